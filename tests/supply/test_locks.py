"""Lock files of workspaces beside the main one: what builds with --locked fails where they lag behind."""

import pathlib
import subprocess

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
MANIFESTS = sorted(p.relative_to(ROOT) for p in ROOT.glob("tests/*/Cargo.toml") if (p.parent / "Cargo.lock").exists())


@pytest.mark.parametrize("manifest", MANIFESTS, ids=str)
def test_a_lock_file_is_of_the_manifests_that_it_locks(manifest):
    command = ["cargo", "metadata", "--locked", "--offline", "--format-version", "1", "--manifest-path", manifest]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert "lock file" not in done.stderr, f"{done.stderr}run `cargo metadata --manifest-path {manifest}` and commit its Cargo.lock"


def test_the_fuzzers_have_a_lock_file():
    assert pathlib.Path("tests/fuzz/Cargo.toml") in MANIFESTS
