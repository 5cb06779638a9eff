"""tests/calibrate: campaigns of the laboratory, diagnosed, and the table of probabilities fitted to them."""
import argparse
import json
import os
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np

from . import prove, weights
from .generate import generate, label_hash
from .groups import case_name, draw_group
from .scores import BINS

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "harness" / "diagnose" / "calibration.json"
PICTURE = ROOT / "docs" / "src" / "images" / "reliability.png"
# campaigns of a seed: of today's mix, of pairs and of each group; the sealed half never calibrates while it is sealed.
# Folders drawn before hold other numbers of each: every group counts as much as it has here
SHARES = {"mix": 40, "pairs": 12, "print": 20, "dirt": 12, "little": 12, "strangers": 20, "rough": 12}
FOLDS = 5


def options():
    a = argparse.ArgumentParser(prog="tests/calibrate", description="Draws campaigns, diagnoses them, fits harness/diagnose/calibration.json to their evidence and draws the reliability it was judged by. Seeds that calibrate must not judge (tests/prove).")
    a.add_argument("seeds", metavar="SEED", type=int, nargs="*", help="seeds to draw from; none: only from folders given by --drawn")
    a.add_argument("--out", type=Path, default=ROOT / "out" / "calibration", help="folder of cases and verdicts (default out/calibration)")
    a.add_argument("--drawn", type=Path, action="append", default=[], metavar="DIR", help="a folder with truth/ and verdicts/ drawn before (tests/prove, --out)")
    a.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    a.add_argument("--touchdown", type=Path, help="another touchdown binary than the one the launcher builds")
    a.add_argument("--only", nargs="+", choices=[*weights.PARAMETERS, "level"], metavar="NAME", help="fit these numbers of the table alone, from where they are; the others stay as they are")
    a.add_argument("--dry", action="store_true", help="print and draw, write no table")
    o = a.parse_args()
    if not o.seeds and not o.drawn:
        a.error("give seeds to draw from, or --drawn DIR")
    return o


def drawn(o, binary):
    """Draws what is not there yet and diagnoses it; the folder with truth/ and verdicts/."""
    mark, total, done, t0 = o.out / "drawn.json", len(o.seeds) * sum(SHARES.values()), 0, time.monotonic()
    cases = []
    for seed in o.seeds:
        for group, n in SHARES.items():
            say = lambda i, *_: prove.progress(done + i, total, t0, "drawing")
            held = json.loads(mark.read_text()) if mark.exists() else []
            names = [f"s{seed}-{i + 1:03d}" if group == "mix" else case_name(seed, group, i) for i in range(n)]
            if [seed, group] not in held:
                if group == "mix":
                    generate(seed, n, o.out, say)
                elif group == "pairs":
                    generate(seed, n, o.out, say, prefix=f"s{seed}-pairs", todo=[("pair", None)] * n)
                else:
                    draw_group(seed, n, group, o.out, say)
                mark.write_text(json.dumps(held + [[seed, group]]))
            cases += [o.out / "open" / name for name in names]
            done += n
    sealed = label_hash(o.out / "truth")
    prove.diagnose_all(binary, cases, o.out / "verdicts", o.jobs, "diagnosing")
    if label_hash(o.out / "truth") != sealed:
        sys.exit("the labels changed while they were sealed")
    return o.out


def crossed(cases, fit):
    """(probability of the most probable cause, whether it is the cause, group) of each case by a table that did not see it; `fit` makes a table of cases."""
    order = np.random.default_rng(1).permutation(len(cases))
    out, needs = [None] * len(cases), []
    for k in range(FOLDS):
        test = set(order[k::FOLDS].tolist())
        seen = with_weights([c for i, c in enumerate(cases) if i not in test])
        theta = fit(seen)
        level = weights.level(seen, theta)
        for i in test:
            name, f, want, group = cases[i]
            p = weights.posterior(f, theta)
            held = weights.credible(p, level)
            out[i] = dict(case=name, group=group, top=p[held[0]], said=sorted(held[0]), right=held[0] == want, loss=float(-np.log(max(p.get(want, 0.0), weights.LEAST))), want=sorted(want), held=want in held, size=len(held))
    return out


