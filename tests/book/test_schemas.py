"""The schemas accept every file of that format in the repository, and refuse what the program refuses."""

import json
import tomllib

import jsonschema
import pytest

from tests.book.pages import ROOT

EXAMPLES = ROOT / "harness/examples"


def validator(name):
    schema = json.loads((ROOT / f"docs/src/formats/schemas/{name}.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def files():
    """Every file of a format, with that format."""
    found = []
    for path in sorted(EXAMPLES.rglob("*.toml")):
        head = tomllib.loads(path.read_text())
        name = "recordings" if path.name == "campaign.toml" else "system" if "fmu" in head else "scenario" if "kind" in head else None
        if name:
            found.append(pytest.param(name, path, id=str(path.relative_to(EXAMPLES))))
    return found


@pytest.mark.parametrize("name, path", files())
def test_the_schema_accepts_what_the_program_runs(name, path):
    errors = [f"{'/'.join(map(str, e.path))}: {e.message}" for e in validator(name).iter_errors(tomllib.loads(path.read_text()))]
    assert not errors, errors


def test_there_are_examples_of_every_format():
    assert {p.values[0] for p in files()} == {"recordings", "system", "scenario"}


RIGHT = {
    "recordings": """format = "recordings/1"\n[campaign]\nkind = "drop_test"\n[campaign.columns]\nbatch = "B7"\ntemperature = 23.5\n[rig]\nmoving_mass = 0.5\n[simulation]\nterms = ["gravity"]\n[[recording]]\nfile = "a.csv"\nlevel = "low"\n""",
    "scenario": """kind = "drop-test"\nmass = 0.5\nimpact_speed = 1\n[contact]\nstiffness = 1e6\nexponent = 1.5\nadhesion_form = "growing"\n[motion.guide_friction]\nfriction = 2.0\n""",
    "system": """[[fmu]]\nname = "a"\nfile = "a.fmu"\nset = { x = 1.5, name = "text" }\n[[connect]]\nfrom = "a.y"\nto = "a.u"\n[master]\nstop = 1\nadapt = { by = "energy", tolerance = 1e-6 }\n""",
}
WRONG = [
    ("recordings", "moving_mass", "moving_mas"), ("recordings", "0.5", "-0.5"), ("recordings", '"gravity"', '"grvity"'), ("recordings", "drop_test", "droptest"), ("recordings", 'file = "a.csv"', "order = 1"), ("recordings", "23.5", "[23.5]"),
    ("scenario", "drop-test", "drop"), ("scenario", "stiffness", "stifness"), ("scenario", '"growing"', '"shrinking"'), ("scenario", "friction = 2.0", "friction = -2.0"), ("scenario", "guide_friction", "guide_frction"),
    ("system", 'file = "a.fmu"', ""), ("system", '"energy"', '"enrgy"'), ("system", "stop = 1", 'stop = "late"'), ("system", "to = ", "too = "),
]


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_file_is_accepted(name):
    validator(name).validate(tomllib.loads(RIGHT[name]))


@pytest.mark.parametrize("name, old, new", WRONG)
def test_a_wrong_file_is_refused(name, old, new):
    assert old in RIGHT[name]
    assert list(validator(name).iter_errors(tomllib.loads(RIGHT[name].replace(old, new, 1))))
