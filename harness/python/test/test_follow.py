"""While Rust works Python goes on: other threads run, progress is reported, Ctrl-C ends it."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import touchdown_impact as td

ENDLESS = """
import sys, time
import touchdown_impact as td
def progress(p):
    if p.stage:
        print("stage", p.stage, flush=True)
try:
    td.diagnose(sys.argv[1], out=sys.argv[2], bootstrap=9999, progress=progress)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


def test_ctrl_c_raises_within_a_second_and_nothing_is_written(campaign: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    child = subprocess.Popen(
        [sys.executable, "-c", ENDLESS, str(campaign), str(out)], stdout=subprocess.PIPE, text=True
    )
    assert child.stdout is not None
    # the nulls alone take hours: that it ends at all shows that it was asked
    assert child.stdout.readline().startswith("stage")
    child.send_signal(signal.SIGINT)
    asked = time.monotonic()
    last = ""
    for line in child.stdout:
        last = line
        if line == "interrupted\n":
            break
    took = time.monotonic() - asked
    assert last == "interrupted\n" and took < 1.0, (last, took)
    assert child.wait(60) == 0
    assert not out.exists()


def test_other_threads_run_while_rust_works(campaign: Path) -> None:
    ticks, over = [], threading.Event()

    def tick() -> None:
        while not over.wait(0.01):
            ticks.append(time.monotonic())

    thread = threading.Thread(target=tick)
    thread.start()
    began = time.monotonic()
    td.fit(campaign)
    took = time.monotonic() - began
    over.set()
    thread.join()
    longest = max(b - a for a, b in zip(ticks, ticks[1:], strict=False))
    assert longest < 0.5 * took and len(ticks) > 10, (longest, took, len(ticks))


def test_progress_is_told_and_what_it_raises_ends_the_work(campaign: Path) -> None:
    reported: list[td.Progress] = []
    td.fit(campaign, progress=reported.append)
    assert reported[0] == td.Progress("fit bench_drop", "", 0, 0)
    assert any(p.stage == "level by level" for p in reported)

    class Enough(Exception):
        pass

    def refuse(_: td.Progress) -> None:
        raise Enough

    with pytest.raises(Enough):
        td.fit(campaign, progress=refuse)


def test_a_fit_that_has_nothing_in_its_time_says_so(campaign: Path) -> None:
    with pytest.raises(td.TouchdownError, match="--seconds -1 is no time to work in"):
        td.fit(campaign, seconds=-1)


def test_several_at_once_give_what_each_alone_gives(campaign: Path) -> None:
    alone = td.fit(campaign).fit
    fits: list[td.Fit] = []
    threads = [threading.Thread(target=lambda: fits.append(td.fit(campaign))) for _ in range(3)]
    for t in threads:
        t.start()
    for t in threads:
        t.join()
    assert [f.fit for f in fits] == [alone] * 3


FORKED = """
import os, sys
import touchdown_impact as td
td.Campaign(sys.argv[1]).recordings
if os.fork() == 0:
    try:
        td.Campaign(sys.argv[1]).recordings
    except td.TouchdownError as e:
        print(e, flush=True)
    os._exit(0)
os.wait()
"""


def test_a_forked_process_is_told_that_it_has_no_threads(campaign: Path) -> None:
    done = subprocess.run([sys.executable, "-c", FORKED, str(campaign)], capture_output=True, text=True, timeout=120)
    assert "this process was forked" in done.stdout and "spawn or forkserver" in done.stdout, done
