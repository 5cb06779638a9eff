"""The scripts for Slurm and HyperQueue, run as these run them: by the scheduler where it is installed, else by a stand-in that
reads the script's directives, sets the variables of its documentation, and runs every task."""

import os
import re
import shutil
import subprocess

import pytest

from tests.fleet.conftest import PROGRAM, ROOT, answer, touchdown

SCRIPTS = ROOT / "harness/examples/fleet"
NAMES = [f"c{i}" for i in range(8)]


def copied(name, folder, shares):
    """The script as a user would copy and change it."""
    text = (SCRIPTS / name).read_text()
    changed = re.sub(r"^(#SBATCH --array=|#HQ --array )1-\d+", rf"\g<1>1-{shares}", text, flags=re.M)
    changed = re.sub(r"^shares=\d+", f"shares={shares}", changed, flags=re.M)
    assert changed != text
    (folder / name).write_text(changed)
    return folder / name


def directives(script, mark):
    """Options of the script's directives, as the scheduler reads them: up to the first command."""
    found = {}
    for line in script.read_text().splitlines()[1:]:
        if line.startswith(mark):
            words = line[len(mark):].split("#")[0].strip()
            name, _, value = words.lstrip("-").replace("=", " ", 1).partition(" ")
            found[name] = value.strip()
        elif line and not line.startswith("#"):
            break
    return found


def run(script, variables, tasks):
    codes = []
    for task in tasks:
        env = dict(os.environ, TOUCHDOWN=str(PROGRAM), **{k: v.format(task=task) for k, v in variables.items()})
        done = subprocess.run(["bash", script.name], cwd=script.parent, env=env, capture_output=True, text=True, check=False)
        codes.append((done.returncode, done.stderr))
    return codes


def submitted(script, tasks=None):
    """Submits the script, and waits for its tasks: all of the array, or those given."""
    if script.name == "slurm.sh":
        given = directives(script, "#SBATCH")
        if shutil.which("sbatch"):
            more = [] if tasks is None else [f"--array={','.join(map(str, tasks))}"]
            subprocess.run(["sbatch", "--wait", *more, script.name], cwd=script.parent, check=False, env=dict(os.environ, TOUCHDOWN=str(PROGRAM)))
            return None
        variables = {"SLURM_ARRAY_TASK_ID": "{task}", "SLURM_CPUS_PER_TASK": given["cpus-per-task"]}
    else:
        given = directives(script, "#HQ")
        if shutil.which("hq"):
            more = [] if tasks is None else ["--array", ",".join(map(str, tasks))]
            subprocess.run(["hq", "submit", "--wait", *more, script.name], cwd=script.parent, check=False, env=dict(os.environ, TOUCHDOWN=str(PROGRAM)))
            return None
        variables = {"HQ_TASK_ID": "{task}"}
    first, _, last = given["array"].partition("-")
    return run(script, variables, tasks or range(int(first), int(last) + 1))


@pytest.mark.parametrize("name", ["slurm.sh", "hyperqueue.sh"])
def test_a_script_diagnoses_the_fleet_and_does_what_is_lost_again(fleet, one_machine, tmp_path, name):
    (tmp_path / "campaigns").symlink_to(fleet)
    script = copied(name, tmp_path, 3)
    codes = submitted(script)
    if codes is not None:
        assert sorted(c for c, _ in codes) == [0, 2, 2], codes
    touchdown("merge", tmp_path / "answers", code=2)
    for c in NAMES:
        assert answer(tmp_path / "answers" / c) == answer(one_machine / c)
    # one answer is lost, and the share that has it submitted alone
    shutil.rmtree(tmp_path / "answers/c4")
    submitted(script, [2])
    assert answer(tmp_path / "answers/c4") == answer(one_machine / "c4")


@pytest.mark.parametrize("name, variable", [("slurm.sh", "SLURM_ARRAY_TASK_ID"), ("hyperqueue.sh", "HQ_TASK_ID")])
def test_an_array_beyond_the_shares_is_refused(tmp_path, name, variable):
    (code, said), = run(copied(name, tmp_path, 3), {variable: "{task}"}, [4])
    assert code == 2 and "let shares and --array agree" in said
