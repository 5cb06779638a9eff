"""The scipy side of the base fit in `touchdown bench`: the same data, noise, priors and start, given in a JSON file.

The model is a drop test: m x'' = m g - F, F = max(0, k x^p + mu x^p x') for x > 0, seen through gains and zeros,
compared through the noise's autoregression. Parameters: ln F_ref, p, mu v_ref / k, tolerances on gains and mass;
of every recording touch instant, touch speed, stiffness scatter and the zeros.

Questions on stdin, a line each; all answers are numbers, times are CPU seconds of one thread:
agree              chi^2 at the start by solve_ivp and by numba, and at the optimum, as both report it
simplex LIMIT      solve_ivp + Nelder-Mead, the law and each recording's nuisances in turns, until chi^2 is within the
                   share given of the optimum, or LIMIT s: seconds, chi^2, recordings simulated, arrived, k, p, mu
plain              least_squares as it comes (trf, two-point differences) over the numba model: seconds, chi^2, ...
structured         the same with the block structure given: sparse Jacobian, chain parameters not simulated again
"""
import json
import os
import sys
import time

for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[threads] = "1"

import numba
import numpy as np
import scipy
from scipy.integrate import RK45, solve_ivp
from scipy.optimize import least_squares, minimize
from scipy.sparse import csr_matrix, vstack

CHANNELS = 3
RUNGE = tuple(np.ascontiguousarray(a) for a in (RK45.A, RK45.B, RK45.C, RK45.E, RK45.P))
RK_A, RK_B, RK_C, RK_E, RK_P = RUNGE


class Case:
    """What is fitted."""

    def __init__(self, given):
        self.given = given
        self.goal, self.share = given["goal"], given["share"]
        self.mass, self.gravity, self.tolerance = given["mass"], given["gravity"], given["tolerance"]
        self.x_ref, self.v_ref, self.hysteresis = given["x_ref"], given["v_ref"], given["hysteresis"]
        ps = given["parameters"]
        self.names = [p["name"] for p in ps]
        self.theta0 = np.array([p["start"] for p in ps])
        self.lower, self.upper = (np.array([p[b] for p in ps]) for b in ("lower", "upper"))
        self.steps = np.array([p["step"] for p in ps])
        self.priors = [(j, *p["prior"]) for j, p in enumerate(ps) if p["prior"]]
        self.gain_at = np.array([self.find(f"ln gain {c}") for c in ("force", "acceleration", "penetration")])
        self.mass_at = self.find("ln mass")
        self.nuisances = given["nuisances"]
        self.zero_at = np.array([self.local(f"zero {c}") for c in ("force", "acceleration", "penetration")])
        self.local_steps = np.array(given["local_steps"])
        self.records = [Record(r, given) for r in given["records"]]
        self.g, self.l = len(self.theta0), len(self.nuisances)
        start = [r.start for r in self.records]
        self.x0 = np.concatenate([self.theta0, *start])
        self.scale = np.concatenate([self.steps, *([self.local_steps] * len(start))])

    def find(self, name):
        return self.names.index(name) if name in self.names else -1

    def local(self, name):
        return self.nuisances.index(name) if name in self.nuisances else -1

    def split(self, x):
        return x[: self.g], x[self.g :].reshape(len(self.records), self.l)

    def law(self, theta, stiffness=0.0):
        """(k, p, mu, m)"""
        p = theta[1]
        k = np.exp(theta[0] - p * np.log(self.x_ref) + stiffness)
        mu = theta[2] * k / self.v_ref if self.hysteresis else 0.0
        return k, p, mu, self.mass * (np.exp(theta[self.mass_at]) if self.mass_at >= 0 else 1.0)

    def global_prior(self, theta):
        return np.array([(theta[j] - mean) / sd for j, mean, sd in self.priors])

    def local_prior(self, r, local):
        out = [(local[i] - mean) / sd for i, mean, sd in r.priors]
        if r.first_speed is not None:
            mean, sd = r.first_speed
            seen = local[1] + self.gravity * min(0.0, r.time[0] - local[0])
            out.append((seen - mean) / sd)
        return np.array(out)


