"""Results as objects: values, tables, pictures."""

from __future__ import annotations

import json
import os
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest
import touchdown_impact as td

from conftest import EXAMPLES


def test_a_diagnosis_says_what_is_missing(found: td.Diagnosis) -> None:
    assert found.judged and found.detected and found.reason is None
    [missing] = found.missing
    assert missing.mechanism == "plastic_indentation" and missing.probability > 0.9
    depth = found.parameters["plastic_indentation.yield_penetration"]
    assert depth.low is not None and depth.high is not None and depth.low < depth.value < depth.high
    assert depth.unit == "m" and float(depth) == depth.value
    assert found.posterior[0].mechanisms == ("plastic_indentation",) == found.credible_set[0]
    assert abs(sum(c.probability for c in found.posterior) - 1.0) < 1e-6
    assert found.sentence and found.sentence in found.report().read_text(encoding="utf-8")


def test_the_same_table_in_every_library(found: td.Diagnosis) -> None:
    arrow, frame, other = found.to_frame("arrow"), found.to_frame(), found.to_frame("polars")
    assert isinstance(frame, pd.DataFrame) and list(frame.columns) == arrow.column_names == other.columns
    assert frame.to_dict("records") == arrow.to_pylist() == other.to_dicts()
    assert frame["parameter"].tolist() == ["yield_penetration"]
    with pytest.raises(ValueError, match="give pandas, polars or arrow"):
        found.to_frame("excel")  # type: ignore[call-overload]


def test_predictions_are_there_for_every_recording(found: td.Diagnosis, campaign: Path) -> None:
    rows = found.predictions()
    assert set(rows["simulation"]) == {"before", "after"}
    assert set(rows["file"]) == {p.name for p in campaign.glob("*.csv")}
    recorded = pd.read_csv(campaign / "r05.csv")
    after = rows[(rows["file"] == "r05.csv") & (rows["simulation"] == "after")]
    assert len(after) == len(recorded)
    peak = recorded["force [N]"].max()
    assert abs(after["force [N]"].max() - peak) < 0.05 * peak


