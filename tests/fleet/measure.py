"""Campaigns an hour against processes, and memory of each: by shares of the command, and by Dask's workers.

    python -m tests.fleet.measure [--campaigns N] [--write]     a table; --write puts it into docs/src/how-to/fleets.md

On a machine that does nothing else.
"""
import argparse
import json
import os
import pathlib
import platform
import shutil
import subprocess
import tempfile
import time

from tests.fleet.conftest import PROGRAM, ROOT
from tests.fleet.draw import campaign

PAGE = ROOT / "docs/src/how-to/fleets.md"
BEGIN, END = "<!-- scaling: written by python -m tests.fleet.measure --write -->", "<!-- end of scaling -->"
SEED = 20261126


def by_shares(folder, workers):
    """Seconds and the largest memory of a process [MB], by one share that runs so many processes."""
    with tempfile.TemporaryDirectory() as out:
        done = subprocess.run([PROGRAM, "diagnose", folder, "--out", out, "--shard", "1/1", "--jobs", str(workers), "--json", "--quiet"], capture_output=True, text=True, check=True)
    share = json.loads(done.stdout)
    return share["seconds"], share["memory"] / 1e6


def by_dask(folder, workers):
    """The same by Dask's workers, a process each, with what the worker itself takes."""
    import distributed
    import psutil

    from touchdown_impact.dask import diagnose

    with tempfile.TemporaryDirectory() as out, distributed.LocalCluster(n_workers=workers, threads_per_worker=1, processes=True, dashboard_address=None) as cluster, distributed.Client(cluster) as client:
        began = time.monotonic()
        fleet = diagnose(folder, client, out, command=[str(PROGRAM)], progress=False)
        took = time.monotonic() - began
        assert not fleet.lost
        memory = max(psutil.Process(w.pid).memory_info().rss for w in cluster.workers.values())
    return took, memory / 1e6


def main():
    a = argparse.ArgumentParser(prog="python -m tests.fleet.measure")
    a.add_argument("--campaigns", type=int, default=24)
    a.add_argument("--write", action="store_true")
    o = a.parse_args()
    cores, before = len(os.sched_getaffinity(0)), os.getloadavg()[0]
    folder = pathlib.Path(tempfile.mkdtemp())
    try:
        for i in range(o.campaigns):
            campaign(SEED, i, o.campaigns, folder)
        rows = []
        for workers in range(1, cores + 1):
            (s, mb), (d, more) = by_shares(folder, workers), by_dask(folder, workers)
            hour = lambda seconds: f"{3600 * o.campaigns / seconds:.0f}"
            rows.append(f"| {workers} | {hour(s)} | {mb:.0f} | {hour(d)} | {more:.0f} |")
            print(rows[-1], flush=True)
    finally:
        shutil.rmtree(folder)
    model = next((line.split(":", 1)[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")), platform.processor())
    table = "\n".join([
        f"{o.campaigns} campaigns of six recordings of about 110 samples, as `tests/fleet/draw.py` draws them, on {cores} cores ({model}), {time.strftime('%Y-%m-%d')}, beside other work of a load of {before:.1f}:", "",
        "| processes at once | campaigns an hour, `--shard` | MB a campaign's process at most | campaigns an hour, Dask | MB a Dask worker beside it |", "|---|---|---|---|---|", *rows])
    print(table)
    if o.write:
        text = PAGE.read_text()
        head, rest = text.split(BEGIN)
        PAGE.write_text(f"{head}{BEGIN}\n\n{table}\n\n{END}{rest.split(END)[1]}")


if __name__ == "__main__":
    main()
