"""The library of physical terms the tuned rivals choose from, at a recording's states; what each would be called.

A term is a force of contact (in compression), of the body (along x) or a change of the force transducer's reading.
"""
import numpy as np
from scipy.signal import savgol_filter

from . import motion as m
from .beside_base import equations


def smooth_force(t):
    """The force the chain terms stand on: measured and smoothed, else the base's."""
    f = t.data.get("force")
    f = t.s["force"] if f is None or t.kind == "indentation" else savgol_filter(f, 9, 2)
    return f


def library(t, x, v):
    """[(name, where, column [N])] along states x, v of the track; where: contact, body or chain."""
    rig, P, dt = t.rig, t.base.P, t.rig.dt
    r, xr, vr, F = rig.recs[0], rig.ref["x"], rig.ref["v"], rig.ref["Fmax"]
    xp = np.maximum(x, 0.0)
    u, w = xp / xr, v / vr
    inside = (x > 0) * 1.0
    p = P[m.PW]
    f = smooth_force(t) / F
    top = max(u.max(), 1e-9)
    out = [("viscous_damping", "contact", inside * w)]
    out.append(("contact_preload", "contact", inside * np.minimum(1.0, np.maximum(u, 0.0) / 0.03)))
    if "hysteresis_damping" not in rig.terms:
        out.append(("hysteresis_damping", "contact", u ** p * w))
    for d in (0.35, 0.55, 0.75):
        out.append(("secondary_stiffening", "contact", np.maximum(u - d * 1.3, 0.0) ** 1.5))
    back = inside * (np.arange(len(x)) > int(np.argmax(x)))
    out.append(("adhesion", "contact", -back))
    out.append(("plastic_indentation", "contact", -back * u * np.maximum(1 - u / top, 0.0)))
    out.append(("plastic_indentation", "contact", -back * u ** p * np.maximum(1 - (u / top) ** 2, 0.0)))
    out.append(("cyclic_softening", "contact", -u ** p * np.log(r.order)))
    length = max(inside.sum() * dt, dt)
    for tau in (0.1, 0.4):
        e, q, s = np.exp(-dt / (tau * length)), 0.0, np.zeros(len(x))
        g = np.diff(u ** p, prepend=0.0)
        for i in range(len(x)):
            q = q * e + g[i]
            s[i] = q
        out.append(("viscoelastic_relaxation", "contact", s * inside))
    if rig.kind != "indentation":
        out += [("guide_friction", "body", -np.tanh(v / 0.005)), ("fluid_drag", "body", -w * np.abs(w))]
        gap = np.maximum(-x, 0.0)
        out.append(("squeeze_film", "body", -w * xr / (gap + xr)))
        if rig.kind == "drop-test":
            out += [("return_spring", "body", np.ones(len(x))), ("return_spring", "body", -x / (vr * r.before + 1e-12))]
        else:
            out.append(("residual_magnetism", "body", -1 / (1 + np.maximum(x + P[m.TRAVEL], 0.0) / (0.3 * P[m.TRAVEL])) ** 2))
            out.append(("residual_magnetism", "body", -np.exp(-t.t / max(0.5 * r.before, dt))))
        if "force" in t.data:
            out += [("lowpass_lag", "chain", -np.gradient(f, dt) * length), ("charge_droop", "chain", -np.cumsum(f) * dt / length),
                    ("force_gain", "chain", f), ("clipping", "chain", -np.maximum(f - 0.9, 0.0))]
    return [(n, k, c * F) for n, k, c in out]


def freedom(t, x, v):
    """Columns of the base's own freedom in the contact equation [N]: k, p, mu_d, this recording's stiffness and zeros."""
    P = t.base.P
    xp = np.maximum(x, 1e-12)
    law = np.where(x > 0, P[m.K] * xp ** P[m.PW], 0.0)
    cols = [law, law * np.log(xp / t.rig.ref["x"])]
    if "hysteresis_damping" in t.rig.terms:
        cols.append(law * v / t.rig.ref["v"])
    return cols


