"""Prints the book's table of hosts from runs made now: python -m tests.hosts.table"""

import importlib.util
import tempfile

from . import cases, masters, measure

MODULES = {"fmpy": "fmpy", "libcosimpy": "libcosimpy", "ecospy": "ecospy"}
LIMITS = {
    "touchdown run": "",
    "touchdown run, jacobi": "",
    "fmpy simulate_ssp": "steps all from the last point; ignores parameter bindings, so values are packed in",
    "libcosimpy from_ssp_file": "needs the step in whole nanoseconds; without one it crashes",
    "ecospy ssp": "needs TBB",
    "fmucontainer in fmpy": "step fixed when the container is made",
    "MuJoCo": "",
    "Exudyn": "",
    "Drake": "",
}


def main():
    print("| host | version | stepping | lookahead | restitution off by | without lookahead | peak off by | limits |")
    print("|---|---|---|---|---|---|---|---|")
    for name, package, function, lookahead in masters.ALL:
        if package in MODULES and importlib.util.find_spec(MODULES[package]) is None:
            print(f"| {name} | - | not installed | | | | | |")
            continue
        release = measure.version(package) if package else "this"
        order = "sequential" if lookahead == 0.5 else "parallel"
        good, plain = (measure.worst_master(function, at) for at in (lookahead, 0.0))
        print(f"| {name} | {release} | {order} | {lookahead} | {good:.1e} | {plain:.1e} | - | {LIMITS[name]} |")
    if masters.fmi_sim_path() is None:
        print("| fmi-sim | - | not installed | | | | | |")
    else:
        with tempfile.TemporaryDirectory() as folder:
            flight, contact = abs(masters.fmi_sim_flight(folder)), masters.fmi_sim_contact(folder)
        notes = f"one FMU, no connections: bar's flight off by {flight:.0e}, driven contact's force by {contact:.0e}"
        print(f"| fmi-sim | 0.7.0 | one FMU | - | - | - | - | {notes} |")
    with tempfile.TemporaryDirectory() as folder:
        fmu = cases.pack(f"{folder}/HysteresisContact.fmu")
        reference = None
        for name, how, drive, options, lookahead in measure.ENGINES:
            module = {"MuJoCo": "mujoco", "Exudyn": "exudyn", "Drake": "pydrake"}[name]
            if importlib.util.find_spec(module) is None:
                print(f"| {name} | - | not installed | | | | | |")
                continue
            release = measure.version("drake" if module == "pydrake" else module)
            reference = reference or measure.contactor_reference()
            good, peak = measure.worst_impact(fmu, drive, options, lookahead)
            plain = "" if lookahead == 0.0 else f"{measure.worst_impact(fmu, drive, options, 0.0)[0]:.1e}"
            end, _ = measure.rest(fmu, drive, options, lookahead)
            rebound = measure.contactor(fmu, drive, options, lookahead)[1] / reference[1] - 1.0
            notes = f"rest off by {abs(end):.0e}, contactor's rebound by {abs(rebound):.0e}"
            print(f"| {name} | {release} | {how} | {lookahead} | {good:.1e} | {plain} | {peak:.1e} | {notes} |")


if __name__ == "__main__":
    main()
