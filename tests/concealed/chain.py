"""Measuring chain: what the sensors make of clean signals on an even time grid."""
from functools import lru_cache

import numpy as np
from scipy import signal
from scipy.interpolate import CubicSpline


@lru_cache(maxsize=64)
def _discrete(kind, order, w):
    """Exact first-order-hold discretisation of an analogue filter with corner w = omega * dt (dimensionless)."""
    if kind == "lag":
        b, a = signal.butter(order, w, "low", analog=True)
    elif kind == "bessel":
        b, a = signal.bessel(order, w, "low", analog=True, norm="phase")
    elif kind == "rc":
        b, a = np.poly1d([1.0]), np.poly1d([1.0 / w, 1.0]) ** order
        b, a = b.coeffs, a.coeffs
    else:                                           # droop: order RC stages
        b, a = (np.poly1d([1.0 / w, 0.0]) ** order).coeffs, (np.poly1d([1.0 / w, 1.0]) ** order).coeffs
    bd, ad, _ = signal.cont2discrete((np.atleast_1d(b), np.atleast_1d(a)), 1.0, "foh")
    return np.ravel(bd), np.ravel(ad)


def filtered(y, dt, kind, order, corner):
    """y [any] through a filter of corner angular frequency `corner` [rad/s], settled on its first value before."""
    b, a = _discrete(kind, order, float(corner * dt))
    start = 0.0 if kind == "droop" else y[0]
    return start + signal.lfilter(b, a, y - start)


@lru_cache(maxsize=64)
def _resonant(w, zeta):
    bd, ad, _ = signal.cont2discrete(([w * w], [1.0, 2.0 * zeta * w, w * w]), 1.0, "foh")
    return np.ravel(bd), np.ravel(ad)


def shifted(y, dt, by, drift=0.0):
    """y(t - by - drift t): a channel that comes `by` seconds late, by a clock that may run at another rate."""
    t = np.arange(len(y)) * dt
    return CubicSpline(t, y)(np.clip(t - by - drift * t, t[0], t[-1]))


def played(y, width):
    """A pick-up with play: follows only once the slack of `width` is taken up (Prandtl's play operator)."""
    out = np.empty(len(y))
    at = y[0] - 0.5 * width                  # the first motion is upwards: the slack is already taken up
    for i, v in enumerate(y):
        at = min(max(at, v - 0.5 * width), v + 0.5 * width)
        out[i] = at
    return out


def slewed(y, dt, steepest):
    """An amplifier whose output changes by no more than `steepest` [units of y per s]."""
    out, most = np.empty(len(y)), steepest * dt
    at = y[0]
    for i, v in enumerate(y):
        at += min(max(v - at, -most), most)
        out[i] = at
    return out


def clipped(y, limit, soft, dt=1.0):
    """Clipping at +-limit; soft: True for a knee that starts at 85 % of the limit and saturates at it, or the time [s]
    an overloaded amplifier takes to let go, or (share, time [s]) by which the limit gives way under overload."""
    if soft is False:
        return np.clip(y, -limit, limit)
    if isinstance(soft, tuple):
        (share, time), out, since = soft, np.array(y, dtype=float), 0.0
        for i, v in enumerate(y):
            since = since + dt if abs(v) > limit else 0.0
            if since:
                out[i] = np.sign(v) * limit * (1.0 - share * (1.0 - np.exp(-since / time)))
        return out
    if soft is not True:
        out = np.clip(y, -limit, limit)
        n = max(int(round(soft / dt)), 1)
        for i in np.flatnonzero((np.abs(y[:-1]) > limit) & (np.abs(y[1:]) <= limit)):
            out[i + 1:i + 1 + n] = np.sign(y[i]) * limit
        return out
    knee = 0.85 * limit
    over = np.abs(y) - knee
    return np.where(over > 0, np.sign(y) * (knee + (limit - knee) * np.tanh(over / (limit - knee))), y)


