"""Effects outside the vocabulary. The diagnosis has stand-ins for some of them; those marked strange it has not."""
import numpy as np

from . import motion as m
from .forms import chained, form, setter


@form("unknown:fracture", "crack", "contact", "di", depends=("contact: depth", "contact: depth and direction", "fracture"))
def _(rng, rig):
    return setter(CRACK_F=rng.uniform(0.35, 0.8) * rig.ref["Fmax"], CRACK_D=lambda s: min(0.4 * s, 0.7))


@form("unknown:bent_scale", "quadratic", "chain", "d", ["penetration"], depends=("reading of penetration: itself", "bent_scale"))
def _(rng, rig):
    way = rng.choice([-1, 1])
    return chained(bent=lambda s: way * 0.5 * s, bent_ref=rig.ref["xmax"])


@form("unknown:corrugated", "periodic", "contact", "di", depends=("contact: depth", "ripple"))
def _(rng, rig):
    return setter(CORR_F=lambda s: 0.2 * s * rig.ref["F"], CORR_W=rng.uniform(0.25, 0.6) * rig.ref["x"])


@form("unknown:jam", "bump", "motion", "dc", depends=("body: place and direction", "jam"))
def _(rng, rig):
    return setter(JAM=lambda s: 0.5 * s * rig.ref["F"], JAM_X=rng.uniform(0.2, 0.6) * rig.ref["x"], JAM_W=rng.uniform(0.05, 0.12) * rig.ref["x"])


@form("unknown:rate_stiffness", "logarithmic", "contact", "d", strange=True, depends=("contact: depth and speed", "contact: depth and speed squared"))
def _(rng, rig):
    return setter(RATE=lambda s: 0.5 * s, RATE_V=rng.uniform(0.05, 0.3) * rig.ref["v"])


@form("unknown:temperature", "swing", "contact", "dci", strange=True, depends=("contact: order",))
def _(rng, rig):
    walk = np.sin(2 * np.pi * (np.arange(40) / rng.uniform(3.5, 6.0) + rng.random()))

    def apply(s, P, ch, r):
        P[m.KFAC] *= 1 + 0.3 * min(s, 1.5) * walk[r.order]
    return apply


@form("unknown:shaken_rig", "hum", "motion", "dc", strange=True, depends=())
def _(rng, rig):
    w = 2 * np.pi * rng.uniform(0.25, 1.2) / rig.ref["T"]
    phase = rng.uniform(0, 2 * np.pi, len(rig.recs))            # another one each time the rig is released

    def apply(s, P, ch, r):
        P[m.VIB], P[m.VIB_W], P[m.VIB_PH] = 0.3 * s * rig.ref["F"], w, phase[r.order - 1]
    return apply


@form("unknown:play", "pick-up", "chain", "d", ["penetration"], strange=True, depends=("reading of penetration: itself",))
def _(rng, rig):
    return chained(play=lambda s: 0.3 * s * rig.ref["x"])
