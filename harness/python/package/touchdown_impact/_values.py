"""Quantities, tables and where answers lie."""

from __future__ import annotations

import html
import io
import json
import os
import tempfile
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, overload

import pyarrow as pa
import pyarrow.csv
from matplotlib.figure import Figure

from . import _native
from ._native import TouchdownError, lead
from ._task import Path_

if TYPE_CHECKING:
    import pandas
    import polars

#: A library of tables: pandas, polars, or arrow for a `pyarrow.Table`.
Library = Literal["pandas", "polars", "arrow"]
#: Columns by name, or a table of them.
Columns: TypeAlias = Mapping[str, Any] | pa.Table


@dataclass(frozen=True)
class Quantity:
    """A value in `unit` with its 95 % interval; `low` and `high` are None where the recordings do not determine it."""

    value: float
    unit: str
    low: float | None = None
    high: float | None = None

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        of = f" (95 %: {self.low:.4g} to {self.high:.4g})" if self.low is not None and self.high is not None else ""
        return f"{self.value:.4g}{of}" + (f" {self.unit}" if self.unit not in ("", "1") else "")


def quantity(value: float, unit: str, interval: Sequence[float] | None) -> Quantity:
    """A quantity with an interval as the files have it, [low, high] or None."""
    low, high = interval if interval else (None, None)
    return Quantity(value, unit, low, high)


@overload
def table(columns: Columns, library: Literal["pandas"]) -> pandas.DataFrame: ...
@overload
def table(columns: Columns, library: Literal["polars"]) -> polars.DataFrame: ...
@overload
def table(columns: Columns, library: Literal["arrow"]) -> pa.Table: ...
@overload
def table(columns: Columns, library: Library) -> pandas.DataFrame | polars.DataFrame | pa.Table: ...
def table(columns: Columns, library: Library) -> pandas.DataFrame | polars.DataFrame | pa.Table:
    """Columns as a table of `library`, by way of Arrow.

    Raises: ValueError for another library; ModuleNotFoundError where it is not installed.
    """
    arrow = columns if isinstance(columns, pa.Table) else pa.table(dict(columns))
    if library == "arrow":
        return arrow
    if library == "polars":
        import polars

        made = polars.from_arrow(arrow)
        assert isinstance(made, polars.DataFrame)
        return made
    if library == "pandas":
        return arrow.to_pandas()
    raise ValueError(f"library {library!r} is not known; give pandas, polars or arrow")


class Tabular:
    """What has a table: its `_columns`."""

    @overload
    def to_frame(self, library: Literal["pandas"] = ...) -> pandas.DataFrame: ...
    @overload
    def to_frame(self, library: Literal["polars"]) -> polars.DataFrame: ...
    @overload
    def to_frame(self, library: Literal["arrow"]) -> pa.Table: ...
    def to_frame(self, library: Library = "pandas") -> pandas.DataFrame | polars.DataFrame | pa.Table:
        """Its table, of `library`: of a campaign every sample, of a run every step, else the parameters, a row each.

        Raises: ModuleNotFoundError where the library is not installed; TouchdownError with what is wrong with a campaign.
        """
        return table(self._columns(), library)

    def _columns(self) -> Columns:
        raise NotImplementedError


def html_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table as HTML."""

    def line(cells: Sequence[str], tag: str) -> str:
        return "<tr>" + "".join(f"<{tag}>{html.escape(c)}</{tag}>" for c in cells) + "</tr>"

    return "<table>" + line(head, "th") + "".join(line(r, "td") for r in rows) + "</table>"


class Picture(Figure):
    """A figure of matplotlib that notebooks show; `savefig` writes it."""

    def __init__(self, width: float, height: float) -> None:
        """width, height: inches."""
        super().__init__(figsize=(width, height), layout="constrained")

    def _repr_png_(self) -> bytes:
        png = io.BytesIO()
        self.savefig(png, format="png")
        return png.getvalue()


class Place:
    """The folder of an answer: the one given, or a temporary one that goes with the answer."""

    def __init__(self, given: Path_ | None) -> None:
        self._temporary = tempfile.TemporaryDirectory(prefix="touchdown-") if given is None else None
        self.path = Path(self._temporary.name if self._temporary is not None else given or "")


class Page:
    """An answer with a page, report.html in its folder."""

    #: Folder of the answer. Without `out` it is a temporary one that goes with this object.
    folder: Path
    _words: str | None = None

    def report(self, path: Path_ | None = None) -> Path:
        """The report: one HTML page that needs no network. Written to `path` where that is given.

        A file that is there and is no page of touchdown is kept under another name, with a warning.

        Raises: TouchdownError where there is none; OSError where it cannot be written.
        """
        return self._file("report.html", path)

    @property
    def sentence(self) -> str:
        """The sentence to take away."""
        return lead(self.report().read_text(encoding="utf-8")) or ""

    def __str__(self) -> str:
        return (self._words if self._words is not None else self.sentence).rstrip("\n")

    def _file(self, name: str, path: Path_ | None) -> Path:
        own = self.folder / name
        if path is not None:
            note = _native.copy_out(self.folder, name, path)
            if note is not None:
                warnings.warn(f"{Path(path).parent}: {note}", stacklevel=3)
            return Path(path)
        if not own.is_file():
            raise TouchdownError(f"{own}: is not there")
        return own


def read_json(folder: Path, name: str) -> dict[str, Any]:
    """What a file of the answer in `folder` holds.

    Raises: FileNotFoundError where it is not there; TouchdownError where it cannot be read, or is no JSON object.
    """
    path = folder / name
    if not os.path.lexists(path):
        raise FileNotFoundError(f"{path}: is not there; name the folder of an answer")
    try:
        found = json.loads(_native.bytes_of(folder, name))
    except (ValueError, RecursionError) as e:
        raise TouchdownError(f"{path}: is no JSON ({e}); work it out again") from e
    if not isinstance(found, dict):
        raise TouchdownError(f"{path}: is no object of JSON; work it out again")
    return found


def read_rows(folder: Path, name: str) -> pa.Table:
    """A table of the answer in `folder`, as CSV.

    Raises: TouchdownError where it cannot be read; ArrowInvalid where it is no table.
    """
    return pyarrow.csv.read_csv(io.BytesIO(_native.bytes_of(folder, name)))
