"""Engines, lamps, skies, solutions, sensors."""

import json

import numpy as np
import pytest

import rebounce
from conftest import ROOT, SCENE

LAMP = rebounce.Light(position=(1.0, 1.6, 1.1), intensity=50)


def test_engine_gives_what_the_operator_says(small_room):
    engine = rebounce.Engine(small_room)
    engine.relight([LAMP])
    M0, H = engine.initial_exitance, engine.indirect_irradiance
    assert np.allclose(M0, small_room.reflectance * engine.direct_irradiance, rtol=1e-5)
    product = (small_room.transfer @ M0.T.ravel()).reshape(3, -1).T
    assert np.allclose(product, H, rtol=1e-4)
    assert np.allclose(engine.radiosity, M0 + small_room.reflectance * H, rtol=1e-5)
    # What the lamp gives is 4 pi candela of lumen, and all of it arrives somewhere.
    flux = small_room.area @ engine.direct_irradiance
    assert flux == pytest.approx(4 * np.pi * 50, rel=0.02)


def test_the_error_of_a_frame_is_known(small_room, cornell):
    engine = rebounce.Engine(small_room)  # a dense operator, exact up to rounding
    engine.relight([LAMP])
    error, bound = engine.estimate_error()
    assert 0 <= error <= bound < 1e-4
    engine = rebounce.Engine(cornell)
    engine.relight([LAMP])
    error, bound = engine.estimate_error()
    assert 1e-5 < error <= bound < 0.1


def test_the_error_of_a_frame_needs_form_factors():
    data = rebounce.precompute(SCENE, patches=100, quality="low", progress=False)
    engine = rebounce.Engine(data)
    engine.relight([LAMP])
    with pytest.raises(rebounce.Error, match="form factors"):
        engine.estimate_error()


def test_results_are_views_of_the_last_frame(small_room):
    engine = rebounce.Engine(small_room)
    engine.relight([LAMP])
    light = engine.radiosity
    kept = light.copy()
    assert not light.flags.writeable and light.base is not None
    engine.relight([LAMP, LAMP])
    assert np.allclose(light, 2 * kept, rtol=1e-4)
    engine.relight_by_direct(np.ones((small_room.patch_count, 3)))
    assert np.allclose(engine.direct_irradiance, 1)


def test_wrong_lights_are_refused(small_room):
    engine = rebounce.Engine(small_room)
    with pytest.raises(ValueError, match=r"light 0: position must be three numbers, not \(0, 0\)"):
        engine.relight([rebounce.Light(position=(0, 0))])
    with pytest.raises(ValueError, match='light 1: type must be one of point, .*, not "candle"'):
        engine.relight([LAMP, rebounce.Light(type="candle")])
    with pytest.raises(ValueError, match="light 0: profile must be .* load_profile"):
        engine.relight([rebounce.Light(profile="lamp.ies")])
    with pytest.raises(ValueError, match="color must be three numbers"):
        engine.relight([LAMP], rebounce.Sky(1.0, color=1.0))
    with pytest.raises(rebounce.Error, match="light 1"):
        engine.relight([LAMP, rebounce.Light(intensity=-1)])
    with pytest.raises(ValueError, match="needs"):
        engine.relight_by_direct(np.ones((3, 3)))


@pytest.mark.parametrize(
    "method",
    ["transfer", "gathering", "jacobi", "gauss-seidel", "symmetric-gauss-seidel",
     "conjugate-gradient", "refine", "hierarchical"],
)  # fmt: skip
def test_solve_by_every_method(cornell, method):
    engine = rebounce.Engine(cornell)
    engine.relight([rebounce.Light(position=(0, 1, 0), intensity=80)])
    solution = rebounce.solve(cornell, engine.initial_exitance, method)
    apart = np.linalg.norm(solution.radiosity - engine.radiosity) / np.linalg.norm(engine.radiosity)
    assert apart < 0.02
    with pytest.raises(ValueError, match="initial_exitance"):
        rebounce.solve(cornell, np.ones(3), method)
    with pytest.raises(ValueError, match="method must be one of"):
        rebounce.solve(cornell, engine.initial_exitance, "magic")
    for wrong in (np.nan, -1, np.inf):
        with pytest.raises(rebounce.Error, match="not finite"):
            rebounce.solve(cornell, np.full((cornell.patch_count, 3), wrong), method)


