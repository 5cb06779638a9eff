"""The table the diagnosis is held to, and how sure it was: reliability, wrong names believed, sets, intervals.

Works on the rows of judge.judge; no files are read.
"""
import numpy as np

from .groups import GROUPS
from .limits import TIES

BELIEVED = 0.9       # probability from which on a name is acted upon
BINS = 5

# key, what is counted, floor, goal; where `less` a share is to lie below them
TABLE = (
    ("null", "noise only, nothing missing: called so", 0.97, 0.98, False),
    ("single", "plain and concealed: named, nothing besides", 0.90, 0.95, False),
    ("deep", "deep", 0.85, 0.90, False),
    ("located", "located", 0.92, 0.95, False),
    ("pair", "pairs", 0.60, 0.75, False),
    ("unknown", "outside the vocabulary, known kinds", 0.85, 0.90, False),
    ("print0", "small print, nothing missing: no name", 0.85, 0.95, False),
    ("print1", "small print and one effect: named, nothing besides", 0.75, 0.90, False),
    ("strange", "strangers: unexplained, no name above 0.5", 0.70, 0.90, False),
    ("strangers", "of these, development half", None, None, False),
    ("sealed", "of these, sealed half", None, None, False),
    ("share", "strangers and known kinds outside: share of the oracle's held-out gain, median where there is 3 % to gain", 0.80, 0.95, False),
    ("part", "strangers and known kinds outside: part of the system right", 0.85, 0.95, False),
    ("depends", "strangers and known kinds outside: what it depends on right, where a class holds it", 0.70, 0.95, False),
    ("dirt0", "dirt, nothing missing: silent", 0.90, 0.98, False),
    ("dirt1", "dirt and one effect: named, nothing besides", None, None, False),
    ("little", "little measured: named or in the set; nothing missing: silent", 0.80, 0.95, False),
    ("rough0", "law off by some per cent, nothing missing: no name", None, None, False),
    ("rough1", "law off by some per cent and one effect: named", None, None, False),
    ("many", "many small effects: no name that is not there", None, None, False),
    ("wrong", "a wrong name believed (probability 0.9 or more), all of the above but pairs and many", 0.05, 0.02, True),
    ("worse", "a name given although levels not seen are predicted worse than before", 0.0, 0.0, True),
    ("calibration", "calibration error (five bins)", 0.08, 0.03, True),
    ("sets", "95 % sets hold the cause", 0.92, 0.95, False),
    ("gain", "share of the oracle's held-out gain, concealed, median", 0.90, 1.00, False),
    ("poorer", "levels not seen predicted worse than before, by more than 1 %", 0.0, 0.0, True),
    ("violated", "structures that fit worse than one they contain", 0.0, 0.0, True),
    ("real", "real recordings answered as known", 0.70, 0.90, False),
    ("real_wrong", "of these, a wrong name believed", 0.0, 0.0, True),
    ("misfit", "real recordings: misfit on what was not seen, after over before, median over campaigns with two levels or more", 0.60, 0.40, True),
    ("planted6", "planted into real recordings, 6 times what was unexplained: named", 0.70, 0.90, False),
    ("planted2", "planted, 2 times what was unexplained: named", 0.45, 0.70, False),
    ("flat", "a flat top planted: named", 0.90, 1.00, False),
    ("planted_wrong", "planted: another name believed", 0.05, 0.02, True),
)


def is_outside(names):
    """Whether one of the names is of something outside the vocabulary."""
    return any(n.startswith("unknown:") for n in names)


def truth_of(r):
    """What the most probable set should be: the names, or the one word for what no vocabulary holds."""
    return frozenset({"unknown"} if is_outside(r["truth"]) else r["truth"])


def tied(names, r):
    """Names with one of a pair nobody can part read as the other, where that is the true one."""
    names = set(names)
    for tie in TIES:
        for a in tie & set(r["truth"]):
            if a not in names and names & tie:
                names = (names - tie) | {a}
    return frozenset(names)


