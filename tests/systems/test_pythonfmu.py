"""An FMU that pythonfmu exports, which declares no dependencies, no units and no states: an effect at its stop is found, handed
back, and what is handed back is nearer to a level that no recording has."""

import csv
import json
import os
import subprocess
import sysconfig
from pathlib import Path

import numpy as np
import pytest
from pythonfmu import FmuBuilder

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PROGRAM = os.environ.get("TOUCHDOWN", str(ROOT / "target/release/touchdown"))
PRELOADS = (80.0, 100.0, 125.0)          # N
UNSEEN = 140.0                          # N
SAMPLES, INTERVAL = 100, 7e-5          # s
NOISE = dict(force=12.0, acceleration=30.0, penetration=5e-6)

SYSTEM = f"""[[fmu]]
name = "bar"
file = "PushedBar.fmu"
[fmu.set]
preload = {UNSEEN}

[[fmu]]
name = "stop"
file = "touchdown:contact"
[fmu.set]
stiffness = 1.2e7
exponent = 1.2
hysteresis_damping = 1.2e6

[[connect]]
from = "bar.x"
to = "stop.penetration"
[[connect]]
from = "bar.v"
to = "stop.velocity"
[[connect]]
from = "stop.force"
to = "bar.push"

[master]
stop = {SAMPLES * INTERVAL}
step = 2e-6
"""

CAMPAIGN = """format = "recordings/1"
[campaign]
name = "bar"
kind = "system"
[simulation]
system = "system.toml"
terms = ["hysteresis_damping", "return_spring"]
[[simulation.free]]
variable = "stop.stiffness"
[[simulation.free]]
variable = "bar.mass"
tolerance = 0.002
[[simulation.bond]]
name = "stop"
kind = "contact"
force = "bar.push"
penetration = "bar.x"
velocity = "bar.v"
[simulation.channels]
force = "stop.force"
acceleration = "bar.a"
penetration = "bar.x"
"""


def libpython():
    """The library of this Python, which pythonfmu's looks for in the process that loads it; None where there is none."""
    known = sysconfig.get_config_vars()
    path = Path(known["LIBDIR"]) / known["LDLIBRARY"]
    return path if path.suffix == ".so" and path.exists() else None


def touchdown(*words, preload=True):
    """Runs the command; what it did."""
    env = dict(os.environ, LD_PRELOAD=str(libpython())) if preload else dict(os.environ)
    return subprocess.run([PROGRAM, *map(str, words)], capture_output=True, text=True, env=env)


def truth(preload, stiffening):
    """Rows of force N, acceleration m/s^2, penetration m of a bar whose stop stiffens beyond 0.12 mm: Runge and Kutta's steps."""
    def force(x, v):
        if x <= 0:
            return 0.0
        return max(1.2e7 * x**1.2 * (1 + 0.1 * v), 0.0) + (stiffening * (x - 1.2e-4) if x > 1.2e-4 else 0.0)

    def rate(y):
        return np.array([y[1], (preload - 2000.0 * (y[0] + 3e-3) - force(*y)) / 0.4])

    within = 40
    h, y, rows = INTERVAL / within, np.array([-3e-3, 0.0]), []
    for _ in range(SAMPLES):
        rows.append([force(*y), rate(y)[1], y[0]])
        for _ in range(within):
            a = rate(y)
            b = rate(y + h / 2 * a)
            c = rate(y + h / 2 * b)
            y = y + h / 6 * (a + 2 * b + 2 * c + rate(y + h * c))
    return np.array(rows)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The FMU, the system, and recordings of a stop that stiffens."""
    if libpython() is None:
        assert not os.environ.get("CI"), "this Python has no shared library, which the FMUs of pythonfmu need"
        pytest.skip("this Python has no shared library, which the FMUs of pythonfmu need")
    folder = tmp_path_factory.mktemp("bar")
    FmuBuilder.build_FMU(HERE / "pushed_bar.py", dest=folder)
    (folder / "system.toml").write_text(SYSTEM)
    text, random = CAMPAIGN, np.random.default_rng(21)
    for i, preload in enumerate(PRELOADS):
        rows = truth(preload, 4e6) + random.normal(size=(SAMPLES, 3)) * list(NOISE.values())
        with open(folder / f"r{i}.csv", "w", newline="") as f:
            out = csv.writer(f)
            out.writerow(["time [s]", "force [N]", "acceleration [m/s^2]", "penetration [m]"])
            out.writerows([INTERVAL * j, *map(float, row)] for j, row in enumerate(rows))
        text += f'[[recording]]\nfile = "r{i}.csv"\norder = {i}\nspring_preload = {preload}\n[recording.set]\n"bar.preload" = {preload}\n'
    (folder / "campaign.toml").write_text(text)
    return folder


def off(system, out):
    """How far the acceleration that the system gives is from the truth at the level not seen, as a share of it."""
    done = touchdown("run", system, "--out", out)
    assert done.returncode == 0, done.stderr
    with open(out / "results.csv") as f:
        a = np.array([float(row["bar.a"]) for row in csv.DictReader(f)])
    want = truth(UNSEEN, 4e6)[:, 1]
    return np.sqrt(np.mean((a[:: round(INTERVAL / 2e-6)][:SAMPLES] - want) ** 2) / np.mean(want**2))


def test_a_loop_that_is_one_by_declaration_alone_is_run(folder, tmp_path):
    done = touchdown("run", folder / "system.toml", "--out", tmp_path / "out")
    assert done.returncode == 0, done.stderr
    with open(tmp_path / "out" / "results.csv") as f:
        x = [float(row["bar.x"]) for row in csv.DictReader(f)]
    deepest = truth(UNSEEN, 0.0)[:, 2].max()
    assert abs(max(x) / deepest - 1) < 0.02


def test_without_its_python_the_fmu_is_named_with_the_cure(folder, tmp_path):
    done = touchdown("run", folder / "system.toml", "--out", tmp_path / "out", preload=False)
    assert done.returncode == 2
    assert "PushedBar.fmu" in done.stderr and "LD_PRELOAD" in done.stderr, done.stderr


def test_an_effect_at_its_stop_is_found_and_handed_back(folder, tmp_path):
    done = touchdown("diagnose", folder, "--out", tmp_path / "out", "--quiet")
    assert done.returncode == 0, done.stderr
    answer = tmp_path / "out" / folder.name
    verdict = json.loads((answer / "verdict.json").read_text())
    assert [m["mechanism"] for m in verdict["missing"]] == ["secondary_stiffening"]
    place = verdict["mismatch"]["where"][0]
    assert (place["bond"], place["fmu"], place["origin"]) == ("stop", "bar", "contact")
    before = off(folder / "system.toml", tmp_path / "before")
    for name in ("system.toml", "system.ssp"):
        after = off(answer / "system" / name, tmp_path / name)
        assert after < 0.2 * before, (name, before, after)
