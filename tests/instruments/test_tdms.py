"""TDMS as npTDMS writes it, and as DAQmx does, written by hand: read by touchdown as npTDMS reads it."""
import struct

import numpy as np
import pytest
from nptdms import ChannelObject, GroupObject, RootObject, TdmsFile, TdmsWriter

META, NEW, RAW, INTERLEAVED, BIG, DAQMX = 2, 4, 8, 32, 64, 128
KINDS = ["int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64", "float32", "float64", "bool"]


def numbers(answer):
    """{(group, channel): samples} of a dump."""
    return {(g["name"], c["name"]): np.array(s, dtype=float) for g in answer["groups"] for c, s in zip(g["channels"], g["samples"])}


def equal(answer, path):
    """Every channel with numbers is as npTDMS reads it."""
    ours, theirs = numbers(answer), {}
    with TdmsFile.open(path) as file:
        for group in file.groups():
            for channel in group.channels():
                if len(channel) and channel[:].dtype.kind in "iufb":
                    theirs[group.name, channel.name] = channel[:].astype(float)
    assert ours.keys() == theirs.keys()
    for key in theirs:
        np.testing.assert_allclose(ours[key], theirs[key], rtol=1e-12, atol=1e-300)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("version", [4712, 4713])
def test_every_numeric_type(tmp_path, dump, kind, version):
    path = tmp_path / "a.tdms"
    data = (np.random.default_rng(2).uniform(0, 100, 70000)).astype(kind)
    with TdmsWriter(path, version=version) as file:
        file.write_segment([ChannelObject("G", "x", data, {"unit_string": "kN"})])
    answer = dump(path)
    assert answer["groups"][0]["channels"] == [{"name": "x", "unit": "kN"}] and answer["groups"][0]["clock"] is None
    equal(answer, path)


def test_names_units_clocks_and_properties(tmp_path, dump):
    path = tmp_path / "a.tdms"
    wave = {"wf_increment": 1e-5, "wf_start_offset": -0.002, "unit_string": "m/s²"}
    with TdmsWriter(path) as file:
        file.write_segment([
            RootObject({"author": "Ada", "date": np.datetime64("2024-02-29T12:30:00.25")}), GroupObject("It's / mine", {"height": 0.25}),
            ChannelObject("It's / mine", "a'b", np.arange(5.0), wave), ChannelObject("It's / mine", "c", np.arange(5.0), {**wave, "sensor": "4711"}),
            ChannelObject("It's / mine", "slow", np.arange(3.0), {"wf_increment": 1e-3}), ChannelObject("It's / mine", "no clock", np.arange(5.0), {"wf_increment": 0.0}),
            ChannelObject("It's / mine", "spectrum", np.arange(5.0), {"wf_increment": 10.0, "wf_xunit_string": "Hz"}),
            ChannelObject("It's / mine", "words", ["a", "b"]), ChannelObject("It's / mine", "empty", np.zeros(0)),
        ])
    answer = dump(path)
    fast, slow, none = answer["groups"]
    assert [g["name"] for g in answer["groups"]] == ["It's / mine"] * 3
    assert fast["channels"] == [{"name": "a'b", "unit": "m/s²"}, {"name": "c", "unit": "m/s²"}] and fast["clock"] == {"start": -0.002, "step": 1e-5}
    assert [c["name"] for c in slow["channels"]] == ["slow"] and slow["clock"] == {"start": 0.0, "step": 1e-3} and slow["length"] == 3
    assert [c["name"] for c in none["channels"]] == ["no clock", "spectrum"] and none["clock"] is None
    for wanted in (["author", "Ada"], ["height", "0.25"], ["date", "2024-02-29T12:30:00.250Z"], ["c: sensor", "4711"]):
        assert wanted in fast["properties"]
    assert any("words" in n and "text" in n for n in answer["notes"])


