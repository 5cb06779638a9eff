"""The same cases in other hands: plain recalibration, PySINDy, gplearn and a Gaussian process, naive and tuned.

Each is given the case's recordings, the base calibrated with every nuisance (but the naive recalibration, which has
none) and the noise of every channel as the label has it. The held-out measure is the diagnosis': every level predicted
by what was learnt from the others. Where a method gives no names, none are counted; a tuned one may take the name of
the physical term its force resembles most.
"""
import json
import time
import warnings

import numpy as np

from . import beside_terms as terms
from .beside_base import Base, Track, equations, load, part
from .generate import jsonable
from .judge import TIES

NOTES = [
    "All but touchdown are given the true standard deviation of every channel's noise; touchdown has to learn it.",
    "Plain recalibration is made to fit, not to say why: it gives no names. Naive: time offsets only, judged by R² under 0.99. Tuned: every nuisance and tolerance, judged by chi² per sample over 1.25.",
    "PySINDy is made to find sparse equations from trajectories, not to see through sensors or calibrated-away effects: naive is its polynomial library of third order on finite differences; tuned is a library of physical terms with the base's own freedom projected out, rows weighted by noise, threshold chosen by BIC, and has to predict held-out levels better.",
    "gplearn is made to find short formulas, with no notion of noise or mechanism: naive is its default functions on x and v; tuned has physical inputs, noise weights and parsimony, has to predict held-out levels better, and takes the name of the term it resembles. Populations are small (200, ten generations) to end in seconds; more would cost minutes a case.",
    "A Gaussian process on the residual is made to predict, not to name: naive is scikit-learn's default kernel; tuned has a length scale for each input and the noise fixed, has to predict held-out levels better, and takes the name of the term it resembles.",
    "Forces found are carried through the equation of motion to first order along the base's trajectory. 'Detected' counts hidden effects, 'named' single effects whose name alone was given (ties held open count as right, as for touchdown).",
]
CHI_LIMIT = 1.25       # chi² per sample over which a tuned recalibration calls a mismatch: repeat scatter alone reaches 1.2
BETTER = 0.97          # a tuned method calls a mismatch if it cuts the held-out misfit to this share or less


class Fold:
    """Base calibrated without one level, its tracks, and the tracks of the level held out along it."""

    def __init__(self, rig, data, out_level, tuned=True, whole=None):
        keep = [i for i, r in enumerate(rig.recs) if r.level != out_level]
        self.base = Base(*part(rig, data, keep), tuned=tuned, starts=(whole.without(keep), None) if whole else (None,))
        self.train = [Track(self.base, *part(rig, data, [i])) for i in keep] if tuned else []
        self.held = [Track(self.base, *part(rig, data, [i])) for i, r in enumerate(rig.recs) if r.level == out_level]


class Case:
    """One case made ready once for all tuned methods; `seconds` is the processor time that took."""

    def __init__(self, folder, noise):
        t0 = time.process_time()
        self.rig, self.data = load(folder, noise)
        self.all = Base(self.rig, self.data)
        self.tracks = [Track(self.all, *part(self.rig, self.data, [i])) for i in range(len(self.data))]
        self.levels = sorted({r.level for r in self.rig.recs})
        self.folds = [Fold(self.rig, self.data, lv, whole=self.all) for lv in self.levels]
        self.before = float(np.mean([q for f in self.folds for t in f.held for q in t.misfits(t.corrected(*(np.zeros(len(t.t)),) * 3))]))
        self.seconds = time.process_time() - t0

    def held_out(self, learn):
        """Held-out misfit of a method: learn(tracks) gives forces(track) -> (dF, dB, dchain)."""
        parts = []
        for f in self.folds:
            forces = learn(f.train)
            for t in f.held:
                parts += t.misfits(t.corrected(*forces(t)))
        return float(np.mean(parts))


def none(track):
    z = np.zeros(len(track.t))
    return z, z, z


