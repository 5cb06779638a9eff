"""What the tests share: the demo's campaign, and the command whose answers the package gives."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
import touchdown_impact as td

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "harness/examples"

Command = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="session")
def command() -> Command:
    """Runs the command `touchdown` of the same build."""
    program = os.environ.get("TOUCHDOWN", str(ROOT / "target/release/touchdown"))

    def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)

    return run


@pytest.fixture(scope="session")
def campaign() -> Path:
    """The demo's campaign."""
    return EXAMPLES / "bench_drop"


@pytest.fixture(scope="session")
def by_command(command: Command, campaign: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The command's answer on the demo's campaign."""
    out = tmp_path_factory.mktemp("command")
    done = command("diagnose", campaign, "--out", out)
    assert done.returncode == 0, done.stderr
    (out / "said.txt").write_text(done.stdout, encoding="utf-8")
    return out


@pytest.fixture(scope="session")
def found(campaign: Path) -> td.Diagnosis:
    """The package's answer on the demo's campaign."""
    return td.diagnose(campaign)


def files(folder: Path) -> dict[str, bytes]:
    """Every file below a folder by its path, but the manifest, which tells the program that wrote it."""
    paths = (p for p in folder.rglob("*") if p.is_file() and p.name != "manifest.json")
    return {str(p.relative_to(folder)): p.read_bytes() for p in paths}
