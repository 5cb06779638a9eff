"""Turns a campaign of a built-in rig into one that FMUs simulate: MovingBar and our element, coupled.

python -m tests.systems.convert CAMPAIGN OUT
"""

import shutil
import sys
import tomllib
from pathlib import Path

BAR = "mass travel spring_preload return_spring_rate"


def number(value):
    """As TOML has a float."""
    return repr(float(value))


def system_of(campaign):
    """The system file: the bar at rest on its seat, the element as the campaign's simulation has it."""
    rig, simulation = campaign["rig"], campaign["simulation"]
    if campaign["campaign"]["kind"] != "contactor-opening":
        raise SystemExit("only contactor openings are converted")
    if "k" not in simulation:
        raise SystemExit("a campaign that is not calibrated has no start values to convert")
    return f"""name = "contactor"

[[fmu]]
name = "bar"
file = "touchdown:moving-bar"
input_orders = 3
[fmu.set]
mass = {number(rig["moving_mass"])}
travel = {number(rig["travel"])}
start_penetration = {number(-rig["travel"])}
spring_preload = {number(campaign["recording"][0]["spring_preload"])}
return_spring_rate = {number(rig["return_spring_rate"])}

[[fmu]]
name = "contact"
file = "touchdown:contact"
[fmu.set]
stiffness = {number(simulation["k"])}
exponent = {number(simulation["p"])}
hysteresis_damping = {number(simulation.get("mu_d", 0.0))}

[[connect]]
from = "bar.penetration"
to = "contact.penetration"
[[connect]]
from = "bar.velocity"
to = "contact.velocity"
[[connect]]
from = "contact.force"
to = "bar.force"

[master]
stop = 0.1
step = 1e-5
"""


def campaign_of(campaign, head):
    """campaign.toml of kind system."""
    terms = campaign["simulation"].get("terms", ["hysteresis_damping"])
    free = ["contact.stiffness", "contact.exponent"]
    if "hysteresis_damping" in terms:
        free.append("contact.hysteresis_damping")
    text = f"""format = "recordings/1"

[campaign]
name = "{head["name"]}"
kind = "system"

[simulation]
system = "system.toml"
terms = {[*terms, "return_spring"]!r}
""".replace("'", '"')
    for variable in free:
        text += f'\n[[simulation.free]]\nvariable = "{variable}"\n'
    text += """
[[simulation.free]]
variable = "bar.mass"
tolerance = 0.002

[[simulation.bond]]
name = "stop"
kind = "contact"
force = "bar.force"
penetration = "bar.penetration"
velocity = "bar.velocity"

[simulation.channels]
force = "contact.force"
acceleration = "bar.acceleration"
penetration = "bar.penetration"
"""
    for r in campaign["recording"]:
        text += f'\n[[recording]]\nfile = "{r["file"]}"\norder = {r["order"]}\n'
        text += f'spring_preload = {number(r["spring_preload"])}\n'
        text += f'[recording.set]\n"bar.spring_preload" = {number(r["spring_preload"])}\n'
    return text


def convert(source, out):
    """Writes the converted campaign of the folder `source` to the folder `out`."""
    source, out = Path(source), Path(out)
    campaign = tomllib.loads((source / "campaign.toml").read_text())
    out.mkdir(parents=True, exist_ok=True)
    (out / "system.toml").write_text(system_of(campaign))
    (out / "campaign.toml").write_text(campaign_of(campaign, campaign["campaign"]))
    for r in campaign["recording"]:
        shutil.copy(source / r["file"], out / r["file"])


if __name__ == "__main__":
    convert(*sys.argv[1:3])
