#!/usr/bin/python3
"""One sheet of the default views of scenes, each under a lamp, a sun and a sky, to be looked at.

usage: views_sheet.py REBOUNCE WORK SCENE.glb...

WORK is a folder for transfer files, pictures and sheet.png. Transfer files that are there already
are taken as they are. The sun shines the way the camera looks, and down. A picture says so if no
light gets into the scene. Fails if the view of a scene differs between the lights.
"""

import json
import pathlib
import subprocess
import sys

from PIL import Image, ImageDraw

TILE, LABEL = (384, 240), 14
SKY = {"sky": {"luminance": 3000}}


def sun_along(camera):
    """A sun behind the camera and above it, for an opening is often where one looks in."""
    x, y, z = camera["direction"]
    sun = {"type": "directional", "direction": [x, min(y, 0) - 0.8, z], "intensity": 20000}
    return {"lights": [sun]}


def run(*words):
    """What a command of the program prints with --json."""
    done = subprocess.run([str(word) for word in words] + ["--json"], check=True,
                          capture_output=True, text=True)
    return json.loads(done.stdout)


def make_transfer(program, scene, work):
    transfer = work / f"{scene.stem}.safetensors"
    if not transfer.exists():
        run(program, "precompute", scene, "-o", transfer, "--patches", 400, "--quality", "low",
            "--tolerance", 0.1)
    return transfer


def make_picture(program, transfer, path, lights=None):
    """One picture under `lights`, or by --key-light; what the program says of it."""
    chosen = ["--key-light"]
    if lights:
        light_file = path.with_suffix(".lights.json")
        light_file.write_text(json.dumps(lights))
        chosen = ["--lights", light_file]
    return run(program, "render", transfer, *chosen, "--size", "{}x{}".format(*TILE), "-o", path)


def make_pictures(program, transfer, work):
    """The picture under each light, and what stands above it; all of one camera."""
    path = {name: work / f"{transfer.stem}.{name}.png" for name in ("lamp", "sun", "sky")}
    found = {"lamp": make_picture(program, transfer, path["lamp"])}
    camera = found["lamp"]["camera"]
    found["sun"] = make_picture(program, transfer, path["sun"], sun_along(camera))
    found["sky"] = make_picture(program, transfer, path["sky"], SKY)
    if any(summary["camera"] != camera for summary in found.values()):
        sys.exit(f"{transfer.stem}: the view depends on the lights")
    for name, summary in found.items():
        gets_in = summary["lumens"]["direct"] > 0
        yield path[name], f"{transfer.stem}, {name}" + ("" if gets_in else ": none gets in")


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    program, work, *scenes = (pathlib.Path(path).resolve() for path in sys.argv[1:])
    work.mkdir(parents=True, exist_ok=True)
    height = TILE[1] + LABEL
    sheet = Image.new("RGB", (3 * TILE[0], len(scenes) * height), "white")
    for row, scene in enumerate(scenes):
        transfer = make_transfer(program, scene, work)
        for column, (picture, label) in enumerate(make_pictures(program, transfer, work)):
            left, top = column * TILE[0], row * height
            ImageDraw.Draw(sheet).text((left + 4, top + 1), label, "black")
            sheet.paste(Image.open(picture).convert("RGB"), (left, top + LABEL))
        print(scene.stem, flush=True)
    sheet.save(work / "sheet.png")


if __name__ == "__main__":
    main()
