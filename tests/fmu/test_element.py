"""The element by itself, through fmpy: the standard, the law, state, threads, misuse."""

import concurrent.futures
import ctypes
import math
import random
import subprocess
import sys

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu

from .element import DISCARD, ERROR, GOLDEN, OK, Element

EVERYTHING = {
    "stiffness": 2e8,
    "exponent": 1.7,
    "hysteresis_damping": 5e7,
    "viscous_damping": 20.0,
    "yield_penetration": 2e-4,
    "plastic_ratio": 0.3,
    "adhesion_force": 15.0,
    "adhesion_range": 5e-5,
    "adhesion_form": 1,
    "relaxation_stiffness": 4e7,
    "relaxation_time": 2e-3,
    "relaxation_spread": 0.5,
    "secondary_stiffness": 1e8,
    "secondary_depth": 6e-4,
}


def test_nothing_is_found_against_it(fmu):
    assert validate_fmu(fmu) == []
    d = fmpy.read_model_description(fmu, validate=True)
    assert d.modelName == "HysteresisContact" and d.coSimulation is not None
    byname = {v.name: v for v in d.modelVariables}
    assert all(v.unit for v in d.modelVariables if v.type == "Real")
    assert [(u.variable.name, [k.name for k in u.dependencies]) for u in d.outputs][0] == (
        "force",
        ["penetration", "velocity"],
    )
    assert byname["penetration"].causality == byname["velocity"].causality == "input"
    assert {"force"} <= {u.variable.name for u in d.initialUnknowns}


def test_packing_again_gives_the_same_bytes(touchdown, fmu, tmp_path):
    again = tmp_path / "again.fmu"
    subprocess.run([touchdown, "pack", "--out", str(again)], check=True)
    assert again.read_bytes() == open(fmu, "rb").read()


def test_start_values_are_in_the_library_too(touchdown, tmp_path):
    path = str(tmp_path / "own.fmu")
    subprocess.run([touchdown, "pack", "--out", path, "--set", "stiffness=3e9", "--set", "exponent=2"], check=True)
    assert validate_fmu(path) == []
    with Element(path) as e:  # nothing set by the host
        assert e.force(1e-3, 0.0) == pytest.approx(3e9 * 1e-6, rel=1e-15)


def impact(e, mass, steps):
    """One impact at 1 m/s, Runge and Kutta's order 4 on the force read after each set; steps of `steps` per some
    duration. Deepest, restitution, duration, peak."""
    h = 0.006 / steps

    def rate(x, v):
        return v, -e.force(x, v) / mass

    x, v, t, rows = 0.0, 1.0, 0.0, []
    while True:
        f = e.force(x, v)
        rows.append((t, x, v, f))
        k1 = rate(x, v)
        k2 = rate(x + 0.5 * h * k1[0], v + 0.5 * h * k1[1])
        k3 = rate(x + 0.5 * h * k2[0], v + 0.5 * h * k2[1])
        k4 = rate(x + h * k3[0], v + h * k3[1])
        x1 = x + h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0])
        v1 = v + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])
        e.move(x1, v1)
        e.step(h)
        if x1 < 0.0:
            s = x / (x - x1)  # nearly no force here: the speed is what it was
            rows.append((t + s * h, 0.0, v + s * (v1 - v), 0.0))
            break
        x, v, t = x1, v1, t + h
    rows = np.array(rows)

    def top(y):
        i = int(np.argmax(y[1:-2])) + 1
        c = np.polyfit([-1, 0, 1], y[i - 1 : i + 2], 2)
        return y[i] - c[1] ** 2 / (4 * c[0])

    return top(rows[:, 1]), -rows[-1, 2], rows[-1, 0], top(rows[:, 3])


@pytest.mark.parametrize("golden", GOLDEN)
def test_golden_impacts_hold_to_a_millionth(fmu, golden):
    k, p, mu, *wanted = golden
    with Element(fmu, {"stiffness": k, "exponent": p, "hysteresis_damping": mu}) as e:
        got = impact(e, 1.0, 3000)
        lost = e.get("dissipated_energy")
    for name, g, w in zip(["deepest", "restitution", "duration", "peak"], got, wanted):
        assert abs(g / w - 1) < 1e-6, (name, g, w)
    assert abs(lost / (0.5 * (1 - wanted[1] ** 2)) - 1) < 1e-6


def test_force_answers_to_what_was_set_last_in_initialization_too(fmu):
    e = Element(fmu, {"stiffness": 1e8, "exponent": 1.5, "hysteresis_damping": 1e7}, initialize=False)
    e.fmu.setupExperiment()
    e.fmu.enterInitializationMode()
    assert e.force(1e-3, 0.5) == pytest.approx((1e8 + 0.5e7) * 1e-3**1.5, rel=1e-14)
    assert e.force(-1e-3, 0.5) == 0.0
    e.fmu.exitInitializationMode()
    assert e.force(2e-3, -0.1) == pytest.approx((1e8 - 0.1e7) * 2e-3**1.5, rel=1e-14)
    assert e.get("contact") == 1
    assert e.force(2e-3, -20.0) == 0.0, "never tensile without adhesion"
    e.close()


