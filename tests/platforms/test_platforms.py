"""One FMU for every desk: what its libraries ask for, what they offer, and that all of them give the same bits."""

import hashlib
import json
import os
import pathlib
import re
import shutil
import subprocess
import zipfile

import fmpy
import pefile
import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
from elftools.elf.dynamic import DynamicSection
from elftools.elf.elffile import ELFFile
from elftools.elf.gnuversions import GNUVerNeedSection
from fmpy.validation import validate_fmu

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parents[1]
CI = os.environ.get("CI") == "true"
# the host's own arithmetic has to be the same everywhere too
FLAGS = ["-std=c11", "-O2", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror"]
# functions of FMI 2.0 for co-simulation: the hosts' table of them
FUNCTIONS = {f"fmi2{n}" for n in re.findall(r"^    F\([^,]+, (\w+),", (HERE / "loaded.h").read_text(), re.M)}


def absent(reason):
    """Skips; in CI, which installs everything, fails."""
    (pytest.fail if CI else pytest.skip)(reason)


@pytest.fixture(scope="session")
def touchdown():
    program = ROOT / "target/release/touchdown"
    assert program.exists(), "build it first: cargo build --release --workspace"
    return program


@pytest.fixture(scope="session")
def release(touchdown, tmp_path_factory):
    """The release folder, made once for all tests."""
    out = tmp_path_factory.mktemp("release")
    done = subprocess.run([ROOT / "fmu/platforms/release", out], env={**os.environ, "TOUCHDOWN": str(touchdown)},
                          capture_output=True, text=True)
    if done.returncode and "missing" in done.stderr:
        absent(done.stderr)
    assert done.returncode == 0, done.stderr
    return out


def unpacked(fmu, out):
    with zipfile.ZipFile(fmu) as z:
        z.extractall(out)
    return out


@pytest.fixture(scope="session")
def opened(release, tmp_path_factory):
    """The FMU of the release, unpacked."""
    return unpacked(release / "HysteresisContact.fmu", tmp_path_factory.mktemp("opened"))


class Model:
    """An FMU unpacked, with the host in C that drives it and how many steps that prints."""

    def __init__(self, name, folder, host):
        self.name, self.folder, self.host = name, folder, host

    def platform(self, platform, to):
        """Puts into a folder all that a host for that platform reads; the library's name there."""
        name = f"{self.name}.{'so' if platform == 'linux64' else 'dll'}"
        library = self.folder / "binaries" / platform / name
        if not library.exists():
            absent(f"{platform} is not in the FMU: fmu/platforms/build says why")
        shutil.copy(library, to)
        shutil.copy(self.folder / "modelDescription.xml", to)
        return name

    def compiled(self, compiler, out, *more):
        if shutil.which(compiler) is None:
            absent(f"{compiler} is not here")
        subprocess.run([compiler, *FLAGS, HERE / self.host, "-o", out, *more], check=True)

    def native(self, here, library):
        """What the host prints of a library of this machine."""
        self.compiled("gcc", here / "host", "-ldl", "-lpthread", "-lm")
        return subprocess.run(["./host", f"./{library}", "modelDescription.xml"], cwd=here, capture_output=True,
                              timeout=600)


def answers(done):
    """What the host has printed, where it went through all of it."""
    text = done.stdout.decode()
    assert done.returncode == 0, f"{text[-500:]}\n{done.stderr.decode()}"
    assert text.endswith("0 failures\n") and "FAILED" not in text
    # the drop of 20,000 steps, with at least eight doubles a step
    assert len(re.findall(r"^\d+( [0-9a-f]{16}){8}", text, re.M)) >= 20000
    return text


@pytest.fixture(scope="session")
def contact(opened, tmp_path_factory):
    """The element, and what its host prints of linux64."""
    model = Model("HysteresisContact", opened, "host.c")
    here = tmp_path_factory.mktemp("contact")
    return model, answers(model.native(here, model.platform("linux64", here)))


@pytest.fixture(scope="session")
def bar(release, touchdown, tmp_path_factory):
    """The moving bar, and what its host prints of linux64."""
    here = tmp_path_factory.mktemp("bar")
    subprocess.run([touchdown, "pack", "--model", "moving-bar", "--all-platforms", "--out", here / "bar.fmu"],
                   check=True)
    model = Model("MovingBar", unpacked(here / "bar.fmu", here / "opened"), "bar.c")
    return model, answers(model.native(here, model.platform("linux64", here)))


def same(ours, theirs, whose):
    """Line by line, so that a difference is named."""
    for i, (a, b) in enumerate(zip(ours.splitlines(), theirs.splitlines())):
        assert a == b, f"line {i + 1}: linux64 prints\n{a}\n{whose}\n{b}"
    assert ours == theirs


@pytest.mark.parametrize("platform, bits, compiler", [("win64", "64", "x86_64-w64-mingw32-gcc"),
                                                      ("win32", "32", "i686-w64-mingw32-gcc")])
@pytest.mark.parametrize("which", ["contact", "bar"])
def test_windows_gives_the_bits_of_linux64(which, request, tmp_path, platform, bits, compiler):
    model, linux64 = request.getfixturevalue(which)
    name = model.platform(platform, tmp_path)
    # win32: arithmetic in doubles, not in the 80 bits of the old floating point unit
    more = ["-msse2", "-mfpmath=sse"] if platform == "win32" else []
    model.compiled(compiler, tmp_path / "host.exe", *more)
    done = subprocess.run([HERE / "wine", bits, tmp_path, "./host.exe", name, "modelDescription.xml"],
                          stdin=subprocess.DEVNULL, capture_output=True, timeout=900)
    if done.returncode == 77:
        absent(done.stderr.decode())
    same(linux64, answers(done), platform)


@pytest.mark.parametrize("which", ["contact", "bar"])
def test_the_plain_build_gives_the_bits_of_the_release(which, request, touchdown, tmp_path):
    model, linux64 = request.getfixturevalue(which)
    named = {"contact": "contact", "bar": "moving-bar"}[which]
    subprocess.run([touchdown, "pack", "--model", named, "--out", tmp_path / "plain.fmu"], check=True)
    plain = Model(model.name, unpacked(tmp_path / "plain.fmu", tmp_path / "plain"), model.host)
    same(linux64, answers(plain.native(tmp_path, plain.platform("linux64", tmp_path))), "the plain build")


def test_a_host_that_finds_fault_says_so(contact, tmp_path):
    """The host's verdict is no decoration: a description with a reference that the library lacks fails it."""
    model, _ = contact
    name = model.platform("linux64", tmp_path)
    text = (tmp_path / "modelDescription.xml").read_text()
    wrong = re.sub(r'(name="stiffness" valueReference=")\d+', r"\g<1>9999", text)
    assert wrong != text
    (tmp_path / "modelDescription.xml").write_text(wrong)
    done = model.native(tmp_path, name)
    assert done.returncode == 1 and b"FAILED" in done.stderr


@pytest.mark.parametrize("which", ["contact", "bar"])
def test_linux64_asks_for_glibc_2_17_at_most_and_offers_fmi_only(which, request, tmp_path):
    model, _ = request.getfixturevalue(which)
    with open(tmp_path / model.platform("linux64", tmp_path), "rb") as f:
        elf = ELFFile(f)
        needed = {t.needed for s in elf.iter_sections() if isinstance(s, DynamicSection) for t in s.iter_tags()
                  if t.entry.d_tag == "DT_NEEDED"}
        assert needed <= {"libc.so.6", "libm.so.6", "libpthread.so.0", "libdl.so.2", "ld-linux-x86-64.so.2"}, needed
        versions = {a.name for s in elf.iter_sections() if isinstance(s, GNUVerNeedSection)
                    for _, auxiliary in s.iter_versions() for a in auxiliary}
        numbers = {tuple(map(int, v.removeprefix("GLIBC_").split("."))) for v in versions}
        assert numbers and max(numbers) <= (2, 17), versions
        offered = {s.name for s in elf.get_section_by_name(".dynsym").iter_symbols()
                   if s.name and s.entry.st_shndx != "SHN_UNDEF"}
    assert len(FUNCTIONS) == 34
    assert offered == FUNCTIONS


@pytest.mark.parametrize("platform, machine", [("win64", 0x8664), ("win32", 0x14C)])
@pytest.mark.parametrize("which", ["contact", "bar"])
def test_windows_asks_for_the_system_only_and_offers_fmi_only(which, request, tmp_path, platform, machine):
    model, _ = request.getfixturevalue(which)
    dll = pefile.PE(tmp_path / model.platform(platform, tmp_path))
    assert dll.FILE_HEADER.Machine == machine
    assert {e.dll.decode().lower() for e in dll.DIRECTORY_ENTRY_IMPORT} <= {"kernel32.dll", "msvcrt.dll"}
    assert not hasattr(dll, "DIRECTORY_ENTRY_DELAY_IMPORT")
    assert {s.name.decode() for s in dll.DIRECTORY_ENTRY_EXPORT.symbols} == FUNCTIONS
    assert dll.FILE_HEADER.TimeDateStamp == 0


def test_the_fmu_is_valid_and_lists_its_platforms(release):
    path = str(release / "HysteresisContact.fmu")
    assert validate_fmu(path) == []
    platforms = set(fmpy.supported_platforms(path))
    assert {"linux64", "win64"} <= platforms
    if CI:
        assert "win32" in platforms


def test_what_was_built_is_packed_from_then_on(release, touchdown, tmp_path):
    """Without a word of it, by the command beside the release's libraries and by that of the checkout that built them."""
    beside = shutil.copy(touchdown, tmp_path / "touchdown")
    shutil.copytree(release / "lib", tmp_path / "lib")
    wanted = set(fmpy.supported_platforms(str(release / "HysteresisContact.fmu")))
    for program in (beside, touchdown):
        subprocess.run([program, "pack", "--out", tmp_path / "x.fmu"], check=True)
        assert set(fmpy.supported_platforms(str(tmp_path / "x.fmu"))) == wanted


def test_no_path_of_this_machine_is_inside(opened):
    for library in opened.glob("binaries/*/*"):
        assert str(ROOT).encode() not in library.read_bytes(), library


def test_two_checkouts_at_different_paths_give_one_sum(release, touchdown, tmp_path):
    """Every file that git has, laid out elsewhere; tools of its own path too."""
    files = subprocess.run(["git", "ls-files", "-z", "-co", "--exclude-standard"], cwd=ROOT, check=True,
                           capture_output=True, text=True).stdout.split("\0")
    elsewhere = tmp_path / "a longer path" / "checkout"
    for f in filter(None, files):
        if (ROOT / f).is_file():
            (elsewhere / f).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(ROOT / f, elsewhere / f)
    (elsewhere / "target/release").mkdir(parents=True)
    shutil.copy(touchdown, elsewhere / "target/release/touchdown")
    built = ROOT / "target/platforms"
    zig = next(built.glob("venv/lib/python*/site-packages/ziglang"))
    shutil.copytree(zig, tmp_path / "zig elsewhere")
    if (built / "std32").exists():
        shutil.copytree(built / "std32", elsewhere / "target/platforms/std32")
    out = tmp_path / "release"
    env = {**os.environ, "TOUCHDOWN": str(elsewhere / "target/release/touchdown"),
           "TOUCHDOWN_ZIG": str(tmp_path / "zig elsewhere/zig")}
    done = subprocess.run([elsewhere / "fmu/platforms/release", out], env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert (elsewhere / "target/platforms/linux64/HysteresisContact.so").exists(), "built there, not here"
    assert (out / "SHA256SUMS").read_text() == (release / "SHA256SUMS").read_text()
    assert (out / "HysteresisContact.fmu").read_bytes() == (release / "HysteresisContact.fmu").read_bytes()


def test_the_release_carries_its_sums_and_a_valid_bill_of_materials(release):
    sums = dict(reversed(line.split("  ")) for line in (release / "SHA256SUMS").read_text().splitlines())
    libraries = {str(f.relative_to(release)) for f in release.glob("lib/platforms/*/*")}
    assert {f"lib/platforms/{p}/{m}.{e}" for p, e in [("linux64", "so"), ("win64", "dll")] for m in ["HysteresisContact", "MovingBar", "BodyForce"]} <= libraries
    assert set(sums) == {"HysteresisContact.fmu", "HysteresisContact.cdx.json"} | libraries
    for name, sum_ in sums.items():
        assert hashlib.sha256((release / name).read_bytes()).hexdigest() == sum_
    text = (release / "HysteresisContact.cdx.json").read_text()
    assert JsonStrictValidator(SchemaVersion.V1_5).validate_str(text) is None
    bill = json.loads(text)
    components = {c["bom-ref"]: c for c in bill["components"]}
    if CI:
        # the oldest compiler the libraries promise (rust-version in Cargo.toml) is the one that built them
        tools = {t["name"]: t["version"] for t in bill["metadata"]["tools"]["components"]}
        assert tools["rustc"].startswith("1.63.")
    with zipfile.ZipFile(release / "HysteresisContact.fmu") as z:
        libraries = [n for n in z.namelist() if n.startswith("binaries/")]
        for n in libraries:
            assert components[n]["hashes"][0]["content"] == hashlib.sha256(z.read(n)).hexdigest()
    refs = set(components) | {"fmu"}
    assert {d["ref"] for d in bill["dependencies"]} == refs
    assert all(set(d["dependsOn"]) <= refs for d in bill["dependencies"])
    # every crate that a library still names in its messages is in the bill
    crates = {c["name"].replace("-", "_") for c in bill["components"]}
    with zipfile.ZipFile(release / "HysteresisContact.fmu") as z:
        for n in libraries:
            named = {m.decode().replace("-", "_") for m in re.findall(rb"vendor/([a-z0-9_-]+)-\d", z.read(n))}
            assert named <= crates, f"{n}: {named - crates} not in the bill"


def test_without_the_tools_it_says_what_to_install(touchdown, tmp_path):
    tools = tmp_path / "bin"
    tools.mkdir()
    for f in pathlib.Path("/usr/bin").iterdir():
        if "mingw" not in f.name:
            (tools / f.name).symlink_to(f)
    out = tmp_path / "x.fmu"
    env = {**os.environ, "PATH": str(tools), "TOUCHDOWN_RUSTC": str(tmp_path / "no rustc")}
    done = subprocess.run([touchdown, "pack", "--all-platforms", "--out", out], env=env, capture_output=True, text=True)
    assert done.returncode == 2
    for package in ("rustc", "libstd-rust-dev-windows", "gcc-mingw-w64-x86-64-posix"):
        assert re.search(f"apt-get install .*{package}", done.stderr), done.stderr
    assert not out.exists()


def test_without_wine_it_skips_and_says_why_but_not_in_ci(tmp_path, monkeypatch):
    env = {**os.environ, "TOUCHDOWN_WINE": str(tmp_path / "no wine")}
    done = subprocess.run([HERE / "wine", "64", tmp_path, "host.exe"], env=env, capture_output=True, text=True)
    assert done.returncode == 77 and "apt-get install wine64" in done.stderr
    for ci, outcome in [(False, pytest.skip.Exception), (True, pytest.fail.Exception)]:
        monkeypatch.setitem(globals(), "CI", ci)
        with pytest.raises(outcome, match="wine64"):
            absent(done.stderr)
