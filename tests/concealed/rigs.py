"""Rigs and materials: what a campaign is made of before anything is concealed in it."""
from dataclasses import dataclass, field

import numpy as np

from . import chain as chain_
from . import motion as m

HEIGHTS = [0.005, 0.01, 0.02, 0.035, 0.05, 0.08, 0.12]      # m
CHANNELS = ("force", "acceleration", "penetration")


@dataclass
class Recording:
    """One recording: its level, order, true touch speed or preload, time grid and (indentation) imposed path."""
    level: float
    order: int
    speed: float = 0.0          # m/s at touch without any effect
    preload: float = 0.0        # N
    before: float = 0.0         # s from the first sample to touch (drop-test)
    n: int = 0
    kfac: float = 1.0           # stiffness scatter of this repeat
    path: tuple = None          # indentation: x [m], v [m/s]


@dataclass
class Rig:
    """A campaign to be: kind, material, base parameters, recordings, channels, noise."""
    kind: str
    material: str
    P: np.ndarray
    recs: list
    dt: float
    channels: tuple
    sigma: dict = field(default_factory=dict)
    rho: dict = field(default_factory=dict)
    terms: list = field(default_factory=list)
    ref: dict = field(default_factory=dict)


def nice(dt):
    """The 1-2-5 step just below dt."""
    e = 10.0 ** np.floor(np.log10(dt))
    return e * max(s for s in (1.0, 2.0, 5.0) if s * e <= dt * 1.0000001)


def contact_time(P, v):
    """Half period of the contact at speed v, undamped, about (x_m/v * 2.9) [s]."""
    q = P[m.PW] + 1
    return 2.9 * (q * P[m.M] * v * v / (2 * P[m.K])) ** (1 / q) / v


def depth(P, v):
    q = P[m.PW] + 1
    return (q * P[m.M] * v * v / (2 * P[m.K])) ** (1 / q)


def log_uniform(rng, a, b):
    return float(np.exp(rng.uniform(np.log(a), np.log(b))))


