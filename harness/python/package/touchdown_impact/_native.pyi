"""The native half: the tasks of the commands. Use the package."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from typing import Any

VERSION: str

class TouchdownError(Exception):
    """What is wrong, where, and the cure, in the words of the command."""

_Path = str | PathLike[str]
_Notify = Callable[[str, str, int], None]

def lies_at(module: _Path, interpreter: _Path, arguments: Sequence[str]) -> None: ...
def serve() -> None: ...
def command(words: Sequence[str], program: Sequence[str]) -> int: ...
def diagnose(
    campaigns: Sequence[_Path],
    out: _Path,
    platforms: _Path | None,
    jobs: int | None,
    bootstrap: int,
    seconds: float | None,
    resume: bool,
    fmus: Mapping[str, Any],
    notify: _Notify,
) -> str: ...
def fit(campaign: _Path, out: _Path, method: str, seconds: float, notify: _Notify) -> str: ...
def run(
    scenario: _Path,
    out: _Path,
    fmu: _Path | None,
    direct: bool,
    parquet: bool,
    step: float | None,
    stop: float | None,
    fmus: Mapping[str, Any],
    notify: _Notify,
) -> str: ...
def pack(
    model: str, out: _Path, starts: Sequence[tuple[str, str]], binaries: Sequence[str], platforms: _Path | None
) -> str: ...
def impact(
    mass: float, speed: float, stiffness: float, exponent: float, damping: float | None, restitution: float | None
) -> str: ...
def import_(files: Sequence[_Path], out: _Path, i: Mapping[str, Any], notify: _Notify) -> str: ...
def campaign(folder: _Path) -> dict[str, Any]: ...
def bytes_of(folder: _Path, name: str) -> bytes: ...
def copy_out(folder: _Path, name: str, out: _Path) -> str | None: ...
def write_campaign(folder: _Path, files: Sequence[tuple[str, bytes]]) -> None: ...
def lead(page: str) -> str | None: ...
def left_alone() -> int: ...
