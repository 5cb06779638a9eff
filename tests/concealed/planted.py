"""tests/planted: known effects planted into real recordings of imposed motion, where what they add is exact.

The effect's visible part, what an elastic law cannot take, is `strength` times what such a law leaves of the recordings as they
are. Equations are other ones than the classes and forms that the diagnosis has. Everything is drawn from the seed.
"""
import argparse
import csv
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
SI = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "N": 1.0, "kN": 1e3, "mN": 1e-3, "uN": 1e-6, "nN": 1e-9, "m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9}
POWERS = (1.0, 1.5, 2.0, 2.5, 3.0)       # of the elastic law that the visible part is measured against
BELIEVED = 0.9


def read(path):
    """(header, rows, {column: values in SI}, {column: its index})."""
    with open(path, newline="") as f:
        head, *rows = list(csv.reader(f))
    names = [h.split(" [")[0].strip() for h in head]
    unit = [re.search(r"\[(.*)\]", h).group(1) for h in head]
    data = np.array([[float(x) for x in r] for r in rows])
    return head, rows, {n: data[:, i] * SI[unit[i]] for i, n in enumerate(names) if unit[i] in SI}, {n: (i, SI.get(unit[i])) for i, n in enumerate(names)}


def touch(x, y):
    """Index of the last sample on the way in at which the force is below 2 % of its largest change."""
    away = np.abs(y - np.median(y[: max(4, len(y) // 50)]))
    return max(int(np.argmax(away > 0.02 * away.max())) - 1, 0)


def motion(c):
    """Depth below the touch over the largest, rate over the largest, time, force over its range, of every recording."""
    t, y, x = c["time"], c["force"], c["penetration"]
    x = x - x[touch(x, y)]
    step = np.maximum(np.gradient(t), 1e-12)
    width = max(3, len(x) // 80) | 1
    smooth = np.convolve(np.pad(x, width // 2, "edge"), np.ones(width) / width, "valid")
    v = np.gradient(smooth) / step
    return t, y, x / x.max(), v / np.abs(v).max()


def relaxing(t, u, tau):
    q = np.zeros(len(t))
    for i in range(1, len(t)):
        h = t[i] - t[i - 1]
        q[i] = q[i - 1] * np.exp(-h / tau) + (u[i] - u[i - 1]) * np.exp(-0.5 * h / tau)
    return q


EFFECTS = {
    "guide_friction": lambda t, u, v, back: (u > 0) * np.tanh(v / 0.02),
    "viscous_damping": lambda t, u, v, back: (u > 0) * v,
    "contact_preload": lambda t, u, v, back: 1.0 - np.exp(-np.clip(u, 0, None) / 0.005),
    "secondary_stiffening": lambda t, u, v, back: np.clip(u - 0.6, 0, None) ** 1.3,
    "adhesion": lambda t, u, v, back: -1.0 * back * np.exp(-((u / 0.08) ** 2)),
    "viscoelastic_relaxation": lambda t, u, v, back: relaxing(t, np.clip(u, 0, None) ** 1.5, (t[-1] - t[0]) / 15),
}


def plant(campaign, into, effect, strength):
    """Writes the campaign with the effect to `into`; a flat top cuts the highest 15 % of the range."""
    into.mkdir(parents=True)
    files = [r["file"] for r in tomllib.loads((campaign / "campaign.toml").read_text())["recording"]]
    shutil.copy(campaign / "campaign.toml", into)
    all_of = [read(campaign / f) for f in files]
    if effect == "clipping":
        top = max(c["force"].max() for _, _, c, _ in all_of)
        low = min(c["force"].min() for _, _, c, _ in all_of)
        added = [np.minimum(c["force"], top - 0.15 * (top - low)) - c["force"] for _, _, c, _ in all_of]
    else:
        visible, left, added = [], [], []
        for _, _, c, _ in all_of:
            t, y, u, v = motion(c)
            back = np.arange(len(u)) > np.argmax(u)
            e = EFFECTS[effect](t, u, v, back)
            law = np.column_stack([np.clip(u, 0, None) ** p for p in POWERS] + [np.ones(len(u))])
            rest = lambda f: f - law @ np.linalg.lstsq(law, f, rcond=1e-9)[0]
            visible.append(np.mean(rest(e) ** 2))
            left.append(np.mean(rest(y) ** 2))
            added.append(e)
        by = strength * np.sqrt(np.mean(left) / np.mean(visible))
        added = [by * e for e in added]
    for f, (head, rows, _, at), e in zip(files, all_of, added):
        i, si = at["force"]
        with open(into / f, "w", newline="") as out:
            w = csv.writer(out)
            w.writerow(head)
            for row, more in zip(rows, e):
                w.writerow(row[:i] + [repr(float(row[i]) + float(more) / si)] + row[i + 1:])


def verdict(folder):
    try:
        return json.loads((folder / "verdict.json").read_text())
    except OSError:
        return None


def names(v):
    return {m["mechanism"]: m for m in (v or {}).get("missing", [])}


def main():
    a = argparse.ArgumentParser(prog="tests/planted", description=__doc__)
    a.add_argument("campaigns", metavar="CAMPAIGN", type=Path, nargs="+", help="folders of real recordings; those without imposed motion are left out")
    a.add_argument("--out", type=Path, default=ROOT / "out" / "planted")
    a.add_argument("--strength", type=float, nargs="+", default=[2.0, 6.0], help="visible part over what an elastic law leaves (default 2 6)")
    a.add_argument("--share", type=float, default=1.0, help="share of the plantings, drawn from the seed (default 1)")
    a.add_argument("--seed", type=int, default=1)
    a.add_argument("--touchdown", type=Path, default=ROOT / "harness" / "touchdown", help="another touchdown than the launcher's")
    o = a.parse_args()
    rng = np.random.default_rng(o.seed)
    shutil.rmtree(o.out, ignore_errors=True)
    cases, real = {}, []
    for c in o.campaigns:
        if 'kind = "indentation"' not in (c / "campaign.toml").read_text():
            continue
        real.append(c)
        for effect, strength in [(e, s) for e in EFFECTS for s in o.strength] + [("clipping", 0.0)]:
            if rng.random() < o.share:
                name = f"{c.name}-{len(cases):03d}"
                plant(c, o.out / "open" / name, effect, strength)
                cases[name] = (c.name, effect, strength)
    folders = real + [o.out / "open" / n for n in cases]
    # every campaign by itself: one that cannot be judged ends no other
    for i, f in enumerate(folders):
        print(f"diagnosing {i + 1} of {len(folders)}: {f.name}", file=sys.stderr, flush=True)
        ran = subprocess.run([o.touchdown, "diagnose", f, "--out", o.out / "verdicts"], capture_output=True, text=True, env=os.environ, check=False)
        if verdict(o.out / "verdicts" / f.name) is None:
            print(f"{f.name}: no verdict: {ran.stderr.strip().splitlines()[-1:]}", file=sys.stderr, flush=True)
    rows = {}
    for n, (of, effect, strength) in cases.items():
        v, plain = verdict(o.out / "verdicts" / n), names(verdict(o.out / "verdicts" / of))
        found = names(v)
        named = effect in found or any(effect in m["also_possible"] for m in found.values())
        wrong = [m for m, d in found.items() if d["probability"] >= BELIEVED and m != effect and m not in plain and effect not in d["also_possible"]]
        rows.setdefault((effect, strength), []).append((named, bool(wrong)))
        print(f"{n}: {effect} x {strength:g}: {'named' if named else 'not named'}; {', '.join(found) or 'no name'}{'; believed besides: ' + ', '.join(wrong) if wrong else ''}")
    print("\n| effect | strength | named | another name believed |\n|---|---|---|---|")
    for (effect, strength), r in sorted(rows.items(), key=lambda k: (k[0][1], k[0][0])):
        print(f"| {effect} | {strength:g} | {sum(q[0] for q in r)} of {len(r)} | {sum(q[1] for q in r)} |")
    for s in sorted({k[1] for k in rows}):
        r = [q for k, v in rows.items() if k[1] == s for q in v]
        print(f"| all | {s:g} | {sum(q[0] for q in r)} of {len(r)} | {sum(q[1] for q in r)} |")


if __name__ == "__main__":
    main()
