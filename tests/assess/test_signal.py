"""Class filters against endaq, shock spectra against pyyeti, ratings against objective-rating-metrics."""
import numpy as np
import pandas as pd
import pytest
from endaq.calc.filters import butterworth
from objective_rating_metrics.rating import ISO18571
from pyyeti.srs import srs

from .conftest import DRAWN, draw

GRADES = [(0.94, "excellent"), (0.80, "good"), (0.58, "fair"), (-1, "poor")]


def numbers(rows):
    return np.array(rows, dtype=float)


@pytest.mark.parametrize("cfc", [60, 180, 600, 1000, 250])
@pytest.mark.parametrize("shape,seed", DRAWN)
def test_class_filter_against_endaq(signal, agrees, shape, seed, cfc):
    rate = [1e4, 2e4, 5e4, 1e5][seed]
    t, y, _ = draw(shape, seed, rate, 0.05)
    ours = numbers(signal("cfc", rate, cfc, columns=[y])).ravel()
    frame = pd.DataFrame({"y": y}, index=pd.Index(t, name="timestamp"))
    theirs = butterworth(frame, low_cutoff=None, high_cutoff=2.0775 * cfc, half_order=2)["y"].to_numpy()
    agrees("class filter and endaq", np.abs(ours - theirs).max() / np.abs(theirs).max())


@pytest.mark.parametrize("q", [5, 10, 50])
@pytest.mark.parametrize("shape,seed", DRAWN)
def test_shock_spectrum_against_pyyeti(signal, agrees, shape, seed, q):
    rate = [1e4, 2e4, 5e4, 1e5][seed]
    _, y, _ = draw(shape, seed, rate, 0.05)
    frequencies = np.geomspace(rate / 2000, rate / 5, 40)
    ours = numbers(signal("srs", rate, q, *(f"{f:.17g}" for f in frequencies), columns=[y]))
    for column, peak in zip(ours.T, ["abs", "pos", "neg"], strict=True):
        theirs = np.abs(srs(y, rate, frequencies, q, ic="zero", peak=peak, time="total", rolloff="none"))
        agrees(f"shock spectrum ({peak}) and pyyeti", np.abs(column / theirs - 1).max())


@pytest.mark.parametrize("samples", [11, 40, 70, 333, 1000])
@pytest.mark.parametrize("shape,seed", DRAWN)
def test_rating_against_objective_rating_metrics(signal, agrees, shape, seed, samples):
    t, reference, other = draw(shape, seed, 1e4, samples / 1e4)
    *ours, [grade] = signal("rate", columns=[reference, other])
    theirs = ISO18571(np.column_stack([t, reference]), np.column_stack([t, other]))
    scores = [of(ndigits=-1) for of in (theirs.corridor_rating, theirs.phase_rating, theirs.magnitude_rating, theirs.slope_rating, theirs.overall_rating)]
    agrees("scores and objective-rating-metrics", np.abs(numbers(ours).ravel() - scores).max())
    assert grade == next(name for above, name in GRADES if scores[-1] > above)
