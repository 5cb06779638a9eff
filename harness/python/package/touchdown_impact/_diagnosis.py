"""What physics a simulation leaves out."""

from __future__ import annotations

import html
import json
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast, overload

import pyarrow as pa

from . import _native
from ._campaign import Campaign, Each, Frames, import_
from ._task import Fmus, Follow, Listener, Path_
from ._values import Columns, Library, Page, Picture, Place, Quantity, Tabular, html_table, quantity, read_json, read_rows, table

if TYPE_CHECKING:
    import pandas
    import polars


@dataclass(frozen=True)
class Cause:
    """A cause weighed: names of mechanisms, none (nothing is missing), or "unknown"."""

    mechanisms: tuple[str, ...]
    probability: float

    def __str__(self) -> str:
        return f"{' and '.join(self.mechanisms) or 'nothing is missing'}: {self.probability:.4f}"


@dataclass(frozen=True)
class Missing:
    """A mechanism that the simulation leaves out."""

    mechanism: str
    form: str
    probability: float
    parameters: dict[str, Quantity]
    #: Names that these recordings cannot part from it.
    also_possible: tuple[str, ...]
    text: str
    equation: str
    source: str
    cure: str


def _verdict(folder: Path) -> dict[str, Any]:
    """What verdict.json in `folder` holds."""
    found = read_json(folder, "verdict.json")
    if found.get("format") != "verdict/1":
        raise _native.TouchdownError(f"{folder / 'verdict.json'}: is no verdict/1; diagnose this campaign again")
    return found


