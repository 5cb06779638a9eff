"""What can be concealed: every mechanism of the vocabulary in several forms, and things outside it.

A form is drawn once a case (`draw`), giving apply(s, P, chain, recording): it writes the effect at strength s
into the parameter vector or the chain. s grows with the effect; the search in generate.py scales it.
"""
import numpy as np

from . import motion as m
from .rigs import log_uniform

ORIGIN = {}
FORMS = {}          # (mechanism, form) -> (kinds, needs, maker)
DIC = "dci"         # drop-test, contactor-opening, indentation


def form(mechanism, name, origin, kinds, needs=()):
    """Registers a maker(rng, rig) -> apply for one form of a mechanism."""
    def add(f):
        ORIGIN[mechanism] = origin
        FORMS[mechanism, name] = (kinds, tuple(needs), f)
        return f
    return add


def setter(**fixed):
    """apply that writes constants and s-dependent callables into P by the names of motion.py."""
    def apply(s, P, ch, r):
        for key, val in fixed.items():
            P[getattr(m, key)] = val(s) if callable(val) else val
    return apply


# --- contact -----------------------------------------------------------------------------------------------------
@form("hysteresis_damping", "hunt-crossley", "contact", DIC)
def _(rng, rig):
    k = rig.P[m.K] / rig.ref["v"]
    return setter(MU=lambda s: s * k)


@form("hysteresis_damping", "kuwabara-kono", "contact", "dc")
def _(rng, rig):
    R = rig.ref
    return setter(CQ=lambda s: s * R["F"] / R["v"] / R["x"] ** (R["p"] - 1), CQ_Q=max(R["p"] - 1, 0.3))


@form("hysteresis_damping", "tsuji", "contact", "d")
def _(rng, rig):
    R = rig.ref
    return setter(CQ=lambda s: 0.5 * s * R["F"] / R["v"] / R["x"] ** 0.5, CQ_Q=0.5)


@form("hysteresis_damping", "speed-scaled", "contact", "d")
def _(rng, rig):
    k = rig.P[m.K]

    def apply(s, P, ch, r):                 # Lankarani-Nikravesh: mu = const k / impact speed
        P[m.MU] = s * k / r.speed
    return apply


@form("viscous_damping", "constant", "contact", DIC)
def _(rng, rig):
    return setter(CV=lambda s: 0.5 * s * rig.ref["F"] / rig.ref["v"])


@form("viscous_damping", "ramp", "contact", "dci")
def _(rng, rig):
    return setter(CV=lambda s: 0.5 * s * rig.ref["F"] / rig.ref["v"], CV_RAMP=rng.uniform(0.03, 0.12) * rig.ref["x"])


@form("viscous_damping", "thinning", "contact", "d")
def _(rng, rig):
    return setter(CV=lambda s: 0.6 * s * rig.ref["F"] / rig.ref["v"], CV_THIN=rng.uniform(0.7, 2.0) * rig.ref["v"])


@form("plastic_indentation", "permanent-set", "contact", DIC)
def _(rng, rig):
    return setter(PL=1.0, PL_Y=rng.uniform(0.05, 0.5) * rig.ref["x"], PL_R=lambda s: min(0.85 * s, 0.9))


@form("plastic_indentation", "walton-braun", "contact", DIC)
def _(rng, rig):
    # slope of the return from the chord, which loses nothing (ratio 1/p), to the tangent and steeper
    return setter(PL=2.0, PL_Y=rng.uniform(0.0, 0.2) * rig.ref["x"], PL_R=lambda s: 1.0 / rig.ref["p"] + s)


@form("plastic_indentation", "thornton", "contact", DIC)
def _(rng, rig):
    return setter(PL=3.0, PL_Y=lambda s: rig.ref["xmax"] * max(0.02, 1.0 - s))


@form("adhesion", "neck", "contact", DIC)
def _(rng, rig):
    return setter(AD=1.0, AD_F=lambda s: 0.3 * s * rig.ref["F"], AD_R=rng.uniform(0.02, 0.2) * rig.ref["x"])


@form("adhesion", "jkr", "contact", DIC)
def _(rng, rig):
    r = rng.uniform(0.02, 0.12) * rig.ref["x"]
    return setter(AD=2.0, AD_F=lambda s: 0.3 * s * rig.ref["F"] * (r / rig.ref["x"]) ** (rig.ref["p"] / 2), AD_R=r)


@form("adhesion", "reversible", "contact", "di")
def _(rng, rig):
    return setter(AD=3.0, AD_F=lambda s: 0.3 * s * rig.ref["F"], AD_R=rng.uniform(0.08, 0.3) * rig.ref["x"])


def _maxwell(rig, taus, weights, kind, scale):
    n = len(taus)
    ref = rig.ref["F"] / (rig.ref["x"] if kind == 0 else rig.ref["x"] ** rig.ref["p"])

    def apply(s, P, ch, r):
        P[m.VE_N], P[m.VE_KIND] = n, kind
        P[m.VE_K:m.VE_K + n] = s * scale * ref * np.asarray(weights)
        P[m.VE_T:m.VE_T + n] = taus
    return apply


