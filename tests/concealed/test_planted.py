"""What is planted into real recordings, what is known of them, and how answers to both are counted."""
import json

import numpy as np
import pytest

from tests.concealed import known, planted, scores
from tests.concealed.judge import contained


def pulse(n=400, peak=1.0):
    t = np.linspace(0.0, 0.04, n)
    return t, -peak * np.exp(-((t - 0.02) / 0.003) ** 2) - 0.01


@pytest.fixture
def campaign(tmp_path):
    """Three drops whose acceleration is read, negative in the impact."""
    folder = tmp_path / "drops"
    folder.mkdir()
    text = '[campaign]\nname = "drops"\nkind = "drop-test"\n'
    for i in range(3):
        t, y = pulse(peak=100.0 * (i + 1))
        (folder / f"r{i}.csv").write_text("time [s],acceleration [m/s^2]\n" + "".join(f"{a!r},{b!r}\n" for a, b in zip(t.tolist(), y.tolist())))
        text += f'[[recording]]\nfile = "r{i}.csv"\nlevel = {i}\n'
    (folder / "campaign.toml").write_text(text)
    plain = tmp_path / "real" / "drops"
    plain.mkdir(parents=True)
    (plain / "verdict.json").write_text(json.dumps({"fit": {"before": {"heldout_nrmse": 0.002}}, "missing": [{"mechanism": "adhesion", "probability": 0.95, "also_possible": []}]}))
    return folder


def test_a_low_pass_answers_a_step_as_its_equation_does():
    t = np.linspace(0.0, 5.0, 2001)
    y = np.where(t > 0, 1.0, 0.0)
    late = planted.late(t, y, 0.7)
    assert np.allclose(late[1:], 1 - np.exp(-(t[1:] - t[1] / 2) / 0.7), atol=2e-3)


def test_a_flat_top_cuts_what_goes_farthest_from_rest():
    readings = [pulse(peak=p)[1] for p in (1.0, 3.0)]
    cut = planted.cut(readings, "acceleration")
    assert np.array_equal(cut[0], readings[0])
    assert cut[1].min() == pytest.approx(-0.01 - 0.85 * 3.0, abs=2e-3) and (cut[1] == cut[1].min()).sum() > 10
    force = planted.cut([-r for r in readings], "force")
    assert np.allclose(force[1], -cut[1])


@pytest.mark.parametrize("effect", planted.CHAIN)
def test_an_error_of_the_chain_shows_as_much_as_was_asked(effect):
    t, y = pulse()
    new = planted.chain([t, t], [y, 2 * y], effect, 0.005)
    seen = [np.sqrt(np.mean(planted.hidden(t, a, b - a) ** 2)) for a, b in zip((y, 2 * y), new)]
    assert np.mean(seen) == pytest.approx(0.005 * np.ptp(2 * y), rel=1e-3)
    assert planted.chain([t], [y], effect, 10.0) is None


def test_a_force_is_one_law_of_depth_and_rate_for_all_recordings():
    t = np.linspace(0.0, 1.0, 401)
    way = np.minimum(t, 1.0 - t) * 2e-3
    way[:40] = way[-40:] = 0.0
    recordings = [dict(time=t, penetration=k * way, force=1e6 * (k * way) ** 1.5 + 1e-3 * t) for k in (0.5, 1.0)]
    shallow, deep = planted.forces(recordings, "secondary_stiffening", 6.0)
    assert not shallow.any() and deep.max() > 0
    shallow, deep = planted.forces(recordings, "viscous_damping", 6.0)
    assert shallow.max() == pytest.approx(0.5 * deep.max(), rel=0.05)
    shallow, deep = planted.forces(recordings, "guide_friction", 6.0)
    assert shallow.max() == pytest.approx(deep.max(), rel=0.01)
    assert planted.forces(recordings, "secondary_stiffening", 1e4) is None