def rows(t):
    """(library matrix, y, freedom) of one recording, rows divided by sigma; its own zeros projected out."""
    x, v, eqs = equations(t, smooth=True)
    lib, own = library(t, x, v), freedom(t, x, v)
    A, y, O, N = [], [], [], []
    step = max(1, len(x) // 250)
    for kind, yy, s in eqs:
        where = np.ones(len(x), bool)
        s_ = s[where][::step]
        if kind == "contact":
            sign = {"contact": 1.0, "body": 0.0 if "force" in t.data else -1.0, "chain": 1.0}
        else:
            sign = {"contact": 0.0, "body": 1.0, "chain": 1.0}
        A.append(np.stack([sign[k] * c[where][::step] / s_ for _, k, c in lib], 1))
        y.append(yy[where][::step] / s_)
        O.append(np.stack([(c if kind == "contact" else 0 * c)[where][::step] / s_ for c in own], 1))
        f = smooth_force(t)
        local = [np.ones(len(x)), np.gradient(f), np.where(x > 0, np.maximum(x, 1e-12) ** (t.base.P[m.PW] - 1), 0.0) * (kind == "contact")]
        N.append((kind, np.stack([c[where][::step] / s_ for c in local], 1)))
    A, y, O = np.concatenate(A), np.concatenate(y), np.concatenate(O)
    L = np.zeros((len(y), 3 * len(N)))
    at = 0
    for j, (_, n) in enumerate(N):
        L[at:at + len(n), 3 * j:3 * j + 3] = n
        at += len(n)
    L = L / (np.sqrt((L ** 2).sum(0)) + 1e-300)
    Q = np.linalg.qr(L)[0] if len(y) > L.shape[1] else np.zeros((len(y), 1))
    take = lambda M: M - Q @ (Q.T @ M)
    return take(A), take(y), take(O)


def stacked(tracks):
    parts = [rows(t) for t in tracks]
    return tuple(np.concatenate([p[j] for p in parts]) for j in range(3))


def without(A, y, own):
    """Library and target with the base's freedom projected out."""
    size = np.sqrt((own ** 2).sum(0)) + 1e-300
    Q = np.linalg.qr(own / size)[0]
    return A - Q @ (Q.T @ A), y - Q @ (Q.T @ y)


def force_of(t, co):
    """Forces (contact, body, chain) of coefficients `co` along the base's states of a track."""
    out = {k: np.zeros(len(t.t)) for k in ("contact", "body", "chain")}
    for (_, k, c), q in zip(library(t, t.x, t.v), co):
        if q:
            out[k] += q * c
    return out["contact"], out["body"], out["chain"]


def tie(name):
    return {"lowpass_lag": ["channel_skew"], "channel_skew": ["lowpass_lag"], "gravity": ["return_spring"], "return_spring": ["gravity"]}.get(name, [])


def names_of(track, co, weight):
    """Names of the terms kept, heaviest first, and what their ties hold open."""
    called = [n for n, _, _ in library(track, track.x, track.v)]
    names = []
    for i in np.argsort(-weight):
        if co[i] != 0 and called[i] not in names:
            names.append(called[i])
    return names, sorted({a for n in names for a in tie(n)})


def inputs(t, x, v, extra):
    """Inputs of a regression in reference units: x, v, and (extra) leaving or not, order and level."""
    xr, vr = t.rig.ref["x"], t.rig.ref["v"]
    cols = [x / xr, v / vr]
    if extra:
        r = t.rig.recs[0]
        cols += [(np.arange(len(x)) > int(np.argmax(x))) * 1.0, np.full(len(x), r.order / 10.0), np.full(len(x), r.speed / vr)]
    return np.stack(cols, 1)


def resembles(tracks, forces, kind):
    """The one library term whose column, the base's freedom taken out, is most like the force found."""
    got, A, own = [], [], []
    for t in tracks:
        dF, dB, _ = forces(t)
        step = max(1, len(t.t) // 250)
        lib = library(t, t.x, t.v)
        y = (dF if kind == "contact" else dB)[::step]
        got.append(y)
        A.append(np.stack([(c if (k == kind or k == "chain") else 0 * c)[::step] for _, k, c in lib], 1))
        own.append(np.stack([(c if kind == "contact" else 0 * c)[::step] for c in freedom(t, t.x, t.v)], 1))
    names = [n for n, _, _ in library(tracks[0], tracks[0].x, tracks[0].v)]
    A, y, own = np.concatenate(A), np.concatenate(got), np.concatenate(own)
    A, y = without(A, y, own) if kind == "contact" else (A, y)
    size = np.sqrt((A ** 2).sum(0)) * np.sqrt(y @ y)
    c = np.where(size > 1e-9, (A.T @ y) / np.maximum(size, 1e-300), 0.0)
    best = names[int(np.argmax(np.abs(c)))]
    return [best], tie(best)
