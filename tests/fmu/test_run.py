"""`touchdown run` against the same scenarios in Python with the FMU in fmpy: stepped as the harness steps, and
integrated by scipy as scipy likes."""

import csv
import json
import pathlib
import subprocess

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from .element import GOLDEN, Element
from .rig import Rig

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "harness/examples"

# Dormand and Prince 1980
STAGES = [
    [],
    [1 / 5],
    [3 / 40, 9 / 40],
    [44 / 45, -56 / 15, 32 / 9],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656],
    [35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
]
TIMES = [0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1]
PIECES = 8  # into which the harness divides a step of the element in contact

PLASTIC = """kind = "drop_test"
mass = 0.8
drop_height = 0.03
gravity = true
impacts = 3
[contact]
stiffness = 2e8
exponent = 1.7
hysteresis_damping = 2e7
yield_penetration = 2e-4
plastic_ratio = 0.3
adhesion_force = 15.0
adhesion_range = 5e-5
secondary_stiffness = 1e8
secondary_depth = 3e-4
"""


def run(touchdown, scenario, out):
    """Rows of every run by column, and the summary."""
    subprocess.run([touchdown, "run", str(scenario), "--out", str(out)], check=True, capture_output=True)
    with open(out / "results.csv") as f:
        rows = list(csv.DictReader(f))
    table = {n: np.array([float(r[n]) if r[n] else np.nan for r in rows]) for n in rows[0]}
    runs = [{n: c[table["run [1]"] == i] for n, c in table.items()} for i in np.unique(table["run [1]"])]
    return runs, json.loads((out / "summary.json").read_text())


def worst(got, wanted, scale=None):
    """The largest difference, relative to `scale` or the largest value wanted."""
    return np.abs(np.asarray(got) - wanted).max() / (scale or np.abs(wanted).max())


def between(y, a, z, b, h, s):
    """Position and velocity of the tip a share `s` into a step: the polynomial of order five through both ends."""
    d = np.polynomial.polynomial.polyval
    m = np.linalg.inv([[1, 1, 1], [3, 4, 5], [6, 12, 20]])
    low = [y[0], h * y[1], h * h * a / 2]
    ends = [z[0] - sum(low), h * z[1] - low[1] - 2 * low[2], h * h * b - 2 * low[2]]
    c = np.array([*low, *(m @ ends)])
    return d(s, c), d(s, c[1:] * np.arange(1, 6)) / h