def recalibration_naive(c):
    """As first written: k, p, mu_d and a time offset; good enough if R² says so."""
    full = Base(c.rig, c.data, tuned=False)
    parts = []
    for lv in c.levels:
        f = Fold(c.rig, c.data, lv, tuned=False)
        for t in f.held:
            parts += t.misfits({k: t.s[k] for k in t.rig.channels})
    return dict(detected=full.fit.r2 < 0.99, names=[], also=[], after=float(np.mean(parts)))


def recalibration_tuned(c):
    chi = np.mean(np.concatenate([(t.data[k] - t.s[k]) / c.rig.sigma[k] for t in c.tracks for k in t.chans]) ** 2)
    return dict(detected=bool(chi > CHI_LIMIT), names=[], also=[], after=c.before)


def pysindy_naive(c):
    """PySINDy as its manual starts: states x and v, finite differences, polynomials to third order, STLSQ at 0.1."""
    import pysindy as ps
    xr, vr = c.rig.ref["x"], c.rig.ref["v"]

    def learn(tracks):
        xs, dots = [], []
        for t in tracks:
            x, v, eqs = equations(t, smooth=False)
            y = eqs[0][1] / c.rig.ref["Fmax"]
            keep = x > 0
            if keep.sum() > 5:
                xs.append(np.stack([x / xr, v / vr], 1)[keep])
                dots.append(np.stack([v / vr, y], 1)[keep])
        model = ps.SINDy(optimizer=ps.STLSQ(threshold=0.1), feature_library=ps.PolynomialLibrary(degree=3))
        model.fit(xs, t=c.rig.dt, x_dot=dots)
        co = model.coefficients()[1]
        learn.names = [(n, float(q)) for n, q in zip(model.get_feature_names(), co) if q != 0.0]

        def forces(t):
            f = np.asarray(model.predict(np.stack([t.x / xr, t.v / vr], 1)))[:, 1] * c.rig.ref["Fmax"]
            z = np.zeros(len(t.t))
            return np.where(t.x > 0, f, 0.0), z, z
        return forces
    after = c.held_out(learn)
    learn(c.tracks)
    called = {"1": "adhesion", "x1": "viscous_damping", "x0 x1": "hysteresis_damping", "x0^2 x1": "hysteresis_damping", "x1^2": "fluid_drag",
              "x0^2": "secondary_stiffening", "x0^3": "secondary_stiffening"}
    names = []
    for n, _ in sorted(learn.names, key=lambda q: -abs(q[1])):
        if n in called and called[n] not in names:
            names.append(called[n])
    return dict(detected=bool(learn.names), names=names, also=[], after=after)


def pysindy_tuned(c):
    """PySINDy's STLSQ on a library of physical terms, the base's freedom projected out; threshold by BIC."""
    import pysindy as ps

    def select(tracks):
        A, y, own = terms.stacked(tracks)
        A, y = terms.without(A, y, own)
        size = np.sqrt((A ** 2).mean(0)) + 1e-300
        live = size > 1e-6
        B = A[:, live] / size[live]
        best = (len(y) * np.log(np.mean(y ** 2)), np.zeros(live.sum()))
        for threshold in (0.02, 0.04, 0.08, 0.16, 0.32, 0.64):
            opt = ps.STLSQ(threshold=threshold, alpha=1e-4, max_iter=30)
            co = np.ravel(opt.fit(B, y[:, None]).coef_)
            k = int((co != 0).sum())
            bic = len(y) * np.log(np.mean((y - B @ co) ** 2)) + 4 * k * np.log(len(y))
            if bic < best[0]:
                best = (bic, co)
        full = np.zeros(A.shape[1])
        full[live] = best[1] / size[live]
        return full, np.abs(full * size)

    def learn(tracks):
        co, _ = select(tracks)
        return lambda t: terms.force_of(t, co)
    after = c.held_out(learn)
    co, weight = select(c.tracks)
    found = bool((co != 0).any()) and after < BETTER * c.before
    names, also = terms.names_of(c.tracks[0], co, weight) if found else ([], [])
    return dict(detected=found, names=names, also=also, after=after if found else c.before)


