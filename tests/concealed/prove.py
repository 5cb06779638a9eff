"""The proof: draw, seal, diagnose blind, open, judge, one page. Run by tests/prove."""
import argparse
import datetime
import hashlib
import json
import math
import os
import re
import shutil
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from . import page
from . import planted
from . import real
from . import scores
from . import systems
from .effects import STRANGE
from .generate import generate, jsonable, label_hash
from .groups import GROUPS, case_name, draw_group
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


def diagnose(binary, campaign, out, running):
    """Diagnoses one campaign on one thread: exit code, seconds on the wall and of processor, peak memory [MB], what it printed."""
    shutil.rmtree(out / campaign.name, ignore_errors=True)      # an answer of another binary is no answer
    log = out / "log"
    log.mkdir(parents=True, exist_ok=True)
    with open(log / f"{campaign.name}.txt", "wb") as f:
        t0 = time.monotonic()
        p = subprocess.Popen([str(binary), "diagnose", str(campaign), "--out", str(out), "--jobs", "1"], stdout=f, stderr=subprocess.STDOUT)
        running.add(p)
        _, status, use = os.wait4(p.pid, 0)
        p.returncode = os.waitstatus_to_exitcode(status)
        running.discard(p)
    return dict(code=p.returncode, seconds=time.monotonic() - t0, cpu=use.ru_utime + use.ru_stime, mb=use.ru_maxrss / 1024,
                printed=(log / f"{campaign.name}.txt").read_text(errors="replace").strip())


class Threads:
    """Diagnoses on this machine, some at once."""

    def __init__(self, jobs):
        self.jobs = jobs

    def __call__(self, binary, todo, out):
        """(case's name, its run) of every case, as they end."""
        running = set()
        with ThreadPoolExecutor(self.jobs) as pool:
            asked = {pool.submit(diagnose, binary, c, out, running): c for c in todo}
            try:
                for done in as_completed(asked):
                    yield asked[done].name, done.result()
            except BaseException:
                pool.shutdown(wait=False, cancel_futures=True)
                for p in list(running):
                    p.terminate()
                raise


class Workers:
    """Diagnoses on the workers of a Dask cluster, which see the same folders: that of an address, or local:N with N processes here."""

    def __init__(self, address):
        from distributed import Client, LocalCluster
        here, _, n = address.partition(":")
        self.cluster = LocalCluster(n_workers=int(n), threads_per_worker=1, processes=True, dashboard_address=None) if here == "local" else None
        self.client = Client(self.cluster or address)

    def __call__(self, binary, todo, out):
        from distributed import as_completed as as_done
        out = out.absolute()
        asked = {self.client.submit(diagnose, Path(binary).absolute(), c.absolute(), out, set(), key=f"prove-{c.name}-{os.urandom(4).hex()}", pure=False): c for c in todo}
        try:
            for done in as_done(asked):
                yield asked[done].name, done.result()
        except BaseException:
            self.client.cancel(list(asked))
            raise


class Shard:
    """Diagnoses a share of the cases on this machine; others are diagnosed by other calls, into the same folder."""

    def __init__(self, text, jobs):
        i, _, n = text.partition("/")
        self.i, self.n, self.here = int(i), int(n), Threads(jobs)

    def __call__(self, binary, todo, out):
        return self.here(binary, [c for c in todo if self.holds(c)], out)

    def holds(self, case):
        # by its name, so that what other shares have done moves nothing
        return int(hashlib.sha256(case.name.encode()).hexdigest(), 16) % self.n == self.i - 1


