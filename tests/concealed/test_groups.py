"""The groups as real as a rig: what they draw, what the strangers do, and how answers on them are scored."""
import json
import tomllib

import numpy as np
import pytest

from tests.concealed import chain, motion as m, page, prove, rigs, scores, weights
from tests.concealed.effects import DEPENDS, FORMS, HALF, KNOWN, OUTSIDE, of_half
from tests.concealed.groups import DIRT, GROUPS, LITTLE, attempt, cut, draw_group, fine_print, plan, soiled
from tests.concealed.judge import files, judge, learned, table
from tests.concealed.test_lab import body, ride


def a_rig(seed=3, kind="drop-test", channels=rigs.CHANNELS):
    return rigs.draw(np.random.default_rng(seed), kind, True, channels)


def test_the_halves_of_the_strangers_are_apart_and_out_of_today_s_mix():
    dev, sealed = of_half("development"), of_half("sealed")
    assert len(dev) >= 5 and len(sealed) >= 5 and not set(dev) & set(sealed) and len(dev) + len(sealed) >= 10
    assert not set(HALF) & (set(KNOWN) | set(OUTSIDE)) and set(HALF) | set(KNOWN) | set(OUTSIDE) == {k[0] for k in FORMS}
    text = " ".join(scores.halves())
    assert all(n.removeprefix("unknown:") in text for n in HALF)
    for group, half in (("strangers", dev), ("sealed", sealed)):
        assert {n for _, n in plan(np.random.default_rng(1), group, 20)} == set(half)


def test_plans_deal_out_every_kind_of_dirt_and_of_little():
    rng = np.random.default_rng(1)
    dirt, little, small = plan(rng, "dirt", 18), plan(rng, "little", 20), plan(rng, "print", 10)
    assert {d for d, _ in dirt} == set(DIRT) and {d for d, _ in little} == set(LITTLE)
    assert sum(n is None for _, n in small) == 4 and sum(n is None for _, n in dirt) == 14 and sum(n is None for _, n in little) == 6


def test_small_print_is_small_and_calibration_does_not_remove_all_of_it():
    for seed in range(6):
        rig = a_rig(seed)
        a, b = (rigs.simulate(rig, rig.P, e) for e in ([(fine_print(np.random.default_rng(seed), rig), 1.0)], []))
        off = np.concatenate([(p["contact"] - q["contact"])[q["contact"] > 0.2 * rig.ref["Fmax"]] for p, q in zip(a, b)]) / rig.ref["Fmax"]
        assert 5e-4 < np.sqrt(np.mean(off ** 2)) < 0.06
        for p in a:                # nothing is gained: the body leaves slower than it came
            assert p["v"][-1] ** 2 < 1.05 * np.max(p["v"]) ** 2


def test_a_rough_law_is_some_times_as_far_off_and_leaves_out_what_cannot_stand_out_of_it():
    rig, far = a_rig(3), []
    for times in (1.0, 4.0):
        a, b = (rigs.simulate(rig, rig.P, e) for e in ([(fine_print(np.random.default_rng(3), rig, times), 1.0)], []))
        far.append(np.sqrt(np.mean(np.concatenate([p["contact"] - q["contact"] for p, q in zip(a, b)]) ** 2)))
    assert 2.5 < far[1] / far[0] < 6.0
    drawn = plan(np.random.default_rng(1), "rough", 40)
    assert "gravity" not in {n for _, n in drawn} and sum(n is None for _, n in drawn) == 12


@pytest.mark.parametrize("key", [k for k in FORMS if k[0] in HALF], ids=lambda k: k[0].removeprefix("unknown:"))
def test_every_stranger_acts(key):
    rig = a_rig()
    apply = FORMS[key][2](np.random.default_rng(2), rig)
    a, b = (rigs.simulate(rig, rig.P, e) for e in ([(apply, 0.1)], []))
    moved = max(np.sqrt(np.mean(((p[c] - q[c]) / rig.sigma[c]) ** 2)) for p, q in zip(a, b) for c in rig.channels)
    assert moved > 0.3


def test_conservative_strangers_give_the_energy_back_and_the_others_take_it():
    def back(**more):
        return -ride(body(M=0.7, K=2e8, PW=1.7, **more), -1e-3, 0.9, 0.05)[1][-1, 1]
    assert back() == pytest.approx(0.9, rel=1e-6)
    assert back(PLAT=0.4, PLAT_X=2e-4, PLAT_W=4e-5) == pytest.approx(0.9, rel=1e-6)
    lossy = dict(loss=dict(LOSS=0.1, LOSS_V=0.01), pad=dict(TH=800.0, TH_V=0.3, TH_D=2e-5), side=dict(SIDE=0.1), pawl=dict(PAWL=3.0), skin=dict(SKIN_F=500.0, SKIN_D=1e-4))
    for what, more in lossy.items():
        assert 0.2 < back(**more) < 0.899, what
    # a latch pulls in and holds back alike: at the height it came from the body is as fast as it was
    out = ride(body(M=0.7, K=2e8, PW=1.7, LA_F=40.0, LA_Z=4e-4), -2e-3, 0.9, 0.01, 8000)[1]
    turn = int(np.argmax(out[:, 0]))
    home = turn + int(np.argmax(out[turn:, 0] < -2e-3))
    assert home > turn and -out[home, 1] == pytest.approx(0.9, rel=1e-3)


