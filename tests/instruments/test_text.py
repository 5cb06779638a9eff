"""Texts as numpy, pandas, Python's csv and instruments write them, read back."""
import csv
import datetime
import io

import numpy as np
import pandas as pd
import pytest

RNG = np.random.default_rng(7)
TIME = np.arange(40) * 1e-3
TABLE = np.column_stack([TIME, RNG.normal(size=(40, 2)) * 1e3])
NAMES, UNITS = ["Time", "Force", "Displacement"], ["s", "kN", "mm"]


def numbers(values):
    return np.array([np.nan if v is None else v for v in values], dtype=float)


def only(read):
    assert len(read["groups"]) == 1, [g["name"] for g in read["groups"]]
    return read["groups"][0]


def check(group, names, units, columns):
    assert [c["name"] for c in group["channels"]] == names
    assert [c["unit"] for c in group["channels"]] == units
    assert group["length"] == max(map(len, columns))
    for read, wrote in zip(group["samples"], columns, strict=True):
        np.testing.assert_array_equal(numbers(read), np.asarray(wrote, dtype=float))


def write(path, text, encoding="utf-8"):
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize("delimiter", [",", ";", "\t", "|", " "])
@pytest.mark.parametrize("fmt", ["%.17g", "%.18e"])
def test_numpy_savetxt(dump, tmp_path, delimiter, fmt):
    path = tmp_path / "table.txt"
    np.savetxt(path, TABLE, fmt=fmt, delimiter=delimiter)
    check(only(dump(path)), [""] * 3, [""] * 3, TABLE.T)


def test_numpy_header_in_a_comment(dump, tmp_path):
    path = tmp_path / "table.txt"
    np.savetxt(path, TABLE, fmt="%.17g", header="made by a rig\ntime [s], force [kN], x [mm]", footer="end")
    group = only(dump(path))
    check(group, ["time", "force", "x"], UNITS, TABLE.T)
    assert ["header", "made by a rig"] in group["properties"]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "cp1252"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\r\r\n"])
@pytest.mark.parametrize("sep,decimal", [(",", "."), (";", ","), ("\t", ","), ("\t", "."), (";", "."), ("|", ",")])
def test_pandas(dump, tmp_path, encoding, end, sep, decimal):
    frame = pd.DataFrame(TABLE, columns=["Time [s]", "Kraft (kN)", "Weg / µm"])
    frame.iloc[3, 1] = np.nan
    text = frame.to_csv(sep=sep, decimal=decimal, index=False, lineterminator="\n", float_format="%.17g")
    path = write(tmp_path / "table.csv", text.replace("\n", end), encoding)
    check(only(dump(path)), ["Time", "Kraft", "Weg"], ["s", "kN", "µm"], frame.to_numpy().T)


def test_pandas_index_and_words_for_missing(dump, tmp_path):
    frame = pd.DataFrame({"F [N]": [1.5, np.nan, np.inf, -np.inf, 2.5]}, index=[0.0, 0.1, 0.2, 0.3, 0.4])
    frame.to_csv(tmp_path / "table.csv", na_rep="n/a")
    group = only(dump(tmp_path / "table.csv"))
    assert [c["name"] for c in group["channels"]] == ["", "F"]
    # JSON has no infinity: the dump writes null for it as for what is missing
    np.testing.assert_array_equal(numbers(group["samples"][1]), [1.5, np.nan, np.nan, np.nan, 2.5])


@pytest.mark.parametrize("quoting", [csv.QUOTE_ALL, csv.QUOTE_NONNUMERIC])
def test_python_csv_with_quotes(dump, tmp_path, quoting):
    buffer = io.StringIO()
    writer = csv.writer(buffer, quoting=quoting)
    writer.writerow(['Time, of "day" [s]', "Force [kN]", "Displacement [mm]"])
    writer.writerows(TABLE.tolist())
    check(only(dump(write(tmp_path / "q.csv", buffer.getvalue()))), ['Time, of "day"', "Force", "Displacement"], UNITS, TABLE.T)


