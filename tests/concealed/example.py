"""python -m tests.concealed.example --seed S --tier concealed --mechanism plastic_indentation --out DIR"""
import argparse
import json
import sys
import tempfile
from pathlib import Path

from tests.systems.convert import convert

from .generate import case, jsonable, write_case
from .systems import KIND


def main():
    a = argparse.ArgumentParser(prog="python -m tests.concealed.example", description="Draws one campaign with one concealed effect: DIR, its label DIR.truth.json")
    a.add_argument("--seed", type=int, required=True)
    a.add_argument("--tier", default="concealed", choices=["plain", "concealed", "deep", "null"])
    a.add_argument("--mechanism", help="a name of the vocabulary; none for a null")
    a.add_argument("--system", action="store_true", help="a contactor opening, converted to a campaign that FMUs simulate")
    a.add_argument("--out", type=Path, required=True)
    o = a.parse_args()
    if o.out.exists():
        sys.exit(f"{o.out} is there already: give another --out")
    if (o.tier == "null") != (o.mechanism is None):
        sys.exit("give --mechanism, or --tier null")
    (rig, data, measured, mass, user, truth), _, _ = case(o.seed, 0, o.tier, o.mechanism, {}, KIND if o.system else None)
    if o.system:
        with tempfile.TemporaryDirectory() as folder:
            write_case(Path(folder) / o.out.name, o.out.name, rig, data, measured, mass, user, "s")
            convert(Path(folder) / o.out.name, o.out)
    else:
        write_case(o.out, o.out.name, rig, data, measured, mass, user, "s")
    drawn = f"python -m tests.concealed.example --seed {o.seed} --tier {o.tier}" + (f" --mechanism {o.mechanism}" if o.mechanism else "") + (" --system" if o.system else "")
    Path(f"{o.out}.truth.json").write_text(json.dumps(jsonable({"drawn by": drawn} | truth), indent=1) + "\n")
    toml = o.out / "campaign.toml"
    toml.write_text(f"# drawn by the laboratory in tests/concealed; what it conceals stands in {o.out.name}.truth.json beside this folder\n" + toml.read_text())
    print(f"{o.out}: {truth['kind']}, {len(rig.recs)} recordings of {', '.join(rig.channels)}; R^2 of the calibrated base {truth['base_refit_r2']:.4f}; label beside it, {o.out.name}.truth.json")


main()
