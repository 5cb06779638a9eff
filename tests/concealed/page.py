"""One self-contained page of the proof, and its summary for the book and the README."""
import html
import json
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import numpy as np

from . import figures as fig
from . import independent, known, planted, scores
from .effects import STRANGE
from .judge import TARGETS, TIES, band, summary

STYLE = """body{font:15px/1.5 system-ui,sans-serif;color:#1d2126;max-width:1080px;margin:2em auto;padding:0 1em}
h1{font-size:1.7em;margin-bottom:.2em}h2{margin-top:2.2em;border-bottom:1px solid #d8dce1;padding-bottom:.2em}
table{border-collapse:collapse;font-size:13px;margin:.8em 0}td,th{padding:.25em .7em;border-bottom:1px solid #e4e7ea;text-align:left}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums}.good{color:#2e7d4f}.mid{color:#1f5fa8}.bad{color:#b3261e}.grey{color:#6b7078}
code{background:#f1f3f5;padding:0 .25em;overflow-wrap:anywhere}img,svg{max-width:100%;height:auto}details{margin:.6em 0}summary{cursor:pointer}
.case{border-left:3px solid #d8dce1;padding-left:1em;margin:1.4em 0}nav a{margin-right:1em}"""
SINGLE = ("plain", "concealed", "deep", "faint")


class Measured(NamedTuple):
    """What was said of real recordings: of each campaign (real.sections), the same as html, and of what was planted into them (planted.judge)."""
    found: list = []
    html: str = ""
    planted: list = []

    def figures(self):
        """{key of scores.TABLE: (value, k, n)}."""
        return {**known.figures(self.found), **planted.figures(self.planted)}


def seeds(head):
    """The seeds in words."""
    own = list(dict.fromkeys(str(s[0]) for s in [*head["sets"], *head.get("groups", [])]))
    return ("seed " if len(own) == 1 else "seeds ") + ", ".join(own)


def as_set(s):
    """A set as it is given on the command line."""
    return f"{s[0]}/{s[1]}" + (f":{s[2]}" if len(s) == 3 else "")


def how_many(head):
    """How many cases were judged, and of how many drawn where that is fewer."""
    total = sum(n for _, n in head["sets"])
    return f"{head['cases']}" if head["cases"] == total else f"the first {head['cases']} of {total}"


def made(head):
    """What diagnosed: the commit it was built from, where the command built it itself, and the binary's hash."""
    return (f"commit {head['commit']}, " if head["commit"] else "") + f"binary {head['binary']}"


def command(head):
    """The command that draws and judges the same cases again."""
    return "tests/prove " + " ".join(as_set(s) for s in [*head["sets"], *head.get("groups", [])]) + (f" --first {head['cases']}" if head["cases"] < sum(n for _, n in head["sets"]) else "")


def esc(x):
    return html.escape(str(x))


def mark(q, key):
    t = TARGETS.get(key)
    return "" if t is None else "good" if q >= t[0] else "mid" if q >= t[1] else "bad"


def rows_of(head, body, numeric=()):
    th = "".join(f'<th class="{"n" if i in numeric else ""}">{h}</th>' for i, h in enumerate(head))
    tr = "".join("<tr>" + "".join(f'<td class="{"n" if i in numeric else ""}">{c}</td>' for i, c in enumerate(r)) + "</tr>" for r in body)
    return f"<table><tr>{th}</tr>{tr}</table>"


def pct(k, n):
    return f"{100 * k / n:.0f} %" if n else "-"


def located(rows):
    rs = [r for r in rows if r["truth"] and r["detected"]]
    return sum(bool(r["located"]) for r in rs), len(rs)


def single(rows):
    rs = [r for r in rows if r["group"] in ("plain", "concealed")]
    return sum(r["right"] for r in rs), len(rs)


def median_gain(rows, group="concealed"):
    g = [r["gain"] for r in rows if r["group"] == group and r["gain"] is not None]
    return (float(np.median(g)), len(g)) if g else (None, 0)


