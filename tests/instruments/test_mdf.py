"""MDF 4 as asammdf writes it, and layouts it does not write by hand, read by touchdown as asammdf reads them."""
import struct
import zlib

import numpy as np
import pytest
from asammdf import MDF, Signal
from asammdf.blocks.conversion_utils import from_dict

N = 30000
T = np.arange(N) * 1e-4
KINDS = ["int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float16", "float32", "float64"]


def channels(answer):
    """{name: samples} of a dump."""
    return {c["name"]: np.array(s, dtype=float) for g in answer["groups"] for c, s in zip(g["channels"], g["samples"])}


def write(path, signals, compression=0, version="4.10", fragment=None, **options):
    with MDF(version=version, **options) as file:
        if fragment:
            file.configure(write_fragment_size=fragment)
        file.append(signals, acq_name="Drop 1", comment="a comment")
        file.save(path, overwrite=True, compression=compression)


@pytest.mark.parametrize("compression", [0, 1, 2])
@pytest.mark.parametrize("version", ["4.00", "4.10", "4.20"])
@pytest.mark.parametrize("fragment", [None, 65536])
def test_every_type_in_every_packing(tmp_path, dump, compression, version, fragment):
    path = tmp_path / "a.mf4"
    rng = np.random.default_rng(1)
    data = {k: rng.uniform(0, 120, N).astype(k) for k in KINDS}
    big = {f"big {k}": d.astype(np.dtype(k).newbyteorder(">")) for k, d in data.items()}
    write(path, [Signal(d, T, name=n, unit="kN" if n == "int8" else "") for n, d in {**data, **big}.items()], compression, version, fragment)
    answer = dump(path)
    [group] = answer["groups"]
    assert group["name"] == "Drop 1" and group["clock"] is None and group["length"] == N and answer["notes"] == []
    assert group["channels"][:2] == [{"name": "time", "unit": "s"}, {"name": "int8", "unit": "kN"}]
    ours = channels(answer)
    assert set(ours) == {"time", *data, *big}
    np.testing.assert_array_equal(ours["time"], T)
    for name, d in {**data, **big}.items():
        np.testing.assert_array_equal(ours[name], d.astype(float), err_msg=name)


@pytest.mark.parametrize("name, conversion", [
    ("linear", {"a": 0.25, "b": -3.0}), ("rational", {"P1": 1.0, "P2": 2.0, "P3": 3.0, "P4": 0.5, "P5": 0.1, "P6": 7.0}), ("inverse", {"P1": 0.0, "P2": 0.0, "P3": 5.0, "P4": 0.0, "P5": 1.0, "P6": 9.0}),
    ("interpolated", {**{f"raw_{i}": v for i, v in enumerate([0, 10, 20, 90])}, **{f"phys_{i}": v for i, v in enumerate([5.0, 1.0, 7.0, -3.0])}, "interpolation": True}),
    ("nearest", {**{f"raw_{i}": v for i, v in enumerate([0, 10, 20, 90])}, **{f"phys_{i}": v for i, v in enumerate([5.0, 1.0, 7.0, -3.0])}, "interpolation": False}),
])
@pytest.mark.parametrize("kind", ["uint8", "float64"])
def test_conversions_to_numbers(tmp_path, dump, name, conversion, kind):
    path = tmp_path / "a.mf4"
    raw = np.random.default_rng(2).uniform(0, 110, N).astype(kind)
    write(path, [Signal(raw, T, name="x", conversion=from_dict(conversion))])
    with MDF(path) as file:
        expected = file.get("x").samples
    np.testing.assert_allclose(channels(dump(path))["x"], expected, rtol=1e-13, atol=1e-13)


