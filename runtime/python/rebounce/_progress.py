"""Progress of long work: tqdm where it is installed, a line by hand where it is not."""

import logging
import sys
import time
from typing import Any, Callable, Optional, Union

Progress = Union[None, bool, Callable[[str, float], Any]]

log = logging.getLogger("rebounce")


class _Bar:
    def __init__(self) -> None:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            tqdm = None
        self._tqdm = tqdm
        self._phase = ""
        self._bar: Any = None
        self._begin = time.monotonic()

    def __call__(self, phase: str, fraction: float) -> None:
        if phase != self._phase:
            self.close()
            self._phase = phase
            self._begin = time.monotonic()
            if self._tqdm is not None:
                self._bar = self._tqdm(total=100, desc=phase, leave=False, unit="%")
        if self._bar is not None:
            self._bar.update(round(100 * fraction) - self._bar.n)
        else:
            sys.stderr.write(f"\r\033[K{phase}: {100 * fraction:.0f} %")
            sys.stderr.flush()

    def close(self) -> None:
        if self._phase:
            log.debug("%s: %.1f s", self._phase, time.monotonic() - self._begin)
        if self._bar is not None:
            self._bar.close()
            self._bar = None
        elif self._phase and self._tqdm is None:
            sys.stderr.write("\r\033[K")
        self._phase = ""


def _is_interactive() -> bool:
    if sys.stderr.isatty():
        return True
    try:
        return type(get_ipython()).__name__ == "ZMQInteractiveShell"  # type: ignore[name-defined]
    except NameError:
        return False


class reporting:
    """A context whose value is called with (phase, fraction), or None for silence.

    progress: None for a bar on terminals and in notebooks, True or False for one always or never,
    or a function of one's own, called with the name of the phase and the fraction done in [0, 1]; what
    it raises ends the work, what it returns counts for nothing.
    """

    def __init__(self, progress: Progress = None) -> None:
        self._bar: Optional[_Bar] = None
        self._call: Optional[Callable[[str, float], Any]] = None
        if callable(progress):
            self._call = progress
        elif progress or (progress is None and _is_interactive()):
            self._bar = _Bar()
            self._call = self._bar

    def __enter__(self) -> Optional[Callable[[str, float], Any]]:
        return self._call

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