def lines(rows, summ):
    """The scoreboard: (name, key of its target, k, n)."""
    out = []
    if "null" in summ:
        out.append(("nothing missing, called so", "null", summ["null"]["right"], summ["null"]["n"]))
    k, n = single(rows)
    out.append(("single effect, plain and concealed: named, nothing besides", "concealed", k, n))
    for g, what in (("deep", "single effect under the noise: named"), ("faint", "faint, a trace of a few sigmas: named"),
                    ("pair", "pairs: both named and no third"), ("unknown", "outside the vocabulary: unexplained")):
        if g in summ:
            out.append((what, g, summ[g]["right"], summ[g]["n"]))
    for want, what in ((False, "single effect in a form the diagnosis fits"), (True, "single effect in a form it does not fit")):
        rs = [r for r in rows if r["group"] in ("plain", "concealed", "deep") and r.get("strange") is want]
        out.append((what, "form", sum(r["right"] for r in rs), len(rs)))
    k, n = located(rows)
    out.append(("located: part of the system and phase (of those detected)", "located", k, n))
    return out


def board(rows, summ):
    body = []
    for what, key, k, n in lines(rows, summ):
        if not n:
            continue
        lo, hi = band(k, n)
        t = TARGETS.get(key)
        body.append([what, n, k, f'<b class="{mark(k / n, key)}">{pct(k, n)}</b>', f"{100 * lo:.0f} to {100 * hi:.0f} %",
                     f"{100 * t[0]:.0f} %" if t else "-", f"{100 * t[1]:.0f} %" if t else "-"])
    g, n = median_gain(rows)
    if g is not None:
        body.append(["share of the oracle's held-out gain, concealed, median", n, "", f'<b class="{mark(g, "gain")}">{g:.2f}</b>', "", "0.90", "0.75"])
    return rows_of(["", "cases", "right", "share", "95 % band", "target", "floor"], body, (1, 2, 3, 4, 5, 6))


def seed_by_seed(rows, head):
    """The scoreboard's lines for each seed, where there are several."""
    if len(head["sets"]) < 2:
        return ""
    body = defaultdict(list)
    for seed, _ in head["sets"]:
        rs = [r for r in rows if r["case"].startswith(f"s{seed}-")]
        got = {what: (key, k, n) for what, key, k, n in lines(rs, summary(rs))}
        for what, key, *_ in lines(rows, summary(rows)):
            _, k, n = got.get(what, (key, 0, 0))
            body[what].append(f'<span class="{mark(k / n, key)}">{k}/{n}</span>' if n else "·")
    return rows_of([""] + [f"seed {s}" for s, _ in head["sets"]], [[w] + v for w, v in body.items()], range(1, 1 + len(head["sets"])))


def wrong_most(rows, count=6):
    """[(mechanism, wrong, drawn, what was said instead)] of single effects and effects outside the vocabulary, most wrong first."""
    by = defaultdict(list)
    for r in rows:
        if len(r["truth"]) == 1:
            by[r["truth"][0]].append(r)
    out = []
    for name, rs in by.items():
        bad = [r for r in rs if not r["right"]]
        if bad:
            out.append((name, len(bad), len(rs), sorted({said(r) for r in bad})))
    return sorted(out, key=lambda q: (-q[1], -q[1] / q[2], q[0]))[:count]


def families(rows):
    cell = defaultdict(list)
    for r in rows:
        if len(r["truth"]) == 1:
            cell[r["truth"][0], r["group"]].append(r)
    names = sorted({k[0] for k in cell}, key=lambda s: (s.startswith("unknown"), s))
    groups = ["plain", "concealed", "deep", "faint", "unknown"]
    body = []
    for n in names:
        line = [esc(n)]
        for g in groups:
            rs = cell.get((n, g), [])
            if not rs:
                line.append('<span class="grey">·</span>')
                continue
            k = sum(r["right"] for r in rs)
            forms = ", ".join(f"{r['forms'][0]}: {said(r)}" for r in rs)
            line.append(f'<span class="{"good" if k == len(rs) else "bad" if k == 0 else "mid"}" title="{esc(forms)}">{k}/{len(rs)}</span>')
        drawn = sorted({r["forms"][0] for r in rows if r["truth"] == [n]})
        line.append(esc(", ".join(f + ("*" if (n, f) in STRANGE else "") for f in drawn)))
        body.append(line)
    return rows_of(["mechanism"] + groups + ["forms drawn (* not one the diagnosis fits)"], body, (1, 2, 3, 4, 5))


