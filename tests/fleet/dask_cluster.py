"""A fleet on a real Dask cluster of several worker processes on this machine. Run by tests/fleet/dask, which installs the package."""

import os
import pathlib
import signal
import threading
import time

import distributed
import pytest
import touchdown_impact.dask as driver

from tests.fleet.conftest import PROGRAM, answer, content, touchdown
from tests.fleet.small import write, write_with_fmu

WORKERS = 3
CAMPAIGNS = int(os.environ.get("FLEET_DASK", "200"))
# seconds of a campaign; many times what the small ones take
SECONDS = 30


@pytest.fixture
def cluster():
    with distributed.LocalCluster(n_workers=WORKERS, threads_per_worker=1, processes=True, dashboard_address=None) as c, distributed.Client(c) as client:
        yield c, client


def test_every_campaign_but_the_lost_is_answered_as_on_one_machine(cluster, tmp_path):
    local, client = cluster
    folder, out, one = tmp_path / "campaigns", tmp_path / "answers", tmp_path / "one"
    names = [f"c{i:03d}" for i in range(CAMPAIGNS)]
    for i, name in enumerate(names):
        write(folder / name, i, 0.2 * (i % 3), levels=(2e-5, 4e-5), samples=28, columns={"order": i})
    write_with_fmu(folder / "poisoned", "abort();")
    write_with_fmu(folder / "endless", "for (;;) sleep(1);")
    killed = []

    def kill():
        """Kills a worker once a quarter of the answers is there."""
        while len(list(out.glob("c*/verdict.json"))) < CAMPAIGNS // 4:
            time.sleep(0.05)
        worker = next(iter(local.workers.values()))
        os.kill(worker.pid, signal.SIGKILL)
        killed.append((worker.pid, len(list(out.glob("c*/verdict.json")))))

    killer = threading.Thread(target=kill, daemon=True)
    killer.start()
    began = time.monotonic()
    fleet = driver.diagnose(folder, client, out, seconds=SECONDS, fmus=driver.Fmus(in_process=True), progress=False)
    took = time.monotonic() - began
    killer.join(timeout=10)
    (_, answered), = killed
    assert CAMPAIGNS // 4 <= answered < CAMPAIGNS, "the worker was killed in the middle"
    assert (fleet.campaigns, fleet.judged) == (CAMPAIGNS + 2, CAMPAIGNS)
    assert sorted(fleet.lost) == ["endless", "poisoned"]
    assert "SIGABRT" in fleet.lost["poisoned"]
    assert f"its {SECONDS} s were up" in fleet.lost["endless"]
    assert not fleet.not_judged
    # on one machine, by one process a share
    share = touchdown("diagnose", *(folder / n for n in names), "--out", one, "--shard", "1/1", "--seconds", SECONDS, "--in-process")
    print(f"{CAMPAIGNS} campaigns on {WORKERS} workers, one of them killed after {answered}: {took:.0f} s; {share.stdout.splitlines()[-2]}")
    for name in names:
        a, b = answer(out / name), answer(one / name)
        assert a.keys() == b.keys()
        # the FMU and the input's hash show by which program they were made; all that was found is the same to the bit
        different = {n for n in a if a[n] != b[n]}
        assert different <= {"manifest.json", "HysteresisContact.fmu"}, (name, different)
    frame = fleet.to_frame()
    assert len(frame) == CAMPAIGNS + 2 and list(frame["state"][:2]) == ["lost", "lost"]
    # once more: what is finished is not done again
    before = {n: (out / n / "manifest.json").stat().st_mtime_ns for n in names}
    again = driver.diagnose([folder / n for n in names[:20]], client, out, seconds=SECONDS, fmus=driver.Fmus(in_process=True), progress=False)
    assert before == {n: (out / n / "manifest.json").stat().st_mtime_ns for n in names}
    assert again.judged == CAMPAIGNS


def test_replicates_on_workers_give_the_bootstrap_of_one_run(cluster, tmp_path):
    _, client = cluster
    write(tmp_path / "c", 1, 0.2, levels=(2e-5, 4e-5), samples=28)
    fleet = driver.diagnose([tmp_path / "c"], client, tmp_path / "out", bootstrap=6, replicates=3, progress=False)
    touchdown("diagnose", tmp_path / "c", "--out", tmp_path / "one", "--bootstrap", "6")
    assert fleet.judged == 1
    for name in ("verdict.json", "report.html"):
        assert content(tmp_path / "out/c" / name) == content(tmp_path / "one/c" / name)


def test_another_program_on_the_workers(cluster, fleet, tmp_path):
    _, client = cluster
    found = driver.diagnose(fleet, client, tmp_path / "out", command=[str(PROGRAM)], progress=False)
    assert sorted(found.lost) == ["none", "short"] and found.judged == 8


def test_what_no_worker_can_do_is_raised(cluster, fleet, tmp_path):
    _, client = cluster
    with pytest.raises(Exception, match="No such file"):
        driver.diagnose(fleet, client, tmp_path / "out", command=[str(pathlib.Path(tmp_path) / "gone")], progress=False)
    with pytest.raises(driver.TouchdownError, match="no campaign is given"):
        driver.diagnose([], client, tmp_path / "out")
    with pytest.raises(driver.TouchdownError, match="is no time to work in"):
        driver.diagnose(fleet, client, tmp_path / "out2", seconds=-1.0, progress=False)