def draw(rng, kind, hysteresis=None, channels=None):
    """A rig of the kind, without noise levels (they need the base simulation: `scales`)."""
    P = np.zeros(m.NP)
    P[m.KFAC] = 1.0
    damped = rng.random() < 0.65 if hysteresis is None else hysteresis
    if kind == "drop-test":
        material = str(rng.choice(["rubber", "plastic", "steel"], p=[0.53, 0.35, 0.12]))
        P[m.M] = rng.uniform(0.3, 1.2)
        P[m.G] = 9.81
        top = {"rubber": (0.9e-3, 4e-3), "plastic": (0.18e-3, 0.9e-3), "steel": (0.02e-3, 0.17e-3)}[material]
        P[m.PW] = rng.uniform(*{"rubber": (1.5, 2.8), "plastic": (1.42, 1.8), "steel": (1.4, 1.58)}[material])
        heights = sorted(rng.choice(HEIGHTS, 5, replace=False))
        v = np.sqrt(2 * 9.81 * np.array(heights))
        q = P[m.PW] + 1
        P[m.K] = q * P[m.M] * v[-1] ** 2 / (2 * log_uniform(rng, *top) ** q)
        if damped:
            P[m.MU] = P[m.K] * rng.uniform(*{"rubber": (0.15, 0.65), "plastic": (0.05, 0.35), "steel": (0.03, 0.12)}[material])
        recs = [Recording(float(h), i + 1) for i, h in enumerate(np.repeat(heights, 2))]
        for r in recs:
            r.speed = float(np.sqrt(2 * 9.81 * r.level) * (1 + 0.004 * rng.standard_normal()))
        dt = nice(contact_time(P, v[2]) / rng.uniform(110, 260))
        lead, tail = rng.uniform(0.45, 0.95), rng.uniform(1.1, 2.0)
        for r in recs:
            tc = contact_time(P, r.speed)
            r.before = lead * tc * rng.uniform(0.95, 1.05)
            r.n = int((r.before + (1.1 + tail) * tc) / dt)
        terms = ["gravity"]
    elif kind == "contactor-opening":
        material = "contactor stop"
        P[m.M] = rng.uniform(0.26, 0.5)
        P[m.TRAVEL] = rng.uniform(2e-3, 5e-3)
        P[m.PW] = rng.uniform(1.0, 1.25)
        pre = rng.uniform(27, 120)
        P[m.SP_K] = rng.uniform(0.2, 0.45) * pre / P[m.TRAVEL]
        levels = [0.8 * pre, pre, 1.25 * pre]
        v = np.sqrt(2 * (levels[-1] * P[m.TRAVEL] - P[m.SP_K] * P[m.TRAVEL] ** 2 / 2) / P[m.M])
        q = P[m.PW] + 1
        P[m.K] = q * P[m.M] * v * v / (2 * log_uniform(rng, 0.08e-3, 0.5e-3) ** q)
        if damped:
            P[m.MU] = P[m.K] * rng.uniform(0.03, 0.2)
        recs = [Recording(float(f), i + 1, preload=float(f)) for i, f in enumerate(np.repeat(levels, 3))]
        tc = contact_time(P, v)
        dt = nice(tc / rng.uniform(60, 130))
        length = 2.05 if rng.random() < 0.7 else 3.6
        for r in recs:
            w = np.sqrt(P[m.SP_K] / P[m.M])
            t_touch = np.arccos(1 - P[m.SP_K] * P[m.TRAVEL] / r.preload) / w
            r.before = t_touch
            r.speed = r.preload / P[m.SP_K] * w * np.sin(w * t_touch)
            r.n = int((length * t_touch + tc) / dt)
        while max(r.n for r in recs) > 3000:
            dt = nice(dt * 2.51)
            for r in recs:
                r.n = int((length * r.before + tc) / dt)
        terms = []
    else:
        material = "indented sample"
        P[m.M] = 1.0
        top = log_uniform(rng, 3e-7, 5e-4)
        P[m.PW] = rng.uniform(1.3, 2.1)
        P[m.K] = log_uniform(rng, 3e-3, 30.0) / top ** P[m.PW]
        shares = np.sort(rng.choice([0.3, 0.45, 0.6, 0.8], 3, replace=False)).tolist() + [1.0]
        recs = [Recording(float("%.4g" % (s * top)), i + 1) for i, s in enumerate(np.repeat(shares, 2))]
        rate = top / rng.uniform(2, 15)
        hold = rng.uniform(0.3, 1.5) * top / rate if rng.random() < 0.75 else 0.0
        n = int(rng.integers(280, 700))
        power = rng.uniform(0.3, 0.8)
        dt = (2.4 * top / rate + hold) / n
        for r in recs:
            u = rate * (r.level / top) ** power
            t1 = 1.2 * r.level / u
            r.n = int((2 * t1 + hold) / dt) + 1
            t = np.arange(r.n) * dt
            x = np.interp(t, [0, t1, t1 + hold, 2 * t1 + hold + dt], [-0.2 * r.level, r.level, r.level, -0.2 * r.level - u * dt])
            w = np.where(t < t1, u, np.where(t < t1 + hold, 0.0, -u))
            r.path = (x, w)
            r.speed, r.before = u, 0.2 * r.level / u
        terms = []
        P[m.MU] = 0.0
    if P[m.MU] > 0:
        terms = terms + ["hysteresis_damping"]
    if channels is None:
        if kind == "indentation":
            channels = ("force", "penetration")
        else:
            channels = [CHANNELS, ("force", "penetration"), ("acceleration", "penetration"), ("force", "acceleration")][
                rng.choice(4, p=[0.74, 0.09, 0.09, 0.08])]
    rig = Rig(kind, material, P, recs, dt, channels, terms=terms)
    scales(rng, rig)
    return rig


def slim(rig, levels=3, repeats=2, samples=200):
    """The rig with its lowest, middle and highest level, two recordings each, thinned to some `samples`: quick to diagnose."""
    have = sorted({r.level for r in rig.recs})
    keep = [have[i] for i in np.linspace(0, len(have) - 1, min(levels, len(have))).round().astype(int)]
    rig.recs = [r for q in keep for r in [r for r in rig.recs if r.level == q][:repeats]]
    every = max(1, round(max(r.n for r in rig.recs) / samples))
    for i, r in enumerate(rig.recs):
        r.order, r.n = i + 1, (r.n + every - 1) // every
        if r.path is not None:
            r.path = (r.path[0][::every], r.path[1][::every])
    rig.dt *= every
    return rig


