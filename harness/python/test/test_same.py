"""What the package writes is what the command writes, byte for byte; what it raises is what the command prints."""

from __future__ import annotations

import json
import tomllib
import zipfile
from pathlib import Path

import pandas as pd
import polars as pl
import pytest
import touchdown_impact as td

from conftest import EXAMPLES, Command, Example, content, files


def test_the_readme_example_gives_the_verdict_of_the_command(example: Example, by_command: Path) -> None:
    assert len(example.lines) == 5
    theirs = by_command / "bench_drop"
    assert (example.found.folder / "verdict.json").read_bytes() == (theirs / "verdict.json").read_bytes()
    for name in ("report.html", "HysteresisContact.fmu"):
        assert content(example.folder / name) == content(theirs / name)


def test_a_diagnosis_is_that_of_the_command_file_by_file(found: td.Diagnosis, by_command: Path) -> None:
    ours, theirs = files(found.folder), files(by_command / "bench_drop")
    assert "verdict.json" in ours and len(ours) > 20
    assert ours == theirs
    said = (by_command / "said.txt").read_text(encoding="utf-8")
    assert said.startswith(str(found) + "\n")


@pytest.mark.parametrize("library", ["pandas", "polars"])
def test_tables_give_the_verdict_of_their_folder(library: str, campaign: Path, by_command: Path, tmp_path: Path) -> None:
    campaign_file = tomllib.loads((campaign / "campaign.toml").read_text(encoding="utf-8"))
    read = pd.read_csv if library == "pandas" else pl.read_csv
    each = {key: [r[key] for r in campaign_file["recording"]] for key in ("order", "impact_speed", "impact_speed_std", "drop_height")}
    made = td.Campaign.of(
        {r["file"]: read(campaign / r["file"]) for r in campaign_file["recording"]},
        mass=campaign_file["rig"]["moving_mass"],
        speed=each["impact_speed"],
        speed_std=each["impact_speed_std"],
        height=each["drop_height"],
        order=each["order"],
        name=campaign_file["campaign"]["name"],
        material=campaign_file["campaign"]["material"],
        **campaign_file["simulation"],
    )
    if library == "polars":
        # the diagnosis of the same recordings is tried above already
        assert made.to_frame("polars").equals(td.Campaign(campaign).to_frame("polars"))
        return
    found = td.diagnose(made, out=tmp_path)
    assert found.folder == tmp_path / "bench_drop"
    ours, theirs = (json.loads((f / "verdict.json").read_text(encoding="utf-8")) for f in (found.folder, by_command / "bench_drop"))
    # the files of tables are written by the package, and are others
    assert ours.pop("trace")["inputs"] != theirs.pop("trace")["inputs"]
    assert ours == theirs


def test_a_fit_is_that_of_the_command(command: Command, campaign: Path, tmp_path: Path) -> None:
    done = command("fit", campaign, "--out", tmp_path / "command")
    fitted = td.fit(campaign, out=tmp_path / "package")
    assert files(fitted.folder) == files(tmp_path / "command")
    assert done.stdout == str(fitted).replace("package", "command") + "\n"
    assert fitted.converged and fitted.parameters["p"].low is not None
    # the law goes into an FMU as it stands
    packed = td.run(EXAMPLES / "drop_test.toml", fmu=fitted.fmu(tmp_path / "Fitted.fmu"))
    assert packed.impacts


def somebody_elses(folder: Path) -> Path:
    """An FMU whose library is not known as ours: it runs in a process of its own."""
    fmu = folder / "Somebody_elses.fmu"
    with zipfile.ZipFile(td.pack(folder / "Ours.fmu").path) as ours, zipfile.ZipFile(fmu, "w") as other:
        for name in ours.namelist():
            other.writestr(name, ours.read(name) + (b"\0" if name.startswith("binaries/") else b""))
    return fmu


def test_a_run_is_that_of_the_command(command: Command, tmp_path: Path) -> None:
    scenario = EXAMPLES / "drop_test.toml"
    fmu = somebody_elses(tmp_path)
    cases: list[tuple[list[str | Path], Path | None, bool]] = [
        ([], None, False),
        (["--fmu", fmu], fmu, False),
        (["--direct"], None, True),
    ]
    for i, (flags, given, direct) in enumerate(cases):
        done = command("run", scenario, "--out", tmp_path / f"command-{i}", *flags)
        assert done.returncode == 0, done.stderr
        ran = td.run(scenario, out=tmp_path / f"package-{i}", fmu=given, direct=direct)
        assert files(ran.folder) == files(tmp_path / f"command-{i}")
        # steps lie about the peak, which is located between them
        largest = float(ran.to_frame()["force [N]"].max())
        assert 0.99 * ran.impacts[0]["peak_force"] < largest <= ran.impacts[0]["peak_force"]


