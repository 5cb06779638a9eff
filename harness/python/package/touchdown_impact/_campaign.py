"""Campaigns: recordings and what is known of them."""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import fspath
from pathlib import Path
from typing import Any, Literal, Protocol, cast

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.csv

from . import _native
from ._task import Follow, Listener, Path_
from ._values import Columns, Picture, Tabular, html_table

#: What was done with the body.
Kind = Literal["drop-test", "contactor-opening", "indentation"]

_UNITS = {"time": "s", "force": "N", "acceleration": "m/s^2", "penetration": "m"}
_CHANNELS = ("force", "acceleration", "penetration")


class Frame(Protocol):
    """A table that hands its columns out through Arrow: of pandas, polars, pyarrow and others."""

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...


#: A table by its columns: an array of numbers each, of one length.
Arrays = Mapping[str, Any]
#: Recordings as tables, named or in order; columns `name [unit]`, or time, force, acceleration and penetration in SI.
Frames = Frame | Arrays | Sequence[Frame | Arrays] | Mapping[str, Frame | Arrays]
#: A value for all recordings, or one for each in order.
Each = float | Sequence[float] | None


@dataclass(frozen=True)
class Recording:
    """A recording as the diagnosis takes it in: cut to what the impact reaches, SI."""

    file: str
    #: Order in which it was taken.
    order: float
    #: What its level is called.
    level: str
    #: Drop height, m
    height: float | None
    #: Speed at touch and its standard deviation, m/s
    speed: tuple[float, float] | None
    #: Speed at the first sample and its standard deviation, m/s
    start_speed: tuple[float, float] | None
    #: Preload of the return spring, N
    preload: float | None
    #: s, increasing
    time: npt.NDArray[np.float64]
    #: N
    force: npt.NDArray[np.float64] | None
    #: m/s^2
    acceleration: npt.NDArray[np.float64] | None
    #: m
    penetration: npt.NDArray[np.float64] | None


