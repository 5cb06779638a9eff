"""Effects that sit in the motion of body and stop."""
import numpy as np

from . import motion as m
from .forms import form, setter
from .rigs import log_uniform


@form("gravity", "left-out", "motion", "d")
def _(rng, rig):
    return lambda s, P, ch, r: P.__setitem__(m.G, 9.81)


@form("gravity", "inclined", "motion", "d", strange=True)
def _(rng, rig):
    g = 9.81 * np.cos(np.radians(rng.uniform(5, 12)))       # the guide leans, so less of the weight acts along it
    return lambda s, P, ch, r: P.__setitem__(m.G, g)


def _weight(rig):
    return rig.P[m.M] * 9.81 if rig.kind == "drop-test" else rig.recs[0].preload


@form("guide_friction", "coulomb", "motion", "dc")
def _(rng, rig):
    return setter(FR=1.0, FR_C=lambda s: 3 * s * _weight(rig))


@form("guide_friction", "coulomb-viscous", "motion", "dc")
def _(rng, rig):
    share = rng.uniform(0.2, 0.8) / rig.ref["v"]
    return setter(FR=1.0, FR_C=lambda s: 2 * s * _weight(rig), FR_V=lambda s: 2 * s * _weight(rig) * share)


@form("guide_friction", "stribeck", "motion", "dc")
def _(rng, rig):
    more = rng.uniform(1.4, 2.2)
    return setter(FR=2.0, FR_C=lambda s: 2 * s * _weight(rig), FR_S=lambda s: 2 * s * more * _weight(rig),
                  FR_VS=rng.uniform(0.05, 0.4) * rig.ref["v"])


@form("guide_friction", "lugre", "motion", "dc", strange=True)
def _(rng, rig):
    more, give = rng.uniform(1.2, 1.8), rng.uniform(0.02, 0.08) * rig.ref["x"] + 2e-6
    return setter(FR=3.0, FR_C=lambda s: 2 * s * _weight(rig), FR_S=lambda s: 2 * s * more * _weight(rig),
                  FR_VS=rng.uniform(0.05, 0.4) * rig.ref["v"], FR_SIG=lambda s: 2 * s * _weight(rig) / give)


@form("fluid_drag", "square", "motion", "dc")
def _(rng, rig):
    return setter(DRAG=lambda s: 3 * s * _weight(rig) / rig.ref["v"] ** 2, DRAG_N=2.0, DRAG_BACK=1.0)


@form("fluid_drag", "wake", "motion", "d")
def _(rng, rig):
    return setter(DRAG=lambda s: 3 * s * _weight(rig) / rig.ref["v"] ** 2, DRAG_N=2.0, DRAG_BACK=rng.uniform(0.6, 1.5))


@form("fluid_drag", "power-1.8", "motion", "dc")
def _(rng, rig):
    return setter(DRAG=lambda s: 3 * s * _weight(rig) / rig.ref["v"] ** 1.8, DRAG_N=1.8, DRAG_BACK=1.0)


@form("fluid_drag", "with-linear-share", "motion", "dc", strange=True)
def _(rng, rig):
    # Forchheimer: a viscous share beside the square
    return setter(DRAG=lambda s: 3 * s * _weight(rig) / rig.ref["v"] ** 2, DRAG_N=2.0, DRAG_BACK=1.0,
                  DRAG_LIN=rng.uniform(0.1, 0.3) * rig.ref["v"])


@form("fluid_drag", "crisis", "motion", "dc")
def _(rng, rig):
    # beyond a speed the boundary layer turns turbulent and the drag is half of what the square says
    return setter(DRAG=lambda s: 4 * s * _weight(rig) / rig.ref["v"] ** 2, DRAG_N=2.0, DRAG_BACK=1.0,
                  DRAG_CR=rng.uniform(0.7, 1.4) * rig.ref["v"])


@form("squeeze_film", "inverse", "motion", "dc")
def _(rng, rig):
    return setter(SQ=lambda s: 0.3 * s * rig.ref["F"] / rig.ref["v"], SQ_G=rng.uniform(0.3, 1.2) * rig.ref["x"], SQ_N=1.0)


@form("squeeze_film", "cubic-cut-off", "motion", "dc", strange=True)
def _(rng, rig):
    g = rng.uniform(0.5, 1.5) * rig.ref["x"]
    return setter(SQ=lambda s: 0.3 * s * rig.ref["F"] / rig.ref["v"], SQ_G=g, SQ_N=3.0, SQ_CUT=rng.uniform(2, 6) * g)


