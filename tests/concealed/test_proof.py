"""The proof's own parts: the page and its lines in book and README, the rivals' arithmetic, what real recordings are asked."""
import argparse
import json
from types import SimpleNamespace

import numpy as np
import pytest

from tests.concealed import independent, page, prove, real, scores
from tests.concealed.beside import right_name
from tests.concealed.beside_base import carried
from tests.concealed.generate import generate, label_hash
from tests.concealed.judge import files


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    """Two cases with answers that name what is hidden, and one case without an answer."""
    out = tmp_path_factory.mktemp("proof")
    generate(41, 3, out, None)
    cases = sorted((out / "open").iterdir())
    runs = {c.name: dict(code=0, seconds=2.0, cpu=1.0, mb=10.0, printed="said") for c in cases}
    for c in cases[:2]:
        t = json.loads((out / "truth" / f"{c.name}.json").read_text())
        answer = out / "verdicts" / c.name
        for k in ("before", "after"):
            (answer / "predictions" / k).mkdir(parents=True)
            for f in files(c):
                (answer / "predictions" / k / f).write_bytes((c / f).read_bytes())
        (answer / "verdict.json").write_text(json.dumps({
            "mismatch": {"detected": bool(t["missing"]), "where": [{"origin": (t["origin"] or ["contact"])[0], "phase": max(t["acts"], key=t["acts"].get)}]},
            "missing": [] if any(m.startswith("unknown:") for m in t["missing"]) else [{"mechanism": m} for m in t["missing"]],
            "unexplained": {"detected": any(m.startswith("unknown:") for m in t["missing"])}}))
    return out, prove.opened(cases, out, runs)


def head(out):
    return dict(sets=[(41, 3)], cases=3, date="2000-01-02", commit="abc", jobs=1, sha256=label_hash(out / "truth"), binary="b")


def test_the_page_holds_hash_scores_and_every_wrong_case(answered):
    out, rows = answered
    page.write(out, head(out), rows, None, None, None)
    text = (out / "index.html").read_text()
    assert label_hash(out / "truth") in text and "tests/prove 41/3" in text
    assert [r["right"] for r in rows] == [True, True, False]
    assert "All 1 cases not answered right" in text and rows[2]["case"] in text
    assert "no answer" in text


def test_book_and_readme_keep_what_is_not_the_proof_s(answered, tmp_path):
    out, rows = answered
    page.write(out, head(out), rows, None, None, None)
    book, readme = tmp_path / "docs" / "src" / "proof.md", tmp_path / "README.md"
    book.parent.mkdir(parents=True)
    (start, end), (real_start, real_end) = page.CONCEALED, page.REAL
    for path in (book, readme):
        path.write_text(f"before\n{real_start}\nof real ones\n{real_end}\n{start}\nwhat stood there\n{end}\nafter\n")
    page.readme(tmp_path, out, head(out), rows, None, None)
    once = book.read_text(), readme.read_text()
    page.readme(tmp_path, out, head(out), rows, None, None)
    assert (book.read_text(), readme.read_text()) == once
    for text in once:
        assert text.startswith(f"before\n{real_start}\nof real ones\n") and text.endswith("\nafter\n") and "what stood there" not in text and "seed 41, 2000-01-02" in text
    for name in ("scoreboard.svg", "detection.svg"):
        assert f"images/{name}" in once[0] and (book.parent / "images" / name).read_text().count("<svg") == 1
    assert page.said_of_concealed(head(out), rows) in once[1] and "Of 3 concealed campaigns (seed 41" in once[1]
    readme.write_text("no markers\n")
    with pytest.raises(SystemExit, match="README.md.*missing"):
        page.readme(tmp_path, out, head(out), rows, None, None)
    assert readme.read_text() == "no markers\n" and book.read_text() == once[0]


