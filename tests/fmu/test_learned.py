"""The force of a shape of its own in both FMUs, beside its formula in Python."""

import math
import subprocess

import fmpy
import pytest

from .element import Element

RANGE, SPEED = 2e-3, 0.7
TERMS = 24
REST = [40.0, -25.0, 8.0, 0, 0, -3.0, *[0] * (TERMS - 7), 1.5]
WITH = [12.0, 0, 4.0, 0, -2.0, *[0] * (TERMS - 5)]
FACTORS = {
    "not": lambda v: 0.0,
    "speed": lambda v: v / SPEED,
    "direction": lambda v: max(-1.0, min(1.0, v / 5e-3)),
    "speed_squared": lambda v: v * abs(v) / SPEED**2,
}
FORMS = list(FACTORS)


def series(coefficients, u):
    u = max(0.0, min(1.0, u))
    return coefficients[0] + sum(c * math.sqrt(2) * math.cos(j * math.pi * u) for j, c in enumerate(coefficients) if j)


def named(prefix, coefficients):
    return {f"learned_{prefix}_{j + 1}": c for j, c in enumerate(coefficients)}


def contact(form):
    return {"stiffness": 2e6, "exponent": 1.5, "learned_form": FORMS.index(form), "learned_range": RANGE, "learned_speed": SPEED, **named("rest", REST), **named("speed", WITH)}


def between(form, x, v):
    if x <= 0:
        return 0.0
    u = x / RANGE
    return (1 - math.exp(-u / 0.03)) * (series(REST, u) + series(WITH, u) * FACTORS[form](v))


@pytest.mark.parametrize("form", FORMS)
def test_the_element_adds_the_learned_force_and_says_where_it_is_beyond(fmu, form):
    with Element(fmu, start=contact(form)) as e:
        beyond = e.vr["beyond_learned"]
        for x, v in [(-1e-4, 1.0), (2e-5, 0.3), (4e-4, -0.002), (1.3e-3, -0.9), (2.5e-3, 0.1), (5e-4, 1.6)]:
            e.set("penetration", x)
            e.set("velocity", v)
            want = 2e6 * max(x, 0.0) ** 1.5 + between(form, x, v)
            assert e.get("force") == pytest.approx(want, rel=1e-12, abs=1e-12)
            assert e.fmu.getBoolean([beyond]) == [x > RANGE or (form != "not" and abs(v) > 2 * SPEED)]


def test_its_derivatives_are_those_of_the_force(fmu):
    with Element(fmu, start=contact("speed")) as e:
        def force(x, v):
            e.set("penetration", x)
            e.set("velocity", v)
            return e.get("force")
        for x, v in [(3e-5, 0.3), (7e-4, -0.5)]:
            force(x, v)
            of = lambda known: e.fmu.getDirectionalDerivative([e.vr["force"]], [e.vr[known]], [1.0])[0]
            by_x, by_v = of("penetration"), of("velocity")
            assert by_x == pytest.approx((force(x + 1e-9, v) - force(x - 1e-9, v)) / 2e-9, rel=1e-4)
            assert by_v == pytest.approx((force(x, v + 1e-6) - force(x, v - 1e-6)) / 2e-6, rel=1e-6)


def test_its_energy_comes_back_and_what_goes_with_the_speed_is_lost(fmu):
    for form in ("not", "speed"):
        with Element(fmu, start=contact(form)) as e:
            lost, n, deepest = 0.0, 400, 1.5e-3
            way = [deepest * (1 - abs(i / (n / 2) - 1)) for i in range(n + 1)]
            for i in range(n + 1):
                v = 0.4 if i < n / 2 else -0.4
                e.set("penetration", way[i])
                e.set("velocity", v)
                e.step(1e-5)
                if i:
                    mid = 0.5 * (way[i - 1] + way[i])
                    lost += (between(form, mid, v) - between("not", mid, v)) * (way[i] - way[i - 1])
            assert e.get("stored_energy") == pytest.approx(0.0, abs=1e-12)
            assert e.get("dissipated_energy") == pytest.approx(lost, rel=0.02, abs=1e-9)


@pytest.mark.parametrize("turns", [False, True])
def test_the_forces_on_the_body_hold_one_of_place_and_speed_or_direction(touchdown, tmp_path, turns):
    path = tmp_path / "BodyForce.fmu"
    values = {"learned_range": RANGE, "learned_speed": SPEED, "learned_direction": float(turns), **named("place", REST), **named("place_speed", WITH), **named("speed", WITH)}
    subprocess.run([touchdown, "pack", "--model", "body-force", "--out", str(path), *[a for n, v in values.items() for a in ("--set", f"{n}={v}")]], check=True)
    description = fmpy.read_model_description(str(path))
    reference = {v.name: v.valueReference for v in description.modelVariables}
    body = fmpy.fmi2.FMU2Slave(guid=description.guid, unzipDirectory=fmpy.extract(str(path)), modelIdentifier="BodyForce", instanceName="body")
    body.instantiate()
    body.setupExperiment(startTime=0.0)
    body.enterInitializationMode()
    body.exitInitializationMode()
    for x, v in [(1e-4, 0.3), (-4e-4, -0.9), (-2e-4, 0.002), (-1.9e-3, 1.2), (-5e-3, 0.1), (-1e-3, 1.6)]:
        body.setReal([reference["penetration"], reference["velocity"], reference["other_force"]], [x, v, 7.0])
        w = v / SPEED
        z = -x / RANGE
        added = -(series(REST, z) + series(WITH, z) * FACTORS["direction" if turns else "speed"](v)) - w * series(WITH, abs(w) / 2)
        force, told = body.getReal([reference["force"], reference["added_force"]])
        assert told == pytest.approx(added, rel=1e-12) and force == pytest.approx(7.0 - added, rel=1e-12)
        assert body.getBoolean([reference["beyond_learned"]]) == [-x > RANGE or abs(v) > 2 * SPEED]
    body.terminate()
    body.freeInstance()