def scales(rng, rig):
    """Noise of each channel from the largest level's range, and the reference magnitudes effects are scaled by."""
    sims = simulate(rig, rig.P)
    top = {c: max(np.ptp(s[c]) for s in sims) for c in CHANNELS}
    lo, hi = {"force": (0.0018, 0.0036), "acceleration": (0.0026, 0.0056), "penetration": (0.0003, 0.0011)}, None
    if rig.kind == "indentation":
        lo = {"force": (0.0015, 0.004), "acceleration": (1, 1), "penetration": (0.0008, 0.003)}
    if rig.kind == "contactor-opening":
        lo["penetration"] = (0.0001, 0.0005)
    rig.sigma = {c: float(rng.uniform(*lo[c]) * max(top[c], 1e-300)) for c in CHANNELS}
    rig.rho = {c: float(rng.uniform(0.0, 0.6)) for c in CHANNELS}
    mid = sims[len(sims) // 2]
    r = rig.recs[len(sims) // 2]
    rig.ref = dict(F=float(mid["contact"].max()), x=float(mid["x"].max()), v=float(abs(mid["v"]).max()),
                   T=float((mid["x"] > 0).sum() * rig.dt), Fmax=top["force"], xmax=float(max(s["x"].max() for s in sims)),
                   length=r.n * rig.dt, before=r.before, p=float(rig.P[m.PW]))


def simulate(rig, P, effects=(), offsets=None, speeds=None, zeros=None, stride=1, kfac=None, tol=1e-6):
    """Every recording as its sensors would give it without noise.

    effects: pairs (apply, strength). offsets [s] shift the touch, speeds [m/s] replace the touch speeds, zeros [m] are
    added to the displacement. Returns dicts with the channels and x, v, contact, phases' raw material.
    """
    outs = []
    for i, r in enumerate(rig.recs):
        q = P.copy()
        q[m.KFAC] = 1.0 if kfac is None else kfac[i]
        ch = {}
        for apply, s in effects:
            apply(s, q, ch, r)
        n = (r.n + stride - 1) // stride
        dt = rig.dt * stride
        off = 0.0 if offsets is None else offsets[i]
        v = r.speed if speeds is None else speeds[i]
        t = np.arange(n) * dt
        out = np.zeros((n, 7))
        ok = 0
        touch = (np.nan, np.nan)
        if rig.kind == "drop-test":
            b = r.before + off
            touch = m.run(q, -(v * b - q[m.G] * b * b / 2), v - q[m.G] * b, t, rig_scale(rig, "x"), v, tol, out)
        elif rig.kind == "contactor-opening":
            q[m.SP_PRE] = r.preload
            touch = m.run(q, -q[m.TRAVEL], 0.0, t + off, rig_scale(rig, "x"), r.speed, tol, out)
        else:
            z = 0.0 if zeros is None else zeros[i]
            m.imposed(q, t, r.path[0][::stride] + z, r.path[1][::stride], out)
            touch = (r.before, r.speed, 1)
        if touch[2] < 0:
            raise ArithmeticError("the integration did not end")
        force = out[:, 4].copy()
        g = q[m.G] if rig.kind == "drop-test" else 0.0
        sig = dict(force=force, acceleration=out[:, 2] - g, penetration=out[:, 0].copy())
        if zeros is not None and rig.kind != "indentation":
            sig["penetration"] += zeros[i]
        if zeros is not None and rig.kind == "indentation":
            sig["penetration"] = r.path[0][::stride].copy()
        bare = dict(sig)
        sig = chain_.through(sig, dt, ch) if ch else sig
        sig.update(x=out[:, 0], v=out[:, 1], a=out[:, 2], contact=out[:, 3], reading=out[:, 4], touch=touch, bare=bare, P=q, chain=ch)
        outs.append(sig)
    ch = outs[0]["chain"]
    if "clip" in ch:
        c, share, soft = ch["clip"]
        limit = ch.get("clip_limit") or share * max(np.abs(s[c]).max() for s in outs)
        for s in outs:
            s["unclipped"] = s[c]
            s[c] = chain_.clipped(s[c], limit, soft, rig.dt * stride)
            s["limit"] = limit
    return outs


def rig_scale(rig, what):
    return rig.ref.get("x", 1e-4) if what == "x" else rig.ref.get("v", 1.0)


def phases(x):
    """Phase of every sample from the body's true position: 0 approach, 1 loading, 2 unloading, 3 after."""
    n = len(x)
    ph = np.full(n, 3)
    inside = x > 0
    if not inside.any():
        return np.zeros(n, int)
    first = int(np.argmax(inside))
    ph[:first] = 0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], inside.astype(int), [0]])))
    for a, b in zip(edges[::2], edges[1::2]):
        d = a + int(np.argmax(x[a:b]))
        ph[a:d + 1] = 1
        ph[d + 1:b] = 2
    return ph
