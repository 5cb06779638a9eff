"""Campaigns converted to systems of FMUs: the same names as by the built-in rig."""

import json
import os
import subprocess
from pathlib import Path

import pytest

from tests.systems.convert import convert

ROOT = Path(__file__).resolve().parents[2]
OPEN = ROOT.parent / "shared" / "concealed" / "open"
PROGRAM = os.environ.get("TOUCHDOWN", str(ROOT / "target/release/touchdown"))
# nothing missing; an effect of the motion that is plain, and what the answer says of it
CASES = {"open-014": None, "open-026": "needs an input for the position of the stop at bond stop"}

pytestmark = pytest.mark.skipif(not OPEN.exists(), reason=f"the open campaigns are absent: {OPEN}")


def diagnosed(campaign, out):
    """The verdict."""
    subprocess.run([PROGRAM, "diagnose", str(campaign), "--out", str(out), "--quiet"], check=True, capture_output=True)
    return json.loads((Path(out) / Path(campaign).name / "verdict.json").read_text())


@pytest.mark.parametrize("case", CASES)
def test_a_converted_campaign_gets_the_same_names(case, tmp_path):
    convert(OPEN / case, tmp_path / case)
    ours = diagnosed(OPEN / case, tmp_path / "rig")
    theirs = diagnosed(tmp_path / case, tmp_path / "fmus")
    names = [m["mechanism"] for m in ours["missing"]]
    assert [m["mechanism"] for m in theirs["missing"]] == names
    said = CASES[case]
    assert said is None or any(said in step for step in theirs["next"]), theirs["next"]
    for place in theirs["mismatch"]["where"]:
        assert place["origin"] == "chain" or (place["bond"], place["fmu"]) == ("stop", "bar")


def test_the_system_handed_back_runs_as_file_and_as_archive(tmp_path):
    case = "open-014"
    convert(OPEN / case, tmp_path / case)
    diagnosed(tmp_path / case, tmp_path / "out")
    handed = tmp_path / "out" / case / "system"
    rows = {}
    for name in ("system.toml", "system.ssp"):
        subprocess.run([PROGRAM, "run", str(handed / name), "--out", str(tmp_path / name)], check=True, capture_output=True)
        rows[name] = (tmp_path / name / "results.csv").read_text().splitlines()
    assert len(rows["system.toml"]) > 1000
    assert rows["system.toml"][1:] == rows["system.ssp"][1:]
