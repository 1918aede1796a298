#!/usr/bin/env python3
"""Kills the program at random moments, and runs it where nothing can be written.

Whatever happens: a file under its final name is the older one or the new one, whole; the next run
gives the bytes of a run that was not disturbed, and leaves nothing else behind; where a file cannot
be written the program says so in one line and exits with 1.

A moment is processor time that the run has used, so that it means the same on a machine that does
other things too. Moments are drawn evenly over each stage of a command.

Usage: kills.py PROGRAM WORK [--moments N] [--stages N] [--seed S] [--only COMMAND]
"""

import argparse
import collections
import contextlib
import dataclasses
import json
import os
import pathlib
import random
import resource
import shutil
import signal
import subprocess
import sys
import time

SCENES = pathlib.Path(__file__).resolve().parent.parent / "scenes"
SCENE = SCENES / "white_room.gltf"
LIGHTS = SCENES / "ceiling_point.lights.json"
OLDER = b"an older file"
WRITING = "writing"
WHOLE = "whole run"
MOST_TRIES = 5  # one short run in ten ends before it is killed


@dataclasses.dataclass
class Command:
    """A command that writes `outputs` into a folder of its own, which replaces OUT."""

    name: str
    arguments: list
    outputs: list
    folders: list = dataclasses.field(default_factory=list)
    has_stages: bool = False

    def line(self, program, folder):
        words = [str(word).replace("OUT", str(folder)) for word in self.arguments]
        return [str(program), *words, "--threads", "1"]


def precompute(name, *options, outputs=("room.safetensors",), folders=()):
    arguments = ["precompute", SCENE, "-o", "OUT/room.safetensors", *options]
    return Command(name, arguments, list(outputs), list(folders), has_stages=True)


def commands(transfer):
    from_links = ("--patches", "60", "--form-factors", "links", "--tolerance", "0.05",
                  "--quality", "low")
    return [
        precompute("precompute", "--patches", "40", "--probes", "2,2,2", "--quality", "low",
                   "--surface-harmonics", "16"),
        precompute("precompute from links", *from_links, "--receivers-at", "patches"),
        precompute("precompute with --checkpoint", *from_links, "--checkpoint", "OUT/parts",
                   folders=["parts"]),
        precompute("precompute for pages", "--patches", "40", "--for", "web", "--quality", "low",
                   "--compress-form-factors", "0.01",
                   outputs=["room.safetensors", "room.form_factors.safetensors"]),
        Command("bake", ["bake", transfer, "--lights", LIGHTS, "-o", "OUT/lit.glb"], ["lit.glb"]),
        Command("export", ["export", transfer, "--what", "transfer", "-o", "OUT/transfer.npz"],
                ["transfer.npz"]),
        Command("solve -o", ["solve", transfer, "--lights", LIGHTS, "-o", "OUT/light.npz"],
                ["light.npz"]),
    ]


class Fault(Exception):
    """What must hold does not."""


def require(holds, what):
    if not holds:
        raise Fault(what)