class Record:
    def __init__(self, r, given):
        self.time = np.array(r["time"])
        self.present = np.array([y is not None for y in r["y"]])
        self.y = np.array([y if y is not None else np.zeros(len(self.time)) for y in r["y"]])
        self.weight = np.array(r["weight"])
        self.start = np.array(r["start"])
        self.priors = [(i, *p) for i, p in enumerate(r["priors"]) if p]
        self.first_speed = r["first_speed"]
        self.depth, self.speed, self.duration = r["depth"], r["speed"], r["duration"]
        self.head = np.array(given["noise"]["head"])
        self.taps = np.array(given["noise"]["taps"])


# solve_ivp, as one first writes it


def scipy_readings(case, r, theta, local):
    k, p, mu, m = case.law(theta, local[2])
    g = case.gravity

    def force(x, v):
        return max(0.0, x**p * (k + mu * v)) if x > 0 else 0.0

    tau = r.time - local[0]
    before = tau < 0
    x, f = np.empty_like(tau), np.zeros_like(tau)
    x[before] = local[1] * tau[before] + 0.5 * g * tau[before] ** 2
    after = tau[~before]
    s = solve_ivp(
        lambda _, y: [y[1], g - force(y[0], y[1]) / m], (0.0, after[-1]), [0.0, local[1]], t_eval=after,
        rtol=case.tolerance, atol=[case.tolerance * r.depth, case.tolerance * r.speed],
    )
    x[~before] = s.y[0]
    f[~before] = [force(a, b) for a, b in s.y.T]
    return np.array([f, -f / m, x])


def scipy_chi2(case, r, theta, local):
    z = scipy_readings(case, r, theta, local)
    total = np.sum(case.local_prior(r, local) ** 2)
    for c in range(CHANNELS):
        if not r.present[c]:
            continue
        gain = np.exp(theta[case.gain_at[c]]) if case.gain_at[c] >= 0 else 1.0
        zero = local[case.zero_at[c]] if case.zero_at[c] >= 0 else 0.0
        e = (r.y[c] - gain * z[c] - zero) * r.weight[c]
        n = len(r.taps[c]) - 1
        w = np.convolve(e, r.taps[c])[: len(e)]
        w[:n] = r.head[c] @ e[:n]
        total += w @ w
    return total


def simplex(case, limit):
    """Nelder-Mead in turns. The clock stops as soon as chi^2 is near enough, wherever the simplex then is."""
    theta, locals_ = case.theta0.copy(), [r.start.copy() for r in case.records]
    count = 0
    began = time.process_time()

    class Enough(Exception):
        pass

    parts = np.array([scipy_chi2(case, r, theta, l) for r, l in zip(case.records, locals_)])

    def check(chi2):
        if chi2 <= case.goal * (1 + case.share) or time.process_time() - began > limit:
            raise Enough

    def law_cost(th):
        nonlocal count, theta, parts
        if np.any(th < case.lower) or np.any(th > case.upper):
            return np.inf
        each = np.array([scipy_chi2(case, r, th, l) for r, l in zip(case.records, locals_)])
        count += len(each)
        prior = np.sum(case.global_prior(th) ** 2)
        if each.sum() + prior < parts.sum() + np.sum(case.global_prior(theta) ** 2):
            theta, parts = th.copy(), each
            check(each.sum() + prior)
        check(np.inf)
        return each.sum() + prior

    def local_cost(l, n):
        nonlocal count
        count += 1
        one = scipy_chi2(case, case.records[n], theta, l)
        if one < parts[n]:
            parts[n], locals_[n] = one, l.copy()
            check(parts.sum() + np.sum(case.global_prior(theta) ** 2))
        check(np.inf)
        return one

    def around(x, steps):
        return np.vstack([x, x + np.diag(steps)])

    total = np.inf
    try:
        while True:
            for n in range(len(locals_)):
                minimize(local_cost, locals_[n], args=(n,), method="Nelder-Mead",
                         options={"initial_simplex": around(locals_[n], 10 * case.local_steps), "fatol": 0.1, "xatol": np.inf})
            minimize(law_cost, theta, method="Nelder-Mead",
                     options={"initial_simplex": around(theta, 10 * case.steps), "fatol": 0.1, "xatol": np.inf})
            now = parts.sum() + np.sum(case.global_prior(theta) ** 2)
            if now > total * (1 - 1e-5):
                break
            total = now
    except Enough:
        pass
    seconds = time.process_time() - began
    total = parts.sum() + np.sum(case.global_prior(theta) ** 2)
    k, p, mu, _ = case.law(theta)
    return seconds, total, count, int(total <= case.goal * (1 + case.share)), k, p, mu


# the numba model