def test_pictures_show_what_was_recorded_and_simulated(found: td.Diagnosis, campaign: Path, tmp_path: Path) -> None:
    figure = found.plot("r03.csv")
    lines = {line.get_label(): line for line in figure.axes[0].get_lines()}
    assert set(lines) == {"recorded", "before", "after"}
    recorded = pd.read_csv(campaign / "r03.csv")
    assert np.array_equal(np.asarray(lines["recorded"].get_ydata(), float), recorded["force [N]"].to_numpy())
    with pytest.raises(ValueError, match=r"r99.csv is no recording; give one of r01.csv"):
        found.plot("r99.csv")
    made = {
        "diagnosis": figure,
        "campaign": td.Campaign(campaign).plot(),
        "fit": td.fit(campaign).plot(),
        "run": td.run(EXAMPLES / "drop_test.toml").plot(),
    }
    for name, picture in made.items():
        picture.savefig(tmp_path / f"{name}.png")
        assert (tmp_path / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_notebooks_get_html(found: td.Diagnosis, campaign: Path) -> None:
    html = found._repr_html_()
    assert "plastic_indentation" in html and "yield_penetration" in html and html.count("<table>") == 2
    assert "r10.csv" in td.Campaign(campaign)._repr_html_()


def test_an_answer_is_opened_again(found: td.Diagnosis, tmp_path: Path) -> None:
    again = td.Diagnosis(found.folder)
    assert again.verdict == found.verdict and str(again) == found.sentence
    assert found.report(tmp_path / "page.html").read_bytes() == (found.folder / "report.html").read_bytes()


def test_the_fmu_of_a_diagnosis_runs(found: td.Diagnosis, tmp_path: Path) -> None:
    fmu = found.fmu(tmp_path / "Found.fmu")
    scenario = tmp_path / "drop.toml"
    scenario.write_text(
        f'kind = "drop_test"\nmass = 0.32622\ndrop_heights = [0.02]\ngravity = true\n\n[contact]\nfmu = "{fmu.name}"\n',
        encoding="utf-8",
    )
    ran = td.run(scenario)
    recorded = td.Campaign(EXAMPLES / "bench_drop").recordings
    peak = max(r.force.max() for r in recorded if r.force is not None and r.height == 0.02)
    assert abs(ran.impacts[0]["peak_force"] / peak - 1.0) < 0.1


def test_a_campaign_tells_what_it_holds(campaign: Path) -> None:
    c = td.Campaign(campaign)
    assert (c.name, c.kind, c.mass, c.warnings) == ("bench_drop", "drop-test", 0.32622, [])
    assert c.parameters == {"k": 2.56526e08, "p": 1.42271, "mu_d": 8.00305e07}
    first = c.recordings[0]
    assert first.file == "r01.csv" and first.speed == (0.314937, 0.00126) and first.height == 0.005
    assert first.force is not None and len(first.force) == len(first.time) and (np.diff(first.time) > 0).all()


def test_tables_that_cannot_be_taken_are_reported() -> None:
    course = pa.table({"time": [0.0, 1.0], "force": [0.0, 1.0]})
    with pytest.raises(ValueError, match="impact_speed: 2 values for 1 recordings"):
        td.Campaign.of(course, speed=[1.0, 2.0])
    with pytest.raises(TypeError, match=r"r01.csv is a int; give a table"):
        td.Campaign.of([3])  # type: ignore[list-item]
    with pytest.raises(td.TouchdownError, match=r"r01.csv"):
        td.diagnose(course, mass=1.0, speed=1.0)
    with pytest.raises(TypeError, match="leave them out"):
        td.diagnose(EXAMPLES / "bench_drop", mass=1.0)


def test_names_lead_into_no_other_folder_and_links_are_not_written_through(tmp_path: Path) -> None:
    course = pa.table({"time": [0.0, 1.0], "force": [0.0, 1.0]})
    for name in ["../x", "/x", "a/b", "a\\b"]:
        with pytest.raises(ValueError, match="is no name of a file"):
            td.Campaign.of({name: course}, folder=tmp_path / "c")
        made = td.Campaign.of(course, name=name)
        assert made.folder.parent == Path(made._temporary.name)  # type: ignore[union-attr]
    precious = tmp_path / "precious"
    precious.write_text("mine")
    (tmp_path / "c").mkdir(exist_ok=True)
    for name in ["campaign.toml", "r01.csv"]:
        (tmp_path / "c" / name).unlink(missing_ok=True)
        (tmp_path / "c" / name).symlink_to(precious)
        with pytest.raises(FileExistsError, match="is in the way"):
            td.Campaign.of(course, folder=tmp_path / "c")
    assert precious.read_text() == "mine"
    assert sorted(f.name for f in (tmp_path / "c").iterdir()) == ["campaign.toml", "r01.csv"]


def test_files_of_the_users_own_stay_and_those_made_before_are_replaced(tmp_path: Path) -> None:
    def course(top: float) -> pa.Table:
        return pa.table({"time": [0.0, 1.0], "force": [0.0, top]})

    for name in ["r01.csv", "campaign.toml"]:
        folder = tmp_path / name
        folder.mkdir()
        (folder / name).write_text("mine")
        with pytest.raises(FileExistsError, match=f"{name} is in the way, and is not as Campaign.of wrote it; give"):
            td.Campaign.of(course(1.0), folder=folder)
        assert [(f.name, f.read_text()) for f in folder.iterdir()] == [(name, "mine")]
    for top in [1.0, 2.0]:
        made = td.Campaign.of(course(top), folder=tmp_path / "again")
        assert f"1,{top:g}" in (made.folder / "r01.csv").read_text()
    for name in ["campaign.toml", "r01.csv"]:
        with open(tmp_path / "again" / name, "a") as f:
            f.write("# mine\n")
        with pytest.raises(FileExistsError, match=f"{name} is in the way"):
            td.Campaign.of(course(3.0), folder=tmp_path / "again")
        assert (tmp_path / "again" / name).read_text().endswith("# mine\n")
    made = td.Campaign.of(course(1.0), folder=tmp_path / "more")
    (made.folder / "r02.csv").write_text("mine")
    with pytest.raises(FileExistsError, match="r02.csv is in the way"):
        td.Campaign.of([course(1.0)] * 2, folder=tmp_path / "more")
    assert (made.folder / "r02.csv").read_text() == "mine"
    with pytest.raises(ValueError, match="two recordings would be called a.csv"):
        td.Campaign.of({"a": course(1.0), "a.csv": course(2.0)}, folder=tmp_path / "none")
    with pytest.raises(ValueError, match="moving_mass is nan"):
        td.Campaign.of(course(1.0), mass=float("nan"), folder=tmp_path / "none")
    assert not (tmp_path / "none").exists()


def test_arrays_of_every_kind_are_taken_or_refused_and_stay_as_they_are() -> None:
    time, force = np.arange(4.0), np.array([0.0, 2.0, 1.0, 0.0])
    plain = td.Campaign.of(pa.table({"time": time, "force": force}), mass=0.5, speed=1.0)
    wanted = (plain.folder / "r01.csv").read_bytes()
    fixed = force.copy()
    fixed.flags.writeable = False
    strided = np.repeat(force, 2)[::2]
    objects = force.astype(object)
    for column in [fixed, strided, objects, force.astype(np.float32), force.astype(">f8").astype(float)]:
        table = pd.DataFrame({"time": time, "force": column})
        made = td.Campaign.of(table, mass=0.5, speed=np.array(1.0, dtype=object))  # type: ignore[arg-type]
        assert (made.folder / "r01.csv").read_bytes() == wanted
    assert not fixed.flags.writeable and (fixed == force).all() and objects.dtype == object
    for mixed in [[0.0, "two", 1.0, None], [0.0, {}, 1.0, 2.0]]:
        with pytest.raises((TypeError, ValueError, pa.ArrowInvalid, td.TouchdownError)):
            td.diagnose(pd.DataFrame({"time": time, "force": mixed}), mass=0.5, speed=1.0)
    for wrong in ["1 m/s", [None], {}, [[1.0, 2.0]]]:
        with pytest.raises((TypeError, ValueError), match="speed"):
            td.Campaign.of(pa.table({"time": time, "force": force}), speed=wrong)  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="moving_mass is {}; give a number"):
        td.Campaign.of(pa.table({"time": time, "force": force}), mass={})  # type: ignore[arg-type]