def _base(rig, ratio, damp, cubic):
    kc = rig.ref["F"] / rig.ref["x"]

    def apply(s, P, ch, r):
        P[m.BMODE], P[m.MB] = 1.0, ratio * P[m.M]
        P[m.KB] = kc / max(s, 1e-9)
        P[m.CB] = damp * 2 * np.sqrt(P[m.KB] * P[m.MB])
        P[m.KB3] = cubic * P[m.KB] / (s * rig.ref["x"]) ** 2
    return apply


@form("base_compliance", "mass-spring", "motion", "dc")
def _(rng, rig):
    return _base(rig, log_uniform(rng, 0.4, 3.0), rng.uniform(0.03, 0.15), 0.0)


@form("base_compliance", "light-damped", "motion", "dc")
def _(rng, rig):
    return _base(rig, log_uniform(rng, 0.1, 0.5), rng.uniform(0.3, 0.9), 0.0)


@form("base_compliance", "hardening", "motion", "d")
def _(rng, rig):
    return _base(rig, log_uniform(rng, 0.4, 3.0), rng.uniform(0.03, 0.15), rng.uniform(0.3, 1.0))


@form("base_compliance", "softening", "motion", "d")
def _(rng, rig):
    return _base(rig, log_uniform(rng, 0.4, 3.0), rng.uniform(0.03, 0.15), -rng.uniform(0.03, 0.12))


@form("base_compliance", "dry", "motion", "dc", strange=True)
def _(rng, rig):
    # the stop slides in its seat
    apply, share = _base(rig, log_uniform(rng, 0.4, 3.0), 0.02, 0.0), rng.uniform(0.02, 0.08)

    def dry(s, P, ch, r):
        apply(s, P, ch, r)
        P[m.CB_DRY] = share * rig.ref["F"]
    return dry


RESTING = 1e-9       # m, play behind a part that lies against the wall there


def _loose(rig, gap, stiff, damp, p, two):
    if rig.kind == "contactor-opening":
        two = RESTING    # a bar set in motion from rest would leave the part behind, and never be struck by it

    def apply(s, P, ch, r):
        ml = min(0.4 * s, 0.4) * P[m.M]
        P[m.LM], P[m.LGAP] = ml, gap
        P[m.LP] = p
        k = ml * (2 * np.pi * stiff / rig.ref["T"]) ** 2
        P[m.LK] = k / (0.3 * rig.ref["x"]) ** (p - 1)
        P[m.LC] = damp * 2 * np.sqrt(ml * k)
        P[m.LTWO] = two
    return apply


@form("loose_part", "linear", "motion", "dc")
def _(rng, rig):
    return _loose(rig, rng.uniform(0.15, 0.8) * rig.ref["x"], rng.uniform(1, 3), rng.uniform(0.03, 0.3), 1.0, 0.0)


@form("loose_part", "hertzian", "motion", "d", strange=True)
def _(rng, rig):
    return _loose(rig, rng.uniform(0.15, 0.8) * rig.ref["x"], rng.uniform(1, 3), rng.uniform(0.03, 0.3), 1.5, 0.0)


@form("loose_part", "rattle", "motion", "d")
def _(rng, rig):
    g = rng.uniform(0.15, 0.6) * rig.ref["x"]
    return _loose(rig, g, rng.uniform(1, 3), rng.uniform(0.03, 0.3), 1.0, g)


@form("loose_part", "rattle-hertzian", "motion", "d", strange=True)
def _(rng, rig):
    g, behind = rng.uniform(0.15, 0.6) * rig.ref["x"], rng.uniform(0.1, 0.8) * rig.ref["x"]
    return _loose(rig, g, rng.uniform(1, 3), rng.uniform(0.03, 0.3), 1.5, behind)


def _riding(rig, tune, damp, cubic=0.0, dry=0.0, play=0.0):
    """A mass on the body: tune, its frequency times the contact time; damp, its damping ratio.

    cubic: share by which the spring is stiffer at the depth of the contact. dry: friction over the force that would
    hold the mass. play: over the depth of the contact.
    """
    def apply(s, P, ch, r):
        P[m.AM] = min(0.3 * s, 0.5) * P[m.M]
        P[m.AM_K] = P[m.AM] * (2 * np.pi * tune / rig.ref["T"]) ** 2
        P[m.AM_C] = 2 * damp * np.sqrt(P[m.AM] * P[m.AM_K])
        P[m.AM_K3] = cubic * P[m.AM_K] / rig.ref["x"] ** 2
        P[m.AM_DRY] = dry * P[m.AM] / P[m.M] * rig.ref["F"]
        P[m.AM_GAP] = play * rig.ref["x"]
    return apply


