#!/usr/bin/env python3
"""Builds from links by several ranks of mpirun, undisturbed and with ranks killed.

Any number of ranks gives the bytes of one process. A rank that is killed ends the run with an exit
status that is not 0 and without half a file, and the same command with another number of ranks goes
on from the checkpoint, to the same bytes.

Usage: ranks.py PROGRAM WORK [--moments N] [--stages N] [--most RANKS] [--seed S]
"""

import contextlib
import os
import pathlib
import shutil
import subprocess
import sys
import time

import kills

# Root may, more ranks than processors may, and no other machine is looked for.
ENVIRONMENT = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
               "OMPI_MCA_plm": "isolated", "OMPI_MCA_rmaps_base_oversubscribe": "1",
               "OMPI_MCA_btl_vader_single_copy_mechanism": "none", "OMP_NUM_THREADS": "1"}
COMMAND = kills.precompute("precompute", "--patches", "80", "--form-factors", "links",
                           "--tolerance", "0.05", "--checkpoint", "OUT/parts", folders=["parts"])


def line(count, program, folder):
    return ["mpirun", "-n", str(count), *COMMAND.line(program, folder), "--quiet"]


def begin(count, program, folder):
    return subprocess.Popen(line(count, program, folder), env=os.environ | ENVIRONMENT,
                            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                            stderr=subprocess.PIPE)


def errors_of(process):
    """What it has printed as errors at its end; ends it if it hangs."""
    try:
        return process.communicate(timeout=300)[1].decode()
    except subprocess.TimeoutExpired:
        process.terminate()  # mpirun ends its ranks
        raise


def wait_after_kill(process):
    """Waits for the end of all ranks.

    The mpirun of Open MPI 4.1 may wait for a lock of its own for ever if a rank is killed while it
    joins. Then it is killed too, but only when no rank is left that it could end.
    """
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.communicate(timeout=10)
    if process.poll() is None and not any(is_running(pid) for pid in children_of(process)):
        print("mpirun hangs after the end of all ranks", flush=True)
        process.kill()
    errors_of(process)


def run(count, program, folder):
    process = begin(count, program, folder)
    text = errors_of(process)
    kills.require(process.returncode == 0, f"{count} ranks: {text}")


def rank_of(pid):
    """The rank of a process of mpirun's; None of any other."""
    try:
        entries = pathlib.Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
    except OSError:
        return None
    name = b"OMPI_COMM_WORLD_RANK="
    return next((int(e[len(name):]) for e in entries if e.startswith(name)), None)


def children_of(process):
    return pathlib.Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()


def find_rank(process, rank):
    """The process of a rank as soon as there is one; None if the run ends before."""
    while process.poll() is None:
        for pid in children_of(process):
            if rank_of(pid) == rank:
                return int(pid)
        time.sleep(0.005)
    return None


def state_of(pid):
    """The fields of /proc/PID/stat from the state on; None if the process is gone."""
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return None


def is_running(pid):
    fields = state_of(pid)
    return fields is not None and fields[0] != "Z"


def used(pid):
    """Processor seconds of a process, all its threads; None if it has ended."""
    fields = state_of(pid)
    if fields is None:
        return None
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def kill_rank(process, rank, moment):
    """Kills a rank when it has used so many processor seconds. False if it has ended before."""
    pid = find_rank(process, rank)
    while pid is not None and process.poll() is None:
        seconds = used(pid)
        if seconds is None:
            return False
        if seconds >= moment:
            os.kill(pid, 9)
            return True
        time.sleep(0.002)
    return False


def kill_and_go_on(program, folder, known, draw, most, moment):
    """Returns whether the rank was killed before its end."""
    count, again = draw.sample(range(1, most + 1), 2)
    rank = draw.randrange(count)
    kills.fresh(folder, COMMAND.outputs)
    process = begin(count, program, folder)
    # Of what one process uses, each rank uses a part.
    killed = kill_rank(process, rank, moment / count)
    if killed:
        wait_after_kill(process)
    else:
        errors_of(process)
    if process.returncode == 0:
        # A signal to a rank that frees its memory at its end comes too late: all must be there.
        kills.check_whole(COMMAND, folder, known.files)
        killed = False
    kills.check_after_kill(COMMAND, folder, {name: kills.OLDER for name in COMMAND.outputs},
                           known.files)
    run(again, program, folder)
    kills.check_whole(COMMAND, folder, known.files)
    return killed


def main():
    parser = kills.argument_parser(__doc__.splitlines()[0], moments=1)
    parser.add_argument("--most", type=int, default=3, help="ranks at most, 2 or more")
    options = parser.parse_args()
    program, work, draw = kills.prepared(options)
    folder = work / "out"
    known = kills.reference(COMMAND, program, folder)
    faults = 0
    for count in range(1, options.most + 1):
        kills.fresh(folder, [])
        run(count, program, folder)
        kills.check_whole(COMMAND, folder, known.files)
        print(f"{count} ranks: the bytes of one process", flush=True)
    stages = [stage for stage in known.stages if stage[0] != kills.WRITING]
    if options.stages is not None:
        stages = draw.sample(stages, min(options.stages, len(stages)))
    killed_of_all = 0
    for name, first, last in stages:
        killed = 0
        for _ in range(options.moments):
            try:
                killed += kill_and_go_on(program, folder, known, draw, options.most,
                                         draw.uniform(first, last))
            except kills.Fault as fault:
                faults += 1
                print(f"FAULT: {name}: {fault}")
        print(f"{name:<24} {killed} of {options.moments} killed before the end", flush=True)
        killed_of_all += killed
    if killed_of_all == 0:
        faults += 1
        print("FAULT: no rank was killed before its end")
    shutil.rmtree(work, ignore_errors=True)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
