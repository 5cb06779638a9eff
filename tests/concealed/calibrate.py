"""Calibration of a simulation to recordings: Gauss-Newton on base parameters, nuisances eliminated per recording."""
import numpy as np

from . import motion as m
from .rigs import rig_scale, simulate


def with_globals(rig, th, P0):
    """Base parameters from (ln F at the reference depth, p, mu/k)."""
    P = P0.copy()
    x = rig.ref["x"]
    P[m.PW] = th[1]
    P[m.K] = np.exp(th[0]) / x ** th[1]
    P[m.MU] = max(th[2], 0.0) * P[m.K]
    return P


def base_parameters(rig):
    """The user's base: only the terms the simulation holds."""
    P = rig.P.copy()
    if rig.kind == "drop-test" and "gravity" not in rig.terms:
        P[m.G] = 0.0
    if "hysteresis_damping" not in rig.terms:
        P[m.MU] = 0.0
    return P


class Fit:
    """Result: parameters, nuisances, prediction and how good it is."""


def fit(rig, data, P0, effects=(), stride=1, iterations=12, speeds=None, speed_std=0.004, start=None, zeros=True, tolerant=False):
    """Fits (k, p, mu_d if the terms hold it) and per recording time offset, displacement zero and touch speed.

    data: list of dicts of measured channels on the full grid. Weighted by the rig's noise. Returns a Fit.
    """
    damp = "hysteresis_damping" in rig.terms
    ind = rig.kind == "indentation"
    drop = rig.kind == "drop-test"
    chans = [c for c in rig.channels if not (ind and c == "penetration")]
    d = [{c: r[c][::stride] for c in chans} for r in data]
    nr = len(rig.recs)
    v0 = np.array([r.speed for r in rig.recs]) if speeds is None else np.asarray(speeds, float)
    v = v0.copy()
    off, zero = np.zeros(nr), np.zeros(nr)
    if start is None:
        th = np.array([np.log(P0[m.K] * rig.ref["x"] ** P0[m.PW]), P0[m.PW], P0[m.MU] / P0[m.K]])
    else:
        th, off, zero, v = [a.copy() for a in start]
    free = [0, 1, 2] if damp else [0, 1]
    dt = rig.dt * stride
    vs = max(r.speed for r in rig.recs)
    deltas = {0: 1e-4, 1: 1e-4, 2: 2e-4 / vs if not ind else 1e-4}
    prior = {}
    th = np.concatenate([th[:3], np.zeros(4)]) if len(th) < 7 else th
    if tolerant:
        for j, (c, std) in enumerate((("force", 0.007), ("acceleration", 0.007), ("penetration", 0.003))):
            if c in chans:
                free.append(3 + j)
                prior[3 + j] = std
        if not ind:
            free.append(6)
            prior[6] = 0.002
        deltas.update({3: 1e-4, 4: 1e-4, 5: 1e-4, 6: 1e-4})

    def sim(th, off, zero, v):
        P = with_globals(rig, th, P0)
        P[m.M] *= 1 + th[6]
        out = simulate(rig, P, effects, off, v if drop else None, zero, stride)
        for j, c in enumerate(("force", "acceleration", "penetration")):
            if th[3 + j]:
                for o in out:
                    o[c] = o[c] * (1 + th[3 + j])
        return out

    def residuals(s):
        return [np.concatenate([(d[i][c] - s[i][c]) / rig.sigma[c] for c in chans]) for i in range(nr)]

    def cost(res, v, th):
        return sum((th[g] / w) ** 2 for g, w in prior.items()) + sum(float(r @ r) for r in res) + (np.sum(((v - v0) / (speed_std * v0)) ** 2) if drop else 0.0)

    def stack(s, i):
        return np.concatenate([s[i][c] / rig.sigma[c] for c in chans])

    s = sim(th, off, zero, v)
    res = residuals(s)
    c0 = cost(res, v, th)
    lam = 1e-6
    for it in range(iterations):
        cols = []
        for g in free:
            t2 = th.copy()
            t2[g] += deltas[g]
            s2 = sim(t2, off, zero, v)
            cols.append([(stack(s2, i) - stack(s, i)) / deltas[g] for i in range(nr)])
        if drop:
            s2 = sim(th, off, zero, v * (1 + 1e-4))
            vcol = [(stack(s2, i) - stack(s, i)) / (1e-4 * v[i]) for i in range(nr)]
        if ind:
            e = 1e-4 * rig.ref["x"]
            s2 = sim(th, off, zero + e, v)
            zcol = [(stack(s2, i) - stack(s, i)) / e for i in range(nr)]
        A = np.zeros((len(free), len(free)))
        b = np.zeros(len(free))
        for j, g in enumerate(free):
            if g in prior:
                A[j, j] += 1 / prior[g] ** 2
                b[j] -= th[g] / prior[g] ** 2
        parts = []
        for i in range(nr):
            G = np.stack([c[i] for c in cols], 1)
            r = res[i]
            L = []
            sc = []
            if ind:
                L.append(zcol[i])
                sc.append(0.003 * rig.ref["x"])
            else:
                # a later touch by off: signal(t - off)
                grad = [np.gradient(s[i][c], dt) / rig.sigma[c] for c in chans]
                L.append(-np.concatenate(grad) if drop else np.concatenate(grad))
                sc.append(dt)
                if zeros and "penetration" in chans:
                    L.append(np.concatenate([np.full(len(d[i][c]), 1.0 / rig.sigma[c] if c == "penetration" else 0.0) for c in chans]))
                    sc.append(rig.sigma["penetration"])
                if drop:
                    L.append(vcol[i])
                    sc.append(0.004 * v[i])
            L = np.stack(L, 1) * np.array(sc)
            if drop:                      # the prior on the speed as one more row
                w = 1 / (speed_std * v0[i])
                row = np.zeros(L.shape[1])
                row[-1] = w * sc[-1]
                L = np.vstack([L, row])
                G = np.vstack([G, np.zeros(G.shape[1])])
                r = np.append(r, (v0[i] - v[i]) * w)
            N = L.T @ L
            N[np.diag_indices_from(N)] *= 1 + 1e-9 + lam
            N[np.diag_indices_from(N)] += 1e-12
            W = np.linalg.solve(N, np.column_stack([L.T @ G, L.T @ r]))
            A += G.T @ G - (L.T @ G).T @ W[:, :-1]
            b += G.T @ r - (L.T @ G).T @ W[:, -1]
            parts.append((W, sc))
        accepted = False
        for _ in range(6):
            Al = A.copy()
            Al[np.diag_indices_from(Al)] *= 1 + lam
            try:
                dg = np.linalg.solve(Al, b)
            except np.linalg.LinAlgError:
                lam = max(lam * 10, 1e-3)
                continue
            t2, o2, z2, v2 = th.copy(), off.copy(), zero.copy(), v.copy()
            t2[free] += dg
            t2[0] = np.clip(t2[0], th[0] - 1.5, th[0] + 1.5)
            t2[1] = np.clip(t2[1], 0.7, 5.0)
            t2[2] = max(t2[2], 0.0)
            shrink = 1.0
            for i, (W, sc) in enumerate(parts):
                loc = (W[:, -1] - W[:, :-1] @ dg) * sc * shrink
                if ind:
                    z2[i] += loc[0]
                else:
                    o2[i] += np.clip(loc[0], -20 * dt, 20 * dt)
                    if zeros and "penetration" in chans:
                        z2[i] += loc[1]
                    if drop:
                        v2[i] += np.clip(loc[-1], -0.1 * v[i], 0.1 * v[i])
            try:
                s2 = sim(t2, o2, z2, v2)
                r2 = residuals(s2)
                c2 = cost(r2, v2, t2)
            except ArithmeticError:
                c2 = np.inf
            if c2 < c0 * (1 + 1e-12):
                gain = (c0 - c2) / max(c0, 1e-300)
                th, off, zero, v, s, res, c0 = t2, o2, z2, v2, s2, r2, c2
                lam = max(lam * 0.2, 1e-9)
                accepted = True
                break
            lam = max(lam * 10, 1e-4)
        if not accepted or gain < 1e-5 or c0 < 1e-3:
            break
    f = Fit()
    f.th, f.P, f.offset, f.zero, f.speed, f.cost = th, with_globals(rig, th, P0), off, zero, v, c0
    f.state = (th, off, zero, v)
    f.sim, f.chans, f.stride = s, chans, stride
    f.over_noise = float(np.sqrt(np.mean(np.concatenate(res) ** 2)))
    f.nrmse = misfit(rig, d, s, chans)
    num = den = 0.0
    for i in range(nr):
        for c in chans:
            y = d[i][c]
            rg = max(np.ptp(y), 1e-300)
            num += np.mean((y - s[i][c]) ** 2) / rg ** 2
            den += np.var(y) / rg ** 2
    f.r2 = 1 - num / den
    return f


def misfit(rig, data, sims, chans):
    """Mean over recordings and channels of rms difference over the recording's range; an imposed path counts zero."""
    t, n = 0.0, 0
    for a, b in zip(data, sims):
        for c in rig.channels:
            n += 1
            if c in chans:
                t += float(np.sqrt(np.mean((a[c] - b[c]) ** 2)) / max(np.ptp(a[c]), 1e-300))
    return t / n
