"""Campaigns so small that a diagnosis takes about a second: indentations of a half space, with a pull while leaving in some."""
import math
import random
import subprocess
import zipfile


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


DESCRIPTION = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Bad" guid="{bad}" numberOfEventIndicators="0">
  <CoSimulation modelIdentifier="bad" canHandleVariableCommunicationStepSize="true"/>
  <UnitDefinitions>
    <Unit name="m"><BaseUnit m="1"/></Unit><Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit><Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
  </UnitDefinitions>
  <ModelVariables>
    <ScalarVariable name="penetration" valueReference="0" causality="output"><Real unit="m"/></ScalarVariable>
    <ScalarVariable name="velocity" valueReference="1" causality="output"><Real unit="m/s"/></ScalarVariable>
    <ScalarVariable name="force" valueReference="2" causality="output"><Real unit="N"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="1"/><Unknown index="2"/><Unknown index="3"/></Outputs></ModelStructure>
</fmiModelDescription>
"""
CAMPAIGN = """format = "recordings/1"
[campaign]
kind = "system"
[simulation]
system = "bad.fmu"
[[simulation.bond]]
name = "stop"
kind = "contact"
penetration = "bad.penetration"
velocity = "bad.velocity"
[simulation.channels]
force = "bad.force"
"""


def write_with_fmu(folder, on_load):
    """Writes a campaign that an FMU simulates whose library does `on_load`, in C, once it is loaded: in the diagnosis' own process
    where that runs FMUs in it."""
    write(folder, 1)
    (folder / "campaign.toml").write_text(CAMPAIGN + "".join(f'[[recording]]\nfile = "r{i}.csv"\nlevel = {i}\n' for i in (1, 2, 3)))
    source = folder / "bad.c"
    source.write_text(f"#include <stdlib.h>\n#include <unistd.h>\n__attribute__((constructor)) static void load(void) {{ {on_load} }}\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", folder / "bad.so", source], check=True)
    with zipfile.ZipFile(folder / "bad.fmu", "w") as z:
        z.writestr("modelDescription.xml", DESCRIPTION)
        z.write(folder / "bad.so", "binaries/linux64/bad.so")