def test_chain_strangers_do_what_they_say():
    dt, n = 1e-5, 2000
    t = np.arange(n) * dt
    f = np.exp(-((t - 0.01) / 0.001) ** 2) * 100.0
    sig = dict(force=f, acceleration=-f, penetration=0 * f)
    assert chain.through(sig, dt, {"straight": {"force": (0.05, 100.0)}})["force"].max() == pytest.approx(105.0, rel=1e-3)
    after = chain.through(sig, dt, {"zero_shift": ("acceleration", 3.0, 1e-4)})["acceleration"]
    assert np.allclose(after[:900], -f[:900]) and after[-1] == pytest.approx(3.0, rel=1e-3)
    lost = chain.through(sig, dt, {"lost": ("force", 0.01, 2e-4)})["force"]
    assert np.allclose(lost[:1000], f[:1000]) and np.allclose(lost[1001:1900], f[1021:1920], atol=1e-3)
    assert chain.through(sig, dt, {"bracket": (1e-6, 2e4, 0.2)})["penetration"].max() == pytest.approx(1e-4, rel=0.02)
    rub = chain.through(sig, dt, {"rub": (0.5, 10.0)})["force"]
    assert np.all(np.abs(rub - f) <= 2.5 + 1e-9) and np.ptp(rub - f) > 4.0
    flat = chain.through(sig, dt, {"ringing": [("force", 0.01, 2e3, 0.02)]})["force"] - f
    assert 0 < np.abs(flat).max() < 2.0


@pytest.mark.parametrize("what", [d for d in DIRT if d != "scatter"])
def test_dirt_is_seen_and_bounded(what):
    rng, rig = np.random.default_rng(4), a_rig()
    data = [{c: s[c].copy() for c in rig.channels} for s in rigs.simulate(rig, rig.P)]
    out, clocks = soiled(rng, rig, data, what)
    assert all(len(r[c]) == len(t) and np.all(np.diff(t) > 0) for r, t in zip(out, clocks) for c in rig.channels)
    if what == "two systems":
        assert len(clocks[1]) < 0.6 * len(data[1]["force"]) and len(clocks[0]) == len(data[0]["force"])
        return
    if what == "jitter":
        assert 0.01 < max(np.std(np.diff(t)) / rig.dt for t in clocks) < 0.6
        return
    worst = max(np.sqrt(np.mean((a[c] - b[c]) ** 2)) / rig.sigma[c] for a, b in zip(data, out) for c in rig.channels)
    assert 0.3 < worst < 40


def test_scatter_is_three_times_as_wide():
    rig = a_rig()
    from tests.concealed.generate import record
    peak = lambda scatter: np.array([max(d["force"]) for d in record(np.random.default_rng(6), rig, [], (False, False), scatter)[0]])
    base = peak(0.0)
    assert np.std(peak(0.015) / base) > 2.0 * np.std(peak(0.005) / base)


@pytest.mark.parametrize("what, count, levels", [("three drops", 3, 3), ("one level", 2, 1), ("one recording", 1, 1)])
def test_little_is_little(what, count, levels):
    rig = a_rig()
    cut(rig, what, None)
    assert len(rig.recs) == count and len({r.level for r in rig.recs}) == levels and [r.order for r in rig.recs] == list(range(1, count + 1))


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    d = tmp_path_factory.mktemp("groups")
    draw_group(5, 3, "dirt", d)
    draw_group(5, 2, "little", d)
    draw_group(5, 1, "strangers", d)
    return d


def test_groups_are_recordings_1_with_labels_that_hold_the_group(drawn):
    cases = sorted((drawn / "open").iterdir())
    assert len(cases) == 6
    for case in cases:
        t = json.loads((drawn / "truth" / f"{case.name}.json").read_text())
        assert t["set"] in GROUPS and f"-{t['set']}-" in case.name and t["base_refit_r2"] > 0.99
        c = tomllib.loads((case / "campaign.toml").read_text())
        assert c["format"] == "recordings/1" and c["campaign"]["kind"] == t["kind"]
        for r in c["recording"]:
            a = table(case / r["file"])
            assert np.all(np.diff(a["time"]) > 0) and all(np.isfinite(v).all() for v in a.values())
        assert t["set"] not in (case / "campaign.toml").read_text().replace(case.name, "")


