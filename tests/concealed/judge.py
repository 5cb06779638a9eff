"""Judges verdicts (verdict/1) against opened labels. Written for the proof; reads files only."""
import csv
import json
import math
import tomllib
from pathlib import Path

import numpy as np
from scipy import stats

from . import scores
from .effects import DEPENDS

CHANNELS = ("force", "acceleration", "penetration")
TIES = [{"lowpass_lag", "channel_skew"}, {"gravity", "return_spring"}]
TARGETS = {"null": (0.98, 0.95), "plain": (0.95, 0.88), "concealed": (0.95, 0.88), "deep": (0.85, 0.72),
           "pair": (0.70, 0.45), "unknown": (0.85, 0.70), "located": (0.92, 0.85), "gain": (0.90, 0.75)}


def table(path):
    """A recording: {column: array} with the unit stripped from the names; the first column is time."""
    with open(path, newline="") as f:
        head = [h.split("[")[0].strip() for h in next(csv.reader(f))]
    a = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    return {h: a[:, j] for j, h in enumerate(head)}


SI = {"s": 1.0, "ms": 1e-3, "N": 1.0, "kN": 1e3, "mN": 1e-3, "m": 1.0, "mm": 1e-3, "um": 1e-6, "m/s^2": 1.0, "g": 9.80665}


def si(path):
    """A recording in SI units: {column: array}."""
    with open(path, newline="") as f:
        head = next(csv.reader(f))
    units = {h.split("[")[0].strip(): h.split("[")[1].strip(" ]") if "[" in h else "" for h in head}
    return {c: v * SI.get(units[c], 1.0) for c, v in table(path).items()}


def files(case):
    with open(case / "campaign.toml", "rb") as f:
        return [r["file"] for r in tomllib.load(f)["recording"]]


def distance(case, prediction):
    """Mean over recordings and channels of rms(recording - prediction) / range(recording); None where unusable."""
    parts = []
    for name in files(case):
        a = table(case / name)
        if not (prediction / name).exists():
            return None
        b = table(prediction / name)
        for c in CHANNELS:
            if c in a:
                if c not in b or len(b[c]) != len(a[c]) or not np.isfinite(b[c]).all():
                    return None
                parts.append(float(np.sqrt(np.mean((a[c] - b[c]) ** 2)) / max(np.ptp(a[c]), 1e-300)))
    return float(np.mean(parts)) if parts else None


def group(truth):
    """The row a case counts in: of today's mix, or of groups.py."""
    names, other = truth["missing"], scores.group_of(truth)
    if other is not None:
        return other
    if not names:
        return "null"
    if scores.is_outside(names):
        return "unknown"
    return "pair" if len(names) > 1 else truth["tier"]


def band(k, n, level=0.95):
    """Clopper-Pearson interval of a share."""
    a = (1 - level) / 2
    lo = stats.beta.ppf(a, k, n - k + 1) if k > 0 else 0.0
    hi = stats.beta.ppf(1 - a, k + 1, n - k) if k < n else 1.0
    return float(lo), float(hi)