def test_timestamps_count_from_the_first(tmp_path, dump):
    path = tmp_path / "a.tdms"
    times = np.datetime64("2023-07-01T00:00:00.5") + (np.arange(1000) * 250).astype("timedelta64[us]")
    with TdmsWriter(path) as file:
        file.write_segment([ChannelObject("G", "time", times), ChannelObject("G", "x", np.arange(1000.0))])
    [group] = dump(path)["groups"]
    assert group["channels"][0] == {"name": "time", "unit": "s"} and ["time: first time", "2023-07-01T00:00:00.500Z"] in group["properties"]
    np.testing.assert_allclose(group["samples"][0], np.arange(1000) * 250e-6, atol=1e-12)


def test_segments_that_change(tmp_path, dump):
    path = tmp_path / "a.tdms"
    rng = np.random.default_rng(3)
    with TdmsWriter(path) as file:
        for i in range(40):
            file.write_segment([ChannelObject("G", "x", rng.normal(size=7)), ChannelObject("G", "y", rng.integers(0, 9, 7).astype("int16"))])
        for i in range(3):
            file.write_segment([ChannelObject("G", "y", rng.integers(0, 9, 5 + i).astype("int16")), ChannelObject("G", "z", rng.normal(size=3))])
        file.write_segment([ChannelObject("G", "x", rng.normal(size=18))])
        file.write_segment([GroupObject("H", {"late": "yes"})])
        file.write_segment([ChannelObject("H", "x", rng.normal(size=100000).astype("float32"))])
    equal(dump(path), path)


def text(s, e="<"):
    return struct.pack(e + "I", len(s.encode())) + s.encode()


def prop(name, value, e="<"):
    if isinstance(value, str):
        return text(name, e) + struct.pack(e + "I", 0x20) + text(value, e)
    return text(name, e) + (struct.pack(e + "II", 7, value) if isinstance(value, int) else struct.pack(e + "Id", 10, value))


def thing(path, index, properties=(), e="<"):
    return text(path, e) + index + struct.pack(e + "I", len(properties)) + b"".join(prop(n, v, e) for n, v in properties)


def plain(kind, values, e="<"):
    return struct.pack(e + "IIIQ", 20, kind, 1, values)


def segment(flags, objects, data, e="<", length=None, version=4713):
    meta = b"" if objects is None else struct.pack(e + "I", len(objects)) + b"".join(objects)
    length = len(meta) + len(data) if length is None else length
    return b"TDSm" + struct.pack("<I", flags) + struct.pack(e + "IQQ", version, length, len(meta)) + meta + data


NONE, SAME = b"\xff" * 4, b"\0" * 4


@pytest.mark.parametrize("e", ["<", ">"])
@pytest.mark.parametrize("interleaved", [False, True])
def test_layouts_by_hand(tmp_path, dump, e, interleaved):
    """Both orders of bytes; many chunks in one segment; segments without metadata or with changes only."""
    path = tmp_path / "a.tdms"
    flags = (BIG if e == ">" else 0) | (INTERLEAVED if interleaved else 0)
    rng = np.random.default_rng(4)

    def data(n, chunks):
        out = b""
        for _ in range(chunks):
            a, b = rng.normal(size=n).astype(e + "f8"), rng.integers(-9, 9, n).astype(e + "i2")
            out += b"".join(x.tobytes() + y.tobytes() for x, y in zip(a, b)) if interleaved else a.tobytes() + b.tobytes()
        return out
    raw = segment(META | NEW | RAW | flags, [thing("/", NONE, [], e), thing("/'G'", NONE, [("p", 1.5)], e), thing("/'G'/'a'", plain(10, 50, e), [("unit_string", "N")], e), thing("/'G'/'b'", plain(2, 50, e), [], e)], data(50, 3), e)
    raw += segment(RAW | flags, None, data(50, 2), e)
    raw += segment(RAW | flags, None, data(50, 1), e)
    raw += segment(META | RAW | flags, [thing("/'G'/'a'", plain(10, 9, e), [], e), thing("/'G'/'b'", plain(2, 9, e), [], e)], data(9, 4), e)
    raw += segment(META | RAW | flags, [thing("/'G'/'a'", NONE, [], e)], rng.integers(-9, 9, 18).astype(e + "i2").tobytes(), e)
    raw += segment(META | NEW | RAW | flags, [thing("/'G'/'b'", SAME, [], e), thing("/'G'/'a'", SAME, [], e)], b"".join(struct.pack(e + "hd", i, i / 3) for i in range(9)) if interleaved else struct.pack(e + "9h", *range(9)) + struct.pack(e + "9d", *range(9)), e)
    path.write_bytes(raw)
    answer = dump(path)
    equal(answer, path)
    assert [c for g in answer["groups"] for c in g["channels"] if c["name"] == "a"] == [{"name": "a", "unit": "N"}]


