"""Campaigns as real as a rig: groups beside today's mix, in which noise is not the only fault of the world.

print      small print: the true law off by smooth wiggles of 0.5 to 2 % of force, a small loss at any speed, transducers
           not quite straight, small modes of the structure; with nothing missing, or with one effect
dirt       a dirty measurement: one fault of DIRT, with nothing missing, or with one effect
little     little measured: one of LITTLE, with nothing missing, or with one effect
strangers  one effect of no vocabulary, of the development half (forms_strange.py)
sealed     one effect of no vocabulary, of the sealed half
many       four to six small effects at once
rough      the true law off by some per cent of force and little noise, as the real recordings show it (`fine_print`, three to
           five times as large); with nothing missing, or with one effect that stands out of that

`draw_group` writes campaigns as generate.py does; labels also hold the group ("set") and what was drawn ("detail").
"""
import json
from pathlib import Path

import numpy as np

from . import chain as chain_
from . import motion as m
from .calibrate import base_parameters, fit
from .effects import FORMS, KNOWN, allowed, of_half
from .generate import CALM, TIERS, acts, described, gravity_target, jsonable, make_effect, oracle_misfit, record, tune, write_case
from .limits import OPPOSITES, TIES
from .rigs import CHANNELS, draw, simulate

GROUPS = ("print", "dirt", "little", "strangers", "sealed", "many", "rough")
DIRT = ("hum", "heavy tails", "growing noise", "coarse steps", "drift", "two systems", "jitter", "scatter", "spikes")
LITTLE = ("acceleration alone", "force alone", "three drops", "one level", "one recording")
NOTHING = {"print": 0.4, "dirt": 0.75, "little": 0.3, "strangers": 0.0, "sealed": 0.0, "many": 0.0, "rough": 0.3}     # share with nothing missing
ROUGH = (3.0, 5.0)                              # how many times as large as small print
QUIET = (0.1, 0.5)                              # noise beside that of the other groups: what is rough shows where noise does not hide it
STANDS_OUT = (1.3, 4.0)                         # misfit of an effect over that of the rough law it stands beside
BY_ORDER = {"cyclic_softening", "cyclic_hardening", "force_gain"}      # need several recordings to show


def names_of(group):
    """The effects a group draws from. Gravity is as strong as it is: nothing makes it stand out of a rough law."""
    if group in ("strangers", "sealed"):
        return of_half({"strangers": "development", "sealed": "sealed"}[group])
    return [k for k in KNOWN if k != "gravity"] if group == "rough" else KNOWN


def plan(rng, group, n):
    """(detail, name of the effect or None) for each of n campaigns of a group, shuffled; decks are dealt out evenly."""
    details = {"dirt": DIRT, "little": LITTLE}.get(group, ("",))
    names = names_of(group)
    nothing = round(NOTHING[group] * n)
    out, deck, kinds = [], [], []
    for i in range(n):
        if not i % len(details):
            kinds = [str(d) for d in rng.permutation(details)]
        if not deck:
            deck = [str(x) for x in rng.permutation(names)]
        out.append((kinds[i % len(details)], None if i < nothing or group == "many" else deck.pop()))
    return [out[i] for i in rng.permutation(n)]


def fine_print(rng, rig, times=1.0):
    """apply(s, P, chain, recording) of what a real rig has besides; s is not used.

    Wiggles: three sines of depth, 0.5 to 2 % of force in all (rms). Loss: 0.1 to 0.5 % of force at any speed. Transducers: up
    to 0.5 % from straight at the largest reading (displacement 0.2 %). Modes: two, 0.2 to 1 % of force, 3 to 10 in a contact.
    All of it `times` as large.
    """
    size = times * rng.uniform(0.005, 0.02)
    share = rng.dirichlet([2.0] * m.WIG_N) ** 0.5 * size * np.sqrt(2.0)
    number = rng.uniform(0.6, 3.0, m.WIG_N) * 2 * np.pi / rig.ref["xmax"]
    phase = rng.uniform(0, 2 * np.pi, m.WIG_N)
    loss = times * rng.uniform(0.001, 0.005)
    plain = simulate(rig, rig.P)
    full = {c: max(np.abs(q[c]).max() for q in plain) for c in CHANNELS}
    straight = {"force": (times * rng.uniform(-0.005, 0.005), full["force"])}
    ringing = []
    if rig.kind != "indentation":
        straight |= {"acceleration": (times * rng.uniform(-0.005, 0.005), full["acceleration"]), "penetration": (times * rng.uniform(-0.002, 0.002), full["penetration"])}
        for _ in range(2):
            c = str(rng.choice(["force", "acceleration"]))
            unit = 1.0 if c == "force" else -1.0 / rig.P[m.M]
            f = min(rng.uniform(3.0, 10.0) / rig.ref["T"], 0.2 / rig.dt)
            ringing.append((c, times * rng.uniform(0.002, 0.01) * unit, f, rng.uniform(0.01, 0.05)))

    def apply(s, P, ch, r):
        for i in range(m.WIG_N):
            P[m.WIG + 3 * i:m.WIG + 3 * i + 3] = share[i], number[i], phase[i]
        P[m.LOSS], P[m.LOSS_V] = loss, 0.02 * rig.ref["v"]
        ch["straight"], ch["ringing"] = straight, ringing
    return apply


