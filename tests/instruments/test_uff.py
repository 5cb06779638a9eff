"""Universal files as pyuff writes them, read back; binary forms that pyuff does not write are made of its own by hand."""
import struct

import numpy as np
import pytest
import pyuff

RNG = np.random.default_rng(5)
N = 50


def dataset(**more):
    x = 0.25 + np.arange(N) / 1024
    of = dict(type=58, binary=0, func_type=1, rsp_node=12, rsp_dir=3, ref_node=0, ref_dir=0, id1="Force", id3="01-MAY-24 12:00:00", x=x, data=RNG.normal(size=N) * 1e3, abscissa_spacing=1, abscissa_spec_data_type=17, ordinate_spec_data_type=13, orddenom_spec_data_type=0, z_axis_spec_data_type=0, abscissa_axis_lab="Time", abscissa_axis_units_lab="s", ordinate_axis_lab="Force", ordinate_axis_units_lab="kN")
    return of | more


def write(path, sets, force_double=True):
    uff = pyuff.UFF(str(path))
    for i, of in enumerate(sets):
        uff.write_sets(of, mode="overwrite" if i == 0 else "add", force_double=force_double)
    return path


def by_pyuff(path, index=0):
    return pyuff.UFF(str(path)).read_sets(index)


@pytest.mark.parametrize("binary", [0, 1])
@pytest.mark.parametrize("spacing", [0, 1])
def test_double(dump, tmp_path, binary, spacing):
    wrote = dataset(binary=binary, abscissa_spacing=spacing)
    path = write(tmp_path / "f.uff", [wrote])
    (group,) = dump(path)["groups"]
    # pyuff does not find the datasets of its own binary files, which hold the values as they are
    reference = wrote | dict(abscissa_min=0.25, abscissa_inc=float(f"{1 / 1024:.5e}")) if binary else by_pyuff(path)
    np.testing.assert_array_equal(group["samples"][-1], reference["data"])
    np.testing.assert_allclose(group["samples"][-1], wrote["data"], rtol=1e-11)
    assert group["channels"][-1] == {"name": "Force", "unit": "kN"}
    assert ["ID line 3", "01-MAY-24 12:00:00"] in group["properties"]
    if spacing:
        assert group["clock"] == {"start": reference["abscissa_min"], "step": reference["abscissa_inc"]}
    else:
        assert group["clock"] is None and group["channels"][0] == {"name": "Time", "unit": "s"}
        np.testing.assert_array_equal(group["samples"][0], reference["x"])


@pytest.mark.parametrize("spacing", [0, 1])
def test_single_ascii(dump, tmp_path, spacing):
    wrote = dataset(abscissa_spacing=spacing, ord_data_type=2)
    path = write(tmp_path / "f.unv", [wrote], force_double=False)
    (group,) = dump(path)["groups"]
    np.testing.assert_array_equal(group["samples"][-1], by_pyuff(path)["data"])


def binary_set(order, data_type, even, n=N, said=None, x_form="f"):
    """A dataset 58b in a byte order, with the abscissa in a precision."""
    end = {1: "<", 2: ">"}[order]
    form = {2: "f", 4: "d"}[data_type]
    y, x = RNG.normal(size=n).astype(form), np.sort(RNG.random(n)).astype(x_form)
    body = struct.pack(f"{end}{n}{form}", *y) if even else b"".join(struct.pack(f"{end}{x_form}{form}", a, b) for a, b in zip(x, y))
    lines = [f"{-1:6}", f"{58:6}b{order:6}{2:6}{11:12}{len(body) if said is None else said:12}{0:6}{0:6}{0:12}{0:12}", "Gap", *["NONE"] * 4, f"{1:5}{1:10}{1:5}{0:10} {'NONE':10}{3:10}{-2:4} {'NONE':10}{0:10}{0:4}", f"{data_type:10}{n:10}{int(even):10}{0.0:13.5e}{1e-4 if even else 0.0:13.5e}{0.0:13.5e}"]
    lines += [f"{code:10}{0:5}{0:5}{0:5} {'NONE':20} {'NONE':20}" for code in (17, 8, 0, 0)]
    return "".join(f"{line:80}\n" if i > 1 else f"{line}\n" for i, line in enumerate(lines)).encode() + body + b"\n    -1\n", x, y


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("data_type", [2, 4])
@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("said", [None, 7])
def test_binary_in_both_byte_orders(dump, tmp_path, order, data_type, even, said):
    content, x, y = binary_set(order, data_type, even, said=said)
    (tmp_path / "f.uff").write_bytes(content + content)
    groups = dump(tmp_path / "f.uff")["groups"]
    for group in groups:
        np.testing.assert_array_equal(group["samples"][-1], y.astype(float))
    if even:
        (group,) = groups
        assert group["channels"] == [{"name": "Gap 3-Y", "unit": "m"}] * 2 and group["clock"] == {"start": 0.0, "step": 1e-4}
    else:
        assert len(groups) == 2 and groups[0]["channels"] == [{"name": "", "unit": "s"}, {"name": "Gap 3-Y", "unit": "m"}]
        np.testing.assert_array_equal(groups[0]["samples"][0], x.astype(float))


