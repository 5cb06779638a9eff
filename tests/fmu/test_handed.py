"""How the element describes itself to a simulator, and the FMU that a diagnosis hands back."""

import datetime
import json
import os
import pathlib
import re
import shutil
import subprocess
import zipfile

import fmpy
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from .element import Element

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "harness/examples"
SYSTEM = EXAMPLES / "contactor_system.toml"
CHOICES = {
    "plastic_form": ["permanent_set", "walton_braun", "thornton"],
    "plastic_damping_form": ["depth", "branch"],
    "adhesion_form": ["contact", "neck", "reach", "leaving", "growing"],
    "learned_form": ["not", "speed", "direction", "speed_squared"],
}


def pack(touchdown, out, *more):
    return subprocess.run([touchdown, "pack", "--out", str(out), *more], capture_output=True, text=True)


def variables(path):
    return {v.name: v for v in fmpy.read_model_description(str(path), validate=True).modelVariables}


def test_choices_are_lists_that_a_simulator_can_show(fmu):
    seen = {v.name: v for v in variables(fmu).values() if v.type == "Enumeration"}
    assert {n: [i.name for i in v.declaredType.items] for n, v in seen.items()} == CHOICES
    assert all([int(i.value) for i in v.declaredType.items] == list(range(len(CHOICES[n]))) for n, v in seen.items())
    assert all(i.description for v in seen.values() for i in v.declaredType.items)
    assert not [v.name for v in variables(fmu).values() if v.type == "Integer"], "a coded number is left"
    with Element(fmu, initialize=False) as e:
        e.set("adhesion_form", 4)
        assert e.fmu.getInteger([e.vr["adhesion_form"]]) == [4]


def test_a_choice_is_packed_by_name_or_number(touchdown, tmp_path):
    by = {value: tmp_path / f"{value}.fmu" for value in ("walton_braun", "1")}
    for value, path in by.items():
        assert pack(touchdown, path, "--set", f"plastic_form={value}").returncode == 0
        assert variables(path)["plastic_form"].start == "1"
    assert by["1"].read_bytes() == by["walton_braun"].read_bytes()
    for wrong, said in [("plastic_form=walton_brown", 'did you mean "walton_braun"?'), ("plastic_from=1", 'did you mean "plastic_form"?'), ("plastic_form=7", "permanent_set (0), walton_braun (1) or thornton (2)")]:
        o = pack(touchdown, tmp_path / "no.fmu", "--set", wrong)
        assert o.returncode == 2 and said in o.stderr, o.stderr


@pytest.mark.parametrize("kind", ["scenario", "fmu", "system"])
def test_a_choice_stands_in_files_by_name_or_number(touchdown, fmu, tmp_path, kind):
    def result(value):
        folder = tmp_path / value.strip('"')
        folder.mkdir()
        text = SYSTEM.read_text()
        if kind == "system":
            text = text.replace("stiffness =", f"adhesion_force = 5.0\nadhesion_form = {value}\nstiffness =")
        else:
            law = "stiffness = 2e8\nexponent = 1.5\nadhesion_force = 30.0\nadhesion_range = 1e-4\n"
            own = f"adhesion_form = {value}\n" if kind == "scenario" else f"fmu = {json.dumps(fmu)}\nparameters = {{ adhesion_form = {value} }}\n"
            text = f'kind = "drop_test"\nmass = 0.5\ndrop_height = 0.01\ngravity = true\n[contact]\n{law}{own}'
        (folder / "file.toml").write_text(text)
        o = subprocess.run([touchdown, "run", str(folder / "file.toml"), "--out", str(folder / "out")], capture_output=True, text=True)
        return o, b"".join(p.read_bytes() for p in sorted(folder.glob("out/*.csv")))

    (named, a), (number, b), (other, c) = result('"neck"'), result("1"), result('"contact"')
    assert named.returncode == number.returncode == other.returncode == 0, named.stderr + number.stderr
    assert a == b and a and a != c
    o, _ = result('"nek"')
    assert o.returncode == 2 and 'adhesion_form "nek" is not known; did you mean "neck"?' in o.stderr, o.stderr