def fresh(folder, with_older):
    """An empty folder, or one with an older file under each final name of `with_older`."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in with_older:
        (folder / name).write_bytes(OLDER)


def names_in(folder):
    return sorted(entry.name for entry in folder.iterdir())


def run(command, program, folder, extra=()):
    return subprocess.run(command.line(program, folder) + list(extra), capture_output=True,
                          stdin=subprocess.DEVNULL, timeout=300, check=False)


def processor_seconds(pid):
    """What a process has used; None if it has ended."""
    try:
        text = pathlib.Path(f"/proc/{pid}/schedstat").read_text()
    except OSError:
        return None
    return int(text.split()[0]) * 1e-9


def processor_seconds_of_children(call):
    def total():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = total()
    result = call()
    return result, total() - before


@dataclasses.dataclass
class Reference:
    """A run that was not disturbed: its files, and the processor time at which stages begin."""

    files: dict
    stages: list  # of (name, begin, end) in seconds


def reference(command, program, folder):
    fresh(folder, [])
    result, seconds = processor_seconds_of_children(
        lambda: run(command, program, folder, ["--json"]))
    require(result.returncode == 0, f"{command.name}: {result.stderr.decode()}")
    files = {name: (folder / name).read_bytes() for name in command.outputs}
    if not command.has_stages:
        return Reference(files, [(WHOLE, 0, seconds), (WRITING, 0, seconds)])
    phases = json.loads(result.stdout)["seconds"]
    total = phases.pop("total")
    # Of the processor time each stage has the share that it has of the time on the clock.
    stages, reached = [], 0
    for name in in_order(phases, command, program, folder):
        end = reached + phases[name] / total * seconds
        stages.append((name, reached, end))
        reached = end
    return Reference(files, stages + [(WRITING, 0, seconds)])


def in_order(phases, command, program, folder):
    """Names of stages in the order in which they run, as the summary for people has them."""
    fresh(folder, [])
    text = run(command, program, folder).stdout.decode()
    times = next(line for line in text.splitlines() if line.endswith("MiB") and " s, " in line)
    return sorted(phases, key=lambda name: times.index(name + " "))


def temporary_files(folder):
    with contextlib.suppress(OSError):
        return [entry for entry in os.scandir(folder) if entry.name.endswith((".tmp", ".library"))]
    return []


def is_being_written(folder):
    for entry in temporary_files(folder):
        with contextlib.suppress(OSError):
            if entry.stat().st_size > 0:
                return True
    return False


def kill_at(process, stage, moment, folder, draw):
    """Waits for the moment and kills. False if the run has ended before."""
    if stage == WRITING:
        while process.poll() is None and not is_being_written(folder):
            pass
        time.sleep(draw.uniform(0, 0.002))
    else:
        while process.poll() is None and (processor_seconds(process.pid) or 0) < moment:
            time.sleep(0.0005)
    process.send_signal(signal.SIGKILL)
    return process.wait() == -signal.SIGKILL


def contents(command, folder):
    """The bytes of each output that is there."""
    there = [name for name in command.outputs if (folder / name).exists()]
    return {name: (folder / name).read_bytes() for name in there}


def check_after_kill(command, folder, before, files):
    after = contents(command, folder)
    for name in command.outputs:
        require(name in after or name not in before, f"{name}: the older file is lost")
        require(after.get(name) in (before.get(name), files[name]), f"{name}: half a file")
    known = set(command.outputs + command.folders)
    strange = [n for n in names_in(folder) if n not in known and not n.startswith(".")]
    require(not strange, f"other files: {strange}")


def check_whole(command, folder, files):
    for name in command.outputs:
        require((folder / name).read_bytes() == files[name], f"{name}: other bytes after a kill")
    left = [name for name in names_in(folder) if name not in command.outputs + command.folders]
    require(not left, f"left behind: {left}")
    for name in command.folders:
        hidden = [entry for entry in names_in(folder / name) if entry.startswith(".")]
        require(not hidden, f"left behind in {name}: {hidden}")


def kill_once(command, program, folder, known, stage, draw):
    """Returns whether the run was killed before its end, and whether it left something."""
    name, begin, end = stage
    before = contents(command, folder)
    process = subprocess.Popen(command.line(program, folder) + ["--quiet"],
                               stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL)
    killed = kill_at(process, name, draw.uniform(begin, end), folder, draw)
    check_after_kill(command, folder, before, known.files)
    return killed, bool(temporary_files(folder))


def kill_in_stage(command, program, folder, known, stage, moments, draw):
    """Kills, some times in a row, and runs again to the end. Returns counts of kills and faults."""
    counts = collections.Counter()
    while counts["kills"] < moments:
        fresh(folder, command.outputs if draw.random() < 0.5 else [])
        try:
            for _ in range(min(draw.randint(1, 8), moments - counts["kills"])):
                counts["kills"] += 1
                killed, left = kill_once(command, program, folder, known, stage, draw)
                counts["killed"] += killed
                counts["left"] += left
            result = run(command, program, folder, ["--quiet"])
            require(result.returncode == 0, f"the next run: {result.stderr.decode()}")
            check_whole(command, folder, known.files)
        except Fault as fault:
            counts["faults"] += 1
            print(f"FAULT: {command.name}, {stage[0]}: {fault}")
    print(f"{command.name:<28} {stage[0]:<18} {counts['killed']:>4} of {moments} killed before the "
          f"end, {counts['left']:>3} left a temporary file, {counts['faults']} faults", flush=True)
    return counts


def drawn(stages, count, draw):
    """So many of the stages in their order, the last one among them; all if `count` is None."""
    if count is None or count >= len(stages):
        return stages
    places = sorted(draw.sample(range(len(stages) - 1), count - 1))
    return [stages[place] for place in places] + stages[-1:]


def kill_often(command, program, work, options, draw):
    """Kills in stages, and again if all runs have ended before.

    Returns the number of faults, and the processor time of a run that was not disturbed.
    """
    known = reference(command, program, work / "out")
    seconds = known.stages[-1][2]
    stages, moments = drawn(known.stages, options.stages, draw), options.moments
    counts = collections.Counter()
    for _ in range(MOST_TRIES):
        for stage in stages:
            counts += kill_in_stage(command, program, work / "out", known, stage, moments, draw)
        if counts["killed"] > 0:
            return counts["faults"], seconds
    print(f"FAULT: {command.name}: no run was killed before its end")
    return counts["faults"] + 1, seconds


def check_refusal(command, result, folder, outputs_before):
    text = result.stderr.decode()
    require(result.returncode == 1, f"exit status {result.returncode}: {text}")
    require(text.startswith("rebounce: ") and text.count("\n") == 1, f"not one line: {text!r}")
    require(not any(name.startswith(".") for name in names_in(folder)),
            f"left behind: {names_in(folder)}")
    for name in outputs_before:
        require((folder / name).read_bytes() == OLDER, f"{name}: the older file is lost")


def refused(command, program, folder, what):
    """Runs where nothing can be written. Returns the number of faults."""
    before = [name for name in command.outputs if (folder / name).exists()]
    result = run(command, program, folder, ["--quiet"])
    try:
        check_refusal(command, result, folder, before)
    except Fault as fault:
        print(f"FAULT: {command.name}, {what}: {fault}")
        return 1
    print(f"{command.name:<30} {what:<20} exit 1: {result.stderr.decode().strip()}", flush=True)
    return 0


@contextlib.contextmanager
def mounted(folder, *options):
    """A small file system in memory; None where that is not allowed."""
    folder.mkdir(parents=True, exist_ok=True)
    line = ["mount", "-t", "tmpfs", "-o", ",".join(options), "tmpfs", str(folder)]
    if os.geteuid() != 0 or subprocess.run(line, capture_output=True, check=False).returncode != 0:
        yield None
        return
    try:
        yield folder
    finally:
        subprocess.run(["umount", "-l", str(folder)], check=True)


def on_a_full_disk(command, program, work):
    with mounted(work / "disk", "size=64k") as disk:
        if disk is None:
            print(f"{command.name:<30} full disk: skipped, this user may not mount one")
            return 0
        fresh(disk / "out", command.outputs)
        with contextlib.suppress(OSError), open(disk / "filler", "wb") as filler:
            while True:
                filler.write(bytes(4096))
                filler.flush()
        return refused(command, program, disk / "out", "full disk")


def in_a_read_only_folder(command, program, work):
    with mounted(work / "disk", "size=1m") as disk:
        if disk is not None:
            fresh(disk / "out", command.outputs)
            subprocess.run(["mount", "-o", "remount,ro", str(disk)], check=True)
            return refused(command, program, disk / "out", "read-only folder")
    if os.geteuid() == 0:
        print(f"{command.name:<30} read-only folder: skipped, root writes there too")
        return 0
    folder = work / "read-only"
    fresh(folder, command.outputs)
    folder.chmod(0o555)
    try:
        return refused(command, program, folder, "read-only folder")
    finally:
        folder.chmod(0o755)


def vanishing(command, program, work, draw, seconds):
    """The folder is removed at a random moment."""
    folder = work / "out"
    fresh(folder, [])
    process = subprocess.Popen(command.line(program, folder) + ["--quiet"],
                               stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                               stderr=subprocess.PIPE)
    moment = draw.uniform(0, seconds)
    while process.poll() is None and (processor_seconds(process.pid) or 0) < moment:
        time.sleep(0.0005)
    shutil.rmtree(folder, ignore_errors=True)
    text = process.communicate()[1].decode()
    if process.returncode == 0:
        return "exit 0"
    require(process.returncode == 1, f"exit status {process.returncode}: {text}")
    require(text.startswith("rebounce: ") and text.count("\n") == 1, f"not one line: {text!r}")
    require(not folder.exists() or not any(n.startswith(".") for n in names_in(folder)),
            "a temporary file is left")
    return "exit 1"


def vanish_often(command, program, work, moments, draw, seconds):
    counts, faults = collections.Counter(), 0
    for _ in range(moments):
        try:
            counts[vanishing(command, program, work, draw, seconds)] += 1
        except Fault as fault:
            faults += 1
            print(f"FAULT: {command.name}, vanishing folder: {fault}")
    print(f"{command.name:<30} vanishing folder: {dict(counts)}", flush=True)
    return faults


def argument_parser(description, moments):
    """What all drivers of kills take; `moments` is the default."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("program", type=pathlib.Path)
    parser.add_argument("work", type=pathlib.Path)
    parser.add_argument("--moments", type=int, default=moments, help="in each stage of each command")
    parser.add_argument("--stages", type=int, help="so many, drawn at random; all if left out")
    parser.add_argument("--seed", type=int, default=None)
    return parser


