"""What touchdown's readers make of a file, for comparison with the library that wrote it."""
import json
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def dump_binary():
    # of the whole workspace, as tests/run builds it: features of crates are the same then, and nothing is compiled twice
    subprocess.run(["cargo", "build", "--release", "-q", "--workspace", "--example", "dump"], cwd=ROOT, check=True)
    return ROOT / "target" / "release" / "examples" / "dump"


@pytest.fixture
def dump(dump_binary):
    """A function: the file's groups, channels and samples as the reader gives them; `error=True`: its error's text instead."""
    def of(path, error=False):
        done = subprocess.run([str(dump_binary), str(path)], capture_output=True, text=True, timeout=120)
        assert done.returncode == (2 if error else 0), done.stderr[-2000:]
        return done.stderr if error else json.loads(done.stdout)
    return of
