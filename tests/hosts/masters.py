"""The free impact in other people's co-simulation masters: each function returns the speed of rebound, m/s."""

import csv
import math
import os
import pathlib
import shutil
import subprocess
import sys

from . import cases

STEPS = round(0.02 / cases.STEP)


def touchdown(folder, lookahead, phase, method="gauss-seidel"):
    """Our own master."""
    out = pathlib.Path(folder) / "out"
    path = cases.system(folder, lookahead, phase, method)
    subprocess.run([cases.program(), "run", str(path), "--out", str(out)], check=True, stdout=subprocess.DEVNULL)
    with open(out / "results.csv") as f:
        rows = list(csv.DictReader(f))
    return -float(rows[-1]["bar.velocity [m/s]"])


def touchdown_parallel(folder, lookahead, phase):
    """Our own master, all FMUs from the last values."""
    return touchdown(folder, lookahead, phase, "jacobi")


def fmpy_ssp(folder, lookahead, phase):
    """fmpy: simulate_ssp on the exported archive."""
    from fmpy.ssp.simulation import simulate_ssp

    got = simulate_ssp(cases.archive(folder, lookahead, phase), stop_time=STEPS * cases.STEP, step_size=cases.STEP)
    return -float(got["bar.velocity"][-1])


def libcosim(folder, lookahead, phase):
    """libcosimpy: from_ssp_file on the exported archive, its fixed step given in nanoseconds."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimObserver import CosimObserver

    execution = CosimExecution.from_ssp_file(cases.archive(folder, lookahead, phase), round(cases.STEP * 1e9))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    for _ in range(STEPS):
        assert execution.step()
    for index in range(execution.num_slaves()):
        names = {v.name.decode(): v.reference for v in execution.slave_variables(index)}
        if "start_velocity" in names:
            return -observer.last_real_values(index, [names["velocity"]])[0]
    raise AssertionError("no bar among the slaves")


def ecos(folder, lookahead, phase):
    """ecospy: EcosSimulation on the exported archive, in a process of its own (it needs TBB loaded first)."""
    code = f"""
import ctypes, pathlib, sys
tbb = pathlib.Path(sys.prefix) / "lib/libtbb.so.12"
if tbb.exists():
    ctypes.CDLL(str(tbb), mode=ctypes.RTLD_GLOBAL)
from ecospy import EcosSimulation
with EcosSimulation(ssp_path={cases.archive(folder, lookahead, phase)!r}, step_size={cases.STEP!r}) as s:
    s.init()
    for _ in range({STEPS}):
        s.step()
    print("rebound", -s.get_real("bar::velocity"))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-2000:]
    return float(done.stdout.split("rebound")[-1])


def fmucontainer(folder, lookahead, phase):
    """fmu-manipulation-toolbox: both FMUs in one container, stepped by fmpy."""
    import fmpy

    folder = pathlib.Path(folder)
    start = -(2.0 + phase) * cases.STEP
    cases.pack(folder / "MovingBar.fmu", "moving-bar", mass=1.0, start_velocity=1.0, start_penetration=start)
    cases.pack(folder / "HysteresisContact.fmu", **cases.LAW, lookahead=lookahead)
    (folder / "both.csv").write_text(
        "rule;from_fmu;from_port;to_fmu;to_port\n"
        "FMU;MovingBar.fmu;;;\n"
        "FMU;HysteresisContact.fmu;;;\n"
        "LINK;MovingBar.fmu;penetration;HysteresisContact.fmu;penetration\n"
        "LINK;MovingBar.fmu;velocity;HysteresisContact.fmu;velocity\n"
        "LINK;HysteresisContact.fmu;force;MovingBar.fmu;force\n"
        "OUTPUT;MovingBar.fmu;velocity;;speed\n"
    )
    tool = os.path.join(os.path.dirname(sys.executable), "fmucontainer")
    done = subprocess.run(
        [tool, "-container", f"both.csv:{cases.STEP}", "-fmu-directory", str(folder)],
        capture_output=True,
        text=True,
        cwd=folder,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    got = fmpy.simulate_fmu(
        str(folder / "both.fmu"), stop_time=STEPS * cases.STEP, output_interval=cases.STEP, output=["speed"]
    )
    return -float(got["speed"][-1])


def fmi_sim_path():
    """The fmi-sim command, or None."""
    return os.environ.get("FMI_SIM") or shutil.which("fmi-sim")


def fmi_sim_steps(folder, model, *options):
    """The rows that fmi-sim writes of one FMU: it knows no connections."""
    out = pathlib.Path(folder) / "out.csv"
    done = subprocess.run(
        [fmi_sim_path(), "--model", str(model), "--output-file", str(out), *options], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    with open(out) as f:
        return list(csv.DictReader(f))


def fmi_sim_flight(folder):
    """The bar flying freely: its penetration after 10 ms at 1 m/s from -2 mm, off by how much of that."""
    bar = cases.pack(pathlib.Path(folder) / "MovingBar.fmu", "moving-bar", start_velocity=1.0, start_penetration=-0.002)
    rows = fmi_sim_steps(folder, bar, "co-simulation", "--step", "1e-5", "-f", "0.01")
    return float(rows[-1]["penetration"]) / 0.008 - 1.0


def fmi_sim_contact(folder):
    """The contact driven through half a sine from a file: its worst force beside the law, of the largest force."""
    h, depth, half = 1e-5, 1e-4, 250
    k, p, mu = 1e8, 1.5, 3e7
    omega = math.pi / (half * h)
    points = [(depth * math.sin(omega * h * i), depth * omega * math.cos(omega * h * i)) for i in range(half + 1)]
    given = pathlib.Path(folder) / "in.csv"
    lines = ["time,penetration,velocity"] + [f"{i * h!r},{x!r},{v!r}" for i, (x, v) in enumerate(points)]
    given.write_text("\n".join(lines) + "\n")
    fmu = cases.pack(
        pathlib.Path(folder) / "HysteresisContact.fmu", stiffness=k, exponent=p, hysteresis_damping=mu
    )
    rows = fmi_sim_steps(folder, fmu, "-i", str(given), "co-simulation", "--step", "1e-5", "-f", str(half * h))
    law = [max(0.0, (k + mu * v) * max(x, 0.0) ** p) for x, v in points]
    # it hands over the inputs of a step's beginning and writes what came out at its end
    got = [float(r["force"]) for r in rows[1:]]
    assert len(got) == half
    return max(abs(f - g) for f, g in zip(law, got)) / max(law)


# name, package, function, lookahead that its order of stepping wants
ALL = [
    ("touchdown run", None, touchdown, 0.5),
    ("touchdown run, jacobi", None, touchdown_parallel, 1.5),
    ("fmpy simulate_ssp", "fmpy", fmpy_ssp, 1.5),
    ("libcosimpy from_ssp_file", "libcosimpy", libcosim, 1.5),
    ("ecospy ssp", "ecospy", ecos, 1.5),
    ("fmucontainer in fmpy", "fmu-manipulation-toolbox", fmucontainer, 1.5),
]