@pytest.mark.parametrize("start", [{"hysteresis_damping": 3e7}, EVERYTHING])
def test_directional_derivatives_agree_with_differences(fmu, start):
    rng = random.Random(3)
    with Element(fmu, start) as e:
        x = 0.0
        for i in range(60):
            x1, v1 = 1e-3 * math.sin(0.1 * i), rng.uniform(-0.3, 0.3)
            e.move(x1, v1)
            e.step(1e-4)
            y, v = x1 * rng.uniform(0.8, 1.2) + 1e-9, rng.uniform(-0.5, 0.5)
            for j, (name, d) in enumerate([("penetration", 1e-6 * abs(y)), ("velocity", 1e-4)]):
                at = [y, v]
                e.move(*at)
                got = e.fmu.getDirectionalDerivative([e.vr["force"]], [e.vr[name]], [1.0])[0]
                ends = []
                for s in (-1, 1):
                    a = list(at)
                    a[j] += s * d
                    ends.append(e.force(*a))
                scale = abs(ends[0]) / max(abs(at[j]), d) + abs(got) + 1e-9
                middle = e.force(*at)
                kink = abs(ends[0] + ends[1] - 2 * middle) / (2 * d)
                assert abs((ends[1] - ends[0]) / (2 * d) - got) < 1e-5 * scale + 2 * kink, (name, at)
            x = x1
        e.move(1e-3, -1e6)
        both = e.fmu.getDirectionalDerivative(
            [e.vr["force"]], [e.vr["penetration"], e.vr["velocity"]], [1.0, 1.0]
        )
        if start is not EVERYTHING:
            assert both == [0.0], "clamped"


def path(n):
    for i in range(n):
        yield 1.2e-3 * math.sin(0.05 * i), 0.6 * math.cos(0.05 * i)


def walk(e, points):
    seen = []
    for x, v in points:
        e.move(x, v)
        e.step(1e-4)
        seen.append([e.get(n) for n in ("force", "stored_energy", "dissipated_energy", "permanent_set")])
    return seen


def test_state_saved_and_restored_is_bit_identical(fmu):
    points = list(path(120))
    with Element(fmu, EVERYTHING) as e:
        walk(e, points[:50])
        kept, time = e.fmu.getFMUstate(), e.time
        first = walk(e, points[50:])
        e.fmu.setFMUstate(kept)
        e.time = time
        assert walk(e, points[50:]) == first
        e.fmu.freeFMUstate(kept)


def test_serialized_state_goes_on_in_a_new_process(fmu, tmp_path):
    points = list(path(120))
    with Element(fmu, EVERYTHING) as e:
        walk(e, points[:50])
        kept = e.fmu.getFMUstate()
        (tmp_path / "state").write_bytes(e.fmu.serializeFMUstate(kept))
        time, wanted = e.time, walk(e, points[50:])
    code = (
        "import sys; from tests.fmu.element import Element; from tests.fmu.test_element import path, walk\n"
        "e = Element(sys.argv[1])\n"
        "s = e.fmu.deSerializeFMUstate(open(sys.argv[2], 'rb').read()); e.fmu.setFMUstate(s)\n"
        "e.time = float(sys.argv[3])\n"
        "print([[v.hex() for v in r] for r in walk(e, list(path(120))[50:])])"
    )
    arguments = [sys.executable, "-c", code, fmu, str(tmp_path / "state"), repr(time)]
    root = __file__.rsplit("/tests/", 1)[0]
    got = subprocess.run(arguments, check=True, capture_output=True, text=True, cwd=root).stdout.strip()
    assert got == str([[v.hex() for v in r] for r in wanted])


def test_a_damaged_state_is_refused(fmu):
    with Element(fmu) as e:
        kept = e.fmu.getFMUstate()
        data = bytearray(e.fmu.serializeFMUstate(kept))
        data[40] ^= 1
        for bytes_ in (bytes(data), bytes(data[:10]), b""):
            pointer = ctypes.c_void_p()
            buffer = (ctypes.c_char * len(bytes_)).from_buffer_copy(bytes_)
            got = e.status("fmi2DeSerializeFMUstate", buffer, ctypes.c_size_t(len(bytes_)), ctypes.byref(pointer))
            assert got == ERROR and pointer.value is None
        assert "serializedState" in e.log[-1][2]


