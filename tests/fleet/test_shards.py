"""Shares of a fleet, and what a merge makes of them."""

import json
import os
import signal
import subprocess
import time

import pyarrow.parquet
import pytest

from tests.fleet.conftest import PROGRAM, answer, touchdown

NAMES = [f"c{i}" for i in range(8)]


def test_shards_give_the_answers_of_one_machine_and_name_what_is_lost(fleet, one_machine, tmp_path):
    out = tmp_path / "answers"
    codes = [touchdown("diagnose", fleet, "--out", out, "--shard", f"{i}/3", code=None) for i in (1, 2, 3)]
    assert sorted(c.returncode for c in codes) == [0, 2, 2], [c.stdout for c in codes]
    for name in NAMES:
        assert answer(out / name) == answer(one_machine / name), name
    merged = touchdown("merge", out, code=2)
    assert "8 of 10 campaigns were judged" in merged.stdout and "2 are lost: none, short" in merged.stdout
    files = {n: (out / n).read_bytes() for n in ("index.html", "fleet.parquet", "fleet.json")}
    lost = {c["campaign"]: c["why"] for c in json.loads(files["fleet.json"])["lost"]}
    assert "kind is missing" in lost["none"] and "samples" in lost["short"]
    assert b"kind is missing" in files["index.html"]
    table = pyarrow.parquet.read_table(out / "fleet.parquet").to_pylist()
    assert sorted(r["campaign"] for r in table) == [*NAMES, "none", "short"]
    by_name = {r["campaign"]: r for r in table}
    for name in NAMES:
        verdict = json.loads((one_machine / name / "verdict.json").read_text())
        row = by_name[name]
        assert row["state"] == "judged" and row["detected"] == verdict["mismatch"]["detected"]
        assert row["false_alarm_probability"] == verdict["mismatch"]["false_alarm_probability"]
        assert row["heldout_nrmse_before"] == verdict["fit"]["before"]["heldout_nrmse"]
        assert row["column.order"] == int(name[1:]) and row["column.batch"] == "AB"[int(name[1:]) % 2]
    assert by_name["none"]["state"] == "lost" and by_name["none"]["detected"] is None

    # merged once more, and finished once more, nothing changes
    touchdown("merge", out, code=2)
    assert files == {n: (out / n).read_bytes() for n in files}
    again = touchdown("diagnose", fleet, "--out", out, "--shard", "1/1", code=2)
    assert "up to date: 8 (" in again.stdout and "finished" not in again.stdout
    touchdown("merge", out, code=2)
    assert files == {n: (out / n).read_bytes() for n in files}


def test_shards_on_several_disks_are_merged(fleet, one_machine, tmp_path):
    outs = [tmp_path / f"node{i}" / "answers" for i in (1, 2)]
    for i, out in enumerate(outs):
        touchdown("diagnose", *sorted(fleet.glob("c*")), "--out", out, "--shard", f"{i + 1}/2", "--jobs", "1")
    merged = touchdown("merge", *outs, "--out", tmp_path / "fleet", "--json")
    summary = json.loads(merged.stdout)
    assert (summary["campaigns"], summary["judged"], summary["lost"]) == (8, 8, [])
    page = (tmp_path / "fleet/index.html").read_text()
    for i, name in enumerate(NAMES):
        assert f'href="../node{i % 2 + 1}/answers/{name}/report.html"' in page
        assert answer(outs[i % 2] / name) == answer(one_machine / name)


