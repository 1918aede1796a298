"""Light in buildings: weather files, skies of every hour, a year of illuminances.

Weather files have z up and north along y; here, as everywhere in the package, up is +y, east +x and
north -z. All surfaces are diffuse.
"""

import dataclasses
import math
import os
from typing import List, Sequence, Tuple, Union

import numpy as np
import numpy.typing as npt

from ._progress import Progress, reporting
from .frame import Engine, Light, Sky, sky_cell_directions
from .sensors import Sensors, read_points, y_up
from .transfer import TransferData

__all__ = [
    "Weather",
    "Year",
    "daylight_autonomy",
    "perez_sky",
    "read_points",
    "read_weather",
    "simulate_year",
    "sun_position",
    "useful_daylight",
    "write_illuminance",
    "y_up",
]

Path = Union[str, "os.PathLike[str]"]
Doubles = npt.NDArray[np.float64]
Floats = npt.NDArray[np.float32]

# R. Perez, R. Seals, J. Michalsky, "All-weather model for sky luminance distribution: preliminary
# configuration and validation", Solar Energy 50(3), 1993, table 1: a1 to a4, b1 to b4 ... e4 for each
# bin of clearness.
_CLEARNESS_BINS = np.array([1.065, 1.23, 1.5, 1.95, 2.8, 4.5, 6.2])
_COEFFICIENTS = np.array([
    [1.3525, -0.2576, -0.2690, -1.4366, -0.7670, 0.0007, 1.2734, -0.1233, 2.8000, 0.6004, 1.2375,
     1.0000, 1.8734, 0.6297, 0.9738, 0.2809, 0.0356, -0.1246, -0.5718, 0.9938],
    [-1.2219, -0.7730, 1.4148, 1.1016, -0.2054, 0.0367, -3.9128, 0.9156, 6.9750, 0.1774, 6.4477,
     -0.1239, -1.5798, -0.5081, -1.7812, 0.1080, 0.2624, 0.0672, -0.2190, -0.4285],
    [-1.1000, -0.2515, 0.8952, 0.0156, 0.2782, -0.1812, -4.5000, 1.1766, 24.7219, -13.0812, -37.7000,
     34.8438, -5.0000, 1.5218, 3.9229, -2.6204, -0.0156, 0.1597, 0.4199, -0.5562],
    [-0.5484, -0.6654, -0.2672, 0.7117, 0.7234, -0.6219, -5.6812, 2.6297, 33.3389, -18.3000, -62.2500,
     52.0781, -3.5000, 0.0016, 1.1477, 0.1062, 0.4659, -0.3296, -0.0876, -0.0329],
    [-0.6000, -0.3566, -2.5000, 2.3250, 0.2937, 0.0496, -5.6812, 1.8415, 21.0000, -4.7656, -21.5906,
     7.2492, -3.5000, -0.1554, 1.4062, 0.3988, 0.0032, 0.0766, -0.0656, -0.1294],
    [-1.0156, -0.3670, 1.0078, 1.4051, 0.2875, -0.5328, -3.8500, 3.3750, 14.0000, -0.9999, -7.1406,
     7.5469, -3.4000, -0.1078, -1.0750, 1.5702, -0.0672, 0.4016, 0.3017, -0.4844],
    [-1.0000, 0.0211, 0.5025, -0.5119, -0.3000, 0.1922, 0.7023, -1.6317, 19.0000, -5.0000, 1.2438,
     -1.9094, -4.0000, 0.0250, 0.3844, 0.2656, 1.0468, -0.3788, -2.4517, 1.4656],
    [-1.0500, 0.0289, 0.4260, 0.3590, -0.3250, 0.1156, 0.7781, 0.0025, 31.0625, -14.5000, -46.1148,
     55.3750, -7.2312, 0.4050, 13.3500, 0.6234, 1.5000, -0.6426, 1.8564, 0.5636],
])  # fmt: skip