def test_several_groups_properties_and_invalid_values(tmp_path, dump):
    path = tmp_path / "a.mf4"
    bad = np.arange(N) % 7 == 3
    with MDF(version="4.10") as file:
        file.header.comment = "<HDcomment><TX>drop &amp; hold</TX><common_properties><e name=\"author\">Ada</e></common_properties></HDcomment>"
        file.append([Signal(np.arange(N), T, name="x", invalidation_bits=bad), Signal(np.arange(N) * 2.0, T, name="y", unit="m/s²"), Signal(np.arange(N) * 3.0, T, name="z", invalidation_bits=~bad)], acq_name="fast")
        file.append([Signal(np.arange(50.0), T[:50] * 100, name="slow")], acq_name="slow")
        file.save(path)
    answer = dump(path)
    fast, slow = answer["groups"]
    assert (fast["name"], slow["name"], slow["length"]) == ("fast", "slow", 50)
    ours = channels({"groups": [fast]})
    np.testing.assert_array_equal(ours["x"], np.where(bad, np.nan, np.arange(N)))
    np.testing.assert_array_equal(ours["z"], np.where(bad, np.arange(N) * 3.0, np.nan))
    np.testing.assert_array_equal(ours["y"], np.arange(N) * 2.0)
    names = dict(fast["properties"])
    assert names["comment"] == "drop & hold" and names["author"] == "Ada" and names["start"].startswith("20") and names["program"]


def test_what_is_left_out_is_noted(tmp_path, dump):
    path = tmp_path / "a.mf4"
    texts = {f"val_{i}": i for i in range(3)} | {f"text_{i}": f"text {i}".encode() for i in range(3)} | {"default": b"none"}
    write(path, [Signal(np.array([b"ab"] * N), T, name="word", encoding="utf-8"), Signal(np.arange(N) % 3, T, name="state", conversion=from_dict(texts)), Signal(np.arange(N), T, name="formula", conversion=from_dict({"formula": "X1*2"})), Signal(np.arange(N), T, name="x")])
    answer = dump(path)
    ours = channels(answer)
    assert list(ours) == ["time", "state", "x"]
    np.testing.assert_array_equal(ours["state"], np.arange(N) % 3)
    for name, why in {"word": "text", "formula": "formula", "state": "as they are"}.items():
        assert any(f'"{name}" of group "Drop 1"' in n and why in n for n in answer["notes"])


def test_structures_give_their_members(tmp_path, dump):
    path = tmp_path / "a.mf4"
    record = np.rec.fromarrays([np.arange(N, dtype="u2"), np.arange(N) * 0.5], names=["a", "b"])
    write(path, [Signal(record, T, name="s"), Signal(np.arange(N), T, name="x")])
    ours = channels(dump(path))
    np.testing.assert_array_equal(ours["a"], record.a)
    np.testing.assert_array_equal(ours["b"], record.b)
    assert "x" in ours and len(ours) == 4


