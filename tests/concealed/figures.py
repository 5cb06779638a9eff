"""Pictures of the proof, as inline SVG or PNG."""
import base64
import io

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from .judge import CHANNELS, band, files, table

BLUE, ORANGE, GREY, RED, GREEN = "#1f5fa8", "#d9822b", "#8a8f98", "#b3261e", "#2e7d4f"
plt.rcParams.update({"font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.grid": True,
                     "grid.alpha": 0.25, "legend.frameon": False, "svg.hashsalt": "touchdown", "svg.fonttype": "none"})
LABEL = {"force": "force [N]", "acceleration": "acceleration [m/s²]", "penetration": "penetration [m]"}


def svg(fig):
    """The figure as an SVG element; closes it."""
    b = io.StringIO()
    fig.savefig(b, format="svg", bbox_inches="tight", metadata={"Date": None})
    plt.close(fig)
    s = b.getvalue()
    return s[s.index("<svg"):]


def png(fig):
    """The figure as an inlined image, for many points; closes it."""
    b = io.BytesIO()
    fig.savefig(b, format="png", dpi=110, bbox_inches="tight")
    plt.close(fig)
    return f'<img src="data:image/png;base64,{base64.b64encode(b.getvalue()).decode()}" alt="">'


def detection(rows):
    """Share detected and named right against strength, with the binomial 95 % band and the bound."""
    fig, ax = plt.subplots(figsize=(7, 3.4))
    one = [r for r in rows if r["group"] in ("plain", "concealed", "deep", "faint")]
    edges = [0.02, 0.25, 0.5, 0.75, 1.05, 2.0, 3.0, 5.0, 8.0, 14.0]
    for key, col, name in (("detected", GREY, "detected"), ("right", BLUE, "named right")):
        x, y, lo, hi = [], [], [], []
        for a, b in zip(edges, edges[1:]):
            rs = [r for r in one if a <= r["strength"] < b]
            if not rs:
                continue
            k = sum(r[key] for r in rs)
            l, h = band(k, len(rs))
            x.append(np.exp(np.mean(np.log([r["strength"] for r in rs]))))
            y.append(k / len(rs)); lo.append(l); hi.append(h)
            if key == "right":
                ax.annotate(str(len(rs)), (x[-1], -0.02), ha="center", va="top", fontsize=7, color=GREY)
        ax.plot(x, y, "o-", color=col, label=name)
        ax.fill_between(x, lo, hi, color=col, alpha=0.15)
    b = [(r["strength"], r["limit"]["p_right"]) for r in one if r.get("limit")]
    if b:
        ax.plot(*zip(*sorted(b)), ".", ms=3, color=ORANGE, label="best any method could name (two-class bound)")
    ax.set_xscale("log")
    ax.set_ylim(-0.1, 1.05)
    ax.set_xlabel("strength: misfit of the calibrated base over noise")
    ax.set_ylabel("share of cases")
    ax.legend(loc="lower right")
    return svg(fig)