def diagnose_all(binary, cases, out, engine, what):
    """Diagnoses every case by an engine (or by so many threads), keeping what this very binary has answered before (out/runs.json, and
    those of shares beside it); nothing is lost by Ctrl-C."""
    engine = Threads(engine) if isinstance(engine, int) else engine
    mine = f"runs-{engine.i}-of-{engine.n}.json" if isinstance(engine, Shard) else "runs.json"
    kept = out / mine
    version = hashlib.sha256(Path(binary).read_bytes()).hexdigest()[:12]
    out.mkdir(parents=True, exist_ok=True)
    runs = {}
    for file in sorted(out.glob("runs*.json")):
        runs.update(json.loads(file.read_text()))
    runs = {k: r for k, r in runs.items() if r["binary"] == version and (r["code"] != 0 or (out / k / "verdict.json").exists())}
    todo = [c for c in cases if c.name not in runs]
    t0, done = time.monotonic(), 0
    total = sum(1 for c in todo if not isinstance(engine, Shard) or engine.holds(c))
    for name, run in engine(binary, todo, out):
        runs[name] = dict(run, binary=version)
        temp = kept.with_suffix(".part")
        temp.write_text(json.dumps(runs))
        temp.replace(kept)
        done += 1
        progress(done, total, t0, what)
    return runs, version


def progress(i, n, t0, what):
    left = (time.monotonic() - t0) / i * (n - i)
    end = "\n" if i == n or not sys.stderr.isatty() else ""
    if sys.stderr.isatty() or i == n or i % 5 == 0:
        print(f"\r{what} {i}/{n}, {left:.0f} s to go   ", end=end, file=sys.stderr, flush=True)


def one_level(binary, out, rows, count, engine):
    """The first `count` single effects named right, once more with the highest level's recordings only."""
    pool = [r for r in rows if r["right"] and r["group"] in ("plain", "concealed", "deep")][:count]
    folder = out / "one-level" / "open"
    for r in pool:
        src, dst = out / "open" / r["case"], folder / r["case"]
        if dst.exists():
            continue
        dst.mkdir(parents=True)
        head, *parts = (src / "campaign.toml").read_text().split("[[recording]]")
        key = ("drop_height", "spring_preload", "level")
        level = [next(line.split("=")[1].split("#")[0].strip() for line in p.splitlines() if line.split("=")[0].strip() in key) for p in parts]
        keep = [p for p, q in zip(parts, level) if q == level[-1]]
        (dst / "campaign.toml").write_text("[[recording]]".join([head] + keep))
        for p in keep:
            name = next(line.split('"')[1] for line in p.splitlines() if line.startswith("file"))
            (dst / name).write_bytes((src / name).read_bytes())
    runs, _ = diagnose_all(binary, [folder / r["case"] for r in pool], out / "one-level" / "verdicts", engine, "one level only")
    res = []
    for r in pool:
        truth = json.loads((out / "truth" / f"{r['case']}.json").read_text())
        q = judge(folder / r["case"], truth, out / "one-level" / "verdicts" / r["case"])
        held = bool(set(r["truth"]) & set(q["also"]))
        res.append(dict(case=r["case"], truth=r["truth"], strength=r["strength"], named=q["named"], also=q["also"], right=q["right"], held=held,
                        silent=q["answered"] and not q["detected"], unexplained=q["unexplained"], seconds=runs[r["case"]]["seconds"]))
    return res


SHARE = 0.3          # campaigns of each group that --groups draws for one of today's mix


def a_set(text):
    """SEED/N as (seed, n), SEED/N:GROUP as (seed, n, group)."""
    both, colon, group = text.partition(":")
    seed, _, n = both.partition("/")
    if not (seed.isdigit() and n.isdigit() and int(n) > 0):
        raise argparse.ArgumentTypeError(f"{text}: a set is SEED/N or SEED/N:GROUP, two whole numbers, N at least 1")
    if colon and group not in GROUPS:
        raise argparse.ArgumentTypeError(f"{text}: {group!r} is no group; the groups are {', '.join(GROUPS)}")
    return (int(seed), int(n), group) if colon else (int(seed), int(n))