class Campaign(Tabular):
    """Recordings of one body and one stop, in a folder of format recordings/1."""

    #: Its folder.
    folder: Path

    def __init__(self, folder: Path_) -> None:
        """The campaign in `folder`. It is read when it is asked for something; what is wrong with it is raised then."""
        self.folder = Path(folder)
        self._temporary: tempfile.TemporaryDirectory[str] | None = None
        self._read: dict[str, Any] | None = None
        #: What was taken of each file and what was left out, of a campaign that was imported.
        self.imported: dict[str, Any] | None = None

    @classmethod
    def of(
        cls,
        frames: Frames,
        *,
        mass: float | None = None,
        speed: Each = None,
        speed_std: Each = None,
        height: Each = None,
        start_speed: Each = None,
        start_speed_std: Each = None,
        preload: Each = None,
        level: Each = None,
        order: Each = None,
        kind: Kind = "drop-test",
        travel: float | None = None,
        spring_rate: float | None = None,
        terms: Sequence[str] | None = None,
        k: float | None = None,
        p: float | None = None,
        mu_d: float | None = None,
        name: str = "campaign",
        material: str | None = None,
        folder: Path_ | None = None,
    ) -> Campaign:
        """A campaign of tables, one a recording.

        mass: moving mass, kg. speed: at touch, m/s. height: drop height, m. start_speed: at the first sample, m/s. preload:
        of the return spring, N. level: what recordings of one level share, where neither height nor preload gives it. order:
        in which they were taken; as given unless stated. travel: of a contactor from rest to the stop, m. spring_rate: N/m.
        terms: what the simulation holds beside k x^p, names of `touchdown mechanisms`. k, p, mu_d: its law, where it is
        calibrated. folder: where the campaign is written; a temporary folder that goes with it unless given.

        Raises: ValueError for as many values as there are no recordings, and for one that is not finite; TypeError for what is no
        table, or no number; FileExistsError where `folder` holds files of these names that are not as a call like this left them; OSError
        where it cannot be written. All files are there, or none. What is wrong with the recordings is reported where they are used.
        """
        named = _named(frames)
        temporary = None
        if folder is None:
            temporary = tempfile.TemporaryDirectory(prefix="touchdown-")
            folder = Path(temporary.name) / _plain(name)
        folder = Path(folder)
        given: dict[str, Each] = {
            "order": order if order is not None else list(range(1, len(named) + 1)),
            "level": level,
            "drop_height": height,
            "impact_speed": speed,
            "impact_speed_std": speed_std,
            "start_speed": start_speed,
            "start_speed_std": start_speed_std,
            "spring_preload": preload,
        }
        each = {key: _each(key, value, len(named)) for key, value in given.items() if value is not None}
        lines = ["# Written by touchdown_impact.", 'format = "recordings/1"', "", "[campaign]"]
        lines += _keys(name=name, kind=kind, material=material)
        lines += ["", "[rig]"] + _keys(moving_mass=mass, travel=travel, return_spring_rate=spring_rate)
        lines += ["", "[simulation]"] + _keys(terms=None if terms is None else list(terms), k=k, p=p, mu_d=mu_d)
        files: dict[str, bytes] = {}
        for i, (file, frame) in enumerate(named.items()):
            text = io.BytesIO()
            pyarrow.csv.write_csv(
                _renamed(frame), text, pyarrow.csv.WriteOptions(quoting_style="none", delimiter=",")
            )
            files[file] = text.getvalue()
            lines += ["", "[[recording]]"] + _keys(file=file, **{key: values[i] for key, values in each.items()})
        files["campaign.toml"] = ("\n".join(lines) + "\n").encode()
        _native.write_campaign(folder, list(files.items()))
        made = cls(folder)
        made._temporary = temporary
        return made

    @property
    def name(self) -> str:
        """As campaign.toml has it."""
        return cast(str, self._facts["name"])

    @property
    def kind(self) -> str:
        """drop-test, contactor-opening, indentation or system."""
        return cast(str, self._facts["kind"])

    @property
    def mass(self) -> float | None:
        """Moving mass, kg."""
        return cast("float | None", self._facts["mass"])

    @property
    def parameters(self) -> dict[str, float]:
        """The law of the simulation as it is given: k N/m^p, p, mu_d N s/m^(p+1); empty where it is not calibrated."""
        return {name: self._facts["simulation"][name] for name in ("k", "p", "mu_d") if self._facts["simulation"][name]}

    @property
    def warnings(self) -> list[str]:
        """What is to be known of how it was read."""
        return list(self._facts["warnings"])

    @property
    def recordings(self) -> list[Recording]:
        """The recordings that a diagnosis takes.

        Raises: TouchdownError with everything wrong with the campaign.
        """
        def course(y: bytes | None) -> npt.NDArray[np.float64] | None:
            return None if y is None else np.frombuffer(y)

        courses = ("time", *_CHANNELS)
        return [
            Recording(**{**r, **{name: course(r[name]) for name in courses}}) for r in self._facts["recordings"]
        ]

    def _columns(self) -> Columns:
        """Every sample of every recording: file, order, level and the channels, SI.

        Raises: TouchdownError with everything wrong with the campaign.
        """
        parts = []
        for r in self.recordings:
            n = len(r.time)
            columns: dict[str, Any] = {"file": [r.file] * n, "order": np.full(n, r.order), "level": [r.level] * n}
            columns["time [s]"] = r.time
            for name in _CHANNELS:
                values = getattr(r, name)
                columns[f"{name} [{_UNITS[name]}]"] = pa.nulls(n, pa.float64()) if values is None else values
            parts.append(pa.table(columns))
        return pa.concat_tables(parts)

    def plot(self, channel: Literal["force", "acceleration", "penetration"] | None = None) -> Picture:
        """A channel of every recording over time; force, or else the first there is.

        Raises: ValueError for a channel that no recording has.
        """
        recordings = self.recordings
        there = [c for c in _CHANNELS if any(getattr(r, c) is not None for r in recordings)]
        channel = channel or cast(Any, there[0])
        if channel not in there:
            raise ValueError(f"no recording has {channel}; give {' or '.join(there)}")
        figure = Picture(8, 4)
        axes = figure.subplots()
        for r in recordings:
            if (y := getattr(r, channel)) is not None:
                axes.plot(1e3 * r.time, y, label=f"{r.file}, {r.level}", linewidth=1)
        axes.set(xlabel="time [ms]", ylabel=f"{channel} [{_UNITS[channel]}]", title=self.name)
        axes.legend(fontsize="small")
        return figure

    def _repr_html_(self) -> str:
        def show(value: float | None, unit: str) -> str:
            return "" if value is None else f"{value:.6g} {unit}"

        rows = [
            [r.file, f"{r.order:g}", r.level, show(r.speed and r.speed[0], "m/s"), str(len(r.time))]
            for r in self.recordings
        ]
        head = f"<p><b>{self.name}</b>: {self.kind}, {show(self.mass, 'kg')}</p>"
        return head + html_table(["file", "order", "level", "speed", "samples"], rows)

    def __repr__(self) -> str:
        return f"Campaign({str(self.folder)!r})"

    @property
    def _facts(self) -> dict[str, Any]:
        if self._read is None:
            self._read = _native.campaign(self.folder)
        return self._read


