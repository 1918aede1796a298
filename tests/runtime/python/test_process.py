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


def test_ctrl_c_ends_a_build_within_a_second():
    sent = []

    def interrupt():
        sent.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(1.5, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        rebounce.precompute(SCENE, patches=16000, quality="high", progress=False)
    limit = 1 if os.getloadavg()[0] < 2 else 10  # where others use the processors
    assert time.monotonic() - sent[0] < limit


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
    mypy = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", os.devnull, "--config-file",
         PACKAGE / "pyproject.toml", PACKAGE / "rebounce"],
        stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    if "No module named mypy" in mypy.stdout or mypy.returncode not in (0, 1):
        pytest.skip("mypy is not installed")
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