def options():
    a = argparse.ArgumentParser(prog="tests/prove", description="Concealed effects, found blind: draws N cases from each seed, seals their labels, diagnoses them, opens the labels, judges, writes DIR/index.html.")
    a.add_argument("sets", metavar="SEED/N", type=a_set, nargs="*", help=f"N cases drawn from SEED, or SEED/N:GROUP, N of a group ({', '.join(GROUPS)}); may be given several times")
    a.add_argument("--groups", action="store_true", help=f"beside every SEED/N draw every group from that seed, {SHARE:g} N of each")
    a.add_argument("--out", type=Path, default=ROOT / "out" / "proof", help="folder of cases, labels, verdicts and the page (default out/proof)")
    a.add_argument("--system", action="store_true", help="draw contactor openings alone, and diagnose each twice: by the built-in rig, and converted to FMUs")
    a.add_argument("--first", type=int, metavar="N", help="judge only the first N cases drawn (they are shuffled), where time is short; the page says so")
    a.add_argument("--beside", action="store_true", help="run PySINDy, gplearn, a Gaussian process and plain recalibration on the same cases")
    a.add_argument("--beside-cases", type=int, help="only on the first so many of them")
    a.add_argument("--one-level", type=int, default=10, metavar="N", help="diagnose N of the effects named right once more from one level only (default 10)")
    a.add_argument("--real", type=Path, metavar="FOLDER", help="folder of real campaigns: one section each; with or without SEED/N")
    a.add_argument("--planted", type=Path, nargs="+", default=[], metavar="FOLDER", help="plant known effects into real campaigns (folders of one or of several) and diagnose them too")
    a.add_argument("--strength", type=float, nargs="+", default=[2.0, 6.0], metavar="S", help="visible part of what is planted over what the simulation as given leaves (default 2 6)")
    a.add_argument("--planted-share", type=float, default=1.0, metavar="P", help="share of all that can be planted, drawn from the seed (default 1)")
    a.add_argument("--planted-seed", type=int, metavar="SEED", help="draws it (default: the first SEED given, or 1)")
    a.add_argument("--readme", action="store_true", help="write tables and pictures into docs/src/proof.md and docs/src/images, and their sentence into README.md")
    a.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    a.add_argument("--dask", metavar="ADDRESS", help="diagnose on a Dask cluster that sees the same folders: its scheduler's address, or local:N for N worker processes here")
    a.add_argument("--shard", metavar="I/N", help="diagnose the I-th of N shares of the cases and end; --again without it judges what all shares have left in --out")
    a.add_argument("--touchdown", type=Path, help="another touchdown binary than the one the launcher builds")
    a.add_argument("--commit", default="", metavar="ID", help="the commit --touchdown was built from, for the page")
    a.add_argument("--again", action="store_true", help="keep the cases --out holds already (same sets) and what this binary answered; judge anew")
    o = a.parse_args()
    if o.system and (o.dask or o.shard or o.groups or o.real or o.planted or o.beside or o.readme or o.first or not o.sets or any(len(s) == 3 for s in o.sets)):
        a.error("--system goes with SEED/N, --out, --jobs, --again and --touchdown alone")
    o.more = [s for s in o.sets if len(s) == 3]
    o.sets = [s for s in o.sets if len(s) == 2]
    if o.groups:
        o.more += [(s, math.ceil(SHARE * n), g) for s, n in o.sets for g in GROUPS]
    if len({(s, g) for s, _, g in o.more}) < len(o.more):
        a.error("a group is drawn from a seed twice: it would draw the same campaigns again")
    if o.groups and not o.sets:
        a.error("--groups draws beside SEED/N: give one, or name the groups as SEED/N:GROUP")
    drawn = o.sets + o.more
    if not drawn and not o.real and not o.planted:
        a.error("give SEED/N, how many cases to draw from which seed (or --real FOLDER, or --planted FOLDER)")
    if len({s for s, _ in o.sets}) < len(o.sets):
        a.error("a seed is given twice: it would draw the same cases again")
    if o.shard and (o.real or o.planted):
        a.error("--shard shares what is drawn; give --real and --planted to the call that judges what all shares have left")
    if o.dask and o.shard:
        a.error("--dask and --shard are two ways to share the work: give one")
    if o.shard and not (re.fullmatch(r"[1-9]\d*/[1-9]\d*", o.shard) and int(o.shard.split("/")[0]) <= int(o.shard.split("/")[1])):
        a.error(f"--shard {o.shard}: is no share; write I/N, I from 1 to N")
    if o.dask and o.dask.startswith("local:") and not re.fullmatch(r"local:[1-9]\d*", o.dask):
        a.error(f"--dask {o.dask}: write local:N with N processes")
    if o.first is not None and not 1 <= o.first <= sum(n for _, n in o.sets):
        a.error("--first must be from 1 to the number of cases drawn")
    if o.one_level < 0 or o.jobs < 1 or (o.beside_cases is not None and o.beside_cases < 1):
        a.error("--one-level cannot be negative; --jobs and --beside-cases must be at least 1")
    if o.real and not any((p / "campaign.toml").exists() for p in o.real.glob("*/")):
        a.error(f"--real {o.real}: no folder with a campaign.toml there")
    for f in o.planted:
        if not planted.campaigns_in([f]):
            a.error(f"--planted {f}: no campaign.toml there, nor in a folder in it")
    if not 0 < o.planted_share <= 1 or min(o.strength) <= 0:
        a.error("--planted-share is from 0 to 1, and a --strength is above 0")
    if o.planted_seed is None:
        o.planted_seed = drawn[0][0] if drawn else 1
    if o.touchdown and not o.touchdown.is_file():
        a.error(f"--touchdown {o.touchdown}: no such file")
    mark = o.out / "drawn.json"
    if drawn and mark.exists() and o.again:
        held = [tuple(s) for s in json.loads(mark.read_text())["sets"]]
        if held != drawn:
            a.error(f"{o.out} holds {' '.join(page.as_set(s) for s in held)}")
    elif drawn and (o.out / "open").exists():
        a.error(f"{o.out / 'open'} is there already: give another --out, or --again where its drawing had ended")
    return o


