"""MAT-files as scipy writes them, and of the other order of bytes by hand, read by touchdown as scipy reads them."""
import struct
from pathlib import Path

import numpy as np
import pytest
import scipy.io.matlab
from scipy.io import loadmat, savemat
from scipy.sparse import csc_matrix

KINDS = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32", "float64", "bool"]
N = 70000
# what MATLAB 4.2 to 8 wrote on Solaris, Linux and Windows, as scipy ships it
FROM_MATLAB = [p for kind in ("double", "matrix", "multi", "struct", "cell", "bool", "vec") for p in Path(scipy.io.matlab.__file__).parent.glob(f"tests/data/test{kind}_[4-8]*.mat")]


def channels(answer):
    """{name: samples} of a dump."""
    return {c["name"]: np.array(s, dtype=float) for g in answer["groups"] for c, s in zip(g["channels"], g["samples"])}


def same(answer, expected):
    ours = channels(answer)
    assert list(ours) == list(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(ours[name], np.asarray(values, dtype=float).ravel(), err_msg=name)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("compressed", [False, True])
def test_every_class_of_numbers(tmp_path, dump, kind, compressed):
    path = tmp_path / "a.mat"
    x = np.random.default_rng(1).uniform(0, 120, N).astype(kind)
    savemat(path, {"x": x, "m": x.reshape(-1, 7)}, do_compression=compressed, oned_as="column")
    m = loadmat(path)["m"]
    same(dump(path), {"x": loadmat(path)["x"], **{f"m {i + 1}": m[:, i] for i in range(7)}})


def flat(name, value):
    """Channels of a variable as loadmat gives it."""
    if value.dtype.names:
        return [c for f in value.dtype.names for c in flat(f"{name}.{f}", value[f].ravel()[0])]
    if value.dtype.kind == "O":
        return [c for i, v in enumerate(value.ravel(order="F")) for c in flat(f"{name}.{i + 1}", v)]
    if value.size < 2 or value.dtype.kind not in "iufb":
        return []
    columns = [value.ravel()] if 1 in value.shape else list(value.T if value.shape[0] >= value.shape[1] else value)
    return [(name if len(columns) == 1 else f"{name} {i + 1}", c) for i, c in enumerate(columns)]


@pytest.mark.parametrize("path", FROM_MATLAB, ids=lambda p: p.stem)
def test_files_that_matlab_wrote(dump, path):
    expected = dict(c for name, value in loadmat(path).items() if not name.startswith("__") for c in flat(name, value))
    ours = channels(dump(path))
    assert expected and ours.keys() == expected.keys() and len(FROM_MATLAB) > 20
    for name, values in expected.items():
        np.testing.assert_array_equal(ours[name], values)


@pytest.mark.parametrize("form", ["4", "5"])
def test_vectors_scalars_texts_and_matrices(tmp_path, dump, form):
    path = tmp_path / "a.mat"
    t = np.arange(1000) * 1e-4
    savemat(path, {"t": t[None, :], "force": np.sin(t)[:, None], "m": np.arange(3000.0).reshape(1000, 3), "wide": np.arange(2000.0).reshape(2, 1000), "rate": 10000.0, "remark": "drop no. 3", "short": np.arange(5.0)}, format=form)
    answer = dump(path)
    long, short = answer["groups"]
    assert long["name"] == "1000 samples" and long["clock"] is None and [c["name"] for c in short["channels"]] == ["short"]
    same({"groups": [long]}, {"t": t, "force": np.sin(t), **{f"m {i + 1}": np.arange(3000.0).reshape(1000, 3)[:, i] for i in range(3)}, **{f"wide {i + 1}": np.arange(2000.0).reshape(2, 1000)[i] for i in range(2)}})
    for wanted in (["rate", "10000"], ["remark", "drop no. 3"]):
        assert wanted in long["properties"] and wanted in short["properties"]
    assert any("wide" in n and "rows are channels" in n for n in answer["notes"])


def test_several_matrices_with_a_clock_of_their_own_are_tables_of_their_own(tmp_path, dump):
    path = tmp_path / "a.mat"
    t = np.arange(400) * 1e-4
    drops = {f"drop{i}": np.stack([t, np.sin(i + t)], 1) for i in range(3)}
    savemat(path, {**drops, "beside": np.cos(t)})
    groups = {g["name"]: [c["name"] for c in g["channels"]] for g in dump(path)["groups"]}
    assert groups == {**{name: [f"{name} 1", f"{name} 2"] for name in drops}, "400 samples": ["beside"]}
    # one alone may belong to the vectors beside it, and all have the clock that lies beside them
    for contents, channels in [({"drop": drops["drop0"], "beside": np.cos(t)}, 3), ({**drops, "t": t}, 7)]:
        savemat(path, contents)
        assert [len(g["channels"]) for g in dump(path)["groups"]] == [channels]


@pytest.mark.parametrize("compressed", [False, True])
def test_structs_and_cells(tmp_path, dump, compressed):
    path = tmp_path / "a.mat"
    x, cells = np.arange(100.0), np.empty(3, dtype=object)
    cells[:] = [x, x + 1, np.zeros(0)]
    several = np.zeros(2, dtype=[("v", object), ("gain", object)])
    several["v"], several["gain"] = [x * 2, x * 3], [1.0, 2.0]
    savemat(path, {"rec": {"force": x, "deep": {"m": np.stack([x, -x], 1)}, "rate": 5.0, "who": "me", "nothing": np.zeros((0, 0))}, "c": cells, "s": several}, do_compression=compressed)
    answer = dump(path)
    [group] = answer["groups"]
    same(answer, {"rec.force": x, "rec.deep.m 1": x, "rec.deep.m 2": -x, "c.1": x, "c.2": x + 1, "s.1.v": x * 2, "s.2.v": x * 3})
    assert group["name"] == "" and all(p in group["properties"] for p in (["rec.rate", "5"], ["rec.who", "me"], ["s.2.gain", "2"]))


def test_structs_with_their_own_time_are_groups(tmp_path, dump):
    path = tmp_path / "a.mat"
    t = np.arange(50) * 1e-3
    series = lambda y, unit: {"Time": t[:, None], "Data": y, "TimeInfo": {"Units": "seconds"}, "DataInfo": {"Units": unit}}
    savemat(path, {"force": series(np.sin(t)[:, None], "kN"), "acc": series(np.stack([t, -t], 1), "m/s²"), "log": {"time": t, "signal": {"values": t * 2}, "x": t * 3}, "alone": t})
    force, acc, log, rest = dump(path)["groups"]
    assert force["name"] == "force" and force["channels"] == [{"name": "Time", "unit": "seconds"}, {"name": "force", "unit": "kN"}]
    assert acc["channels"] == [{"name": "Time", "unit": "seconds"}, {"name": "acc 1", "unit": "m/s²"}, {"name": "acc 2", "unit": "m/s²"}]
    assert [c["name"] for c in log["channels"]] == ["log.time", "log.signal.values", "log.x"] and [c["name"] for c in rest["channels"]] == ["alone"]
    np.testing.assert_array_equal(force["samples"], [t, np.sin(t)])


def test_what_is_left_out_is_noted(tmp_path, dump):
    path = tmp_path / "a.mat"
    savemat(path, {"z": np.arange(5) * 1j, "sparse": csc_matrix(np.eye(5)), "cube": np.zeros((2, 3, 4)), "line": np.arange(5.0).reshape(1, 1, 5), "lines": np.array(["ab", "cd"]), "x": np.arange(5.0)})
    answer = dump(path)
    same(answer, {"line": np.arange(5), "x": np.arange(5)})
    for name, why in {"z": "complex", "sparse": "full(...)", "cube": "two dimensions", "lines": "many lines"}.items():
        assert any(f'"{name}"' in n and why in n for n in answer["notes"])
    savemat(path, {"z": 1.0})
    assert "no vectors" in dump(path, error=True)
    savemat(path, {"z": np.arange(5) * 1j}, format="4")
    assert "complex" in dump(path, error=True)


def element(e, kind, body):
    if 0 < len(body) <= 4:
        return struct.pack(e + "I", len(body) << 16 | kind) + body.ljust(4, b"\0")
    return struct.pack(e + "II", kind, len(body)) + body + b"\0" * (-len(body) % 8)


def matrix(e, name, kind, klass, array, columns=1):
    body = element(e, 6, struct.pack(e + "II", klass, 0)) + element(e, 5, struct.pack(e + "ii", array.size // columns, columns)) + element(e, 1, name) + element(e, kind, array.tobytes())
    return element(e, 14, body)


@pytest.mark.parametrize("e", ["<", ">"])
def test_both_orders_of_bytes_and_numbers_stored_smaller_than_their_class(tmp_path, dump, e):
    """MATLAB stores doubles that are whole numbers as integers."""
    path = tmp_path / "a.mat"
    kinds = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
    raw = b"MATLAB 5.0 MAT-file, by hand".ljust(124) + struct.pack(e + "H", 0x100) + (b"IM" if e == "<" else b"MI")
    for kind, code in kinds.items():
        raw += matrix(e, b"x_" + code.encode(), kind, 6, np.arange(6).astype(e + code)) + matrix(e, code.encode(), kind, 6, np.arange(2).astype(e + code)) + matrix(e, b"m" + code.encode(), kind, 6, np.arange(6).astype(e + code), 2)
    path.write_bytes(raw)
    theirs = loadmat(path)
    ours = channels(dump(path))
    assert len(ours) == 4 * len(kinds)
    for code in kinds.values():
        np.testing.assert_array_equal(ours["x_" + code], theirs["x_" + code].ravel())
        np.testing.assert_array_equal(ours[code], theirs[code].ravel())
        np.testing.assert_array_equal([ours[f"m{code} 1"], ours[f"m{code} 2"]], theirs["m" + code].T)
    assert ["header", "MATLAB 5.0 MAT-file, by hand"] in dump(path)["groups"][0]["properties"]


@pytest.mark.parametrize("e", ["<", ">"])
def test_every_kind_of_version_4(tmp_path, dump, e):
    path = tmp_path / "a.mat"
    raw = b""
    for i, code in enumerate(["f8", "f4", "i4", "i2", "u2", "u1"]):
        raw += struct.pack(e + "5i", (1000 if e == ">" else 0) + 10 * i, 4, 2, 0, 3) + f"x{i}\0".encode() + np.arange(8).astype(e + code).tobytes()
    path.write_bytes(raw)
    theirs = loadmat(path)
    same(dump(path), {f"x{i} {c + 1}": theirs[f"x{i}"][:, c] for i in range(6) for c in range(2)})


@pytest.mark.parametrize("form, compressed", [("4", False), ("5", False), ("5", True)])
def test_a_cut_file_gives_the_variables_that_are_whole(tmp_path, dump, form, compressed):
    path = tmp_path / "a.mat"
    savemat(path, {"x": np.random.default_rng(1).normal(size=1000)}, format=form, do_compression=compressed)
    whole = path.stat().st_size
    savemat(path, {"x": np.random.default_rng(1).normal(size=1000), "y": np.arange(1000.0)}, format=form, do_compression=compressed)
    raw = path.read_bytes()
    for cut in (whole + 3, whole + 40, len(raw) - 1):
        path.write_bytes(raw[:cut])
        answer = dump(path)
        same(answer, {"x": np.random.default_rng(1).normal(size=1000)})
        assert any(f"byte {whole}" in n for n in answer["notes"])
    path.write_bytes(raw[:whole - 1])
    assert "no vectors" in dump(path, error=True)


def test_damaged_files_say_where(tmp_path, dump):
    path = tmp_path / "a.mat"
    savemat(path, {"x": np.random.default_rng(1).normal(size=1000)}, do_compression=True)
    raw = bytearray(path.read_bytes())
    raw[3000] ^= 0xFF
    path.write_bytes(raw)
    assert "byte 136" in dump(path, error=True)
    savemat(path, {"x": np.arange(10.0)})
    raw = path.read_bytes()
    path.write_bytes(raw.replace(struct.pack("<ii", 1, 10), struct.pack("<ii", 2**31 - 1, 2**31 - 1)))
    assert "claims" in dump(path, error=True)