def test_real_recordings_have_a_part_of_their_own_in_book_and_readme(answered, tmp_path):
    out, rows = answered
    found = dict(campaign="afm-gel", answered=True, seconds=1.0, named=["adhesion"], probability={"adhesion": 0.97}, levels=2, before=0.04, after=0.01, figures=[])
    grown = dict(campaign="afm-gel", case="planted-000", effect="clipping", strength=0.0, named=True, found=["clipping"], wrong=[])
    measured = page.Measured([found], "<p>of it</p>", [grown])
    page.write(out, dict(head(out), planted="seal"), rows, None, measured, None)
    text = (out / "index.html").read_text()
    assert "seal" in text and "of it" in text and "real recordings answered as known" in text
    book = tmp_path / "docs" / "src" / "proof.md"
    book.parent.mkdir(parents=True)
    for path in (book, tmp_path / "README.md"):
        path.write_text("".join(f"{a}\nas it was\n{b}\n" for a, b in (page.REAL, page.CONCEALED)))
    page.readme(tmp_path, out, dict(head(out), planted="seal"), [], None, measured)
    said = (tmp_path / "README.md").read_text()
    assert said.count("as it was") == 1 and "of 1 campaigns whose missing physics is known 1 are answered so" in said and "falls to 0.25 of what it was" in said and "of 1 peaks cut flat 1" in said
    assert "| afm-gel | adhesion |" in book.read_text() and (book.parent / "images" / "real.svg").read_text().count("<svg") == 1


def test_the_sentence_counts_what_the_tables_count(answered):
    out, rows = answered
    got = scores.figures(rows)
    said = page.said_of_concealed(head(out), rows)
    for key, words in page.SAID_OF_CONCEALED.items():
        assert (words.format(n=got[key][2], k=got[key][1]) in said) if key in got else words.rpartition("}")[2] not in said
    assert "wrong" in got
    for what, *_, kept in scores.lines(rows):
        assert (f'"{what}"' in said) == (kept is False)


def test_readme_and_book_have_a_place_for_the_proof():
    for path in (page.BOOK / "proof.md", "README.md"):
        for marks in (page.REAL, page.CONCEALED):
            text = (prove.ROOT / path).read_text()
            assert page.between(path, text, ["said"], marks).count("said\n") >= 1


def test_a_set_is_a_seed_and_a_number():
    assert prove.a_set("41/100") == (41, 100)
    for bad in ("41", "41/", "/3", "41/0", "a/3", "41/-1"):
        with pytest.raises(argparse.ArgumentTypeError):
            prove.a_set(bad)


def test_what_is_wrong_most_comes_first():
    row = lambda name, right, said: dict(truth=[name], right=right, named=[said] if said else [], unexplained=False, answered=True)
    rows = [row("adhesion", True, "adhesion"), row("adhesion", False, "clipping"), row("gravity", False, ""), row("gravity", False, "adhesion"), row("clipping", True, "clipping")]
    assert page.wrong_most(rows) == [("gravity", 2, 2, ["adhesion", "nothing"]), ("adhesion", 1, 2, ["clipping"])]


def test_a_force_is_carried_through_the_motion():
    """A constant body force on a damped oscillator: the closed solution, to the order of the step."""
    dt, mass, k, c = 1e-5, 0.5, 2e4, 20.0
    t = np.arange(4000) * dt
    one = np.ones(len(t))
    x, v, a = carried(dt, mass, k * one, c * one, 0.0, 0 * one, 3.0 * one)
    n, w = c / 2 / mass, np.sqrt(k / mass - (c / 2 / mass) ** 2)
    want = 3.0 / k * (1 - np.exp(-n * t) * (np.cos(w * t) + n / w * np.sin(w * t)))
    assert np.allclose(x, want, atol=2e-4 * want.max())
    assert np.allclose(carried(dt, mass, k * one, c * one, 0.0, 3.0 * one, 0 * one)[0], -x)


def test_rivals_get_a_tie_right_only_with_the_other_held_open():
    assert right_name(["adhesion"], ["adhesion"], [])
    assert not right_name(["adhesion"], ["adhesion", "clipping"], [])
    assert not right_name(["lowpass_lag"], ["channel_skew"], [])
    assert right_name(["lowpass_lag"], ["channel_skew"], ["lowpass_lag"])


def test_real_recordings_tell_of_set_hold_and_pull():
    t = np.linspace(0, 3, 3001)
    x = np.interp(t, [0, 1, 2, 3], [-0.1, 1.0, 1.0, -0.1])
    set_ = 0.4
    f = np.where(t < 1, np.maximum(x, 0) ** 1.5, np.where(t < 2, 1 - 0.3 * (t - 1), 0.7 * np.maximum((x - set_) / (1 - set_), 0) ** 1.5))
    a = dict(time=t, penetration=x, force=f)
    assert real.set_left(a) == pytest.approx(0.45, abs=0.06)
    loss, long = real.hold_loss(a)
    assert loss == pytest.approx(0.3, abs=0.03) and long == pytest.approx(1.0, abs=0.08)
    noise = np.random.default_rng(3).normal(0, 1e-4, len(t))
    b = dict(a, force=f + noise - 0.1 * np.exp(-((t - 2.9) / 0.02) ** 2))
    sigmas, share = real.pull_off(b)
    assert sigmas > 100 and share == pytest.approx(0.1, abs=0.005)