class File:
    """A file of blocks; a block is written after the ones that it links to."""

    def __init__(self, version=410, magic=b"MDF     ", flags=0):
        self.raw = bytearray(magic + b"4.10    by hand " + bytes(4) + struct.pack("<H", version) + bytes(30) + struct.pack("<HH", flags, 0) + bytes(104))

    def block(self, kind, links=(), data=b"", length=None):
        self.raw += bytes(-len(self.raw) % 8)
        at = len(self.raw)
        size = 24 + 8 * len(links) + len(data)
        self.raw += b"##" + kind + bytes(4) + struct.pack("<QQ", size if length is None else length, len(links)) + struct.pack(f"<{len(links)}Q", *links) + data
        return at

    def text(self, text):
        return self.block(b"TX", (), text.encode() + b"\0")

    def conversion(self, kind, values=(), refs=(), unit=0):
        return self.block(b"CC", (0, unit, 0, 0, *refs), struct.pack("<BBHHHdd", kind, 0, 0, len(refs), len(values), 0, 0) + struct.pack(f"<{len(values)}d", *values))

    def channel(self, name, after=0, data_type=0, at=0, bit=0, bits=8, conversion=0, kind=0, sync=0, flags=0, invalid=0, parts=0, unit=0):
        return self.block(b"CN", (after, parts, self.text(name), 0, conversion, 0, unit, 0), struct.pack("<BBBBIIIIBBHdddddd", kind, sync, data_type, bit, at, bits, flags, invalid, 0, 0, 0, *[0.0] * 6))

    def group(self, channel, count, size, after=0, number=0, invalid=0, flags=0, master=()):
        return self.block(b"CG", (after, channel, self.text("by hand"), 0, 0, 0, *master), struct.pack("<QQHHIII", number, count, flags, 0, 0, size, invalid))

    def zipped(self, kind, raw, columns=0):
        rows = np.frombuffer(raw, "u1")[:len(raw) // columns * columns].reshape(-1, columns) if columns else None
        packed = zlib.compress(raw if rows is None else rows.T.tobytes() + raw[rows.size:])
        return self.block(b"DZ", (), kind + struct.pack("<BxIQQ", int(rows is not None), columns, len(raw), len(packed)) + packed)

    def save(self, path, group, data, id_size=0, after=0):
        dg = self.block(b"DG", (after, group, data, 0), struct.pack("<B7x", id_size))
        self.raw[64:168] = b"##HD" + bytes(4) + struct.pack("<QQ", 104, 6) + struct.pack("<6Q", dg, 0, 0, 0, 0, 0) + struct.pack("<QhhBBBxdd", 1714564800250000000, 0, 0, 0, 0, 0, 0, 0)
        path.write_bytes(self.raw)
        return path


def test_bits_within_bytes(tmp_path, dump):
    """Numbers of any count of bits at any bit, signed and not, in both orders of bytes."""
    raw, file = np.random.default_rng(3).integers(0, 256, (500, 12), dtype="u1"), File()
    first, expected = 0, {}
    for bit, bits in [(0, 1), (3, 5), (7, 9), (2, 12), (5, 24), (1, 33), (7, 64), (0, 64), (4, 57)]:
        for data_type in range(4):
            n, e = (bit + bits + 7) // 8, "big" if data_type % 2 else "little"
            values = [int.from_bytes(row[1:1 + n], e) >> bit & 2**bits - 1 for row in raw.tolist()]
            expected[f"{bit} {bits} {data_type}"] = [v - 2**bits if data_type > 1 and v >> bits - 1 else v for v in values]
            first = file.channel(f"{bit} {bits} {data_type}", first, data_type, 1, bit, bits)
    path = file.save(tmp_path / "a.mf4", file.group(first, 500, 12), file.block(b"DT", (), raw.tobytes()))
    ours = channels(dump(path))
    assert set(ours) == set(expected)
    for name, values in expected.items():
        np.testing.assert_array_equal(ours[name], np.array(values, dtype=float), err_msg=name)


def test_unsorted_records(tmp_path, dump):
    file, rng = File(), np.random.default_rng(4)
    texts = file.group(0, 0, 0, number=3, flags=1)
    b = file.group(file.channel("b", 0, 2, 0, 0, 16), 300, 2, after=texts, number=2)
    a = file.group(file.channel("time", file.channel("a", 0, 4, 8, 0, 64), 4, 0, 0, 64, kind=2, sync=1), 200, 16, after=b, number=1)
    order, data, expected = rng.permutation([1] * 200 + [2] * 300 + [3] * 50), b"", {1: [], 2: []}
    for i, k in enumerate(order):
        if k == 1:
            expected[1].append((i * 0.1, rng.normal()))
            data += b"\1\0" + struct.pack("<dd", *expected[1][-1])
        elif k == 2:
            expected[2].append(int(rng.integers(-999, 999)))
            data += b"\2\0" + struct.pack("<h", expected[2][-1])
        else:
            data += b"\3\0" + struct.pack("<I", i % 9) + bytes(i % 9)
    parts = [data[i:i + 701] for i in range(0, len(data), 701)]
    blocks = [file.block(b"DT", (), p) if i % 2 else file.zipped(b"DT", p) for i, p in enumerate(parts)]
    lists = file.block(b"DL", (0, *blocks[5:]), struct.pack("<B3xIQ", 1, len(blocks) - 5, 701))
    lists = file.block(b"DL", (lists, *blocks[:5]), struct.pack("<B3xIQ", 1, 5, 701))
    path = file.save(tmp_path / "a.mf4", a, file.block(b"HL", (lists,), struct.pack("<HBx4x", 1, 0)), id_size=2)
    answer = dump(path)
    ours = channels(answer)
    assert [g["length"] for g in answer["groups"]] == [200, 300]
    np.testing.assert_array_equal(np.array([ours["time"], ours["a"]]).T, expected[1])
    np.testing.assert_array_equal(ours["b"], expected[2])


def test_columns_stored_apart(tmp_path, dump):
    """MDF 4.2: each channel in a list of blocks of values of its own, its invalid bits beside it, the time in another group."""
    file, n = File(420), 1000
    t, x, bad = np.arange(n) * 1e-3, np.arange(n, dtype="<i4"), np.arange(n) % 3 == 1
    bits = (bad * 4).astype("u1").tobytes()
    values = [file.block(b"DV", (), x[:300].tobytes()), file.zipped(b"DV", x[300:650].tobytes(), 4), file.zipped(b"DV", x[650:].tobytes())]
    invalid = [file.block(b"DI", (), bits[:300]), 0, file.zipped(b"DI", bits[650:])]
    data = file.block(b"LD", (0, values[2], invalid[2]), struct.pack("<IIQ", 1 << 31, 1, 350))
    data = file.block(b"LD", (data, *values[:2], *invalid[:2]), struct.pack("<IIQQ", 1 << 31, 2, 0, 300))
    time = file.group(file.channel("t", 0, 4, bits=64, kind=2, sync=1), n, 8)
    other = file.block(b"DG", (0, file.group(file.channel("x", 0, 2, bits=32, flags=2, invalid=2), n, 4, invalid=1, flags=8, master=(time,)), data, 0), bytes(8))
    [group] = dump(file.save(tmp_path / "a.mf4", time, file.block(b"DV", (), t.tobytes()), after=other))["groups"]
    bad[300:650] = False
    assert group["channels"] == [{"name": "t", "unit": "s"}, {"name": "x", "unit": ""}]
    np.testing.assert_array_equal(np.array(group["samples"], dtype=float), [t, np.where(bad, np.nan, x)])


def test_arrays_are_left_out(tmp_path, dump):
    file = File()
    array = file.channel("array", file.channel("x", at=8), bits=8, parts=file.block(b"CA", (), bytes(16)))
    answer = dump(file.save(tmp_path / "a.mf4", file.group(array, 2, 9), file.block(b"DT", (), bytes(18))))
    assert list(channels(answer)) == ["x"] and any('"array"' in n and "it is an array" in n for n in answer["notes"])


def test_time_counted_from_the_record_is_a_clock(tmp_path, dump):
    file = File()
    time = file.channel("t", file.channel("x"), kind=3, sync=1, bits=0, conversion=file.conversion(1, [-0.5, 1e-3]))
    path = file.save(tmp_path / "a.mf4", file.group(time, 4, 1), file.block(b"DT", (), bytes([1, 2, 3, 4])))
    [group] = dump(path)["groups"]
    assert group["clock"] == {"start": -0.5, "step": 1e-3} and group["samples"] == [[1, 2, 3, 4]] and ["start", "2024-05-01T12:00:00.250Z"] in group["properties"]


def test_conversions_by_ranges_and_partial_texts(tmp_path, dump):
    file = File()
    word, unit = file.text("not available"), file.text("bar")
    ranged = file.conversion(6, [0, 9, 1.5, 10, 19, 2.5, -1])
    partial = file.conversion(8, [250, 255], (word, file.conversion(1, [1, 0.5])), unit=unit)
    single = file.conversion(7, [0, 1], (file.conversion(1, [100, 0]), word, file.conversion(0)))
    first = file.channel("ranged", file.channel("partial", file.channel("single", conversion=single), conversion=partial), conversion=ranged)
    path = file.save(tmp_path / "a.mf4", file.group(first, 256, 1), file.block(b"DT", (), bytes(range(256))))
    answer, x = dump(path), np.arange(256)
    ours = channels(answer)
    np.testing.assert_array_equal(ours["ranged"], np.where(x <= 9, 1.5, np.where(x <= 19, 2.5, -1)))
    np.testing.assert_array_equal(ours["partial"], np.where(x >= 250, np.nan, 0.5 * x + 1))
    np.testing.assert_array_equal(ours["single"], np.where(x == 0, 100, np.where(x == 1, np.nan, x)))
    assert answer["groups"][0]["channels"][1] == {"name": "partial", "unit": "bar"} and sum("missing" in n for n in answer["notes"]) == 2


@pytest.mark.parametrize("length", [24, 0])
def test_a_measurement_that_was_not_finished(tmp_path, dump, length):
    file = File(magic=b"UnFinMF ", flags=5)
    group = file.group(file.channel("x", bits=16), 0, 2)
    data = len(file.raw) + 64 + (-len(file.raw) % 8)
    path = file.save(tmp_path / "a.mf4", group, data)
    assert file.block(b"DT", (), struct.pack("<5hx", *range(5)), length) == data
    path.write_bytes(file.raw)
    answer = dump(path)
    assert channels(answer)["x"].tolist() == list(range(5)) and any("not finished" in n for n in answer["notes"])


@pytest.mark.parametrize("compression", [0, 1])
def test_a_cut_file_gives_what_is_whole(tmp_path, dump, compression):
    file, raw = File(), np.arange(1000, dtype="<u2").tobytes()
    group, at = file.group(file.channel("x", bits=16), 1000, 2), 0
    start = len(file.raw) + (-len(file.raw) % 8) + 64
    packed = [raw[i:i + 400] for i in range(0, 2000, 400)]
    sizes = [24 + (24 + len(zlib.compress(p)) if compression else len(p)) for p in packed]
    links, at = [], start + 24 + 8 * 6 + 16
    for size in sizes:
        at += -at % 8
        links.append(at)
        at += size
    path = file.save(tmp_path / "a.mf4", group, start)
    assert file.block(b"DL", (0, *links), struct.pack("<B3xIQ", 1, 5, 400)) == start
    for link, p in zip(links, packed):
        assert link == (file.zipped(b"DT", p) if compression else file.block(b"DT", (), p))
    path.write_bytes(file.raw)
    assert len(channels(dump(path))["x"]) == 1000
    path.write_bytes(file.raw[:links[3] + 24 + 33])
    answer = dump(path)
    assert channels(answer)["x"].tolist() == list(range(600 if compression else 616)) and any("cut" in n for n in answer["notes"])
    path.write_bytes(file.raw[:start - 68])
    assert "cut" in dump(path, error=True)


def test_what_is_no_mdf_4(tmp_path, dump):
    path = tmp_path / "a.mdf"
    with MDF(version="3.30") as file:
        file.append([Signal(np.arange(10), T[:10], name="x")])
        file.save(path, overwrite=True)
    assert "3.30" in dump(path, error=True) and "MDF 4" in dump(path, error=True)
    file = File()
    channel = file.channel("x")
    file.raw[channel + 24:channel + 32] = struct.pack("<Q", channel)
    assert f"byte {channel}" in dump(file.save(path, file.group(channel, 1, 1), file.block(b"DT", (), b"1")), error=True)
    file = File()
    zipped = file.block(b"DZ", (), b"DT" + struct.pack("<BxIQQ", 2, 0, 4, 4) + b"1234")
    assert "4.3" in dump(file.save(path, file.group(file.channel("x"), 4, 1), zipped), error=True)
    file = File()
    zipped = file.block(b"DZ", (), b"DT" + struct.pack("<BxIQQ", 0, 0, 2**40, 4) + b"1234")
    assert f"{2**40} bytes" in dump(file.save(path, file.group(file.channel("x"), 4, 1), zipped), error=True)
