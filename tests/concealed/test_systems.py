"""tests/prove --system: openings alone are drawn, converted, judged by both, and listed in a table."""
import json
import tomllib
from types import SimpleNamespace

import numpy as np

from . import systems
from .effects import FORMS, allowed
from .generate import generate, label_hash
from .rigs import CHANNELS


def test_a_quarter_misses_nothing_and_the_rest_is_what_an_opening_allows():
    todo = systems.plan(np.random.default_rng(3), 24)
    assert len(todo) == 24 and sum(tier == "null" for tier, _ in todo) == 6
    names = [name for _, name in todo if name]
    assert len(names) == 18
    assert all(any(allowed(*f, systems.KIND, CHANNELS) for f in FORMS if f[0] == name) for name in names)


def test_cases_are_drawn_converted_and_reported(tmp_path, monkeypatch, capsys):
    generate(5, 2, tmp_path, say=None, todo=[("null", None)] * 2, only=systems.KIND)
    answers = {("rig", "s5-001"): [], ("fmus", "s5-001"): [], ("rig", "s5-002"): [], ("fmus", "s5-002"): ["adhesion"]}

    def judge(case, truth, answer):
        named = answers[answer.parent.name, case.name]
        kind = tomllib.loads((case / "campaign.toml").read_text())["campaign"]["kind"]
        assert kind == ("system" if answer.parent.name == "fmus" else systems.KIND)
        return dict(named=named, answered=True, right=named == truth["missing"], unexplained=False)

    def diagnose_all(binary, cases, out, jobs, what):
        return {c.name: dict(cpu=6.0 if out.name == "fmus" else 2.0, code=0) for c in cases}, "x"

    monkeypatch.setattr(systems, "judge", judge)
    o = SimpleNamespace(out=tmp_path, sets=[(5, 2)], jobs=1)
    systems.prove(o, "touchdown", dict(sha256=label_hash(tmp_path / "truth")), diagnose_all)
    printed = capsys.readouterr().out
    assert "| `s5-001` | nothing | nothing | nothing | yes | 3.0 |" in printed
    assert "| `s5-002` | nothing | nothing | adhesion | no | 3.0 |" in printed
    assert "Same names: 1 of 2. Right: 2 by the built-in rig, 1 by FMUs. Processor time of FMUs over that of the rig: 3.0 in the middle, 3.0 at most." in printed
    assert len(json.loads((tmp_path / "systems.json").read_text())["cases"]) == 2
