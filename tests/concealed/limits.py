"""What any method could do at best: traces left after calibration, whitened, with every nuisance projected out.

P(right) between two named effects = Phi(sqrt(lambda (1 - rho) / 2)): lambda the squared length of the trace in sigmas,
rho the largest cosine with the trace another mechanism would leave.
"""
import math

import numpy as np

from . import motion as m
from .calibrate import with_globals
from .effects import FORMS, allowed
from .rigs import simulate

TIES = [{"lowpass_lag", "channel_skew"}, {"gravity", "return_spring"}]
OPPOSITES = {"cyclic_softening", "cyclic_hardening"}      # the same trace with the other sign, which distinguishes them


def _white(rig, y, c):
    """One channel in sigmas with the AR(1) colour taken out."""
    z = y / rig.sigma[c]
    rho = rig.rho[c]
    z = z.copy()
    z[1:] = (z[1:] - rho * z[:-1]) / math.sqrt(1 - rho * rho)
    return z


def separability(rng, rig, base, mechanism, sims, fit):
    """sigmas of the trace, the nearest other mechanism, its cosine and the bound on naming it right.

    base: parameters of the simulation's structure. sims: clean recordings with the effect; fit: the base calibrated
    to them (on every fit.stride-th sample, whose count is made up for).
    """
    st = fit.stride
    th, off, zero, v = fit.state
    drop = rig.kind == "drop-test"
    chans = fit.chans
    P = with_globals(rig, th, base)
    speeds = v if drop else None
    nr = len(rig.recs)
    up = math.sqrt(st)
    # thinned samples are further apart, so less coloured
    rho0 = dict(rig.rho)
    rig.rho = {c: r ** st for c, r in rho0.items()}

    def vec(s):
        return [np.concatenate([_white(rig, s[i][c] if len(s[i][c]) == len(ref[i][c]) else s[i][c][::st], c) for c in chans]) for i in range(nr)]

    try:
        ref = simulate(rig, P, (), off, speeds, zero, st)
        y0 = vec(ref)
        cols_g, prior_g = [], []
        for g, e in ((0, 1e-4), (1, 1e-4), (2, 1e-4 / max(r.speed for r in rig.recs))):
            if g == 2 and "hysteresis_damping" not in rig.terms:
                continue
            t2 = th.copy()
            t2[g] += e
            s2 = vec(simulate(rig, with_globals(rig, t2, base), (), off, speeds, zero, st))
            cols_g.append([(a - b) / e for a, b in zip(s2, y0)])
            prior_g.append(0.0)
        for c, std in (("force", 0.007), ("acceleration", 0.007), ("penetration", 0.003)):
            if c in chans:
                cols_g.append([np.concatenate([_white(rig, ref[i][d] * (d == c), d) for d in chans]) for i in range(nr)])
                prior_g.append(1 / std)
        if rig.kind != "indentation":
            heavier = P.copy()
            heavier[m.M] *= 1 + 1e-4
            s2 = vec(simulate(rig, heavier, (), off, speeds, zero, st))
            cols_g.append([(a - b) / 1e-4 for a, b in zip(s2, y0)])
            prior_g.append(1 / 0.002)
        k2 = vec(simulate(rig, P, (), off, speeds, zero, st, kfac=[1.0001] * nr))
        if drop:
            v2 = vec(simulate(rig, P, (), off, v * 1.0001, zero, st))
        locs = []
        for i in range(nr):
            L = [(k2[i] - y0[i]) / 1e-4]
            w = [1 / 0.005]
            if rig.kind != "indentation":
                L.append(np.concatenate([_white(rig, np.gradient(ref[i][c]), c) for c in chans]))
                w.append(0.0)
            if drop:
                L.append((v2[i] - y0[i]) / 1e-4)
                w.append(1 / 0.004)
            for c, std in (("force", 0.001), ("penetration", None)):
                if c in chans:
                    L.append(np.concatenate([_white(rig, np.ones(len(ref[i][d])) * (d == c), d) for d in chans]))
                    w.append(1 / (std * rig.ref["Fmax"]) if std else 0.0)
            locs.append((np.stack(L, 1), np.array(w)))
        inv = []
        for L, w in locs:
            N = L.T @ L + np.diag((w / up) ** 2 + 1e-12 * np.diag(L.T @ L) + 1e-30)
            inv.append(np.linalg.inv(N))

        def loc(i, x):
            L = locs[i][0]
            return x - L @ (inv[i] @ (L.T @ x))

        Gp = [np.stack([c[i] for c in cols_g], 1) for i in range(nr)]
        GQ = [loc(i, Gp[i]) for i in range(nr)]
        A = sum(g.T @ q for g, q in zip(Gp, GQ)) + np.diag((np.array(prior_g) / up) ** 2)
        A[np.diag_indices_from(A)] *= 1 + 1e-10
        Ai = np.linalg.inv(A)

        def project(d):
            q = [loc(i, d[i]) for i in range(nr)]
            b = sum(g.T @ x for g, x in zip(Gp, q))
            c = Ai @ b
            return np.concatenate([x - g @ c for x, g in zip(q, GQ)])

        truth = project([a - b for a, b in zip(vec(sims), y0)])
        length = float(np.sqrt(truth @ truth))
        best, who = 0.0, None
        for (name, f), (_, _, maker) in FORMS.items():
            if name == mechanism or name.startswith("unknown") or not allowed(name, f, rig.kind, rig.channels):
                continue
            if name == "gravity" and "gravity" in rig.terms:
                continue
            if name == "hysteresis_damping" and "hysteresis_damping" in rig.terms and f == "hunt-crossley":
                continue
            apply = maker(rng, rig)
            for s in ((1.0,) if name == "gravity" else (0.02, 0.2)):
                try:
                    d = vec(simulate(rig, P, [(apply, s)], off, speeds, zero, st))
                except ArithmeticError:
                    continue
                q = project([a - b for a, b in zip(d, y0)])
                n = float(np.sqrt(q @ q))
                if n > 1e-9 and length > 0:
                    c = float(q @ truth) / (n * length)
                    c = c if {name, mechanism} == OPPOSITES else abs(c)
                    if c > best and {name, mechanism} not in TIES:
                        best, who = c, name
    finally:
        rig.rho = rho0
    sig = length * up
    arg = math.sqrt(max(sig * sig * (1 - best) / 2, 0.0))
    return {"sigmas": sig, "nearest": who, "cosine": best, "p_right": 0.5 * (1 + math.erf(arg / math.sqrt(2)))}