def test_quoted_decimal_commas_and_thousands(dump, tmp_path):
    text = '"t","F"\n"0,5","1.234,5"\n"1,5","2.000"\n"2,5","12,25"\n'
    check(only(dump(write(tmp_path / "q.csv", text))), ["t", "F"], ["", ""], [[0.5, 1.5, 2.5], [1234.5, 2000, 12.25]])


def test_a_lone_separator_of_thousands_is_not_guessed(dump, tmp_path):
    error = dump(write(tmp_path / "q.csv", "t;F\n0,5;1,5\n1,5;2,5\n2,5;3,5\n3,5;1.234\n4,5;1,5\n"), error=True)
    assert "line 5, column 2" in error and "`1.234`" in error


def test_thousands_with_points_for_decimals(dump, tmp_path):
    text = "t\tF\n0.5\t1,234.5\n1.5\t1,000\n2.5\t-12,345,678.25\n"
    check(only(dump(write(tmp_path / "q.txt", text))), ["t", "F"], ["", ""], [[0.5, 1.5, 2.5], [1234.5, 1000, -12345678.25]])


@pytest.mark.parametrize("units", ["s;kN;mm", "[s];[kN];[mm]", "(s);(kN);(mm)"])
def test_header_names_units(dump, tmp_path, units):
    rows = "\r\n".join(";".join(repr(v).replace(".", ",") for v in row) for row in TABLE.tolist())
    text = f"Device: DAQ 9000\r\nDate;2024-05-01\r\nSampling rate = 1000 Hz\r\nA line of prose\r\n\r\n{';'.join(NAMES)}\r\n{units}\r\n{rows}\r\n"
    group = only(dump(write(tmp_path / "h.csv", text)))
    check(group, NAMES, UNITS, TABLE.T)
    for expected in (["Device", "DAQ 9000"], ["Date", "2024-05-01"], ["Sampling rate", "1000 Hz"], ["header", "A line of prose"]):
        assert expected in group["properties"]
    assert group["clock"] is None


def test_a_header_of_any_length(dump, tmp_path):
    header = "".join(f"Channel {i} gain: {i}.5\n" for i in range(1500))
    group = only(dump(write(tmp_path / "h.csv", header + "Time [s],Force [kN]\n0,1\n1,2\n2,3\n")))
    check(group, ["Time", "Force"], ["s", "kN"], [[0, 1, 2], [1, 2, 3]])
    assert len(group["properties"]) == 1000


def test_the_clock_of_a_header_without_a_column_of_time(dump, tmp_path):
    group = only(dump(write(tmp_path / "h.csv", "Sample rate [kHz]: 20\nF [kN];x [mm]\n1;2\n3;4\n5;6\n")))
    assert group["clock"] == {"start": 0.0, "step": 1 / 20e3}


def test_sep_line_and_trailing_delimiter(dump, tmp_path):
    for first in ("sep=;", '"sep=;"', "SEP=;"):
        check(only(dump(write(tmp_path / "s.csv", f"{first}\r\nt [s];F [N];\r\n0;1,5;\r\n1;2,5;\r\n"))), ["t", "F"], ["s", "N"], [[0, 1], [1.5, 2.5]])


def test_comments_exponents_and_missing(dump, tmp_path):
    text = "% a comment\n// another\n; a third\nt,F\n0,1.5D+03\n# in between\n1,-\n2,NaN\n3,\n4,1.5d-1\n"
    check(only(dump(write(tmp_path / "c.csv", text))), ["t", "F"], ["", ""], [range(5), [1500, np.nan, np.nan, np.nan, 0.15]])