def answer(drawn, tmp_path, name, v):
    case, folder = drawn / "open" / name, tmp_path / name
    for k in ("before", "after"):
        (folder / "predictions" / k).mkdir(parents=True, exist_ok=True)
        for f in files(case):
            (folder / "predictions" / k / f).write_bytes((case / f).read_bytes())
    (folder / "verdict.json").write_text(json.dumps(v))
    return judge(case, json.loads((drawn / "truth" / f"{name}.json").read_text()), folder)


def said(names=(), detected=None, unexplained=False, **more):
    return {"mismatch": {"detected": bool(names) or unexplained if detected is None else detected}, "missing": [{"mechanism": n, "probability": p} for n, p in names],
            "unexplained": {"detected": unexplained}} | more


def test_a_law_off_by_some_per_cent_is_nothing_or_unknown_but_no_name():
    row = lambda said: scores.verdict_scores(
        {"posterior": [{"mechanisms": said, "probability": 0.9}], "credible_set": [{"mechanisms": said}], "missing": []},
        {"group": "rough0", "truth": [], "named": [], "also": []})
    assert row([])["top"] == row(["unknown"])["top"] == (0.9, True) and not row(["adhesion"])["top"][1]
    assert weights.cause({"missing": [], "set": "rough"}) == weights.UNKNOWN
    assert weights.cause({"missing": ["adhesion"], "set": "rough"}) == frozenset({"adhesion"})


def test_answers_on_groups_are_judged_by_their_own_rules(drawn, tmp_path):
    names = {p.stem: json.loads(p.read_text()) for p in (drawn / "truth").glob("*.json")}
    null = next(n for n, t in names.items() if t["set"] == "dirt" and not t["missing"])
    r = answer(drawn, tmp_path, null, said())
    assert r["right"] and r["group"] == "dirt0" and not r["believed"] and r["top"] == (1.0, True)
    r = answer(drawn, tmp_path, null, said([("adhesion", 0.95)]))
    assert not r["right"] and r["believed"] == ["adhesion"] and r["top"] == (0.95, False)
    strange = next(n for n, t in names.items() if t["set"] == "strangers")
    assert answer(drawn, tmp_path, strange, said(unexplained=True))["right"]
    assert answer(drawn, tmp_path, strange, said([("adhesion", 0.4)], unexplained=True))["right"]
    r = answer(drawn, tmp_path, strange, said([("adhesion", 0.6)], unexplained=True))
    assert not r["right"] and not r["believed"]
    r = answer(drawn, tmp_path, strange, said(unexplained=True, posterior=[{"mechanisms": ["unknown"], "probability": 0.7}, {"mechanisms": [], "probability": 0.3}],
                                              credible_set=[{"mechanisms": ["unknown"]}, {"mechanisms": []}]))
    assert r["top"] == (0.7, True) and r["held"] == (True, 2)
    r = answer(drawn, tmp_path, strange, said(unexplained=True, credible_set=[{"mechanisms": ["clipping"]}]))
    assert r["held"] == (False, 1)


def test_what_was_learned_of_a_stranger_is_judged_by_part_and_dependence():
    truth = dict(missing=["unknown:latch"], origin=["motion"], kind="drop-test")
    law = lambda *classes: {"sets": [{"classes": ["contact: depth"], "probability": 0.2}, {"classes": list(classes), "probability": 0.7}]}
    said = lambda origin, law, unexplained=True: {"mismatch": {"where": [{"origin": origin}]}, "learned": law, "unexplained": {"detected": unexplained}}
    assert learned(said("motion", law("body: place")), truth) == dict(part=True, depends=True)
    assert learned(said("motion", law("squeeze_film", "body: place")), truth)["depends"]
    assert learned(said("contact", law("contact: depth")), truth) == dict(part=False, depends=False)
    assert learned(said("motion", law("body: place"), unexplained=False), truth) == dict(part=True, depends=False)
    assert learned({"mismatch": {}}, truth) == dict(part=False, depends=False)
    # no class holds it; the classes of indentations are others
    assert learned(said("chain", law("body: place")), truth | dict(missing=["unknown:echo"], origin=["chain"])) == dict(part=True, depends=None)
    assert learned(said("motion", law("body: place")), truth | dict(kind="indentation"))["depends"] is None


def test_every_stranger_says_which_classes_hold_it():
    assert set(DEPENDS) == set(HALF) | set(OUTSIDE)
    stand_ins = {"bent_scale", "fracture", "jam", "ripple"}
    assert all(c in stand_ins or c.startswith(("contact: ", "body: ", "reading of ")) for classes in DEPENDS.values() for c in classes)


