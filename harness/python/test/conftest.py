"""What the tests share: the demo's campaign, and the command whose answers the package gives."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

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


@dataclass(frozen=True)
class Example:
    """The README's example: its lines, what they made, and the folder they were run in."""

    lines: list[str]
    found: td.Diagnosis
    folder: Path


@pytest.fixture(scope="session")
def example(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Example]:
    """The README's example, run in a folder where the repository's files are."""
    [code] = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    folder, before = tmp_path_factory.mktemp("example"), Path.cwd()
    (folder / "harness").symlink_to(ROOT / "harness")
    names: dict[str, Any] = {}
    os.chdir(folder)
    try:
        exec(compile(code, "README.md", "exec"), names)
    finally:
        os.chdir(before)
    # what it named by a path from that folder
    found: td.Diagnosis = names["found"]
    found.campaign = td.Campaign(EXAMPLES / "bench_drop")
    yield Example([line for line in code.splitlines() if line.strip()], found, folder)


@pytest.fixture(scope="session")
def found(example: Example) -> td.Diagnosis:
    """The package's answer on the demo's campaign."""
    return example.found


def content(file: Path) -> bytes:
    """What a file holds; of a page all but the block that says when and by which command it was made."""
    return re.sub(rb'<footer class="trace".*?</footer>', b"", file.read_bytes(), flags=re.DOTALL)


def files(folder: Path) -> dict[str, bytes]:
    """Every file below a folder by its path, but the manifest, which names the program that wrote it."""
    paths = (p for p in folder.rglob("*") if p.is_file() and p.name != "manifest.json")
    return {str(p.relative_to(folder)): content(p) for p in paths}
