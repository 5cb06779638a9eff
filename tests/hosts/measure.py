"""What each host makes of both scenarios, against the exact impact: used by the tests and by the table."""

import importlib.metadata
import math
import tempfile

from . import cases, engines, masters
from .element import Contact

# engine, how it is stepped, function, options, lookahead that suits it
ENGINES = [
    ("MuJoCo", "Euler (semi-implicit)", engines.mujoco, {}, 0.0),
    ("MuJoCo", "RK4", engines.mujoco, {"integrator": "RK4"}, 0.5),
    ("Exudyn", "RK44", engines.exudyn, {"solver": "RK44"}, 0.5),
    ("Exudyn", "generalized alpha", engines.exudyn, {}, 1.0),
    ("Drake", "continuous, force held", engines.drake, {}, 0.5),
    ("Drake", "discrete plant", engines.drake, {"discrete": True}, 0.0),
]


def version(package):
    return importlib.metadata.version(package)


def impact(fmu, drive, options, lookahead, phase):
    """(restitution, peak force) over the exact ones, less one, of the free impact."""
    contact = Contact(fmu, **cases.LAW, lookahead=lookahead)
    last = {"v": 0.0, "peak": 0.0}

    def seen(t, x, v):
        last["v"] = v
        last["peak"] = max(last["peak"], contact.get("force_at_inputs"))
        return not (x <= 0.0 and v < 0.0)

    start = -(2.0 + phase) * cases.STEP
    time = 8.0 * cases.DURATION
    drive(contact, 1.0, start, 1.0, lambda t, x, v: 0.0, cases.STEP, time, seen, **options)
    contact.close()
    return -last["v"] / cases.RESTITUTION - 1.0, last["peak"] / cases.PEAK - 1.0


def worst_impact(fmu, drive, options, lookahead):
    """The worst of both over the phases on which the touch falls."""
    all = [impact(fmu, drive, options, lookahead, p) for p in cases.PHASES]
    return max(abs(e) for e, _ in all), max(abs(p) for _, p in all)


def made_up(fmu, steps, lookahead):
    """(energy reported less work done, error of the rebound's energy), as shares of the impact's energy, in a loop that
    moves a body of 1 kg exactly under the force held."""
    h = cases.DURATION / steps
    contact = Contact(fmu, **cases.LAW, lookahead=lookahead)
    x, v, work = -2.3 * h, 1.0, 0.0
    force = contact.force(x, v, h)
    while not (x <= 0.0 and v < 0.0):
        at, v = x + h * v - 0.5 * h * h * force, v - h * force
        work += force * (at - x)
        x = at
        force = contact.force(x, v, h)
    reported = contact.get("stored_energy") + contact.get("dissipated_energy")
    contact.close()
    return 2.0 * (reported - work), v * v - cases.RESTITUTION**2


def rest(fmu, drive, options, lookahead, gravity=9.81):
    """Where a body set down 10 % too deep comes to rest on a contact with a viscous part, over the exact depth, less
    one; and its largest departure in the last tenth of the time, as a share."""
    depth = (gravity / cases.LAW["stiffness"]) ** (1.0 / cases.LAW["exponent"])
    rate = math.sqrt(cases.LAW["exponent"] * gravity / depth)
    h = 2.0 * math.pi / rate / 40.0
    law = {**cases.LAW, "hysteresis_damping": 0.0, "viscous_damping": 0.4 * rate}
    contact = Contact(fmu, **law, lookahead=lookahead)
    path = []
    drive(contact, 1.0, 1.1 * depth, 0.0, lambda t, x, v: gravity, h, 2000 * h, lambda t, x, v: path.append(x) or True, **options)
    contact.close()
    end = path[-len(path) // 10 :]
    return path[-1] / depth - 1.0, max(abs(x / depth - 1.0) for x in end)


def contactor(fmu, drive, options, lookahead, h=5e-5):
    """(peak force, speed of the first rebound) of the contactor's opening, N and m/s."""
    contact = Contact(fmu, **cases.CONTACTOR_LAW, lookahead=lookahead)
    found = {"peak": 0.0, "rebound": None}

    def seen(t, x, v):
        found["peak"] = max(found["peak"], contact.get("force_at_inputs"))
        if found["peak"] > 0.0 and x <= 0.0 and v < 0.0:
            found["rebound"] = -v
            return False
        return True

    drive(contact, cases.MASS, -cases.TRAVEL, 0.0, cases.contactor_drive, h, 0.05, seen, **options)
    contact.close()
    return found["peak"], found["rebound"]


def contactor_reference():
    """The same by our own iterated master, its step by doubling to 1e-9."""
    import csv
    import pathlib
    import subprocess

    folder = pathlib.Path(tempfile.mkdtemp())
    text = (cases.ROOT / "harness/examples/contactor_system.toml").read_text()
    head = text.split("[[lookahead]]")[0].replace('"gauss-seidel"', '"iterated"')
    head = head.replace("[[touch]]", 'adapt = { by = "doubling", tolerance = 1e-9, longest = 1e-4 }\n\n[[touch]]', 1)
    path = folder / "system.toml"
    path.write_text(head.replace("stop = 0.1", "stop = 0.026"))
    out = folder / "out"
    subprocess.run([cases.program(), "run", str(path), "--out", str(out)], check=True, stdout=subprocess.DEVNULL)
    with open(out / "results.csv") as f:
        rows = list(csv.DictReader(f))
    peak = max(float(r["contact.force_at_inputs [N]"]) for r in rows)
    x = [float(r["bar.penetration [m]"]) for r in rows]
    v = [float(r["bar.velocity [m/s]"]) for r in rows]
    i = next(i for i in range(1, len(x)) if x[i - 1] > 0.0 and x[i] <= 0.0)
    return peak, -v[i]


def worst_master(function, lookahead):
    """Largest error of restitution over the phases, in a co-simulation master."""
    worst = 0.0
    for phase in cases.PHASES:
        with tempfile.TemporaryDirectory() as folder:
            worst = max(worst, abs(function(folder, lookahead, phase) / cases.RESTITUTION - 1.0))
    return worst
