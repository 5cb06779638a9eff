"""How sure: fits the table that turns evidence into probabilities, on campaigns of the laboratory. Run by tests/calibrate.

A verdict holds ln evidence of every structure weighed, by size of the discrepancy; the laboratory knows the cause. The table
is what makes the posterior of `of_verdict` say the cause with the least log loss; harness/diagnose/src/table.rs reads it and
harness/diagnose/src/posterior.rs works the same posterior out.
"""
import json
from itertools import cycle
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize
from scipy.special import logsumexp

from .limits import TIES
from .scores import is_outside

NOTHING, UNKNOWN = frozenset(), frozenset({"unknown"})
LEAST = 1e-3                 # what a cause counts that was not weighed at all

# name: (start, how far it may go from there at one unit of penalty)
PARAMETERS = {
    "temperature": (np.log(3.0), 1.0),         # ln; of the evidence
    "overdispersion": (1.0, 0.5),              # power of the least overdispersion left, on the temperature
    "tail": (np.log(4.0), 1.0),                # ln; from where on evidence counts by its logarithm
    "noise_temperature": (0.0, 1.0),           # added to both where noise alone, without a discrepancy, has the most evidence
    "noise_tail": (0.0, 1.0),
    "single": (-2.0, 1.0),                     # ln prior of one mechanism, of two, of a cause that nobody has named, over that of none
    "pair": (-4.0, 1.0),
    "unknown": (-2.0, 1.0),
    "stand_in": (0.0, 3.0),                    # ln weight of a stand-in, of what each recording has of its own, of a large discrepancy
    "own": (0.0, 3.0),
    "large": (0.0, 3.0),
    "large_known": (-2.0, 2.0),                # ln weight of a large discrepancy beside what is known
    "large_left": (0.0, 1.0),                  # power of the overdispersion that a structure leaves, on either weight of its large discrepancy
    "large_known_left": (0.0, 1.0),
    "own_known": (-2.0, 2.0),                  # and of a small one of each recording's own
    "drift": (-2.0, 1.0),                      # ln weight of instruments that drift, hum or walk
    "disturbed": (0.0, 0.5),                   # weight of ln(1 + nats that such instruments explain) on every cause with them but the unknown
    "size": (0.0, 0.5),                        # ln weight of a discrepancy by step of its size
    "none": (0.0, 1.0),                        # ln weight of no discrepancy at all
    "parameter": (0.0, 2.0),                   # ln weight of each parameter of the mechanisms added: forms were chosen among many
    "bound": (-1.0, 1.0),                      # ln weight of a structure with a parameter at a bound, of any name where there is one level only
    "one_level": (-0.5, 0.5),
    "heldout": (0.5, 0.5),                     # weight of the ln of how many times better, and worse, a structure predicts levels not seen
    "worse": (-20.0, 10.0),                    # than the simulation as given does
    "flat": (3.7, 1.0),                        # ln weight of names that limit a reading where readings end in a flat top: of 18 campaigns with clipping 1 has one, of 394 others none (rule of succession: 2/20 over 1/396)
    "needed": (0.0, 0.3),                      # weight of ln(1 + nats that the best structure with these names has over the best without them)
    "completed": (0.0, 0.3),                   # weight of ln(1 + nats that the best structure with these names and more has over the best with these alone)
}
# what is a reason for doubt never speaks for a name, and what speaks for one never against it
BOUNDS = {"parameter": (None, 0.0), "bound": (None, 0.0), "one_level": (None, 0.0), "worse": (None, 0.0), "heldout": (0.0, None), "needed": (0.0, None), "flat": (0.0, None), "large_left": (0.0, None), "large_known_left": (None, 0.0), "disturbed": (None, 0.0)}
START = np.array([v[0] for v in PARAMETERS.values()])
WIDTH = np.array([v[1] for v in PARAMETERS.values()])
NEGLIGIBLE = 60.0            # nats below the most evidence of a cause from which on an entry adds nothing to it, whatever the weights
LARGE = 0.03                 # sizes from here on are no small print


def canonical(names):
    """Names with one of a pair nobody can part read as the first of them."""
    names = set(names)
    for tie in TIES:
        if names & tie:
            names = (names - tie) | {min(tie)}
    return frozenset(names)


