"""Contactor openings drawn blind, diagnosed by the built-in rig and, converted, by FMUs: tests/prove --system."""
import json
import statistics
import sys

import numpy as np

from tests.systems.convert import convert

from .effects import FORMS, KNOWN, allowed
from .generate import generate, jsonable, label_hash
from .judge import judge
from .rigs import CHANNELS

KIND = "contactor-opening"
TIERS = ("plain", "concealed", "deep")
NOTHING = 0.25           # share with nothing missing


def plan(rng, n):
    """Tier and effect of each of n openings, shuffled; effects are dealt from decks of those that an opening allows."""
    names = [k for k in KNOWN if any(allowed(*f, KIND, CHANNELS) for f in FORMS if f[0] == k)]
    nothing, deck, out = round(NOTHING * n), [], []
    for i in range(n):
        deck = deck or [str(x) for x in rng.permutation(names)]
        out.append(("null", None) if i < nothing else (TIERS[i % len(TIERS)], deck.pop()))
    return [out[i] for i in rng.permutation(n)]


def generate_openings(seed, n, out, say):
    """As `generate`, of openings alone."""
    return generate(seed, n, out, say, todo=plan(np.random.default_rng([seed, 0x5E57]), n), only=KIND)


def row(case, truth, out, runs):
    """One case: what was concealed, what either named, whether both named the same, the processor time of both [s]."""
    r = dict(case=case, concealed=truth["missing"], tier=truth["tier"])
    for who, run in runs.items():
        j = judge(out / ("open" if who == "rig" else "systems") / case, truth, out / who / case)
        r[who] = dict(named=j["named"], answered=j["answered"], right=j["right"], unexplained=j["unexplained"],
                      cpu=run[case]["cpu"], code=run[case]["code"])
    both = [(sorted(r[who]["named"]), r[who]["unexplained"]) for who in runs]
    r["same"] = all(r[who]["answered"] for who in runs) and both[0] == both[1]
    r["ratio"] = r["fmus"]["cpu"] / r["rig"]["cpu"]
    return r


def in_words(named, unexplained):
    """Names and what is unexplained besides, in words."""
    return " + ".join(named) + (" + unexplained" if unexplained and named else "unexplained" if unexplained else "" if named else "nothing")


def table(rows):
    """The rows as a table in Markdown, and what they come to."""
    lines = ["| case | concealed | built-in rig | FMUs | same | time, FMUs over rig |", "|---|---|---|---|---|---|"]
    for r in rows:
        of = [in_words(r[who]["named"], r[who]["unexplained"]) if r[who]["answered"] else f"no answer ({r[who]['code']})" for who in ("rig", "fmus")]
        lines.append(f"| `{r['case']}` | {in_words(r['concealed'], False)} | {of[0]} | {of[1]} | {'yes' if r['same'] else 'no'} | {r['ratio']:.1f} |")
    ratios = [r["ratio"] for r in rows]
    right = {who: sum(r[who]["right"] for r in rows) for who in ("rig", "fmus")}
    lines += ["", f"Same names: {sum(r['same'] for r in rows)} of {len(rows)}. Right: {right['rig']} by the built-in rig, {right['fmus']} by FMUs. "
              f"Processor time of FMUs over that of the rig: {statistics.median(ratios):.1f} in the middle, {max(ratios):.1f} at most."]
    return "\n".join(lines)


def prove(o, binary, head, diagnose_all):
    """Diagnoses every case twice while the labels are sealed, opens them, prints the table, and writes systems.json."""
    out = o.out
    cases = [out / "open" / f"s{s}-{i + 1:03d}" for s, n in o.sets for i in range(n)]
    for c in cases:
        if not (out / "systems" / c.name / "campaign.toml").exists():
            convert(c, out / "systems" / c.name)
    runs = {"rig": diagnose_all(binary, cases, out / "rig", o.jobs, "by the rig")[0],
            "fmus": diagnose_all(binary, [out / "systems" / c.name for c in cases], out / "fmus", o.jobs, "by FMUs")[0]}
    if label_hash(out / "truth") != head["sha256"]:
        sys.exit("the labels changed while they were sealed: nothing is proved")
    rows = [row(c.name, json.loads((out / "truth" / f"{c.name}.json").read_text()), out, runs) for c in cases]
    (out / "systems.json").write_text(json.dumps(jsonable(dict(head=head, cases=rows)), indent=1))
    print(table(rows))