def test_one_column_with_decimal_commas(dump, tmp_path):
    check(only(dump(write(tmp_path / "a.txt", "Force [kN]\n1,5\n-2,25\n3,5\n"))), ["Force"], ["kN"], [[1.5, -2.25, 3.5]])
    check(only(dump(write(tmp_path / "b.txt", "1,50\n2,05\n3,50\n"))), [""], [""], [[1.5, 2.05, 3.5]])


def test_a_decimal_separator_that_comes_late(dump, tmp_path):
    rows = "".join(f"{i};0\n" for i in range(2000))
    group = only(dump(write(tmp_path / "late.csv", "t;F\n" + rows + "2000;0,5\n")))
    assert group["samples"][1][-1] == 0.5 and group["length"] == 2001


def test_blocks(dump, tmp_path):
    text = "Run: 1\nTime [s];F [kN]\n0;1\n1;2\n2;3\n\nRun: 2\nTime [s];F [kN];x [mm]\n0;5,5;1\n1;7;2\n\nTime [s];F [kN]\n9;9\n"
    first, second, third = dump(write(tmp_path / "b.csv", text))["groups"]
    check(first, ["Time", "F"], ["s", "kN"], [[0, 1, 2], [1, 2, 3]])
    check(second, ["Time", "F", "x"], ["s", "kN", "mm"], [[0, 1], [5.5, 7], [1, 2]])
    check(third, ["Time", "F"], ["s", "kN"], [[9], [9]])
    assert ["Run", "1"] in first["properties"] and ["Run", "2"] in second["properties"]


def test_many_blocks(dump, tmp_path):
    block = "Time [s],F [kN]\n" + "".join(f"{i},{i}.5\n" for i in range(100)) + "\n"
    read = dump(write(tmp_path / "b.csv", block * 300))
    assert [g["length"] for g in read["groups"]] == [100] * 300 and read["notes"] == []


def test_recordings_of_unequal_length_in_columns(dump, tmp_path):
    text = "t1 [s],F1 [N],t2 [s],F2 [N]\n0,1,0,5\n1,2,1,6\n2,3,,\n3,4,,\n"
    nan = np.nan
    check(only(dump(write(tmp_path / "c.csv", text))), ["t1", "F1", "t2", "F2"], ["s", "N"] * 2, [range(4), [1, 2, 3, 4], [0, 1, nan, nan], [5, 6, nan, nan]])


def test_text_columns_are_left_out(dump, tmp_path):
    text = "Time [s],Event,F [N]\n0,start,1\n1,,2\n2,,3\n3,stop,4\n"
    read = dump(write(tmp_path / "e.csv", text))
    check(only(read), ["Time", "F"], ["s", "N"], [range(4), [1, 2, 3, 4]])
    assert any("Event" in note for note in read["notes"])


STAMPS = ["%Y-%m-%d %H:%M:%S.%f", "%Y-%m-%dT%H:%M:%S.%f", "%Y/%m/%d %H:%M:%S.%f", "%d.%m.%Y %H:%M:%S,%f", "%m/%d/%Y %H:%M:%S.%f", "%d-%b-%Y %H:%M:%S.%f", "%H:%M:%S.%f", "%H:%M:%S,%f", "%m/%d/%Y %I:%M:%S.%f %p"]


@pytest.mark.parametrize("form", STAMPS)
def test_stamps(dump, tmp_path, form):
    start = datetime.datetime(2024, 2, 29, 23, 59, 58, 250000)
    times = [start + datetime.timedelta(milliseconds=125 * i) for i in range(40)]
    text = "Stamp;F [N]\n" + "".join(f"{t.strftime(form)};{i},5\n" for i, t in enumerate(times))
    check(only(dump(write(tmp_path / "s.csv", text))), ["Stamp", "F"], ["s", "N"], [np.arange(40) / 8, np.arange(40) + 0.5])


def test_date_and_time_between_spaces(dump, tmp_path):
    text = "".join(f"2024-05-01 12:00:{i:02}.5 {i}.25\n" for i in range(10))
    check(only(dump(write(tmp_path / "s.txt", text))), ["", ""], ["s", ""], [range(10), np.arange(10) + 0.25])


