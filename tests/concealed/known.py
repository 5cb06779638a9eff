"""What is known of public recordings (known.toml), and whether answers say it."""
import tomllib
from pathlib import Path

import numpy as np

from .scores import BELIEVED

FILE = Path(__file__).with_name("known.toml")


def sources():
    """Where the recordings are: dicts of name and campaigns."""
    return tomllib.loads(FILE.read_text())["source"]


def known():
    """{campaign: (needed, allowed besides, share to which the misfit has to fall where nothing is needed, how it is known)}."""
    table = tomllib.loads(FILE.read_text())["campaign"]
    return {n: (set(k["needed"]), set(k.get("allowed", [])), k.get("misfit"), k["from"]) for n, k in table.items()}


def ratio(r):
    """Misfit on what the fit did not see, after over before; 1 where it is not known."""
    return r["after"] / r["before"] if r["before"] and r["after"] else 1.0


def judged(found):
    """The real campaigns of `found` (real.section) of which something is known: (row, needed, believed wrong, whether it is answered, how it is known)."""
    out, of = [], known()
    for r in found:
        if r["campaign"] not in of:
            continue
        needed, allowed, most, how = of[r["campaign"]]
        wrong = sorted(n for n, p in r["probability"].items() if p >= BELIEVED and n not in needed | allowed)
        right = needed <= set(r["named"]) and not wrong and r["answered"] and (most is None or ratio(r) <= most)
        out.append((r, needed, wrong, right, how))
    return out


def figures(found):
    """{key of scores.TABLE: (value, k, n)} of real recordings."""
    rows, out = judged(found), {}
    if rows:
        right, wrong = sum(q[3] for q in rows), sum(bool(q[2]) for q in rows)
        out["real"] = (right / len(rows), right, len(rows))
        out["real_wrong"] = (wrong / len(rows), wrong, len(rows))
    several = [ratio(r) for r in found if r["answered"] and r["levels"] > 1]
    if several:
        out["misfit"] = (float(np.median(several)), None, len(several))
    return out


def markdown(found):
    """What is known of each, what was said and what became of the misfit, as lines of markdown."""
    out = ["| real recordings | known | from | named (probability) | misfit on what was not seen | answered |", "|---|---|---|---|---|---|"]
    for r, needed, _, right, how in judged(found):
        said = ", ".join(f"{n} ({p:.2f})" for n, p in r["probability"].items()) or "nothing" + (", unexplained" if r.get("unexplained") else "")
        fell = f"{100 * r['before']:.2f} % to {100 * r['after']:.2f} %" if r["before"] and r["after"] else "-"
        out.append(f"| {r['campaign']} | {', '.join(sorted(needed)) or 'no word for it'} | {how} | {said} | {fell} | {'yes' if right else 'no'} |")
    there = {r["campaign"] for r in found}
    out += ["", "Where these recordings are:", ""]
    out += [f"- {s['name']}: {', '.join(c for c in s['campaigns'] if c in there)}" for s in sources() if there & set(s["campaigns"])]
    return out