@pytest.mark.parametrize("interleaved", [False, True])
@pytest.mark.parametrize("length", [None, 0xFFFFFFFFFFFFFFFF])
def test_a_file_that_was_not_finished(tmp_path, dump, interleaved, length):
    path = tmp_path / "a.tdms"
    a, b = np.arange(100.0), np.arange(100, dtype="int32")
    chunk = b"".join(struct.pack("<di", x, y) for x, y in zip(a, b)) if interleaved else a.tobytes() + b.tobytes()
    head = [thing("/'G'/'a'", plain(10, 100)), thing("/'G'/'b'", plain(3, 100))]
    raw = segment(META | NEW | RAW | (INTERLEAVED if interleaved else 0), head, chunk * 4, length=length)
    for cut in (0, 1, 100, 399, 400, 401, 850, 1200, 2401):
        path.write_bytes(raw[:len(raw) - cut])
        answer = dump(path)
        equal(answer, path)
        assert any("not finished" in n for n in answer["notes"]) == (cut > 0 or length is not None)
    path.write_bytes(raw[:20])
    assert "cut" in dump(path, error=True)


def linear(i, slope, intercept, source=None):
    return [(f"NI_Scale[{i}]_Scale_Type", "Linear"), (f"NI_Scale[{i}]_Linear_Slope", slope), (f"NI_Scale[{i}]_Linear_Y_Intercept", intercept)] + ([] if source is None else [(f"NI_Scale[{i}]_Linear_Input_Source", source)])


def polynomial(i, coefficients, source):
    return [(f"NI_Scale[{i}]_Scale_Type", "Polynomial"), (f"NI_Scale[{i}]_Polynomial_Coefficients_Size", len(coefficients)), (f"NI_Scale[{i}]_Polynomial_Input_Source", source)] + [(f"NI_Scale[{i}]_Polynomial_Coefficients[{k}]", c) for k, c in enumerate(coefficients)]


def table(i, pre, scaled, source):
    before = f"NI_Scale[{i}]_Table_"
    return [(f"NI_Scale[{i}]_Scale_Type", "Table"), (before + "Input_Source", source), (before + "Pre_Scaled_Values_Size", len(pre)), (before + "Scaled_Values_Size", len(scaled))] + [(before + f"Pre_Scaled_Values[{k}]", c) for k, c in enumerate(pre)] + [(before + f"Scaled_Values[{k}]", c) for k, c in enumerate(scaled)]


def operation(i, kind, left, right):
    return [(f"NI_Scale[{i}]_Scale_Type", kind), (f"NI_Scale[{i}]_{kind}_Left_Operand_Input_Source", left), (f"NI_Scale[{i}]_{kind}_Right_Operand_Input_Source", right)]


def scales(n, *lists, status="unscaled"):
    return [("NI_Scaling_Status", status), ("NI_Number_Of_Scales", n)] + [p for of in lists for p in of]


def strain(i, configuration, source):
    values = {"Configuration": configuration, "Poisson_Ratio": 0.3, "Gage_Resistance": 350.0, "Lead_Wire_Resistance": 0.7, "Initial_Bridge_Voltage": 1e-4, "Gage_Factor": 2.1, "Bridge_Shunt_Calibration_Gain_Adjustment": 1.02, "Voltage_Excitation": 2.5, "Input_Source": source}
    return [(f"NI_Scale[{i}]_Scale_Type", "Strain")] + [(f"NI_Scale[{i}]_Strain_{k}", v) for k, v in values.items()]