def covered(rows):
    """How many true parameters lie inside the 95 % interval given, and of how many."""
    ci = [lo <= true <= hi for r in rows for _, true, _, lo, hi in r["parameters"] if lo == lo and hi == hi]
    return sum(ci), len(ci)


def parameter_table(rows):
    by = defaultdict(list)
    for r in rows:
        for name, true, got, lo, hi in r["parameters"]:
            by[name].append((true, got, lo, hi))
    body, (inside, total) = [], covered(rows)
    for name in sorted(by):
        v = by[name]
        err = [abs(g / t - 1) for t, g, _, _ in v if t]
        ci = [(lo <= t <= hi) for t, _, lo, hi in v if lo == lo and hi == hi]
        body.append([esc(name), len(v), f"{100 * np.median(err):.1f} %" if err else "-", f"{sum(ci)}/{len(ci)}"])
    if not body:
        return "<p>No effect was named right in a form whose parameters can be compared.</p>"
    return rows_of(["parameter", "cases", "median error", "inside its 95 % interval"], body, (1, 2, 3)) + \
        f"<p>All parameters together: {inside} of {total} true values lie inside the interval given ({pct(inside, total)}, nominal 95 %). Only effects drawn in the very form that is fitted can be compared.</p>"


def where(rows):
    body = []
    for origin in ("contact", "motion", "chain"):
        rs = [r for r in rows if r["origin"] == [origin] and r["detected"]]
        if rs:
            o = sum(r.get("said", {}).get("where", {}).get("origin") == origin for r in rs)
            k = sum(bool(r["located"]) for r in rs)
            body.append([origin, len(rs), pct(o, len(rs)), pct(k, len(rs))])
    return rows_of(["true origin", "detected", "part of the system right", "part and phase right"], body, (1, 2, 3))


def alarms(rows):
    rs = [r for r in rows if r["group"] == "null"]
    kinds = defaultdict(list)
    for r in rs:
        h = r["hostile"]
        kinds[" and ".join(k for k in ("wander", "spikes") if h.get(k)) or "kind"].append(r)
    body = [[k, len(v), sum(not r["right"] for r in v), esc(", ".join(f"{r['case']}: {'+'.join(r['named']) or 'unexplained'}" for r in v if not r["right"]))]
            for k, v in sorted(kinds.items())]
    return rows_of(["null", "cases", "false alarms", "which"], body, (1, 2))


def times(rows, head):
    t = np.array([r["seconds"] for r in rows])
    mb = max(r["mb"] for r in rows)
    cpu = np.median([r["cpu"] for r in rows])
    return f"<p>Processor time {cpu:.1f} s a campaign in the median. A campaign takes {np.median(t):.1f} s in the median, {np.percentile(t, 90):.1f} s for nine of ten, {t.max():.1f} s at worst (one thread each, {head['jobs']} campaigns at once, wall clock, machine shared or not as it was); peak memory {mb:.0f} MB.</p>"


def said(r):
    n = " + ".join(r["named"]) or ("unexplained" if r["unexplained"] else "cannot be judged" if r.get("invalid") else "nothing" if r["answered"] else "no answer")
    if r["named"] and r["unexplained"]:
        n += " and unexplained"
    return n


def worst(out, rows, count=6):
    bad = [r for r in rows if not r["right"]]
    bad.sort(key=lambda r: -(r["strength"] if r["truth"] else 99))
    h = []
    for r in bad[:count]:
        h.append(f'<div class="case"><h3>{esc(r["case"])}: hidden {esc(" + ".join(r["truth"]) or "nothing")} ({esc(", ".join(r["forms"]))}), said {esc(said(r))}</h3>'
                 f'<p>{esc(r["group"])}, {esc(r["kind"])}, strength {r["strength"]:.2f}. {esc(r["printed"][-400:])}</p>')
        h.append(fig.traces(out / "open" / r["case"], out / "verdicts" / r["case"]) + "</div>")
    rest = "".join(f"<tr><td>{esc(r['case'])}</td><td>{esc(r['group'])}</td><td>{esc(r['kind'])}</td><td>{esc(' + '.join(r['truth']) or 'nothing')}</td><td>{esc(', '.join(r['forms']))}</td><td>{esc(said(r))}</td><td>{r['strength']:.2f}</td></tr>" for r in bad)
    return "".join(h) + f"<details open><summary>All {len(bad)} cases not answered right</summary><table><tr><th>case</th><th>group</th><th>kind</th><th>hidden</th><th>form</th><th>said</th><th>strength</th></tr>{rest}</table></details>"


