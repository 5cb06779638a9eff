"""Known effects planted into real recordings, where what they add is exact: forces where the motion is imposed, and in the measuring
chain everywhere.

The effect's visible part is `strength` times what the simulation as given cannot follow in the recordings as they are. Equations are
other ones than the classes and forms that the diagnosis has. Everything is drawn from the seed, and the labels are sealed.
"""
import csv
import json
import re
import shutil
import tomllib
from pathlib import Path

import numpy as np

from . import known
from .generate import label_hash
from .scores import BELIEVED

SI = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "N": 1.0, "kN": 1e3, "mN": 1e-3, "uN": 1e-6, "nN": 1e-9, "m": 1.0, "mm": 1e-3, "um": 1e-6, "nm": 1e-9,
      "m/s^2": 1.0, "g": 9.80665}
POWERS = np.arange(0.8, 4.51, 0.1)       # of k x^p, which the simulation as given may take: what is visible is what the best of them leaves
TOP = 0.15                               # share of the largest excursion that a flat top cuts off
FLAT = "clipping"


def read(path):
    """(header, rows, {column: values in SI}, {column: (its index, SI of its unit)})."""
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
    """Time, force, depth below the touch and its rate, of a recording."""
    t, y, x = c["time"], c["force"], c["penetration"]
    x = x - x[touch(x, y)]
    step = np.maximum(np.gradient(t), 1e-12)
    width = max(3, len(x) // 80) | 1
    smooth = np.convolve(np.pad(x, width // 2, "edge"), np.ones(width) / width, "valid")
    return t, y, x, np.gradient(smooth) / step


def middle_rate(x, v):
    """The rate at which half of the way was gone slower: neither a hold nor a snap into contact changes it much."""
    way, speed = np.abs(np.gradient(x)), np.abs(v)
    order = np.argsort(speed)
    return speed[order][np.searchsorted(np.cumsum(way[order]), 0.5 * way.sum())]


def relaxing(t, u, tau):
    q = np.zeros(len(t))
    for i in range(1, len(t)):
        h = t[i] - t[i - 1]
        q[i] = q[i - 1] * np.exp(-h / tau) + (u[i] - u[i - 1]) * np.exp(-0.5 * h / tau)
    return q


# forces where the motion is imposed, of the depth over the campaign's largest, the rate over its middle one, the time over its longest, and on the way back
FORCES = {
    "guide_friction": lambda t, u, v, back: (u > 0) * np.tanh(v / 0.02),
    "viscous_damping": lambda t, u, v, back: (u > 0) * v,
    "contact_preload": lambda t, u, v, back: 1.0 - np.exp(-np.clip(u, 0, None) / 0.005),
    "secondary_stiffening": lambda t, u, v, back: np.clip(u - 0.6, 0, None) ** 1.3,
    "adhesion": lambda t, u, v, back: -1.0 * back * np.exp(-((u / 0.08) ** 2)),
    "viscoelastic_relaxation": lambda t, u, v, back: relaxing(t, np.clip(u, 0, None) ** 1.5, 1 / 15),
}


def late(t, y, tau):
    """A first-order low-pass of time constant tau [s], begun at rest in the first reading."""
    out = np.empty(len(y))
    out[0] = y[0]
    for i in range(1, len(y)):
        a = np.exp(-(t[i] - t[i - 1]) / tau)
        slope = y[i] - y[i - 1]
        h = (t[i] - t[i - 1]) / tau
        out[i] = a * out[i - 1] + (1 - a) * y[i - 1] + slope * (1 - (1 - a) / h)
    return out


# errors of the measuring chain: reading by time, reading and a size from 0; the largest size that makes sense, over the recording's length
CHAIN = {
    "charge_droop": (lambda t, y, by: y - y[0] - late(t, y - y[0], 1.0 / by) + y[0], lambda length, step: 3.0 / length),
    "lowpass_lag": (late, lambda length, step: length / 5),
}


def cut(readings, what):
    """Readings of all recordings as a channel has them that ends 15 % before the largest excursion from rest."""
    rest = np.median([np.median(y[: max(4, len(y) // 50)]) for y in readings])
    up, down = max(y.max() for y in readings) - rest, rest - min(y.min() for y in readings)
    side, most = (-1.0, down) if what == "acceleration" and down > up else (1.0, up)
    limit = rest + side * (1 - TOP) * most
    return [np.minimum(y, limit) if side > 0 else np.maximum(y, limit) for y in readings]


def left_by_a_power(u, f):
    """Mean square of what the best law a + k u^p, of all powers that there may be, leaves of a force at the depths u."""
    def left(p):
        law = np.column_stack([np.clip(u, 0, None) ** p, np.ones(len(u))])
        return np.mean((f - law @ np.linalg.lstsq(law, f, rcond=1e-9)[0]) ** 2)

    return min(left(p) for p in POWERS)


def forces(all_of, effect, strength):
    """What a force of `effect`, one law for all of them, adds to each recording of imposed motion; None where it would have to be larger
    than all that was read: that is another machine."""
    moved = [motion(c) for c in all_of]
    depth, rate = max(m[2].max() for m in moved), max(middle_rate(m[2], m[3]) for m in moved)
    length = max(np.ptp(m[0]) for m in moved)
    visible, left, added = [], [], []
    for t, y, x, v in moved:
        u = x / depth
        back = np.arange(len(u)) > np.argmax(u)
        e = FORCES[effect]((t - t[0]) / length, u, v / rate, back)
        visible.append(left_by_a_power(u, e))
        left.append(left_by_a_power(u, y))
        added.append(e)
    by = strength * np.sqrt(np.mean(left) / np.mean(visible))
    largest = lambda of: max(np.ptp(f) for f in of)
    return [by * e for e in added] if by * largest(added) <= largest([m[1] for m in moved]) else None


def hidden(t, y, e):
    """What of a change `e` of the reading `y` a calibration can't take: gain, zero, clock and duration are fitted away."""
    slope = np.gradient(y, t)
    columns = np.column_stack([y, np.ones(len(y)), slope, (t - t[np.argmax(np.abs(y))]) * slope])
    columns /= np.linalg.norm(columns, axis=0) + 1e-300
    return e - columns @ np.linalg.lstsq(columns, e, rcond=1e-9)[0]


def chain(times, readings, effect, most):
    """Readings with an error of the chain whose visible part has an rms of `most` over the range, mean of recordings; None where none has."""
    change, largest = CHAIN[effect]
    length, step = max(t[-1] - t[0] for t in times), min(np.median(np.diff(t)) for t in times)
    span = max(np.ptp(y) for y in readings)
    seen = lambda by: np.mean([np.sqrt(np.mean(hidden(t, y, change(t, y, by) - y) ** 2)) for t, y in zip(times, readings)]) / span
    low, high = 0.0, largest(length, step)
    if seen(high) < most:
        return None
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if seen(middle) < most else (low, middle)
    return [change(t, y, high) for t, y in zip(times, readings)]


def is_imposed(campaign):
    return tomllib.loads((campaign / "campaign.toml").read_text())["campaign"]["kind"] == "indentation"


def channel_of(campaign):
    """The channel that an error of the chain is planted in: what all recordings hold of force, acceleration and penetration, in that order."""
    files = [r["file"] for r in tomllib.loads((campaign / "campaign.toml").read_text())["recording"]]
    all_of = [read(campaign / f)[2] for f in files]
    return next(c for c in ("force", "acceleration", "penetration") if all(c in a for a in all_of))


def plant(campaign, into, effect, strength, left):
    """Writes the campaign with the effect to `into`; `left`: what the simulation as given leaves of it, rms over the range. False where
    no size of the effect shows so much."""
    head = tomllib.loads((campaign / "campaign.toml").read_text())
    files = [r["file"] for r in head["recording"]]
    tables = [read(campaign / f) for f in files]
    all_of = [c for _, _, c, _ in tables]
    what = channel_of(campaign)
    readings = [c[what] for c in all_of]
    if effect == FLAT:
        changed = cut(readings, what)
    elif effect in FORCES:
        added = forces(all_of, effect, strength)
        changed = added and [y + e for y, e in zip(readings, added)]
    else:
        changed = chain([c["time"] for c in all_of], readings, effect, strength * left)
    if changed is None:
        return False
    shutil.copytree(campaign, into, ignore=lambda _, names: [n for n in names if n.endswith(".md")])
    for f, (header, rows, _, at), new in zip(files, tables, changed):
        i, si = at[what]
        (into / f).chmod(0o644)
        with open(into / f, "w", newline="") as out:
            w = csv.writer(out)
            w.writerow(header)
            for row, v in zip(rows, new):
                w.writerow(row[:i] + [repr(float(v) / si)] + row[i + 1:])
    return True


def campaigns_in(folders):
    """The campaigns that folders are or hold."""
    found = [q for f in folders for q in ([f] if (f / "campaign.toml").exists() else sorted(p.parent for p in f.glob("*/campaign.toml")))]
    return list(dict.fromkeys(found))


def verdict(folder):
    try:
        return json.loads((folder / "verdict.json").read_text())
    except OSError:
        return None


def draw(campaigns, plain, out, seed, strengths, share):
    """Plants into a share of all that can be planted in the campaigns, diagnosed as they are in `plain`: (cases, sha256 of the labels)."""
    rng = np.random.default_rng(seed)
    count = 0
    for c in campaigns:
        v = verdict(plain / c.name)
        left = v and v["fit"]["before"].get("heldout_nrmse")
        if not left:
            continue
        effects = [*FORCES] if is_imposed(c) else [*CHAIN]
        # a way has no end of its range
        flat = [(FLAT, 0.0)] if channel_of(c) != "penetration" else []
        for effect, strength in [(e, s) for e in effects for s in strengths] + flat:
            if rng.random() >= share:
                continue
            case = out / "open" / f"planted-{count:03d}"
            if plant(c, case, effect, strength, left):
                label = out / "truth" / f"{case.name}.json"
                label.parent.mkdir(parents=True, exist_ok=True)
                label.write_text(json.dumps(dict(campaign=c.name, effect=effect, strength=strength)))
                count += 1
    return sorted((out / "open").glob("*/")), label_hash(out / "truth")


def names(v):
    return {m["mechanism"]: m for m in (v or {}).get("missing", [])}


def judge(cases, out, plain):
    """What was said of each planted case beside what was planted; what is named of the campaign as it is, and what is known to be in it,
    counts as no error."""
    rows, there = [], known.known()
    for case in cases:
        truth = json.loads((out / "truth" / f"{case.name}.json").read_text())
        found = names(verdict(out / "verdicts" / case.name))
        needed, allowed, *_ = there.get(truth["campaign"], ((), ()))
        before = {*names(verdict(plain / truth["campaign"])), *needed, *allowed}
        effect = truth["effect"]
        is_it = lambda m, d: m == effect or effect in d["also_possible"]
        wrong = sorted(m for m, d in found.items() if d["probability"] >= BELIEVED and not is_it(m, d) and m not in before)
        rows.append(dict(truth, case=case.name, named=any(is_it(m, d) for m, d in found.items()), found=sorted(found), wrong=wrong))
    return rows


def figures(rows):
    """{key of scores.TABLE: (value, k, n)} of the plantings."""
    out = {}

    def share(key, rs, what):
        if rs:
            k = sum(bool(r[what]) for r in rs)
            out[key] = (k / len(rs), k, len(rs))

    share("planted6", [r for r in rows if r["strength"] == 6.0], "named")
    share("planted2", [r for r in rows if r["strength"] == 2.0], "named")
    share("flat", [r for r in rows if r["effect"] == FLAT], "named")
    share("planted_wrong", rows, "wrong")
    return out


def markdown(rows):
    """Each effect by strength, as lines of markdown."""
    out = ["| planted | times what was unexplained | named | another name believed |", "|---|---|---|---|"]
    kinds = sorted({(r["effect"], r["strength"]) for r in rows}, key=lambda k: (k[1], k[0]))
    for effect, strength in kinds:
        rs = [r for r in rows if (r["effect"], r["strength"]) == (effect, strength)]
        times = "cut by 15 %" if effect == FLAT else f"{strength:g}"
        out.append(f"| {effect} | {times} | {sum(r['named'] for r in rs)} of {len(rs)} | {sum(bool(r['wrong']) for r in rs)} |")
    return out
