"""Light in buildings: a year of sun and sky in a room with a window, and one layout of lamps.

Makes its own room, weather (.wea) and sensors (.pts), so that it runs anywhere; yours go in their
place. Writes year.npy and year.ill.
"""

import pathlib
import sys
import time

import numpy as np

import rebounce
from rebounce import daylight

quick = "--quick" in sys.argv

# A room of 4 x 6 m and 3 m high; its south wall, at z = 6, has a window of 3 x 1.5 m.
w, h, d = 4.0, 3.0, 6.0
quads = [
    [(0, 0, 0), (0, 0, d), (w, 0, d), (w, 0, 0)],  # floor
    [(0, h, 0), (w, h, 0), (w, h, d), (0, h, d)],  # ceiling
    [(0, 0, 0), (w, 0, 0), (w, h, 0), (0, h, 0)],  # north
    [(0, 0, 0), (0, h, 0), (0, h, d), (0, 0, d)],  # west
    [(w, 0, 0), (w, 0, d), (w, h, d), (w, h, 0)],  # east
    [(0, 0, d), (0, 1, d), (w, 1, d), (w, 0, d)],  # south, below the window and around it
    [(0, 2.5, d), (0, h, d), (w, h, d), (w, 2.5, d)],
    [(0, 1, d), (0, 2.5, d), (0.5, 2.5, d), (0.5, 1, d)],
    [(w - 0.5, 1, d), (w - 0.5, 2.5, d), (w, 2.5, d), (w, 1, d)],
]
vertices = np.array(quads).reshape(-1, 3)
first = 4 * np.arange(len(quads))[:, None]
triangles = np.concatenate([first + [0, 1, 2], first + [0, 2, 3]])
reflectance = np.tile([0.2, 0.8, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5], 2)
# Both sides: the sky must not come in through the backs of walls.
room = rebounce.Scene(vertices, triangles, reflectance=reflectance, double_sided=True, name="room")
data = rebounce.precompute(room, patches=200 if quick else 4096, quality="low" if quick else "default")

# Weather: a clear and an overcast day in turn.
wea = pathlib.Path("year.wea")
with wea.open("w") as file:
    print("place Somewhere\nlatitude 52.5\nlongitude -13.4\ntime_zone -15", file=file)
    print("site_elevation 49\nweather_data_file_units 1", file=file)
    for month in range(1, 13):
        for day in range(1, 29, 7 if quick else 1):
            for hour in np.arange(4.5, 21):
                clear = day % 2 == 0
                up = max(0.0, np.sin(np.pi * (hour - 4) / 17))
                print(month, day, hour, 700 * up if clear else 0, (80 if clear else 200) * up, file=file)
weather = daylight.read_weather(wea)

# Sensors on desks, z up as building programs have it.
pts = pathlib.Path("desks.pts")
rows = [(x, -y, 0.8, 0, 0, 1) for y in np.linspace(0.5, 5.5, 5 if quick else 40)
        for x in np.linspace(0.5, 3.5, 3 if quick else 25)]  # fmt: skip
np.savetxt(pts, rows, fmt="%.3f")
sensors = rebounce.Sensors(data, *daylight.read_points(pts))

lamps = [rebounce.Light("point", position=(2, 2.8, z), intensity=250) for z in (1, 3, 5)]
begin = time.process_time()
year = daylight.simulate_year(data, sensors, weather, lamps)
seconds = time.process_time() - begin
print(f"{len(year.hours)} hours, {data.patch_count} patches, {len(sensors)} sensors: {seconds:.1f} s of processor time")
autonomy = daylight.daylight_autonomy(year, weather)
useful = daylight.useful_daylight(year, weather)
for name, k in (("back of the room", 0), ("beside the window", len(sensors) - 1)):
    print(f"{name}: daylight autonomy {100 * autonomy[k]:.0f} %, useful {100 * useful[k]:.0f} %, "
          f"lamps {year.lamps[k]:.0f} lx")  # fmt: skip
daylight.write_illuminance("year.npy", year)
daylight.write_illuminance("year.ill", year)
assert autonomy[-1] > autonomy[0]