# R. Perez, P. Ineichen, R. Seals, J. Michalsky, R. Stewart, "Modeling daylight availability and
# irradiance components from direct and global irradiance", Solar Energy 44(5), 1990, table 4: lumens
# per watt of diffuse and of direct light, by the same bins.
_DIFFUSE_EFFICACY = np.array([
    [97.24, -0.46, 12.00, -8.91], [107.22, 1.15, 0.59, -3.95], [104.97, 2.96, -5.53, -8.77],
    [102.39, 5.59, -13.95, -13.90], [100.71, 5.94, -22.75, -23.74], [106.42, 3.83, -36.15, -28.83],
    [141.88, 1.90, -53.24, -14.03], [152.23, 0.35, -45.27, -7.98],
])  # fmt: skip
_DIRECT_EFFICACY = np.array([
    [57.20, -4.55, -2.98, 117.12], [98.99, -3.46, -1.21, 12.38], [109.83, -4.90, -1.71, -8.81],
    [110.34, -5.84, -1.99, -4.56], [106.36, -3.97, -1.75, -6.16], [107.19, -1.25, -1.51, -26.73],
    [105.75, 0.77, -1.26, -34.44], [101.18, 1.58, -1.10, -8.29],
])  # fmt: skip

_SOLAR_CONSTANT = 1367.0  # W/m²
_WATER = math.exp(0.07 * 11 - 0.075)  # cm of precipitable water at a dew point of 11 °C
_LOWEST_SUN = math.radians(1)  # below, formulas of air mass and clearness have no meaning


@dataclasses.dataclass
class Weather:
    """Hours of a weather file, in its order."""

    place: str
    latitude: float  #: degrees, north positive
    longitude: float  #: degrees, east positive
    time_zone: float  #: hours ahead of UTC
    day_of_year: npt.NDArray[np.int64]  #: [h] 1 to 365
    hour: Doubles  #: [h] standard time at the middle of the hour
    direct_normal: Doubles  #: [h] W/m²
    diffuse_horizontal: Doubles  #: [h] W/m²

    def __len__(self) -> int:
        return len(self.hour)


_DAYS_BEFORE = np.cumsum([0, 31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30])
_MISSING = 9999.0  # W/m²; .epw files have this or more where there is no value


def _hour(cells: Sequence[str]) -> Sequence[float]:
    """Month, day, hour, direct and diffuse irradiance, 0 if missing, out of the five cells of a line."""
    numbers = [float(cell) for cell in cells]
    if len(numbers) != 5:
        raise ValueError("too few columns")
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError("a number is not finite")
    if numbers[0] not in range(1, 13):
        raise ValueError(f"there is no month {cells[0]}")
    return numbers[:3] + [0.0 if irradiance >= _MISSING else irradiance for irradiance in numbers[3:]]


def _weather(place: str, where: Tuple[float, float, float], rows: Sequence[Sequence[float]]) -> Weather:
    table = np.array(rows, float).reshape(-1, 5)
    day = _DAYS_BEFORE[table[:, 0].astype(int) - 1] + table[:, 1].astype(int)
    return Weather(place, *where, day, table[:, 2], np.maximum(table[:, 3], 0), np.maximum(table[:, 4], 0))


def read_weather(path: Path) -> Weather:
    """Reads an .epw file, or a .wea file of weather_data_file_units 1.

    An irradiance of 9999 W/m² or more is a missing value, and taken as 0. Raises ValueError, with file
    and line, if it is no such file.
    """
    name = os.fspath(path)
    with open(path, encoding="utf-8", errors="replace") as file:
        lines = file.read().splitlines()
    number = 0
    try:
        rows: List[Sequence[float]] = []
        if lines and lines[0].startswith("LOCATION"):
            head = lines[0].split(",")
            place, where = head[1], (float(head[6]), float(head[7]), float(head[8]))
            number = 8
            periods = lines[7].split(",") if len(lines) > 7 else [""]
            if periods[0] == "DATA PERIODS" and int(periods[2]) != 1:
                raise ValueError("only files with one record an hour are read")
            for number, line in enumerate(lines[8:], 9):
                if not line.strip():
                    continue
                cells = line.split(",")
                month, day, hour, direct, diffuse = _hour(cells[1:4] + cells[14:16])
                # Hour k is the hour that ends at k o'clock.
                rows.append([month, day, hour - 0.5, direct, diffuse])
        elif lines and lines[0].startswith("place"):
            head_of = dict(line.split(None, 1) for line in lines[:6])
            place = head_of["place"]
            # Its longitude and time zone count westwards.
            where = (float(head_of["latitude"]), -float(head_of["longitude"]),
                     -float(head_of["time_zone"]) / 15)  # fmt: skip
            number = 6
            if head_of.get("weather_data_file_units", "").strip() != "1":
                raise ValueError("weather_data_file_units must be 1: direct normal and diffuse horizontal")
            for number, line in enumerate(lines[6:], 7):
                if line.strip():
                    rows.append(_hour(line.split()[:5]))
        else:
            raise ValueError("it begins neither with LOCATION, as .epw files do, nor with place, as .wea files do")
    except (IndexError, KeyError, ValueError) as error:
        raise ValueError(f"{name}, line {max(number, 1)}: {error}") from None
    if not rows:
        raise ValueError(f"{name} has no hours after its head")
    return _weather(place, where, rows)