def test_lights_of_a_file():
    lights, sky = rebounce.load_lights(ROOT / "tests/scenes/ceiling_point.lights.json")
    assert lights and lights[0].type == "point"
    assert sky.luminance >= 0


# A luminaire that shines within 60 degrees of its axis.
IES = """IESNA:LM-63-2002
TILT=NONE
1 -1 1 3 1 1 2 0 0 0
1 1 10
0 59 60
0
100 100 0
"""


def test_profiles_and_skies_of_a_light_file(tmp_path):
    (tmp_path / "lamp.ies").write_text(IES)
    path = tmp_path / "lights.json"
    path.write_text(
        '{"lights": [{"position": [1, 1.6, 1.1], "ies": "lamp.ies", "intensity": 0.5}],'
        ' "emitters": [{"material": "screen", "scale": 0.5, "color": [0.6, 0.8, 1]}],'
        ' "sky": {"luminance": 3000, "cie": 12, "sunDirection": [1, -2, 0]}}'
    )
    lights, sky = rebounce.load_lights(path)
    profile = lights[0].profile
    assert profile.intensity(0.5) == pytest.approx(100) and profile.intensity(1.2) == 0
    assert profile.vertical == pytest.approx(np.radians([0, 59, 60]))
    assert rebounce.load_profile(tmp_path / "lamp.ies").intensity(0.5) == pytest.approx(100)
    assert sky.luminance == 3000
    assert np.allclose(sky.distribution, rebounce.cie_sky(12, (1, -2, 0)), rtol=1e-5)
    assert rebounce.load_emitters(path)["screen"] == pytest.approx([0.3, 0.4, 0.5])
    path.write_text('{"lights": [{"ies": "none.ies"}]}')
    with pytest.raises(rebounce.Error, match="light 0.*none.ies"):
        rebounce.load_lights(path)
    path.write_text('{"lights": [{"colour": [1, 1, 1]}]}')
    with pytest.raises(rebounce.Error, match="colour"):
        rebounce.load_lights(path)
    with pytest.raises(ValueError, match="scale is 0"):
        rebounce.load_lights(path, scale=0)


def test_the_scale_of_a_scene_holds_for_its_lamps(tmp_path):
    scene = json.loads((ROOT / "tests/scenes/cornell_box.gltf").read_text())
    light = {"type": "point", "intensity": 5.0}
    scene["extensions"] = {"KHR_lights_punctual": {"lights": [light]}}
    scene["extensionsUsed"] = [*scene.get("extensionsUsed", []), "KHR_lights_punctual"]
    scene["nodes"].append({"translation": [0.2, 0.3, 0.2], "extensions": {"KHR_lights_punctual": {"light": 0}}})
    scene["scenes"][scene.get("scene", 0)]["nodes"].append(len(scene["nodes"]) - 1)
    path = tmp_path / "lamp.gltf"
    path.write_text(json.dumps(scene))
    read = rebounce.load_scene(path, scale=2.0)
    assert rebounce.load_lights(path, scale=2.0)[0][0].position == pytest.approx(read.lights[0].position)
    assert rebounce.load_lights(path)[0][0].position == pytest.approx([0.2, 0.3, 0.2])
    data = rebounce.precompute(read, patches=60, quality="low")
    assert data.record["settings"]["scale"] == 2.0


def test_profiles_shine_as_spots_do(small_room, tmp_path):
    (tmp_path / "lamp.ies").write_text(IES)
    profile = rebounce.load_profile(tmp_path / "lamp.ies")
    engine = rebounce.Engine(small_room)
    place = {"position": (1.0, 1.6, 1.1), "direction": (0, -1, 0)}
    engine.relight([rebounce.Light(profile=profile, intensity=0.5, **place)])
    by_profile = engine.direct_irradiance.copy()
    cone = {"inner_cone_angle": np.radians(59), "outer_cone_angle": np.radians(60)}
    engine.relight([rebounce.Light("spot", intensity=50, **cone, **place)])
    # From 59 to 60 degrees a spot fades in another way than numbers between two of a profile.
    assert np.allclose(by_profile, engine.direct_irradiance, atol=0.1 * by_profile.max())
    assert np.median(abs(by_profile - engine.direct_irradiance)) < 1e-3 * by_profile.max()


