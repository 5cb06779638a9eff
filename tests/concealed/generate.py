"""Draws cases: conceal an effect, calibrate the base to it, keep what looks good, record it with all nuisances."""
import hashlib
import json
import math
from pathlib import Path

import numpy as np

from . import chain as chain_
from . import motion as m
from .calibrate import base_parameters, fit, misfit
from .effects import FORMS, KNOWN, ORIGIN, OUTSIDE, allowed
from .limits import OPPOSITES, TIES, separability
from .rigs import CHANNELS, draw, phases, simulate

TIERS = {"plain": (5.0, 12.0), "concealed": (1.5, 4.4), "deep": (0.42, 1.0), "faint": (0.03, 0.3)}
CALM = 0.001      # how far, relatively, the noise-free calibration may move a touch speed
PHASES = ("approach", "loading", "unloading", "after")
KIND_P = {"null": (0.6, 0.2, 0.2), "single": (0.78, 0.12, 0.10)}
KINDS = ("drop-test", "contactor-opening", "indentation")
UNITS = {"s": {"time": ("s", 1), "force": ("N", 1), "acceleration": ("m/s^2", 1), "penetration": ("m", 1)},
         "ms": {"time": ("ms", 1e-3), "force": ("kN", 1e3), "acceleration": ("g", 9.80665), "penetration": ("mm", 1e-3)}}


def plan(rng, n):
    """Tier and mechanisms wanted for each of n cases, in about the proportions of the open set, shuffled."""
    share = [("null", 0.18), ("plain", 0.135), ("concealed", 0.335), ("deep", 0.165), ("faint", 0.03), ("pair", 0.08), ("unknown", 0.075)]
    count = {t: int(math.floor(p * n)) for t, p in share}
    rest = sorted(share, key=lambda s: -(s[1] * n - math.floor(s[1] * n)))
    for t, _ in rest[:n - sum(count.values())]:
        count[t] += 1
    out = []
    for t, _ in share:
        deck = []
        for _ in range(count[t]):
            if not deck:
                deck = list(rng.permutation(OUTSIDE if t == "unknown" else KNOWN))
            out.append((t, None if t in ("null", "pair") else str(deck.pop())))
    return [out[i] for i in rng.permutation(n)]


def make_effect(rng, rig, mechanism, used):
    """A form of the mechanism that can act in this rig, those used least first; None if there is none."""
    names = [k for k in FORMS if k[0] == mechanism and allowed(*k, rig.kind, rig.channels)]
    if not names:
        return None
    least = min(used.get(k, 0) for k in names)
    key = [k for k in names if used.get(k, 0) == least]
    key = key[int(rng.integers(len(key)))]
    return dict(mechanism=mechanism, form=key[1], origin=ORIGIN[mechanism], apply=FORMS[key][2](rng, rig), key=key)