class Entry(NamedTuple):
    """One ln evidence of a cause; the numbers of a structure are 0 where the entry is of no structure."""
    kind: str                # of KINDS
    size: int                # index of the discrepancy's size; -1: of what each recording has of its own
    ln: float                # ln evidence
    drifts: bool = False     # with instruments that drift, hum or walk
    bound: bool = False      # a parameter of a mechanism rests at a bound
    better: float = 0.0      # ln of how many times better it predicts levels not seen than the simulation as given does
    parameters: int = 0      # of the mechanisms added
    left: float = 0.0        # ln overdispersion of what the structure leaves
    flat: bool = False       # they limit a reading, and readings end in a flat top


def features(verdict):
    """(least overdispersion left, levels, {set: [Entry]}), None where nothing was weighed."""
    e = verdict.get("evidence")
    if not e:
        return None
    out = {}
    left = [s["overdispersion_left"] for s in e["structures"] if s["overdispersion_left"] is not None]
    before, flat = verdict["fit"]["before"]["heldout_nrmse"], e["flat"]
    for s in e["structures"]:
        names, held = canonical(s["mechanisms"]), s.get("heldout_nrmse")
        better = float(np.log(before / held)) if names and held and before else 0.0
        if not s["named"] and better < 0.0:     # a stand-in that follows what it has seen and predicts the rest worse stands for nothing
            continue
        doubts = dict(bound=bool(names) and s["at_bound"], better=better, flat=flat > 0 and "clipping" in names)
        has = dict(parameters=s["parameters"], left=float(np.log(max(s["overdispersion"], 1.0))))
        steady = [(False, i, ln) for i, ln in enumerate(s["ln_evidence"])]
        for drifts, i, ln in steady + [(True, i, ln) for i, ln in enumerate(s.get("ln_evidence_drifting", []))]:
            if ln is None:
                continue
            if not s["named"]:
                out.setdefault(UNKNOWN, []).append(Entry("stand_in", i, ln, drifts, **has))
            elif e["sizes"][i] >= LARGE:
                out.setdefault(UNKNOWN, []).append(Entry("large", i, ln, drifts, **has))
                out.setdefault(names, []).append(Entry("large_known", i, ln, drifts, **has, **doubts))
            else:
                out.setdefault(names, []).append(Entry("", i, ln, drifts, **has, **doubts))
    for u in e["unknown"]:
        names = canonical(u["beside"])
        beside = max((x for x in out.get(names, []) if names and x.kind == ""), key=lambda x: x.ln, default=None)
        for size, ln in zip(cycle(e["own_sizes"]), u["ln_evidence"]):
            if ln is None:
                continue
            out.setdefault(UNKNOWN, []).append(Entry("own", -1, ln))
            if beside and size < LARGE:         # as with a discrepancy that all share: what is small does not make the cause another one
                out[names].append(beside._replace(kind="own_known", size=-1, ln=ln, drifts=False))
    return max(1.0, min(left, default=1.0)), e.get("levels", 3), out


def noise_alone(sets):
    """1 where the most evidence of all is without a discrepancy: the laws are right to the noise; else 0."""
    return float(max((x for of in sets.values() for x in of), key=lambda x: x.ln).size == 0)


def needed(sets):
    """{named set: ln(1 + nats that the best structure with these names has over the best without them)}: what is needed by all that explain much is likely there, whatever else is."""
    best = {h: max(x.ln for x in of) for h, of in sets.items() if h != UNKNOWN}
    out = {}
    for h in best.keys() - {NOTHING}:
        without = [ln for g, ln in best.items() if not g >= h]
        most = max(ln for g, ln in best.items() if g >= h)
        out[h] = float(np.log1p(max(most - max(without), 0.0))) if without else 0.0
    return out


def completed(sets):
    """{named set: ln(1 + nats that the best structure with these names and more has over the best with these alone)}: what is part of an explanation that works may be right and not all."""
    best = {h: max(x.ln for x in of) for h, of in sets.items() if h != UNKNOWN}
    return {h: float(np.log1p(max(best[g] - best[h] for g in best if g >= h))) for h in best if h != NOTHING}