@pytest.mark.parametrize("model", ["contact", "moving-bar", "body-force"])
def test_every_real_has_a_nominal_value_and_parameters_are_listed_by_group(touchdown, tmp_path, model):
    path = tmp_path / "x.fmu"
    assert pack(touchdown, path, "--model", model).returncode == 0
    assert validate_fmu(str(path)) == []
    assert all(float(v.nominal) > 0 for v in variables(path).values() if v.type == "Real")
    with zipfile.ZipFile(path) as z:
        text = z.read("modelDescription.xml").decode()
    groups = [g.split() for g in re.findall(r'<Group name="\w+" variables="([^"]+)"', text)]
    order = list(variables(path))
    assert len(groups) >= 2 and len(sum(groups, [])) == len(set(sum(groups, [])))
    if model == "contact":
        # a list in the file's order shows every mechanism's parameters together
        assert all(order[order.index(g[0]):][:len(g)] == g for g in groups)


def test_a_start_value_is_its_nominal_value(touchdown, tmp_path):
    assert pack(touchdown, tmp_path / "x.fmu", "--set", "stiffness=3e9", "--set", "adhesion_force=12").returncode == 0
    v = variables(tmp_path / "x.fmu")
    assert (float(v["stiffness"].nominal), float(v["adhesion_force"].nominal), float(v["contact_preload"].nominal)) == (3e9, 12, 1e3)


def test_the_stock_fmu_has_a_date_only_where_one_is_set(touchdown, fmu, tmp_path):
    assert fmpy.read_model_description(fmu).generationDateAndTime is None
    def run(epoch):
        return subprocess.run([touchdown, "pack", "--out", str(tmp_path / "x.fmu")], env={**os.environ, "SOURCE_DATE_EPOCH": epoch}, capture_output=True, text=True)
    assert run("86400").returncode == 0
    assert fmpy.read_model_description(str(tmp_path / "x.fmu"), validate=True).generationDateAndTime == "1970-01-02T00:00:00Z"
    o = run("yesterday")
    assert o.returncode == 2 and "SOURCE_DATE_EPOCH" in o.stderr


def diagnose(touchdown, out, *more, **env):
    o = subprocess.run([touchdown, "diagnose", str(EXAMPLES / "bench_drop"), "--out", str(out), *more], capture_output=True, text=True, env={**os.environ, **env})
    assert o.returncode == 0, o.stderr
    return out / "bench_drop", o.stdout


@pytest.fixture(scope="module")
def libraries(fmu, tmp_path_factory):
    """Libraries that lie ready, as an unpacked FMU has them; that for Windows is none, but it has the start values."""
    folder = tmp_path_factory.mktemp("unpacked")
    with zipfile.ZipFile(fmu) as z:
        z.extract("binaries/linux64/HysteresisContact.so", folder)
    (folder / "binaries/win64").mkdir()
    shutil.copy(folder / "binaries/linux64/HysteresisContact.so", folder / "binaries/win64/HysteresisContact.dll")
    return folder / "binaries"


@pytest.fixture(scope="module")
def handed(touchdown, libraries, tmp_path_factory):
    """Folder of the answer, and what was printed."""
    return diagnose(touchdown, tmp_path_factory.mktemp("answer"), "--platforms", str(libraries))


