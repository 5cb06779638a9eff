"""Scenarios and systems of FMUs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow.parquet

from . import _native
from ._task import Fmus, Follow, Listener, Path_
from ._values import Columns, Page, Picture, Place, Tabular, html_table, read_json, read_rows


class Run(Page, Tabular):
    """What a simulation came to."""

    def __init__(self, folder: Path_, place: Place | None = None, words: str | None = None) -> None:
        """The answer in `folder`, of `run` or of the command.

        Raises: OSError where there is none.
        """
        self.folder = Path(folder)
        self._place = place
        self._words = words
        #: What summary.json holds.
        self.summary: dict[str, Any] = read_json(self.folder, "summary.json")

    @property
    def impacts(self) -> list[dict[str, Any]]:
        """The impacts of every run in order, SI; none of a system of FMUs."""
        return [impact for run in self.summary.get("runs", []) for impact in run["impacts"]]

    @property
    def parameters(self) -> dict[str, float]:
        """The law of the first run: stiffness N/m^p, exponent, mass kg; none of a system of FMUs."""
        first: dict[str, Any] = next(iter(self.summary.get("runs", [])), {})
        return {name: first[name] for name in ("stiffness", "exponent", "mass") if name in first}

    def _columns(self) -> Columns:
        """Everything simulated, a row a step; columns with their unit."""
        rows = self.folder / "results.csv"
        if rows.is_file():
            return read_rows(self.folder, rows.name)
        return pyarrow.parquet.read_table(self.folder / "results.parquet")

    def plot(self) -> Picture:
        """Force over time, or of a system of FMUs every column, each run a line."""
        rows = self.to_frame("arrow")
        names = [n for n in rows.column_names if n == "force [N]"] or [
            n for n in rows.column_names if n not in ("run [1]", "time [s]")
        ]
        figure = Picture(8, 2.2 * len(names) + 1.4)
        runs = rows["run [1]"].to_numpy() if "run [1]" in rows.column_names else None
        time = rows["time [s]"].to_numpy()
        for axes, name in zip(figure.subplots(len(names), sharex=True, squeeze=False)[:, 0], names, strict=True):
            values = rows[name].to_numpy()
            if runs is None:
                axes.plot(time, values)
            else:
                for run in sorted(set(runs.tolist())):
                    axes.plot(time[runs == run], values[runs == run], label=f"run {run:.0f}")
            axes.set_ylabel(name)
        axes.set_xlabel("time [s]")
        return figure

    def _repr_html_(self) -> str:
        names = [("impact_speed", "m/s"), ("deepest", "m"), ("peak_force", "N"), ("restitution", "1"), ("duration", "s")]
        rows = [[f"{impact[name]:.6g}" for name, _ in names] for impact in self.impacts]
        return html_table([f"{name.replace('_', ' ')} [{unit}]" for name, unit in names], rows)


def run(
    scenario: Path_,
    *,
    out: Path_ | None = None,
    fmu: Path_ | None = None,
    direct: bool = False,
    parquet: bool = False,
    step: float | None = None,
    stop: float | None = None,
    fmus: Fmus = Fmus(),
    progress: Follow = True,
) -> Run:
    """Runs a scenario (drop test, contactor opening), or a system of FMUs.

    scenario: scenario file, system file or SSP 1.0 archive. out: folder for the answer; a temporary one unless given. fmu: FMU
    to run instead of our own. direct: calls the law without an FMU. parquet: writes results.parquet too. step, stop:
    of a system, the macro-step and the end in place of its own, s. fmus: where somebody else's FMUs run. progress: see
    `Progress`.

    Raises: TouchdownError for what is wrong with the file, an FMU or the motion; what was computed before is in `out`.
    KeyboardInterrupt within a second of Ctrl-C.
    """
    if fmu is not None and direct:
        raise TypeError("fmu and direct cannot be given at once")
    place = Place(out)
    listener = Listener(progress)
    try:
        done = _native.run(scenario, place.path, fmu, direct, parquet, step, stop, fmus._options(), listener)
    finally:
        listener.close()
    return Run(place.path, place, json.loads(done)["words"])
