"""How a task is followed, and where somebody else's FMUs run."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

from tqdm import tqdm

from . import _native

#: A path as the standard library takes it.
Path_ = str | os.PathLike[str]

# What serves somebody else's FMU in a process of its own: the native module alone, without the package.
_SERVE = """
from importlib.util import module_from_spec, spec_from_file_location
spec = spec_from_file_location("touchdown_impact._native", {path!r})
native = module_from_spec(spec)
spec.loader.exec_module(native)
native.serve()
"""
_native.lies_at(_native.__file__, sys.executable, ["-I", "-S", "-c", _SERVE.format(path=_native.__file__)])


class TouchdownWarning(UserWarning):
    """What is to be known beside an answer."""


@dataclass(frozen=True)
class Fmus:
    """Where somebody else's FMUs run.

    in_process: inside this process: faster, but a crash of theirs ends Python.
    fmu_seconds: longest time of one call, s, above 0.
    fmu_memory: most memory of an FMU, MB; None: no limit.
    """

    in_process: bool = False
    fmu_seconds: float = 60.0
    fmu_memory: int | None = None

    def _options(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class Progress:
    """How far a task is.

    task: what is done.
    stage: what is done of it now; empty before the first stage.
    done, total: parts; total is 0 where nobody knows how many there are.
    """

    task: str
    stage: str
    done: int
    total: int


#: True: a bar by tqdm, on a terminal or in a notebook. False: nothing. Else called as a task goes on.
Follow = bool | Callable[[Progress], None]


class Listener:
    """Takes what a task reports: progress to whom it is for, warnings to `warnings`, errors and words kept."""

    def __init__(self, progress: Follow) -> None:
        self._progress = progress
        self._now = Progress("", "", 0, 0)
        self._bar: tqdm[Any] | None = None
        self.errors: list[str] = []
        self.answers: list[str] = []

    def __call__(self, kind: str, text: str, number: int) -> None:
        now = self._now
        if kind == "warning":
            # of the caller of the package's function
            warnings.warn(text, TouchdownWarning, stacklevel=3)
        elif kind == "error":
            self.errors.append(text)
        elif kind == "answer":
            self.answers.append(text)
        elif kind == "end":
            self.close()
        else:
            if kind == "begin":
                self.close()
                now = Progress(text, "", 0, number)
            elif kind == "stage":
                now = Progress(now.task, text, now.done, now.total)
            else:
                now = Progress(now.task, now.stage, now.done + number, now.total)
            self._now = now
            self._show(now)

    def _show(self, now: Progress) -> None:
        if callable(self._progress):
            self._progress(now)
        elif self._progress:
            if self._bar is None:
                # nothing in the first second, and nothing where nobody looks on
                watched = sys.stderr.isatty() or "ipykernel" in sys.modules
                self._bar = tqdm(total=now.total or None, delay=1.0, disable=not watched, leave=False)
            self._bar.set_description(f"{now.task}: {now.stage}" if now.stage else now.task)
            self._bar.update(now.done - self._bar.n)

    def close(self) -> None:
        """Takes the bar away."""
        if self._bar is not None:
            self._bar.close()
            self._bar = None

    def raise_errors(self) -> None:
        """Raises what was reported as an error.

        Raises: TouchdownError.
        """
        if self.errors:
            raise _native.TouchdownError("\n".join(self.errors))