def cut(rig, what, rng):
    """The rig with as little measured as `what` says."""
    levels = sorted({r.level for r in rig.recs})
    of = {q: [r for r in rig.recs if r.level == q] for q in levels}
    if what == "three drops":
        rig.recs = [of[levels[i]][0] for i in (0, len(levels) // 2, -1)]
    elif what == "one level":
        rig.recs = of[levels[-1]]
    elif what == "one recording":
        rig.recs = of[levels[-1]][:1]
    for i, r in enumerate(rig.recs):
        r.order = i + 1


def soiled(rng, rig, data, what):
    """Dirty measurements: (data, clocks), each recording's channels and time stamps [s]; `what` is one of DIRT.

    hum: mains, 1 to 4 sigma of noise. heavy tails: Student's t of 2.5 degrees. growing noise: 1 to 2 % of the signal.
    coarse steps: 9 bit over the range. drift: 3 to 8 sigma over a recording. two systems: every other recording by a
    system of half to a third the rate, of its own gain (0.3 %) and noise. jitter: samples 10 to 25 % of a step off the even
    grid, with stamps that say where, or the stamps alone. spikes: 2 to 8 samples a recording, 10 to 60 sigma. (scatter is drawn
    by `record`.)
    """
    hit = [c for c in rig.channels if not (rig.kind == "indentation" and c == "penetration")]
    if what in ("hum", "heavy tails", "growing noise", "drift", "spikes"):
        hit = [c for c in hit if rng.random() < 0.7] or [hit[0]]
    mains, mean, known_where = rng.choice([50.0, 60.0]), rng.uniform(0.1, 0.25), rng.random() < 0.5
    size = {c: rng.uniform(0, 1) for c in rig.channels}
    top = {c: max(np.abs(d[c]).max() for d in data) for c in rig.channels}
    slow, gain = int(rng.integers(2, 4)), {c: 1 + 0.003 * rng.standard_normal() for c in rig.channels}
    out, clocks = [], []
    for i, row in enumerate(data):
        row, n = {c: v.copy() for c, v in row.items()}, len(row[rig.channels[0]])
        t = np.arange(n) * rig.dt
        if what == "two systems" and i % 2:
            t = t[::slow]
            row = {c: v[::slow] * gain[c] + 0.5 * rig.sigma[c] * rng.standard_normal(len(t)) for c, v in row.items()}
        if what == "jitter":
            off = mean * rig.dt * np.clip(rng.standard_normal(n), -1.9, 1.9)
            if known_where:
                row = {c: np.interp(t + off, t, v) for c, v in row.items()}
            t = t + off
        for c in hit:
            s, a = rig.sigma[c], size[c]
            if what == "hum":
                row[c] += chain_.hum(rng, n, rig.dt, (1 + 3 * a) * s, mains)
            elif what == "heavy tails":
                row[c] += s * rng.standard_t(2.5, n)
            elif what == "growing noise":
                row[c] += (0.01 + 0.01 * a) * np.abs(row[c]) * rng.standard_normal(n)
            elif what == "drift":
                row[c] += chain_.drifted(rng, n, (3 + 5 * a) * s)
            elif what == "coarse steps":
                q = 2 * 1.25 * top[c] / 2 ** 9
                row[c] = np.round(row[c] / q) * q
            elif what == "spikes":
                at = rng.integers(0, n, rng.integers(2, 9))
                row[c][at] += rng.choice([-1, 1], len(at)) * rng.uniform(10, 60, len(at)) * s
        out.append(row)
        clocks.append(t)
    return out, clocks


def kind_of(rng, group, name, channels):
    """A kind of rig in which the effect can show; drop tests mostly."""
    share = {"drop-test": 0.76, "contactor-opening": 0.12, "indentation": 0.12}
    if group in ("little", "many"):
        share = {"drop-test": 1.0}
    kinds = [k for k in share if name is None or any(allowed(*f, k, channels) for f in FORMS if f[0] == name)]
    if name == "residual_magnetism":
        kinds = ["contactor-opening"]
    if not kinds:
        return None
    w = np.array([share.get(k, 1.0) for k in kinds])
    return str(rng.choice(kinds, p=w / w.sum()))


def small(rng, rig, used):
    """Four to six effects, each leaving some 0.3 to 0.9 sigma after calibration by itself; None where they cannot be had."""
    names = [str(x) for x in rng.permutation([k for k in KNOWN if k not in ("gravity", "residual_magnetism")])[:int(rng.integers(4, 7))]]
    if any(set(t) <= set(names) for t in (*TIES, OPPOSITES)) or {"base_compliance", "sensor_resonance"} <= set(names):
        return None
    pairs = []
    stride = max(1, int(np.median([r.n for r in rig.recs]) // 220))
    for n in names:
        eff = make_effect(rng, rig, n, used)
        if eff is None:
            return None
        s, want = 0.03, rng.uniform(0.3, 0.9)
        for _ in range(3):
            f = fit(rig, simulate(rig, rig.P, [(eff["apply"], s)]), base_parameters(rig), stride=stride, iterations=6, speed_std=CALM)
            if 0.6 < f.over_noise / want < 1.6:
                break
            s = float(np.clip(s * np.clip(want / f.over_noise, 0.05, 10.0), 1e-5, 1.5))
        else:
            return None
        pairs.append((eff, s))
    return pairs


def attempt(rng, group, detail, name, used):
    """One try at a campaign of a group; None where it does not come out as wanted."""
    channels = {"acceleration alone": ("acceleration",), "force alone": ("force",)}.get(detail)
    kind = kind_of(rng, group, name, channels or CHANNELS)
    if kind is None:
        return None
    if group == "little" and kind == "drop-test" and channels is None:
        channels = CHANNELS
    rig = draw(rng, kind, False if name == "hysteresis_damping" or group == "many" or kind == "indentation" else None, channels)
    cut(rig, detail, rng)
    if group == "rough":
        quiet = rng.uniform(*QUIET)
        rig.sigma = {c: quiet * s for c, s in rig.sigma.items()}
    if len(rig.recs) < 3 and name in BY_ORDER:
        return None
    if name == "gravity":
        rig.terms = [t for t in rig.terms if t != "gravity"]
    pairs, tier = [], "null"
    besides = lambda times: [(dict(apply=fine_print(rng, rig, times), origin="contact"), 1.0)]
    extra = besides(rng.uniform(*ROUGH)) if group == "rough" else []
    stride = max(1, int(np.median([r.n for r in rig.recs]) // 220))
    if group == "many":
        pairs, tier = small(rng, rig, used), "many"
        if pairs is None:
            return None
    elif name is not None:
        tier = str(rng.choice(["plain", "concealed"], p=[0.4, 0.6]))
        eff = make_effect(rng, rig, name, used)
        if eff is None:
            return None
        a, b = TIERS[tier]
        if name == "gravity":
            a, b = TIERS["concealed"][0], TIERS["plain"][1]
        if group == "rough":
            law = fit(rig, simulate(rig, rig.P, [(e["apply"], s) for e, s in extra]), base_parameters(rig), stride=stride, iterations=8, speed_std=CALM)
            tier, (a, b) = "rough", (STANDS_OUT[0] * law.over_noise, STANDS_OUT[1] * law.over_noise)
        target = gravity_target(rig, eff, (a, b)) if name == "gravity" else float(np.exp(rng.uniform(np.log(a * 1.12), np.log(b * 0.9))))
        got = None if target is None else tune(rng, rig, eff, target)
        if got is None:
            return None
        pairs = [(eff, got[0])]
    clean = [(e["apply"], s) for e, s in pairs]
    sims = simulate(rig, rig.P, clean)
    f = fit(rig, sims, base_parameters(rig), stride=stride, iterations=12, speed_std=CALM)
    band = {"null": (-1.0, np.inf), "many": (0.6, 4.0)}.get(tier) or (a * 0.95, b * 1.1)
    if f.r2 < (0.95 if group == "rough" else 0.99) or not band[0] < f.over_noise < band[1]:      # what calibration takes up entirely is no effect to be found
        return None
    if group == "print":
        extra = besides(1.0)
    data, speeds, mass = record(rng, rig, pairs + extra, (False, False), scatter=0.015 if detail == "scatter" else 0.005)
    Pm = base_parameters(rig)
    Pm[m.M] = mass
    user = fit(rig, data, Pm, stride=stride, iterations=12, speeds=speeds if kind == "drop-test" else None)
    strange = group in ("strangers", "sealed")
    oracle = oracle_misfit(rig, data, mass, pairs, stride, speeds if kind == "drop-test" else None) if strange else None
    clocks = None
    if group == "dirt":
        data, clocks = soiled(rng, rig, data, detail)
    for e, _ in pairs:
        used[e["key"]] = used.get(e["key"], 0) + 1
    truth = {
        "set": group, "detail": detail, "missing": [e["mechanism"] for e, _ in pairs], "kind": kind, "material": rig.material, "tier": tier,
        "strength": float(max([s for _, s in pairs], default=1.0)), "strengths": [s for _, s in pairs], "forms": [e["form"] for e, _ in pairs],
        "base_refit_nrmse": f.nrmse, "base_refit_r2": f.r2, "misfit_over_noise": f.over_noise, "oracle_misfit": oracle, "limit": None, "hostile": {},
        "acts": acts(rig, sims, pairs) if pairs else {"approach": 0.0, "loading": 0.5, "unloading": 0.5, "after": 0.0},
        "origin": sorted({e["origin"] for e, _ in pairs}), "user_fit_r2": user.r2,
        "true_base": {"M": rig.P[m.M], "k": rig.P[m.K], "p": rig.P[m.PW], "mu": rig.P[m.MU], "g": rig.P[m.G], "travel": rig.P[m.TRAVEL], "sp_k": rig.P[m.SP_K]},
        "true_effect": described(rig, pairs), "noise": {c: rig.sigma[c] for c in rig.channels},
    }
    return rig, data, speeds, mass, user.P, truth, clocks


def campaign(seed, group, index, detail, name, used):
    """Campaign `index` of a group: draws again until one comes out, from the seventh try on with another effect of the same kind."""
    names = names_of(group)
    for t in range(240):
        rng = np.random.default_rng([seed, GROUPS.index(group) + 1, index, t])
        if t % 6 == 5 and name is not None:
            name = str(rng.choice(names))
        try:
            got = attempt(rng, group, detail, name, used)
        except (ArithmeticError, np.linalg.LinAlgError):
            got = None
        if got is not None:
            return got, rng, t
    raise RuntimeError(f"{group} {index}: no draw came out")


def draw_group(seed, n, group, out, say=None):
    """Writes n campaigns of a group into out/open and out/truth; returns their names."""
    out, used, names = Path(out), {}, []
    todo = plan(np.random.default_rng([seed, 0xC0DE, GROUPS.index(group)]), group, n)
    for i, (detail, effect) in enumerate(todo):
        name = case_name(seed, group, i)
        (rig, data, speeds, mass, user, truth, clocks), rng, tries = campaign(seed, group, i, detail, effect, used)
        write_case(out / "open" / name, name, rig, data, speeds, mass, user, "ms" if rng.random() < 0.33 else "s", clocks)
        (out / "truth").mkdir(parents=True, exist_ok=True)
        (out / "truth" / f"{name}.json").write_text(json.dumps(jsonable(truth), indent=1) + "\n")
        names.append(name)
        if say:
            say(i + 1, n, name, group, truth, tries)
    return names


def case_name(seed, group, index):
    return f"s{seed}-{group}-{index + 1:03d}"