def follow(out, rows):
    pool = [r for r in rows if r["right"] and r["group"] == "concealed" and r["gain"] is not None and r["kind"] == "drop-test"] or [r for r in rows if r["right"] and r["truth"]]
    if not pool:
        return "<p>No hidden effect was named right.</p>"
    r = sorted(pool, key=lambda r: (-len(r["parameters"]), r["case"]))[0]
    case = out / "open" / r["case"]
    toml = (case / "campaign.toml").read_text().split("[[recording]]")[0]
    verdict = json.loads((out / "verdicts" / r["case"] / "verdict.json").read_text())
    short = {k: verdict[k] for k in ("mismatch", "missing", "unexplained") if k in verdict}
    report = f"verdicts/{r['case']}/report.html"
    par = "".join(f"<li>{esc(n)}: true {t:.4g}, found {g:.4g}, interval {lo:.4g} to {hi:.4g}</li>" for n, t, g, lo, hi in r["parameters"])
    return (f"<p>Case <code>{esc(r['case'])}</code>. The user's simulation, calibrated, with R² {r['r2']:.5f} on what the concealed effect left:</p><pre>{esc(toml.strip())}</pre>"
            f"<p>Lowest and highest level; orange the simulation recalibrated without that level, blue with what was named; below, what each leaves.</p>"
            + fig.traces(case, out / "verdicts" / r["case"])
            + f"<p>The verdict, before the label was opened (<a href=\"{report}\">its report</a>):</p><pre>{esc(json.dumps(short, indent=1)[:3500])}</pre>"
            f"<p>The label: {esc(' + '.join(r['truth']))}, form {esc(', '.join(r['forms']))}, {esc(json.dumps(r['effect']))}. "
            f"Held-out misfit {r['before']:.4f} before, {r['after']:.4f} after, {r['oracle']:.4f} for the oracle that is given the name.</p><ul>{par}</ul>")


def bound(rows):
    rs = [r for r in rows if r.get("limit")]
    if not rs:
        return ""
    exp = sum(r["limit"]["p_right"] for r in rs)
    got = sum(r["right"] for r in rs)
    hard = sorted(rs, key=lambda r: r["limit"]["p_right"])[:12]
    body = [[esc(r["case"]), esc(r["truth"][0]), f"{r['limit']['sigmas']:.1f}", esc(r["limit"]["nearest"]), f"{r['limit']['cosine']:.4f}", f"{r['limit']['p_right']:.3f}", esc(said(r))] for r in hard]
    return (f"<p>For every single effect the laboratory knows the trace that is left after calibration, whitened and with every nuisance projected out: its length in sigmas, "
            f"and the cosine with the nearest trace another mechanism would leave. Two-class bound P = Φ(√(λ(1−ρ)/2)); it lets the rest of the vocabulary be known not to be there and takes the noise as known, so it is optimistic. "
            f"Summed over {len(rs)} cases the bound allows {exp:.1f} right names; {got} were given. The hardest:</p>"
            + rows_of(["case", "hidden", "sigmas left", "nearest other", "cosine", "bound", "said"], body, (2, 4, 5)))


def ties(rows):
    """How the pairs that such recordings cannot part were answered."""
    body = []
    for tie in TIES:
        rs = [r for r in rows if len(r["truth"]) == 1 and r["truth"][0] in tie and r["detected"]]
        if rs:
            named = sum(r["named"] == r["truth"] for r in rs)
            other = sum(bool(r["named"]) and r["named"][0] in tie and r["named"] != r["truth"] for r in rs)
            open_ = sum(bool(set(r["named"]) & tie) and bool((tie - set(r["named"])) & set(r["also"])) for r in rs)
            body.append([esc(" or ".join(sorted(tie))), len(rs), named, other, open_])
    return rows_of(["tie", "detected", "named itself", "named as the other", "other held open"], body, (1, 2, 3, 4)) if body else ""