@numba.njit(cache=False, fastmath=False)
def push(x, v, k, p, mu):
    if x <= 0.0:
        return 0.0
    return max(0.0, x**p * (k + mu * v))


@numba.njit
def flight(t, start, speed, k, p, mu, m, g, tolerance, depth, scale, duration, z):
    """Dormand and Prince 5(4), dense output of fourth order; free flight before and after contact in closed form."""
    n = len(t)
    i = 0
    while i < n and t[i] < start:
        tau = t[i] - start
        z[0, i], z[1, i], z[2, i] = 0.0, 0.0, tau * (speed + 0.5 * g * tau)
        i += 1
    end = t[n - 1] - start
    x, v, now, h = 0.0, speed, 0.0, 0.02 * duration
    kx, kv = np.empty(7), np.empty(7)
    kx[0], kv[0] = v, g - push(x, v, k, p, mu) / m
    touched = False
    for _ in range(100000):
        if i >= n:
            return True
        if touched and x <= 0.0 and v < 0.0 and x + (end - now) * (v + 0.5 * g * (end - now)) <= 0.0:
            while i < n:
                tau = t[i] - start - now
                z[0, i], z[1, i], z[2, i] = 0.0, 0.0, x + tau * (v + 0.5 * g * tau)
                i += 1
            return True
        for s in range(1, 6):
            dx, dv = 0.0, 0.0
            for j in range(s):
                dx += RK_A[s, j] * kx[j]
                dv += RK_A[s, j] * kv[j]
            xs, vs = x + h * dx, v + h * dv
            kx[s], kv[s] = vs, g - push(xs, vs, k, p, mu) / m
        dx, dv = 0.0, 0.0
        for j in range(6):
            dx += RK_B[j] * kx[j]
            dv += RK_B[j] * kv[j]
        x1, v1 = x + h * dx, v + h * dv
        kx[6], kv[6] = v1, g - push(x1, v1, k, p, mu) / m
        ex, ev = 0.0, 0.0
        for j in range(7):
            ex += RK_E[j] * kx[j]
            ev += RK_E[j] * kv[j]
        error = max(abs(h * ex) / (tolerance * depth), abs(h * ev) / (tolerance * scale))
        if error > 1.0:
            h *= max(0.2, 0.9 * error**-0.2)
            continue
        while i < n and t[i] - start <= now + h * (1 + 1e-12):
            u = (t[i] - start - now) / h
            xi, vi = x, v
            for j in range(7):
                b = u * (RK_P[j, 0] + u * (RK_P[j, 1] + u * (RK_P[j, 2] + u * RK_P[j, 3])))
                xi += h * b * kx[j]
                vi += h * b * kv[j]
            f = push(xi, vi, k, p, mu)
            z[0, i], z[1, i], z[2, i] = f, -f / m, xi
            i += 1
        touched = touched or x1 > 0.0
        x, v, now = x1, v1, now + h
        kx[0], kv[0] = kx[6], kv[6]
        h *= min(5.0, 0.9 * max(error, 1e-4) ** -0.2)
        h = min(h, max(end - now, 1e-12)) if now < end else h
    return False


@numba.njit
def whiten(e, head, taps, out):
    n = len(taps) - 1
    for i in range(min(n, len(e))):
        s = 0.0
        for j in range(i + 1):
            s += head[i, j] * e[j]
        out[i] = s
    for i in range(n, len(e)):
        s = 0.0
        for j in range(n + 1):
            s += taps[j] * e[i - j]
        out[i] = s


@numba.njit
def numba_residual(z, y, weight, present, gains, zeros, head, taps, out):
    n, at = y.shape[1], 0
    e = np.empty(n)
    for c in range(3):
        if present[c]:
            for i in range(n):
                e[i] = (y[c, i] - gains[c] * z[c, i] - zeros[c]) * weight[c, i]
            whiten(e, head[c], taps[c], out[at : at + n])
            at += n


def chain(case, theta, local):
    gains = np.array([np.exp(theta[a]) if a >= 0 else 1.0 for a in case.gain_at])
    zeros = np.array([local[a] if a >= 0 else 0.0 for a in case.zero_at])
    return gains, zeros


def numba_trace(case, r, theta, local):
    z = np.empty((CHANNELS, len(r.time)))
    k, p, mu, m = case.law(theta, local[2])
    flight(r.time, local[0], local[1], k, p, mu, m, case.gravity, case.tolerance, r.depth, r.speed, r.duration, z)
    return z


