"""The free impact in other people's co-simulation masters: each function returns the speed of rebound, m/s."""

import csv
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


def fmi_sim(folder):
    """fmi-sim steps one FMU only: the bar, flying freely; its penetration after 10 ms at 1 m/s from -2 mm."""
    folder = pathlib.Path(folder)
    bar = cases.pack(folder / "MovingBar.fmu", "moving-bar", start_velocity=1.0, start_penetration=-0.002)
    out = folder / "out.csv"
    done = subprocess.run(
        [fmi_sim_path(), "--model", bar, "--output-file", str(out), "co-simulation", "--step", "1e-3"]
        + ["--stop-time", "0.01"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    with open(out) as f:
        rows = list(csv.DictReader(f))
    return float(rows[-1]["penetration"])


# name, package, function, lookahead that its order of stepping wants
ALL = [
    ("touchdown run", None, touchdown, 0.5),
    ("touchdown run, jacobi", None, touchdown_parallel, 1.5),
    ("fmpy simulate_ssp", "fmpy", fmpy_ssp, 1.5),
    ("libcosimpy from_ssp_file", "libcosimpy", libcosim, 1.5),
    ("ecospy ssp", "ecospy", ecos, 1.5),
    ("fmucontainer in fmpy", "fmu-manipulation-toolbox", fmucontainer, 1.5),
]