@form("attached_mass", "linear", "motion", "dc")
def _(rng, rig):
    return _riding(rig, log_uniform(rng, 0.4, 2.5), log_uniform(rng, 0.01, 0.15))


@form("attached_mass", "well-damped", "motion", "dc")
def _(rng, rig):
    return _riding(rig, log_uniform(rng, 0.4, 1.5), rng.uniform(0.15, 0.4))


@form("attached_mass", "hardening", "motion", "dc")
def _(rng, rig):
    return _riding(rig, log_uniform(rng, 0.5, 2.0), log_uniform(rng, 0.02, 0.15), cubic=rng.uniform(0.3, 1.5))


@form("attached_mass", "dry", "motion", "dc", strange=True)
def _(rng, rig):
    return _riding(rig, log_uniform(rng, 0.5, 2.0), 0.01, dry=rng.uniform(0.03, 0.12))


@form("attached_mass", "play", "motion", "d", strange=True)
def _(rng, rig):
    return _riding(rig, log_uniform(rng, 0.5, 2.0), log_uniform(rng, 0.03, 0.15), play=rng.uniform(0.01, 0.06))


@form("return_spring", "preloaded", "motion", "d")
def _(rng, rig):
    rate = rng.uniform(0.1, 0.6)
    way = rig.recs[-1].speed * rig.recs[-1].before
    return setter(SP_PRE=lambda s: 6 * s * _weight(rig), SP_K=lambda s: 6 * s * rate * _weight(rig) / way)


@form("return_spring", "soft", "motion", "d")
def _(rng, rig):
    way = rig.recs[-1].speed * rig.recs[-1].before
    return setter(SP_PRE=lambda s: 6 * s * _weight(rig), SP_K=lambda s: 6 * s * 0.03 * _weight(rig) / way)


@form("return_spring", "progressive", "motion", "d")
def _(rng, rig):
    rate, more = rng.uniform(0.05, 0.3), rng.uniform(0.5, 2.0)
    way = rig.recs[-1].speed * rig.recs[-1].before
    return setter(SP_PRE=lambda s: 6 * s * _weight(rig), SP_K=lambda s: 6 * s * rate * _weight(rig) / way,
                  SP_K3=lambda s: 6 * s * more * _weight(rig) / way ** 3)


@form("return_spring", "two-stage", "motion", "d", strange=True)
def _(rng, rig):
    rate, more = rng.uniform(0.1, 0.4), rng.uniform(1.0, 3.0)
    way = rig.recs[-1].speed * rig.recs[-1].before
    return setter(SP_PRE=lambda s: 6 * s * _weight(rig), SP_K=lambda s: 6 * s * rate * _weight(rig) / way,
                  SP_K2=lambda s: 6 * s * rate * more * _weight(rig) / way, SP_X2=-rng.uniform(0.2, 0.6) * way)


@form("residual_magnetism", "gap-and-time", "motion", "c")
def _(rng, rig):
    return setter(MG_F=lambda s: 0.4 * s * _weight(rig), MG_Z=rng.uniform(0.15, 0.6) * rig.P[m.TRAVEL], MG_T=rng.uniform(0.6, 2.5) * rig.ref["before"])


@form("residual_magnetism", "gap", "motion", "c")
def _(rng, rig):
    return setter(MG_F=lambda s: 0.4 * s * _weight(rig), MG_Z=rng.uniform(0.1, 0.5) * rig.P[m.TRAVEL])


@form("residual_magnetism", "time", "motion", "c")
def _(rng, rig):
    return setter(MG_F=lambda s: 0.4 * s * _weight(rig), MG_T=rng.uniform(0.2, 0.7) * rig.ref["before"])


@form("residual_magnetism", "eddy", "motion", "c", strange=True)
def _(rng, rig):
    return setter(MG_F=lambda s: 0.4 * s * _weight(rig), MG_T=rng.uniform(0.3, 1.2) * rig.ref["before"], MG_EDDY=1.0)
