"""The same two scenarios for every host: a free impact with its exact answer, and the opening of a contactor."""

import math
import os
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parents[2]

# 1 kg at 1 m/s on k = 1.85e8, p = 1.96, mu_d = 8.77e7: from the exact phase curve, evaluated to 40 digits
LAW = {"stiffness": 1.85e8, "exponent": 1.96, "hysteresis_damping": 8.77e7}
RESTITUTION, DURATION, PEAK = 0.75847045292087518, 5.4497898388347824e-3, 716.04884002798315
# a communication step of whole nanoseconds, some 22 a contact
STEP = 2.5e-4
PHASES = [0.1, 0.35, 0.6, 0.85]

CONTACTOR_LAW = {"stiffness": 2.27e6, "exponent": 1.0, "hysteresis_damping": 1.0e6}
MASS, TRAVEL, PRELOAD, RATE, HOLD, FADE = 0.509, 0.004, 12.3, 900.0, 30.0, 0.002


def program():
    """The touchdown command, built."""
    path = os.environ.get("TOUCHDOWN", str(ROOT / "target/release/touchdown"))
    assert os.path.exists(path), "build it first: cargo build --release --workspace"
    return path


def pack(out, model="contact", **start):
    """Packs a model with start values."""
    sets = [f"--set={name}={value!r}" for name, value in start.items()]
    subprocess.run([program(), "pack", "--model", model, "--out", str(out), *sets], check=True, stdout=subprocess.DEVNULL)
    return str(out)


def contactor_drive(t, x, v):
    """Spring less magnet, N; the seat holds against what pulls away from the stop."""
    net = PRELOAD - RATE * (x + TRAVEL) - HOLD * math.exp(-t / FADE)
    return 0.0 if x <= -TRAVEL and net < 0.0 else net


def system(folder, lookahead, phase, method="gauss-seidel", stop=0.02):
    """A system file of bar and contact, the free impact; its path."""
    start = -(2.0 + phase) * STEP
    path = pathlib.Path(folder) / "impact.toml"
    sets = "\n".join(f"{n} = {v!r}" for n, v in LAW.items())
    path.write_text(f"""
name = "impact"
[[fmu]]
name = "bar"
file = "touchdown:moving-bar"
[fmu.set]
mass = 1.0
start_velocity = 1.0
start_penetration = {start!r}
[[fmu]]
name = "contact"
file = "touchdown:contact"
[fmu.set]
{sets}
lookahead = {lookahead}
[[connect]]
from = "bar.penetration"
to = "contact.penetration"
[[connect]]
from = "bar.velocity"
to = "contact.velocity"
[[connect]]
from = "contact.force"
to = "bar.force"
[master]
method = "{method}"
step = {STEP}
stop = {stop}
[results]
record = ["bar.penetration", "bar.velocity", "contact.force_at_inputs"]
""")
    return path


def archive(folder, lookahead, phase):
    """The same as an SSP archive; its path."""
    out = pathlib.Path(folder) / "impact.ssp"
    subprocess.run(
        [program(), "export-ssp", str(system(folder, lookahead, phase)), "--out", str(out)],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    return str(out)
