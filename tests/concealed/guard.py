"""Small campaigns that a build is held to: what each hides is known, and has been named right before.

A case is a line of CASES: everything in it is drawn again from its seed. It guards the diagnosis against being broken
unseen; it says nothing of how good the diagnosis is (tests/prove does), and nothing is tuned on it.

    python -m tests.concealed.guard --draw SEED/N --touchdown BINARY [--of NAME,...]

draws N candidates, diagnoses them and prints those named right as such lines, with the seconds each took.
"""
import argparse
import json
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import motion as m
from .calibrate import base_parameters, fit
from .effects import FORMS, KNOWN, ORIGIN, allowed
from .forms import DIC
from .generate import CALM, record, tune, write_case
from .judge import TIES
from .rigs import CHANNELS, draw, simulate, slim

KINDS = {"d": "drop-test", "c": "contactor-opening", "i": "indentation"}


@dataclass(frozen=True)
class Case:
    """A campaign: seed, kind (d, c or i), and (mechanism, form, strength) of each effect; none where nothing is missing."""
    seed: int
    kind: str
    effects: tuple = ()

    @property
    def names(self):
        return tuple(e[0] for e in self.effects)

    def __str__(self):
        return f"guard-{self.seed}: {' + '.join(self.names) or 'nothing missing'}, {KINDS[self.kind]}"


# 3 with nothing missing, 7 single effects (contact, motion, chain), a pair, one from outside the vocabulary
CASES = (
    Case(11, "d"),
    Case(15, "d"),
    Case(21, "i"),
    Case(102, "c", (("plastic_indentation", "permanent-set", 0.007),)),
    Case(111, "c", (("secondary_stiffening", "hertzian", 0.565),)),
    Case(131, "c", (("guide_friction", "coulomb", 0.00388),)),
    Case(191, "d", (("loose_part", "rattle-hertzian", 0.15),)),
    Case(150, "d", (("channel_skew", "drifting-clock", 0.0672),)),
    Case(160, "c", (("charge_droop", "two-corners", 0.05),)),
    Case(180, "c", (("clipping", "hard", 0.11),)),
    Case(300, "c", (("squeeze_film", "cubic-cut-off", 0.00938), ("lowpass_lag", "first-order", 0.0969))),
    Case(330, "d", (("unknown:corrugated", "periodic", 0.248),)),
)


def rig_of(rng, kind, names):
    """The small rig of a case, with the term left out of the simulation that is to be missing."""
    rig = slim(draw(rng, KINDS[kind], False if "hysteresis_damping" in names or kind == "i" else None, ("force", "penetration") if kind == "i" else CHANNELS))
    if "gravity" in names:
        rig.terms = [t for t in rig.terms if t != "gravity"]
    return rig


def effect(rng, rig, name, form):
    return dict(mechanism=name, form=form, origin=ORIGIN[name], apply=FORMS[name, form][2](rng, rig), key=(name, form))


def campaign(case, folder):
    """Draws the case and writes it as a campaign into `folder`."""
    rng = np.random.default_rng([0x67, case.seed])
    rig = rig_of(rng, case.kind, case.names)
    written(rng, rig, [(effect(rng, rig, n, f), s) for n, f, s in case.effects], folder)


def written(rng, rig, pairs, folder):
    """Records the rig with its effects, calibrates the simulation to it, writes the campaign."""
    data, speeds, mass = record(rng, rig, pairs, (False, False))
    P = base_parameters(rig)
    P[m.M] = mass
    stride = max(1, int(np.median([r.n for r in rig.recs]) // 220))
    user = fit(rig, data, P, stride=stride, speeds=speeds if rig.kind == "drop-test" else None)
    write_case(folder, folder.name, rig, data, speeds, mass, user.P, "s")


def wrong(case, verdict):
    """What is wrong with the verdict's names, in words; empty where it is right."""
    named = {q["mechanism"] for q in verdict["missing"]}
    detected, unexplained = verdict["mismatch"]["detected"], verdict["unexplained"]["detected"]
    said = " + ".join(sorted(named)) or "no name"
    said += (", unexplained" if unexplained else "") + ("" if detected else ", nothing detected")
    also = {a for q in verdict["missing"] for a in q.get("also_possible", [])}
    for tie in TIES:                        # of a pair nobody can part, either with the other held open
        for a in tie & set(case.names):
            if tie - {a} <= named and a in also:
                named = (named - tie) | {a}
    if not case.names:
        ok = not named and not detected
    elif case.names[0].startswith("unknown:"):
        ok = not named and detected and unexplained
    else:
        ok = named == set(case.names) and detected and not unexplained
    return "" if ok else f"{case}; said: {said}"


def diagnosed(binary, folder, out, jobs=1):
    """The verdict of the binary on a campaign; an error with what it printed where it gives none."""
    r = subprocess.run([str(binary), "diagnose", str(folder), "--out", str(out), "--jobs", str(jobs)], capture_output=True, text=True)
    if r.returncode not in (0, 3):      # 3: cannot be judged, and the verdict says why
        raise RuntimeError(f"{folder.name}: exit code {r.returncode}: {(r.stderr or r.stdout).strip()[-300:]}")
    return json.loads((out / folder.name / "verdict.json").read_text())


def candidate(seed, wanted):
    """A case drawn at random among the names wanted, strengths tuned to 2 to 5 sigmas; None where it does not come out."""
    rng = np.random.default_rng([0x67, 0xCA, seed])
    names = [] if wanted == ["nothing"] else [str(x) for x in rng.choice(wanted, 1)]
    if wanted == ["pair"]:
        known = sorted(set(KNOWN) - {"residual_magnetism", "gravity", "return_spring"})
        names = [str(x) for x in rng.choice(known, 2, replace=False)]
    kind = str(rng.choice(list(DIC), p=[0.3, 0.6, 0.1]))
    own = np.random.default_rng([0x67, seed])
    rig = rig_of(own, kind, names)
    pairs = []
    for n in names:
        forms = [k[1] for k in FORMS if k[0] == n and allowed(*k, rig.kind, rig.channels)]
        if not forms:
            return None
        eff = effect(own, rig, n, str(rng.choice(forms)))
        got = tune(rng, rig, eff, float(np.exp(rng.uniform(np.log(2.0), np.log(5.0)))))
        if got is None:
            return None
        pairs.append((n, eff["form"], float(f"{got[0]:.3g}")))
    return Case(seed, kind, tuple(pairs))


def main():
    a = argparse.ArgumentParser(prog="python -m tests.concealed.guard", description="Draws candidates for CASES and prints those the binary names right.")
    a.add_argument("--draw", required=True, metavar="SEED/N", help="N candidates from the seeds SEED, SEED + 1, ...")
    a.add_argument("--touchdown", type=Path, required=True)
    a.add_argument("--of", default="nothing", help="names to draw from, with commas; or nothing, or pair")
    a.add_argument("--out", type=Path, required=True)
    o = a.parse_args()
    first, n = (int(x) for x in o.draw.split("/"))
    for seed in range(first, first + n):
        try:
            case = candidate(seed, o.of.split(","))
        except (ArithmeticError, np.linalg.LinAlgError):
            case = None
        if case is None:
            continue
        folder, t0 = o.out / f"guard-{seed}", time.monotonic()
        campaign(case, folder)
        t1 = time.monotonic()
        try:
            text = wrong(case, diagnosed(o.touchdown, folder, o.out / "verdicts"))
        except RuntimeError as e:
            text = str(e)
        print(f"{'# wrong ' if text else ''}{case!r}   # {t1 - t0:.1f} s drawn, {time.monotonic() - t1:.1f} s diagnosed {text}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