def _named(frames: Frames) -> dict[str, Frame]:
    """Tables by the name of their file."""
    named: dict[str, Any] = {}
    if hasattr(frames, "__arrow_c_stream__") or _is_arrays(frames):
        named = {"r01.csv": frames}
    elif isinstance(frames, Mapping):
        for name, frame in frames.items():
            file = name if name.endswith(".csv") else f"{name}.csv"
            if file in named:
                raise ValueError(f"two recordings would be called {file}; give each a name of its own")
            named[file] = frame
    else:
        named = {f"r{i:02}.csv": frame for i, frame in enumerate(cast("Sequence[Any]", frames), 1)}
    for name, frame in named.items():
        if _is_arrays(frame):
            named[name] = _of_arrays(name, frame)
        elif not hasattr(frame, "__arrow_c_stream__"):
            what = "a table of pandas, polars or pyarrow, or a dict of arrays"
            raise TypeError(f"{name} is a {type(frame).__name__}; give {what}")
        if _plain(name) != name:
            raise ValueError(f"{name!r} is no name of a file; name the recording without / and \\")
    if not named:
        raise ValueError("there is no recording; give a table for each")
    return named


def _is_column(values: Any) -> bool:
    """Whether these are the values of one column."""
    if isinstance(values, list | tuple):
        return all(isinstance(v, int | float) for v in values)
    return isinstance(values, np.ndarray | pa.Array | pa.ChunkedArray) or (hasattr(values, "dtype") and hasattr(values, "__len__"))


def _is_arrays(frame: Any) -> bool:
    """Whether this is a table by its columns."""
    return isinstance(frame, Mapping) and len(frame) > 0 and all(map(_is_column, frame.values()))


def _of_arrays(table: str, columns: Arrays) -> pa.Table:
    """A table by its columns."""
    made: dict[str, npt.NDArray[np.float64]] = {}
    for name, values in columns.items():
        try:
            numbers = np.asarray(values, dtype=np.float64)
        except (TypeError, ValueError) as e:
            raise TypeError(f"{table}: column {name!r} holds what is no number ({e})") from e
        if numbers.ndim != 1:
            raise ValueError(f"{table}: column {name!r} has {numbers.ndim} dimensions; give a number a sample")
        made[name] = numbers
    lengths = {name: len(numbers) for name, numbers in made.items()}
    if len(set(lengths.values())) > 1:
        said = ", ".join(f"{name!r} {n}" for name, n in lengths.items())
        raise ValueError(f"{table}: columns of different lengths: {said}; give as many samples of each")
    return pa.table(made)


def _plain(name: str) -> str:
    """A name without what leads to another folder."""
    plain = "".join("_" if c in "/\\:\0" else c for c in name)
    return plain if plain.strip(". ") else "campaign"


def _renamed(frame: Frame) -> pa.Table:
    """The columns `name [unit]`; those without a unit are in SI."""
    arrow = pa.table(frame)
    return arrow.rename_columns([f"{n} [{_UNITS[n]}]" if n in _UNITS else n for n in arrow.column_names])


