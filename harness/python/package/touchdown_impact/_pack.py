"""The element as an FMU."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import fspath
from pathlib import Path
from typing import Literal

from . import _native
from ._task import Path_


@dataclass(frozen=True)
class Packed:
    """An FMU that was written.

    path: the file. platforms: those that it runs on, as FMI 2.0 names them. starts: start values given, SI.
    """

    path: Path
    platforms: tuple[str, ...]
    starts: dict[str, float]


def pack(
    path: Path_,
    starts: Mapping[str, float | str] | None = None,
    *,
    model: Literal["contact", "moving-bar", "body-force"] = "contact",
    binaries: Sequence[str] = (),
    platforms: Path_ | None = None,
) -> Packed:
    """Writes the contact element as an FMU (FMI 2.0 for co-simulation).

    starts: start values of parameters, a number in SI or the name of a choice. model: contact, or moving-bar, its partner, or body-force.
    binaries: libraries to pack, PLATFORM=FILE, instead of those that lie ready. platforms: folder of libraries that lie
    ready for other platforms.

    Raises: TouchdownError for a parameter that is not known or out of its range, a library that is not there, or a place
    that cannot be written.
    """
    values = [(name, value if isinstance(value, str) else repr(float(value))) for name, value in (starts or {}).items()]
    done = json.loads(_native.pack(model, fspath(path), values, list(binaries), platforms))
    return Packed(Path(done["fmu"]), tuple(done["platforms"]), done["starts"])
