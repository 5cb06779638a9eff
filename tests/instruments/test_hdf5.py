"""HDF5 files as h5py writes them: every name, unit and sample must come back."""
import math
import re

import h5py
import numpy as np
import pytest

N = 70_000  # more than a block
RAMP = np.arange(N)


def channels(group):
    return {c["name"]: (c["unit"], s) for c, s in zip(group["channels"], group["samples"])}


def numbers(samples):
    return np.array([math.nan if v is None else v for v in samples], dtype=float)


def one(result):
    assert len(result["groups"]) == 1, [g["name"] for g in result["groups"]]
    return result["groups"][0]


@pytest.mark.parametrize("libver", ["earliest", "v108", "v110", "v112", "latest"])
@pytest.mark.parametrize("how", [
    {}, {"chunks": (1000,)}, {"compression": "gzip"}, {"compression": "gzip", "shuffle": True, "fletcher32": True}, {"compression": "lzf"},
    {"chunks": (777,), "maxshape": (None,), "compression": "gzip", "compression_opts": 9}, {"scaleoffset": 3}, {"chunks": (N,)}, {"compression": "szip"},
], ids=str)
def test_layouts_and_filters(dump, tmp_path, libver, how):
    if how.get("compression") == "szip" and not h5py.h5z.filter_avail(h5py.h5z.FILTER_SZIP):
        pytest.skip("this h5py has no szip")
    wave = np.round(np.sin(RAMP / 50), 3)
    with h5py.File(tmp_path / "a.h5", "w", libver=libver) as f:
        f.create_dataset("wave", data=wave, **how)
    group = one(dump(tmp_path / "a.h5"))
    assert np.allclose(numbers(channels(group)["wave"][1]), wave, rtol=0, atol=5e-4 if "scaleoffset" in how else 0) and group["length"] == N


@pytest.mark.parametrize("dtype", ["<i1", "<u1", "<i2", ">i2", "<u2", "<i4", ">i4", ">u4", "<i8", ">i8", "<u8", "<f2", ">f2", "<f4", ">f4", "<f8", ">f8", "?"])
@pytest.mark.parametrize("chunks", [None, (100,)])
def test_types(dump, tmp_path, dtype, chunks):
    kind = np.dtype(dtype)
    if kind.kind in "iu":
        info = np.iinfo(kind)
        data = np.array([info.min, info.max, 0, 1, 100] * 50, dtype=kind)
    elif kind.kind == "b":
        data = np.array([True, False, True] * 50)
    else:
        data = np.array([0.1, -2.5, math.inf, -math.inf, math.nan, 6e-8, 60000.0] * 50).astype(kind)
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f.create_dataset("x", data=data, chunks=chunks)
    want, got = data.astype(float), numbers(channels(one(dump(tmp_path / "a.h5")))["x"][1])
    finite = np.isfinite(want)  # JSON has no infinity: the dump prints null
    assert np.array_equal(got[finite], want[finite]) and np.isnan(got[~finite]).all()