def points(tracks, kind, smooth, limit, rng, extra=False):
    """Inputs (in reference units), target and its sigma of one equation, thinned to `limit` points."""
    X, y, s = [], [], []
    for t in tracks:
        x, v, eqs = equations(t, smooth)
        for k, yy, ss in eqs:
            if k == kind:
                keep = x > 0 if kind == "contact" else np.ones(len(x), bool)
                X.append(terms.inputs(t, x, v, extra)[keep])
                y.append(yy[keep])
                s.append(ss[keep])
    X, y, s = np.concatenate(X), np.concatenate(y), np.concatenate(s)
    pick = rng.permutation(len(y))[:limit]
    return X[pick], y[pick], s[pick]


def worst_equation(c, smooth):
    """The equation whose residual is furthest over its noise, and by how much (chi² a sample)."""
    chi = {}
    for t in c.tracks:
        x, _, eqs = equations(t, smooth)
        for k, y, s in eqs:
            keep = x > 0 if k == "contact" else slice(None)
            chi.setdefault(k, []).append(np.mean((y[keep] / s[keep]) ** 2) if np.any(x > 0) else 0.0)
    k = max(chi, key=lambda q: np.mean(chi[q]))
    return k, float(np.mean(chi[k]))


def regressor(c, make, smooth, limit, extra, tuned):
    """A regression of the worst equation's force on x, v (and more): detection, name by resemblance, held-out misfit."""
    kind, _ = worst_equation(c, smooth)

    def learn(tracks):
        X, y, s = points(tracks, kind, smooth, limit, np.random.default_rng(7), extra)
        f = make(X, y / c.rig.ref["Fmax"], s / c.rig.ref["Fmax"])
        learn.drop = 1 - np.mean((y / c.rig.ref["Fmax"] - f(X)) ** 2) / max(np.mean((y / c.rig.ref["Fmax"]) ** 2), 1e-300)

        def forces(t):
            q = f(terms.inputs(t, t.x, t.v, extra)) * c.rig.ref["Fmax"]
            z = np.zeros(len(t.t))
            return (np.where(t.x > 0, q, 0.0), z, z) if kind == "contact" else (z, q, z)
        return forces
    after = c.held_out(learn)
    forces = learn(c.tracks)
    if not tuned:
        return dict(detected=bool(learn.drop > 0.05), names=[], also=[], after=after)
    found = after < BETTER * c.before
    names, also = terms.resembles(c.tracks, forces, kind) if found else ([], [])
    return dict(detected=found, names=names, also=also, after=after if found else c.before)


def gplearn_with(c, tuned):
    from gplearn.genetic import SymbolicRegressor
    more = dict(function_set=("add", "sub", "mul", "div", "sqrt", "abs", "max", "min"), parsimony_coefficient=0.002) if tuned else {}

    def make(X, y, s):
        g = SymbolicRegressor(population_size=200, generations=10, random_state=1, n_jobs=1, **more)
        scale = y.std() + 1e-300
        g.fit(X, y / scale, **({"sample_weight": (s.mean() / s) ** 2} if tuned else {}))
        return lambda Z: np.nan_to_num(g.predict(Z)) * scale
    return regressor(c, make, tuned, 600, tuned, tuned)


def gaussian_with(c, tuned):
    from sklearn.gaussian_process import GaussianProcessRegressor
    from sklearn.gaussian_process.kernels import RBF, ConstantKernel

    def make(X, y, s):
        if tuned:
            kernel = ConstantKernel(np.var(y) + 1e-12, (1e-14, 1e4)) * RBF(np.full(X.shape[1], 0.5), (0.03, 30))
            g = GaussianProcessRegressor(kernel=kernel, alpha=s ** 2)
        else:
            g = GaussianProcessRegressor(kernel=RBF(1.0), alpha=1e-6, normalize_y=True)
        g.fit(X, y)
        return g.predict
    return regressor(c, make, tuned, 250, tuned, tuned)


