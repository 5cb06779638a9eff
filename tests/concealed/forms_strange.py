"""Strangers: effects of no vocabulary, in two halves.

The development half may be looked at while the diagnosis is worked on. The sealed half may not: campaigns of it are drawn
by tests/prove only, and no setting is chosen by them. Which half a stranger is in is fixed here and printed by the proof.
"""
import numpy as np

from . import motion as m
from .forms import FORMS, chained, form, setter

HALF = {}            # name -> "development" or "sealed"


def stranger(half, name, *rest, depends):
    """Registers a maker as `form` does, and which half the stranger is in."""
    HALF[f"unknown:{name}"] = half
    return form(f"unknown:{name}", *rest, strange=True, depends=depends)


def of_half(half):
    """The strangers of one half, sorted."""
    return sorted(n for n, h in HALF.items() if h == half)


# --- development half -----------------------------------------------------------------------------------------------

@stranger("development", "leaf_friction", "layers", "contact", "dci", depends=("contact: depth and direction",))
def _(rng, rig):
    # layers that rub on each other: a loss in proportion to the force, whatever the speed (Coulomb's leaf spring)
    return setter(LOSS=lambda s: min(0.4 * s, 0.6), LOSS_V=0.02 * rig.ref["v"])


@stranger("development", "buckling_wall", "gives-way", "contact", "di", depends=("contact: depth",))
def _(rng, rig):
    return setter(PLAT=lambda s: min(0.6 * s, 0.6), PLAT_X=rng.uniform(0.4, 0.7) * rig.ref["xmax"], PLAT_W=rng.uniform(0.04, 0.1) * rig.ref["xmax"])


@stranger("development", "drying", "damping", "contact", "dc", depends=("contact: order",))
def _(rng, rig):
    # a film that is used up: damping that is there at first and gone later
    n = rng.uniform(1.5, 4.0)

    def apply(s, P, ch, r):
        P[m.CV] = 0.8 * s * rig.ref["F"] / rig.ref["v"] * np.exp(-(r.order - 1) / n)
        P[m.CV_RAMP] = 0.05 * rig.ref["x"]
    return apply


@stranger("development", "side_load", "oblique", "motion", "dc", depends=("contact: depth and direction", "body: place and direction"))
def _(rng, rig):
    # the stop's force is oblique, and presses the body against its guide
    return setter(SIDE=lambda s: min(0.4 * s, 0.6))


@stranger("development", "latch", "magnet", "motion", "d", depends=("body: place",))
def _(rng, rig):
    # a magnet in the stop: pulls the closer the harder, both ways
    return setter(LA_F=lambda s: 0.5 * s * rig.ref["F"], LA_Z=rng.uniform(0.8, 3.0) * rig.ref["x"])


@stranger("development", "bent_force", "quadratic", "chain", "dci", ["force"], depends=("reading of force: itself", "bent_scale"))
def _(rng, rig):
    way = rng.choice([-1, 1])
    return chained(straight=lambda s: {"force": (way * 0.5 * min(s, 0.8), rig.ref["Fmax"])})


@stranger("development", "zero_shift", "after-the-peak", "chain", "d", ["acceleration"], depends=())
def _(rng, rig):
    # a piezoelectric element whose zero jumps under shock (Chu 1987)
    way, rise = rng.choice([-1, 1]), rng.uniform(0.02, 0.1) * rig.ref["T"]
    return chained(zero_shift=lambda s: ("acceleration", way * 0.2 * s * rig.ref["Fmax"] / rig.P[m.M], rise))


@stranger("development", "thickening", "beyond-a-speed", "contact", "dc", depends=("contact: depth and speed", "contact: depth and speed squared"))
def _(rng, rig):
    # a shear-thickening pad: no damping below a speed, much above (Barnes 1989)
    v = rng.uniform(0.4, 0.7) * rig.ref["v"]
    return setter(TH=lambda s: s * rig.ref["F"] / rig.ref["v"] / (rig.ref["v"] - v), TH_V=v, TH_D=0.1 * rig.ref["x"])


@stranger("development", "skin", "breaks", "contact", "di", depends=("contact: depth and direction", "fracture"))
def _(rng, rig):
    # a skin, ice or paint, that bears until it breaks, once a recording
    return setter(SKIN_F=lambda s: 0.5 * s * rig.ref["F"], SKIN_D=rng.uniform(0.15, 0.4) * rig.ref["x"])