def test_numbers_of_numpy_are_numbers_and_those_that_are_none_are_refused() -> None:
    course = pa.table({"time": np.arange(3.0), "force": np.zeros(3)})
    made = td.Campaign.of(course, mass=np.float32(0.5), travel=np.int64(2), speed=np.array([1.0]))  # type: ignore[arg-type]
    assert "moving_mass = 0.5\ntravel = 2\n" in (made.folder / "campaign.toml").read_text()
    for wrong in [float("nan"), float("inf"), np.float32("nan")]:
        with pytest.raises(ValueError, match="moving_mass is (nan|inf); give a finite number"):
            td.Campaign.of(course, mass=wrong)  # type: ignore[arg-type]


def test_what_is_to_be_known_is_a_warning(campaign: Path) -> None:
    recordings = {r.file: pd.read_csv(campaign / r.file) for r in td.Campaign(campaign).recordings[:2]}
    # a clock that stood still for a row
    clock = recordings["r01.csv"]["time [s]"]
    recordings["r01.csv"]["time [s]"] = clock.where(clock.index != 7, clock.shift())
    made = td.Campaign.of(recordings, mass=0.32622, speed=0.315)
    noted = made.warnings
    assert noted and noted[0].startswith("r01.csv: ")
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        td.fit(made, seconds=60)
    ours = [w for w in said if issubclass(w.category, td.TouchdownWarning)]
    assert [str(w.message) for w in ours] == [f"{made.folder}: {t}" for t in noted]
    assert ours[0].filename == __file__