def test_tektronix_tds(dump, tmp_path):
    labels = [("Record Length", "2.500000e+03"), ("Sample Interval", "4.0e-06"), ("Trigger Point", "1.25e+03"), ("", ""), ("", ""), ("", ""), ("Source", "CH1"), ("Vertical Units", "V"), ("Vertical Scale", "5.0e-01"), ("Horizontal Units", "s"), ("Horizontal Scale", "1e-3"), ("Pt Fmt", "Y"), ("Model Number", "TDS2014")]
    labels += [("", "")] * (40 - len(labels))
    text = "".join(f"{a},{b},,{t!r},{v!r},\r\n" for (a, b), (t, v) in zip(labels, TABLE[:, :2].tolist()))
    group = only(dump(write(tmp_path / "F0000CH1.CSV", text)))
    check(group, ["", "CH1"], ["s", "V"], TABLE[:, :2].T)
    assert ["Model Number", "TDS2014"] in group["properties"] and ["Sample Interval", "4.0e-06"] in group["properties"]


def test_tektronix_mdo(dump, tmp_path):
    head = "Model,MDO3024\nFirmware Version,1.26\n\nWaveform Type,ANALOG\nPoint Format,Y\nHorizontal Units,s\nHorizontal Scale,4e-06\nSample Interval,4e-09\nRecord Length,10000\nGating,0.0% to 100.0%\nProbe Attenuation,10,10\nVertical Units,V,A\nVertical Offset,0,0\nVertical Scale,1,1\nVertical Position,0,0\n,,\n,,\nLabel,,\nTIME,CH1,CH2\n"
    text = head + "".join(",".join(map(repr, row)) + "\n" for row in TABLE.tolist())
    check(only(dump(write(tmp_path / "tek0000ALL.csv", text))), ["TIME", "CH1", "CH2"], ["s", "V", "A"], TABLE.T)


def test_rigol(dump, tmp_path):
    rows = "".join(f"{i},{v!r},,\n" for i, v in enumerate(TABLE[:, 1].tolist()))
    group = only(dump(write(tmp_path / "NewFile1.csv", f"X,CH1,Start,Increment,\nSequence,Volt,-6.0e-04,1.0e-06,\n{rows}")))
    check(group, ["X", "CH1"], ["Sequence", "Volt"], [range(40), TABLE[:, 1]])
    assert group["clock"] == {"start": -6e-4, "step": 1e-6}
    rows = "".join(f"{v!r},,\n" for v in TABLE[:, 1].tolist())
    read = dump(write(tmp_path / "RigolDS0.csv", f"CH1V,t0 = -6.0e-04s,tInc = 1.0e-06,\n{rows}"))
    assert only(read)["clock"] == {"start": -6e-4, "step": 1e-6} and read["notes"] == []


def test_keysight(dump, tmp_path):
    rows = "".join(f"{t:+.8E},{a:+.8E},{b:+.8E}\n" for t, a, b in TABLE)
    columns = [[float(f"{v:+.8E}") for v in c] for c in TABLE.T]
    check(only(dump(write(tmp_path / "scope_0.csv", "x-axis,1,2\nsecond,Volt,Volt\n" + rows))), ["x-axis", "1", "2"], ["second", "Volt", "Volt"], columns)


def test_picoscope(dump, tmp_path):
    text = "Time,Channel A,Channel B\r\n(ms),(V),(mV)\r\n\r\n-5.00000000,0.10000000,\u221e\r\n-4.00000000,0.20000000,1.5\r\n-3.00000000,0.30000000,-\u221e\r\n"
    check(only(dump(write(tmp_path / "p.csv", text))), ["Time", "Channel A", "Channel B"], ["ms", "V", "mV"], [[-5, -4, -3], [0.1, 0.2, 0.3], [np.nan, 1.5, np.nan]])
    text = "Zeit;Kanal A\r\n(us);(V)\r\n\r\n-5,00000000;0,10000000\r\n-4,00000000;0,20000000\r\n"
    check(only(dump(write(tmp_path / "p.csv", text))), ["Zeit", "Kanal A"], ["us", "V"], [[-5, -4], [0.1, 0.2]])