ORIGIN = 0xFFFFFFFF
SCALINGS = {
    "linear": scales(1, linear(0, 0.5, -3.0)),
    "no count": linear(0, 0.5, -3.0),
    "linear of the raw data": scales(1, linear(0, 0.5, -3.0, ORIGIN)),
    "scaled already": scales(1, linear(0, 0.5, -3.0), status="scaled"),
    "polynomial": scales(1, polynomial(0, [1.0, -2.0, 0.25, 1e-3, 5e-5], ORIGIN)),
    "chain": scales(3, linear(0, 0.1, 0.0, ORIGIN), polynomial(1, [0.0, 2.0, 0.5, 0.0], 0), linear(2, 4.0, 1.0, 1)),
    "table": scales(2, linear(0, 0.1, 0.0, ORIGIN), table(1, [-1.0, 0.0, 0.5, 2.0], [5.0, 0.0, 1.0, 8.0], 0)),
    "falling table": scales(1, table(0, [30.0, 0.0, -10.0], [5.0, 0.0, 1.0], ORIGIN)),
    "add": scales(3, linear(0, 0.1, 0.0, ORIGIN), polynomial(1, [1.0, 2.0, 3.0, 4.0], ORIGIN), operation(2, "Add", 0, 1)),
    "subtract": scales(3, linear(0, 0.1, 0.0, ORIGIN), linear(1, 7.0, 2.0, ORIGIN), operation(2, "Subtract", 0, 1)),
    **{f"strain {n}": scales(2, linear(0, 1e-4, 0.0, ORIGIN), strain(1, n, 0)) for n in (10183, 10184, 10185, 10188, 10189, 10271, 10272)},
}


@pytest.mark.parametrize("name", SCALINGS)
@pytest.mark.parametrize("owner", ["channel", "group", "file"])
def test_scalings(tmp_path, dump, name, owner):
    path = tmp_path / "a.tdms"
    of = lambda who: SCALINGS[name] if who == owner else []
    data = np.arange(-50, 50, dtype="<i2").tobytes()
    path.write_bytes(segment(META | NEW | RAW, [thing("/", NONE, of("file")), thing("/'G'", NONE, of("group")), thing("/'G'/'x'", plain(2, 100), of("channel"))], data))
    equal(dump(path), path)


@pytest.mark.parametrize("properties, why", [
    (scales(1, [("NI_Scale[0]_Scale_Type", "Thermocouple")]), "Thermocouple"), (scales(1, [("NI_Scale[0]_Scale_Type", "RTD")]), "RTD"),
    (scales(1, linear(0, 1.0, 0.0, 0)), "without end"), (scales(4), "no type"), (scales(1, strain(0, 17, ORIGIN)), "bridge 17"), (scales(1, linear(0, 1.0, 0.0)[:2]), "Y_Intercept"),
    (scales(1, table(0, [0.0, 2.0, 1.0], [0.0, 1.0, 2.0], ORIGIN)), "rise or fall"), (scales(1, polynomial(0, [1.0], ORIGIN)[:-1]), "Coefficients"),
])
def test_scalings_that_cannot_be_applied_leave_the_channel_out(tmp_path, dump, properties, why):
    path = tmp_path / "a.tdms"
    path.write_bytes(segment(META | NEW | RAW, [thing("/'G'/'x'", plain(2, 100), properties), thing("/'G'/'y'", plain(2, 100))], bytes(400)))
    answer = dump(path)
    assert [c["name"] for c in answer["groups"][0]["channels"]] == ["y"]
    assert any('"x"' in n and why in n for n in answer["notes"])


def daqmx(values, scalers, widths, e="<", line=False):
    form = e + ("IIIBI" if line else "IIIII")
    return struct.pack(e + "IIIQI", 0x126A if line else 0x1269, 0xFFFFFFFF if not line else 5, 1, values, len(scalers)) + b"".join(struct.pack(form, *s) for s in scalers) + struct.pack(e + f"I{len(widths)}I", len(widths), *widths)


