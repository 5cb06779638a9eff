"""Draws a fleet in the laboratory of tests/concealed: small campaigns of a production line, in which friction grows with the place in
the line and one batch yields.

    python -m tests.fleet.draw --seed S --campaigns N --out DIR     DIR/campaigns/<name>, DIR/truth.json; what is there stays
"""
import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

from tests.concealed import motion as m
from tests.concealed.calibrate import base_parameters, fit
from tests.concealed.effects import FORMS
from tests.concealed.generate import record, write_case
from tests.concealed.rigs import CHANNELS, draw, slim

BATCHES = "ABCD"
# the batch whose stops yield, and how strongly
YIELDS, YIELD = "C", 0.12
# friction at the end of the line
FRICTION = 0.25
SAMPLES = 110


def campaign(seed, i, n, folder):
    """Writes campaign i of n; what is concealed in it."""
    rng = np.random.default_rng([seed, i])
    name = f"f{seed}-{i:04d}"
    columns = dict(order=i, batch=BATCHES[int(rng.integers(len(BATCHES)))], temperature=round(float(23 + 4 * rng.standard_normal()), 1))
    while True:
        rig = slim(draw(rng, "drop-test", hysteresis=True, channels=CHANNELS), samples=SAMPLES)
        effects = [(FORMS["guide_friction", "coulomb"][2](rng, rig), FRICTION * i / n)]
        if columns["batch"] == YIELDS:
            effects.append((FORMS["plastic_indentation", "thornton"][2](rng, rig), YIELD))
        pairs = [(dict(apply=apply), s) for apply, s in effects]
        try:
            data, measured, mass = record(rng, rig, pairs, (False, False))
            P = base_parameters(rig)
            P[m.M] = mass
            user = fit(rig, data, P, stride=1, iterations=8, speeds=measured, start=None)
        except (ArithmeticError, np.linalg.LinAlgError):
            continue
        if user.r2 > 0.97:
            break
    part = folder / f".{name}.part"
    if part.exists():
        for f in part.iterdir():
            f.unlink()
        part.rmdir()
    write_case(part, name, rig, data, measured, mass, user.P, "s")
    toml = part / "campaign.toml"
    table = "[campaign.columns]\n" + "".join(f"{k} = {json.dumps(v)}\n" for k, v in columns.items())
    toml.write_text(toml.read_text().replace("[rig]", table + "\n[rig]", 1))
    part.rename(folder / name)
    return name, dict(columns, friction=effects[0][1], yields=len(effects) > 1)


def main():
    a = argparse.ArgumentParser(prog="python -m tests.fleet.draw")
    a.add_argument("--seed", type=int, required=True)
    a.add_argument("--campaigns", type=int, required=True)
    a.add_argument("--out", type=Path, required=True)
    o = a.parse_args()
    folder, truth = o.out / "campaigns", o.out / "truth.json"
    folder.mkdir(parents=True, exist_ok=True)
    known = json.loads(truth.read_text()) if truth.exists() else {}
    t0 = time.time()
    for i in range(o.campaigns):
        name = f"f{o.seed}-{i:04d}"
        if not (folder / name / "campaign.toml").exists() or name not in known:
            if (folder / name).exists():
                for f in (folder / name).iterdir():
                    f.unlink()
                (folder / name).rmdir()
            name, known[name] = campaign(o.seed, i, o.campaigns, folder)
            temp = truth.with_suffix(".part")
            temp.write_text(json.dumps(known, indent=1))
            temp.replace(truth)
        if (i + 1) % 50 == 0 or i + 1 == o.campaigns:
            print(f"{i + 1}/{o.campaigns} campaigns drawn, {time.time() - t0:.0f} s", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
