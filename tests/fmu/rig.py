"""Scenarios once more, in Python, with the contact asked from an instance in fmpy. Written from the equations, not
from the harness: Ahn and Ryu 2005, eq. 6 for one body, eqs 3 to 5 for three, x > 0 into the stop."""

import math
import tomllib

import numpy as np

GRAVITY = 9.81
SLIP = 5e-3  # m/s, width of the smoothed zero of the guide's friction
OWN = ("stiffness", "exponent", "hysteresis_damping", "viscous_damping", "yield_penetration", "plastic_ratio",
       "adhesion_force", "adhesion_range", "adhesion_form", "secondary_stiffness", "secondary_depth",
       "secondary_exponent",
       "viscous_thinning_speed", "adhesion_depth", "hysteresis_thinning_speed", "secondary_width")  # fmt: skip


class Rig:
    """One run of a scenario without its contact."""

    def __init__(self, path, height=None, tip=None):
        with open(path, "rb") as f:
            s = tomllib.load(f)
        self.text = s
        tips = {t["name"]: t for t in s.get("tip", [])}
        own = tips.get(tip, {})
        contact = own.get("contact") or s["contact"]
        self.law = {n: contact[n] for n in OWN if n in contact}
        self.friction = s.get("guide_friction", 0.0)
        self.after = GRAVITY if s.get("gravity") else 0.0
        self.contactor = s["kind"] == "contactor_opening"
        self.before = self.after if self.contactor else GRAVITY
        self.height = height or s.get("drop_height")
        self.three = s.get("model") == "three_mass"
        if self.three:
            m, k = s["masses"], s["sensors"]
            self.masses = [own.get("mass") or m["tip"], m["body"], m["accelerometer"]]
            self.k = [k["transducer_stiffness"], k["accelerometer_stiffness"]]
            ratios = [k.get("transducer_damping_ratio", 0.0), k.get("accelerometer_damping_ratio", 0.0)]
            ends = [self.masses[0], self.masses[2]]
            self.c = [2 * z * math.sqrt(a * b) for z, a, b in zip(ratios, self.k, ends)]
        else:
            self.masses = [s["mass"] + own.get("mass", 0.0)]
        self.mass = sum(self.masses)

    def drive(self, t, x, v):
        """What acts on the body from outside but its weight, N."""
        f = -self.friction * math.tanh(v / SLIP)
        if self.contactor:
            s = self.text
            f += s["spring_preload"] - s.get("return_spring_rate", 0.0) * (x + s["travel"])
            if s.get("holding_force", 0.0):
                f -= s["holding_force"] * math.exp(-t / s["holding_time"])
        return f

    def rates(self, g, t, y, force):
        """Rates of tip, body, accelerometer: position and velocity each."""
        if not self.three:
            return np.array([y[1], (self.drive(t, y[0], y[1]) - force) / self.mass + g])
        xt, vt, xb, vb, xa, va = y
        transducer = self.k[0] * (xb - xt) + self.c[0] * (vb - vt)
        accelerometer = self.k[1] * (xb - xa) + self.c[1] * (vb - va)
        at = (transducer - force) / self.masses[0] + g
        ab = (self.drive(t, xb, vb) - transducer - accelerometer) / self.masses[1] + g
        aa = accelerometer / self.masses[2] + g
        return np.array([vt, at, vb, ab, va, aa])

    def centre(self, y):
        """Position and velocity of the centre of mass."""
        return [sum(m * y[2 * i + j] for i, m in enumerate(self.masses)) / self.mass for j in (0, 1)]
