"""MATLAB 7.3 files, as hdf5storage writes them and as MATLAB lays them out."""
import h5py
import hdf5storage
import numpy as np


def channels(group):
    return {c["name"]: (c["unit"], s) for c, s in zip(group["channels"], group["samples"])}


def matlab(path):
    """An open file with MATLAB's head; what is written follows MATLAB's layout by hand."""
    with h5py.File(path, "w", userblock_size=512, libver=("earliest", "v108")):
        pass
    head = b"MATLAB 7.3 MAT-file, Platform: PCWIN64, Created on: Tue Mar 12 10:00:00 2024 HDF5 schema 1.00 ."
    with open(path, "r+b") as f:
        f.write(head.ljust(116) + bytes(8) + b"\x00\x02IM")
    return h5py.File(path, "r+", libver=("earliest", "v108"))


def put(where, name, array, kind="double", **more):
    array = np.atleast_2d(np.asarray(array))
    where[name] = array.T  # columns first
    where[name].attrs["MATLAB_class"] = np.bytes_(kind)
    where[name].attrs.update(more)
    return where[name]


def text(where, name, value):
    return put(where, name, np.array([[ord(c) for c in value]], dtype="<u2"), "char", MATLAB_int_decode=np.int32(2))


def test_written_by_hdf5storage(dump, tmp_path):
    n = 5000
    t, f = np.linspace(0, 1, n)[:, None], np.sin(np.arange(n))[:, None]
    run = {"force": f, "count": np.arange(n, dtype="int16")[None, :], "name": "drop 1"}
    hdf5storage.savemat(str(tmp_path / "a.mat"), {"t": t, "table": np.hstack([t, f]), "Fs": 51200.0, "note": "soft", "run": run}, format="7.3", oned_as="column")
    assert (tmp_path / "a.mat").read_bytes().startswith(b"MATLAB 7.3 MAT-file")
    result = dump(tmp_path / "a.mat")
    by = {g["name"]: g for g in result["groups"]}
    top, inner = channels(by[""]), channels(by["run"])
    assert top["t"][1] == list(t[:, 0]) and top["table(:, 1)"][1] == list(t[:, 0]) and top["table(:, 2)"][1] == list(f[:, 0])
    assert inner["force"][1] == list(f[:, 0]) and inner["count"][1] == list(range(n))
    assert by[""]["clock"] == {"start": 0, "step": 1 / 51200} and by["run"]["clock"] == by[""]["clock"]
    assert dict(map(tuple, by[""]["properties"]))["note"] == "soft" and dict(map(tuple, by["run"]["properties"]))["name"] == "drop 1"


def test_layout_of_matlab_itself(dump, tmp_path):
    with matlab(tmp_path / "a.mat") as f:
        put(f, "row", np.arange(50.0)[None, :])
        put(f, "column", np.arange(50.0)[:, None] * 2)
        put(f, "wide", np.arange(150.0).reshape(3, 50))
        put(f, "square", np.arange(4.0).reshape(2, 2))
        put(f, "flags", (np.arange(50)[:, None] % 2).astype("u1"), "logical", MATLAB_int_decode=np.int32(1))
        put(f, "dt", [[0.5]])
        text(f, "comment", "Prüfstand")
        f["empty"] = np.array([0, 0], dtype="u8")
        f["empty"].attrs.update({"MATLAB_class": np.bytes_("double"), "MATLAB_empty": np.uint8(1)})
        s = f.create_group("s")
        s.attrs["MATLAB_class"] = np.bytes_("struct")
        put(s, "x", np.arange(30.0)[:, None])
    result = dump(tmp_path / "a.mat")
    by = {(g["name"], g["length"]): g for g in result["groups"]}
    top = channels(by["", 50])
    assert top["row"][1] == list(range(50)) and top["column"][1] == list(range(0, 100, 2)) and top["flags"][1] == [0, 1] * 25
    assert [top[f"wide({i}, :)"][1] for i in (1, 2, 3)] == np.arange(150).reshape(3, 50).tolist()
    square = channels(by["", 2])
    assert square["square(:, 1)"][1] == [0, 2] and square["square(:, 2)"][1] == [1, 3]
    assert channels(by["s", 30])["x"][1] == list(range(30)) and by["s", 30]["clock"] == {"start": 0, "step": 0.5}
    assert dict(map(tuple, by["", 50]["properties"]))["comment"] == "Prüfstand"


def test_cells_and_arrays_of_structs(dump, tmp_path):
    with matlab(tmp_path / "a.mat") as f:
        refs = f.create_group("#refs#")
        put(refs, "a", np.arange(20.0)[:, None])
        put(refs, "b", np.arange(20.0)[:, None] + 100)
        put(refs, "c", np.array([[ord(c) for c in "kN"]], dtype="<u2"), "char")
        f["runs"] = np.array([[refs["a"].ref], [refs["b"].ref], [refs["c"].ref]], dtype=h5py.ref_dtype)
        f["runs"].attrs["MATLAB_class"] = np.bytes_("cell")
        table = f.create_group("hidden")
        table.attrs["MATLAB_class"] = np.bytes_("struct")
        f["object"] = np.array([[refs.ref]], dtype=h5py.ref_dtype)
        f["object"].attrs["MATLAB_class"] = np.bytes_("cell")
    result = dump(tmp_path / "a.mat")
    (group,) = result["groups"]
    assert channels(group) == {"runs{1}": ("", [float(i) for i in range(20)]), "runs{2}": ("", [100.0 + i for i in range(20)])}
    assert dict(map(tuple, group["properties"]))["runs{3}"] == "kN" and any('"object"' in n for n in result["notes"])


def test_a_cut_file_is_refused(dump, tmp_path):
    with matlab(tmp_path / "a.mat") as f:
        put(f, "x", np.arange(5000.0)[:, None])
    data = (tmp_path / "a.mat").read_bytes()
    (tmp_path / "b.mat").write_bytes(data[:-1000])
    assert "ends at byte" in dump(tmp_path / "b.mat", error=True)