def limits(rows):
    """Right names against the length of the trace that is left, beside the two-class bound averaged over the same cases."""
    fig, ax = plt.subplots(figsize=(7, 3.4))
    one = [r for r in rows if r.get("limit") and r["limit"]["sigmas"] > 0]
    if not one:
        plt.close(fig)
        return ""
    one.sort(key=lambda r: r["limit"]["sigmas"])
    parts = [q for q in np.array_split(np.arange(len(one)), max(min(len(one) // 6, 8), 1)) if len(q)]
    x, y, lo, hi, best = [], [], [], [], []
    for q in parts:
        rs = [one[i] for i in q]
        k = sum(r["right"] for r in rs)
        l, h = band(k, len(rs))
        x.append(np.exp(np.mean(np.log([r["limit"]["sigmas"] for r in rs]))))
        y.append(k / len(rs)); lo.append(l); hi.append(h)
        best.append(np.mean([r["limit"]["p_right"] for r in rs]))
        ax.annotate(str(len(rs)), (x[-1], -0.03), ha="center", va="top", fontsize=7, color=GREY)
    ax.plot(x, best, "s--", ms=4, color=ORANGE, label="best any method could do (two-class bound, mean)")
    ax.plot(x, y, "o-", color=BLUE, label="named right, nothing besides")
    ax.fill_between(x, lo, hi, color=BLUE, alpha=0.15)
    ax.set_xscale("log")
    ax.set_ylim(-0.1, 1.05)
    ax.set_xlabel("trace left after calibration, nuisances projected out [sigmas]")
    ax.set_ylabel("share of cases")
    ax.legend(loc="lower right")
    return svg(fig)


def fallen(found):
    """Misfit of real campaigns on levels that the fit did not see, before and after what was found (rows of real.section)."""
    rows = sorted((r for r in found if r["before"] and r["after"]), key=lambda r: r["after"] / r["before"])
    fig, ax = plt.subplots(figsize=(7.5, 0.8 + 0.26 * max(len(rows), 1)))
    for i, r in enumerate(rows):
        before, after = 100 * r["before"], 100 * r["after"]
        ax.plot([before, after], [i, i], color=GREY, lw=1, zorder=1)
        ax.plot(before, i, "o", color=ORANGE, ms=5, label="simulation as given, recalibrated" if i == 0 else None)
        ax.plot(after, i, "o", color=BLUE, ms=5, label="with what was found" if i == 0 else None)
        named = " + ".join(r["named"]).replace("_", " ")
        ax.annotate(named or ("a learned force" if after < 0.99 * before else "nothing"), (1.02, i), xycoords=("axes fraction", "data"), va="center", fontsize=7, color=GREY)
    ax.set_yticks(range(len(rows)), [r["campaign"] for r in rows], fontsize=7.5)
    ax.invert_yaxis()
    ax.set_xscale("log")
    ax.set_xlabel("misfit on levels that the fit did not see [% of range]")
    ax.legend(loc="lower right", fontsize=7.5)
    return svg(fig)


def scoreboard(summ, targets):
    """Right answers by group with band, target and floor."""
    fig, ax = plt.subplots(figsize=(7, 2.9))
    for i, (g, s) in enumerate(summ.items()):
        lo, hi = band(s["right"], s["n"])
        q = s["right"] / s["n"]
        t = targets.get(g)
        ok = GREY if t is None else GREEN if q >= t[0] else BLUE if q >= t[1] else RED
        ax.barh(i, q, color=ok, height=0.6)
        ax.plot([lo, hi], [i, i], color="black", lw=1)
        if t:
            ax.plot([t[1]] * 2, [i - 0.4, i + 0.4], color="black", lw=1, ls=":")
            ax.plot([t[0]] * 2, [i - 0.4, i + 0.4], color="black", lw=1.4)
        ax.text(0.01, i, f"{s['right']}/{s['n']}", va="center", color="white" if q > 0.1 else "black", fontsize=8)
    ax.set_yticks(range(len(summ)), list(summ))
    ax.invert_yaxis()
    ax.set_xlim(0, 1)
    ax.set_xlabel("answered right (dotted: floor, solid: target, line: 95 % band)")
    ax.grid(axis="y", visible=False)
    return svg(fig)


def reliability(found):
    """Share right against probability reported, five bins with the binomial 95 % band; the line is what should be."""
    bins, error = found
    fig, ax = plt.subplots(figsize=(4.2, 3.4))
    ax.plot([0, 1], [0, 1], color=GREY, lw=0.8)
    for p, q, n in bins:
        if n:
            lo, hi = band(round(q * n), n)
            ax.plot([p, p], [lo, hi], color=BLUE, lw=1.2)
            ax.plot(p, q, "o", color=BLUE)
            ax.annotate(str(n), (p, q), textcoords="offset points", xytext=(6, -3), fontsize=7, color=GREY)
    ax.set_xlim(-0.03, 1.03)
    ax.set_ylim(-0.03, 1.03)
    ax.set_xlabel("probability reported")
    ax.set_ylabel("share right")
    ax.set_title("" if error is None else f"calibration error {error:.3f}", fontsize=9)
    return svg(fig)


def confusion(rows):
    """Hidden mechanism against the first name given."""
    one = [r for r in rows if r["group"] in ("plain", "concealed", "deep", "unknown", "null", "faint")]
    ys = sorted({(r["truth"] or ["nothing"])[0] for r in one}, key=lambda s: (s == "nothing", s.startswith("unknown"), s))

    def said(r):
        if r["named"]:
            c = [n for n in r.get("counted", r["named"]) if n in r["truth"]]
            return c[0] if c else r["named"][0]
        return "unexplained" if r["unexplained"] else "nothing"
    xs = sorted({said(r) for r in one} | set(y for y in ys if not y.startswith("unknown")), key=lambda s: (s == "nothing", s == "unexplained", s))
    M = np.zeros((len(ys), len(xs)), int)
    for r in one:
        M[ys.index((r["truth"] or ["nothing"])[0]), xs.index(said(r))] += 1
    fig, ax = plt.subplots(figsize=(0.33 * len(xs) + 3, 0.27 * len(ys) + 2))
    share = M / np.maximum(M.sum(1, keepdims=True), 1)
    ax.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for i in range(len(ys)):
        for j in range(len(xs)):
            if M[i, j]:
                ax.text(j, i, M[i, j], ha="center", va="center", fontsize=7, color="white" if share[i, j] > 0.5 else "black")
    ax.set_xticks(range(len(xs)), xs, rotation=60, ha="right", fontsize=7)
    ax.set_yticks(range(len(ys)), ys, fontsize=7)
    ax.set_xlabel("first name given")
    ax.set_ylabel("hidden")
    ax.grid(False)
    return svg(fig)


def gains(rows):
    """Held-out misfit before and after over the oracle's."""
    fig, ax = plt.subplots(figsize=(5, 3.4))
    for g, c in (("plain", GREY), ("concealed", BLUE), ("deep", ORANGE), ("pair", GREEN)):
        rs = [r for r in rows if r["group"] == g and r["before"] and r["after"]]
        if rs:
            ax.plot([r["before"] / r["oracle"] for r in rs], [r["after"] / r["oracle"] for r in rs], "o", ms=4, color=c, label=g, alpha=0.8)
    ax.plot([0.9, 12], [0.9, 12], color="black", lw=0.8)
    ax.axhline(1, color="black", lw=0.8, ls=":")
    ax.set_xscale("log"); ax.set_yscale("log")
    ax.set_xlabel("held-out misfit before, over the oracle's")
    ax.set_ylabel("after, over the oracle's")
    if ax.get_legend_handles_labels()[0]:
        ax.legend()
    return svg(fig)


def traces(case, answer, title="", count=2):
    """Recording, before and after of a low and a high level, with what is left below each."""
    names = files(case)
    pick = [names[0], names[-1]][-count:]
    have = [c for c in CHANNELS if c in table(case / pick[0])]
    fig, axs = plt.subplots(2 * len(pick), len(have), figsize=(4 * len(have), 2.1 * 2 * len(pick)), squeeze=False,
                            gridspec_kw={"height_ratios": [2, 1] * len(pick)})
    for i, n in enumerate(pick):
        a = table(case / n)
        t = a["time"]
        preds = []
        for k, c in (("before", ORANGE), ("after", BLUE)):
            p = answer / "predictions" / k / n
            if p.exists():
                preds.append((k, c, table(p)))
        for j, ch in enumerate(have):
            ax, rx = axs[2 * i, j], axs[2 * i + 1, j]
            ax.plot(t, a[ch], color="#c3c7cd", lw=2.2, label="recording")
            for k, c, p in preds:
                if ch in p and len(p[ch]) == len(t):
                    ax.plot(t, p[ch], color=c, lw=0.9, label=k)
                    rx.plot(t, a[ch] - p[ch], color=c, lw=0.7)
            ax.set_title(f"{n}: {ch}", fontsize=8)
            rx.set_ylabel("left", fontsize=7)
            for q in (ax, rx):
                q.tick_params(labelsize=6)
    axs[0, 0].legend(fontsize=7)
    if title:
        fig.suptitle(title, fontsize=9)
    fig.tight_layout()
    return png(fig)
