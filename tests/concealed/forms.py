"""Registry of the forms an effect can take, and how a form is written.

A form is drawn once a case, giving apply(s, P, chain, recording): it writes the effect at strength s into the
parameter vector or the chain. s grows with the effect; the search in generate.py scales it.
"""
from . import motion as m

ORIGIN = {}
FORMS = {}          # (mechanism, form) -> (kinds, needs, maker)
STRANGE = set()     # forms no candidate of the diagnosis has, as far as its mechanisms/ showed when they were written
DEPENDS = {}        # stranger -> classes of a verdict's learned force that say what it depends on; empty: no class does
DIC = "dci"         # drop-test, contactor-opening, indentation


def form(mechanism, name, origin, kinds, needs=(), strange=False, depends=None):
    """Registers a maker(rng, rig) -> apply for one form of a mechanism; strange: not a form the diagnosis fits; depends: of a stranger
    the classes, as verdicts name them, of which any is right: several where one campaign cannot part them."""
    def add(f):
        ORIGIN[mechanism] = origin
        FORMS[mechanism, name] = (kinds, tuple(needs), f)
        if strange:
            STRANGE.add((mechanism, name))
        if depends is not None:
            DEPENDS[mechanism] = frozenset(depends)
        return f
    return add


def setter(**fixed):
    """apply that writes constants and s-dependent callables into P by the names of motion.py."""
    def apply(s, P, ch, r):
        for key, val in fixed.items():
            P[getattr(m, key)] = val(s) if callable(val) else val
    return apply


def chained(**fixed):
    def apply(s, P, ch, r):
        for key, val in fixed.items():
            ch[key] = val(s) if callable(val) else val
    return apply


def allowed(mechanism, name, rig_kind, channels):
    """Whether this form can act and show in such a campaign."""
    kinds, needs, _ = FORMS[mechanism, name]
    if {"drop-test": "d", "contactor-opening": "c", "indentation": "i"}[rig_kind] not in kinds:
        return False
    return all(any(c in channels for c in need.split("|")) for need in needs)