def disturbed(sets):
    """{set but unknown: ln(1 + nats that the best entry with instruments that drift, hum or walk has over the best without them)}: 0 where all have them, or none."""
    best = lambda of, drifts: max((x.ln for x in of if x.drifts == drifts), default=np.nan)
    gains = {h: best(of, True) - best(of, False) for h, of in sets.items() if h != UNKNOWN}
    return {h: float(np.log1p(gain)) if gain > 0.0 else 0.0 for h, gain in gains.items()}


def weighted(t, kind, size, ln, drifts, parameters, left):
    """ln evidence with the table's weights, of entries' numbers (arrays); `kind` holds indices of KINDS."""
    own = np.array([t.get(k, 0.0) for k in KINDS])[kind] + np.array([t.get(f"{k}_left", 0.0) for k in KINDS])[kind] * left
    sizes = np.where(size < 0, 0.0, np.where(size == 0, t["none"], t["size"] * (size - 1)))
    return ln + own + sizes + t["drift"] * drifts + t["parameter"] * parameters


def scales(t, left, alone):
    """(tail, temperature) of the table `t`, from the least overdispersion left and `noise_alone`; numbers or arrays."""
    temperature = np.exp(t["temperature"] + t["noise_temperature"] * alone) * left ** t["overdispersion"]
    return np.exp(t["tail"] + t["noise_tail"] * alone), temperature


def posterior(feature, theta):
    """{set: probability}."""
    t = dict(zip(PARAMETERS, theta))
    left, levels, sets = feature
    tail, temperature = scales(t, left, noise_alone(sets))
    top, need, complete, disturb = -np.inf, needed(sets), completed(sets), disturbed(sets)
    mass, doubt = {}, {}
    for h, of in sets.items():
        ln = weighted(t, [KINDS.index(x.kind) for x in of], *(np.array([getattr(x, k) for x in of]) for k in WEIGHTED))
        mass[h], best = logsumexp(ln), of[int(ln.argmax())]
        doubt[h] = t["bound"] * best.bound + t["heldout"] * max(best.better, 0.0) + t["worse"] * max(-best.better, 0.0) + t["one_level"] * (levels < 2 and h not in (NOTHING, UNKNOWN)) + t["flat"] * best.flat + t["needed"] * need.get(h, 0.0) + t["completed"] * complete.get(h, 0.0) + t["disturbed"] * disturb.get(h, 0.0)
        top = max(top, mass[h])
    prior = lambda h: 0.0 if h == NOTHING else t["unknown"] if h == UNKNOWN else t["single"] if len(h) == 1 else t["pair"]
    score = {h: prior(h) + doubt[h] - tail * np.log1p((top - m) / (tail * temperature)) for h, m in mass.items()}
    whole = logsumexp(list(score.values()))
    return {h: float(np.exp(s - whole)) for h, s in score.items()}


def cause(truth):
    """What the posterior should hold: the names, none, or unknown; a law off by some per cent is nothing of the vocabulary."""
    names = truth["missing"]
    if not names and truth.get("set") == "rough":
        return UNKNOWN
    return UNKNOWN if is_outside(names) else canonical(names)


