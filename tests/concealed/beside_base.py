"""What every rival is given: recordings as a rig, the base calibrated to them, the noise, and a way to hold a level out.

A rival finds forces the base leaves out. They are carried through the equation of motion to first order along the
base's own trajectory, M dx'' = dB - dF - F_x dx - F_v dv, so that a force that acts in flight moves the penetration too.
"""
import copy
import tomllib

import numpy as np
from numba import njit
from scipy.signal import savgol_filter

from . import motion as m
from .calibrate import base_parameters, fit, with_globals
from .judge import CHANNELS, files, si
from .rigs import Recording, Rig, depth, simulate

SCATTER = 0.005         # stiffness scatter between repeats, as the format says
SPEED_STD = 0.004


def load(case, noise):
    """The case's recordings as (rig, data): what campaign.toml says, and the noise of each channel as given."""
    c = tomllib.loads((case / "campaign.toml").read_text())
    data = [si(case / n) for n in files(case)]
    kind, sim = c["campaign"]["kind"], c["simulation"]
    P = np.zeros(m.NP)
    P[m.KFAC], P[m.M] = 1.0, c.get("rig", {}).get("moving_mass", 1.0)
    P[m.K], P[m.PW], P[m.MU] = sim["k"], sim["p"], sim["mu_d"]
    channels = tuple(q for q in CHANNELS if q in data[0])
    dt = float(np.median(np.diff(data[0]["time"])))
    recs = []
    for r, a in zip(c["recording"], data):
        level = next(r[k] for k in ("drop_height", "spring_preload", "level") if k in r)
        q = Recording(float(level), r["order"], n=len(a["time"]))
        if kind == "drop-test":
            P[m.G] = 9.81
            q.speed = r["impact_speed"]
            if "penetration" in a:
                q.before = float(a["time"][int(np.argmax(a["penetration"] > 0))])
            else:
                s = "force" if "force" in a else "acceleration"
                q.before = float(a["time"][max(int(np.argmax(np.abs(a[s]) > 8 * noise[s])) - 2, 0)])
        elif kind == "contactor-opening":
            P[m.TRAVEL], P[m.SP_K] = c["rig"]["travel"], c["rig"]["return_spring_rate"]
            q.preload = float(level)
            w = np.sqrt(P[m.SP_K] / P[m.M])
            q.before = float(np.arccos(1 - P[m.SP_K] * P[m.TRAVEL] / q.preload) / w)
            q.speed = float(q.preload / P[m.SP_K] * w * np.sin(w * q.before))
        else:
            n = max(len(a["time"]) // 60 | 1, 5)
            x = savgol_filter(a["penetration"], n, 2)
            q.path = (x, savgol_filter(a["penetration"], n, 2, deriv=1, delta=dt))
            q.speed = float(np.abs(q.path[1]).max())
        recs.append(q)
    rig = Rig(kind, "", P, recs, dt, channels, sigma={k: noise.get(k, 1.0) for k in CHANNELS}, rho={k: 0.0 for k in CHANNELS}, terms=list(sim["terms"]))
    if kind == "indentation":
        rig.ref = dict(x=float(max(r.path[0].max() for r in recs)), v=max(r.speed for r in recs))
    else:
        v = float(np.median([r.speed for r in recs]))
        rig.ref = dict(x=float(depth(P, v)), v=v)
    rig.ref["Fmax"] = float(P[m.K] * rig.ref["x"] ** P[m.PW])
    return rig, data


def part(rig, data, keep):
    """The rig and data of some recordings only."""
    r = copy.copy(rig)
    r.recs = [rig.recs[i] for i in keep]
    return r, [data[i] for i in keep]


class Base:
    """The base calibrated to some recordings: parameters and, per recording, offset, zero and speed.

    Tuned: every nuisance and tolerance, from several starts, and once more with each channel's weight taken from what it
    is really missed by, so that one channel with little noise does not bend the rest. Naive: time offsets only.
    """

    def __init__(self, rig, data, tuned=True, starts=(None,)):
        stride = max(1, int(np.median([r.n for r in rig.recs]) // 220))
        given = dict(stride=stride, iterations=12, speeds=[r.speed for r in rig.recs] if rig.kind == "drop-test" else None,
                     speed_std=SPEED_STD if tuned else 1e-6, zeros=tuned, tolerant=tuned)
        tries = [fit(rig, data, base_parameters(rig), start=s, **given) for s in starts]
        self.fit = min(tries, key=lambda f: f.cost)
        self.rig = rig
        if tuned:
            missed = {c: np.sqrt(np.mean([np.mean((d[c][::stride] - s[c]) ** 2) for d, s in zip(data, self.fit.sim)])) for c in self.fit.chans}
            self.rig = copy.copy(rig)
            self.rig.sigma = {c: max(rig.sigma[c], float(missed.get(c, 0.0))) for c in CHANNELS}
            self.fit = fit(self.rig, data, base_parameters(rig), start=self.fit.state, **given)
        self.P = with_globals(rig, self.fit.th, base_parameters(rig))
        self.P[m.M] *= 1 + self.fit.th[6]
        self.gain = {c: 1 + self.fit.th[3 + j] for j, c in enumerate(("force", "acceleration", "penetration"))}
        self.tuned = tuned

    def without(self, keep):
        """A start for the same fit on some of the recordings."""
        th, off, zero, v = self.fit.state
        return th, off[keep], zero[keep], v[keep]

    def run(self, rig1, off, zero, v):
        """One recording simulated: the channels with their gains, and the states."""
        s = simulate(rig1, self.P, (), [off], [v] if rig1.kind == "drop-test" else None, [zero])[0]
        for c in CHANNELS:
            s[c] = s[c] * self.gain[c]
        return s


class Track:
    """One recording along the base: nuisances fitted, signals, states, and the columns a nuisance adds."""

    def __init__(self, base, rig1, data1, iterations=4):
        self.rig, self.data, self.base = rig1, data1[0], base
        r, self.kind = rig1.recs[0], rig1.kind
        self.chans = [c for c in rig1.channels if not (self.kind == "indentation" and c == "penetration")]
        q, best = np.array([0.0, 0.0, r.speed]), None
        lam = 1.0
        for _ in range(iterations):
            s = base.run(rig1, *q)
            cols, scale = self.columns(s, q)
            res = self.stack({c: self.data[c] - s[c] for c in self.chans})
            cost = res @ res + self.prior(q)
            if best is not None and cost > best[0]:
                lam *= 0.3
                q = best[1] + lam * best[2]
                continue
            step = self.solve(cols, res, scale, q)
            best = (cost, q.copy(), step)
            q = q + step
        s = base.run(rig1, *q)
        if (lambda e: e @ e + self.prior(q))(self.stack({c: self.data[c] - s[c] for c in self.chans})) > best[0]:
            q = best[1]
            s = base.run(rig1, *q)
        self.q, self.s = q, s
        self.cols, self.scale = self.columns(s, q)
        self.t = np.arange(r.n) * rig1.dt
        self.x, self.v = s["x"], s["v"]
        P = base.P
        x = np.maximum(self.x, 1e-12)
        inside = self.x > 0
        self.Fx = np.where(inside, P[m.PW] * x ** (P[m.PW] - 1) * (P[m.K] + P[m.MU] * self.v), 0.0)
        self.Fv = np.where(inside, P[m.MU] * x ** P[m.PW], 0.0)

    def stack(self, sig):
        return np.concatenate([sig[c] / self.base.rig.sigma[c] for c in self.chans])

    def prior(self, q):
        r = self.rig.recs[0]
        return ((q[2] - r.speed) / (SPEED_STD * r.speed)) ** 2 if self.kind == "drop-test" else 0.0

    def columns(self, s, q):
        """Derivatives of the stacked signals to offset, zero and speed, by differences; and the step scales."""
        dt, xr = self.rig.dt, self.rig.ref["x"]
        y = self.stack(s)
        steps = {"drop-test": (0.2 * dt, 1e-3 * xr, 1e-4 * q[2]), "contactor-opening": (0.2 * dt, 1e-3 * xr, 0.0), "indentation": (0.0, 1e-3 * xr, 0.0)}[self.kind]
        cols = []
        for j, e in enumerate(steps):
            if not e:
                cols.append(np.zeros_like(y))
                continue
            q2 = q.copy()
            q2[j] += e
            cols.append((self.stack(self.base.run(self.rig, *q2)) - y) / e)
        return np.stack(cols, 1), np.array([dt, xr, max(q[2], 1e-9)])

    def solve(self, cols, res, scale, q):
        r = self.rig.recs[0]
        A, b = cols * scale, res
        N = A.T @ A + np.diag([1e-9, 1e-9, 1e-9])
        g = A.T @ b
        if self.kind == "drop-test":
            w = (scale[2] / (SPEED_STD * r.speed)) ** 2
            N[2, 2] += w
            g[2] += w * (r.speed - q[2]) / scale[2]
        N[np.diag_indices(3)] *= 1 + 1e-9
        step = np.linalg.solve(N, g) * scale
        return np.clip(step, [-20 * self.rig.dt, -self.rig.ref["x"], -0.1 * q[2]], [20 * self.rig.dt, self.rig.ref["x"], 0.1 * q[2]])

    def corrected(self, dF, dB, dchain):
        """The channels with forces added: contact dF [N], body dB [N], reading of the force transducer dchain [N]."""
        out = {c: self.s[c].copy() for c in self.rig.channels}
        P, g = self.base.P, self.base.gain
        if self.kind == "indentation":
            dx = dv = da = np.zeros_like(dF)
        else:
            dx, dv, da = carried(self.rig.dt, P[m.M], self.Fx, self.Fv, P[m.SP_K], dF, dB)
        add = {"force": dF + self.Fx * dx + self.Fv * dv + dchain, "acceleration": da, "penetration": dx}
        res = {c: self.data[c] - out[c] - g[c] * add[c] for c in self.chans}
        step = self.solve(self.cols, self.stack(res), self.scale, self.q)
        moved = self.cols @ step
        n = len(self.t)
        for j, c in enumerate(self.chans):
            out[c] = out[c] + g[c] * add[c] + moved[j * n:(j + 1) * n] * self.base.rig.sigma[c]
        if self.kind == "indentation":
            out["penetration"] = self.data["penetration"]
        return out

    def misfits(self, out):
        """rms over range of every channel, as the judge measures it."""
        return [float(np.sqrt(np.mean((self.data[c] - out[c]) ** 2)) / max(np.ptp(self.data[c]), 1e-300)) for c in self.rig.channels]


@njit(cache=True)
def carried(dt, mass, Fx, Fv, spring, dF, dB):
    """(dx, dv, da) of M dv' = dB - dF - (F_x + spring) dx - F_v dv from rest, by the trapezoidal rule."""
    n = len(dF)
    dx, dv, da = np.zeros(n), np.zeros(n), np.zeros(n)
    da[0] = (dB[0] - dF[0]) / mass
    for i in range(1, n):
        k, c = Fx[i] + spring, Fv[i]
        vp = dv[i - 1] + 0.5 * dt * da[i - 1]
        xp = dx[i - 1] + 0.5 * dt * dv[i - 1]
        # v = vp + dt/2 a, x = xp + dt/2 v, a = (f - k x - c v)/m
        f = dB[i] - dF[i]
        h = 0.5 * dt
        a = (f - k * (xp + h * vp) - c * vp) / (mass + c * h + k * h * h)
        dv[i] = vp + h * a
        dx[i] = xp + h * dv[i]
        da[i] = a
    return dx, dv, da


def equations(track, smooth):
    """What the recording says against the base at measured states.

    Returns x [m], v [m/s], and a list of equations (kind, y [N], sigma [N]): "contact" is the force the law misses,
    "body" the force the motion misses (M a + F less the springs).
    """
    d, b, rig = track.data, track.base, track.rig
    P, g, dt = b.P, b.gain, rig.dt
    n = len(track.t)
    if "penetration" in d and rig.kind != "indentation":
        xm = d["penetration"] / g["penetration"] - track.q[1]
        w = 9
        if smooth and n > 4 * w:
            x, v = savgol_filter(xm, w, 3), savgol_filter(xm, w, 3, deriv=1, delta=dt)
            sx = rig.sigma["penetration"] * 0.6
        else:
            x, v = xm, np.gradient(xm, dt)
            sx = rig.sigma["penetration"]
    else:
        x, v, sx = track.x, track.v, 0.0
    xp = np.maximum(x, 0.0)
    law = xp ** P[m.PW] * (P[m.K] + P[m.MU] * v)
    slope = np.where(x > 0, P[m.PW] * np.maximum(xp, 1e-12) ** (P[m.PW] - 1) * P[m.K], 0.0)
    spring = 0.0 if rig.kind != "contactor-opening" else rig.recs[0].preload - P[m.SP_K] * (x + P[m.TRAVEL])
    eqs = []
    err = np.sqrt((slope * sx) ** 2 + (SCATTER * law) ** 2)
    if "force" in d:
        f = d["force"] / g["force"]
        eqs.append(("contact", f - law, np.sqrt(rig.sigma["force"] ** 2 + err ** 2)))
        if "acceleration" in d and rig.kind != "indentation":
            a = d["acceleration"] / g["acceleration"]
            eqs.append(("body", P[m.M] * a + f - spring, np.full(n, np.hypot(rig.sigma["force"], P[m.M] * rig.sigma["acceleration"])) + 0.007 * np.abs(f)))
    elif "acceleration" in d:
        a = d["acceleration"] / g["acceleration"]
        eqs.append(("contact", spring - P[m.M] * a - law, np.sqrt((P[m.M] * rig.sigma["acceleration"]) ** 2 + err ** 2)))
    return x, v, eqs