METHODS = [
    ("plain recalibration", "naive", recalibration_naive), ("plain recalibration", "tuned", recalibration_tuned),
    ("PySINDy", "naive", pysindy_naive), ("PySINDy", "tuned", pysindy_tuned),
    ("gplearn", "naive", lambda c: gplearn_with(c, False)), ("gplearn", "tuned", lambda c: gplearn_with(c, True)),
    ("Gaussian process", "naive", lambda c: gaussian_with(c, False)), ("Gaussian process", "tuned", lambda c: gaussian_with(c, True)),
]


def right_name(truth, names, also):
    """Whether the names given are the one that is hidden; of a tie, either with the other held open."""
    if len(truth) != 1 or len(names) != 1:
        return False
    if names == truth:
        return True
    return any(truth[0] in t and names[0] in t and truth[0] in also for t in TIES)


def score(rows, answers, name, settings):
    """One line of the table from {case: dict(detected, names, also, after, seconds)}."""
    null = [r for r in rows if r["group"] == "null"]
    hid = [r for r in rows if r["truth"]]
    one = [r for r in hid if r["group"] in ("plain", "concealed", "deep", "faint")]
    gains = []
    for r in hid:
        if r["group"] == "concealed" and r["before"] and r["before"] > 1.02 * r["oracle"] and answers[r["case"]]["after"] is not None:
            gains.append((r["before"] - answers[r["case"]]["after"]) / (r["before"] - r["oracle"]))
    return dict(name=name, settings=settings, nulls=len(null), alarms=sum(answers[r["case"]]["detected"] for r in null), effects=len(hid),
                detected=sum(answers[r["case"]]["detected"] for r in hid), singles=len(one),
                named=sum(right_name(r["truth"], answers[r["case"]]["names"], answers[r["case"]]["also"]) for r in one),
                first=sum(bool(answers[r["case"]]["names"]) and right_name(r["truth"], answers[r["case"]]["names"][:1], answers[r["case"]]["also"]) for r in one),
                gain=float(np.median(gains)) if gains else None, seconds=float(np.median([answers[r["case"]]["seconds"] for r in rows])))


def each(folder, noise):
    """Every method's answer to one case, by "name, settings"."""
    c, answers = Case(folder, noise), {}
    for n, s, run in METHODS:
        t1 = time.process_time()
        try:
            a = run(c)
        except (ArithmeticError, ValueError, np.linalg.LinAlgError) as e:
            a = dict(detected=False, names=[], also=[], after=c.before, failed=str(e)[:200])
        a["seconds"] = time.process_time() - t1 + (0.0 if n == "plain recalibration" and s == "naive" else c.seconds)
        answers[f"{n}, {s}"] = a
    return answers


def compare(out, rows, progress):
    """Every method on the given cases of `out`: table, notes and all answers."""
    warnings.filterwarnings("ignore")
    kept = out / "beside-answers.json"                   # what was answered before stays over Ctrl-C
    done = json.loads(kept.read_text()) if kept.exists() else {}
    t0 = time.monotonic()
    for i, r in enumerate(rows):
        if r["case"] not in done:
            done[r["case"]] = each(out / "open" / r["case"], json.loads((out / "truth" / f"{r['case']}.json").read_text())["noise"])
            temp = kept.with_suffix(".part")
            temp.write_text(json.dumps(jsonable(done)))
            temp.replace(kept)
        progress(i + 1, len(rows), t0, "beside")
    answers = {(n, s): {r["case"]: done[r["case"]][f"{n}, {s}"] for r in rows} for n, s, _ in METHODS}
    own = {r["case"]: dict(detected=r["detected"], names=r["named"], also=r["also"], after=r["after"], seconds=r["cpu"]) for r in rows}
    table = [score(rows, own, "touchdown", "as it is")] + [score(rows, answers[n, s], n, s) for n, s, _ in METHODS]
    return dict(cases=len(rows), methods=table, notes=NOTES, answers={f"{n}, {s}": a for (n, s), a in answers.items()})
