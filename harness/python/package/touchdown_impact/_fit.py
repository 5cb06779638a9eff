"""The law of a campaign estimated."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Literal, cast

import numpy as np
import pyarrow as pa

from . import _native
from ._campaign import Campaign, Each, Frames
from ._diagnosis import as_campaign
from ._pack import pack
from ._task import Follow, Listener, Path_
from ._values import Columns, Page, Picture, Place, Quantity, Tabular, html_table, quantity, read_json

_UNITS = {"k": "N/m^p", "p": "1", "mu_d": "N s/m^(p+1)"}
_VARIABLES = {"k": "stiffness", "p": "exponent", "mu_d": "hysteresis_damping"}


class Fit(Page, Tabular):
    """The law F = k x^p + mu_d x^p v that fits a campaign best, and the terms its simulation holds beside it."""

    def __init__(self, folder: Path_, place: Place | None = None, words: str | None = None) -> None:
        """The answer in `folder`, of `fit` or of the command.

        Raises: OSError where there is none.
        """
        self.folder = Path(folder)
        self._place = place
        self._words = words
        #: What fit.json holds.
        self.fit: dict[str, Any] = read_json(self.folder, "fit.json")
        #: What certificate.json holds: why the answer may be believed or not.
        self.certificate: dict[str, Any] = read_json(self.folder, "certificate.json")

    @property
    def converged(self) -> bool:
        """Whether it came to its end."""
        return cast(bool, self.fit["converged"])

    @property
    def parameters(self) -> dict[str, Quantity]:
        """k, p and mu_d with 95 % intervals, and the quantities of the terms by "term: quantity"."""
        law = {n: quantity(self.fit["parameters"][n], unit, self.fit["ci95"][n]) for n, unit in _UNITS.items()}
        terms = {n: quantity(t["value"], t["unit"], t["ci95"]) for n, t in self.certificate["terms"].items()}
        return law | terms

    def fmu(self, path: Path_) -> Path:
        """Writes the contact element with this law to `path`.

        Raises: TouchdownError where it cannot be packed or written.
        """
        return pack(path, {v: self.fit["parameters"][n] for n, v in _VARIABLES.items()}).path

    def _columns(self) -> Columns:
        """The parameters, a row each."""
        rows = self.parameters
        number = pa.float64()
        columns = {
            "parameter": pa.array(list(rows), pa.string()),
            "value": pa.array([q.value for q in rows.values()], number),
            "low": pa.array([q.low for q in rows.values()], number),
            "high": pa.array([q.high for q in rows.values()], number),
            "unit": pa.array([q.unit for q in rows.values()], pa.string()),
        }
        return columns

    def plot(self) -> Picture:
        """How the objective fell, and the misfit of every channel by recording."""
        figure = Picture(8, 6)
        fall, misfit = figure.subplots(2)
        fall.semilogy(self.fit["objective"], marker=".")
        fall.set(xlabel="iteration", ylabel="objective", title=self.certificate["campaign"])
        files = list(self.fit["nrmse"])
        channels = sorted({c for of in self.fit["nrmse"].values() for c in of})
        width = 0.8 / max(len(channels), 1)
        for i, channel in enumerate(channels):
            values = [100.0 * (self.fit["nrmse"][f].get(channel) or 0.0) for f in files]
            misfit.bar(np.arange(len(files)) + (i + 0.5) * width - 0.4, values, width, label=channel)
        misfit.set_xticks(range(len(files)), files, rotation=45, ha="right")
        misfit.set_ylabel("misfit [% of range]")
        misfit.legend(fontsize="small")
        return figure

    def _repr_html_(self) -> str:
        return html_table(["parameter", "value"], [[name, str(q)] for name, q in self.parameters.items()])

    def __repr__(self) -> str:
        return f"Fit({str(self.folder)!r})"


def fit(
    data: Path_ | Campaign | Frames,
    *,
    mass: float | None = None,
    speed: Each = None,
    height: Each = None,
    out: Path_ | None = None,
    method: Literal["lm", "simplex"] = "lm",
    seconds: float = 600.0,
    progress: Follow = True,
) -> Fit:
    """Estimates the law from the recordings of a campaign.

    data, mass, speed, height: as `diagnose` takes them. out: folder for the answer; a temporary one unless given. method: lm,
    Levenberg-Marquardt, or simplex, Nelder and Mead's. seconds: after which the best so far is the answer, above 0. progress:
    see `Progress`.

    Raises: TouchdownError with everything wrong with the campaign, or where there was no fit within `seconds`. KeyboardInterrupt
    within a second of Ctrl-C.
    """
    campaign = as_campaign(data, mass, speed, height, progress)
    place = Place(out)
    listener = Listener(progress)
    try:
        done = _native.fit(campaign.folder, place.path, method, seconds, listener)
    finally:
        listener.close()
    return Fit(place.path, place, json.loads(done)["words"])
