"""The program, small fleets, and answers compared."""

import json
import os
import pathlib
import re
import subprocess

import pytest

from tests.fleet.small import write

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = pathlib.Path(os.environ.get("TOUCHDOWN", ROOT / "target/release/touchdown"))


def touchdown(*arguments, code=0, **settings):
    """Runs the program; what it printed, after the exit code was looked at."""
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, check=False, **settings)
    assert code is None or done.returncode == code, (arguments, done.returncode, done.stdout, done.stderr)
    return done


def content(file):
    """What a file holds; of a page all but the block that says when and by which command it was made and the links to pages above, which a
    campaign by itself has none of; of a manifest all but its pages."""
    if file.name == "manifest.json":
        manifest = json.loads(file.read_text())
        return manifest | {"files": {n: f for n, f in manifest["files"].items() if not n.endswith(".html")}}
    return re.sub(rb'<footer class="trace".*?</footer>|<nav class="pages".*?</nav>', b"", file.read_bytes(), flags=re.DOTALL)


def answer(folder):
    """The files of an answer by name, but for what belongs to the fleet."""
    return {str(f.relative_to(folder)): content(f) for f in sorted(folder.rglob("*")) if f.is_file()}


@pytest.fixture(scope="session")
def fleet(tmp_path_factory):
    """Eight campaigns that can be judged, one that is none, and one whose samples are too few."""
    folder = tmp_path_factory.mktemp("fleet") / "campaigns"
    for i in range(8):
        write(folder / f"c{i}", i, 0.2 if i % 2 else 0.0, levels=(2e-5, 4e-5), samples=32, columns={"order": i, "batch": "AB"[i % 2]})
    write(folder / "none", 8)
    (folder / "none" / "campaign.toml").write_text("format = 1\n")
    write(folder / "short", 9, samples=4)
    return folder


@pytest.fixture(scope="session")
def one_machine(fleet, tmp_path_factory):
    """The fleet's answers of one process a campaign, one after the other."""
    out = tmp_path_factory.mktemp("one") / "answers"
    for c in sorted(fleet.glob("c*")):
        touchdown("diagnose", c, "--out", out, "--alone")
    return out
