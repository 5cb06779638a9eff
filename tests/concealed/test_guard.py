"""The built touchdown against twelve small campaigns whose hidden effect it has named right before (guard.py).

Run by tests/run, which builds it first. Another binary: TOUCHDOWN=/path/to/touchdown pytest tests/concealed/test_guard.py
"""
import json
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tests.concealed import guard, weights
from tests.concealed.effects import FORMS, ORIGIN

BINARY = Path(os.environ.get("TOUCHDOWN", Path(__file__).resolve().parents[2] / "target" / "release" / "touchdown"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("guard")


@pytest.fixture(scope="module")
def answers(folder):
    """What is wrong with each case's answer, by its seed; two diagnoses at once, one thread each."""
    assert BINARY.exists(), f"{BINARY} is not built: cargo build --release, or name another as TOUCHDOWN"
    d = folder
    for c in guard.CASES:
        guard.campaign(c, d / f"guard-{c.seed}")

    def ask(c):
        try:
            return guard.wrong(c, guard.diagnosed(BINARY, d / f"guard-{c.seed}", d / "verdicts"))
        except RuntimeError as e:
            return f"{c}; no answer: {e}"

    with ThreadPoolExecutor(2) as pool:
        return dict(zip((c.seed for c in guard.CASES), pool.map(ask, guard.CASES)))


@pytest.mark.parametrize("case", guard.CASES, ids=lambda c: f"{c.seed}-{'+'.join(c.names) or 'nothing'}")
def test_the_diagnosis_still_says_what_it_said(answers, case):
    assert not answers[case.seed], answers[case.seed]


def test_probabilities_are_those_of_the_table_that_was_calibrated(answers, folder):
    table = json.loads((Path(__file__).resolve().parents[2] / "harness" / "diagnose" / "calibration.json").read_text())
    verdicts = sorted(folder.glob("verdicts/**/verdict.json"))
    assert len(verdicts) >= len(guard.CASES)
    for path in verdicts:
        v = json.loads(path.read_text())
        ours = weights.posterior(weights.features(v), [table[k] for k in weights.PARAMETERS])
        theirs = {weights.canonical(c["mechanisms"]): c["probability"] for c in v["posterior"]}
        assert abs(sum(theirs.values()) - 1.0) < 1e-9 and ours.keys() == theirs.keys(), path
        assert all(abs(ours[h] - theirs[h]) < 1e-6 for h in ours), (path, ours, theirs)
        held, level = [theirs[weights.canonical(c["mechanisms"])] for c in v["credible_set"]], table["level"]
        assert sum(held) >= level - 1e-9 and sum(held[:-1]) < level, path


def test_the_cases_are_mixed():
    singles = [c for c in guard.CASES if len(c.names) == 1 and not c.names[0].startswith("unknown:")]
    assert sum(not c.names for c in guard.CASES) == 3 and len(singles) == 7 and sum(len(c.names) == 2 for c in guard.CASES) == 1
    assert sum(c.names[:1] != () and c.names[0].startswith("unknown:") for c in guard.CASES) == 1 and len(guard.CASES) == 12
    assert {ORIGIN[c.names[0]] for c in singles} == {"contact", "motion", "chain"} and len({c.names for c in singles}) == 7
    assert all((n, f) in FORMS for c in guard.CASES for n, f, _ in c.effects) and len({c.seed for c in guard.CASES}) == 12


def test_a_wrong_answer_names_the_campaign_and_what_was_said():
    case = guard.Case(5, "d", (("adhesion", "neck", 0.1),))
    say = lambda names, detected=True, unexplained=False, also=(): guard.wrong(case, {
        "missing": [{"mechanism": n, "also_possible": list(also)} for n in names], "mismatch": {"detected": detected}, "unexplained": {"detected": unexplained}})
    assert say(["adhesion"]) == ""
    assert say(["clipping"]) == "guard-5: adhesion, drop-test; said: clipping"
    assert "unexplained" in say(["adhesion"], unexplained=True) and "nothing detected" in say([], detected=False)
    tie = guard.Case(6, "d", (("lowpass_lag", "first-order", 0.1),))
    v = {"missing": [{"mechanism": "channel_skew", "also_possible": ["lowpass_lag"]}], "mismatch": {"detected": True}, "unexplained": {"detected": False}}
    assert guard.wrong(tie, v) == ""