def one_level_table(res):
    if not res:
        return ""
    right, held = sum(r["right"] for r in res), sum(r["held"] and not r["right"] for r in res)
    silent = sum(r["silent"] for r in res)
    body = [[esc(r["case"]), esc(r["truth"][0]), f"{r['strength']:.2f}", esc(" + ".join(r["named"]) or ("unexplained" if r["unexplained"] else "nothing")), esc(", ".join(r["also"]))] for r in res]
    return (f"<p>One level only: {len(res)} effects that were named right from all levels, diagnosed again from the highest level's recordings alone. {right} named right, {held} held open beside another name, "
            f"{silent} not detected, {len(res) - right - held - silent} named wrong or unexplained.</p>" + rows_of(["case", "hidden", "strength", "said from one level", "held open"], body, (2,)))


def real_table(found):
    body = []
    for r in found:
        gain = f"{r['before'] / r['after']:.2f}" if r["before"] and r["after"] else "-"
        shown = {True: "yes", False: "no", None: "-"}[r.get("as_shown")]
        body.append([esc(r["campaign"]), esc(" + ".join(r["named"]) or "nothing"), "-" if r["before"] is None else f"{100 * r['before']:.2f} %",
                     "-" if r["after"] is None else f"{100 * r['after']:.2f} %", gain, shown, f"{r['seconds']:.0f} s"])
    return rows_of(["campaign", "named", "held-out before", "after", "times less", "as the recordings themselves show", "processor time"], body, (2, 3, 4, 6))


def beside_table(others):
    body = []
    for m in others["methods"]:
        body.append([esc(m["name"]), esc(m["settings"]), f"{m['alarms']}/{m['nulls']}", f"{m['detected']}/{m['effects']}", f"{m['named']}/{m['singles']}",
                     "-" if m["gain"] is None else f"{m['gain']:.2f}", f"{m['seconds']:.1f}"])
    notes = "".join(f"<li>{esc(n)}</li>" for n in others["notes"])
    return rows_of(["method", "settings", "false alarms", "detected", "single effect named", "share of the oracle's gain, median", "processor s a case"], body, (2, 3, 4, 5, 6)) + f"<ul>{notes}</ul>"


def certainty(rows, more, measured):
    """The table the diagnosis is held to over all groups, and how sure it was."""
    body = [[esc(what), n, k, f'<b class="{ {True: "good", False: "bad", None: ""}[kept]}">{value}</b>', floor, goal] for what, n, k, value, floor, goal, kept in scores.lines(rows + more, measured.figures())]
    groups = rows_of(["group", "answers", "wrong names believed", "size of the 95 % sets, mean", "sets that hold the cause", "parameters inside their 95 % interval"],
                     [[esc(c) for c in line] for line in scores.by_group(rows + more)], (1, 2, 3, 4, 5))
    bad = [r for r in more if not r["right"]]
    rest = "".join(f"<tr><td>{esc(r['case'])}</td><td>{esc(r['group'])}</td><td>{esc(r['detail'])}</td><td>{esc(r['kind'])}</td><td>{esc(' + '.join(r['truth']) or 'nothing')}</td>"
                   f"<td>{esc(', '.join(r['forms']))}</td><td>{esc(', '.join(f'{n} {p:.2f}' for n, p in r['probability'].items()) or said(r))}</td></tr>" for r in bad)
    strangers = "".join(f"<p>Strangers, {esc(h)}.</p>" for h in scores.halves()) if more else ""
    table = ['<h2 id="sure">How sure it was</h2>', rows_of(["", "cases", "right", "value", "floor", "goal"], body, (1, 2, 3, 4, 5))]
    if not rows and not more:
        return table
    return [*table, fig.reliability(scores.reliability(rows + more)), groups, strangers,
            f"<details><summary>All {len(bad)} campaigns of the groups not answered right</summary><table><tr><th>case</th><th>group</th><th>of it</th><th>kind</th><th>hidden</th><th>form</th><th>said</th></tr>{rest}</table></details>" if more else ""]