def verdict_scores(v, r):
    """What a verdict says of its own certainty, judged: keys for the row.

    top: (probability of the most probable set, whether it is the cause). Where there is no `posterior`: of the names given
    the least probability, 1 for no names. held: (whether the credible set holds the cause, its size), None where there is none.
    """
    named = {m.get("mechanism"): float(m.get("probability", 1.0)) for m in v.get("missing", [])}
    want, unexplained = truth_of(r), bool(v.get("unexplained", {}).get("detected"))
    # a law that is off by some per cent is nothing of the vocabulary, and not nothing
    is_cause = lambda names: tied(names, r) == want or r["group"] == "rough0" and set(names) == {"unknown"}
    posterior = v.get("posterior") or []
    if posterior:
        best = max(posterior, key=lambda s: s["probability"])
        top = (float(best["probability"]), is_cause(best["mechanisms"]))
    else:
        said = frozenset(named) or frozenset({"unknown"} if unexplained else ())
        top = (min(named.values(), default=1.0), is_cause(said))
    sets = v.get("credible_set")
    held = None if not sets else (any(is_cause(s["mechanisms"]) for s in sets), len(sets))
    counted = tied(named, r)
    sure = {n for n, p in named.items() if p >= BELIEVED}
    return dict(probability=named, top=top, held=held, open=sorted({n for s in sets or [] for n in s["mechanisms"]}),
                believed=sorted(tied(sure, r) - set(r["truth"])), false_names=sorted(counted - set(r["truth"])))


def right_in_group(r, v):
    """Whether an answer is right in one of the groups (r["group"] of group_of)."""
    named, g = tied(r["named"], r), r["group"]
    if g in ("print0", "rough0"):
        return not named
    if g == "dirt0":
        return not named and not r["detected"]
    if g in ("print1", "dirt1", "rough1"):      # a rough law may be called unexplained beside the name
        return named == set(r["truth"])
    if g in ("strangers", "sealed"):
        return r["detected"] and r["unexplained"] and all(p <= 0.5 for p in r["probability"].values())
    if g == "little":
        if not r["truth"]:
            return not named and not r["detected"]
        return bool(set(r["truth"]) & (named | set(r["also"]) | set(r["open"])))
    return not r["false_names"]             # many


def group_of(truth):
    """The row of the table a label belongs to, for campaigns of groups.py; None for today's mix."""
    g = truth.get("set")
    return None if g is None else f"{g}{int(bool(truth['missing']))}" if g in ("print", "dirt", "rough") else g


def of_groups(rows):
    """Rows of groups.py's campaigns."""
    return [r for r in rows if r.get("set") in GROUPS]


def reliability(rows):
    """([(mean probability reported, share right, how many)] of the bins, calibration error); rows of many effects have no one cause."""
    sure = [r["top"] for r in rows if r["answered"] and r["group"] != "many"]
    bins = [[] for _ in range(BINS)]
    for p, ok in sure:
        bins[min(int(p * BINS), BINS - 1)].append((p, ok))
    out = [(float(np.mean([p for p, _ in b])), float(np.mean([ok for _, ok in b])), len(b)) if b else (None, None, 0) for b in bins]
    error = sum(n * abs(p - q) for p, q, n in out if n) / len(sure) if sure else None
    return out, error


def figures(rows, besides=None):
    """{key of TABLE: (value, k, n)}; k None where the value is no share. Keys without cases are left out. `besides`: those of real
    recordings and of plantings."""
    out = dict(besides or {})

    def share(key, rs, what="right"):
        rs = list(rs)
        if rs:
            k = sum(bool(r[what]) for r in rs)
            out[key] = (k / len(rs), k, len(rs))

    by = {g: [r for r in rows if r["group"] == g] for g in {r["group"] for r in rows}}
    for key in ("null", "deep", "pair", "unknown", "print0", "print1", "rough0", "rough1", "strangers", "sealed", "dirt0", "dirt1", "little", "many"):
        share(key, by.get(key, []))
    share("single", by.get("plain", []) + by.get("concealed", []))
    share("strange", by.get("strangers", []) + by.get("sealed", []))
    share("located", [r for r in rows if r["truth"] and r["detected"] and r.get("set") is None], "located")
    share("wrong", [r for r in rows if r["answered"] and r["group"] not in ("pair", "many")], "believed")
    share("worse", [r for r in rows if r["answered"]], "worse")
    share("poorer", [r for r in rows if r["answered"]], "poorer")
    tried = [r["contained"] for r in rows if r["answered"]]
    if sum(n for _, n in tried):
        k, n = sum(k for k, _ in tried), sum(n for _, n in tried)
        out["violated"] = (k / n, k, n)
    outside = [r for r in rows if r["part"] is not None]
    share("part", outside, "part")
    share("depends", [r for r in outside if r["depends"] is not None], "depends")
    shares = [r["share"] for r in outside if r["share"] is not None]
    if shares:
        out["share"] = (float(np.median(shares)), None, len(shares))
    _, error = reliability(rows)
    if error is not None:
        out["calibration"] = (error, None, sum(r["answered"] and r["group"] != "many" for r in rows))
    held = [r["held"] for r in rows if r["answered"] and r["held"] is not None and r["group"] != "many"]
    if held:
        k = sum(h for h, _ in held)
        out["sets"] = (k / len(held), k, len(held))
    gains = [r["gain"] for r in by.get("concealed", []) if r["gain"] is not None]
    if gains:
        out["gain"] = (float(np.median(gains)), None, len(gains))
    return out


