#!/usr/bin/python3
"""One sheet of the default views of scenes, each under a lamp, a sun and a sky, to be looked at.

usage: views_sheet.py REBOUNCE WORK SCENE.glb...

WORK is a folder for transfer files, pictures and sheet.png. Transfer files that are there already
are taken as they are. Fails if the view of a scene differs between the lights.
"""

import json
import pathlib
import subprocess
import sys

from PIL import Image, ImageDraw

TILE, LABEL = (384, 240), 14
LIGHTS = {
    "lamp": None,  # --key-light
    "sun": {"lights": [{"type": "directional", "direction": [0.4, -1, -0.3], "intensity": 20000}]},
    "sky": {"sky": {"luminance": 3000}},
}


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


def make_pictures(program, transfer, work):
    """The pictures under each light, all of one camera."""
    pictures, cameras = [], []
    for name, lights in LIGHTS.items():
        light_file = work / f"{name}.json"
        light_file.write_text(json.dumps(lights))
        chosen = ["--lights", light_file] if lights else ["--key-light"]
        pictures.append(work / f"{transfer.stem}.{name}.png")
        summary = run(program, "render", transfer, *chosen, "--size", "{}x{}".format(*TILE),
                      "-o", pictures[-1])
        cameras.append(summary["camera"])
    if any(camera != cameras[0] for camera in cameras):
        sys.exit(f"{transfer.stem}: the view depends on the lights: {cameras}")
    return pictures


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    program, work, *scenes = (pathlib.Path(path).resolve() for path in sys.argv[1:])
    work.mkdir(parents=True, exist_ok=True)
    height = TILE[1] + LABEL
    sheet = Image.new("RGB", (len(LIGHTS) * TILE[0], len(scenes) * height), "white")
    for row, scene in enumerate(scenes):
        pictures = make_pictures(program, make_transfer(program, scene, work), work)
        ImageDraw.Draw(sheet).text((4, row * height + 1), scene.stem, "black")
        for column, picture in enumerate(pictures):
            sheet.paste(Image.open(picture).convert("RGB"),
                        (column * TILE[0], row * height + LABEL))
        print(scene.stem, flush=True)
    sheet.save(work / "sheet.png")


if __name__ == "__main__":
    main()