def sun_position(weather: Weather) -> Floats:
    """[h, 3] unit vectors to the sun, y up; to 0.3 degrees.

    J. W. Spencer, "Fourier series representation of the position of the sun", Search 2(5), 1971.
    """
    angle = 2 * np.pi * (weather.day_of_year - 1 + (weather.hour - 12) / 24) / 365
    declination = (
        0.006918 - 0.399912 * np.cos(angle) + 0.070257 * np.sin(angle)
        - 0.006758 * np.cos(2 * angle) + 0.000907 * np.sin(2 * angle)
        - 0.002697 * np.cos(3 * angle) + 0.00148 * np.sin(3 * angle)
    )  # fmt: skip
    equation_of_time = 229.18 / 60 * (
        0.000075 + 0.001868 * np.cos(angle) - 0.032077 * np.sin(angle)
        - 0.014615 * np.cos(2 * angle) - 0.040849 * np.sin(2 * angle)
    )  # fmt: skip
    solar_time = weather.hour + equation_of_time + weather.longitude / 15 - weather.time_zone
    turn = np.radians(15 * (solar_time - 12))
    latitude = math.radians(weather.latitude)
    up = math.sin(latitude) * np.sin(declination) + math.cos(latitude) * np.cos(declination) * np.cos(turn)
    east = -np.cos(declination) * np.sin(turn)
    north = math.cos(latitude) * np.sin(declination) - math.sin(latitude) * np.cos(declination) * np.cos(turn)
    return np.asarray(np.stack([east, up, -north], axis=1), dtype=np.float32)