def draw(o):
    """Draws and seals the labels, or takes those drawn before: (sha256, seconds the drawing took)."""
    out, mark = o.out, o.out / "drawn.json"
    if mark.exists():
        m = json.loads(mark.read_text())
        if label_hash(out / "truth") != m["sha256"]:
            sys.exit("the labels are not those that were sealed")
        return m["sha256"], m["seconds"]
    t0, total, done = time.monotonic(), sum(s[1] for s in o.sets + o.more), 0
    say = lambda i, *_: progress(done + i, total, t0, "drawing")
    for seed, n in o.sets:
        if o.system:
            systems.generate_openings(seed, n, out, say)
        else:
            generate(seed, n, out, say)
        done += n
    for seed, n, group in o.more:
        draw_group(seed, n, group, out, say)
        done += n
    sealed, seconds = label_hash(out / "truth"), time.monotonic() - t0
    mark.write_text(json.dumps(dict(sets=o.sets + o.more, sha256=sealed, seconds=seconds)))
    return sealed, seconds


def opened(cases, out, runs):
    """Opens the labels and judges every case."""
    rows = []
    for c in cases:
        truth = json.loads((out / "truth" / f"{c.name}.json").read_text())
        r = judge(c, truth, out / "verdicts" / c.name)
        r.update({k: runs[c.name].get(k) for k in ("seconds", "cpu", "mb", "code", "printed")})
        r.update(acts=truth["acts"], origin=truth["origin"], effect=truth["true_effect"], r2=truth["base_refit_r2"],
                 strange=any((m, f) in STRANGE for m, f in zip(truth["missing"], truth["forms"])))
        rows.append(r)
    return rows


