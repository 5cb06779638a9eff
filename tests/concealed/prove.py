"""The proof: draw, seal, diagnose blind, open, judge, one page. Run by tests/prove."""
import argparse
import datetime
import json
import os
import subprocess
import sys
import time
from pathlib import Path

from . import page
from .generate import generate, label_hash
from .judge import judge, summary

ROOT = Path(__file__).resolve().parents[2]


def built(given):
    """The touchdown binary: the one given, or the launcher's, built if needed."""
    if given:
        return given
    r = subprocess.run([str(ROOT / "harness" / "touchdown"), "--version"], stdout=subprocess.DEVNULL)
    if r.returncode not in (0, 2):
        sys.exit("harness/touchdown does not build")
    b = ROOT / "target" / "release" / "touchdown"
    if not b.exists():
        sys.exit(f"{b} is missing after the build")
    return b


def diagnose(binary, campaign, out, jobs):
    """Diagnoses one campaign: exit code, seconds, peak memory [MB], what it printed."""
    log = out / "log"
    log.mkdir(parents=True, exist_ok=True)
    with open(log / f"{campaign.name}.txt", "wb") as f:
        t0 = time.monotonic()
        p = subprocess.Popen([str(binary), "diagnose", str(campaign), "--out", str(out), "--jobs", str(jobs)], stdout=f, stderr=subprocess.STDOUT)
        _, status, use = os.wait4(p.pid, 0)
        p.returncode = os.waitstatus_to_exitcode(status)
    return dict(code=p.returncode, seconds=time.monotonic() - t0, mb=use.ru_maxrss / 1024, printed=(log / f"{campaign.name}.txt").read_text(errors="replace").strip())


def progress(i, n, t0, what):
    left = (time.monotonic() - t0) / i * (n - i)
    print(f"\r{what} {i}/{n}, {left:.0f} s to go   ", end="\n" if i == n else "", file=sys.stderr, flush=True)


def main():
    a = argparse.ArgumentParser(prog="tests/prove", description="Concealed effects, found blind: draws cases from a seed, diagnoses them, judges, writes DIR/index.html.")
    a.add_argument("--seed", type=int, required=True)
    a.add_argument("--cases", type=int, required=True)
    a.add_argument("--out", type=Path, required=True)
    a.add_argument("--beside", action="store_true", help="run PySINDy, gplearn, a Gaussian process and plain recalibration on the same cases")
    a.add_argument("--beside-cases", type=int, help="only on the first so many of them")
    a.add_argument("--real", type=Path, help="folder of real campaigns: one section each")
    a.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    a.add_argument("--touchdown", type=Path, help="another touchdown binary than the one the launcher builds")
    a.add_argument("--again", action="store_true", help="keep the cases --out holds already (same seed and number), diagnose and judge anew")
    o = a.parse_args()
    if o.cases < 1:
        a.error("--cases must be at least 1")
    if o.real and not any(p.is_dir() for p in o.real.glob("*/")):
        a.error(f"--real {o.real}: no campaign folder there")
    out = o.out
    mark = out / "drawn.json"
    binary = built(o.touchdown)
    if mark.exists() and o.again:
        m = json.loads(mark.read_text())
        if (m["seed"], m["cases"]) != (o.seed, o.cases):
            a.error(f"{out} holds {m['cases']} cases of seed {m['seed']}")
        sealed = m["sha256"]
        draw_s = m["seconds"]
        if label_hash(out / "truth") != sealed:
            sys.exit("the labels are not those that were sealed")
    elif (out / "open").exists():
        a.error(f"{out / 'open'} is there already: give another --out, or --again")
    else:
        t0 = time.monotonic()
        generate(o.seed, o.cases, out, lambda i, n, *_: progress(i, n, t0, "drawing"))
        draw_s = time.monotonic() - t0
        sealed = label_hash(out / "truth")
        mark.write_text(json.dumps(dict(seed=o.seed, cases=o.cases, sha256=sealed, seconds=draw_s)))
    print(f"seed {o.seed}, {o.cases} cases drawn; labels sealed before the diagnosis, sha256 {sealed}", flush=True)

    cases = sorted((out / "open").iterdir())
    runs, t0 = {}, time.monotonic()
    for i, c in enumerate(cases):
        runs[c.name] = diagnose(binary, c, out / "verdicts", o.jobs)
        progress(i + 1, len(cases), t0, "diagnosing")
    if label_hash(out / "truth") != sealed:
        sys.exit("the labels changed while they were sealed: nothing is proved")
    rows = []
    for c in cases:
        truth = json.loads((out / "truth" / f"{c.name}.json").read_text())
        r = judge(c, truth, out / "verdicts" / c.name)
        r.update(seconds=runs[c.name]["seconds"], mb=runs[c.name]["mb"], code=runs[c.name]["code"], printed=runs[c.name]["printed"], acts=truth["acts"],
                 origin=truth["origin"], effect=truth["true_effect"], r2=truth["base_refit_r2"])
        rows.append(r)
    summ = summary(rows)
    commit = subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    head = dict(seed=o.seed, cases=len(cases), sha256=sealed, date=datetime.date.today().isoformat(), commit=commit, jobs=o.jobs, draw_s=draw_s)
    (out / "scores.json").write_text(json.dumps(dict(head=head, summary=summ, cases=rows), indent=1))
    others = None
    if o.beside:
        from .beside import compare
        n = o.beside_cases or len(cases)
        others = compare(out, rows[:n], lambda i, m, t, what: progress(i, m, t, what))
        (out / "beside.json").write_text(json.dumps(others, indent=1))
    real = None
    if o.real:
        from .real import sections
        real = sections(o.real, out / "real", lambda c, d: diagnose(binary, c, d, o.jobs))
    page.write(out, head, rows, summ, others, real)
    print(page.markdown(head, rows, summ, others))
    print(f"page: {out / 'index.html'}")


if __name__ == "__main__":
    main()
