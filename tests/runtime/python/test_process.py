"""What concerns the process: Ctrl-C, memory, threads, types, examples."""

import doctest
import gc
import os
import pathlib
import resource
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import rebounce
from conftest import ROOT, SCENE

PACKAGE = ROOT / "runtime/python"


def test_ctrl_c_ends_a_build():
    timer = threading.Timer(1.5, lambda: os.kill(os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        rebounce.precompute(SCENE, patches=16000, quality="high", progress=False)


def test_other_threads_run_meanwhile():
    ticks = []
    done = threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.001)

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.monotonic()
    rebounce.precompute(SCENE, patches=200, progress=False)
    took = time.monotonic() - begin
    done.set()
    thread.join()
    during = [t for t in ticks if begin < t < begin + took]
    assert len(during) > 10 * min(took, 1)


def test_threads_are_those_of_the_caller():
    def threads_while_it_builds(count):
        found = []

        def work():
            rebounce.set_threads(count)
            seen = []
            data = rebounce.precompute(
                SCENE, patches=300, quality="low", operator="dense",
                progress=lambda *_: seen.append(len(os.listdir("/proc/self/task"))),
            )  # fmt: skip
            found.append((max(seen), data.transfer @ np.ones(3 * data.patch_count, np.float32)))

        thread = threading.Thread(target=work)
        thread.start()
        thread.join()
        return found[0]

    one, light_of_one = threads_while_it_builds(1)
    four, light_of_four = threads_while_it_builds(4)
    assert four >= one + 2
    assert np.array_equal(light_of_one, light_of_four)
    with pytest.raises(ValueError, match="threads must be 0 or more"):
        rebounce.set_threads(-1)


def test_no_leak_over_many_calls(small_room):
    op = small_room.transfer
    engine = rebounce.Engine(small_room)
    x = np.ones(op.shape[1], np.float32)
    lamp = [rebounce.Light(position=(1, 1, 1))]

    def calls(count):
        for _ in range(count):
            op @ x
            engine.relight(lamp, rebounce.Sky(1.0))
            engine.radiosity
            with pytest.raises(ValueError):
                op @ x[1:]

    def held():
        gc.collect()
        pages = int(pathlib.Path("/proc/self/statm").read_text().split()[1])
        return pages * resource.getpagesize()

    calls(500)
    before = held()
    calls(10000)
    assert held() - before < 8 << 20


def test_the_package_is_typed():
    pytest.importorskip("mypy")
    mypy = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", os.devnull, "--config-file",
         PACKAGE / "pyproject.toml", PACKAGE / "rebounce"],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    assert mypy.returncode == 0, mypy.stdout


def test_doctests():
    for name in ("facets", "daylight"):
        module = __import__(f"rebounce.{name}", fromlist=[name])
        result = doctest.testmod(module)
        assert result.attempted > 0 and result.failed == 0, name


@pytest.mark.parametrize("example", sorted(path.name for path in (PACKAGE / "examples").glob("*.py")))
def test_examples(example, tmp_path):
    done = subprocess.run(
        [sys.executable, PACKAGE / "examples" / example, "--quick"],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
