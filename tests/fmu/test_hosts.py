"""The element in other people's hosts."""

import ctypes
import os
import pathlib
import subprocess
import sys

import pytest

from .element import GOLDEN

K, P, MU, DEEPEST, RESTITUTION, DURATION, PEAK = GOLDEN[1]


def body(force_of, h, steps):
    """Steps a body of 1 kg from touch at 1 m/s; `force_of(x, v, i)` steps the host."""
    x, v, force, deepest = 0.0, 1.0, 0.0, 0.0
    for i in range(steps):
        x, v = x + h * v - 0.5 * h * h * force, v - h * force
        force = force_of(x, v, i)
        deepest = max(deepest, x)
        if x < 0:
            break
    return -v, deepest


def test_libcosimpy_steps_it(fmu):
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    h = 1e-5
    execution = CosimExecution.from_step_size(int(h * 1e9))
    slave = CosimLocalSlave(fmu_path=fmu, instance_name="contact")
    index = execution.add_local_slave(slave)
    reference = {v.name.decode(): v.reference for v in execution.slave_variables(index)}
    for name, value in (("stiffness", K), ("exponent", P), ("hysteresis_damping", MU), ("lookahead", 0.5)):
        assert execution.real_initial_value(index, reference[name], value)
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator)
    execution.add_observer(observer)
    inputs = [reference["penetration"], reference["velocity"]]

    def force(x, v, i):
        assert manipulator.slave_real_values(index, inputs, [x, v])
        assert execution.step()
        return observer.last_real_values(index, [reference["force"]])[0]

    e, deepest = body(force, h, 2000)
    assert e == pytest.approx(RESTITUTION, rel=1e-3)
    assert deepest == pytest.approx(DEEPEST, rel=1e-3)


def test_ecospy_steps_it(fmu):
    code = f"""
import ctypes, sys, sysconfig, pathlib
for tbb in [pathlib.Path(sys.prefix) / "lib/libtbb.so.12"]:
    if tbb.exists():
        ctypes.CDLL(str(tbb), mode=ctypes.RTLD_GLOBAL)
from ecospy import EcosSimulation, EcosSimulationStructure
from tests.fmu.test_hosts import body
h = 1e-5
with EcosSimulationStructure() as s:
    s.add_model("contact", {fmu!r})
    s.add_parameter_set("p", {{"contact::stiffness": {K}, "contact::exponent": {P},
                              "contact::hysteresis_damping": {MU}, "contact::lookahead": 0.5}})
    with EcosSimulation(structure=s, step_size=h) as sim:
        sim.init(parameter_set="p")
        def force(x, v, i):
            sim.set_real("contact::penetration", x)
            sim.set_real("contact::velocity", v)
            sim.step()
            return sim.get_real("contact::force")
        print(*body(force, h, 2000))
"""
    root = pathlib.Path(__file__).resolve().parents[2]
    o = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=root)
    assert o.returncode == 0, o.stderr[-2000:]
    e, deepest = map(float, o.stdout.split()[-2:])
    assert e == pytest.approx(RESTITUTION, rel=1e-3)
    assert deepest == pytest.approx(DEEPEST, rel=1e-3)


def test_fmutool_finds_nothing(fmu, tmp_path):
    tool = os.path.join(os.path.dirname(sys.executable), "fmutool")
    o = subprocess.run([tool, "-input", fmu, "-check", "-summary"], capture_output=True, text=True, cwd=tmp_path)
    text = o.stdout + o.stderr
    assert o.returncode == 0, text
    assert "HysteresisContact" in text and "ERROR" not in text and "WARNING" not in text, text


def test_fmucontainer_wraps_it_and_the_container_answers(fmu, tmp_path):
    import fmpy

    tool = os.path.join(os.path.dirname(sys.executable), "fmucontainer")
    (tmp_path / "HysteresisContact.fmu").write_bytes(pathlib.Path(fmu).read_bytes())
    (tmp_path / "two.csv").write_text(
        "rule;from_fmu;from_port;to_fmu;to_port\n"
        "FMU;HysteresisContact.fmu;;;\n"
        "INPUT;;x;HysteresisContact.fmu;penetration\n"
        "INPUT;;v;HysteresisContact.fmu;velocity\n"
        "OUTPUT;HysteresisContact.fmu;force;;f\n"
    )
    o = subprocess.run(
        [tool, "-container", "two.csv:1e-5", "-fmu-directory", str(tmp_path)], capture_output=True, text=True, cwd=tmp_path
    )
    assert o.returncode == 0, o.stdout + o.stderr
    made = tmp_path / "two.fmu"
    got = fmpy.simulate_fmu(str(made), stop_time=1e-3, output_interval=1e-4, start_values={"x": 1e-3, "v": 0.0}, output=["f"])
    assert got["f"][-1] == pytest.approx(1e8 * 1e-3**1.5, rel=1e-12)