def test_compact_datasets(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as f:
        plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
        plist.set_layout(h5py.h5d.COMPACT)
        data = np.arange(20.0)
        h5py.h5d.create(f.id, b"small", h5py.h5t.IEEE_F64LE, h5py.h5s.create_simple((20,)), plist).write(h5py.h5s.ALL, h5py.h5s.ALL, data)
    assert channels(one(dump(tmp_path / "a.h5")))["small"][1] == list(range(20))


def test_groups_units_clock_and_properties(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f.attrs["instrument"] = "DAQ 7"
        f.attrs["date"] = np.bytes_("2024-03-12")
        run = f.create_group("runs/drop 1")
        run.attrs["sample_rate"] = 51200.0
        run.attrs["limits"] = [1.5, 2.5]
        run["force"] = RAMP * 0.5
        run["force"].attrs["unit"] = "kN"
        run["force"].attrs["sensor"] = "9331B"
        run["acceleration"] = RAMP * -1.0
        run["acceleration"].attrs["Units"] = np.bytes_("m/s²".encode())
        run["slow"] = np.arange(10.0)
        run["slow"].attrs["dt"] = 0.25
        run["comment"] = "soft ground"
        run["mass"] = 3.5
        f["other/time"] = np.linspace(0, 1, 5)
    result = dump(tmp_path / "a.h5")
    by = {(g["name"], g["length"]): g for g in result["groups"]}
    assert set(by) == {("runs/drop 1", N), ("runs/drop 1", 10), ("other", 5)}
    fast, slow, other = by["runs/drop 1", N], by["runs/drop 1", 10], by["other", 5]
    assert channels(fast)["force"][0] == "kN" and channels(fast)["acceleration"][0] == "m/s²"
    assert channels(fast)["force"][1] == list(RAMP * 0.5) and channels(fast)["acceleration"][1] == list(RAMP * -1.0)
    assert fast["clock"] == {"start": 0, "step": 1 / 51200} and slow["clock"] == {"start": 0, "step": 0.25} and other["clock"] is None
    properties = dict(map(tuple, fast["properties"]))
    assert properties["instrument"] == "DAQ 7" and properties["date"] == "2024-03-12" and properties["comment"] == "soft ground" and properties["mass"] == "3.5"
    assert properties["force.sensor"] == "9331B" and properties["limits"] == "1.5, 2.5"


def test_waveform_attributes(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f["v"] = np.arange(100)
        f["v"].attrs.update({"wf_increment": 1e-5, "wf_start_offset": -2e-4, "unit_string": "V"})
    group = one(dump(tmp_path / "a.h5"))
    assert group["clock"] == {"start": -2e-4, "step": 1e-5} and channels(group)["v"][0] == "V"


@pytest.mark.parametrize("chunks", [None, True])
@pytest.mark.parametrize("across", [False, True])
def test_two_axes(dump, tmp_path, across, chunks):
    table = np.arange(N * 3.0).reshape(N, 3) % 977
    with h5py.File(tmp_path / "a.h5", "w") as f:
        d = f.create_dataset("data", data=table.T if across else table, chunks=chunks)
        d.attrs["units"] = ["V", "A", "N"]
        f["t"] = RAMP * 1e-3
    group = one(dump(tmp_path / "a.h5"))
    names = ["data[0, :]", "data[1, :]", "data[2, :]"] if across else ["data[:, 0]", "data[:, 1]", "data[:, 2]"]
    assert [(c["name"], c["unit"]) for c in group["channels"]] == [*zip(names, "VAN"), ("t", "")]
    assert np.array_equal(np.array(group["samples"][:3]).T, table)


def test_names_of_columns(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f["data"] = np.zeros((50, 2))
        f["data"].attrs["columns"] = ["t", "F"]
        f["data"].attrs["unit"] = "mm"
    assert [(c["name"], c["unit"]) for c in one(dump(tmp_path / "a.h5"))["channels"]] == [("t", "mm"), ("F", "mm")]


@pytest.mark.parametrize("how", [{}, {"chunks": (333,), "compression": "gzip", "shuffle": True}])
def test_compound_table(dump, tmp_path, how):
    kind = np.dtype([("t", ">f8"), ("name", "S4"), ("f", "<f4"), ("n", "<i2"), ("axes", "<f4", (3,)), ("ok", "?")])
    table = np.zeros(N, kind)
    table["t"], table["f"], table["n"], table["ok"] = RAMP * 0.1, RAMP * 0.25, RAMP % 1000 - 500, RAMP % 2
    table["axes"] = np.stack([RAMP, -RAMP, RAMP * 2.0], axis=1)
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f.create_dataset("scope/table", data=table, **how)
        f["scope/table"].attrs["fs"] = 10.0
    group = one(dump(tmp_path / "a.h5"))
    assert group["name"] == "scope/table" and group["clock"] == {"start": 0, "step": 0.1}
    assert [c["name"] for c in group["channels"]] == ["t", "f", "n", "axes[0]", "axes[1]", "axes[2]", "ok"]
    want = [table["t"], table["f"], table["n"], *table["axes"].T, table["ok"]]
    assert all(np.array_equal(numbers(got), w.astype(float)) for got, w in zip(group["samples"], want))


def test_links_and_cycles(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f["a/x"] = np.arange(10.0)
        f["a/again"] = f["a"]  # a cycle of hard links
        f["a/self"] = h5py.SoftLink("/a")
        f["a/y"] = h5py.SoftLink("/b/z")
        f["a/gone"] = h5py.SoftLink("/nowhere")
        f["a/round"] = h5py.SoftLink("/a/round")
        f["a/far"] = h5py.ExternalLink("other.h5", "/x")
        f["b/z"] = np.arange(10.0) * 2
    groups = {g["name"]: channels(g) for g in dump(tmp_path / "a.h5")["groups"]}
    assert set(groups) == {"a", "b"} and set(groups["a"]) == {"x", "y"} and groups["a"]["y"][1] == [2 * i for i in range(10)]


def test_many_channels_in_a_group(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w", libver="latest", track_order=True) as f:
        for i in range(300):
            f[f"channel {i}"] = np.arange(20) + i
    group = one(dump(tmp_path / "a.h5"))
    assert [c["name"] for c in group["channels"]] == [f"channel {i}" for i in range(300)]
    assert all(s == list(range(i, i + 20)) for i, s in enumerate(group["samples"]))


def test_scaled_integers(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f["x"] = np.array([0, 1, -5], dtype="<i2")
        f["x"].attrs.update({"scale_factor": 0.5, "add_offset": 10.0})
    assert channels(one(dump(tmp_path / "a.h5")))["x"][1] == [10, 10.5, 7.5]


def test_values_that_were_never_written_and_user_block(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w", userblock_size=1024) as f:
        d = f.create_dataset("x", shape=(100,), chunks=(10,), dtype="f8", fillvalue=-1.0)
        d[:15] = 7
        f["deep/y"] = np.arange(5)
        f["deep/y"].attrs["unit"] = "m"
    groups = {g["name"]: g for g in dump(tmp_path / "a.h5")["groups"]}
    assert channels(groups[""])["x"][1] == [7] * 15 + [-1] * 85 and channels(groups["deep"])["y"] == ("m", [0, 1, 2, 3, 4])


def test_what_is_left_out_is_reported(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f["x"] = np.arange(5.0)
        f["cube"] = np.zeros((3, 4, 5))
        f["words"] = [f"w{i}" for i in range(200)]
        f["none"] = h5py.Empty("f8")
        f.create_dataset("huge", shape=(10**12,), chunks=(1000,), dtype="f8")
    result = dump(tmp_path / "a.h5")
    assert list(channels(one(result))) == ["x"]
    for left in ["cube", "words", "huge"]:
        assert any(f'"{left}"' in note for note in result["notes"]), (left, result["notes"])


def test_unknown_compression_is_reported(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f.create_dataset("x", data=np.zeros(1000), compression="lzf")
    data = (tmp_path / "a.h5").read_bytes()
    changed, count = re.subn(rb"\x00\x7d(?=..\x01\x00\x03\x00)", b"\x01\x7d", data, flags=re.S)  # the filter's number, 32000, before its name's length
    assert count == 1
    (tmp_path / "b.h5").write_bytes(changed)
    text = dump(tmp_path / "b.h5", error=True)
    assert "32001" in text and "h5repack" in text and '"x"' in text


def test_a_cut_file_is_refused(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f["x"] = np.arange(5000.0)
    data = (tmp_path / "a.h5").read_bytes()
    (tmp_path / "b.h5").write_bytes(data[: len(data) // 2])
    assert f"ends at byte {len(data) // 2}" in dump(tmp_path / "b.h5", error=True)


def test_a_file_without_numbers_is_refused(dump, tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as f:
        f["words"] = ["a", "b"]
    assert "no channels" in dump(tmp_path / "a.h5", error=True)