def _each(key: str, value: Each, count: int) -> list[float]:
    """A value for each of so many recordings."""
    # an array without a dimension is one number
    given = value.tolist() if isinstance(value, np.ndarray) else value
    values = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else [given] * count
    if len(values) != count:
        raise ValueError(f"{key}: {len(values)} values for {count} recordings; give one, or one for each")
    try:
        return [float(cast(float, v)) for v in values]
    except (TypeError, ValueError):
        raise TypeError(f"{key} is {value!r}; give a number, or one for each recording") from None


def _keys(**values: Any) -> list[str]:
    """Keys of TOML, those that have a value; JSON writes texts, numbers and lists as TOML does."""
    return [f"{key} = {_toml(key, value)}" for key, value in values.items() if value is not None]


def _toml(key: str, value: Any) -> str:
    if isinstance(value, (bool, str, list)):
        # TOML escapes one character more than JSON
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    # numbers of numpy are no numbers of JSON
    try:
        number = int(value) if isinstance(value, (int, np.integer)) else float(value)
    except (TypeError, ValueError):
        raise TypeError(f"{key} is {value!r}; give a number") from None
    if not np.isfinite(number):
        raise ValueError(f"{key} is {number}; give a finite number")
    return json.dumps(number)


def _amount(value: float | str | None) -> str | None:
    """An amount as the flags of the command have it."""
    return value if value is None or isinstance(value, str) else repr(float(value))


def import_(
    files: Path_ | Sequence[Path_],
    *,
    out: Path_ | None = None,
    map: str | Sequence[str] = (),  # noqa: A002 - as the command has it
    rate: float | None = None,
    names: str | None = None,
    table: Path_ | None = None,
    height: float | str | None = None,
    speed: float | str | None = None,
    preload: float | str | None = None,
    kind: Kind | None = None,
    mass: float | str | None = None,
    travel: float | str | None = None,
    spring_rate: float | str | None = None,
    terms: Sequence[str] | None = None,
    name: str | None = None,
    material: str | None = None,
    keep_all: bool = False,
    split_columns: bool = False,
    least: float = 0.05,
    skip_bad: bool = False,
    progress: Follow = True,
) -> Campaign:
    """Makes a campaign out of the files that instruments write: text of any dialect, TDMS, MAT, MDF, WAV and others.

    out: folder for the campaign, which must not be there yet; a temporary one unless given. map: columns,
    CHANNEL=COLUMN[:UNIT or sensitivity][:negative or :positive]. rate: samples per second, where no column is time. names: what
    the files' names say, such as "drop_{height:mm}_{order}.tdms". table: CSV with what is known of each file. height, speed,
    preload, mass, travel, spring_rate: of all recordings, in SI or a text with a unit ("200 mm"). kind: guessed unless
    given. keep_all: recordings are taken whole. split_columns: columns of one kind are recordings of their own. least: share of a
    file's hardest impact that another has to reach to be a recording. skip_bad: files without a recording are left out.

    Raises: TouchdownError with everything wrong with the files, and with what is missing. KeyboardInterrupt within a second of
    Ctrl-C.
    """
    temporary = None
    if out is None:
        temporary = tempfile.TemporaryDirectory(prefix="touchdown-")
        out = Path(temporary.name) / _plain(name or "campaign")
    several = isinstance(files, Sequence) and not isinstance(files, str)
    options = {
        "map": [map] if isinstance(map, str) else list(map),
        "rate": rate,
        "names": names,
        "table": table,
        "height": _amount(height),
        "speed": _amount(speed),
        "preload": _amount(preload),
        "kind": kind,
        "mass": _amount(mass),
        "travel": _amount(travel),
        "spring_rate": _amount(spring_rate),
        "terms": None if terms is None else list(terms),
        "name": name,
        "material": material,
        "keep_all": keep_all,
        "split_columns": split_columns,
        "least": least,
        "skip_bad": skip_bad,
    }
    paths = [fspath(f) for f in cast("Sequence[Path_]", files)] if several else [fspath(cast(Path_, files))]
    listener = Listener(progress)
    try:
        done = json.loads(_native.import_(paths, fspath(out), options, listener))
    finally:
        listener.close()
    made = Campaign(out)
    made._temporary = temporary
    made.imported = done["taken"]
    return made
