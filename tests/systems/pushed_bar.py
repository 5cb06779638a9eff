"""A bar that a spring pushes towards a stop, as a model of pythonfmu: tests/systems/test_pythonfmu.py makes an FMU of it."""

from math import cos, sin, sqrt

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class PushedBar(Fmi2Slave):
    """mass x'' = preload - rate (x + travel) - push, at rest at x = -travel at first; steps are exact under a push held."""

    def __init__(self, **of):
        super().__init__(**of)
        self.push = 0.0             # N
        self.mass = 0.4             # kg
        self.preload = 100.0        # N
        self.rate = 2000.0          # N/m
        self.travel = 3e-3          # m
        self.x = -self.travel
        self.v = 0.0
        self.register_variable(Real("push", causality=Fmi2Causality.input))
        for name in ("x", "v", "a"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        for name in ("mass", "preload", "rate", "travel"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))

    @property
    def a(self):
        """Answers to the push at once."""
        return (self.preload - self.rate * (self.x + self.travel) - self.push) / self.mass

    def enter_initialization_mode(self):
        self.x, self.v = -self.travel, 0.0

    def do_step(self, current_time, step_size):
        w = sqrt(self.rate / self.mass)
        rest = (self.preload - self.push) / self.rate - self.travel
        c, s, away = cos(w * step_size), sin(w * step_size), self.x - rest
        self.x, self.v = rest + away * c + self.v / w * s, self.v * c - away * w * s
        return True