def test_two_hundred_instances_on_eight_threads_share_nothing(fmu):
    first = Element(fmu, EVERYTHING)
    one = walk(first, path(100))
    others = [Element(fmu, {**EVERYTHING, "stiffness": 2e8}) for _ in range(199)]
    with concurrent.futures.ThreadPoolExecutor(8) as pool:
        for seen in pool.map(lambda e: walk(e, path(100)), others):
            assert seen == one
    for e in [first, *others]:
        e.close()


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("name", ["penetration", "velocity"])
def test_no_finite_number_is_never_ok(fmu, bad, name):
    with Element(fmu) as e:
        e.move(1e-3, 0.1)
        before = e.get("force")
        assert e.set_status(name, bad) in (DISCARD, ERROR)
        assert name in e.log[-1][2] and "%s" not in e.log[-1][2]
        assert e.step_status(0.0, 1e-5) in (DISCARD, ERROR)
        assert e.get_status("force") in (DISCARD, ERROR)
        e.move(1e-3, 0.1)
        assert e.get("force") == before
        assert e.step_status(0.0, 1e-5) == OK
        assert e.step_status(1e-5, bad) == ERROR
        assert e.step_status(bad, 1e-5) == ERROR


def test_a_force_out_of_range_is_not_handed_out(fmu):
    with Element(fmu, {"exponent": 5.0}) as e:
        e.move(1e300, 0.0)
        assert e.get_status("force") in (DISCARD, ERROR)
        assert e.step_status(0.0, 1e-5) in (DISCARD, ERROR)
        assert "penetration" in e.log[-1][2]
        e.move(1e-3, 0.0)
        assert e.step_status(0.0, 1e-5) == OK


def test_misuse_gets_a_status_and_a_line_in_the_log(fmu):
    unknown = (ctypes.c_uint * 1)(4711)
    number = (ctypes.c_double * 1)(1.0)
    one, none = ctypes.c_size_t(1), ctypes.c_void_p()
    e = Element(fmu, initialize=False)

    def refused(status, word):
        assert status == ERROR and word in e.log[-1][2], (status, e.log[-1:])
        assert e.log[-1][1] == "logStatusError"

    refused(e.step_status(0.0, 1e-5), "fmi2DoStep")
    refused(e.status("fmi2ExitInitializationMode"), "fmi2ExitInitializationMode")
    refused(e.status("fmi2Terminate"), "fmi2Terminate")
    refused(e.get_status("force"), "force")
    refused(e.set_status("stiffness", math.nan), "stiffness")
    refused(e.set_status("force", 1.0), "force")
    refused(e.status("fmi2SetReal", unknown, one, number), "4711")
    refused(e.status("fmi2GetReal", unknown, one, number), "4711")
    refused(e.status("fmi2GetReal", none, one, number), "vr")
    refused(e.status("fmi2SetReal", unknown, one, none), "value")
    refused(e.status("fmi2GetInteger", (ctypes.c_uint * 1)(e.vr["force"]), one, (ctypes.c_int * 1)()), "Real")
    refused(e.status("fmi2GetString", unknown, one, (ctypes.c_char_p * 1)()), "String")
    refused(e.status("fmi2SetDebugLogging", 1, one, (ctypes.c_char_p * 1)(b"foo")), "foo")
    refused(e.status("fmi2SetFMUstate", none), "FMUstate")
    refused(e.status("fmi2GetFMUstate", none), "FMUstate")
    assert e.status("fmi2FreeFMUstate", none) == OK
    e.set("exponent", 40.0)
    assert e.status("fmi2EnterInitializationMode") == OK
    refused(e.status("fmi2ExitInitializationMode"), "exponent")
    e.set("exponent", 1.5)
    assert e.status("fmi2ExitInitializationMode") == OK
    refused(e.status("fmi2SetupExperiment", 0, ctypes.c_double(), ctypes.c_double(), 0, ctypes.c_double()), "Setup")
    refused(e.set_status("stiffness", 1e9), "stiffness")
    assert e.set_status("lookahead", 0.5) == OK
    refused(e.set_status("lookahead", 1e9), "lookahead")
    refused(e.step_status(0.5, 1e-5), "currentCommunicationPoint")
    refused(e.step_status(0.0, -1e-5), "communicationStepSize")
    refused(e.step_status(0.0, 0.0), "communicationStepSize")
    refused(e.status("fmi2CancelStep"), "pending")
    assert e.status("fmi2GetStatus", 0, (ctypes.c_int * 1)()) == DISCARD
    assert e.status("fmi2GetRealStatus", 2, number) == OK and number[0] == 0.0
    assert e.status("fmi2GetBooleanStatus", 3, (ctypes.c_int * 1)()) == OK
    assert e.status("fmi2Terminate") == OK
    refused(e.step_status(0.0, 1e-5), "Terminated")
    assert e.status("fmi2Reset") == OK
    assert e.status("fmi2EnterInitializationMode") == OK
    dll = e.dll
    for f in ("fmi2DoStep", "fmi2Reset", "fmi2GetReal", "fmi2SetReal", "fmi2Terminate"):
        function = getattr(dll, f)
        function.restype = ctypes.c_int
        assert function(none, none, none, none) == ERROR
    dll.fmi2FreeInstance(none)
    e.close()
    with pytest.raises(Exception):
        Element(fmu, guid="{11111111-1111-1111-1111-111111111111}")


