"""Seeded pulses, and what touchdown makes of them."""
import json
import subprocess
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
TOLERANCE = 1e-6
LARGEST = {}          # by what was compared


@pytest.fixture
def agrees():
    """A function: holds a deviation against the tolerance, and keeps the largest for the summary."""
    def of(what, off):
        LARGEST[what] = max(LARGEST.get(what, 0.0), float(off))
        assert off < TOLERANCE, what
    return of


def pytest_terminal_summary(terminalreporter):
    for what, off in sorted(LARGEST.items()):
        terminalreporter.write_line(f"largest deviation, {what}: {off:.1e}")


def build(*what):
    subprocess.run(["cargo", "build", "--release", "-q", *what], cwd=ROOT, check=True)


@pytest.fixture(scope="session")
def signal():
    """A function: `signal("cfc", rate, class, columns=[y])` gives the rows that the example prints, split at commas."""
    build("-p", "touchdown-assess", "--example", "signal")

    def of(*words, columns):
        rows = "\n".join(",".join(f"{v:.17g}" for v in row) for row in zip(*columns, strict=True))
        command = [ROOT / "target" / "release" / "examples" / "signal", *(str(w) for w in words)]
        done = subprocess.run(command, input=rows, capture_output=True, text=True, timeout=120)
        assert done.returncode == 0, done.stderr[-2000:]
        return [line.split(",") for line in done.stdout.splitlines()]
    return of


@pytest.fixture(scope="session")
def compare():
    """A function: the answer of `touchdown compare --json` to its words."""
    build("-p", "touchdown")

    def of(*words):
        done = subprocess.run([ROOT / "target" / "release" / "touchdown", "compare", *(str(w) for w in words), "--json"], capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stderr[-2000:]
        return json.loads(done.stdout)
    return of


def half_sine(u):
    return np.where((u >= 0) & (u <= 1), np.sin(np.pi * u), 0.0)


def haversine(u):
    return np.where((u >= 0) & (u <= 1), 0.5 - 0.5 * np.cos(2 * np.pi * u), 0.0)


def saw_tooth(u):
    return np.where((u >= 0) & (u <= 1), u, 0.0)


def bouncing_contact(u):
    """Contacts of one length with less and less in between, each of less speed."""
    y, start, height = np.zeros_like(u), 0.0, 1.0
    for _ in range(5):
        y += height * half_sine((u - start) / 0.2)
        start, height = start + 0.2 + 0.7 * height, 0.6 * height
    return y


SHAPES = {"half sine": half_sine, "haversine": haversine, "saw tooth": saw_tooth, "bouncing contact": bouncing_contact}


def draw(shape, seed, rate, seconds):
    """A pulse of random place, width and height with noise on it, and another that is late, longer, higher and noisier."""
    rng = np.random.default_rng([seed, *shape.encode()])
    t = np.arange(round(rate * seconds)) / rate
    if shape == "noise":
        y = rng.normal(size=t.size) * 30
        return t, y, y * rng.uniform(0.7, 1.2) + rng.normal(size=t.size) * 10
    place, width, height = rng.uniform(0.25, 0.4) * seconds, rng.uniform(0.05, 0.2) * seconds, rng.choice([-1, 1]) * 10 ** rng.uniform(0, 4)
    late, longer, higher = rng.uniform(-0.1, 0.1) * seconds, rng.uniform(0.8, 1.3), rng.uniform(0.6, 1.3)
    noise = [abs(height) * level * rng.normal(size=t.size) for level in (0.01, 0.02)]
    of = SHAPES[shape]
    return t, height * of((t - place) / width) + noise[0], higher * height * of((t - place - late) / (width * longer)) + noise[1]


DRAWN = [(shape, seed) for shape in [*SHAPES, "noise"] for seed in range(4)]
