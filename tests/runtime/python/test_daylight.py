"""Weather, skies and a year."""

import numpy as np
import pytest

import rebounce
from rebounce import daylight

EPW_HEAD = "LOCATION,Somewhere,-,DEU,test,0,52.5,13.4,1.0,49.0\n" + "HEAD\n" * 7


def epw_line(month, day, hour, direct, diffuse):
    cells = ["2020", str(month), str(day), str(hour), "0", "?"] + ["0"] * 29
    cells[14], cells[15] = str(direct), str(diffuse)
    return ",".join(cells) + "\n"


def test_weather_files(tmp_path):
    epw = tmp_path / "a.epw"
    epw.write_text(EPW_HEAD + epw_line(1, 1, 1, 0, 0) + epw_line(6, 21, 13, 700, 120))
    weather = daylight.read_weather(epw)
    assert (weather.latitude, weather.longitude, weather.time_zone) == (52.5, 13.4, 1)
    assert list(weather.day_of_year) == [1, 172] and list(weather.hour) == [0.5, 12.5]
    wea = tmp_path / "a.wea"
    wea_head = (
        "place Somewhere\nlatitude 52.5\nlongitude -13.4\ntime_zone -15\nsite_elevation 49\n"
        "weather_data_file_units 1\n"
    )
    wea.write_text(wea_head + "1 1 0.5 0 0\n6 21 12.5 700 120\n")
    again = daylight.read_weather(wea)
    for name in ("latitude", "longitude", "time_zone"):
        assert getattr(again, name) == getattr(weather, name)
    assert np.array_equal(again.direct_normal, weather.direct_normal)
    wea.write_text("nonsense\n")
    with pytest.raises(ValueError, match="neither"):
        daylight.read_weather(wea)
    epw.write_text(EPW_HEAD + "2020,1,1,x\n")
    with pytest.raises(ValueError, match="line 9"):
        daylight.read_weather(epw)
    epw.write_text(EPW_HEAD[: -len("HEAD\n")] + "DATA PERIODS,1,4,Data,Sunday,1/1,12/31\n" + epw_line(1, 1, 1, 0, 0))
    with pytest.raises(ValueError, match="a.epw, line 8: only files with one record an hour"):
        daylight.read_weather(epw)
    epw.write_text(EPW_HEAD + epw_line(13, 1, 1, 0, 0))
    with pytest.raises(ValueError, match="a.epw, line 9: there is no month 13"):
        daylight.read_weather(epw)
    epw.write_text(EPW_HEAD)
    with pytest.raises(ValueError, match="a.epw has no hours"):
        daylight.read_weather(epw)
    wea.write_text(wea_head + "1 1 0.5 0\n")
    with pytest.raises(ValueError, match="a.wea, line 7: too few columns"):
        daylight.read_weather(wea)
    wea.write_text(wea_head.replace("units 1", "units 2") + "1 1 0.5 0 0\n")
    with pytest.raises(ValueError, match="a.wea, line 6: weather_data_file_units must be 1"):
        daylight.read_weather(wea)
    epw.write_text(EPW_HEAD + epw_line(6, 21, 12, 9999, 99999.0) + epw_line(6, 21, 13, 9998, 120))
    weather = daylight.read_weather(epw)
    assert list(weather.direct_normal) == [0, 9998] and list(weather.diffuse_horizontal) == [0, 120]
    for cell in ("nan", "inf"):
        epw.write_text(EPW_HEAD + epw_line(6, 21, 12, 700, cell))
        with pytest.raises(ValueError, match="a.epw, line 9: a number is not finite"):
            daylight.read_weather(epw)


def noon(day, latitude):
    return daylight.Weather(
        "", latitude, 0.0, 0.0, np.array([day]), np.array([12.0]), np.array([700.0]), np.array([100.0])
    )


def test_sun_at_noon():
    for day, declination in ((172, 23.44), (355, -23.44), (80, 0)):
        to_sun = daylight.sun_position(noon(day, 50.0))[0]
        assert np.linalg.norm(to_sun) == pytest.approx(1, abs=1e-6)
        altitude = np.degrees(np.arcsin(to_sun[1]))
        assert altitude == pytest.approx(90 - 50 + declination, abs=0.6)
        assert to_sun[2] > 0  # in the south
    morning = noon(80, 0.0)
    morning.hour[:] = 8
    assert daylight.sun_position(morning)[0, 0] > 0.5  # in the east