class Stacked:
    """All cases' evidence in flat arrays, so that one loss costs a few array operations."""

    def __init__(self, cases, start=START):
        self.start = start
        rows, hyps, ends, alone = [], [], [], []
        for k, (feature, want, weight) in enumerate(cases):
            left, levels, sets = feature
            alone.append(noise_alone(sets))
            need, complete, disturb = needed(sets), completed(sets), disturbed(sets)
            for h, of in sets.items():
                ends.append(len(rows))
                most = max(x.ln for x in of)
                of = [x for x in of if x.ln > most - NEGLIGIBLE]
                rows += [(KINDS.index(x.kind), *(getattr(x, k) for k in WEIGHTED), x.bound, x.flat, max(-x.better, 0.0), max(x.better, 0.0)) for x in of]
                prior = "" if h == NOTHING else "unknown" if h == UNKNOWN else "single" if len(h) == 1 else "pair"
                hyps.append((k, left, levels < 2 and h not in (NOTHING, UNKNOWN), PRIORS.index(prior), h == want, need.get(h, 0.0), complete.get(h, 0.0), disturb.get(h, 0.0)))
        kind, *self.entries, self.bound, self.flat, self.worse, self.better = np.array(rows, float).T
        self.kind = kind.astype(int)
        self.case, self.left, self.one, self.prior, self.want, self.needed, self.completed, self.disturbed = np.array(hyps, float).T
        self.case, self.prior, self.want = self.case.astype(int), self.prior.astype(int), self.want.astype(bool)
        self.starts, self.n, self.alone = np.array(ends), len(cases), np.array(alone)
        self.lengths = np.diff([*ends, len(rows)])
        self.weight = np.array([w for _, _, w in cases])

    def loss(self, theta):
        """Mean log loss, each case with its weight, and the penalty that keeps the table near its start."""
        t = dict(zip(PARAMETERS, theta))
        ln = weighted(t, self.kind, *self.entries)
        mass = np.logaddexp.reduceat(ln, self.starts)
        best = ln == np.repeat(np.maximum.reduceat(ln, self.starts), self.lengths)
        of_best = lambda what: np.maximum.reduceat(np.where(best, what, 0.0), self.starts)
        doubt = t["bound"] * of_best(self.bound) + t["worse"] * of_best(self.worse) + t["heldout"] * of_best(self.better) + t["one_level"] * self.one + t["flat"] * of_best(self.flat) + t["needed"] * self.needed + t["completed"] * self.completed + t["disturbed"] * self.disturbed
        top = np.full(self.n, -np.inf)
        np.maximum.at(top, self.case, mass)
        tail, temperature = scales(t, self.left, self.alone[self.case])
        score = np.array([t.get(k, 0.0) for k in PRIORS])[self.prior] + doubt - tail * np.log1p((top[self.case] - mass) / (tail * temperature))
        most = np.full(self.n, -np.inf)
        np.maximum.at(most, self.case, score)
        e = np.exp(score - most[self.case])
        whole, right = np.zeros(self.n), np.zeros(self.n)
        np.add.at(whole, self.case, e)
        np.add.at(right, self.case, np.where(self.want, e, 0.0))
        return float(-(self.weight * np.log(np.maximum(right / whole, LEAST))).sum() / self.weight.sum() + 0.5 * np.sum(((theta - self.start) / WIDTH) ** 2) / self.n)


KINDS = ("", "stand_in", "own", "large", "large_known", "own_known")
WEIGHTED = ("size", "ln", "drifts", "parameters", "left")      # an entry's numbers that `weighted` takes
PRIORS = ("", "single", "pair", "unknown")


def fit(cases, start=START, only=None):
    """The table's parameters of the least loss, kept near `start`; of `only` those, the others stay there."""
    stacked, free = Stacked(cases, start), [i for i, k in enumerate(PARAMETERS) if only is None or k in only]

    if not free:
        return np.array(start)

    def table(x):
        theta = np.array(start)
        theta[free] = x
        return theta

    bounds = [BOUNDS.get(list(PARAMETERS)[i], (None, None)) for i in free]
    return table(minimize(lambda x: stacked.loss(table(x)), start[free], method="L-BFGS-B", bounds=bounds, options=dict(maxiter=100, ftol=1e-7)).x)


def credible(p, level):
    """The fewest causes of the posterior `p` that add up to `level`, the most probable first."""
    held, total = [], 0.0
    for h, v in sorted(p.items(), key=lambda kv: -kv[1]):
        held.append(h)
        total += v
        if total >= level:
            break
    return held


def level(cases, theta, share=0.95):
    """Probability that a set has to add up to for as large a share of them to hold the cause (split conformal: Vovk; Angelopoulos and Bates 2021)."""
    need = []
    for feature, want, _ in cases:
        p = sorted(posterior(feature, theta).items(), key=lambda kv: -kv[1])
        at = [h for h, _ in p]
        need.append(sum(v for _, v in p[:at.index(want)]) if want in at else 1.0)
    n = len(need)
    k = min(n, int(np.ceil(share * (n + 1))))
    return float(np.clip(np.sort(need)[k - 1], 0.5, 0.999))


def read(truths, verdicts):
    """[(case, feature, cause, group)] of every case whose verdict was weighed; many small effects have no one cause."""
    out = []
    for path in sorted(truths.glob("*.json")):
        truth, v = json.loads(path.read_text()), verdicts / path.stem / "verdict.json"
        if truth.get("set") == "many" or not v.exists():
            continue
        f = features(json.loads(v.read_text()))
        if f is not None:
            out.append((path.stem, f, cause(truth), truth.get("set") or "mix"))
    return out