def _span(rig):
    """Time a contact lasts; for an indentation, of ramp and hold."""
    return rig.ref["T"]


@form("viscoelastic_relaxation", "maxwell", "contact", DIC)
def _(rng, rig):
    return _maxwell(rig, [_span(rig) * log_uniform(rng, 0.08, 0.8)], [1.0], int(rng.integers(0, 2)), 0.5)


@form("viscoelastic_relaxation", "three-branches", "contact", "di")
def _(rng, rig):
    t = _span(rig)
    return _maxwell(rig, [t * q for q in (0.03, 0.2, 1.3)], rng.dirichlet([2, 2, 2]).tolist(), int(rng.integers(0, 2)), 0.6)


@form("viscoelastic_relaxation", "fractional", "contact", "di")
def _(rng, rig):
    a = rng.uniform(0.2, 0.6)               # springpot of order a as eight branches, three decades
    taus = _span(rig) * np.logspace(-1.7, 1.3, 8)
    w = taus ** -a
    return _maxwell(rig, taus, (w / w.sum()).tolist(), 1, 0.7)


def _second(rng, rig, p, lo, hi, scale):
    d = rng.uniform(lo, hi) * rig.ref["xmax"]
    room = rig.ref["xmax"] - d
    return setter(ST_K=lambda s: s * scale * rig.ref["Fmax"] / room ** p, ST_D=d, ST_P=p)


@form("secondary_stiffening", "hertzian", "contact", DIC)
def _(rng, rig):
    return _second(rng, rig, 1.5, 0.3, 0.75, 0.6)


@form("secondary_stiffening", "linear", "contact", DIC)
def _(rng, rig):
    return _second(rng, rig, 1.0, 0.3, 0.75, 0.6)


@form("secondary_stiffening", "stop", "contact", "d")
def _(rng, rig):
    return _second(rng, rig, 1.0, 0.8, 0.9, 0.8)


def _soft(law):
    def apply(s, P, ch, r):
        P[m.KFAC] *= 1.0 - min(law(s, r.order), 0.8)
    return apply


@form("cyclic_softening", "exponential", "contact", "dci")
def _(rng, rig):
    n = rng.uniform(1.5, 4.0)
    return _soft(lambda s, o: 0.5 * s * (1 - np.exp(-(o - 1) / n)))


@form("cyclic_softening", "logarithmic", "contact", "dci")
def _(rng, rig):
    return _soft(lambda s, o: 0.5 * s * np.log(o) / np.log(10))


@form("cyclic_softening", "linear", "contact", "dci")
def _(rng, rig):
    return _soft(lambda s, o: 0.5 * s * (o - 1) / 9)


# --- motion ------------------------------------------------------------------------------------------------------
@form("gravity", "left-out", "motion", "d")
def _(rng, rig):
    return lambda s, P, ch, r: P.__setitem__(m.G, 9.81)


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


@form("guide_friction", "lugre", "motion", "dc")
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


@form("squeeze_film", "inverse", "motion", "dc")
def _(rng, rig):
    return setter(SQ=lambda s: 0.3 * s * rig.ref["F"] / rig.ref["v"], SQ_G=rng.uniform(0.3, 1.2) * rig.ref["x"], SQ_N=1.0)


@form("squeeze_film", "cubic-cut-off", "motion", "dc")
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


def _loose(rig, gap, stiff, damp, p, two):
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


@form("loose_part", "hertzian", "motion", "d")
def _(rng, rig):
    return _loose(rig, rng.uniform(0.15, 0.8) * rig.ref["x"], rng.uniform(1, 3), rng.uniform(0.03, 0.3), 1.5, 0.0)


@form("loose_part", "rattle", "motion", "d")
def _(rng, rig):
    g = rng.uniform(0.15, 0.6) * rig.ref["x"]
    return _loose(rig, g, rng.uniform(1, 3), rng.uniform(0.03, 0.3), 1.0, g)


@form("return_spring", "preloaded", "motion", "d")
def _(rng, rig):
    rate = rng.uniform(0.1, 0.6)
    way = rig.recs[-1].speed * rig.recs[-1].before
    return setter(SP_PRE=lambda s: 6 * s * _weight(rig), SP_K=lambda s: 6 * s * rate * _weight(rig) / way)


@form("return_spring", "soft", "motion", "d")
def _(rng, rig):
    way = rig.recs[-1].speed * rig.recs[-1].before
    return setter(SP_PRE=lambda s: 6 * s * _weight(rig), SP_K=lambda s: 6 * s * 0.03 * _weight(rig) / way)


@form("residual_magnetism", "gap-and-time", "motion", "c")
def _(rng, rig):
    return setter(MG_F=lambda s: 0.4 * s * _weight(rig), MG_Z=rng.uniform(0.15, 0.6) * rig.P[m.TRAVEL], MG_T=rng.uniform(0.6, 2.5) * rig.ref["before"])