@pytest.mark.parametrize("form, n", [("permanent set", 1.5), ("permanent set, unloading power free", 1.3), ("Walton-Braun", 1.0)])
def test_an_indentation_is_read_as_the_diagnosis_says_it(form, n):
    p, r, y, d = 1.5, 0.4, 0.1, 1.1
    s = r * (d - y)
    x = np.interp(np.linspace(0, 2, 4001), [0, 1, 2], [0.0, d, 0.0])
    f = np.where(np.arange(4001) <= 2000, x ** p, d ** p * np.maximum((x - s) / (d - s), 0) ** n)
    value = lambda v: {"value": v, "ci95": [0.99 * v, 1.01 * v]}
    entry = {"mechanism": "plastic_indentation", "form": form, "parameters": {"plastic_ratio": value(r), "yield_penetration": value(y)}}
    if "free" in form:
        entry["parameters"]["plastic_unloading_exponent"] = value(n)
    verdict = {"missing": [entry], "fit": {"base_bias": {"parameters": [{"name": "p", "after": p}]}}}
    found = independent.permanent_set(SimpleNamespace(name="x"), [dict(penetration=x, force=f)], [1.0], verdict)
    assert len(found) == 2
    for figure in found:
        assert figure.error == pytest.approx(0, abs=3e-3) and figure.holds, figure
    # with a second mechanism the way back is no power of the depth
    assert independent.unloading(dict(verdict, missing=[entry, {"mechanism": "adhesion"}])) is None


def test_the_delay_of_a_clipped_and_late_sensor_is_found():
    t = np.arange(0, 0.2, 1e-4)
    y = lambda s: -300 * np.exp(-((t - 0.1 - s) / 0.01) ** 2)
    good = dict(time=t, acceleration=y(0.0))
    late = dict(time=t, acceleration=np.clip(y(0.0015), -200, 200))
    assert real.delay(good, late) == pytest.approx(0.0015, abs=1e-4)


def shock(rings, width=3e-4, rate=50e3):
    """A half sine of 1 that rings on."""
    t = np.arange(0, 6e-3, 1 / rate)
    pulse = np.where((t > 1e-3) & (t < 1e-3 + width), np.sin(np.pi * (t - 1e-3) / width), 0.0)
    return dict(time=t, acceleration=-pulse + np.where(t > 1e-3 + width, 0.05 * np.sin(2 * np.pi * rings * t) * np.exp(-(t - 1e-3) / 2e-3), 0.0))


def test_a_pulse_tells_its_width_and_what_rings_on_after_it():
    assert independent.ringing(shock(4000.0)) == pytest.approx(4000.0, rel=0.02)
    assert independent.width(shock(4000.0)) == pytest.approx(2e-4, rel=0.02)         # a half sine is above half its peak for two thirds
    short = {k: v[:75] for k, v in shock(4000.0).items()}
    assert independent.ringing(short) is None


def test_figures_of_the_diagnosis_carry_their_interval():
    entry = {"mechanism": "attached_mass", "parameters": {"attached_stiffness": {"value": 4.0, "ci95": [1.0, 9.0]}, "attached_mass": {"value": 1.0, "ci95": [1.0, 1.0]}}}
    value, low, high = independent.derived(entry, ("attached_stiffness", "attached_mass"), lambda k, m: np.sqrt(k / m))
    assert (value, low, high) == (2.0, 1.0, 3.0)
    f = independent.Figure("x", "peak of a.csv", "m/s²", 2.5, value, low, high)
    assert f.holds and f.error == pytest.approx(-0.2)
    lines = independent.markdown([f, independent.Figure("x", "growth", "1", 0.08)])
    assert "| x | peak of a.csv | 2.5 m/s² | 2 m/s² | 1 to 3 | -20.0 % | yes |" in lines and "| x | growth | 0.08 | not reported | - | - | - |" in lines
    assert lines[-1].startswith("Clipped peaks are recovered within 20.0 % at worst")
