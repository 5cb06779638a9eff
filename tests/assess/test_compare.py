"""`touchdown compare --json` against the same steps taken with endaq, pyyeti and objective-rating-metrics; bounces against exact ones."""
import numpy as np
import pandas as pd
import pytest
from endaq.calc.filters import butterworth
from objective_rating_metrics.rating import ISO18571
from pyyeti.srs import srs

from .conftest import DRAWN, draw

G = 9.81


def write(path, head, *columns):
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=head, comments="", fmt="%.17g")
    return path


@pytest.mark.parametrize("rate", [1e4, 4e4])
@pytest.mark.parametrize("shape,seed", DRAWN)
def test_filtered_rated_and_shocked_as_others_do(compare, tmp_path, agrees, shape, seed, rate):
    t, *both = draw(shape, seed, rate, 0.06)
    heads = ["time [ms],acceleration [g]", "time [s],velocity [m/s],acceleration [m/s^2]"]
    answer = compare(
        write(tmp_path / "r.csv", heads[0], t * 1e3, both[0] / 9.80665),
        write(tmp_path / "s.csv", heads[1], t, np.full_like(t, np.nan), both[1]),
        "--cfc", 180, "--srs", 12)
    assert (answer["samples"], answer["rating_rate"]) == (t.size, 1e4)
    [channel] = answer["channels"]
    frame = pd.DataFrame(dict(zip("rs", both)), index=pd.Index(t, name="timestamp"))
    filtered = butterworth(frame, low_cutoff=None, high_cutoff=2.0775 * 180, half_order=2)
    largest = {}
    for name, file in zip("rs", ["recording", "simulation"]):
        y = filtered[name].to_numpy()
        peak = np.abs(y).argmax()
        agrees("compare's peak", abs(channel[file]["peak"] / y[peak] - 1))
        agrees("compare's time of peak", abs(channel[file]["time"] - t[peak]) / t[-1])
        for column, method in [("maximax", "abs"), ("positive", "pos"), ("negative", "neg")]:
            theirs = np.abs(srs(y, rate, np.array(answer["spectra"]["frequency"]), 12, ic="zero", peak=method, time="total", rolloff="none"))
            largest[name] = max(largest.get(name, 0), theirs.max())
            agrees("compare's shock spectra and pyyeti", np.abs(np.array(answer["spectra"][file][column]) - theirs).max() / largest[name])
    step = round(rate / 1e4)
    theirs = ISO18571(*(np.column_stack([t, filtered[name]])[::step] for name in "rs"))
    for score in ["corridor", "phase", "magnitude", "slope", "overall"]:
        agrees("compare's scores and objective-rating-metrics", abs(channel["rating"][score] - getattr(theirs, f"{score}_rating")(ndigits=-1)))
    r, s = filtered["r"], filtered["s"]
    agrees("compare's normalised rms", abs(channel["normalised_rms"] / (np.sqrt(np.mean((r - s) ** 2)) / (r.max() - r.min())) - 1))


def ball(rng, rate):
    """A dropped ball that bounces some times and comes to rest: time, penetration, restitutions, touches."""
    height, e, contact = rng.uniform(0.01, 0.2), rng.uniform(0.3, 0.8, size=rng.integers(2, 6)), rng.uniform(5e-4, 2e-3)
    start = rng.uniform(0, 0.05)
    touch = start + np.sqrt(2 * height / G)
    pieces, touches, v = [(start, touch, -height, 0.0, G)], [touch], G * (touch - start)
    for k in e:
        pieces.append((touch, touch + contact, 0.0, v, -(1 + k) * v / contact))
        v *= k
        pieces.append((touch + contact, touch + contact + 2 * v / G, 0.0, -v, G))
        touch = pieces[-1][1]
        touches.append(touch)
    t = np.arange(0, touch + 0.01, 1 / rate)
    x = np.where(t < start, -height, 1e-3)
    for a, b, x0, v0, acceleration in pieces:
        u = t - a
        x = np.where((t >= a) & (t < b), x0 + v0 * u + acceleration * u * u / 2, x)
    return t, x, e, np.array(touches)


@pytest.mark.parametrize("seed", range(6))
def test_bounces_of_a_ball(compare, tmp_path, agrees, seed):
    rng = np.random.default_rng([seed, 18])
    t, x, e, touches = ball(rng, 5e4)
    closed = write(tmp_path / "s.csv", "time [s],force [N],closed [1]", t, 1e5 * np.clip(x, 0, None), x > 0)
    answer = compare(write(tmp_path / "r.csv", "time [s],penetration [mm],force [N]", t, 1e3 * x, 1e5 * np.clip(x, 0, None)), closed)["bounces"]
    by_position, by_events = answer["recording"], answer["simulation"]
    assert (by_position["by"], by_events["by"]) == ("penetration", "closed")
    for b, finest in [(by_position, 1e-6), (by_events, 1 / 5e4)]:
        assert b["count"] == touches.size
        assert abs(b["first"] - touches[0]) <= finest
        assert abs(b["bounce_time"] - (touches[-1] - touches[0])) <= finest
        assert [i["touch"] for i in b["impacts"]] == pytest.approx(touches, abs=finest)
    restitution = [i["restitution"] for i in by_position["impacts"]]
    assert restitution[-1] is None
    agrees("bounces: restitution and the ball's", np.abs(np.array(restitution[:-1]) / e - 1).max())
    # under gravity alone the flight after an impact over the flight before is its restitution
    agrees("bounces: flight times and the ball's", np.abs(np.array([i["flight_ratio"] for i in by_position["impacts"][1:-1]]) / e[1:] - 1).max())
    assert [i["flight_ratio"] for i in by_events["impacts"][1:-1]] == pytest.approx(e[1:], rel=0.02)


@pytest.mark.parametrize("seed", range(8))
def test_noise_is_no_bounce(compare, tmp_path, seed):
    rng = np.random.default_rng([seed, 19])
    t, x, e, touches = ball(rng, 5e4)
    force = 1e5 * np.clip(x, 0, None)
    position = write(tmp_path / "r.csv", "time [s],penetration [m]", t, x + 2e-6 * rng.normal(size=t.size))
    transducer = write(tmp_path / "s.csv", "time [s],force [N]", t, force + 0.005 * force.max() * rng.normal(size=t.size))
    answer = compare(position, transducer)["bounces"]
    for b, by in [(answer["recording"], "penetration"), (answer["simulation"], "force")]:
        assert (b["by"], b["count"]) == (by, touches.size)
        assert b["bounce_time"] == pytest.approx(touches[-1] - touches[0], abs=5e-4)
    assert answer["recording"]["impacts"][0]["restitution"] == pytest.approx(e[0], rel=0.05)
