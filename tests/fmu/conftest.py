"""Packs the element once for all tests."""

import os
import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def touchdown():
    """The command, built."""
    program = os.environ.get("TOUCHDOWN", str(ROOT / "target/release/touchdown"))
    assert os.path.exists(program), "build it first: cargo build --release --workspace"
    return program


@pytest.fixture(scope="session")
def fmu(touchdown, tmp_path_factory):
    """The packed FMU."""
    path = tmp_path_factory.mktemp("fmu") / "HysteresisContact.fmu"
    subprocess.run([touchdown, "pack", "--out", str(path)], check=True)
    return str(path)