@pytest.mark.parametrize("e", ["<", ">"])
def test_daqmx_scalers(tmp_path, dump, e):
    """Two cards; a channel with two scalers; each type of raw data."""
    path = tmp_path / "a.tdms"
    rng = np.random.default_rng(5)
    widths = [2 + 2 + 4 + 1, 4 + 8]
    flags = META | NEW | RAW | DAQMX | INTERLEAVED | (BIG if e == ">" else 0)
    chain = lambda: scales(2, linear(1, 1e-4, 0.5, 0))
    objects = [
        thing("/'G'/'force'", daqmx(20, [(3, 0, 0, 0, 0)], widths, e), chain(), e),
        thing("/'G'/'unsigned'", daqmx(20, [(2, 0, 2, 0, 0)], widths, e), chain(), e),
        thing("/'G'/'two'", daqmx(20, [(5, 0, 4, 0, 0), (1, 0, 8, 0, 1)], widths, e), scales(3, operation(2, "Subtract", 0, 1)), e),
        thing("/'G'/'other card'", daqmx(12, [(8, 1, 0, 0, 0)], widths, e), scales(2, polynomial(1, [0.0, 2.0, 1.0, 0.0], 0)), e),
        thing("/'G'/'double'", daqmx(12, [(9, 1, 4, 0, 0)], widths, e), scales(2, linear(1, 2.0, 0.0, 0)), e),
    ]

    def card(n, kinds):
        return np.rec.fromarrays([rng.integers(-100, 100, n).astype(k) for k in kinds], dtype=[(str(i), k) for i, k in enumerate(kinds)]).tobytes()
    chunk = lambda: card(20, [e + "i2", e + "u2", e + "i4", "i1"]) + card(12, [e + "f4", e + "f8"])
    raw = segment(flags, objects, chunk() + chunk() + chunk(), e) + segment(RAW | DAQMX | INTERLEAVED | (flags & BIG), None, chunk(), e)
    path.write_bytes(raw)
    equal(dump(path), path)
    for cut in (1, 143, 144, 145, 200, 323):
        path.write_bytes(raw[:-cut])
        answer = dump(path)
        equal(answer, path)
        assert any("not finished" in n for n in answer["notes"])


def test_daqmx_lines_of_a_port(tmp_path, dump):
    path = tmp_path / "a.tdms"
    lines = [thing(f"/'G'/'line {b}'", daqmx(100, [(0, 0, b, 0, 0)], [2], line=True)) for b in (0, 3, 9, 15)]
    path.write_bytes(segment(META | NEW | RAW | DAQMX | INTERLEAVED, lines, np.random.default_rng(6).integers(0, 65536, 300).astype("<u2").tobytes()))
    answer = dump(path)
    equal(answer, path)
    assert answer["notes"] == []


def test_raw_daqmx_data_without_scaling_are_noted(tmp_path, dump):
    path = tmp_path / "a.tdms"
    path.write_bytes(segment(META | NEW | RAW | DAQMX, [thing("/'G'/'x'", daqmx(4, [(3, 0, 0, 0, 0)], [2]))], np.arange(4, dtype="<i2").tobytes()))
    answer = dump(path)
    assert answer["groups"][0]["samples"] == [[0, 1, 2, 3]] and any("raw numbers" in n for n in answer["notes"])


def test_what_is_no_tdms(tmp_path, dump):
    path = tmp_path / "a.tdms"
    good = segment(META | NEW | RAW, [thing("/'G'/'x'", plain(2, 4))], bytes(8))
    for raw, why in [
        (b"TDSh" + good[4:], "index"), (good + b"JUNK" + good[4:], f"byte {len(good)}"), (segment(META | NEW | RAW, [thing("/'G'/'x'", plain(11, 4))], bytes(64)), "DBL"),
        (segment(META | NEW | RAW, [thing("/'G'/'x'", plain(2, 4))], bytes(8), version=4711), "4711"), (segment(RAW, None, bytes(8)), "metadata"), (segment(META | NEW | RAW, [thing("/'G'/'x'", SAME)], bytes(8)), "index"),
        (segment(META | NEW, [thing("/'G'/'x'", NONE)], b""), "no samples"), (segment(META | NEW | RAW, [thing("/'G'/'x'", plain(2, 2**62))], bytes(8)).replace(plain(2, 2**62), plain(4, 2**62)), "more data than any file"),
    ]:
        path.write_bytes(raw)
        assert why in dump(path, error=True)