# what a verdict's parameter should be, where the effect's form is the one that is fitted:
# (the verdict's preload counts against +x, by its equation F = -(P + r x); the laboratory's with it)
# (mechanism, form) -> {parameter: value from (true_effect, true_base, strength), or None where it only has to be there}
EXACT = {
    ("guide_friction", "coulomb"): {"friction": lambda e, b, s: e["fr_c"]},
    ("guide_friction", "coulomb-viscous"): {"friction": lambda e, b, s: e["fr_c"], "friction_viscous": lambda e, b, s: e["fr_v"]},
    ("guide_friction", "stribeck"): {"friction": lambda e, b, s: e["fr_c"], "stribeck_speed": None},
    ("fluid_drag", "square"): {"drag": lambda e, b, s: e["drag"]},
    ("return_spring", "preloaded"): {"spring_preload": lambda e, b, s: -e["sp_pre"], "spring_rate": lambda e, b, s: e["sp_k"]},
    ("viscous_damping", "constant"): {"viscous_damping": lambda e, b, s: e["cv"]},
    ("viscous_damping", "ramp"): {"viscous_damping": lambda e, b, s: e["cv"]},
    ("force_gain", "high"): {"gain": lambda e, b, s: e["gain"]},
    ("force_gain", "low"): {"gain": lambda e, b, s: e["gain"]},
    ("channel_skew", "late"): {"skew": lambda e, b, s: abs(e["skew"][1])},
    ("channel_skew", "early"): {"skew": lambda e, b, s: abs(e["skew"][1])},
    ("charge_droop", "first-order"): {"droop_rate": lambda e, b, s: 1.0 / e["droop"][2]},
    ("lowpass_lag", "first-order"): {"corner": lambda e, b, s: e["lowpass"][3]},
    ("lowpass_lag", "second-order"): {"corner": lambda e, b, s: e["lowpass"][3]},
    ("base_compliance", "mass-spring"): {"base_stiffness": lambda e, b, s: e["kb"], "base_mass": lambda e, b, s: e["mb"]},
    ("base_compliance", "light-damped"): {"base_stiffness": lambda e, b, s: e["kb"]},
    ("loose_part", "linear"): {"loose_mass": lambda e, b, s: e["lm"], "loose_gap": lambda e, b, s: e["lgap"]},
    ("gravity", "left-out"): {"gravity": lambda e, b, s: 9.81},
    ("gravity", "inclined"): {"gravity": lambda e, b, s: e["g"]},
    ("secondary_stiffening", "hertzian"): {"secondary_depth": lambda e, b, s: e["st_d"]},
    ("secondary_stiffening", "linear"): {"secondary_depth": lambda e, b, s: e["st_d"]},
    ("plastic_indentation", "permanent-set"): {"yield_penetration": lambda e, b, s: e["pl_y"], "plastic_ratio": lambda e, b, s: e["pl_r"]},
    ("plastic_indentation", "thornton"): {"yield_penetration": lambda e, b, s: e["pl_y"]},
    ("viscoelastic_relaxation", "maxwell"): {"relaxation_time": lambda e, b, s: e["ve_t"]},
    ("residual_magnetism", "gap-and-time"): {"magnet_force": lambda e, b, s: e["mg_f"]},
    ("residual_magnetism", "gap"): {"magnet_force": lambda e, b, s: e["mg_f"]},
    ("residual_magnetism", "time"): {"magnet_force": lambda e, b, s: e["mg_f"], "magnet_time": lambda e, b, s: e["mg_t"]},
    ("cyclic_softening", "exponential"): {"softening_share": lambda e, b, s: 0.5 * s},
    ("cyclic_softening", "logarithmic"): {"softening_share_per_decade": lambda e, b, s: 0.5 * s},
    ("hysteresis_damping", "hunt-crossley"): {"damping_ratio/reference_speed": lambda e, b, s: e["mu"] / b["k"]},
    ("sensor_resonance", "second-order"): {"transducer_frequency": lambda e, b, s: 2 * math.pi * e["resonance"][0]},
    ("contact_preload", "ramp"): {"contact_preload": lambda e, b, s: e["pre_f"]},
    ("contact_preload", "tanh"): {"contact_preload": lambda e, b, s: e["pre_f"]},
    ("cyclic_hardening", "exponential"): {"hardening_share": lambda e, b, s: 1.2 * s},
    ("cyclic_hardening", "logarithmic"): {"hardening_share_per_decade": lambda e, b, s: 1.2 * s},
    ("attached_mass", "linear"): {"attached_mass": lambda e, b, s: e["am"], "attached_stiffness": lambda e, b, s: e["am_k"]},
    ("attached_mass", "well-damped"): {"attached_mass": lambda e, b, s: e["am"], "attached_stiffness": lambda e, b, s: e["am_k"]},
    ("squeeze_film", "inverse"): {"squeeze_gap": lambda e, b, s: e["sq_g"]},
}

LABEL = {("plastic_indentation", "permanent-set"): "permanent set", ("plastic_indentation", "thornton"): "Thornton"}    # forms that share parameters


def found(parameters, name):
    """Value and interval of a verdict's parameter, or of a ratio a/b of two of them."""
    parts = name.split("/")
    p = parameters.get(parts[0])
    if p is None or p.get("value") is None:
        return None
    v, ci = float(p["value"]), p.get("ci95")
    if len(parts) == 2:
        q = parameters.get(parts[1])
        if q is None:
            return None
        d = float(q["value"])
        v, ci = v / d, [c / d for c in ci] if ci else None
    return v, ci


def parameters(verdict, truth):
    """[(mechanism.parameter, true, found, lo, hi)] for effects named right whose form allows a comparison."""
    out = []
    for name, form, s in zip(truth["missing"], truth["forms"], truth["strengths"]):
        want = EXACT.get((name, form))
        if not want:
            continue
        for m in verdict.get("missing", []):
            got = {par: found(m.get("parameters", {}), par) for par in want}
            if m.get("mechanism") != name or None in got.values() or m.get("form") != LABEL.get((name, form), m.get("form")):
                continue
            for par, f in want.items():
                if f is None:
                    continue
                true = float(f(truth["true_effect"], truth["true_base"], s))
                v, ci = got[par]
                if par == "skew":
                    v, ci = abs(v), sorted(abs(c) for c in ci) if ci else None
                lo, hi = (ci if ci and None not in ci else (math.nan, math.nan))
                out.append((f"{name}.{par}", true, v, lo, hi))
    return out


GAP = 1.03          # misfit before over the oracle's from which on there is something to gain


def learned(verdict, truth):
    """Of what is outside the vocabulary: whether the part of the system was right, and what it depends on; the first classes of
    the likeliest set. None of what no class holds, and of indentations, whose classes are others."""
    law = verdict.get("learned") or {}
    first = max(law.get("sets", []), key=lambda s: s["probability"], default={"classes": []})
    said = verdict.get("unexplained", {}).get("detected", False)
    want = set().union(*(DEPENDS[n] for n in truth["missing"] if n in DEPENDS))
    part = (verdict.get("mismatch", {}).get("where") or [{}])[0].get("origin")
    return dict(part=part in truth["origin"], depends=bool(said and want & set(first["classes"])) if want and truth["kind"] != "indentation" else None)