def test_the_fmu_handed_back_names_its_campaign_and_what_was_found(handed):
    path, verdict = handed[0] / "HysteresisContact.fmu", json.loads((handed[0] / "verdict.json").read_text())
    assert validate_fmu(str(path)) == []
    d = fmpy.read_model_description(str(path), validate=True)
    assert d.modelName == "HysteresisContact_bench_drop" and d.coSimulation.modelIdentifier == "HysteresisContact"
    assert "plastic indentation" in d.description and "yield penetration" in d.description and "(95 %: " in d.description and d.description.isascii()
    assert re.match(r"touchdown \d+\.\d+\.\d+$", d.generationTool) and d.version and d.author
    newest = max(int(f.stat().st_mtime) for f in (EXAMPLES / "bench_drop").iterdir())
    assert d.generationDateAndTime == datetime.datetime.fromtimestamp(newest, datetime.UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    v = variables(path)
    found = verdict["missing"][0]["parameters"]["yield_penetration"]
    assert float(v["yield_penetration"].start) == float(v["yield_penetration"].nominal) == pytest.approx(found["value"], rel=1e-12)
    # typical sizes are the campaign's, not the stock element's
    assert 1e-5 < float(v["penetration"].nominal) != 1e-3 and float(v["force"].nominal) != 1e3
    with Element(str(path)) as e:
        assert e.force(float(v["penetration"].nominal), 0.0) > 0


def test_its_documentation_shows_what_was_calibrated_and_needs_no_script(handed):
    verdict = json.loads((handed[0] / "verdict.json").read_text())
    with zipfile.ZipFile(handed[0] / "HysteresisContact.fmu") as z:
        page = z.read("documentation/index.html").decode()
        other = z.read("documentation/cosimulation.html").decode()
    assert "bench" in page and verdict["missing"][0]["sentence"][1:] in page and "95 % interval" in page
    assert page.count('<svg class="chart"') == 1 and "m/s: restitution 0." in page
    # what was found stands first, then the list of sections, the loop, and what holds of every element
    at = [page.index(x) for x in ('class="lead"', 'class="contents"', "Start values</h2>", '<svg class="chart"', "HysteresisContact</h2>", "Equations</h2>")]
    assert at == sorted(at)
    starts = verdict["element"]["starts"]
    for name in ("stiffness", "yield_penetration"):
        row = re.search(rf"<td><code>{name}</code></td><td>parameter</td><td>[^<]*</td><td>([^<]+)</td>", page)
        assert float(row[1]) == starts[name]["value"]
    # the table of start values has an interval for what was fitted, the simulation's own parameters too
    for name in ("stiffness", "exponent", "yield_penetration"):
        assert re.search(rf"<tr><td>{name}</td><td[^>]*>[^<]+</td><td[^>]*>[^<]+ to [^<]+</td></tr>", page), name
    for p in (page, other):
        assert "@media print" in p and "prefers-color-scheme: dark" in p
        assert "<script" not in p and "src=" not in p and "http" not in p.replace("http://www.w3.org/2000/svg", "")


def test_the_same_campaign_gives_the_same_bytes_and_a_date_that_is_set(touchdown, handed, libraries, tmp_path):
    newest = max(int(f.stat().st_mtime) for f in (EXAMPLES / "bench_drop").iterdir())
    again, _ = diagnose(touchdown, tmp_path, "--platforms", str(libraries), SOURCE_DATE_EPOCH=str(newest))
    assert (again / "HysteresisContact.fmu").read_bytes() == (handed[0] / "HysteresisContact.fmu").read_bytes()


def test_libraries_that_lie_ready_are_in_it_and_the_answer_says_so(touchdown, handed, libraries, tmp_path):
    assert set(fmpy.supported_platforms(str(handed[0] / "HysteresisContact.fmu"))) == {"linux64", "win64"}
    assert json.loads((handed[0] / "verdict.json").read_text())["element"]["platforms"] == ["linux64", "win64"]
    assert "it runs on linux64, win64" in handed[1]
    o = pack(touchdown, tmp_path / "x.fmu", "--platforms", str(libraries))
    assert o.stdout.strip().endswith(": linux64, win64")
    o = pack(touchdown, tmp_path / "y.fmu", "--platforms", str(tmp_path))
    assert o.returncode == 2 and str(tmp_path) in o.stderr and "unpacked FMU" in o.stderr, o.stderr


def test_libraries_beside_the_command_are_found(touchdown, libraries, tmp_path):
    program = shutil.copy(touchdown, tmp_path / "touchdown")
    shutil.copytree(libraries, tmp_path / "lib/platforms")
    assert pack(program, tmp_path / "x.fmu").stdout.strip().endswith(": linux64, win64")
    # those that pack --all-platforms left from an older source are not
    (tmp_path / "lib").rename(tmp_path / "old")
    shutil.copytree(libraries, tmp_path / "platforms")
    own = shutil.copy(libraries / "linux64/HysteresisContact.so", tmp_path / "libhysteresis_contact.so")
    for age, platforms in [(-100, "linux64, win64"), (100, "linux64")]:
        os.utime(own, (now := os.stat(tmp_path / "platforms/win64/HysteresisContact.dll").st_mtime + age, now))
        assert pack(program, tmp_path / "x.fmu").stdout.strip().endswith(f": {platforms}"), age


def test_a_choice_by_name_goes_through_an_ssp_archive(touchdown, fmu, tmp_path):
    """Of an FMU that is not packed on the fly: its parameters stand in the archive's description."""
    text = SYSTEM.read_text().replace("stiffness =", 'adhesion_force = 5.0\nadhesion_form = "reach"\nstiffness =')
    (tmp_path / "system.toml").write_text(text.replace('"touchdown:contact"', json.dumps(fmu)))
    archive = tmp_path / "system.ssp"
    subprocess.run([touchdown, "export-ssp", str(tmp_path / "system.toml"), "--out", str(archive)], check=True)
    with zipfile.ZipFile(archive) as z:
        assert '<ssv:Enumeration value="reach"/>' in z.read("SystemStructure.ssd").decode()
    o = subprocess.run([touchdown, "run", str(archive), "--out", str(tmp_path / "out")], capture_output=True, text=True)
    assert o.returncode == 0 and list(tmp_path.glob("out/*.csv")), o.stderr
    with zipfile.ZipFile(archive) as z:
        z.extractall(tmp_path / "wrong")
    ssd = tmp_path / "wrong/SystemStructure.ssd"
    ssd.write_text(ssd.read_text().replace('value="reach"', 'value="reech"'))
    shutil.make_archive(str(tmp_path / "wrong"), "zip", tmp_path / "wrong")
    (tmp_path / "wrong.zip").rename(tmp_path / "wrong.ssp")
    o = subprocess.run([touchdown, "run", str(tmp_path / "wrong.ssp"), "--out", str(tmp_path / "no")], capture_output=True, text=True)
    assert o.returncode == 2 and 'did you mean "reach"?' in o.stderr, o.stderr


@pytest.mark.parametrize("what", ["contactor", "transformed", "alone"])
def test_an_exported_archive_keeps_to_the_schema_of_ssp(touchdown, fmu, tmp_path, what):
    """By the schema of SSP 1.0 that fmpy brings."""
    text = SYSTEM.read_text().replace('"touchdown:contact"', json.dumps(fmu))
    if what == "transformed":
        text = text.replace('to = "bar.force"', 'to = "bar.force"\nfactor = 0.5\noffset = 1.0\nsuppress_unit_conversion = true')
    if what == "alone":
        text = f'[[fmu]]\nname = "a & b"\nfile = {json.dumps(fmu)}\n[master]\nstop = 0.1\nstep = 0.01\n'
    (tmp_path / "system.toml").write_text(text)
    archive = tmp_path / "system.ssp"
    o = subprocess.run([touchdown, "export-ssp", str(tmp_path / "system.toml"), "--out", str(archive)], capture_output=True, text=True)
    assert o.returncode == 0 and ("not every host applies" in o.stderr) == (what == "transformed"), o.stderr
    schema = pathlib.Path(fmpy.__file__).parent / "ssp/schema/SystemStructureDescription.xsd"
    with zipfile.ZipFile(archive) as z:
        etree.XMLSchema(etree.parse(str(schema))).assertValid(etree.fromstring(z.read("SystemStructure.ssd")))