def replay(rig, e, rows):
    """Takes the steps the harness took, through fmpy. State, force and energies at every row."""
    t = rows["time [s]"]
    x, v = rows["penetration [m]"], rows["velocity [m/s]"]
    n = 6 if rig.three else 2
    y = np.array([x[0], v[0]] * (n // 2))
    inside, touched, first = False, False, True
    seen = []

    def force(x, v):
        # on which side of the surface a step runs is known from where it began
        return e.force(max(x, 1e-300) if inside else min(x, 0.0), v)

    def rates(t, y):
        return rig.rates(rig.after if touched else rig.before, t, y, force(y[0], y[1]))

    for i in range(len(t)):
        if x[i] == 0.0:  # the harness ends a step on the surface, and on a turning point
            y[0] = 0.0
            inside = y[1] > 0
            touched = touched or inside
        if v[i] == 0.0:
            y[1] = 0.0
        f = force(y[0], y[1])
        if first:
            e.move(y[0], y[1])
            first = False
        energies = [e.get("stored_energy"), e.get("dissipated_energy")]
        seen.append([*y, f, *energies])
        if i + 1 == len(t):
            return np.array(seen)
        h, k = t[i + 1] - t[i], []
        for stage, c in zip(STAGES[:6], TIMES):
            z = y + h * sum((a * r for a, r in zip(stage, k)), np.zeros(n))
            k.append(rates(t[i] + c * h, z))
        z = y + h * sum(a * r for a, r in zip(STAGES[6], k))
        z[0] = 0.0 if x[i + 1] == 0.0 else z[0]
        z[1] = 0.0 if v[i + 1] == 0.0 else z[1]
        a1 = rates(t[i + 1], z)[1]
        pieces = PIECES if inside else 1
        e.move(y[0], y[1])
        for j in range(1, pieces + 1):
            e.move(*((z[0], z[1]) if j == pieces else between(y, k[0][1], z, a1, h, j / pieces)))
            e.step(h / pieces)
        y = z


@pytest.mark.parametrize(
    "name, impacts, run_number",
    [("drop_test", None, 0), ("drop_test_sensors", None, 0), ("drop_test_sensors", None, 4), ("contactor_paper", None, 0),
     ("contactor_opening", 4, 0), ("plastic", None, 0)],
)  # fmt: skip
def test_the_same_steps_through_fmpy_give_the_same_rows(touchdown, fmu, tmp_path, name, impacts, run_number):
    text = PLASTIC if name == "plastic" else (EXAMPLES / f"{name}.toml").read_text()
    if impacts:
        text = text.replace("[contact]", f"impacts = {impacts}\n[contact]", 1)
    scenario = tmp_path / "s.toml"
    scenario.write_text(text)
    runs, summary = run(touchdown, scenario, tmp_path / "out")
    rows, reported = runs[run_number], summary["runs"][run_number]
    assert "FMU" in reported["element"]
    rig = Rig(scenario, reported["drop_height"], reported["tip"])
    with Element(fmu, rig.law) as e:
        seen = replay(rig, e, rows)
    columns = ["penetration [m]", "velocity [m/s]"]
    if rig.three:
        columns += ["body position [m]", "body velocity [m/s]", "accelerometer position [m]", "accelerometer velocity [m/s]"]
    columns += ["force [N]", "stored energy [J]", "dissipated energy [J]"]
    energy = max(rows["kinetic energy [J]"])
    for column, got in zip(columns, seen.T):
        assert worst(got, rows[column], energy if "[J]" in column else None) < 1e-9, column
    contact = rows["penetration [m]"] > 0
    assert contact.sum() > 50
    assert worst(seen[contact, 0], rows[columns[0]][contact]) < 1e-9, "against the depth, not the drop"
    assert max(rows["force [N]"]) <= reported["impacts"][0]["peak_force"] * (1 + 1e-12)


def fall(rig, e, gaps):
    """A drop by scipy: times through the gaps, then touch to separation."""
    tight = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}

    def meets(position):
        def event(_, y):
            return y[0] - position

        event.direction = 1.0
        return event

    touch = meets(0.0)
    touch.terminal = True
    flight = solve_ivp(
        lambda t, y: rig.rates(rig.before, t, y, 0.0), (0.0, 10.0), [-rig.height, 0.0], events=[*map(meets, gaps), touch], **tight
    )
    t0, v0 = flight.t[-1], flight.y[1, -1]

    def leave(_, y):
        return y[0]

    leave.terminal, leave.direction = True, -1.0

    def turn(_, y):
        return y[1]

    def rates(t, y):
        return rig.rates(rig.after, t, y, e.force(max(y[0], 1e-300), y[1]))

    s = solve_ivp(rates, (t0, t0 + 1.0), [0.0, v0], events=[leave, turn], max_step=2e-5, dense_output=True, **tight)

    def force(t):
        y = s.sol(t)
        return e.force(y[0], y[1])

    # the largest force by golden section about the largest one stepped on
    i = int(np.argmax([e.force(*y) for y in s.y.T]))
    lo, hi = s.t[i - 1], s.t[i + 1]
    for _ in range(60):
        a, b = lo + 0.382 * (hi - lo), lo + 0.618 * (hi - lo)
        lo, hi = (lo, b) if force(a) > force(b) else (a, hi)
    return {
        "times": [float(q[0]) for q in flight.t_events[:-1]],
        "touch": t0,
        "impact_speed": v0,
        "deepest": s.y_events[1][0][0],
        "duration": s.t[-1] - t0,
        "restitution": -s.y[1, -1] / v0,
        "peak_force": force(0.5 * (lo + hi)),
    }


@pytest.mark.parametrize("name, friction", [("drop_test", 0.0), ("drop_test", 2.0), ("contactor_paper", 0.0)])
def test_a_drop_by_scipy_through_fmpy_gives_the_same_impact(touchdown, fmu, tmp_path, name, friction):
    text = (EXAMPLES / f"{name}.toml").read_text().replace("gravity = true", f"guide_friction = {friction}\ngravity = true", 1)
    scenario = tmp_path / "s.toml"
    scenario.write_text(text)
    _, summary = run(touchdown, scenario, tmp_path / "out")
    reported = summary["runs"][0]
    impact, gaps = reported["impacts"][0], reported["photo_interrupters"]
    rig = Rig(scenario, reported["drop_height"])
    with Element(fmu, rig.law) as e:
        got = fall(rig, e, gaps["positions"] if gaps else [])
    for what in ("touch", "impact_speed", "deepest", "duration", "restitution", "peak_force"):
        assert abs(impact[what] / got[what] - 1) < 1e-9, (what, impact[what], got[what])
    if gaps:
        assert worst(gaps["times"], np.array(got["times"])) < 1e-9


@pytest.mark.parametrize("golden", GOLDEN)
def test_golden_impacts_hold_through_the_fmu_in_run(touchdown, tmp_path, golden):
    k, p, mu, *wanted = golden
    scenario = tmp_path / "golden.toml"
    scenario.write_text(
        f'kind = "drop_test"\nmass = 1.0\nimpact_speed = 1.0\n[contact]\nstiffness = {k!r}\nexponent = {p!r}\n'
        f"hysteresis_damping = {mu!r}\n"
    )
    _, summary = run(touchdown, scenario, tmp_path / "out")
    impact = summary["runs"][0]["impacts"][0]
    for what, w in zip(("deepest", "restitution", "duration", "peak_force"), wanted):
        assert abs(impact[what] / w - 1) < 1e-6, what


def test_an_fmu_given_is_run_and_keeps_what_was_packed_into_it(touchdown, fmu, tmp_path):
    packed = tmp_path / "packed.fmu"
    sets = ["stiffness=2e8", "exponent=1.7", "hysteresis_damping=2e7", "yield_penetration=2e-4", "plastic_ratio=0.3"]
    subprocess.run([touchdown, "pack", "--out", str(packed), *(a for s in sets for a in ("--set", s))], check=True)
    whole = 'kind = "drop_test"\nmass = 1.0\nimpact_speed = 0.5\n[contact]\n'
    scenario = tmp_path / "packed.toml"
    scenario.write_text(whole + 'fmu = "packed.fmu"\n')
    given = tmp_path / "given.toml"
    given.write_text(whole + "\n".join(sets))
    a = run(touchdown, scenario, tmp_path / "a")[1]["runs"][0]
    b = run(touchdown, given, tmp_path / "b")[1]["runs"][0]
    assert a["impacts"][0]["separation"] is not None and "packed.fmu" in a["element"]
    for what in ("deepest", "restitution", "duration", "peak_force"):
        assert a["impacts"][0][what] == b["impacts"][0][what], what