def test_the_same_seed_plants_the_same_and_the_labels_are_kept_apart(campaign, tmp_path):
    drawn = [planted.draw([campaign], tmp_path / "real", tmp_path / out, 4, [2.0], 1.0) for out in ("a", "b")]
    (cases, sealed), (_, again) = drawn
    assert sealed == again and len(cases) == 3
    assert not any(word in (c / "campaign.toml").read_text() + c.name for c in cases for word in [*planted.CHAIN, planted.FLAT])
    for c in cases:
        for f in ("r0.csv", "r2.csv"):
            assert (c / f).read_bytes() == (tmp_path / "b" / "open" / c.name / f).read_bytes()
    rows = {json.loads(p.read_text())["effect"] for p in (tmp_path / "a" / "truth").glob("*.json")}
    assert rows == {*planted.CHAIN, planted.FLAT}


def test_a_name_of_the_campaign_as_it_is_is_no_false_one_and_a_tie_held_open_counts(campaign, tmp_path):
    cases, _ = planted.draw([campaign], tmp_path / "real", tmp_path / "a", 4, [2.0], 1.0)
    said = {"clipping": [("clipping", 0.99, [])], "charge_droop": [("gravity", 0.95, []), ("adhesion", 0.99, [])], "lowpass_lag": [("channel_skew", 0.97, ["lowpass_lag"])]}
    for c in cases:
        effect = json.loads((tmp_path / "a" / "truth" / f"{c.name}.json").read_text())["effect"]
        (tmp_path / "a" / "verdicts" / c.name).mkdir(parents=True)
        missing = [{"mechanism": m, "probability": p, "also_possible": also} for m, p, also in said[effect]]
        (tmp_path / "a" / "verdicts" / c.name / "verdict.json").write_text(json.dumps({"missing": missing}))
    rows = planted.judge(cases, tmp_path / "a", tmp_path / "real")
    got = {r["effect"]: (r["named"], r["wrong"]) for r in rows}
    assert got == {"clipping": (True, []), "charge_droop": (False, ["gravity"]), "lowpass_lag": (True, [])}
    figures = planted.figures(rows)
    assert figures["flat"] == (1.0, 1, 1) and figures["planted2"] == (0.5, 1, 2) and figures["planted_wrong"] == (pytest.approx(1 / 3), 1, 3)
    assert "planted6" not in figures
    kept = {line[0]: line[-1] for line in scores.lines([], figures)}
    assert kept["a flat top planted: named"] is True and kept["planted: another name believed"] is False
    assert any(line.startswith("| clipping | cut by 15 % | 1 of 1") for line in planted.markdown(rows))


def test_what_is_known_is_written_in_names_of_the_vocabulary():
    from tests.concealed.effects import KNOWN
    names = set(KNOWN)
    for campaign, (needed, allowed, most, how) in known.known().items():
        assert needed | allowed <= names, campaign
        assert bool(needed) != (most is not None) and how
    listed = [c for s in known.sources() for c in s["campaigns"]]
    assert sorted(listed) == sorted(known.known())


def test_a_real_answer_is_right_where_all_is_named_and_nothing_false_believed():
    row = lambda campaign, probability, before=2.0, after=1.0: dict(campaign=campaign, answered=True, named=list(probability), probability=probability, levels=2, before=before, after=after)
    rows = [row("afm-gel", {"adhesion": 0.9}), row("switch-1", {"contact_preload": 1.0}), row("balls-from-a-bridge", {"fluid_drag": 0.8, "gravity": 0.95}), row("caught-drops", {}, after=0.9),
            row("caught-drops-cone", {}, after=1.5), row("of somebody else's", {})]
    assert [q[3] for q in known.judged(rows)] == [True, False, False, True, False]
    figures = known.figures(rows)
    assert figures["real"] == (0.4, 2, 5) and figures["real_wrong"] == (0.2, 1, 5) and figures["misfit"][0] == 0.5
    text = "\n".join(known.markdown([dict(r, unexplained=True) for r in rows]))
    assert "| afm-gel | adhesion |" in text and "bluepylons" in text and "somebody" not in text


def test_structures_that_fit_worse_than_what_they_contain_are_counted():
    of = lambda *tried: {"evidence": {"structures": [{"forms": list(f), "chi2": c} for f, c in tried]}}
    assert contained(of(((), 100.0), (("a",), 90.0), (("b",), 80.0), (("a", "b"), 85.0))) == (1, 5)
    assert contained(of(((), 100.0), (("a",), 100.5))) == (0, 1)
    assert contained({}) == (0, 0)