def against(case, r, z, theta, local, y):
    out = np.empty(r.present.sum() * len(r.time))
    numba_residual(z, y, r.weight, r.present, *chain(case, theta, local), r.head, r.taps, out)
    return out


def residuals(case, x):
    theta, locals_ = case.split(x)
    out = [against(case, r, numba_trace(case, r, theta, l), theta, l, r.y) for r, l in zip(case.records, locals_)]
    out.append(case.global_prior(theta))
    out.extend(case.local_prior(r, l) for r, l in zip(case.records, locals_))
    return np.concatenate(out)


class Structured:
    """The Jacobian with its blocks: a recording's rows depend on the globals and on its own nuisances."""

    def __init__(self, case):
        self.case = case
        g, l = case.g, case.l
        indices, pointers = [], [0]
        for n, r in enumerate(case.records):
            rows = r.present.sum() * len(r.time)
            own = np.concatenate([np.arange(g), g + n * l + np.arange(l)])
            indices.append(np.tile(own, rows))
            pointers.extend(pointers[-1] + (g + l) * np.arange(1, rows + 1))
        self.indices, self.pointers = np.concatenate(indices), np.array(pointers)
        base = residuals(case, case.x0)
        count = len(pointers) - 1
        rows = []
        for j in range(len(case.x0)):
            x = case.x0.copy()
            x[j] += case.scale[j]
            theta, locals_ = case.split(x)
            p = [case.global_prior(theta)] + [case.local_prior(r, v) for r, v in zip(case.records, locals_)]
            rows.append((np.concatenate(p) - base[count:]) / case.scale[j])
        self.prior = csr_matrix(np.array(rows).T)

    def __call__(self, x):
        case = self.case
        theta, locals_ = case.split(x)
        blocks = []
        for r, l in zip(case.records, locals_):
            z = numba_trace(case, r, theta, l)
            none = np.zeros_like(r.y)
            base = against(case, r, z, theta, l, none)
            columns = np.empty((case.g + case.l, len(base)))
            for j in range(case.g):
                h = case.steps[j]
                th = theta.copy()
                th[j] += h
                again = z if j in case.gain_at else numba_trace(case, r, th, l)
                columns[j] = (against(case, r, again, th, l, none) - base) / h
            for j in range(case.l):
                h = case.local_steps[j]
                v = l.copy()
                v[j] += h
                again = z if j in case.zero_at else numba_trace(case, r, theta, v)
                columns[case.g + j] = (against(case, r, again, theta, v, none) - base) / h
            blocks.append(columns.T.ravel())
        shape = (len(self.pointers) - 1, len(x))
        return vstack([csr_matrix((np.concatenate(blocks), self.indices, self.pointers), shape=shape), self.prior], "csr")


def squares(case, **how):
    began = time.process_time()
    s = least_squares(lambda x: residuals(case, x), case.x0, x_scale=case.scale, ftol=1e-5, xtol=1e-10, gtol=None, **how)
    seconds = time.process_time() - began
    theta, _ = case.split(s.x)
    k, p, mu, _ = case.law(theta)
    chi2 = 2 * s.cost
    return seconds, chi2, s.nfev, int(chi2 <= case.goal * (1 + case.share)), k, p, mu


def agree(case):
    best = np.concatenate([case.given["optimum"]["theta"], *case.given["optimum"]["locals"]])
    out = []
    for x in (case.x0, best):
        theta, locals_ = case.split(x)
        one = sum(scipy_chi2(case, r, theta, l) for r, l in zip(case.records, locals_))
        out += [one + np.sum(case.global_prior(theta) ** 2), np.sum(residuals(case, x) ** 2)]
    return out


def main():
    with open(sys.argv[1]) as f:
        case = Case(json.load(f))
    structure = Structured(case)
    structure(case.x0)  # compiles
    print(f"scipy {scipy.__version__}, numba {numba.__version__}", flush=True)
    for question in sys.stdin:
        word, _, rest = question.strip().partition(" ")
        if word == "agree":
            answer = agree(case)
        elif word == "simplex":
            answer = simplex(case, float(rest))
        elif word == "plain":
            answer = squares(case)
        elif word == "structured":
            answer = squares(case, jac=structure, tr_solver="lsmr")
        else:
            raise SystemExit(f"{word}: no such question")
        print(*(float(a) for a in answer), flush=True)


main()