def test_groups_names_and_other_datasets(dump, tmp_path):
    sets = [dataset(id1="A"), dataset(id1="B", ordinate_axis_units_lab="mm"), dataset(id1="C", x=np.arange(N) / 512.0), dataset(id1="D", x=np.arange(N - 1) / 512.0, data=np.ones(N - 1))]
    header = dict(type=151, model_name="rig", description="d", db_app="x", date_db_created="01-May-24", time_db_created="12:00:00", version_db1=0, version_db2=0, file_type=0, date_db_saved="01-May-24", time_db_saved="12:00:00", program="x", date_file_written="01-May-24", time_file_written="12:00:00")
    frf = dataset(id1="H", func_type=4, abscissa_spec_data_type=18, data=RNG.normal(size=N) + 1j)
    spectrum = dataset(id1="S", func_type=2)
    read = dump(write(tmp_path / "f.uff", [header, sets[0], frf, sets[1], spectrum, *sets[2:]]))
    assert [[c["name"] for c in g["channels"]] for g in read["groups"]] == [["A", "B"], ["C"], ["D"]]
    assert [c["unit"] for c in read["groups"][0]["channels"]] == ["kN", "mm"]
    np.testing.assert_allclose(read["groups"][0]["samples"], [s["data"] for s in sets[:2]], rtol=1e-11)
    assert any("`H`" in n and "complex" in n for n in read["notes"]) and any("`S`" in n for n in read["notes"])


@pytest.mark.parametrize("code,unit", [(1, "m/s²"), (5, "mm/s²"), (7, "in/s²"), (9, "")])
def test_units_of_the_data_type(dump, tmp_path, code, unit):
    units = dict(type=164, units_code=code, units_description="", temp_mode=1, length=1.0, force=1.0, temp=1.0, temp_offset=0.0)
    blank = dataset(ordinate_axis_units_lab="NONE", ordinate_spec_data_type=12)
    assert dump(write(tmp_path / "f.uff", [units, blank]))["groups"][0]["channels"][0]["unit"] == unit


def test_numbers_that_touch(dump, tmp_path):
    path = write(tmp_path / "f.uff", [dataset(ord_data_type=2, data=-np.abs(RNG.normal(size=N)))], force_double=False)
    lines = path.read_text().split("\n")
    lines[13] = "".join(f"{v:13.5E}" for v in [-1.5e100, -2.5e100, 1.0, -3.0, 4.0, 5.0])
    lines[14] = " 1.500000D+02" + lines[14][13:]
    path.write_text("\n".join(lines))
    samples = dump(path)["groups"][0]["samples"][0]
    assert samples[:7] == [-1.5e100, -2.5e100, 1.0, -3.0, 4.0, 5.0, 150.0]


@pytest.mark.parametrize("binary", [0, 1])
def test_a_cut_file_gives_what_is_whole(dump, tmp_path, binary):
    wrote = dataset(binary=binary)
    path = write(tmp_path / "f.uff", [wrote])
    whole, reference = path.read_bytes(), wrote["data"] if binary else by_pyuff(path)["data"]
    path.write_bytes(whole[:-300])
    read = dump(path)
    count = read["groups"][0]["length"]
    assert 5 < count < N and any("cut" in note for note in read["notes"])
    np.testing.assert_array_equal(read["groups"][0]["samples"][0], reference[:count])


def test_faults(dump, tmp_path):
    path = write(tmp_path / "f.uff", [dataset()])
    text = path.read_text()
    path.write_text(text.replace(f"{4:10}{N:10}", f"{4:10}{10**9:10}"))
    assert "ends before the 1000000000 values" in dump(path, error=True)
    path.write_text(text.replace(f"{4:10}{N:10}", f"{4:10}{'many':>10}"))
    assert "record 7" in dump(path, error=True)
    path = write(tmp_path / "f.uff", [dataset(func_type=2)])
    assert "no time response" in dump(path, error=True)