def test_shares_of_strangers_are_a_median_and_parts_are_counted():
    rows = [a_row("strangers", True, 1.0, True, ("unknown:latch",), part=True, depends=True, share=s) for s in (0.2, 0.9, 1.0)]
    rows += [a_row("unknown", False, 1.0, True, ("unknown:echo",), part=False), a_row("plain", True, 1.0, True)]
    got = scores.figures(rows)
    assert got["part"] == (0.75, 3, 4) and got["depends"] == (1.0, 3, 3) and got["share"] == (0.9, None, 3)


def test_little_counts_a_name_that_is_held_open():
    row = dict(group="little", truth=["adhesion"], named=["clipping"], also=[], open=["adhesion"], detected=True)
    assert scores.right_in_group(row, {}) and not scores.right_in_group(row | {"open": []}, {})
    assert scores.right_in_group(row | {"open": [], "also": ["adhesion"]}, {})


def a_row(group, right, p, ok, truth=("x",), **more):
    return dict(group=group, right=right, top=(p, ok), truth=list(truth), answered=True, detected=True, located=True, held=None, believed=[], worse=False, poorer=False, contained=(0, 4), gain=None,
                part=None, depends=None, share=None, parameters=[], set=None, case="c", false_names=[], probability={}) | more


def test_reliability_is_the_mean_gap_between_reported_and_right():
    rows = [a_row("plain", True, 0.9, True)] * 8 + [a_row("plain", False, 0.9, False)] * 2 + [a_row("deep", True, 0.5, True)] * 5 + [a_row("deep", False, 0.5, False)] * 5
    bins, error = scores.reliability(rows)
    assert error == pytest.approx(0.05) and bins[4] == (pytest.approx(0.9), pytest.approx(0.8), 10) and bins[0] == (None, None, 0)
    assert scores.reliability([a_row("many", True, 0.9, False)])[1] is None


def test_the_table_says_what_is_held_and_what_falls_short():
    rows = [a_row("plain", True, 1.0, True)] * 19 + [a_row("plain", False, 1.0, False, believed=["y"])] + [a_row("print0", False, 1.0, False, (), set="print")]
    got = {line[0]: line for line in scores.lines(rows)}
    assert got["plain and concealed: named, nothing besides"][1:4] == ("20", "19", "0.95") and got["plain and concealed: named, nothing besides"][6] is True
    assert got["small print, nothing missing: no name"][3] == "0.00" and got["small print, nothing missing: no name"][6] is False
    assert got["95 % sets hold the cause"][1:4] == ("-", "-", "-")
    wrong = next(line for what, line in got.items() if what.startswith("a wrong name believed"))
    assert wrong[1:4] == ("21", "1", "0.05") and wrong[6] is True
    rows[0] = a_row("plain", True, 1.0, True, held=(True, 3), parameters=[("a.b", 1.0, 1.1, 0.9, 1.2), ("a.c", 1.0, 2.0, 1.5, 2.5)])
    text = "\n".join(scores.markdown(rows))
    assert "| 95 % sets hold the cause | 1 | 1 | 1.00 |" in text and "| plain | 20 | 1 | 3.0 | 1.00 | 1/2 |" in text and "short |" in text


def test_a_set_may_name_a_group():
    assert prove.a_set("41/100:print") == (41, 100, "print") and page.as_set((41, 100, "print")) == "41/100:print"
    import argparse
    for bad in ("41/3:", "41/3:prints", "41/0:dirt"):
        with pytest.raises(argparse.ArgumentTypeError):
            prove.a_set(bad)


def test_groups_come_beside_every_set(monkeypatch, tmp_path):
    monkeypatch.setattr("sys.argv", ["prove", "41/10", "42/4:dirt", "--groups", "--out", str(tmp_path / "p")])
    o = prove.options()
    assert o.sets == [(41, 10)] and o.more == [(42, 4, "dirt")] + [(41, 3, g) for g in GROUPS]
    head = dict(sets=o.sets, groups=o.more, cases=10)
    assert page.command(head).startswith("tests/prove 41/10 42/4:dirt 41/3:print") and page.seeds(head) == "seeds 41, 42"


def test_a_late_channel_by_itself_is_a_time_offset_and_no_effect():
    taken = {("channel_skew", "drifting-clock"): 1, ("channel_skew", "early"): 1}
    assert attempt(np.random.default_rng(2), "little", "force alone", "channel_skew", taken) is None


def test_one_recording_cannot_conceal_what_needs_several():
    for t in range(3):
        assert attempt(np.random.default_rng([1, t]), "little", "one recording", "cyclic_hardening", {}) is None