@form("residual_magnetism", "gap", "motion", "c")
def _(rng, rig):
    return setter(MG_F=lambda s: 0.4 * s * _weight(rig), MG_Z=rng.uniform(0.1, 0.5) * rig.P[m.TRAVEL])


@form("residual_magnetism", "time", "motion", "c")
def _(rng, rig):
    return setter(MG_F=lambda s: 0.4 * s * _weight(rig), MG_T=rng.uniform(0.2, 0.7) * rig.ref["before"])


# --- measuring chain ---------------------------------------------------------------------------------------------
def chained(**fixed):
    def apply(s, P, ch, r):
        for key, val in fixed.items():
            ch[key] = val(s) if callable(val) else val
    return apply


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


def _lag(kind, order):
    def make(rng, rig):
        c = _channel(rng, rig)
        return chained(lowpass=lambda s: (c, kind, order, order / (0.3 * max(s, 1e-6) * rig.ref["T"])))
    return make


form("lowpass_lag", "first-order", "chain", "dc", ["force|acceleration"])(_lag("lag", 1))
form("lowpass_lag", "second-order", "chain", "dc", ["force|acceleration"])(_lag("lag", 2))
form("lowpass_lag", "bessel-4", "chain", "dc", ["force|acceleration"])(_lag("bessel", 4))
form("lowpass_lag", "rc-3", "chain", "d", ["force|acceleration"])(_lag("rc", 3))


@form("channel_skew", "late", "chain", "dc", ["force"])
def _(rng, rig):
    return chained(skew=lambda s: ("force", 0.2 * s * rig.ref["T"]))


@form("channel_skew", "early", "chain", "dc", ["force"])
def _(rng, rig):
    return chained(skew=lambda s: ("force", -0.2 * s * rig.ref["T"]))


@form("channel_skew", "acceleration-late", "chain", "d", ["acceleration"])
def _(rng, rig):
    return chained(skew=lambda s: ("acceleration", 0.2 * s * rig.ref["T"]))


@form("clipping", "hard", "chain", DIC, ["force|acceleration"])
def _(rng, rig):
    c = _channel(rng, rig)
    return chained(clip=lambda s: (c, 1 - min(s, 0.6), False))


@form("clipping", "soft", "chain", DIC, ["force|acceleration"])
def _(rng, rig):
    c = _channel(rng, rig)
    return chained(clip=lambda s: (c, 1.05 - min(s, 0.6), True))


@form("force_gain", "high", "chain", "dc", ["force", "acceleration|penetration"])
def _(rng, rig):
    return chained(gain=lambda s: 1 + 0.3 * s)


@form("force_gain", "low", "chain", "dc", ["force", "acceleration|penetration"])
def _(rng, rig):
    return chained(gain=lambda s: 1 / (1 + 0.3 * s))


# --- outside the vocabulary --------------------------------------------------------------------------------------
@form("unknown:fracture", "crack", "contact", "d")
def _(rng, rig):
    return setter(CRACK_F=rng.uniform(0.35, 0.8) * rig.ref["Fmax"], CRACK_D=lambda s: min(0.4 * s, 0.7))


@form("unknown:bent_scale", "quadratic", "chain", "d", ["penetration"])
def _(rng, rig):
    way = rng.choice([-1, 1])
    return chained(bent=lambda s: way * 0.5 * s, bent_ref=rig.ref["xmax"])


@form("unknown:corrugated", "periodic", "contact", "d")
def _(rng, rig):
    return setter(CORR_F=lambda s: 0.2 * s * rig.ref["F"], CORR_W=rng.uniform(0.25, 0.6) * rig.ref["x"])


@form("unknown:jam", "bump", "motion", "d")
def _(rng, rig):
    return setter(JAM=lambda s: 0.5 * s * rig.ref["F"], JAM_X=rng.uniform(0.2, 0.6) * rig.ref["x"], JAM_W=rng.uniform(0.05, 0.12) * rig.ref["x"])


@form("unknown:rate_stiffness", "logarithmic", "contact", "d")
def _(rng, rig):
    return setter(RATE=lambda s: 0.5 * s, RATE_V=rng.uniform(0.05, 0.3) * rig.ref["v"])


@form("unknown:temperature", "swing", "contact", "d")
def _(rng, rig):
    walk = np.sin(2 * np.pi * (np.arange(40) / rng.uniform(3.5, 6.0) + rng.random()))

    def apply(s, P, ch, r):
        P[m.KFAC] *= 1 + 0.3 * min(s, 1.5) * walk[r.order]
    return apply


def allowed(mechanism, name, rig_kind, channels):
    """Whether this form can act and show in such a campaign."""
    kinds, needs, _ = FORMS[mechanism, name]
    if {"drop-test": "d", "contactor-opening": "c", "indentation": "i"}[rig_kind] not in kinds:
        return False
    return all(any(c in channels for c in need.split("|")) for need in needs)
