"""Effects that sit in the measuring chain."""
import numpy as np

from . import motion as m
from .forms import DIC, chained, form


@form("sensor_resonance", "second-order", "chain", "dc", ["force"])
def _(rng, rig):
    z = rng.uniform(0.01, 0.06)
    return chained(resonance=lambda s: (0.9 / (max(s, 0.02) * rig.ref["T"]), z))


@form("sensor_resonance", "tip-mass", "chain", "d", ["force"])
def _(rng, rig):
    ratio, z = rng.uniform(0.02, 0.08), rng.uniform(0.01, 0.06)

    def apply(s, P, ch, r):
        P[m.BMODE], P[m.MB] = 2.0, ratio * P[m.M]
        w = 2 * np.pi * 0.9 / (max(s, 0.02) * rig.ref["T"])
        P[m.KB] = P[m.MB] * w * w
        P[m.CB] = 2 * z * P[m.MB] * w
    return apply


@form("sensor_resonance", "two-modes", "chain", "dc", ["force"])
def _(rng, rig):
    z, apart, share = rng.uniform(0.01, 0.06), rng.uniform(1.5, 2.6), rng.uniform(0.2, 0.45)
    return chained(resonance=lambda s: (0.9 / (max(s, 0.02) * rig.ref["T"]), z), modes=((apart, share),))


@form("sensor_resonance", "three-modes", "chain", "dc", ["force"], strange=True)
def _(rng, rig):
    z, first, second = rng.uniform(0.01, 0.06), rng.uniform(1.4, 2.0), rng.uniform(2.4, 3.4)
    modes = ((first, rng.uniform(0.15, 0.35)), (second, rng.uniform(0.1, 0.3)))
    return chained(resonance=lambda s: (0.9 / (max(s, 0.02) * rig.ref["T"]), z), modes=modes)


def _channel(rng, rig, accel=0.25):
    have = [c for c in ("force", "acceleration") if c in rig.channels]
    if len(have) == 2:
        return "acceleration" if rng.random() < accel and rig.kind == "drop-test" else "force"
    return have[0]


@form("charge_droop", "first-order", "chain", "dc", ["force"])
def _(rng, rig):
    c = _channel(rng, rig)
    return chained(droop=lambda s: (c, 1, rig.ref["T"] / max(s, 1e-6)))


@form("charge_droop", "second-order", "chain", "dc", ["force"])
def _(rng, rig):
    c = _channel(rng, rig)
    return chained(droop=lambda s: (c, 2, 2 * rig.ref["T"] / max(s, 1e-6)))


@form("charge_droop", "shelf", "chain", "dc", ["force"])
def _(rng, rig):
    c, share = _channel(rng, rig), rng.uniform(0.3, 0.7)      # only a share of the charge leaks away
    return chained(droop=lambda s: (c, 1, share * rig.ref["T"] / max(s, 1e-6)), droop_share=share)


@form("charge_droop", "two-corners", "chain", "dc", ["force"], strange=True)
def _(rng, rig):
    c, apart = _channel(rng, rig), rng.uniform(3.0, 12.0)     # amplifier and logger each AC-coupled, not alike
    return chained(droop=lambda s: (c, 1, rig.ref["T"] / max(s, 1e-6)), second_droop=apart)


def _lag(kind, order):
    def make(rng, rig):
        c = _channel(rng, rig)
        return chained(lowpass=lambda s: (c, kind, order, order / (0.3 * max(s, 1e-6) * rig.ref["T"])))
    return make


form("lowpass_lag", "first-order", "chain", "dc", ["force|acceleration"])(_lag("lag", 1))
form("lowpass_lag", "second-order", "chain", "dc", ["force|acceleration"])(_lag("lag", 2))
form("lowpass_lag", "bessel-4", "chain", "dc", ["force|acceleration"])(_lag("bessel", 4))
form("lowpass_lag", "rc-3", "chain", "d", ["force|acceleration"], strange=True)(_lag("rc", 3))


@form("channel_skew", "late", "chain", "dc", ["force"])
def _(rng, rig):
    return chained(skew=lambda s: ("force", 0.2 * s * rig.ref["T"]))


@form("channel_skew", "early", "chain", "dc", ["force"])
def _(rng, rig):
    return chained(skew=lambda s: ("force", -0.2 * s * rig.ref["T"]))


@form("channel_skew", "acceleration-late", "chain", "d", ["acceleration"])
def _(rng, rig):
    return chained(skew=lambda s: ("acceleration", 0.2 * s * rig.ref["T"]))


@form("channel_skew", "drifting-clock", "chain", "dc", ["force"], strange=True)
def _(rng, rig):
    late, drift = rng.choice([-0.2, 0.2]), rng.uniform(0.4, 0.9)     # another logger, whose clock runs at another rate
    return chained(skew=lambda s: ("force", late * s * rig.ref["T"]), skew_drift=lambda s: late * s * drift * rig.ref["T"] / rig.ref["length"])


@form("clipping", "hard", "chain", DIC, ["force|acceleration"])
def _(rng, rig):
    c = _channel(rng, rig)
    return chained(clip=lambda s: (c, 1 - min(s, 0.6), False))


@form("clipping", "soft", "chain", DIC, ["force|acceleration"])
def _(rng, rig):
    c = _channel(rng, rig)
    return chained(clip=lambda s: (c, 1.05 - min(s, 0.6), True))


@form("clipping", "slow-recovery", "chain", "dc", ["force|acceleration"])
def _(rng, rig):
    c, dwell = _channel(rng, rig), rng.uniform(0.03, 0.1) * rig.ref["T"]    # an amplifier that stays overloaded for a while
    return chained(clip=lambda s: (c, 1 - min(s, 0.6), dwell))


@form("clipping", "sagging", "chain", "dc", ["force|acceleration"], strange=True)
def _(rng, rig):
    # a supply that gives way while the amplifier is overloaded
    c, share, time = _channel(rng, rig), rng.uniform(0.03, 0.12), rng.uniform(0.05, 0.3) * rig.ref["T"]
    return chained(clip=lambda s: (c, 1 - min(s, 0.6), (share, time)))


@form("force_gain", "high", "chain", "dc", ["force", "acceleration|penetration"])
def _(rng, rig):
    return chained(gain=lambda s: 1 + 0.3 * s)


@form("force_gain", "low", "chain", "dc", ["force", "acceleration|penetration"])
def _(rng, rig):
    return chained(gain=lambda s: 1 / (1 + 0.3 * s))


@form("force_gain", "warming", "chain", "dc", ["force", "acceleration|penetration"])
def _(rng, rig):
    n, way = len(rig.recs), rng.choice([-1, 1])

    def apply(s, P, ch, r):                 # the amplifier warms up: the gain moves from recording to recording
        ch["gain"] = (1 + 0.3 * s * (0.6 + 0.8 * (r.order - 1) / (n - 1))) ** way
    return apply


@form("force_gain", "settling", "chain", "dc", ["force", "acceleration|penetration"], strange=True)
def _(rng, rig):
    orders, way = rng.uniform(0.7, 3.0), rng.choice([-1, 1])

    def apply(s, P, ch, r):                 # a charge amplifier that settles after it was switched on
        ch["gain"] = (1 + 0.3 * s * (1 - 0.7 * np.exp(-(r.order - 1) / orders))) ** way
    return apply