def test_lecroy(dump, tmp_path):
    text = "LECROYWR64Xi,50000,Waveform\nSegments,1,SegmentSize,5\nSegment,TrigTime,TimeSinceSegment1\n#1,01-Jan-2024 12:00:00,0\nTime,Ampl\n" + "".join(f"{i}e-06,0.{i}\n" for i in range(5))
    check(only(dump(write(tmp_path / "C1Trace.csv", text))), ["Time", "Ampl"], ["", ""], [[float(f"{i}e-06") for i in range(5)], [i / 10 for i in range(5)]])


def test_yokogawa(dump, tmp_path):
    text = '"Header Size",10\n"Model Name","DL850"\n"BlockNumber",1\n"TraceName","Force","Gap"\n"BlockSize",3,3\n"VUnit","N","V"\n"SampleRate",2000.0,2000.0\n"HUnit","s","s"\n\n,1.0,2\n,1.1,3\n,1.2,4\n'
    group = only(dump(write(tmp_path / "y.csv", text)))
    check(group, ["Force", "Gap"], ["N", "V"], [[1.0, 1.1, 1.2], [2, 3, 4]])
    assert group["clock"] == {"start": 0.0, "step": 5e-4}


@pytest.mark.parametrize("text,place", [
    ("t,F\n0,1\n1,2\n2,3\n3,abc\n4,5\n", "line 5, column 2"),
    ("t,F\n0,1\n1,x\n2,3\n3,4\n4,5\n5,6\n", "line 3, column 2"),
    ("t,F\n0,1\n1,2\n2,3\n3,4,5\n4,5\n", "line 5, column 3"),
    ("1\n2\n3\nfour\n5\n", "line 4, column 1"),
])
def test_text_between_numbers(dump, tmp_path, text, place):
    error = dump(write(tmp_path / "bad.csv", text), error=True)
    assert place in error and "bad.csv" in error


def test_no_table(dump, tmp_path):
    assert "no table" in dump(write(tmp_path / "prose.txt", "A text.\nAnother line of it.\n"), error=True)
    assert "empty" in dump(write(tmp_path / "none.txt", ""), error=True)
    assert "no table" in dump(write(tmp_path / "head.csv", "Time [s],Force [kN]\n"), error=True)


def test_a_cut_last_line(dump, tmp_path):
    whole = "t,F\n" + "".join(f"{i}.000,{i}.250\n" for i in range(10))
    for cut in ("10.000", "10.0", "10.000,10.2", "10.000,-", "10.000,1e"):
        read = dump(write(tmp_path / "cut.csv", whole + cut))
        check(only(read), ["t", "F"], ["", ""], [range(10), np.arange(10) + 0.25])
        assert any("line 12" in note and "cut" in note for note in read["notes"])
    assert only(dump(write(tmp_path / "cut.csv", whole + "10.000,10.250")))["length"] == 11
    read = dump(write(tmp_path / "cut.csv", whole + "\0" * 5000))
    assert only(read)["length"] == 10 and any("zeros" in note for note in read["notes"])


def test_a_footer(dump, tmp_path):
    for footer in ("End of file\n", "\nMax;9,5\nMin;0,5\n", "\nRecorded by;X\n"):
        read = dump(write(tmp_path / "f.csv", "t;F\n" + "".join(f"{i};{i},5\n" for i in range(10)) + footer))
        check(only(read), ["t", "F"], ["", ""], [range(10), np.arange(10) + 0.5])
        assert any("follows the table" in note for note in read["notes"])
