"""What a real recording, a second sensor or an exchanged part gives without any model, beside what the diagnosis says of it.

Each figure is read off the recordings by itself: a peak by the sensor that did not clip, a natural frequency by the spectrum
of what rings on after the pulse, a permanent set by where the force ends, a loss by the area of a loop, a pull by how far the
force goes below its baseline. The diagnosis gives the same figure, read in the same way, by the parameters of what it named, each
with its 95 % interval.
"""
import itertools
from typing import NamedTuple

import numpy as np

from .judge import files, si


class Figure(NamedTuple):
    """One figure: `independent` as read off the recordings, `said` by the diagnosis from `low` to `high` (95 %); None: not reported."""
    campaign: str
    what: str
    unit: str
    independent: float
    said: float | None = None
    low: float | None = None
    high: float | None = None

    @property
    def error(self):
        """Relative error of what is said."""
        return None if self.said is None else self.said / self.independent - 1

    @property
    def holds(self):
        """Whether the interval holds the independent figure."""
        return None if self.said is None else self.low <= self.independent <= self.high


ENDED = 0.02        # share of its peak at which a force has ended: what is read is deeper than the set by the last 2 % of the way back


def set_left(a):
    """Depth at which the force has ended on the way back, over the deepest point; None where it does not come back."""
    f, x = a["force"], a["penetration"]
    top = int(np.argmax(f))
    back = np.flatnonzero(f[top:] < ENDED * f[top])
    return float(x[top + back[0]] / x.max()) if len(back) and x.max() > 0 else None


def work_lost(a):
    """Share of the work of the way in that the way out does not give back: area of the loop of force over penetration."""
    f, x = a["force"], a["penetration"]
    top = int(np.argmax(x))
    return float(1 + np.trapezoid(f[top:], x[top:]) / np.trapezoid(f[:top + 1], x[:top + 1]))