def planted_table(rows):
    """What was planted into real recordings, and what was said of each."""
    lines_ = [line.strip("| ").split(" | ") for line in planted.markdown(rows)]
    body = [[esc(r["case"]), esc(r["campaign"]), esc(r["effect"]), f"{r['strength']:g}", "yes" if r["named"] else "no", esc(", ".join(r["found"]) or "nothing"), esc(", ".join(r["wrong"]))] for r in rows]
    return rows_of(lines_[0], [[esc(c) for c in line] for line in lines_[2:]], (1,)) + "<details><summary>All of them</summary>" + \
        rows_of(["case", "campaign", "planted", "times", "named", "said", "believed besides"], body, (3,)) + "</details>"


def write(out, head, rows, others, measured, single_level, more=()):
    """DIR/index.html and the pictures of the book."""
    measured = measured or Measured()
    out.mkdir(parents=True, exist_ok=True)
    parts = [f"<!doctype html><meta charset=utf-8><title>Concealed effects, found blind</title><style>{STYLE}</style>", "<h1>Concealed effects, found blind</h1>"]
    more = list(more)
    if rows:
        parts += blind(out, head, rows, others, measured, single_level)
    elif more:
        parts.append(f"<p>{len(more)} campaigns of groups, {seeds(head)}, {head['date']}, {made(head)}. Labels sealed before the diagnosis: sha256 <code>{head['sha256']}</code>. Again: <code>{command(head)}</code></p>")
    if rows or more or measured.figures():
        parts += certainty(rows, more, measured)
    if others:
        parts += ['<h2 id="beside">Beside what else one could use</h2>', beside_table(others)]
    if measured.planted:
        parts += ['<h2 id="planted">Planted into real recordings</h2>', f"<p>Labels sealed before the diagnosis: sha256 <code>{head['planted']}</code>.</p>", planted_table(measured.planted)]
    if measured.found:
        fallen = fig.fallen(measured.found)
        (out / "real.svg").write_text('<?xml version="1.0"?>\n' + fallen)
        parts += ['<h2 id="real">Real recordings</h2>', fallen, real_table(measured.found), measured.html]
    (out / "index.html").write_text("\n".join(parts))


def blind(out, head, rows, others, measured, single_level):
    """The page's parts on concealed cases."""
    summ = summary(rows)
    score, det = fig.scoreboard(summ, TARGETS), fig.detection(rows)
    (out / "scoreboard.svg").write_text('<?xml version="1.0"?>\n' + score)
    (out / "detection.svg").write_text('<?xml version="1.0"?>\n' + det)
    k, n = single(rows)
    return [
        f"<p>{how_many(head)} campaigns drawn from {seeds(head)} by a laboratory that shares no code with the diagnosis; effects calibrated away until the base fits with R² over 0.99; "
        f"{k} of {n} plain and concealed single effects named with nothing besides. {head['date']}, {made(head)}.</p>",
        f"<p>Labels sealed before the diagnosis started: sha256 <code>{head['sha256']}</code>, and unchanged when they were opened. Again: <code>{command(head)}</code></p>",
        '<nav><a href="#board">Scoreboard</a><a href="#limits">Limits</a><a href="#follow">One case</a><a href="#worst">Worst cases</a>' + ('<a href="#beside">Beside others</a>' if others else "") + ('<a href="#real">Real recordings</a>' if measured.found else "") + "</nav>",
        '<h2 id="board">Scoreboard</h2>', board(rows, summ), seed_by_seed(rows, head), score,
        "<h2>By family and strength</h2>", families(rows),
        "<p>Strength is the misfit of the calibrated base over the noise, noise-free: plain 5 to 12, concealed 1.5 to 4.4, deep 0.42 to 1.0, faint 0.03 to 0.3.</p>",
        "<h2>Detection against strength</h2>", det,
        '<h2 id="limits">Limits: what any method could know</h2>', bound(rows), fig.limits(rows), ties(rows), one_level_table(single_level),
        "<h2>What is taken for what</h2>", fig.confusion(rows),
        "<h2>Where it sits</h2>", where(rows),
        "<h2>Parameters</h2>", parameter_table(rows),
        "<h2>Recordings the fit did not see</h2>", fig.gains(rows),
        "<h2>False alarms</h2>", alarms(rows), "<h2>Time</h2>", times(rows, head),
        '<h2 id="follow">One case, from recordings to verdict</h2>', follow(out, rows),
        '<h2 id="worst">The worst cases</h2>', worst(out, rows),
    ]