def perez_sky(
    to_sun: npt.ArrayLike,
    direct_normal: npt.ArrayLike,
    diffuse_horizontal: npt.ArrayLike,
    day_of_year: npt.ArrayLike = 80,
    ground_reflectance: float = 0.2,
) -> Tuple[Floats, Doubles]:
    """The all-weather sky of Perez in the 146 cells that transfer files have.

    to_sun: [h, 3] unit vectors, y up. Irradiances [h] in W/m², at least 0. day_of_year: 1 to 365, a
    number or [h], for the distance of the sun. ground_reflectance: in [0, 1].
    Returns the mean luminance of the cells, [h, 146] in cd/m² (cell 0: ground of this reflectance
    under sun and sky), and the illuminance of the sun on a surface that faces it, [h] in lx. Hours
    with the sun less than a degree above the horizon, or without diffuse irradiance, are dark.
    Raises ValueError if the shapes do not fit each other, or a number is out of range.

    >>> cells, sun = perez_sky([[0, 1, 0]], [0.0], [100.0])
    >>> cells.shape, float(sun[0])
    ((1, 146), 0.0)
    """
    sun = np.atleast_2d(np.asarray(to_sun, float))
    beam = np.atleast_1d(np.asarray(direct_normal, float))
    diffuse = np.atleast_1d(np.asarray(diffuse_horizontal, float))
    if sun.shape != (len(beam), 3) or diffuse.shape != beam.shape:
        raise ValueError(
            f"to_sun, direct_normal and diffuse_horizontal have the shapes {list(sun.shape)}, "
            f"{list(beam.shape)} and {list(diffuse.shape)}, and need [h, 3], [h] and [h]"
        )
    if not 0 <= ground_reflectance <= 1:
        raise ValueError(f"ground_reflectance is {ground_reflectance}; it must be in [0, 1]")
    if not (np.all(beam >= 0) and np.all(diffuse >= 0)):
        raise ValueError("direct_normal and diffuse_horizontal must be at least 0")
    altitude = np.arcsin(np.clip(sun[:, 1], -1, 1))
    lit = (altitude > _LOWEST_SUN) & (diffuse > 0)
    zenith = np.pi / 2 - np.maximum(altitude, _LOWEST_SUN)
    with np.errstate(divide="ignore", invalid="ignore"):
        # F. Kasten, "A new table and approximation formula for the relative optical air mass", 1965.
        air_mass = 1 / (np.cos(zenith) + 0.15 * (93.885 - np.degrees(zenith)) ** -1.253)
        extraterrestrial = _SOLAR_CONSTANT * (
            1 + 0.033 * np.cos(2 * np.pi * np.broadcast_to(day_of_year, beam.shape) / 365)
        )
        brightness = np.clip(air_mass * diffuse / extraterrestrial, 0.01, 0.6)
        clearness = np.where(
            lit, ((diffuse + beam) / np.where(lit, diffuse, 1) + 1.041 * zenith**3) / (1 + 1.041 * zenith**3), 1.0
        )
    bin_of = np.searchsorted(_CLEARNESS_BINS, np.clip(clearness, 1, 12), side="right")
    # Between, the fit of the luminances does not reach to darker skies.
    fitted = np.where((bin_of >= 1) & (bin_of <= 4), np.maximum(brightness, 0.2), brightness)
    sky_of, sun_of = _DIFFUSE_EFFICACY[bin_of], _DIRECT_EFFICACY[bin_of]
    diffuse_lux = diffuse * (
        sky_of[:, 0] + sky_of[:, 1] * _WATER + sky_of[:, 2] * np.cos(zenith) + sky_of[:, 3] * np.log(brightness)
    )
    sun_lux = beam * np.maximum(
        0,
        sun_of[:, 0] + sun_of[:, 1] * _WATER + sun_of[:, 2] * np.exp(5.73 * zenith - 5) + sun_of[:, 3] * brightness,
    )
    diffuse_lux, sun_lux = np.where(lit, diffuse_lux, 0), np.where(lit, sun_lux, 0)

    x = _COEFFICIENTS[bin_of].reshape(-1, 5, 4)
    a, b, c, d, e = (
        x[:, :, 0] + x[:, :, 1] * zenith[:, None] + fitted[:, None] * (x[:, :, 2] + x[:, :, 3] * zenith[:, None])
    ).T
    turbid = bin_of == 0  # the first bin has forms of its own for c and d
    c1, d1 = x[:, 2], x[:, 3]
    c = np.where(turbid, np.exp((np.maximum(fitted * (c1[:, 0] + c1[:, 1] * zenith), 0)) ** c1[:, 2]) - c1[:, 3], c)
    d = np.where(
        turbid,
        -np.exp(fitted * (d1[:, 0] + d1[:, 1] * zenith)) + d1[:, 2] + fitted * d1[:, 3],
        d,
    )
    directions, cells = sky_cell_directions()
    height = np.maximum(directions[:, 1].astype(float), 0.01)
    cosine = np.clip(sun @ directions.T, -1, 1)
    gamma = np.arccos(cosine)
    relative = (1 + a[:, None] * np.exp(b[:, None] / height)) * (
        1 + c[:, None] * np.exp(d[:, None] * gamma) + e[:, None] * cosine**2
    )
    per_cell = directions.shape[0] // 145
    mean = np.maximum(relative, 0).reshape(len(beam), 145, per_cell).mean(axis=2)
    solid_angle, mean_height = _cell_geometry()
    horizontal = mean @ (solid_angle * mean_height)
    luminance = mean * np.where(horizontal > 0, diffuse_lux / np.where(horizontal > 0, horizontal, 1), 0)[:, None]
    ground = ground_reflectance / np.pi * (diffuse_lux + sun_lux * np.maximum(sun[:, 1], 0))
    return np.column_stack([ground, luminance]).astype(np.float32), sun_lux


def _cell_geometry() -> Tuple[Doubles, Doubles]:
    """Solid angle [145] of the cells above the horizon, and the mean of the sine of the altitude."""
    from . import _core

    solid_angle = np.array([_core.sky_cell_solid_angle(cell) for cell in range(1, 146)])
    directions, _ = sky_cell_directions()
    return solid_angle, directions[:, 1].reshape(145, -1).mean(axis=1).astype(float)


@dataclasses.dataclass
class Year:
    """Illuminances of a year."""

    illuminance: Floats  #: [m, h] lx of sun and sky by sensor and hour, of hours with sun
    hours: npt.NDArray[np.int64]  #: [h] their numbers in the weather file, from 0
    lamps: Floats  #: [m] lx of the lamps, and of what emits in the scene