class Diagnosis(Page, Tabular):
    """What a simulation leaves out, how sure that is, and an FMU that holds it."""

    def __init__(
        self,
        folder: Path_,
        campaign: Campaign | None = None,
        place: Place | None = None,
        words: str | None = None,
    ) -> None:
        """The answer in `folder`, of `diagnose` or of the command; `campaign` is wanted for `plot` alone.

        Raises: OSError where there is none; TouchdownError where its verdict.json cannot be read or is of another format.
        """
        self.folder = Path(folder)
        self.campaign = campaign
        self._place = place
        self._words = words
        #: What verdict.json holds, in the format verdict/1.
        self.verdict: dict[str, Any] = _verdict(self.folder)

    @property
    def judged(self) -> bool:
        """Whether the campaign could be judged; where not, `reason` says why."""
        return "invalid" not in self.verdict

    @property
    def reason(self) -> str | None:
        """Why nothing can be judged."""
        return cast("str | None", self.verdict.get("invalid", {}).get("text"))

    @property
    def detected(self) -> bool:
        """Whether simulation and recordings differ by more than noise and tolerances."""
        return cast(bool, self.verdict["mismatch"]["detected"])

    @property
    def missing(self) -> list[Missing]:
        """The mechanisms named, in the order they were found."""
        return [
            Missing(
                m["mechanism"],
                m["form"],
                m["probability"],
                {n: quantity(p["value"], p["unit"], p.get("ci95")) for n, p in m["parameters"].items()},
                tuple(m["also_possible"]),
                m["text"],
                m["equation"],
                m["source"],
                m["cure"],
            )
            for m in self.verdict["missing"]
        ]

    @property
    def parameters(self) -> dict[str, Quantity]:
        """Parameters of what is missing by "mechanism.parameter", with 95 % intervals."""
        return {f"{m.mechanism}.{n}": q for m in self.missing for n, q in m.parameters.items()}

    @property
    def posterior(self) -> list[Cause]:
        """Every cause weighed, the most probable first."""
        return [Cause(tuple(c["mechanisms"]), c["probability"]) for c in self.verdict.get("posterior", [])]

    @property
    def credible_set(self) -> list[tuple[str, ...]]:
        """The fewest causes that hold the true one with 95 %."""
        return [tuple(c["mechanisms"]) for c in self.verdict.get("credible_set", [])]

    def fmu(self, path: Path_ | None = None) -> Path:
        """The contact element calibrated, with what it can hold of what is missing. Written to `path` where that is given.

        Raises: TouchdownError with the reason where there is none; OSError where it cannot be written.
        """
        name = self.verdict.get("element", {}).get("fmu")
        if name is None:
            why = self.verdict.get("element", {}).get("text") or self.reason or "the diagnosis wrote none"
            raise _native.TouchdownError(f"{self.folder}: there is no FMU: {why}")
        return self._file(name, path)

    def _columns(self) -> Columns:
        """The parameters of what is missing, a row each."""
        rows = [(m, n, q) for m in self.missing for n, q in m.parameters.items()]
        number = pa.float64()
        columns = {
            "mechanism": pa.array([m.mechanism for m, _, _ in rows], pa.string()),
            "form": pa.array([m.form for m, _, _ in rows], pa.string()),
            "probability": pa.array([m.probability for m, _, _ in rows], number),
            "parameter": pa.array([n for _, n, _ in rows], pa.string()),
            "value": pa.array([q.value for _, _, q in rows], number),
            "low": pa.array([q.low for _, _, q in rows], number),
            "high": pa.array([q.high for _, _, q in rows], number),
            "unit": pa.array([q.unit for _, _, q in rows], pa.string()),
        }
        return columns

    @overload
    def predictions(self, library: Literal["pandas"] = ...) -> pandas.DataFrame: ...
    @overload
    def predictions(self, library: Literal["polars"]) -> polars.DataFrame: ...
    @overload
    def predictions(self, library: Literal["arrow"]) -> pa.Table: ...
    def predictions(self, library: Library = "pandas") -> pandas.DataFrame | polars.DataFrame | pa.Table:
        """Every recording as predicted by fits without its level: file, simulation (before or after), channels as recorded.

        Raises: TouchdownError where nothing was judged; ModuleNotFoundError where the library is not installed.
        """
        parts = []
        for simulation in ("before", "after"):
            for path in sorted((self.folder / "predictions" / simulation).glob("*.csv")):
                rows = read_rows(self.folder, f"predictions/{simulation}/{path.name}")
                rows = rows.add_column(0, "simulation", pa.array([simulation] * len(rows), pa.string()))
                parts.append(rows.add_column(0, "file", pa.array([path.name] * len(rows), pa.string())))
        if not parts:
            raise _native.TouchdownError(f"{self.folder}: there are no predictions: {self.reason or 'none is there'}")
        return table(pa.concat_tables(parts, promote_options="default"), library)

    def plot(self, recording: str | None = None) -> Picture:
        """Recorded, simulated as given, and with what is missing: each channel of a recording over time, predicted by fits
        without its level. The first recording unless its file is named.

        Raises: TouchdownError where nothing was judged, or the campaign is not known; ValueError for no such recording.
        """
        files = sorted(p.name for p in (self.folder / "predictions" / "before").glob("*.csv"))
        if not files:
            raise _native.TouchdownError(f"{self.folder}: there is nothing to plot: {self.reason or 'no predictions'}")
        name = recording or files[0]
        if name not in files:
            raise ValueError(f"{name} is no recording; give one of {', '.join(files)}")
        courses = {}
        if self.campaign is not None and (self.campaign.folder / name).is_file():
            courses["recorded"] = (self.campaign.folder, name, "0.55")
        for simulation, color in (("before", "tab:red"), ("after", "tab:blue")):
            if (self.folder / "predictions" / simulation / name).is_file():
                courses[simulation] = (self.folder, f"predictions/{simulation}/{name}", color)
        tables = {label: read_rows(folder, file) for label, (folder, file, _) in courses.items()}
        clock, *channels = tables["before"].column_names
        figure = Picture(8, 2.2 * len(channels) + 1)
        all_axes = figure.subplots(len(channels), sharex=True, squeeze=False)[:, 0]
        for axes, channel in zip(all_axes, channels, strict=True):
            for label, rows in tables.items():
                if channel in rows.column_names:
                    axes.plot(rows[clock], rows[channel], label=label, color=courses[label][2], linewidth=1)
            axes.set_ylabel(channel)
        all_axes[0].legend(fontsize="small")
        all_axes[-1].set_xlabel(clock)
        figure.suptitle(f"{self.verdict['campaign']}, {name}")
        return figure

    def _repr_html_(self) -> str:
        causes = [[str(c).rsplit(":", 1)[0], f"{c.probability:.4f}"] for c in self.posterior[:5]]
        values = [[name, str(q)] for name, q in self.parameters.items()]
        out = f"<p><b>{html.escape(self.sentence)}</b></p>"
        if causes:
            out += html_table(["cause", "probability"], causes)
        if values:
            out += html_table(["parameter", "value"], values)
        return out

    def __repr__(self) -> str:
        return f"Diagnosis({str(self.folder)!r})"