def through(sig, dt, chain):
    """Clean channels `sig` of one recording through the chain, clipping excepted (it needs the campaign's range)."""
    out = dict(sig)
    if "resonance" in chain:
        f, zeta = chain["resonance"]
        b, a = _resonant(float(2 * np.pi * f * dt), zeta)
        u = out["force"]
        out["force"] = signal.lfilter(b, a, u)
        modes = chain.get("modes", ())
        out["force"] = (1 - sum(share for _, share in modes)) * out["force"]
        for apart, share in modes:
            b, a = _resonant(float(2 * np.pi * f * apart * dt), zeta)
            out["force"] = out["force"] + share * signal.lfilter(b, a, u)
    if "bracket" in chain:                   # the displacement sensor's holder gives under the force
        give, f, zeta = chain["bracket"]
        b, a = _resonant(float(2 * np.pi * f * dt), zeta)
        out["penetration"] = out["penetration"] + give * signal.lfilter(b, a, sig["force"])
    for c, share, f, zeta in chain.get("ringing", ()):        # small modes of the structure, read besides
        b, a = _resonant(float(2 * np.pi * f * dt), zeta)
        out[c] = out[c] + share * (signal.lfilter(b, a, sig["force"]) - sig["force"])
    for c, (bend, ref) in chain.get("straight", {}).items():
        out[c] = out[c] + bend * out[c] * np.abs(out[c]) / ref
    if "rub" in chain:
        share, width = chain["rub"]
        out["force"] = (1 - share) * out["force"] + share * played(out["force"], width)
    if "zero_shift" in chain:
        ch, by, rise = chain["zero_shift"]
        after = (np.arange(len(out[ch])) - int(np.argmax(np.abs(out[ch])))) * dt
        out[ch] = out[ch] + by * (1 - np.exp(-np.maximum(after, 0.0) / rise))
    if "lost" in chain:
        ch, at, by = chain["lost"]
        t = np.arange(len(out[ch])) * dt
        out[ch] = np.where(t < at, out[ch], shifted(out[ch], dt, -by))
    if "echo" in chain:
        share, late = chain["echo"]
        out["force"] = out["force"] + share * shifted(out["force"], dt, late)
    if "wobble" in chain:
        by, period, phase = chain["wobble"]
        t = np.arange(len(out["force"])) * dt
        out["force"] = CubicSpline(t, out["force"])(np.clip(t - by * np.sin(2 * np.pi * t / period + phase), t[0], t[-1]))
    if "dead" in chain:
        out["force"] = np.sign(out["force"]) * np.maximum(np.abs(out["force"]) - chain["dead"], 0.0)
    if "slew" in chain:
        out["force"] = slewed(out["force"], dt, chain["slew"])
    if "gain" in chain:
        out["force"] = out["force"] * chain["gain"]
    if "droop" in chain:
        ch, order, tau = chain["droop"]
        share = chain.get("droop_share", 1.0)
        out[ch] = share * filtered(out[ch], dt, "droop", order, 1.0 / tau) + (1 - share) * out[ch]
        if "second_droop" in chain:
            out[ch] = filtered(out[ch], dt, "droop", order, 1.0 / (chain["second_droop"] * tau))
    if "lowpass" in chain:
        ch, kind, order, corner = chain["lowpass"]
        out[ch] = filtered(out[ch], dt, kind, order, corner)
    if "skew" in chain:
        ch, by = chain["skew"]
        out[ch] = shifted(out[ch], dt, by, chain.get("skew_drift", 0.0))
    if "play" in chain:
        out["penetration"] = played(out["penetration"], chain["play"])
    if "bent" in chain:
        x = out["penetration"]
        out["penetration"] = x + chain["bent"] * x * np.abs(x) / chain["bent_ref"]
    return out


def noise(rng, n, sigma, rho):
    """AR(1) noise of standard deviation sigma and lag-one correlation rho."""
    e = rng.standard_normal(n) * sigma * np.sqrt(1 - rho * rho)
    e[0] = rng.standard_normal() * sigma
    return signal.lfilter([1.0], [1.0, -rho], e)


def hostile(rng, n, sigma, wander, spikes):
    """Slow wander (a smoothed random walk) and single-sample spikes, both in units of the noise."""
    y = np.zeros(n)
    if wander:
        knots = np.cumsum(rng.standard_normal(8))
        w = CubicSpline(np.linspace(0, n - 1, 8), knots - knots.mean())(np.arange(n))
        y += w / max(w.std(), 1e-9) * sigma * rng.uniform(0.3, 0.9)
    if spikes:
        for i in rng.integers(0, n, rng.integers(1, 6)):
            y[i] += rng.choice([-1, 1]) * rng.uniform(4, 9) * sigma
    return y


def hum(rng, n, dt, amplitude, mains):
    """Mains hum: `mains` [Hz], its third and fifth harmonic, of another phase each time; amplitude in units of the channel."""
    t = np.arange(n) * dt
    return sum(amplitude * share * np.sin(2 * np.pi * mains * k * t + rng.uniform(0, 2 * np.pi)) for k, share in ((1, 1.0), (3, 0.35), (5, 0.15)))


def drifted(rng, n, amplitude):
    """A slow drift over the recording: a line and an arc, nothing at its beginning."""
    u = np.linspace(0, 1, n)
    return amplitude * (rng.uniform(-1, 1) * u + rng.uniform(-1, 1) * u * u)
