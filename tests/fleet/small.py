"""Campaigns so small that a diagnosis takes about a second: indentations of a half space, with a pull while leaving in some."""
import math
import random


def write(folder, seed, adhesion=0.0, levels=(2e-5, 4e-5, 6e-5), samples=48, columns=None):
    """Writes a campaign of one indentation a level. adhesion: pull while leaving, share of the largest force."""
    rng = random.Random(seed)
    k, p = 4e9 * math.exp(rng.gauss(0, 0.1)), 1.5
    largest = k * max(levels) ** p
    folder.mkdir(parents=True)
    lines = ['format = "recordings/1"', "[campaign]", 'kind = "indentation"']
    if columns:
        lines += ["[campaign.columns]", *(f'{name} = {value!r}'.replace("'", '"') for name, value in columns.items())]
    lines += ["[simulation]", "terms = []", f"k = {k:.6g}", f"p = {p}"]
    for i, level in enumerate(levels):
        rows = ["time [s],force [N],penetration [m]"]
        for j in range(samples):
            t = j / (samples - 1)
            x = level * (1.3 * math.sin(math.pi * t) - 0.3)
            force = k * max(x, 0.0) ** p
            if t > 0.5 and x > 0:
                force -= adhesion * largest * x / max(levels)
            rows.append(f"{0.1 * t:.6g},{force + largest * rng.gauss(0, 1e-3):.6g},{x + max(levels) * rng.gauss(0, 3e-4):.6g}")
        (folder / f"r{i + 1}.csv").write_text("\n".join(rows) + "\n")
        lines += ["[[recording]]", f'file = "r{i + 1}.csv"', f"order = {i + 1}", f"level = {level:g}"]
    (folder / "campaign.toml").write_text("\n".join(lines) + "\n")