def test_stop_time_is_kept_and_a_million_steps_do_not_drift(fmu):
    e = Element(fmu, initialize=False)
    e.fmu.setupExperiment(startTime=0.0, stopTime=1.0)
    e.fmu.enterInitializationMode()
    e.fmu.exitInitializationMode()
    assert e.step_status(0.0, 1.0) == OK
    assert e.step_status(1.0, 1e-3) == ERROR
    e.close()
    with Element(fmu) as e:
        time, h = 0.0, 1e-7
        for i in range(100_000):
            assert e.step_status(i * h, h) == OK
        number = (ctypes.c_double * 1)()
        assert e.status("fmi2GetRealStatus", 2, number) == OK
        assert abs(number[0] - 0.01) < 1e-15


def test_input_derivatives_lead_to_the_end_of_the_step_and_output_derivatives_come_from_there(fmu):
    start = {"stiffness": 1e8, "exponent": 1.5, "hysteresis_damping": 1e7}
    x, v, a, h = 1e-3, 0.4, -300.0, 1e-4
    with Element(fmu, start) as e, Element(fmu, start) as plain:
        e.move(x, v)
        e.fmu.setRealInputDerivatives([e.vr["penetration"], e.vr["velocity"]], [1, 1], [v, a])
        e.step(h)
        wanted = plain.force(x + h * v, v + h * a)
        assert e.get("force") == wanted
        e.move(x, v)  # without a call the inputs are held, and v is the derivative of x
        e.step(h)
        assert e.get("force") == plain.force(x, v)
        e.fmu.setRealInputDerivatives([e.vr["velocity"]], [1], [a])
        rate = e.fmu.getRealOutputDerivatives([e.vr["force"]], [1])[0]
        d = 1e-7
        slope = (plain.force(x + d * v, v + d * a) - plain.force(x - d * v, v - d * a)) / (2 * d)
        assert rate == pytest.approx(slope, rel=1e-6)


def test_contact_is_logged_when_asked_for(fmu):
    with Element(fmu, logging=True) as e:
        for x in (-1e-4, 1e-4, 2e-4, -1e-4):
            e.move(x, 0.0)
            e.step(1e-4)
        lines = [m for _, c, m in e.log if c == "logContact"]
        assert len(lines) == 2 and "begins" in lines[0] and "ends" in lines[1]


@pytest.mark.parametrize("master, best", [("sequential", 0.5), ("parallel", 1.5)])
def test_lookahead_cuts_the_energy_a_holding_host_gains(fmu, master, best):
    k, p, mu, _, wanted, duration, _ = GOLDEN[1]

    def worst(lookahead, steps):
        h, errors = duration / steps, []
        for phase in (0.0, 0.25, 0.5, 0.75):
            start = {"stiffness": k, "exponent": p, "hysteresis_damping": mu, "lookahead": lookahead}
            with Element(fmu, start) as e:
                x, v, force = -(3 + phase) * h, 1.0, 0.0
                while x > -4 * h or v > 0:
                    x0, v0 = x, v
                    x, v = x + h * v - 0.5 * h * h * force, v - h * force
                    e.move(*((x, v) if master == "sequential" else (x0, v0)))
                    e.step(h)
                    force = e.get("force")
                errors.append(abs(-v / wanted - 1))
        return max(errors)

    assert worst(0.0, 40) > 0.02
    assert worst(best, 40) < 2e-3
    assert worst(best, 20) < (1e-3 if master == "sequential" else 2e-2)


def test_fmpy_simulates_it_from_input_signals(fmu):
    t = np.linspace(0.0, 0.01, 2001)
    x, v = 1e-3 * np.sin(400 * t), 0.4 * np.cos(400 * t)
    signals = np.array(list(zip(t, x, v)), dtype=[("time", float), ("penetration", float), ("velocity", float)])
    start = {"stiffness": 1e8, "exponent": 1.5, "hysteresis_damping": 1e7}
    got = fmpy.simulate_fmu(fmu, stop_time=0.01, output_interval=5e-6, start_values=start, input=signals, output=["force"])
    xs, vs = np.interp(got["time"], t, x), np.interp(got["time"], t, v)
    wanted = np.where(xs > 0, np.maximum(0, np.abs(xs) ** 1.5 * (1e8 + 1e7 * vs)), 0.0)
    assert np.abs(got["force"] - wanted).max() < 2e-3 * wanted.max()
