"""The exact impact."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass

from . import _native


@dataclass(frozen=True)
class Impact:
    """The impact of a mass on F = k x^p + mu_d x^p v, exact; SI."""

    #: mu_d, N s/m^(p+1)
    hysteresis_damping: float
    #: Deepest penetration, m
    deepest: float
    #: Speed after over speed before
    restitution: float
    #: N
    peak_force: float
    #: s
    duration: float
    #: J
    energy_lost: float
    #: N s
    impulse: float

    @property
    def parameters(self) -> dict[str, float]:
        """All of it by name."""
        return asdict(self)


def impact(
    *,
    mass: float,
    speed: float,
    stiffness: float,
    exponent: float = 1.5,
    damping: float | None = None,
    restitution: float | None = None,
) -> Impact:
    """The exact impact of a mass on the law F = k x^p + mu_d x^p v.

    mass: kg. speed: at touch, m/s. stiffness: k, N/m^p. exponent: p. damping: mu_d, N s/m^(p+1); none unless given.
    restitution: wanted restitution in place of a damping, above 0 and up to 1.

    Raises: TouchdownError for a value out of its range; TypeError for damping and restitution at once.
    """
    if damping is not None and restitution is not None:
        raise TypeError("damping and restitution cannot be given at once")
    return Impact(**json.loads(_native.impact(mass, speed, stiffness, exponent, damping, restitution)))
