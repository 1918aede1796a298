#!/usr/bin/env python3
"""Makes scenes.jpg, the contact sheet of scenes as people made them, and prints what each cost.

usage: notes/pictures/scenes.py REBOUNCE SCENES WORK [SCENE...]

REBOUNCE is the program, SCENES the folder with the .glb files, WORK a folder for transfer files and
pictures; a transfer file or picture that is there already is taken as it is. With scenes named (by
their numbers) only those are made, and no sheet.
"""

import pathlib
import resource
import subprocess
import sys

from PIL import Image

PATCHES, SIZE, TILE, MARGIN, COLUMNS = 4096, (1280, 720), (480, 270), 3, 3


def names_of(scenes):
    return sorted(path.stem for path in scenes.glob("*.glb"))


def user_seconds(command):
    """Runs a command; returns the processor time that it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([str(part) for part in command], check=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def make_picture(program, scenes, work, name):
    transfer, picture = work / f"{name}.safetensors", work / f"{name}.png"
    if not transfer.exists():
        seconds = user_seconds(
            [program, "precompute", scenes / f"{name}.glb", "-o", transfer,
             "--patches", PATCHES, "--quiet"])
        print(f"{name}: precompute {seconds:.0f} user s", flush=True)
    if not picture.exists():
        seconds = user_seconds(
            [program, "render", transfer, "--key-light", "--size", "{}x{}".format(*SIZE),
             "-o", picture])
        print(f"{name}: render {seconds:.0f} user s", flush=True)
    return picture


def make_sheet(pictures, path):
    rows = -(-len(pictures) // COLUMNS)
    width, height = TILE[0] + 2 * MARGIN, TILE[1] + 2 * MARGIN
    sheet = Image.new("RGB", (COLUMNS * width, rows * height), "white")
    for k, picture in enumerate(pictures):
        tile = Image.open(picture).convert("RGB").resize(TILE, Image.LANCZOS)
        row, column = divmod(k, COLUMNS)
        sheet.paste(tile, (column * width + MARGIN, row * height + MARGIN))
    sheet.save(path, quality=85)


def main():
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    program, scenes, work = (pathlib.Path(path).resolve() for path in sys.argv[1:4])
    work.mkdir(parents=True, exist_ok=True)
    wanted = sys.argv[4:]
    names = [n for n in names_of(scenes) if not wanted or n.split("_")[0] in wanted]
    pictures = [make_picture(program, scenes, work, name) for name in names]
    if not wanted:
        make_sheet(pictures, pathlib.Path(__file__).with_name("scenes.jpg"))


if __name__ == "__main__":
    main()