NO_BETTER = 1.0     # chi2 by which a structure may end above one that it contains: a fit is stopped before the last of it


def contained(verdict):
    """How many of the structures tried fit worse than one that they contain, and how many pairs there are of which one contains the other."""
    tried = [(set(s["forms"]), s["chi2"]) for s in verdict.get("evidence", {}).get("structures", [])]
    pairs = [(a, b) for f, a in tried for g, b in tried if f < g]
    return sum(b > a + NO_BETTER for a, b in pairs), len(pairs)


def judge(case, truth, answer):
    """One case judged: a dict with what was right. `answer` is the folder with verdict.json and predictions."""
    g = group(truth)
    want = set(truth["missing"])
    out = dict(case=case.name, group=g, set=truth.get("set"), detail=truth.get("detail", ""), kind=truth["kind"], truth=truth["missing"], forms=truth["forms"],
               strength=truth["misfit_over_noise"], limit=truth.get("limit"), hostile=truth.get("hostile", {}),
               answered=False, invalid=None, detected=False, named=[], also=[], unexplained=False, right=False, located=None,
               gain=None, before=None, after=None, oracle=truth["oracle_misfit"], parameters=[],
               part=False if scores.is_outside(want) else None, depends=None, share=None,
               top=(0.0, False), held=None, open=[], believed=[], false_names=[], probability={}, worse=False, poorer=False, contained=(0, 0))
    try:
        v = json.loads((answer / "verdict.json").read_text())
    except (OSError, ValueError) as e:
        out["why"] = str(e)
        return out
    out["answered"] = True
    out["invalid"] = v.get("invalid", {}).get("text")
    out["detected"] = bool(v.get("mismatch", {}).get("detected"))
    out["named"] = [m.get("mechanism") for m in v.get("missing", [])]
    out["also"] = sorted({a for m in v.get("missing", []) for a in m.get("also_possible", [])})
    out["unexplained"] = bool(v.get("unexplained", {}).get("detected"))
    out["said"] = {"text": "; ".join(m.get("text", "") for m in v.get("missing", [])) or v.get("unexplained", {}).get("text", ""),
                   "where": (v.get("mismatch", {}).get("where") or [{}])[0], "missing": v.get("missing", [])}
    names = set(out["named"])
    for tie in TIES:                                   # of a pair nobody can part, either with the other held open
        for a in tie & want:
            b = next(iter(tie - {a}))
            if b in names and a not in names and a in out["also"]:
                names = (names - {b}) | {a}
    out["counted"] = sorted(names)
    out.update(scores.verdict_scores(v, out))
    if out["set"] is not None:
        out["right"] = scores.right_in_group(out, v)
    elif g == "null":
        out["right"] = not out["detected"] and not out["named"]
    elif g == "unknown":
        out["right"] = out["detected"] and out["unexplained"] and len(out["named"]) <= 1
    else:
        out["right"] = out["detected"] and names == want and not out["unexplained"]
    if want and out["detected"]:
        w = out["said"]["where"]
        acts = truth["acts"]
        out["located"] = w.get("origin") in truth["origin"] and acts.get(w.get("phase"), 0.0) >= 0.5 * max(acts.values())
    elif want:
        out["located"] = False
    out["before"] = distance(case, answer / "predictions" / "before")
    out["after"] = distance(case, answer / "predictions" / "after")
    out["worse"] = bool(out["named"] and out["before"] and out["after"] and out["after"] > 1.005 * out["before"])
    out["poorer"] = bool(out["before"] and out["after"] and out["after"] > 1.01 * out["before"])
    out["contained"] = contained(v)
    if out["before"] and out["after"] and want and g != "unknown" and out["oracle"] and out["before"] > 1.02 * out["oracle"]:
        if out["after"] >= 0.6 * out["oracle"]:
            out["gain"] = (out["before"] - out["after"]) / (out["before"] - out["oracle"])
    if scores.is_outside(want):
        out.update(learned(v, truth))
        if out["before"] and out["after"] and out["oracle"] and out["before"] > GAP * out["oracle"]:
            out["share"] = (out["before"] - out["after"]) / (out["before"] - out["oracle"])
    out["parameters"] = parameters(v, truth)
    return out


def summary(rows):
    """Per group: n, right, detected, located, median share of the oracle's gain."""
    out = {}
    for g in ("null", "plain", "concealed", "deep", "faint", "pair", "unknown"):
        rs = [r for r in rows if r["group"] == g]
        if not rs:
            continue
        gains = [r["gain"] for r in rs if r["gain"] is not None]
        out[g] = dict(n=len(rs), right=sum(r["right"] for r in rs), detected=sum(r["detected"] for r in rs),
                      located=sum(bool(r["located"]) for r in rs if r["detected"]),
                      gain=float(np.median(gains)) if gains else None)
    return out