def below(a):
    """(deepest pull while leaving, below the baseline before touch; standard deviation of that baseline; peak above it), N."""
    f, x = a["force"], a["penetration"]
    top = int(np.argmax(f))
    base = f[:max(int(np.argmax(x > 0)) // 2, 5)]
    return float(base.mean() - f[top:].min()), float(base.std()), float(f[top] - base.mean())


def peak(a, c="acceleration"):
    return float(np.abs(a[c]).max())


def named(verdict, mechanism):
    """The entry of `mechanism` in the verdict, or None."""
    return next((m for m in verdict.get("missing", []) if m["mechanism"] == mechanism), None)


def derived(entry, keys, of):
    """(value, low, high) of `of(parameters...)` over the corners of their intervals; None where a parameter is not reported."""
    p = entry["parameters"]
    if any(k not in p for k in keys):
        return None
    # a constant of a form has no interval
    corners = [of(*x) for x in itertools.product(*(p[k].get("ci95") or [p[k]["value"]] for k in keys))]
    return of(*(p[k]["value"] for k in keys)), min(corners), max(corners)


def peaks(case, partner, verdict):
    """Peaks of clipped recordings: read by the sensor that did not clip."""
    out = []
    for u in verdict.get("without_clipping") or []:
        if u["clipped"] and partner and (partner / u["recording"]).exists():
            true = peak(si(partner / u["recording"]), u["channel"])
            low, high = sorted(abs(x) for x in u["ci95"])
            out.append(Figure(case.name, f"peak of {u['recording']}", "m/s²", true, abs(u["peak"]), low, high))
    return out


def ringing(a):
    """Frequency, Hz, of what rings on in an acceleration after its pulse: the largest of its spectrum above a third of one over the pulse's width; None where less than six widths are recorded."""
    y, dt = a["acceleration"], float(np.median(np.diff(a["time"])))
    above = np.flatnonzero(np.abs(y) > 0.5 * np.abs(y).max())
    long = above[-1] - above[0] + 1
    z = y[above[-1] + long:]
    if len(z) < 6 * long:
        return None
    n = 16 * len(z)                                     # zeros between the lines of the spectrum
    f, s = np.fft.rfftfreq(n, dt), np.abs(np.fft.rfft((z - z.mean()) * np.hanning(len(z)), n))
    kept = f > 1 / (3 * long * dt)
    return float(f[kept][np.argmax(s[kept])])


def natural_frequency(case, recordings, verdict):
    """Natural frequency of what rides on a table: by the spectrum after the pulses, median over recordings."""
    found = [f for f in map(ringing, recordings) if f]
    m = named(verdict, "attached_mass")
    if not found:
        return []
    said = m and derived(m, ("attached_stiffness", "attached_mass"), lambda k, mass: np.sqrt(k / mass) / (2 * np.pi))
    return [Figure(case.name, "natural frequency of what rides on the body", "Hz", float(np.median(found)), *(said or ()))]


def width(a):
    """Seconds that an acceleration is above half its peak, by linear interpolation."""
    y, t = np.abs(a["acceleration"]), a["time"]
    half, above = y.max() / 2, np.flatnonzero(y > y.max() / 2)
    i, j = above[0], above[-1]
    cross = lambda p, q: t[p] + (half - y[p]) / (y[q] - y[p]) * (t[q] - t[p])
    return float((cross(j, j + 1) if j + 1 < len(y) else t[j]) - (cross(i - 1, i) if i else t[i]))


def hardening(case, recordings, verdict):
    """Growth of stiffness over shocks of one level: by how much the pulses narrow, width to the power of -2 (half a period of a mass on a spring)."""
    if len(recordings) < 5:
        return []
    w = [width(a) for a in recordings]
    third = max(len(w) // 3, 1)
    growth = float((np.median(w[:third]) / np.median(w[-third:])) ** 2 - 1)
    m = named(verdict, "cyclic_hardening")
    said = m and derived(m, ("hardening_share",), lambda s: s)
    return [Figure(case.name, "growth of stiffness from the first third of the shocks to the last", "1", growth, *(said or ()))]


def unloading(verdict):
    """What `figure(d, set s, power n of the way back, power p of loading)` of an indentation to depth d is by the diagnosis, as `derived` gives it: a function of (figure, d); None where plastic_indentation is not the only one named, or its form has no power.

    The way back from depth d goes along ((x - s)/(d - s))^n with s = r (d - y) (Oliver and Pharr 1992), straight in the form of Walton and Braun 1986."""
    m = named(verdict, "plastic_indentation")
    if not m or len(verdict["missing"]) > 1 or m["form"] == "Thornton":
        return None
    p = next((q["after"] for q in verdict["fit"]["base_bias"]["parameters"] if q["name"] == "p"), None)
    # a shape that was learned has neither
    if p is None or not {"plastic_ratio", "yield_penetration"} <= m["parameters"].keys():
        return None
    keys = [k for k in ("plastic_ratio", "yield_penetration", "plastic_unloading_exponent") if k in m["parameters"]]
    power = 1.0 if m["form"] == "Walton-Braun" else p
    return lambda figure, d: derived(m, keys, lambda r, y, n=power: figure(d, r * max(d - y, 0.0), n, p))


def end_of_force(d, s, n, p):
    """Depth at which the force has ended on the way back."""
    return s + (d - s) * ENDED ** (1 / n)


def share_lost(d, s, n, p):
    """Share of the work of loading along x^p that the way back does not give back."""
    return 1 - (d - s) / d * (p + 1) / (n + 1)


def permanent_set(case, recordings, levels, verdict):
    """Of the indentations of each level, median over its recordings: where the force has ended on the way back, and the share of the work that is lost."""
    by_diagnosis = unloading(verdict) or (lambda figure, d: ())
    out = []
    for level in dict.fromkeys(levels):
        alike = [a for a, k in zip(recordings, levels) if k == level]
        shares = [set_left(a) for a in alike]
        if None in shares or np.median(shares) < 0.1:
            continue
        d = float(np.median([a["penetration"].max() for a in alike]))
        out.append(Figure(case.name, f"end of force on the way back from {d:.3g} m", "m", float(np.median(shares)) * d, *by_diagnosis(end_of_force, d)))
        lost = float(np.median([work_lost(a) for a in alike]))
        if lost < 1:                                    # else it pulls on the way back: that work is no loss of the indentation alone
            out.append(Figure(case.name, f"work lost in an indentation to {d:.3g} m, share", "1", lost, *by_diagnosis(share_lost, d)))
    return out


def pull(case, recordings, verdict):
    """Largest pull while leaving, median over recordings: how far the force goes below its baseline."""
    m = named(verdict, "adhesion")
    found = [below(a)[0] for a in recordings]
    said = m and derived(m, ("adhesion_force",), lambda f: f)
    return [Figure(case.name, "largest pull while leaving", "N", float(np.median(found)), *(said or ()))] if m else []


def friction(case, recordings, verdict):
    """Friction of an indented mechanism: half of what the force falls by from the way in to the way out, at half depth."""
    a = recordings[0]
    f, x = a["force"], a["penetration"]
    top, mid = int(np.argmax(x)), 0.5 * float(x.max())
    if top < 2 or top > len(x) - 3 or x[-1] > mid:
        return []
    loss = float(np.interp(mid, x[:top], f[:top]) - np.interp(mid, x[top:][::-1], f[top:][::-1])) / 2
    m = named(verdict, "guide_friction")
    said = m and derived(m, ("friction",), lambda f: f)
    return [Figure(case.name, "friction at half depth", "N", loss, *(said or ()))]


def figures(case, campaign, verdict, partner):
    """All figures that the recordings of a campaign (campaign.toml, read) give by themselves. `partner`: the folder of the same impacts by another sensor."""
    recordings = [si(case / n) for n in files(case)]
    out = peaks(case, partner, verdict)
    if campaign["campaign"]["kind"] == "indentation":
        levels = [r.get("level") for r in campaign["recording"]]
        out += permanent_set(case, recordings, levels, verdict) + pull(case, recordings, verdict)
        out += friction(case, recordings, verdict) if "switch" in campaign["campaign"].get("material", "") else []
    elif not partner and all("acceleration" in a for a in recordings):
        out += natural_frequency(case, recordings, verdict)
        # what narrows the pulses of one level is no speed
        out += hardening(case, recordings, verdict) if len({r.get("level") for r in campaign["recording"]}) == 1 else []
    return out


def cells(f):
    """A figure as texts: independently, by the diagnosis, interval, off by, whether the interval holds it."""
    unit = "" if f.unit == "1" else f" {f.unit}"
    if f.said is None:
        return f"{f.independent:.4g}{unit}", "not reported", "-", "-", "-"
    return f"{f.independent:.4g}{unit}", f"{f.said:.4g}{unit}", f"{f.low:.4g} to {f.high:.4g}", f"{100 * f.error:+.1f} %", "yes" if f.holds else "no"


HEAD = ("independently", "by the diagnosis", "95 % interval", "off by", "interval holds it")


def table(found):
    """The figures of one campaign as HTML."""
    rows = "".join(f"<tr><td>{f.what}</td>" + "".join(f"<td class=n>{c}</td>" for c in cells(f)) + "</tr>" for f in found)
    return "<table><tr><th>figure</th>" + "".join(f"<th class=n>{h}</th>" for h in HEAD) + f"</tr>{rows}</table>"


def markdown(found):
    """The figures of all campaigns as lines of markdown; of peaks the worst and the median error."""
    out = ["| campaign | figure | " + " | ".join(HEAD) + " |", "|---|---" + "|---" * len(HEAD) + "|"]
    out += [f"| {f.campaign} | {f.what} | {' | '.join(cells(f))} |" for f in found]
    of_peaks = [f for f in found if f.said is not None and f.what.startswith("peak of")]
    if of_peaks:
        errors = [abs(f.error) for f in of_peaks]
        out += ["", f"Clipped peaks are recovered within {100 * max(errors):.1f} % at worst, {100 * np.median(errors):.1f} % in the median of {len(errors)}; {sum(f.holds for f in of_peaks)} of the intervals hold the true peak."]
    return out
