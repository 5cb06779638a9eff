"""Contactor openings by the built-in rig and, converted, by FMUs, side by side. Run by tests/systems/run."""

import argparse
import json
import os
import statistics
import sys
import tomllib
from pathlib import Path

from tests.concealed.prove import built, diagnose_all
from tests.concealed.systems import in_words
from tests.systems.convert import convert

ROOT = Path(__file__).resolve().parents[2]
OPEN = ROOT.parent / "shared" / "concealed" / "open"
LONGEST = 10.0           # times the built-in rig's processor time that FMUs may take


def options():
    a = argparse.ArgumentParser(prog="tests/systems/run", description="Diagnoses contactor openings by the built-in rig and, converted, by FMUs.")
    a.add_argument("campaigns", metavar="CAMPAIGN", type=Path, nargs="*", help="folder of a contactor opening (default: all of ../shared/concealed/open)")
    a.add_argument("--out", type=Path, default=ROOT / "out" / "systems", help="folder of converted campaigns and answers (default out/systems)")
    a.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    a.add_argument("--touchdown", type=Path, help="another touchdown binary than the one the launcher builds")
    return a.parse_args()


def is_opening(folder):
    return tomllib.loads((folder / "campaign.toml").read_text())["campaign"]["kind"] == "contactor-opening"


def named(out, campaign):
    """What a verdict names, in words; None where there is none."""
    path = out / campaign.name / "verdict.json"
    if not path.exists():
        return None
    v = json.loads(path.read_text())
    return in_words(sorted(m["mechanism"] for m in v["missing"]), v["unexplained"]["detected"])


def main():
    o = options()
    campaigns = o.campaigns or [p for p in sorted(OPEN.glob("*/")) if is_opening(p)]
    if not campaigns:
        sys.exit(f"no contactor opening in {OPEN}: name some")
    converted = [o.out / "converted" / c.name for c in campaigns]
    for c, to in zip(campaigns, converted):
        convert(c, to)
    binary = built(o.touchdown)
    rig, _ = diagnose_all(binary, campaigns, o.out / "rig", o.jobs, "by the rig")
    fmus, _ = diagnose_all(binary, converted, o.out / "fmus", o.jobs, "by FMUs")
    print("| campaign | built-in rig | FMUs | same | time, FMUs over rig |\n|---|---|---|---|---|")
    same, ratios = 0, []
    for c in campaigns:
        ours, theirs = named(o.out / "rig", c), named(o.out / "fmus", c)
        alike = ours is not None and ours == theirs
        same += alike
        ratios.append(fmus[c.name]["cpu"] / rig[c.name]["cpu"])
        print(f"| `{c.name}` | {ours or 'no answer'} | {theirs or 'no answer'} | {'yes' if alike else 'no'} | {ratios[-1]:.1f} |")
    print(f"\nSame names: {same} of {len(campaigns)}. Processor time of FMUs over that of the rig: {statistics.median(ratios):.1f} in the middle, {max(ratios):.1f} at most.")
    sys.exit(same < len(campaigns) or max(ratios) > LONGEST)


if __name__ == "__main__":
    main()
