"""The proof's diagnoses, shared by threads, by shares of several calls, and by Dask's workers."""

import pytest

from tests.concealed import prove
from tests.fleet.conftest import PROGRAM, answer


@pytest.fixture(scope="module")
def cases(fleet):
    return sorted(fleet.glob("c[0-5]"))


def test_shares_and_workers_diagnose_as_threads_do(cases, tmp_path):
    pytest.importorskip("distributed")
    threads, shares, workers = (tmp_path / n for n in ("threads", "shares", "workers"))
    runs, version = prove.diagnose_all(PROGRAM, cases, threads, prove.Threads(2), "by threads")
    assert sorted(runs) == [c.name for c in cases] and all(r["code"] == 0 and r["binary"] == version for r in runs.values())
    first, _ = prove.diagnose_all(PROGRAM, cases, shares, prove.Shard("1/2", 1), "by the first share")
    both, _ = prove.diagnose_all(PROGRAM, cases, shares, prove.Shard("2/2", 1), "by the second share")
    assert 0 < len(first) < len(cases) and sorted(both) == sorted(runs)
    engine = prove.Workers("local:2")
    try:
        by_workers, _ = prove.diagnose_all(PROGRAM, cases, workers, engine, "by workers")
    finally:
        engine.client.close()
        engine.cluster.close()
    assert sorted(by_workers) == sorted(runs) and all(r["mb"] > 1 for r in by_workers.values())
    for c in cases:
        assert answer(threads / c.name) == answer(shares / c.name) == answer(workers / c.name)
    # all is there: nothing is done again, and the judging call finds the shares' runs
    found, _ = prove.diagnose_all(PROGRAM, cases, shares, prove.Threads(1), "once more")
    assert found == both


@pytest.mark.parametrize("words", [["--shard", "3/2"], ["--dask", "local:0"], ["--dask", "local:2", "--shard", "1/2"], ["--system", "--dask", "local:2"]])
def test_engines_that_are_none_are_refused(monkeypatch, capsys, words):
    monkeypatch.setattr("sys.argv", ["tests/prove", "1/2", *words])
    with pytest.raises(SystemExit) as e:
        prove.options()
    assert e.value.code == 2