def test_an_answer_that_leads_out_of_its_folder_or_is_none_is_refused(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("mine")
    answer = tmp_path / "answer"
    answer.mkdir()
    of = {"format": "verdict/1", "element": {"fmu": "../secret"}, "invalid": {"text": "too short"}}
    verdict = answer / "verdict.json"
    for text in ["{}", "[]", "[" * 100_000, "{", '{"format": "verdict/2"}']:
        verdict.write_text(text)
        with pytest.raises(td.TouchdownError, match=r"verdict.json: "):
            td.Diagnosis(answer)
    verdict.write_text(json.dumps(of))
    found = td.Diagnosis(answer)
    with pytest.raises((td.TouchdownError, OSError), match="secret"):
        found.fmu(tmp_path / "out.fmu")
    assert not (tmp_path / "out.fmu").exists()
    verdict.unlink()
    os.mkfifo(verdict)
    with pytest.raises(td.TouchdownError, match="a pipe"):
        td.Diagnosis(answer)


def test_a_report_replaces_no_file_of_the_users_and_no_link(tmp_path: Path) -> None:
    answer = tmp_path / "answer"
    answer.mkdir()
    (answer / "verdict.json").write_text(json.dumps({"format": "verdict/1", "invalid": {"text": "too short"}}))
    (answer / "report.html").write_text('<p class="lead">It is so.</p>')
    found = td.Diagnosis(answer)
    mine, link = tmp_path / "mine.html", tmp_path / "link.html"
    mine.write_text("mine")
    link.symlink_to(mine)
    for place in [link, mine]:
        with pytest.warns(UserWarning, match="kept"):
            assert found.report(place) == place
        assert "It is so." in place.read_text() and not place.is_symlink()
    assert (tmp_path / "mine.kept.html").read_text() == "mine"
    # one that touchdown has written goes
    found.report(mine)
    assert sorted(f.name for f in tmp_path.glob("mine*")) == ["mine.html", "mine.kept.html"]


def test_dicts_of_arrays_are_tables(tmp_path: Path) -> None:
    time, force = np.arange(20) * 1e-3, np.sin(np.arange(20.0))
    one = pa.table({"time": time, "force": force})
    frozen = force.copy()
    frozen.setflags(write=False)
    kinds: list[dict[str, object]] = [
        {"time": time, "force": force},
        {"time": time.tolist(), "force": tuple(force)},
        {"time": time.astype(object), "force": frozen},
        {"time": np.repeat(time, 2)[::2], "force": force.astype(">f8")},
        {"time": pd.Series(time), "force": pa.array(force)},
    ]
    wanted = (td.Campaign.of(one, mass=1.0, height=0.01, folder=tmp_path / "one").folder / "r01.csv").read_bytes()
    for i, given in enumerate(kinds):
        for frames in (given, [given], {"r01": given}):
            made = td.Campaign.of(frames, mass=1.0, height=0.01, folder=tmp_path / str(i))
            assert (made.folder / "r01.csv").read_bytes() == wanted
    with pytest.raises(ValueError, match=r"r01.csv: columns of different lengths: 'time' 20, 'force' 19; give as many"):
        td.Campaign.of({"time": time, "force": force[1:]}, mass=1.0)
    with pytest.raises(TypeError, match=r"r01.csv: column 'force' holds what is no number"):
        td.Campaign.of({"time": time, "force": np.array(["x"] * 20, dtype=object)}, mass=1.0)
    with pytest.raises(ValueError, match=r"r01.csv: column 'force' has 2 dimensions"):
        td.Campaign.of({"time": time, "force": force.reshape(-1, 1)}, mass=1.0)
    with pytest.raises(TypeError, match="mass, speed and height of a campaign stand in"):
        td.diagnose(EXAMPLES / "bench_drop", height=0.01)