def test_perez_sky_gives_the_diffuse_illuminance():
    """The integral over the cells is the diffuse irradiance times its efficacy."""
    sun = np.array([[0.3, 0.8, 0.52]]) / np.linalg.norm([0.3, 0.8, 0.52])
    solid_angle, height = daylight._cell_geometry()
    assert solid_angle.sum() == pytest.approx(2 * np.pi, rel=1e-4)
    for direct, diffuse, low, high in ((0, 150, 90, 135), (300, 250, 90, 140), (850, 90, 110, 160)):
        cells, sun_lux = daylight.perez_sky(sun, [direct], [diffuse])
        lux = cells[0, 1:] @ (solid_angle * height)
        assert low < lux / diffuse < high
        assert sun_lux[0] == 0 if direct == 0 else 85 < sun_lux[0] / direct < 120
        assert (cells >= 0).all()
    overcast, _ = daylight.perez_sky(sun, [0], [150])
    clear, _ = daylight.perez_sky(sun, [850], [90])
    near_sun = int(rebounce._core.sky_cells(sun.astype(np.float32))[0])
    assert clear[0].argmax() == near_sun
    # Thickly overcast: as the CIE overcast sky brighter above, without a sun.
    assert 1.4 < overcast[0, 145] / overcast[0, 1:31].mean() < 4
    for wrong in (20, -0.1, float("nan")):
        with pytest.raises(ValueError, match="ground_reflectance is"):
            daylight.perez_sky(sun, [0], [150], ground_reflectance=wrong)
    with pytest.raises(ValueError, match="must be at least 0"):
        daylight.perez_sky(sun, [-1], [150])
    night, dark = daylight.perez_sky([[0, -1, 0]], [0], [0])
    assert not night.any() and not dark.any()
    with pytest.raises(ValueError, match="shapes"):
        daylight.perez_sky(sun, [0, 1], [0])


def test_a_year_in_the_open(tmp_path):
    """One sensor on black ground has the horizontal illuminance of sun and sky."""
    vertices = [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]
    scene = rebounce.Scene(vertices, [[0, 2, 1], [0, 3, 2]], reflectance=0.0)
    data = rebounce.precompute(scene, patches=8, quality="low", progress=False)
    points = tmp_path / "a.pts"
    points.write_text("0 0 0.5 0 0 1\n0 0.2 0.5 0 0 -1\n")
    sensors = rebounce.Sensors(data, *daylight.read_points(points), rays=20000)
    hours = np.arange(24) + 0.5
    weather = daylight.Weather(
        "", 40.0, 0.0, 0.0, np.full(24, 172), hours,
        np.where(abs(hours - 12) < 6, 600.0, 0), np.where(abs(hours - 12) < 7, 120.0, 0),
    )  # fmt: skip
    lamp = rebounce.Light(position=(0, 2.5, 0), intensity=400)
    reports, bad = [], rebounce.Light(intensity=float("nan"))
    with pytest.raises(rebounce.Error, match="light 0"):
        daylight.simulate_year(
            data, sensors, weather, [bad], progress=lambda *report: reports.append(report)
        )
    assert not reports
    year = daylight.simulate_year(data, sensors, weather, [lamp], progress=False)
    assert 12 <= len(year.hours) <= 14
    to_sun = daylight.sun_position(weather)[year.hours]
    cells, sun_lux = daylight.perez_sky(
        to_sun, weather.direct_normal[year.hours], weather.diffuse_horizontal[year.hours], 172
    )
    solid_angle, height = daylight._cell_geometry()
    right = cells[:, 1:] @ (solid_angle * height) + sun_lux * to_sun[:, 1]
    assert np.allclose(year.illuminance[0], right, rtol=0.02)
    # It looks down at black ground, and beyond its rim at the ground that the sky is above.
    assert (year.illuminance[1] < 0.2 * right).all()
    assert year.lamps[0] == pytest.approx(100, rel=1e-3)
    assert daylight.daylight_autonomy(year, weather)[0] == pytest.approx(1)
    assert daylight.useful_daylight(year, weather)[0] < 0.3
    assert daylight.daylight_autonomy(year, weather, 1e6)[1] == 0
    for name in ("a.npy", "a.ill"):
        daylight.write_illuminance(tmp_path / name, year)
    assert np.allclose(np.load(tmp_path / "a.npy"), np.loadtxt(tmp_path / "a.ill"), rtol=1e-5)


def test_what_emits_is_of_the_lamps_and_not_of_the_day():
    vertices = [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]
    lid = [[x, 1.0, z] for x, _, z in vertices]
    triangles = [[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7]]
    weather = noon(172, 40.0)
    years = []
    for luminance in (0.0, 1000.0):
        emission = np.repeat([0.0, luminance], 2)
        scene = rebounce.Scene(vertices + lid, triangles, 0.5, emission[:, None])
        data = rebounce.precompute(scene, patches=16, quality="low", progress=False)
        sensors = rebounce.Sensors(data, [[0.0, 0.1, 0.0]], [[0.0, 1.0, 0.0]], rays=2000)
        years.append(daylight.simulate_year(data, sensors, weather, progress=False))
    dark, lit = years
    assert dark.illuminance[0, 0] > 100
    assert np.allclose(lit.illuminance, dark.illuminance, rtol=1e-2)
    assert dark.lamps[0] == 0 and lit.lamps[0] > 100