def of_real(head, measured):
    """The tables on real recordings, as lines for the book."""
    if not measured.figures() and not measured.found:
        return []
    out = [f"{head['date']}, {made(head)}."]
    if measured.found:
        out += ["", "What is known of each, what was named, and how the misfit on levels that the fit did not see fell (mean of rms over range):", "", *known.markdown(measured.found)]
    if measured.planted:
        out += ["", f"Known effects planted into {len({r['campaign'] for r in measured.planted})} campaigns; labels sealed before the diagnosis, sha256", f"`{head['planted']}`:", "", *planted.markdown(measured.planted)]
    if measured.figures():
        out += ["", *scores.markdown([], measured.figures())]
    figures = [f for r in measured.found for f in r["figures"]]
    if figures:
        out += ["", "What a second sensor or the recordings themselves give without any model, beside the diagnosis:", "", *independent.markdown(figures)]
    return out


def of_concealed(head, rows, others, more=()):
    """The tables on concealed campaigns, as lines for the book; more: rows of groups.py's campaigns."""
    out, more = [], list(more)
    if rows:
        out += [f"{how_many(head)[:1].upper()}{how_many(head)[1:]} concealed cases, {seeds(head)}, {head['date']}, {made(head)}; labels sha256",
                f"`{head['sha256']}`; `{command(head)}`:", "",
                "| | cases | right | 95 % band | target | floor |", "|---|---|---|---|---|---|"]
        for what, key, k, n in lines(rows, summary(rows)):
            if n:
                t, (lo, hi) = TARGETS.get(key), band(k, n)
                out.append(f"| {what} | {n} | {pct(k, n)} | {100 * lo:.0f} to {100 * hi:.0f} % | {f'{100 * t[0]:.0f} %' if t else '-'} | {f'{100 * t[1]:.0f} %' if t else '-'} |")
        g, n = median_gain(rows)
        if g is not None:
            out.append(f"| share of the oracle's held-out gain, concealed, median | {n} | {g:.2f} | | 0.90 | 0.75 |")
        k, n = covered(rows)
        if n:
            lo, hi = band(k, n)
            out.append(f"| parameters inside their 95 % interval (forms that can be compared) | {n} | {pct(k, n)} | {100 * lo:.0f} to {100 * hi:.0f} % | - | - |")
        bad = "; ".join(f"{n.replace('unknown:', 'outside: ')} {k} of {m} (said {', '.join(w)})" for n, k, m, w in wrong_most(rows))
        if bad:
            out += ["", f"Wrong most often, over all strengths: {bad}."]
        cpu = [r["cpu"] for r in rows]
        out += ["", f"A campaign took {np.median(cpu):.0f} s of processor time in the median, {np.percentile(cpu, 90):.0f} s for nine of ten."]
    if more:
        out += ["", f"With {len(more)} campaigns more, of the groups of tests/concealed/groups.py:" if rows else
                f"{len(more)} campaigns of the groups of tests/concealed/groups.py, {seeds(head)}, {head['date']}, {made(head)}; labels sha256 `{head['sha256']}`; `{command(head)}`:"]
    if rows or more:
        out += [""] + scores.markdown(rows + more)
    if others:
        out += ["", f"Beside, on the first {others['cases']} of these cases:", "", "| | false alarms | detected | single effect named | share of the oracle's gain | processor s a case |", "|---|---|---|---|---|---|"]
        for m in others["methods"]:
            out.append(f"| {m['name']}, {m['settings']} | {m['alarms']}/{m['nulls']} | {m['detected']}/{m['effects']} | {m['named']}/{m['singles']} | {'-' if m['gain'] is None else format(m['gain'], '.2f')} | {m['seconds']:.1f} |")
    return out