def test_a_system_runs_with_a_step_and_an_end_in_place_of_its_own(command: Command, tmp_path: Path) -> None:
    system = EXAMPLES / "contactor_system.toml"
    done = command("run", system, "--step", "1e-5", "--stop", "1e-3", "--out", tmp_path / "command")
    assert done.returncode == 0, done.stderr
    ran = td.run(system, step=1e-5, stop=1e-3, out=tmp_path / "package")
    assert files(ran.folder) == files(tmp_path / "command")
    assert float(ran.to_frame()["time [s]"].max()) == pytest.approx(1e-3)
    with pytest.raises(td.TouchdownError, match="--step is for systems of FMUs"):
        td.run(EXAMPLES / "drop_test.toml", step=1e-5)


def test_an_fmu_that_takes_too_long_is_reported(tmp_path: Path) -> None:
    fmu = somebody_elses(tmp_path)
    with pytest.raises(td.TouchdownError, match="no answer for"):
        td.run(EXAMPLES / "drop_test.toml", fmu=fmu, fmus=td.Fmus(fmu_seconds=1e-6))
    with pytest.raises(td.TouchdownError, match="--fmu-seconds 0: give a time above 0"):
        td.run(EXAMPLES / "drop_test.toml", fmu=fmu, fmus=td.Fmus(fmu_seconds=0.0))


def test_a_packed_fmu_is_that_of_the_command(command: Command, tmp_path: Path) -> None:
    command("pack", "--out", tmp_path / "command.fmu", "--set", "stiffness=2e6", "--set", "adhesion_form=leaving")
    packed = td.pack(tmp_path / "package.fmu", {"stiffness": 2e6, "adhesion_form": "leaving"})
    assert packed.path.read_bytes() == (tmp_path / "command.fmu").read_bytes()
    assert packed.starts == {"stiffness": 2e6, "adhesion_form": 3.0}


def test_an_impact_is_that_of_the_command(command: Command) -> None:
    said = command("impact", "--mass", "0.5", "--speed", "0.8", "--stiffness", "2e7", "--restitution", "0.7", "--json")
    assert td.impact(mass=0.5, speed=0.8, stiffness=2e7, restitution=0.7).parameters == json.loads(said.stdout)


def test_an_import_is_that_of_the_command(command: Command, campaign: Path, tmp_path: Path) -> None:
    recordings = sorted(campaign.glob("*.csv"))
    flags = ["--mass", "0.32622", "--speed", "0.5 m/s", "--kind", "drop-test", "--name", "drops"]
    done = command("import", *recordings, "--out", tmp_path / "command", *flags)
    assert done.returncode == 0, done.stderr
    made = td.import_(recordings, out=tmp_path / "package", mass=0.32622, speed="0.5 m/s", kind="drop-test", name="drops")
    assert files(made.folder) == files(tmp_path / "command")
    assert made.imported is not None and len(made.imported["recordings"]) == len(made.recordings) == 10


def errors(said: str) -> str:
    """What the command says is wrong."""
    return "\n".join(line.removeprefix("error: ") for line in said.splitlines() if line.startswith("error: "))


def test_errors_have_the_words_of_the_command(command: Command, campaign: Path, tmp_path: Path) -> None:
    bad = tmp_path / "bad"
    bad.mkdir()
    text = (campaign / "campaign.toml").read_text(encoding="utf-8")
    (bad / "campaign.toml").write_text(text.replace("drop_height = 0.005", "drop_heihgt = 0.005", 1), encoding="utf-8")
    out = tmp_path / "out"
    for folder in [bad, tmp_path / "absent"]:
        for task in ("diagnose", "fit"):
            said = command(task, folder, "--out", out)
            assert said.returncode == 2
            with pytest.raises(td.TouchdownError) as raised:
                td.diagnose(folder, out=out) if task == "diagnose" else td.fit(folder, out=out)
            assert str(raised.value) == errors(said.stderr) != ""
    assert not out.exists()
    said = command("pack", "--out", tmp_path / "x.fmu", "--set", "stifness=1")
    with pytest.raises(td.TouchdownError) as raised:
        td.pack(tmp_path / "x.fmu", {"stifness": "1"})
    assert str(raised.value) == errors(said.stderr) and "did you mean" in str(raised.value)
    said = command("import", campaign / "campaign.toml", "--out", out)
    with pytest.raises(td.TouchdownError) as raised:
        td.import_(campaign / "campaign.toml", out=out)
    assert str(raised.value) == errors(said.stderr)
    with pytest.raises(td.TouchdownError, match="a restitution of 2 cannot be had"):
        td.impact(mass=1, speed=1, stiffness=1e8, restitution=2)