def prepared(arguments):
    """The program, an empty folder, and random numbers whose seed is printed."""
    program, work = arguments.program.resolve(), arguments.work.resolve()
    seed = arguments.seed if arguments.seed is not None else random.randrange(1 << 32)
    print(f"seed {seed}", flush=True)
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    return program, work, random.Random(seed)


def main():
    parser = argument_parser(__doc__.splitlines()[0], moments=100)
    parser.add_argument("--only", help="this command alone")
    arguments = parser.parse_args()
    if processor_seconds(os.getpid()) is None:
        sys.exit("kills need /proc/PID/schedstat, which cannot be read here")
    program, work, draw = prepared(arguments)
    transfer = work / "room.safetensors"
    subprocess.run([program, "precompute", SCENE, "--patches", "40", "--quality", "low", "--quiet",
                    "--operator", "dense", "-o", transfer], check=True, stdin=subprocess.DEVNULL)
    faults = 0
    for command in commands(transfer):
        if arguments.only not in (None, command.name):
            continue
        found, seconds = kill_often(command, program, work, arguments, draw)
        faults += found
        faults += on_a_full_disk(command, program, work)
        faults += in_a_read_only_folder(command, program, work)
        faults += vanish_often(command, program, work, min(arguments.moments, 10), draw, seconds)
    shutil.rmtree(work, ignore_errors=True)
    print(f"{faults} faults")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