def group_of(group, cause):
    """The group of SHARES that a case of `group` counts for: pairs of the mix are pairs, sealed strangers are strangers."""
    if group == "sealed":
        return "strangers"
    return "pairs" if group == "mix" and len(cause) > 1 else group


def with_weights(cases):
    """[(feature, cause, weight)]: the groups add up as SHARES has them, whatever was drawn of each; 1 on average."""
    groups = [group_of(group, cause) for _, _, cause, group in cases]
    drawn_of = Counter(groups)
    weight = {g: SHARES[g] / n for g, n in drawn_of.items()}
    mean = sum(weight[g] for g in groups) / len(groups)
    return [(f, cause, weight[g] / mean) for (_, f, cause, _), g in zip(cases, groups)]


def reliability(rows):
    """Lines of the reliability table, and the calibration error."""
    bins = [[r for r in rows if min(int(r["top"] * BINS), BINS - 1) == b] for b in range(BINS)]
    error = sum(abs(sum(r["top"] - r["right"] for r in b)) for b in bins) / len(rows)
    lines = [f"{i / BINS:.1f} to {(i + 1) / BINS:.1f}: reported {np.mean([r['top'] for r in b]):.2f}, right {np.mean([r['right'] for r in b]):.2f} of {len(b)}" for i, b in enumerate(bins) if b]
    return lines, error, bins


def picture(bins, error):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot as plt
    fig, ax = plt.subplots(figsize=(4.2, 4.2))
    ax.plot([0, 1], [0, 1], color="0.7", lw=1)
    at = [b for b in bins if b]
    ax.plot([np.mean([r["top"] for r in b]) for b in at], [np.mean([r["right"] for r in b]) for b in at], "o-", color="#1f5fa8")
    for b in at:
        ax.annotate(f" {len(b)}", (np.mean([r["top"] for r in b]), np.mean([r["right"] for r in b])), va="top", fontsize=8)
    ax.set(xlabel="probability reported", ylabel="share right", xlim=(0, 1.02), ylim=(0, 1.02), title=f"laboratory, cross-validated: error {error:.2f}")
    fig.tight_layout()
    fig.savefig(PICTURE, dpi=110)


def main():
    o = options()
    folders = list(o.drawn)
    if o.seeds:
        folders.append(drawn(o, prove.built(o.touchdown)))
    cases = [c for folder in folders for c in weights.read(folder / "truth", folder / "verdicts")]
    if len(cases) < 4 * FOLDS:
        sys.exit(f"{len(cases)} campaigns were weighed: too few to calibrate on")
    old = json.loads(TABLE.read_text()) if o.only else {}
    start = np.array([old.get(k, v) for k, v in zip(weights.PARAMETERS, weights.START)])
    fit = lambda of: weights.fit(of, start, o.only)
    rows = crossed(cases, fit)
    lines, error, bins = reliability(rows)
    print("\n".join(lines))
    print(f"calibration error {error:.3f}; the sets hold the cause in {np.mean([r['held'] for r in rows]):.2f} of {len(rows)}, mean size {np.mean([r['size'] for r in rows]):.1f}")
    for g in sorted({r["group"] for r in rows}):
        of = [r for r in rows if r["group"] == g]
        print(f"  {g}: most probable cause right {np.mean([r['right'] for r in of]):.2f} of {len(of)}; believed and wrong {sum(r['top'] >= 0.9 and not r['right'] for r in of)}")
    theta = fit(with_weights(cases))
    level = old["level"] if o.only and "level" not in o.only else weights.level(with_weights(cases), theta)
    table = {**{k: round(float(v), 4) for k, v in zip(weights.PARAMETERS, theta)}, "level": round(level, 4)}
    print(json.dumps(table, indent=1))
    if not o.dry:
        # what laws learned as functions are weighed by is not fitted here
        table["learned"] = json.loads(TABLE.read_text())["learned"]
        TABLE.write_text(json.dumps(table, indent=1) + "\n")
        picture(bins, error)
        print(f"{TABLE.relative_to(ROOT)} and {PICTURE.relative_to(ROOT)} written")
    (o.out / "reliability.json").parent.mkdir(parents=True, exist_ok=True)
    (o.out / "reliability.json").write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("\nstopped; the same command goes on where this ended")
