"""The Python side of `touchdown bench`: answers questions on stdin, a line each, with CPU seconds.

loop N      a step by setReal, doStep, getReal on fmpy's slave, over N steps
step N      doStep and getReal on fmpy's slave, inputs held, over N steps
empty N     the same on the empty FMU
simulate N  a step by fmpy.simulate_fmu with the same inputs, over N steps
drop JSON   a drop test with scipy's DOP853 on the FMU's force, seconds, then
            deepest m, restitution, duration s, accepted steps
Arguments: the FMU, and the empty FMU. With JSON as the second argument: that drop test, no questions.
"""
import csv
import json
import math
import shutil
import sys
import time

import fmpy
import numpy as np
import scipy
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from scipy.integrate import DOP853
from scipy.optimize import brentq

H, DEPTH, PERIOD = 1e-5, 1e-4, 500
OMEGA = 2 * math.pi / (PERIOD * H)
LAW = {"stiffness": 1e8, "exponent": 1.5, "hysteresis_damping": 3e7}


class Element:
    """The FMU as fmpy's users hold it."""

    def __init__(self, path, parameters):
        self.description = read_model_description(path)
        self.folder = extract(path)
        self.reference = {v.name: v.valueReference for v in self.description.modelVariables}
        self.slave = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName="bench",
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        if parameters:
            self.slave.setReal([self.reference[n] for n in parameters], list(parameters.values()))
        self.inputs = [self.reference["penetration"], self.reference["velocity"]]
        self.output = [self.reference["force"]]
        self.energies = [self.reference[n] for n in ("stored_energy", "dissipated_energy") if n in self.reference]

    def begin(self, x, v):
        self.slave.enterInitializationMode()
        self.slave.setReal(self.inputs, [x, v])
        self.slave.exitInitializationMode()

    def force(self, x, v):
        self.slave.setReal(self.inputs, [x, v])
        return self.slave.getReal(self.output)[0]

    def close(self):
        self.slave.terminate()
        self.slave.freeInstance()
        shutil.rmtree(self.folder)


class Walk:
    """The same walk as Rust's: in contact half the time."""

    def __init__(self, path, law=LAW):
        self.element = Element(path, law)
        self.element.begin(0.0, 0.0)
        phases = [OMEGA * H * n for n in range(PERIOD)]
        self.points = [[DEPTH * math.sin(p), DEPTH * OMEGA * math.cos(p)] for p in phases]
        self.done = 0

    def loop(self, steps):
        slave, inputs, output = self.element.slave, self.element.inputs, self.element.output
        points, total = self.points, 0.0
        start = time.process_time()
        for n in range(steps):
            slave.setReal(inputs, points[n % PERIOD])
            slave.doStep(self.done * H, H)
            self.done += 1
            total += slave.getReal(output)[0]
        return (time.process_time() - start) / steps


    def held(self, steps):
        slave, output = self.element.slave, self.element.output
        slave.setReal(self.element.inputs, self.points[100])
        total = 0.0
        start = time.process_time()
        for _ in range(steps):
            slave.doStep(self.done * H, H)
            self.done += 1
            total += slave.getReal(output)[0]
        return (time.process_time() - start) / steps


def simulate(path, folder, description, steps):
    """fmpy.simulate_fmu, unpacking and reading beforehand: its stepping only."""
    t = H * np.arange(steps + 1)
    signals = np.zeros(steps + 1, dtype=[("time", float), ("penetration", float), ("velocity", float)])
    signals["time"] = t
    signals["penetration"] = DEPTH * np.sin(OMEGA * t)
    signals["velocity"] = DEPTH * OMEGA * np.cos(OMEGA * t)
    start = time.process_time()
    simulate_fmu(
        folder, model_description=description, stop_time=float(t[-1]), step_size=H, output_interval=H, input=signals,
        output=["force"], start_values=LAW, fmi_type="CoSimulation",
    )
    return (time.process_time() - start) / steps


def drop(path, case):
    """From the drop height through `impacts` impacts to the top of the last rebound; writes results.csv."""
    start = time.process_time()
    m, gravity, tolerance = case["mass"], case["gravity"], case["tolerance"]
    element = Element(path, case["contact"])
    y, t = np.array([-case["drop_height"], 0.0]), 0.0
    element.begin(*y)
    deepest = 0.0

    def rates(_, y):
        return [y[1], gravity - element.force(y[0], y[1]) / m]

    rows, impacts, last = [], 0, {}
    h = 1e-5
    while True:
        scale = [max(1e-6, case["drop_height"]) * tolerance, tolerance * math.sqrt(2 * gravity * case["drop_height"])]
        solver = DOP853(rates, t, y, np.inf, rtol=tolerance, atol=scale, first_step=h)
        event = None
        while event is None:
            before = solver.y.copy()
            solver.step()
            after, ends = solver.y.copy(), solver.t
            dense = None
            for i in (0, 1):
                if before[i] * after[i] < 0 and solver.t_old < ends:
                    dense = dense or solver.dense_output()
                    at = brentq(lambda s: dense(s)[i], solver.t_old, solver.t, xtol=1e-16, rtol=1e-14)
                    if at <= ends and at - solver.t_old > 1e-9 * (solver.t - solver.t_old):
                        event, ends, after = i, at, dense(at)
                        after[i] = 0.0
            f = element.force(*after)
            element.slave.doStep(t, ends - t)
            t = ends
            rows.append([t, *after, f, *element.slave.getReal(element.energies)])
            deepest = max(deepest, after[0])
        y, h = after, None
        if event == 0 and y[1] > 0:
            touch, speed = t, y[1]
            deepest = 0.0
            short = 1e-3 * (2.5 * m * speed**2 / (2 * case["contact"]["stiffness"])) ** 0.4 / speed
            h = short
        elif event == 0:
            last = {"restitution": -y[1] / speed, "duration": t - touch}
            impacts, h = impacts + 1, 1e-5
        elif event == 1 and y[0] < 0 and impacts >= case["impacts"]:
            break
    element.close()
    seconds = time.process_time() - start
    with open(case["out"], "w", newline="") as f:
        w = csv.writer(f)
        w.writerow(["time [s]", "penetration [m]", "velocity [m/s]", "force [N]", "stored [J]", "dissipated [J]"])
        w.writerows(rows)
    return seconds, deepest, last["restitution"], last["duration"], len(rows)


def main():
    path = sys.argv[1]
    if sys.argv[2].startswith("{"):
        print(*drop(path, json.loads(sys.argv[2])))
        return
    walk, empty = Walk(path), Walk(sys.argv[2], {})
    description, folder = read_model_description(path), extract(path)
    print(f"Python {sys.version.split()[0]}, fmpy {fmpy.__version__}, scipy {scipy.__version__}", flush=True)
    try:
        for question in sys.stdin:
            word, _, rest = question.strip().partition(" ")
            if word == "loop":
                print(walk.loop(int(rest)), flush=True)
            elif word == "step":
                print(walk.held(int(rest)), flush=True)
            elif word == "empty":
                print(empty.held(int(rest)), flush=True)
            elif word == "simulate":
                print(simulate(path, folder, description, int(rest)), flush=True)
            elif word == "drop":
                print(*drop(path, json.loads(rest)), flush=True)
    finally:
        walk.element.close()
        empty.element.close()
        shutil.rmtree(folder, ignore_errors=True)


main()
