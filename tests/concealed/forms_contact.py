"""Effects that sit in the contact."""
import numpy as np

from . import motion as m
from .forms import DIC, form, setter
from .rigs import log_uniform


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


@form("hysteresis_damping", "thinning", "contact", "dc")
def _(rng, rig):
    k = 1.4 * rig.P[m.K] / rig.ref["v"]
    return setter(MU=lambda s: s * k, MU_THIN=rng.uniform(0.7, 2.0) * rig.ref["v"])


@form("hysteresis_damping", "power-of-speed", "contact", "d", strange=True)
def _(rng, rig):
    k = 1.2 * rig.P[m.K] / rig.ref["v"]
    return setter(MU=lambda s: s * k, MU_THIN=rig.ref["v"], MU_POW=rng.uniform(0.45, 0.8))


@form("viscous_damping", "constant", "contact", DIC)
def _(rng, rig):
    return setter(CV=lambda s: 0.5 * s * rig.ref["F"] / rig.ref["v"])


@form("viscous_damping", "ramp", "contact", "dci")
def _(rng, rig):
    return setter(CV=lambda s: 0.5 * s * rig.ref["F"] / rig.ref["v"], CV_RAMP=rng.uniform(0.03, 0.12) * rig.ref["x"])


@form("viscous_damping", "thinning", "contact", "d")
def _(rng, rig):
    return setter(CV=lambda s: 0.6 * s * rig.ref["F"] / rig.ref["v"], CV_THIN=rng.uniform(0.7, 2.0) * rig.ref["v"])


@form("viscous_damping", "power-law", "contact", "d", strange=True)
def _(rng, rig):
    return setter(CV=lambda s: 0.5 * s * rig.ref["F"] / rig.ref["v"], CV_THIN=rig.ref["v"], CV_POW=rng.uniform(0.45, 0.8))


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


@form("plastic_indentation", "oliver-pharr", "contact", DIC, strange=True)
def _(rng, rig):
    more = rng.uniform(0.05, 0.35)
    return setter(PL=4.0, PL_Y=rng.uniform(0.0, 0.25) * rig.ref["x"], PL_R=lambda s: min(0.9 * s, 0.9),
                  PL_M=lambda s: rig.ref["p"] * (1 + more * min(s, 1.0)))


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


@form("adhesion", "meniscus", "contact", DIC, strange=True)
def _(rng, rig):
    return setter(AD=4.0, AD_F=lambda s: 0.3 * s * rig.ref["F"], AD_R=rng.uniform(0.06, 0.4) * rig.ref["x"])


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


@form("viscoelastic_relaxation", "fractional", "contact", "di", strange=True)
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


@form("secondary_stiffening", "gradual", "contact", DIC)
def _(rng, rig):
    apply = _second(rng, rig, 1.3, 0.4, 0.75, 0.6)      # rough faces: the layer takes part over a width
    w = rng.uniform(0.03, 0.09) * rig.ref["xmax"]

    def gradual(s, P, ch, r):
        apply(s, P, ch, r)
        P[m.ST_W] = w
    return gradual


@form("secondary_stiffening", "two-layers", "contact", DIC, strange=True)
def _(rng, rig):
    # a third layer below the second
    first = _second(rng, rig, 1.0, 0.25, 0.5, 0.35)
    d = rng.uniform(0.6, 0.8) * rig.ref["xmax"]
    k = 0.35 * rig.ref["Fmax"] / (rig.ref["xmax"] - d)

    def both(s, P, ch, r):
        first(s, P, ch, r)
        P[m.ST2_K], P[m.ST2_D] = s * k, d
    return both


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


@form("cyclic_softening", "two-rates", "contact", "dci", strange=True)
def _(rng, rig):
    # what runs in within a few recordings, and what goes on
    n, quick = rng.uniform(0.5, 1.2), rng.uniform(0.3, 0.7)
    return _soft(lambda s, o: 0.5 * s * (quick * (1 - np.exp(-(o - 1) / n)) + (1 - quick) * (o - 1) / 9))


@form("cyclic_softening", "by-impulse", "contact", "dci")
def _(rng, rig):
    # falls with the impulse the contact has taken so far, not with the count of recordings
    taken = np.cumsum([0.0] + [r.level if rig.kind == "indentation" else r.speed for r in rig.recs])
    share = dict(zip([r.order for r in rig.recs], taken / (rng.uniform(0.2, 0.6) * taken[-1])))
    return _soft(lambda s, o: 0.5 * s * (1 - np.exp(-share[o])))


@form("contact_preload", "ramp", "contact", DIC)
def _(rng, rig):
    return setter(PRE=1.0, PRE_F=lambda s: 0.4 * s * rig.ref["F"], PRE_D=rng.uniform(0.01, 0.06) * rig.ref["x"])


@form("contact_preload", "tanh", "contact", DIC)
def _(rng, rig):
    return setter(PRE=2.0, PRE_F=lambda s: 0.4 * s * rig.ref["F"], PRE_D=rng.uniform(0.005, 0.04) * rig.ref["x"])


@form("contact_preload", "disc-spring", "contact", DIC, strange=True)
def _(rng, rig):
    # the force it is set to falls a little with depth
    return setter(PRE=3.0, PRE_F=lambda s: 0.4 * s * rig.ref["F"], PRE_D=rng.uniform(0.005, 0.04) * rig.ref["x"],
                  PRE_SAG=rng.uniform(0.1, 0.35), PRE_X=rng.uniform(0.4, 0.8) * rig.ref["xmax"])


def _hard(law):
    def apply(s, P, ch, r):
        P[m.KFAC] *= 1.0 + min(law(s, r.order), 3.0)
    return apply


@form("cyclic_hardening", "linear", "contact", DIC)
def _(rng, rig):
    return _hard(lambda s, o: 1.2 * s * (o - 1) / 9)


@form("cyclic_hardening", "exponential", "contact", DIC)
def _(rng, rig):
    n = rng.uniform(1.5, 4.0)
    return _hard(lambda s, o: 1.2 * s * (1 - np.exp(-(o - 1) / n)))


@form("cyclic_hardening", "logarithmic", "contact", DIC)
def _(rng, rig):
    return _hard(lambda s, o: 1.2 * s * np.log(o) / np.log(10))


@form("cyclic_hardening", "by-energy", "contact", DIC, strange=True)
def _(rng, rig):
    # grows with the energy the contact has taken so far (depth to the power of the law, or the square of speed), and saturates
    size = [r.level ** (rig.ref["p"] + 1) if rig.kind == "indentation" else r.speed ** 2 for r in rig.recs]
    taken = np.cumsum([0.0] + size)
    share = dict(zip([r.order for r in rig.recs], taken / (rng.uniform(0.3, 0.9) * taken[-1])))
    return _hard(lambda s, o: 1.2 * s * (1 - np.exp(-share[o])))