def test_a_list_stands_for_campaigns_and_a_share_that_is_ended_is_finished_by_the_next(fleet, one_machine, tmp_path):
    listed, out = tmp_path / "campaigns.txt", tmp_path / "answers"
    listed.write_text("# my fleet\n" + "".join(f"{fleet / n}\n" for n in NAMES))
    call = ["diagnose", "--list", listed, "--out", out, "--shard", "1/1", "--jobs", "1"]
    p = subprocess.Popen([PROGRAM, *map(str, call)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    for _ in range(600):
        if (out / "c1/verdict.json").exists():
            break
        time.sleep(0.05)
    p.send_signal(signal.SIGTERM)
    said = p.communicate(timeout=20)
    assert p.returncode == 128 + signal.SIGTERM and "not begun" in said[1], said
    assert touchdown("merge", out, code=2).stdout.count("lost: c") >= 1
    touchdown(*call)
    touchdown("merge", out)
    for name in NAMES:
        assert answer(out / name) == answer(one_machine / name)


@pytest.mark.skipif(not os.path.exists("/proc"), reason="ends with its share on Linux")
def test_a_share_that_is_killed_takes_its_process_with_it(fleet, tmp_path):
    out = tmp_path / "answers"
    call = ["diagnose", fleet / "c1", "--out", out, "--shard", "1/1", "--bootstrap", "500"]
    p = subprocess.Popen([PROGRAM, *map(str, call)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    below = []
    for _ in range(600):
        below = [int(c) for c in open(f"/proc/{p.pid}/task/{p.pid}/children").read().split()] or children(p.pid)
        if below:
            break
        time.sleep(0.05)
    assert below
    p.kill()
    p.wait()
    for _ in range(200):
        if not os.path.exists(f"/proc/{below[0]}") or "(zombie)" in open(f"/proc/{below[0]}/status").read():
            break
        time.sleep(0.05)
    else:
        pytest.fail("the campaign's process runs on")
    assert "had begun and has not come to an end" in touchdown("merge", out, code=2).stdout


def children(pid):
    """Processes that any thread of `pid` has started."""
    found = []
    for task in os.listdir(f"/proc/{pid}/task"):
        try:
            found += [int(c) for c in open(f"/proc/{pid}/task/{task}/children").read().split()]
        except FileNotFoundError:
            pass
    return found


def test_replicates_of_a_bootstrap_give_the_answer_of_one_run(fleet, tmp_path):
    one, shared = tmp_path / "one", tmp_path / "shared"
    touchdown("diagnose", fleet / "c1", "--out", one, "--bootstrap", "5")
    first = touchdown("diagnose", fleet / "c1", "--out", shared, "--bootstrap", "5", "--replicates", "2/3")
    assert "waiting for other replicates: 1 (c1)" in first.stdout and not (shared / "c1").exists()
    touchdown("diagnose", fleet / "c1", "--out", shared, "--bootstrap", "5", "--replicates", "1/3")
    last = touchdown("diagnose", fleet / "c1", "--out", shared, "--bootstrap", "5", "--replicates", "3/3")
    assert "waiting" not in last.stdout
    assert answer(one / "c1") == answer(shared / "c1")
    assert json.loads((one / "c1/verdict.json").read_text())["mismatch"]["bootstrap"]["nulls"] == 5
    again = touchdown("diagnose", fleet / "c1", "--out", shared, "--bootstrap", "5", "--replicates", "1/3", "--resume")
    assert "up to date: 1 (c1)" in again.stdout
    touchdown("diagnose", fleet / "c1", "--out", shared, "--replicates", "1/3", code=2)


@pytest.mark.parametrize("wrong", ["0/3", "4/3", "3", "a/b"])
def test_a_share_that_is_none_is_refused(fleet, tmp_path, wrong):
    said = touchdown("diagnose", fleet, "--out", tmp_path / "o", "--shard", wrong, code=2)
    assert "is no share; write I/N" in said.stderr


def test_a_folder_without_answers_is_reported(tmp_path):
    assert "holds no answer of touchdown" in touchdown("merge", tmp_path, code=2).stderr
    (tmp_path / "index.html").write_text("mine")
    (tmp_path / "c").mkdir()
    touchdown("merge", tmp_path, code=2)
    assert (tmp_path / "index.html").read_text() == "mine"
