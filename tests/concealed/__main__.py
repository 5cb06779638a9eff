"""python -m tests.concealed --seed S --cases N --out DIR"""
import argparse
import sys
import time
from pathlib import Path

from .generate import generate, label_hash


def main():
    a = argparse.ArgumentParser(prog="python -m tests.concealed", description="Draws concealed cases: DIR/open/<case>, DIR/truth/<case>.json")
    a.add_argument("--seed", type=int, required=True)
    a.add_argument("--cases", type=int, required=True)
    a.add_argument("--out", type=Path, required=True)
    a.add_argument("--verbose", action="store_true", help="print the labels while drawing (not blind)")
    o = a.parse_args()
    if o.cases < 1:
        sys.exit("--cases must be at least 1")
    if (o.out / "open").exists():
        sys.exit(f"{o.out / 'open'} is there already: give another --out")
    t0 = time.time()

    def say(i, n, name, tier, t, tries):
        if o.verbose:
            print(f"{i}/{n} {time.time() - t0:6.1f}s {name} {tier} {t['kind']} {'+'.join(t['missing'])} {t['forms']} s={t['strength']:.3g} "
                  f"R2={t['base_refit_r2']:.5f} mon={t['misfit_over_noise']:.2f} oracle={t['oracle_misfit']:.4f} tries={tries}", flush=True)
        elif i % 10 == 0 or i == n:
            print(f"{i}/{n} cases, {time.time() - t0:.0f} s", file=sys.stderr, flush=True)

    generate(o.seed, o.cases, o.out, say)
    print("labels sha256", label_hash(o.out / "truth"))


main()