_LUMINOUS = np.array([0.2126, 0.7152, 0.0722], np.float32)  # Rec.709


def simulate_year(
    data: TransferData,
    sensors: Sensors,
    weather: Weather,
    lamps: Sequence[Light] = (),
    ground_reflectance: float = 0.2,
    points_per_patch: int = 8,
    batch: int = 256,
    progress: Progress = None,
) -> Year:
    """The illuminance of every sensor in every hour with sun.

    Each hour is a frame: the sun is traced, sun and sky go through the operator. The light of
    patches goes to the sensors `batch` hours at a time. Lamps, and surfaces that emit, are evaluated
    once, beside: they are dark in the hours.
    ground_reflectance: in [0, 1], of the ground below the horizon. points_per_patch: as of Engine.
    progress: see precompute. Raises ValueError if ground_reflectance is out of range, Error if the
    data have no sky cells, because the scene is closed, or a lamp is out of range.
    """
    to_sun = sun_position(weather)
    cells, sun_lux = perez_sky(
        to_sun, weather.direct_normal, weather.diffuse_horizontal, weather.day_of_year, ground_reflectance
    )
    hours = np.flatnonzero(cells[:, 1:].any(axis=1))
    engine = Engine(data, points_per_patch=points_per_patch)
    engine.relight(lamps)
    of_lamps = sensors.illuminance(engine, lamps) @ _LUMINOUS
    for material in range(len(data.record["materials"])):
        engine.set_emission_scale(material, 0.0)
    result = np.empty((len(sensors), len(hours)), np.float32)
    with reporting(progress) as report:
        for begin in range(0, len(hours), batch):
            if report is not None:
                report("hours", begin / len(hours))
            part = hours[begin : begin + batch]
            radiosity = np.empty((data.patch_count, len(part)), np.float32)
            arriving = np.zeros((len(sensors), len(part)), np.float32)
            for k, hour in enumerate(part):
                sun = [Light("directional", direction=-to_sun[hour], intensity=float(sun_lux[hour]))]
                engine.relight(sun, Sky(1.0, distribution=cells[hour]))
                radiosity[:, k] = engine.radiosity @ _LUMINOUS
                arriving[:, k] = sensors.direct(sun)[:, 1]
            result[:, begin : begin + len(part)] = (
                sensors.patches @ radiosity + np.pi * (sensors.sky_cells @ cells[part].T) + arriving
            )
    return Year(result, hours, of_lamps.astype(np.float32))


def daylight_autonomy(
    year: Year, weather: Weather, threshold: float = 300.0, occupied: Tuple[float, float] = (8.0, 18.0)
) -> Doubles:
    """[m] part of the occupied hours of all days in which a sensor has at least `threshold` lx.

    occupied: from and to, hours of standard time. Raises ValueError if no hour is in between.
    """
    counted, total = _occupied(year, weather, occupied)
    return np.asarray((year.illuminance[:, counted] >= threshold).sum(axis=1) / total)


def useful_daylight(
    year: Year,
    weather: Weather,
    low: float = 100.0,
    high: float = 3000.0,
    occupied: Tuple[float, float] = (8.0, 18.0),
) -> Doubles:
    """[m] useful daylight illuminance: part of the occupied hours between `low` and `high` lx.

    occupied: as of daylight_autonomy.
    """
    counted, total = _occupied(year, weather, occupied)
    light = year.illuminance[:, counted]
    return np.asarray(((light >= low) & (light <= high)).sum(axis=1) / total)


def _occupied(
    year: Year, weather: Weather, occupied: Tuple[float, float]
) -> Tuple[npt.NDArray[np.bool_], int]:
    within = (weather.hour >= occupied[0]) & (weather.hour <= occupied[1])
    if not within.any():
        raise ValueError(f"no hour is between {occupied[0]:g} and {occupied[1]:g}")
    return within[year.hours], int(within.sum())


def write_illuminance(path: Path, year: Year) -> None:
    """Writes [m, h] to a .npy file, or as text to an .ill file: a line for each sensor."""
    if os.fspath(path).endswith(".npy"):
        np.save(path, year.illuminance)
    else:
        np.savetxt(path, year.illuminance, fmt="%.6g")