def tune(rng, rig, eff, target):
    """Strength at which the calibrated base misses the clean signals by target sigmas; None if out of reach."""
    P0 = base_parameters(rig)
    fixed = eff["mechanism"] == "gravity"
    stride = max(1, int(np.median([r.n for r in rig.recs]) // 220))
    s, best, lo, hi = 0.05, None, 0.0, 3.0
    start = None
    for i in range(9):
        try:
            sims = simulate(rig, rig.P, [(eff["apply"], s)])
            f = fit(rig, sims, P0, stride=stride, iterations=8, speed_std=CALM, start=start)
        except ArithmeticError:
            hi, s = s, (lo + s) / 2
            continue
        q = f.over_noise / target
        if fixed:
            return (1.0, f) if 0.8 < q < 1.25 else None
        if 0.88 < q < 1.14:
            return s, f
        if q < 1:
            lo = max(lo, s)
        else:
            hi = min(hi, s)
        step = min(max(q ** -0.9, 0.08), 8.0)
        s2 = s * step
        if not lo < s2 < hi:
            s2 = math.sqrt(max(lo, 1e-7) * hi) if lo > 0 else hi / 4
        if abs(s2 / s - 1) < 0.01 or s2 < 1e-7:
            return None
        if lo >= 2.9:
            return None
        s = min(s2, 2.95)
    return None


def acts(rig, sims, pairs):
    """How strongly the effects themselves act in each phase: share of the squared force or signal they add."""
    total = np.zeros(4)
    for eff, s in pairs:
        own = simulate(rig, rig.P, [(eff["apply"], s)])
        part = np.zeros(4)
        for r, o in zip(rig.recs, own):
            P = o["P"]
            B = base_parameters(rig).copy()
            B[m.SP_PRE] = r.preload
            fx = np.zeros(len(o["x"]))
            if eff["origin"] == "chain":
                for c in CHANNELS:
                    ref = o["unclipped"] if "unclipped" in o and c == o["chain"]["clip"][0] else o["bare"][c]
                    clean = o["contact"] if c == "force" and P[m.BMODE] == 2.0 else ref
                    fx += ((o[c] - clean) / rig.sigma[c]) ** 2
            elif eff["origin"] == "motion" and P[m.BMODE] == 0.0 and P[m.LM] == 0.0:
                y = np.zeros(m.NS)
                t = np.arange(len(fx)) * rig.dt
                for i in range(len(fx)):
                    # a force on the body: what moves it beyond contact and the base's own body forces
                    base = m.others(t[i], o["x"][i], o["v"][i], 0.0, B)[0]
                    fx[i] = (P[m.M] * o["a"][i] + o["contact"][i] - base) ** 2
            elif P[m.LM] > 0.0:
                fl = (P[m.M] - P[m.LM]) * (o["a"] - P[m.G]) + o["contact"] + P[m.SP_K] * (o["x"] + P[m.TRAVEL]) - r.preload
                fx = fl ** 2
            else:
                y = np.zeros(m.NS)
                mem = 1e9
                for i in range(len(fx)):
                    law = m.contact_force(o["x"][i], o["v"][i], 1, 0, mem, mem, 0, y, B)
                    fx[i] = (o["contact"][i] - law) ** 2
            ph = phases(o["x"] if rig.kind != "indentation" else r.path[0])
            for j in range(4):
                part[j] += fx[ph == j].sum() * rig.dt
        total += part / max(part.sum(), 1e-300)
    total /= max(len(pairs), 1)
    return {p: float(v) for p, v in zip(PHASES, total)}


def shares(rig, sims, f):
    """Where the calibrated base misses, by channel and phase, weighted by noise."""
    out = {c: np.zeros(4) for c in f.chans}
    for i, r in enumerate(rig.recs):
        ph = phases(sims[i]["x"])[::f.stride]
        for c in f.chans:
            e = ((sims[i][c][::f.stride] - f.sim[i][c]) / rig.sigma[c]) ** 2
            for j in range(4):
                out[c][j] += e[ph == j].sum()
    t = max(sum(v.sum() for v in out.values()), 1e-300)
    return {c: {p: float(x / t) for p, x in zip(PHASES, v)} for c, v in out.items()}


def record(rng, rig, pairs, hostile, scatter=0.005):
    """Noisy recordings with every nuisance of the format; returns data (channels), reported speeds and mass.

    scatter: of the stiffness between repeats, one standard deviation.
    """
    kfac = 1 + scatter * rng.standard_normal(len(rig.recs))
    speeds = np.array([r.speed for r in rig.recs])
    sims = simulate(rig, rig.P, [(e["apply"], s) for e, s in pairs], kfac=kfac)
    gain = {"force": 1 + 0.007 * rng.standard_normal(), "acceleration": 1 + 0.007 * rng.standard_normal(),
            "penetration": 1 + 0.003 * rng.standard_normal()}
    mass = rig.P[m.M] * (1 + 0.002 * rng.standard_normal())
    peak = {c: max(np.abs(s[c]).max() for s in sims) for c in CHANNELS}
    span = {c: peak[c] * rng.uniform(1.15, 1.35) for c in CHANNELS}
    data, measured = [], []
    for i, s in enumerate(sims):
        row = {}
        for c in rig.channels:
            y = (s["unclipped"] if "unclipped" in s and s["chain"]["clip"][0] == c else s[c]) * gain[c]
            n = len(y)
            y = y + chain_.noise(rng, n, rig.sigma[c], rig.rho[c])
            y += chain_.hostile(rng, n, rig.sigma[c], *hostile)
            if c == "force":
                y += 0.001 * peak[c] * rng.standard_normal()
            if c == "penetration":
                y += (0.004 * rig.ref["x"] if rig.kind == "indentation" else 2e-6) * rng.standard_normal()
            if "unclipped" in s and s["chain"]["clip"][0] == c:
                y = chain_.clipped(y, s["limit"] * gain[c], s["chain"]["clip"][2], rig.dt)
            q = 2 * span[c] / 2 ** 14
            row[c] = np.round(y / q) * q
        data.append(row)
        touch = s["touch"][1] if s["touch"][1] == s["touch"][1] else speeds[i]
        measured.append(float(touch * (1 + 0.004 * rng.standard_normal())))
    return data, measured, mass


def write_case(folder, name, rig, data, measured, mass, user, units, clocks=None):
    """campaign.toml and one CSV a recording (recordings/1); clocks: time stamps [s] of each recording, even ones where None."""
    folder.mkdir(parents=True)
    u = UNITS[units]
    lines = ['format = "recordings/1"', "", "[campaign]", f'name = "{name}"', f'kind = "{rig.kind}"', f'material = "{rig.material}"', ""]
    if rig.kind != "indentation":
        lines += ["[rig]", f"moving_mass = {mass:.5g}   # kg"]
    if rig.kind == "contactor-opening":
        lines += [f"travel = {rig.P[m.TRAVEL]:.6g}   # m, from rest to the stop", f"return_spring_rate = {rig.P[m.SP_K]:.6g}   # N/m"]
    terms = ", ".join(f'"{t}"' for t in rig.terms)
    lines += ["", "[simulation]   # calibrated to these recordings", f"terms = [{terms}]", f"k = {user[m.K]:.6g}   # N/m^p",
              f"p = {user[m.PW]:.6g}", f"mu_d = {user[m.MU]:.6g}   # N s/m^(p+1)"]
    for i, r in enumerate(rig.recs):
        lines += ["", "[[recording]]", f'file = "r{i + 1:02d}.csv"', f"order = {r.order}"]
        if rig.kind == "drop-test":
            lines += [f"drop_height = {r.level:g}   # m", f"impact_speed = {measured[i]:.6g}   # m/s, photo interrupters",
                      f"impact_speed_std = {0.004 * measured[i]:.3g}   # m/s"]
        elif rig.kind == "contactor-opening":
            lines.append(f"spring_preload = {r.level:.6g}   # N, at rest")
        else:
            lines.append(f"level = {r.level:.4g}   # m, depth aimed at")
        cols = ["time"] + list(rig.channels)
        n = len(data[i][rig.channels[0]])
        table = np.column_stack([(np.arange(n) * rig.dt if clocks is None else clocks[i]) / u["time"][1]] + [data[i][c] / u[c][1] for c in rig.channels])
        body = "\n".join("%.8g," % row[0] + ",".join("%.5g" % v for v in row[1:]) for row in table)
        (folder / f"r{i + 1:02d}.csv").write_text(",".join(f"{c} [{u[c][0]}]" for c in cols) + "\n" + body + "\n")
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n")


def attempt(rng, tier, mechanism, used, only=None):
    """One try at a case, of the kind `only` where that is given; None where it does not come out as wanted."""
    group = "null" if tier == "null" else "single"
    if only:
        if mechanism is not None and not any(allowed(*f, only, CHANNELS) for f in FORMS if f[0] == mechanism):
            return None
        kind = only
    elif tier == "pair":
        kind = "drop-test"
    else:
        kinds = [k for k in KINDS if mechanism is None or any(allowed(*f, k, CHANNELS) for f in FORMS if f[0] == mechanism)]
        w = np.array([KIND_P[group][KINDS.index(k)] for k in kinds])
        kind = str(rng.choice(kinds, p=w / w.sum())) if mechanism != "residual_magnetism" else "contactor-opening"
    hysteresis = False if mechanism == "hysteresis_damping" or kind == "indentation" else None
    rig = draw(rng, kind, hysteresis)
    names = [mechanism] if mechanism else []
    level = tier
    if tier == "pair":
        names = [str(x) for x in rng.choice(sorted(set(KNOWN) - {"residual_magnetism"}), 2, replace=False)]
        level = "concealed"
        if set(names) in (*TIES, OPPOSITES):
            return None
        if "hysteresis_damping" in names:
            rig = draw(rng, kind, False)
    if tier == "unknown":
        level = str(rng.choice(["plain", "concealed"], p=[0.3, 0.7]))
    if "gravity" in names:
        rig.terms = [t for t in rig.terms if t != "gravity"]
    pairs, targets = [], []
    f = None
    if names:
        a, b = TIERS[level]
        target = float(np.exp(rng.uniform(np.log(a * 1.12), np.log(b * 0.9))))
        for nm in names:
            eff = make_effect(rng, rig, nm, used)
            if eff is None:
                return None
            if tier == "pair":
                target = float(np.exp(rng.uniform(np.log(1.5), np.log(3.0))))
            if nm == "gravity":
                target = gravity_target(rig, eff, TIERS[level])
                if target is None:
                    return None
            # in a pair each is tuned alone, on a rig that has gravity unless that is the one left out
            rt = rig
            if tier == "pair" and nm != "gravity" and "gravity" in names:
                rt = alike(rig)
            got = tune(rng, rt, eff, target)
            if got is None:
                return None
            pairs.append((eff, got[0]))
            f = got[1]
    if {e["key"] for e, _ in pairs} > {("sensor_resonance", "tip-mass")} and "base_compliance" in names:
        return None                  # both are the second body of motion.py
    sims = simulate(rig, rig.P, [(e["apply"], s) for e, s in pairs])
    stride = max(1, int(np.median([r.n for r in rig.recs]) // 220))
    f = fit(rig, sims, base_parameters(rig), stride=stride, iterations=12, speed_std=CALM)
    if f.r2 < 0.99:
        return None
    if names:
        a, b = TIERS[level]
        if not a * 0.95 < f.over_noise < b * 1.1:
            return None
    hostile = (False, False)
    if tier == "null":
        hostile = [(False, False), (True, False), (False, True), (True, True)][rng.choice(4, p=[0.4, 0.2, 0.2, 0.2])]
    data, measured, mass = record(rng, rig, pairs, hostile)
    speeds = measured if kind == "drop-test" else None
    Pm = base_parameters(rig)
    Pm[m.M] = mass
    user = fit(rig, data, Pm, stride=stride, iterations=12, speeds=speeds, start=None)
    if user.r2 < 0.99:
        return None
    oracle = oracle_misfit(rig, data, mass, pairs, stride, speeds)
    limit = None
    if len(pairs) == 1 and tier != "unknown":
        limit = separability(rng, rig, base_parameters(rig), names[0], sims, f)
    for e, _ in pairs:
        used[e["key"]] = used.get(e["key"], 0) + 1
    truth = {
        "missing": names, "kind": kind, "material": rig.material,
        "strength": float(max([s for _, s in pairs], default=1.0)),
        "base_refit_nrmse": f.nrmse, "base_refit_r2": f.r2, "misfit_over_noise": f.over_noise,
        "tier": level if tier != "null" else "null", "misfit_share": shares(rig, sims, f),
        "acts": acts(rig, sims, pairs) if pairs else {"approach": 0.0, "loading": 0.5, "unloading": 0.5, "after": 0.0},
        "oracle_misfit": oracle, "origin": sorted({e["origin"] for e, _ in pairs}),
        "limit": limit, "forms": [e["form"] for e, _ in pairs], "strengths": [s for _, s in pairs],
        "hostile": {"wander": hostile[0], "spikes": hostile[1]}, "user_fit_r2": user.r2,
        "true_base": {"M": rig.P[m.M], "k": rig.P[m.K], "p": rig.P[m.PW], "mu": rig.P[m.MU], "g": rig.P[m.G],
                      "travel": rig.P[m.TRAVEL], "sp_k": rig.P[m.SP_K]},
        "true_effect": described(rig, pairs), "noise": {c: rig.sigma[c] for c in rig.channels},
    }
    return rig, data, measured, mass, user.P, truth


def oracle_misfit(rig, data, mass, pairs, stride, speeds):
    """Misfit over range of who knows the effects, their strengths too, and fits what else there is."""
    P = rig.P.copy()
    P[m.M] = mass
    if rig.kind == "drop-test" and any(e["mechanism"] == "gravity" for e, _ in pairs):
        P[m.G] = 9.81
    effects = [(e["apply"], s) for e, s in pairs]
    return fit(rig, data, P, effects=effects, stride=max(1, stride // 2), iterations=14, speeds=speeds, tolerant=True).nrmse


def alike(rig):
    """The same rig with gravity in the simulation's terms."""
    import copy
    r = copy.copy(rig)
    r.terms = ["gravity"] + rig.terms
    return r


def gravity_target(rig, eff, band):
    """Gravity has no strength to choose: what it leaves, if that lies in the tier's band."""
    sims = simulate(rig, rig.P, [(eff["apply"], 1.0)])
    stride = max(1, int(np.median([r.n for r in rig.recs]) // 220))
    f = fit(rig, sims, base_parameters(rig), stride=stride, iterations=8, speed_std=CALM)
    return f.over_noise if band[0] < f.over_noise < band[1] else None


def described(rig, pairs):
    """Parameters the effects wrote, by name, for the middle recording."""
    names = {getattr(m, k): k for k in dir(m) if k.isupper() and k not in m.COUNTS and isinstance(getattr(m, k), int)}
    out = {}
    for e, s in pairs:
        P, ch = rig.P.copy(), {}
        P[m.KFAC] = 1.0
        r = rig.recs[len(rig.recs) // 2]
        before = P.copy()
        e["apply"](s, P, ch, r)
        for i in np.flatnonzero(P != before):
            out[names.get(int(i), f"p{i}").lower()] = float(P[i])
        for k, v in ch.items():
            out[k] = list(v) if isinstance(v, tuple) else v
    return out


def case(seed, index, tier, mechanism, used, only=None):
    """The case `index` of the set `seed`, of the kind `only` where that is given; draws again until one comes out as planned."""
    for t in range(200):
        rng = np.random.default_rng([seed, index, t])
        try:
            got = attempt(rng, tier, mechanism, used, only)
        except (ArithmeticError, np.linalg.LinAlgError):
            got = None
        if got is not None:
            return got, rng, t
        if t % 25 == 24 and tier not in ("null", "pair"):      # what cannot be had at this strength is had another way
            mechanism = str(np.random.default_rng([seed, index, 999, t]).choice(OUTSIDE if tier == "unknown" else KNOWN))
    raise RuntimeError(f"case {index}: no draw came out as {tier}")


def jsonable(x):
    if isinstance(x, dict):
        return {k: jsonable(v) for k, v in x.items()}
    if isinstance(x, (list, tuple)):
        return [jsonable(v) for v in x]
    if isinstance(x, (np.floating, np.integer, np.bool_)):
        return x.item()
    return x


def generate(seed, n, out, say=print, prefix=None, todo=None, only=None):
    """Writes n cases of the seed into out/open and out/truth; returns the truths' names. todo: tier and mechanism of each, where not those of `plan`; only: the kind of all."""
    out = Path(out)
    prefix = prefix or f"s{seed}"
    todo = todo or plan(np.random.default_rng([seed, 0xC0DE]), n)
    used = {}
    names = []
    for i, (tier, mech) in enumerate(todo):
        name = f"{prefix}-{i + 1:03d}"
        (rig, data, measured, mass, user, truth), rng, tries = case(seed, i, tier, mech, used, only)
        units = "ms" if rng.random() < 0.33 else "s"
        write_case(out / "open" / name, name, rig, data, measured, mass, user, units)
        (out / "truth").mkdir(parents=True, exist_ok=True)
        (out / "truth" / f"{name}.json").write_text(json.dumps(jsonable(truth), indent=1) + "\n")
        names.append(name)
        if say:
            say(i + 1, n, name, tier, truth, tries)
    return names


def label_hash(truth_dir):
    """sha256 over all sealed labels, in the order of their names."""
    h = hashlib.sha256()
    for p in sorted(Path(truth_dir).glob("*.json")):
        h.update(p.name.encode())
        h.update(p.read_bytes())
    return h.hexdigest()