@stranger("development", "mass_lost", "by-order", "motion", "d", ["force|penetration"], depends=())
def _(rng, rig):
    # the body loses mass from recording to recording (a load of powder, a leaking tank)
    n = len(rig.recs)

    def apply(s, P, ch, r):
        P[m.M] *= 1 - 0.5 * min(s, 1.0) * (r.order - 1) / max(n - 1, 1)
    return apply


@stranger("development", "pawl", "one-way", "motion", "dc", depends=("body: place and direction", "body: speed"))
def _(rng, rig):
    weight = rig.P[m.M] * 9.81 if rig.kind == "drop-test" else rig.recs[0].preload
    return setter(PAWL=lambda s: 5 * s * weight)


@stranger("development", "bracket", "gives", "chain", "dc", ["penetration"], depends=("reading of penetration: force",))
def _(rng, rig):
    # the displacement sensor's holder gives under the force of the impact, and rings
    f, zeta = rng.uniform(1.0, 4.0) / rig.ref["T"], rng.uniform(0.05, 0.3)
    return chained(bracket=lambda s: (0.4 * s * rig.ref["x"] / rig.ref["F"], f, zeta))


@stranger("development", "rubbing_sensor", "play", "chain", "dci", ["force"], depends=("reading of force: itself",))
def _(rng, rig):
    # a part of the force goes through a joint with play (Prandtl 1928)
    width = rng.uniform(0.1, 0.4) * rig.ref["F"]
    return chained(rub=lambda s: (min(0.6 * s, 0.9), width))


@stranger("development", "lost_samples", "within-the-contact", "chain", "d", ["force"], depends=())
def _(rng, rig):
    # the logger drops a block of one channel: what comes after it comes early
    at, c = rng.uniform(0.3, 0.8), "force"

    def apply(s, P, ch, r):
        ch["lost"] = (c, r.before + at * rig.ref["T"], 0.3 * s * rig.ref["T"])
    return apply


# --- sealed half ----------------------------------------------------------------------------------------------------
# What was sealed up to the proof of build dc6f279 has been looked at since and stands above.

@stranger("sealed", "alternating_stop", "by-parity", "contact", "dci", depends=("contact: order",))
def _(rng, rig):
    # two stops that are struck in turn, or a stop that is turned over after every recording
    return lambda s, P, ch, r: P.__setitem__(m.KFAC, P[m.KFAC] * (1 + 0.4 * s * (r.order % 2)))


@stranger("sealed", "memory_pad", "by-the-last", "contact", "d", depends=("contact: order",))
def _(rng, rig):
    # a pad that has not recovered from the impact before, the less the harder that was
    speeds = {r.order: r.speed for r in rig.recs}
    top = max(speeds.values())

    def apply(s, P, ch, r):
        P[m.KFAC] *= 1 - 0.5 * min(s, 1.0) * speeds.get(r.order - 1, 0.0) / top
    return apply


@stranger("sealed", "creeping_push", "by-order", "motion", "d", depends=())
def _(rng, rig):
    # a force into the stop that grows from recording to recording: a counterweight that runs out
    n, weight = len(rig.recs), rig.P[m.M] * 9.81

    def apply(s, P, ch, r):
        P[m.SP_PRE] -= 6 * s * weight * r.order / n
    return apply


@stranger("sealed", "slew_limit", "amplifier", "chain", "dc", ["force"], depends=())
def _(rng, rig):
    steepest = np.pi * rig.ref["Fmax"] / rig.ref["T"]
    return chained(slew=lambda s: steepest / (1 + 4 * s))


@stranger("sealed", "dead_band", "about-zero", "chain", "dci", ["force"], depends=("reading of force: itself", "bent_scale"))
def _(rng, rig):
    # crossover distortion of an output stage: what lies below a level is not read, nor is that much of the rest
    return chained(dead=lambda s: 0.2 * s * rig.ref["F"])


@stranger("sealed", "echo", "long-cable", "chain", "dc", ["force"], depends=())
def _(rng, rig):
    # a reflection in a cable, or in the rod that the transducer sits on
    late = rng.uniform(0.1, 0.6) * rig.ref["T"]
    return chained(echo=lambda s: (0.3 * min(s, 2.0), late))


@stranger("sealed", "uneven_clock", "one-channel", "chain", "dc", ["force"], depends=())
def _(rng, rig):
    # the clock of one channel runs fast and slow in turn
    period, phase = rng.uniform(0.5, 2.0) * rig.ref["T"], rng.uniform(0, 2 * np.pi)
    return chained(wobble=lambda s: (0.1 * s * rig.ref["T"], period, phase))


assert set(HALF) <= {k[0] for k in FORMS}