def test_emission_by_the_name_of_a_material(cornell):
    engine = rebounce.Engine(cornell)
    names = cornell.record["materials"]
    shining = names[cornell.mesh["triangle_material"][
        np.argmax(cornell.emitted_exitance[
            np.minimum(cornell.mesh["triangle_patch"], cornell.patch_count - 1), 0])]]
    engine.relight([])
    before = engine.initial_exitance.copy()
    engine.set_emission_scale(shining, 0.5)
    engine.relight([])
    assert before.max() > 0 and np.allclose(engine.initial_exitance, 0.5 * before, rtol=1e-5)
    with pytest.raises(ValueError, match="no material"):
        engine.set_emission_scale("nothing", 1)
    for number in (-1, len(names)):
        with pytest.raises(rebounce.Error, match="no material"):
            engine.set_emission_scale(number, 1)


def open_box():
    from conftest import box, triangles_of

    vertices, faces = box(high=(2, 2, 2))
    top = np.all(vertices[faces][:, :, 1] == 2, axis=1)
    scene = rebounce.Scene(vertices, triangles_of(faces[~top]), reflectance=0.0)
    return rebounce.precompute(scene, patches=100, quality="low", progress=False)


def test_sensors_see_sky_and_lamps():
    data = open_box()
    positions, normals = [[1, 0.001, 1], [1, 0.5, 1]], [[0, 2, 0], [0, -1, 0]]
    sensors = rebounce.Sensors(data, positions, normals, rays=20000)
    engine = rebounce.Engine(data)
    sky = rebounce.Sky(luminance=100)
    engine.relight([], sky)
    light = sensors.illuminance(engine, [], sky)
    # From the middle of the floor the opening of 2 m is four rectangles of 1 m at a distance of 2:
    # 4 / (2 pi) (A / sqrt(1 + A²) atan(B / sqrt(1 + A²)) twice), A = B = 1 / 2.
    a = 0.5 / np.sqrt(1.25)
    seen = 4 / (2 * np.pi) * 2 * a * np.arctan(0.5 / np.sqrt(1.25))
    assert light[0] == pytest.approx(np.pi * 100 * seen, rel=0.01)
    assert np.allclose(light[1], 0)  # walls are black
    lamp = rebounce.Light(position=(1, 1.501, 1), intensity=90)
    assert sensors.direct([lamp])[0] == pytest.approx(40, rel=1e-3)
    assert np.allclose(sensors.direct([lamp])[1], 0)
    with pytest.raises(ValueError, match="normals"):
        rebounce.Sensors(data, positions, normals[:1])
    for bad in (np.nan, np.inf):
        with pytest.raises(ValueError, match="not finite"):
            rebounce.Sensors(data, [[1, bad, 1], [1, 1, 1]], normals)
        with pytest.raises(ValueError, match="not finite"):
            rebounce.Sensors(data, positions, [[0, bad, 0], [0, 1, 0]])
    for rays in (0, 2**21):
        with pytest.raises(ValueError, match="rays"):
            rebounce.Sensors(data, positions, normals, rays=rays)


@pytest.mark.parametrize("kind", [1, 5, 12])
def test_cie_skies_give_what_their_luminances_integrate_to(kind):
    """A sensor in the open under a CIE sky: its illuminance is the integral of L cos."""
    vertices = [[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]]
    scene = rebounce.Scene(vertices, [[0, 2, 1], [0, 3, 2]], reflectance=0.2)
    data = rebounce.precompute(scene, patches=8, quality="low", progress=False)
    sun = -np.array([0.5, 0.7, 0.2])
    cells = rebounce.cie_sky(kind, sun)
    sensors = rebounce.Sensors(data, [[0, 1, 0]], [[0, 1, 0]], rays=50000)
    engine = rebounce.Engine(data)
    sky = rebounce.Sky(1000, distribution=cells)
    engine.relight([], sky)
    directions, of = rebounce.sky_cell_directions(4)
    from rebounce import _core

    solid_angle = np.array([_core.sky_cell_solid_angle(int(c)) for c in of]) / 16
    expected = 1000 * np.sum(cells[of] * directions[:, 1] * solid_angle)
    assert sensors.illuminance(engine, [], sky)[0] == pytest.approx(expected, rel=0.01)
    if kind == 1:  # overcast: 7 pi / 9 of the zenith's luminance (Moon and Spencer)
        assert expected == pytest.approx(1000 * 7 * np.pi / 9, rel=0.02)
    if kind == 5:
        assert expected == pytest.approx(1000 * np.pi, rel=0.01)
