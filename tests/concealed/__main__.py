"""python -m tests.concealed --seed S --cases N [--group GROUP] --out DIR"""
import argparse
import sys
import time
from pathlib import Path

from .generate import generate, label_hash
from .groups import GROUPS, draw_group

OPEN = [g for g in GROUPS if g != "sealed"]      # the sealed half of the strangers is drawn by tests/prove alone


def main():
    a = argparse.ArgumentParser(prog="python -m tests.concealed", description="Draws concealed cases: DIR/open/<case>, DIR/truth/<case>.json; several groups and seeds may go into one DIR")
    a.add_argument("--seed", type=int, required=True)
    a.add_argument("--cases", type=int, required=True)
    a.add_argument("--out", type=Path, required=True)
    a.add_argument("--group", choices=OPEN, help="campaigns of a group of groups.py in place of today's mix")
    a.add_argument("--verbose", action="store_true", help="print the labels while drawing (not blind)")
    o = a.parse_args()
    if o.cases < 1:
        sys.exit("--cases must be at least 1")
    mark = o.out / "open" / (f"s{o.seed}-{o.group}-001" if o.group else f"s{o.seed}-001")
    if mark.exists():
        sys.exit(f"{mark} is there already: give another --out or --seed")
    t0 = time.time()

    def say(i, n, name, tier, t, tries):
        if o.verbose:
            print(f"{i}/{n} {time.time() - t0:6.1f}s {name} {tier} {t['kind']} {'+'.join(t['missing'])} {t['forms']} s={t['strength']:.3g} "
                  f"R2={t['base_refit_r2']:.5f} mon={t['misfit_over_noise']:.2f} oracle={t['oracle_misfit'] or float('nan'):.4f} tries={tries}", flush=True)
        elif i % 10 == 0 or i == n:
            print(f"{i}/{n} cases, {time.time() - t0:.0f} s", file=sys.stderr, flush=True)

    if o.group:
        draw_group(o.seed, o.cases, o.group, o.out, say)
    else:
        generate(o.seed, o.cases, o.out, say)
    print("labels sha256", label_hash(o.out / "truth"))


main()