def lines(rows, besides=None):
    """[(what, cases, right, value, floor, goal, kept)] of the table in words; kept None where nothing is asked, "-" where absent."""
    got, out = figures(rows, besides), []
    for key, what, floor, goal, less in TABLE:
        ask = lambda x: "-" if x is None else ("at most " if less else "") + f"{x:.2f}"
        if key not in got:
            if key in ("sets",) and rows:
                out.append((what, "-", "-", "-", ask(floor), ask(goal), None))
            continue
        value, k, n = got[key]
        kept = None if floor is None else value <= floor + 1e-12 if less else value >= floor - 1e-12
        out.append((what, str(n), "" if k is None else str(k), f"{value:.2f}", ask(floor), ask(goal), kept))
    return out


def by_group(rows):
    """[(group, cases, wrong names believed, mean size of the 95 % sets, share of sets that hold the cause, intervals held)]."""
    out = []
    for g in sorted({r["group"] for r in rows}):
        rs = [r for r in rows if r["group"] == g and r["answered"]]
        held = [r["held"] for r in rs if r["held"] is not None]
        ci = [lo <= true <= hi for r in rs for _, true, _, lo, hi in r["parameters"] if lo == lo and hi == hi]
        out.append((g, len(rs), sum(bool(r["believed"]) for r in rs), f"{np.mean([n for _, n in held]):.1f}" if held else "-",
                    f"{np.mean([h for h, _ in held]):.2f}" if held else "-", f"{sum(ci)}/{len(ci)}" if ci else "-"))
    return out


def markdown(rows, besides=None):
    """The table, reliability and what each group adds, as lines of markdown."""
    out = ["| | cases | right | value | floor | goal | |", "|---|---|---|---|---|---|---|"]
    for what, n, k, value, floor, goal, kept in lines(rows, besides):
        out.append(f"| {what} | {n} | {k} | {value} | {floor} | {goal} | { {True: 'held', False: 'short', None: ''}[kept]} |")
    if not rows:
        return out
    bins, error = reliability(rows)
    out += ["", f"Probability reported against share right{'' if error is None else f', calibration error {error:.2f}'}:", "",
            "| reported | " + " | ".join(f"{i / BINS:.1f} to {(i + 1) / BINS:.1f}" for i in range(BINS)) + " |", "|---" * (BINS + 1) + "|",
            "| mean reported | " + " | ".join("-" if p is None else f"{p:.2f}" for p, _, _ in bins) + " |",
            "| share right | " + " | ".join("-" if q is None else f"{q:.2f}" for _, q, _ in bins) + " |",
            "| answers | " + " | ".join(str(n) for _, _, n in bins) + " |", "",
            "| group | answers | wrong names believed | size of the 95 % sets, mean | sets that hold the cause | parameters inside their 95 % interval |", "|---|---|---|---|---|---|"]
    out += [f"| {' | '.join(str(c) for c in line)} |" for line in by_group(rows)]
    return out


def halves():
    """Which stranger is in which half, in words."""
    from .effects import of_half
    return [f"{half} half: " + ", ".join(n.removeprefix("unknown:") for n in of_half(half)) for half in ("development", "sealed")]
