"""Real recordings: what the base misses, what was named, what the held-out levels say, and how the truth is known.

The truth is read off the recordings themselves or off a second sensor, never off a campaign's name: a permanent set is
where the force ends on the way back, relaxation is what it loses in a hold, adhesion is a pull below its baseline,
clipping is a peak the other sensor saw and this one did not. A folder X-other-sensor belongs to X.
"""
import json
import tomllib

import numpy as np

from . import figures as fig
from . import independent
from .independent import below, peak, set_left
from .judge import CHANNELS, distance, files, si, table


def hold_loss(a):
    """Share of the force lost while the penetration stands still near its deepest, and how long [s] that is."""
    f, x, t = a["force"], a["penetration"], a["time"]
    still = np.flatnonzero(x > x.max() - 0.03 * np.ptp(x))
    if len(still) < 10 or f[still[0]] <= 0:
        return None
    i, j = still[0], still[-1]
    k = max(len(still) // 20, 1)
    return float(1 - f[j - k:j + 1].mean() / f[i:j + 1].max()), float(t[j] - t[i])


def pull_off(a):
    """Deepest pull while leaving, in standard deviations of the baseline before touch and as a share of the peak."""
    low, deviation, rise = below(a)
    return low / max(deviation, 1e-300), low / rise


def indentation(case):
    """Sentences on what an indentation's own recordings show, and the names they support."""
    rec = [si(case / n) for n in files(case)]
    say, names = [], set()
    sets = [s for s in map(set_left, rec) if s is not None]
    holds = [h for h in map(hold_loss, rec) if h]
    pulls = [pull_off(a) for a in rec]
    pull = float(np.median([p[1] for p in pulls]))
    if sets and np.median(sets) > 0.3:
        names.add("plastic_indentation")
        say.append(f"On the way back the force has ended at {100 * np.median(sets):.0f} % of the depth reached (median of {len(sets)}; {100 * min(sets):.0f} to {100 * max(sets):.0f} %): a permanent set.")
    if holds and np.median([h[0] for h in holds]) > 0.15 and np.median([h[1] for h in holds]) > 0.1 * np.ptp(rec[0]["time"]):
        names.add("viscoelastic_relaxation")
        say.append(f"While the penetration is held for {np.median([h[1] for h in holds]):.3g} s the force falls by {100 * np.median([h[0] for h in holds]):.0f} %: relaxation.")
    if np.median([p[0] for p in pulls]) > 10 and pull > 0.02:
        names.add("adhesion")
        say.append(f"While leaving, the force goes {np.median([p[0] for p in pulls]):.0f} standard deviations below its baseline, {100 * pull:.1f} % of the peak: a pull.")
    return say or ["The recordings alone show neither a permanent set, nor a loss in a hold, nor a pull."], names


def delay(a, b, c="acceleration"):
    """Seconds that b comes after a: the shift that brings b's rise and fall onto a's, both as shares of a common level.

    Only what lies below 70 % of the lower peak is compared, so clipping does not count."""
    top = 0.7 * min(peak(a, c), peak(b, c))
    dt = min(np.median(np.diff(a["time"])), np.median(np.diff(b["time"]))) / 4
    t = np.arange(max(a["time"][0], b["time"][0]), min(a["time"][-1], b["time"][-1]), dt)
    ya, yb = (np.clip(np.interp(t, q["time"], q[c]), -top, top) for q in (a, b))
    ya, yb = ya - ya.mean(), yb - yb.mean()
    n = int(0.01 / dt)
    lags = np.arange(-n, n + 1)
    r = [float(np.dot(ya[n:-n], yb[n + k:len(yb) - n + k])) for k in lags]
    return float(lags[int(np.argmax(r))] * dt)


def second_sensor(low, high):
    """Rows (recording, true peak, recorded, delay) of a sensor judged by the better one."""
    out = []
    for n in files(low):
        if (high / n).exists():
            a, b = si(high / n), si(low / n)
            out.append((n, peak(a), peak(b), delay(a, b)))
    return out


def partner(case):
    """The campaign of the same drops by the other sensor, if the folder holds one."""
    if case.name.endswith("-other-sensor"):
        p = case.parent / case.name[:-len("-other-sensor")]
    else:
        p = case.parent / (case.name + "-other-sensor")
    return p if (p / "campaign.toml").exists() else None


def misses(case, answer):
    """Where the recalibrated base misses: (channel, rms over range) and the part of each recording it is worst in."""
    tot, when = {}, np.zeros(4)
    for n in files(case):
        a, p = table(case / n), answer / "predictions" / "before" / n
        if not p.exists():
            return None
        b = table(p)
        for c in CHANNELS:
            if c in a and c in b and len(a[c]) == len(b[c]):
                e = a[c] - b[c]
                tot.setdefault(c, []).append(float(np.sqrt(np.mean(e ** 2)) / max(np.ptp(a[c]), 1e-300)))
                when += [float(np.sum(q ** 2)) / max(np.ptp(a[c]), 1e-300) ** 2 for q in np.array_split(e, 4)]
    return {c: float(np.mean(v)) for c, v in tot.items()}, when / max(when.sum(), 1e-300)


def levels(campaign):
    """How many levels a campaign's recordings are of."""
    by = ("level", "drop_height", "spring_preload", "impact_speed", "start_speed")
    of = lambda r: next((r[k] for k in by if k in r), None)
    return len({of(r) for r in campaign["recording"]})


def section(case, answer, run):
    """One campaign and its answer: (dict of what was found, html)."""
    campaign = tomllib.loads((case / "campaign.toml").read_text())
    r = dict(campaign=case.name, seconds=run["cpu"], answered=False, named=[], probability={}, levels=levels(campaign), before=None, after=None, supported=None, figures=[])
    h = [f"<h3>{fig_esc(case.name)}</h3>"]
    try:
        v = json.loads((answer / "verdict.json").read_text())
    except (OSError, ValueError):
        h.append(f"<p>No verdict (exit code {run['code']}): {fig_esc(run['printed'][-600:])}</p>")
        return r, "".join(h)
    r["answered"] = "invalid" not in v
    r["named"] = [m.get("mechanism") for m in v.get("missing", [])]
    r["probability"] = {m["mechanism"]: m["probability"] for m in v.get("missing", [])}
    r["also"] = sorted({x for m in v.get("missing", []) for x in m.get("also_possible", [])})
    r["unexplained"] = bool(v.get("unexplained", {}).get("detected"))
    r["before"], r["after"] = (distance(case, answer / "predictions" / k) for k in ("before", "after"))
    m = misses(case, answer)
    if m:
        by = ", ".join(f"{c} {100 * q:.2f} % of its range" for c, q in m[0].items())
        quarter = int(np.argmax(m[1]))
        h.append(f"<p><b>What the base misses.</b> Recalibrated without the level it predicts, it is off by {by} (rms); {100 * m[1][quarter]:.0f} % of that lies in the {('first', 'second', 'third', 'last')[quarter]} quarter of a recording.</p>")
    h.append(f"<p><b>What was named.</b> {fig_esc(' + '.join(r['named']) or 'nothing')}{', with something unexplained besides' if r['unexplained'] else ''}"
             + (f"; held open: {fig_esc(', '.join(r['also']))}" if r["also"] else "") + f". {fig_esc('; '.join(x.get('text', '') for x in v.get('missing', [])) or v.get('unexplained', {}).get('text', ''))} ({r['seconds']:.0f} s of processor)</p>")
    if r["before"] and r["after"]:
        h.append(f"<p><b>Held-out misfit</b> (mean over recordings and channels, rms over range): {100 * r['before']:.3f} % before, {100 * r['after']:.3f} % after, {r['before'] / r['after']:.2f} times less.</p>")
    h.append("<p><b>How the truth is known.</b> ")
    if campaign["campaign"]["kind"] == "indentation":
        say, names = indentation(case)
        r["supported"] = sorted(names)
        ok = bool(names & set(r["named"]))
        h.append(" ".join(say) + (f" Named {'as the recordings show' if ok else 'otherwise than the recordings show'}." if names else "") + "</p>")
        r["as_shown"] = ok if names else None
    else:
        other = partner(case)
        if other is None:
            h.append("No second sensor: only the levels held out can show it.</p>")
        else:
            mine, theirs = (float(np.median([peak(si(c / n)) for n in files(c)])) for c in (case, other))
            if mine < theirs:
                rows = second_sensor(case, other)
                cut = np.array([b / a for _, a, b, _ in rows])
                lag = np.array([q[-1] for q in rows])
                h.append(f"The second accelerometer of the same drops saw {100 * (1 / cut.max() - 1):.0f} to {100 * (1 / cut.min() - 1):.0f} % higher peaks; this one comes {1e3 * np.median(lag):.2f} ms later (cross-correlation below the clipped level). "
                         f"So clipping and lag are the truth here; named: {'clipping' if 'clipping' in r['named'] else 'not clipping'}, {'lag' if {'lowpass_lag', 'channel_skew'} & set(r['named'] + r['also']) else 'no lag'}.</p>")
                r["as_shown"] = "clipping" in r["named"]
            else:
                h.append("This is the sensor that saw the higher peaks; it judges the other one below or above. What it misses itself only the levels held out can show it.</p>")
    r["figures"] = independent.figures(case, campaign, v, partner(case))
    if r["figures"]:
        h.append(independent.table(r["figures"]))
    h.append(fig.traces(case, answer))
    return r, "".join(h)


def fig_esc(x):
    import html
    return html.escape(str(x))


def sections(campaigns, out, runs):
    """All campaigns, diagnosed into `out` with `runs` by name: (results, html)."""
    both = [section(c, out / c.name, runs[c.name]) for c in campaigns]
    return [r for r, _ in both], "\n".join(h for _, h in both)