def markdown(head, rows, others, measured, more=()):
    """All tables, as they are printed."""
    return "\n".join([*of_real(head, measured or Measured()), "", *of_concealed(head, rows, others, more)]).strip()


# what stands between these lines in the book's page and in the README is written by --readme
REAL = ("<!-- real recordings: written by tests/prove --real --planted --readme -->", "<!-- end of real recordings -->")
CONCEALED = ("<!-- proof: written by tests/prove --readme -->", "<!-- end of proof -->")
BOOK = Path("docs") / "src"


# what the README says of scores.figures, in that order
SAID_OF_REAL = {"real": "of {n} campaigns whose missing physics is known {k} are answered so", "real_wrong": "a wrong name is believed in {k} of them",
                "misfit": "the misfit on levels that the fit did not see falls to {value:.2f} of what it was, in the median of {n}",
                "planted6": "of {n} effects planted at 6 times what was unexplained {k} are named", "planted2": "of {n} at 2 times {k}",
                "flat": "of {n} peaks cut flat {k}", "planted_wrong": "another name is believed in {k} of {n}"}
SAID_OF_CONCEALED = {"null": "of {n} plain campaigns with nothing missing {k} are called so", "single": "of {n} plain and concealed effects {k} are named with nothing besides",
                     "wrong": "a wrong name is believed in {k} of {n} answers", "sets": "of {n} sets that claim to hold the cause with 95 % {k} hold it"}


def sentence(begin, figures, words, lines_):
    """What the README says: the figures there are in these words, and what of the table's `lines_` is short of its floor."""
    said = "; ".join(w.format(value=figures[key][0], n=figures[key][2], k=figures[key][1]) for key, w in words.items() if key in figures)
    short = ", ".join(f'"{what}"' for what, *_, kept in lines_ if kept is False)
    return f"{begin}: {said}." + (f" Short of the floors set for it: {short}." if short else "")


def said_of_real(head, measured):
    """What the README says of real recordings."""
    return sentence(f"Real recordings ({head['date']})", measured.figures(), SAID_OF_REAL, scores.lines([], measured.figures()))


def said_of_concealed(head, rows, more=()):
    """What the README says of concealed campaigns."""
    every = [*rows, *more]
    return sentence(f"Of {len(every)} concealed campaigns ({seeds(head)}, {head['date']})", scores.figures(every), SAID_OF_CONCEALED, scores.lines(every))


def between(path, text, lines_, marks):
    """The text of a file with lines between these marks; the rest of it is kept."""
    start, end = marks
    if start not in text or end not in text:
        raise SystemExit(f"{path}: the lines '{start}' and '{end}' are missing; put them where the proof belongs")
    return text[:text.index(start)] + "\n".join([start, "", *lines_, ""]) + text[text.index(end):]


def readme(root, out, head, rows, others, measured, more=()):
    """Puts tables and pictures into the book's page of the proof, and their sentences into the README: of what there are results."""
    book, front = root / BOOK / "proof.md", root / "README.md"
    measured, texts, pictures = measured or Measured(), {p: p.read_text() for p in (book, front)}, []
    if measured.found:
        pictures.append("real.svg")
        texts[book] = between(book, texts[book], ["![misfit of real recordings before and after](images/real.svg)", "", *of_real(head, measured)], REAL)
        texts[front] = between(front, texts[front], ["![Misfit on levels that the fit did not see, real recordings](docs/src/images/real.svg)", "", said_of_real(head, measured)], REAL)
    if rows or more:
        drawn = ["", "![right answers by group](images/scoreboard.svg)", "", "![detected and named right against strength](images/detection.svg)"]
        texts[book] = between(book, texts[book], [*of_concealed(head, rows, others, more), *(drawn if rows else [])], CONCEALED)
        texts[front] = between(front, texts[front], [said_of_concealed(head, rows, more)], CONCEALED)
        pictures += ["scoreboard.svg", "detection.svg"] if rows else []
    (root / BOOK / "images").mkdir(exist_ok=True)
    for name in pictures:
        (root / BOOK / "images" / name).write_text((out / name).read_text())
    for path, text in texts.items():
        temp = path.with_suffix(".md.part")
        temp.write_text(text)
        temp.replace(path)