def of_real_recordings(o, binary, engine, head):
    """What is said of real campaigns, and of effects planted into them under seal."""
    out, found, html, rows = o.out, [], "", []
    campaigns = sorted(p.parent for p in o.real.glob("*/campaign.toml")) if o.real else []
    sources = planted.campaigns_in(o.planted)
    if not campaigns and not sources:
        return page.Measured()
    plain = out / "real"
    answers, head["binary"] = diagnose_all(binary, list(dict.fromkeys([*campaigns, *sources])), plain, engine, "real recordings")
    if campaigns:
        found, html = real.sections(campaigns, plain, answers)
        (out / "real.json").write_text(json.dumps(jsonable(found), indent=1))
    if sources:
        folder = out / "planted"
        for old in ("open", "truth"):      # drawn anew from its seed: the same again
            shutil.rmtree(folder / old, ignore_errors=True)
        cases, head["planted"] = planted.draw(sources, plain, folder, o.planted_seed, o.strength, o.planted_share)
        print(f"{len(cases)} effects planted into {len(sources)} campaigns from seed {o.planted_seed}; labels sealed before the diagnosis, sha256 {head['planted']}", flush=True)
        diagnose_all(binary, cases, folder / "verdicts", engine, "planted")
        if label_hash(folder / "truth") != head["planted"]:
            sys.exit("the labels changed while they were sealed: nothing is proved")
        rows = planted.judge(cases, folder, plain)
        (out / "planted.json").write_text(json.dumps(rows, indent=1))
    return page.Measured(found, html, rows)


def main():
    o = options()
    out = o.out
    binary = built(o.touchdown)
    engine = Workers(o.dask) if o.dask else Shard(o.shard, o.jobs) if o.shard else Threads(o.jobs)
    commit = o.commit if o.touchdown else subprocess.run(["git", "-C", str(ROOT), "rev-parse", "--short", "HEAD"], capture_output=True, text=True).stdout.strip()
    total = sum(n for _, n in o.sets)
    head = dict(sets=o.sets, groups=o.more, cases=total, date=datetime.date.today().isoformat(), commit=commit, jobs=o.jobs)
    rows, more, single_level, others = [], [], None, None
    if o.sets or o.more:
        sealed, head["draw_s"] = draw(o)
        head["sha256"] = sealed
        print(f"{total + sum(n for _, n, _ in o.more)} cases drawn from {page.seeds(head)}; labels sealed before the diagnosis, sha256 {sealed}", flush=True)
        if o.more:
            print("strangers, " + "; ".join(scores.halves()), flush=True)
        if o.system:
            systems.prove(o, binary, head, diagnose_all)
            return
        cases = [out / "open" / f"s{s}-{i + 1:03d}" for s, n in o.sets for i in range(n)][:o.first or total]
        of_groups = [out / "open" / case_name(s, g, i) for s, n, g in o.more for i in range(n)]
        head["cases"] = len(cases)
        runs, head["binary"] = diagnose_all(binary, cases + of_groups, out / "verdicts", engine, "diagnosing")
        if o.shard:
            left = sum(1 for c in cases + of_groups if c.name not in runs)
            print(f"share {o.shard} is diagnosed; {left} of {len(cases + of_groups)} cases are left to the others")
            return
        if label_hash(out / "truth") != sealed:
            sys.exit("the labels changed while they were sealed: nothing is proved")
        rows, more = opened(cases, out, runs), opened(of_groups, out, runs)
        if o.one_level and rows:
            single_level = one_level(binary, out, rows, o.one_level, engine)
        (out / "scores.json").write_text(json.dumps(jsonable(dict(head=head, summary=summary(rows), figures=scores.figures(rows + more), one_level=single_level, cases=rows + more)), indent=1))
        if o.beside and rows:
            from .beside import compare
            others = jsonable(compare(out, rows[:o.beside_cases or len(rows)], progress))
            (out / "beside.json").write_text(json.dumps(others, indent=1))
        elif (out / "beside.json").exists() and o.again:
            others = json.loads((out / "beside.json").read_text())
    measured = of_real_recordings(o, binary, engine, head)
    page.write(out, head, rows, others, measured, single_level, more)
    print(page.markdown(head, rows, others, measured, more))
    if o.readme:
        page.readme(ROOT, out, head, rows, others, measured, more)
    print(f"page: {out / 'index.html'}")


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        sys.exit("\nstopped; --again goes on where this ended")
