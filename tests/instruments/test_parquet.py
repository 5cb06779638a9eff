"""Parquet files as pyarrow and pandas write them."""
import datetime as dt
import decimal
import math

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

N = 150_000  # more than two blocks


def one(result):
    assert len(result["groups"]) == 1
    return result["groups"][0]


def channels(group):
    return {c["name"]: (c["unit"], s) for c, s in zip(group["channels"], group["samples"])}


@pytest.mark.parametrize("compression", ["none", "snappy", "gzip", "zstd", "lz4", "brotli"])
@pytest.mark.parametrize("how", [{}, {"use_dictionary": False, "data_page_version": "2.0"}, {"row_group_size": 7000}, {"use_dictionary": False, "column_encoding": {"t": "BYTE_STREAM_SPLIT", "n": "DELTA_BINARY_PACKED"}}], ids=str)
def test_compressions_and_pages(dump, tmp_path, compression, how):
    t, n = np.arange(N) * 1e-3, np.arange(N) % 1000 - 500
    pq.write_table(pa.table({"t": t, "n": n}), tmp_path / "a.parquet", compression=compression, **how)
    group = one(dump(tmp_path / "a.parquet"))
    assert group["length"] == N and channels(group) == {"t": ("", t.tolist()), "n": ("", n.tolist())}


@pytest.mark.parametrize("kind", ["int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float16", "float32", "float64", "bool_"])
def test_types_and_missing_values(dump, tmp_path, kind):
    of = getattr(pa, kind)()
    if "int" in kind:
        info = np.iinfo(kind)
        values = [int(info.min), None, int(info.max), 7, 0]
    else:
        values = [True, None, False] if kind == "bool_" else [0.5, None, -2.25, math.nan]
    pq.write_table(pa.table({"x": pa.array(values, of), "y": pa.array(values, of)}), tmp_path / "a.parquet")
    want = [None if v is None or v != v else float(v) for v in values]
    assert channels(one(dump(tmp_path / "a.parquet"))) == {"x": ("", want), "y": ("", want)}


@pytest.mark.parametrize("digits", [5, 12, 30])
def test_decimals(dump, tmp_path, digits):
    values = [decimal.Decimal("123.45"), decimal.Decimal("-0.01"), None, decimal.Decimal("999.99")]
    for integers in (False, True):
        pq.write_table(pa.table({"x": pa.array(values, pa.decimal128(digits, 2))}), tmp_path / "a.parquet", store_decimal_as_integer=integers)
        assert channels(one(dump(tmp_path / "a.parquet")))["x"][1] == [123.45, -0.01, None, 999.99]


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
def test_times_count_from_the_first(dump, tmp_path, unit):
    per = {"s": 1, "ms": 10**3, "us": 10**6, "ns": 10**9}[unit]
    start = 1_710_237_600 * per  # 2024-03-12T10:00:00
    ticks = [start, start + 1, None, start + 5 * per]
    table = {"stamp": pa.array(ticks, pa.timestamp(unit)), "zoned": pa.array(ticks, pa.timestamp(unit, "Europe/Berlin")), "lasting": pa.array([0, 3, None, per], pa.duration(unit))}
    if unit in ("s", "ms"):
        table["clock"] = pa.array([36000 * per, 36000 * per + 2, None, 36001 * per], pa.time32(unit))
    else:
        table["clock"] = pa.array([36000 * per, 36000 * per + 2, None, 36001 * per], pa.time64(unit))
    pq.write_table(pa.table(table), tmp_path / "a.parquet")
    group = one(dump(tmp_path / "a.parquet"))
    got = channels(group)
    assert got["stamp"] == ("s", [0, 1 / per, None, 5]) == got["zoned"] and got["clock"] == ("s", [0, 2 / per, None, 1])
    assert got["lasting"] == ("s", [0, 3 / per, None, 1])
    assert dict(map(tuple, group["properties"]))["stamp.first"] == "2024-03-12T10:00:00"


def test_dates_and_old_timestamps(dump, tmp_path):
    days = [dt.date(2024, 3, 12), dt.date(2024, 3, 13)]
    stamps = [dt.datetime(2024, 3, 12, 10), dt.datetime(2024, 3, 12, 10, 0, 0, 250_000)]
    pq.write_table(pa.table({"day": days, "stamp": stamps}), tmp_path / "a.parquet", use_deprecated_int96_timestamps=True)
    group = one(dump(tmp_path / "a.parquet"))
    assert channels(group) == {"day": ("s", [0, 86400]), "stamp": ("s", [0, 0.25])}
    properties = dict(map(tuple, group["properties"]))
    assert properties["day.first"] == "2024-03-12T00:00:00" and properties["stamp.first"] == "2024-03-12T10:00:00"


def test_units_properties_and_what_is_left_out(dump, tmp_path):
    schema = pa.schema([
        pa.field("F", pa.float64(), metadata={"unit": "kN", "sensor": "9331B"}), pa.field("a", pa.float32(), metadata={"Units": "m/s²"}),
        pa.field("text", pa.string()), pa.field("list", pa.list_(pa.float64())), pa.field("in", pa.struct([("x", pa.float64())])),
    ], metadata={"instrument": "DAQ 7"})
    rows = {"F": [1.0, 2.0], "a": [3.0, 4.0], "text": ["a", "b"], "list": [[1.0], [2.0]], "in": [{"x": 5.0}, None]}
    pq.write_table(pa.table(rows, schema=schema), tmp_path / "a.parquet")
    result = dump(tmp_path / "a.parquet")
    assert channels(one(result)) == {"F": ("kN", [1, 2]), "a": ("m/s²", [3, 4]), "in.x": ("", [5, None])}
    assert ["instrument", "DAQ 7"] in one(result)["properties"]
    assert len(result["notes"]) == 2 and '"text"' in result["notes"][0] and "list" in result["notes"][1]


def test_written_by_pandas(dump, tmp_path):
    frame = pd.DataFrame({"t": np.arange(100) / 10, "F": np.sin(np.arange(100))}, index=pd.date_range("2024-03-12 10:00", periods=100, freq="10ms", name="stamp"))
    frame.to_parquet(tmp_path / "a.parquet")
    got = channels(one(dump(tmp_path / "a.parquet")))
    assert got["F"][1] == frame["F"].tolist() and got["t"][1] == frame["t"].tolist()
    assert np.allclose(got["stamp"][1], np.arange(100) / 100, atol=1e-12) and got["stamp"][0] == "s"


def test_an_empty_table(dump, tmp_path):
    pq.write_table(pa.table({"x": pa.array([], pa.float64()), "stamp": pa.array([], pa.timestamp("ms"))}), tmp_path / "a.parquet")
    assert channels(one(dump(tmp_path / "a.parquet"))) == {"x": ("", []), "stamp": ("s", [])}


def test_bad_files_are_refused(dump, tmp_path):
    pq.write_table(pa.table({"x": np.arange(1000.0)}), tmp_path / "a.parquet")
    data = (tmp_path / "a.parquet").read_bytes()
    (tmp_path / "b.parquet").write_bytes(data[: len(data) // 2])
    assert "b.parquet" in dump(tmp_path / "b.parquet", error=True)
    pq.write_table(pa.table({"x": ["a", "b"]}), tmp_path / "a.parquet")
    assert "no channels" in dump(tmp_path / "a.parquet", error=True)