def as_campaign(
    data: Path_ | Campaign | Frames, mass: float | None, speed: Each, height: Each, progress: Follow
) -> Campaign:
    """A campaign of a folder, of the files of instruments in a folder, or of tables."""
    if isinstance(data, Campaign) or (isinstance(data, str | PathLike) and (Path(data) / "campaign.toml").is_file()):
        if mass is not None or speed is not None or height is not None:
            raise TypeError("mass, speed and height of a campaign stand in its campaign.toml; leave them out")
        return data if isinstance(data, Campaign) else Campaign(data)
    if isinstance(data, str | PathLike):
        folder = Path(data)
        files = sorted(p for p in folder.iterdir() if p.is_file() and not p.name.startswith(".")) if folder.is_dir() else []
        if not files:
            return Campaign(folder)
        if not all(v is None or isinstance(v, int | float) for v in (speed, height)):
            raise TypeError("files of instruments have one speed or height; for several give import_ a table or names")
        name = folder.resolve().name
        speed, height = cast("float | None", speed), cast("float | None", height)
        return import_(files, mass=mass, speed=speed, height=height, name=name, progress=progress)
    return Campaign.of(data, mass=mass, speed=speed, height=height)


def diagnose(
    data: Path_ | Campaign | Frames,
    *,
    mass: float | None = None,
    speed: Each = None,
    height: Each = None,
    out: Path_ | None = None,
    bootstrap: int = 0,
    seconds: float | None = None,
    jobs: int | None = None,
    resume: bool = False,
    platforms: Path_ | None = None,
    fmus: Fmus = Fmus(),
    progress: Follow = True,
) -> Diagnosis:
    """Says what physics the simulation of a campaign leaves out.

    data: folder of a campaign, folder of instruments' files, a `Campaign`, or a table for each recording (of pandas, polars,
    pyarrow, or a dict of arrays), as `Campaign.of` takes them. mass: moving mass, kg, speed: at touch, m/s, and height: of the
    drop, m, where `data` is no campaign yet.
    out: folder for the answer, which goes into a folder in it as the command has it; a temporary one unless given. bootstrap:
    whole campaigns simulated for the false-alarm probability, some seconds each. seconds: that it may take; what is not
    judged by then is answered as not judged. jobs: threads; one a processor unless given. resume: leaves an answer in `out`
    that is whole and of the same input. platforms: folder of the element's libraries for other platforms. fmus: where somebody
    else's FMUs run. progress: see `Progress`.

    The same campaign gives the same files as the command `touchdown diagnose`.

    Raises: TouchdownError with everything wrong with the campaign. KeyboardInterrupt within a second of Ctrl-C; nothing is
    written then.
    """
    campaign = as_campaign(data, mass, speed, height, progress)
    place = Place(out)
    listener = Listener(progress)
    try:
        done = _native.diagnose(
            [campaign.folder],
            place.path,
            platforms,
            jobs,
            bootstrap,
            seconds,
            resume,
            fmus._options(),
            listener,
        )
    finally:
        listener.close()
    listener.raise_errors()
    answers: list[list[str]] = json.loads(done)["answers"]
    return Diagnosis(answers[0][1], campaign, place, "\n".join(listener.answers) or None)

