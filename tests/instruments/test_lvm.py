"""LabVIEW measurement files, written by hand after the description of National Instruments, as lvm_read reads them and here."""
import lvm_read
import numpy as np
import pytest

RNG = np.random.default_rng(3)


def spell(value, decimal):
    return repr(float(value)).replace(".", decimal)


def lvm(segments, columns="No", separator="\t", decimal=".", multi="Yes", end="\r\n", special=False):
    """A file of segments: dicts of X0, Delta_X, names, units, data (channels x samples), and x where there are columns of it."""
    word = {"\t": "Tab", ",": "Comma"}[separator]
    lines = [f"LabVIEW Measurement{separator}", f"Writer_Version{separator}2", f"Reader_Version{separator}2", f"Separator{separator}{word}", f"Decimal_Separator{separator}{decimal}", f"Multi_Headings{separator}{multi}", f"X_Columns{separator}{columns}", f"Time_Pref{separator}Relative", f"Operator{separator}A. Tester", f"Date{separator}2024/05/01", f"Time{separator}12:00:00.123456", f"***End_of_Header***{separator}", separator]
    if special:
        lines += [f"***Start_Special***{separator}", f"Signal{separator}digital", "0", "***End_Special***", separator]
    for s in segments:
        n = len(s["data"])

        def row(key, values):
            return separator.join([key, *map(str, values)]) + separator

        lines += [row("Channels", [n]), row("Samples", [len(d) for d in s["data"]]), row("Date", ["2024/05/01"] * n), row("Time", ["12:00:00.5"] * n), row("Y_Unit_Label", s["units"]), row("X_Dimension", ["Time"] * n), row("X0", [spell(x, decimal) for x in s["X0"]]), row("Delta_X", [spell(x, decimal) for x in s["Delta_X"]]), row("***End_of_Header***", [""] * n)]
        names = ["X_Value", *s["names"]] if columns != "Multi" else [w for name in s["names"] for w in ("X_Value", name)]
        lines.append(separator.join([*names, "Comment"]))
        for i in range(max(map(len, s["data"]))):
            cells = []
            for c, data in enumerate(s["data"]):
                if columns == "Multi" or columns == "One" and c == 0:
                    cells.append(spell(s["x"][c][i], decimal))
                elif c == 0:
                    cells.append("")
                cells.append(spell(data[i], decimal) if i < len(data) else "")
            lines.append(separator.join(cells + (["a remark"] if i == 1 else [])))
        lines.append("")
    return end.join(lines)


def segment(n=20, start=0.0, step=1e-3, channels=2):
    return {"X0": [start] * channels, "Delta_X": [step] * channels, "names": [f"Channel {i}" for i in range(channels)], "units": ["N", "m/s^2", "V"][:channels], "data": RNG.normal(size=(channels, n)), "x": [start + step * np.arange(n)] * channels}


def numbers(values):
    return np.array([np.nan if v is None else v for v in values], dtype=float)


@pytest.mark.parametrize("separator,decimal", [("\t", "."), ("\t", ","), (",", ".")])
@pytest.mark.parametrize("end", ["\r\n", "\n"])
@pytest.mark.parametrize("multi", ["Yes", "No"])
@pytest.mark.parametrize("columns", ["No", "One"])
def test_a_segment_as_lvm_read_reads_it(dump, tmp_path, separator, decimal, end, multi, columns):
    path = tmp_path / "run.lvm"
    wrote = segment()
    text = lvm([wrote], columns, separator, decimal, multi, end)
    path.write_bytes(text.encode())
    (group,) = dump(path)["groups"]
    reference = lvm_read.read_str(text, separator=separator)[0]
    skip = 1 if columns == "One" else 0
    np.testing.assert_array_equal(np.array([numbers(s) for s in group["samples"]]), reference["data"][:, : 2 + skip].T)
    np.testing.assert_array_equal([numbers(s) for s in group["samples"][skip:]], wrote["data"])
    assert [c["name"] for c in group["channels"]] == reference["Channel names"][: 2 + skip]
    assert [c["unit"] for c in group["channels"]] == ["s"][:skip] + ["N", "m/s^2"]
    assert group["clock"] == ({"start": 0.0, "step": 1e-3} if columns == "No" else None)
    assert ["Operator", "A. Tester"] in group["properties"] and ["Time", "12:00:00.5"] in group["properties"]


def test_segments_that_go_on_are_one_group(dump, tmp_path):
    parts = [segment(20, 0.0), segment(20, 0.02), segment(10, 0.04), segment(10, 7.0)]
    (tmp_path / "run.lvm").write_text(lvm(parts))
    first, second = dump(tmp_path / "run.lvm")["groups"]
    np.testing.assert_array_equal(first["samples"], np.hstack([p["data"] for p in parts[:3]]))
    np.testing.assert_array_equal(second["samples"], parts[3]["data"])
    assert first["clock"] == {"start": 0.0, "step": 1e-3} and second["clock"] == {"start": 7.0, "step": 1e-3}


def test_a_column_of_x_for_every_channel(dump, tmp_path):
    wrote = segment()
    wrote["x"] = [np.sort(RNG.random(20)) for _ in range(2)]
    (tmp_path / "run.lvm").write_text(lvm([wrote], "Multi"))
    groups = dump(tmp_path / "run.lvm")["groups"]
    assert len(groups) == 2
    for c, group in enumerate(groups):
        assert group["channels"] == [{"name": "X_Value", "unit": "s"}, {"name": f"Channel {c}", "unit": wrote["units"][c]}]
        np.testing.assert_array_equal(group["samples"], [wrote["x"][c], wrote["data"][c]])


def test_channels_of_unequal_steps_are_groups(dump, tmp_path):
    wrote = segment(channels=3)
    wrote["Delta_X"] = [1e-3, 2e-3, 1e-3]
    wrote["data"] = [wrote["data"][0], wrote["data"][1][:10], wrote["data"][2]]
    (tmp_path / "run.lvm").write_text(lvm([wrote]))
    fast, slow = dump(tmp_path / "run.lvm")["groups"]
    assert fast["clock"]["step"] == 1e-3 and slow["clock"]["step"] == 2e-3
    np.testing.assert_array_equal(fast["samples"], [wrote["data"][0], wrote["data"][2]])
    np.testing.assert_array_equal(numbers(slow["samples"][0][:10]), wrote["data"][1])


def test_special_segments_are_left_out(dump, tmp_path):
    wrote = segment()
    (tmp_path / "run.lvm").write_text(lvm([wrote], special=True))
    read = dump(tmp_path / "run.lvm")
    np.testing.assert_array_equal(read["groups"][0]["samples"], wrote["data"])
    assert any("special" in note for note in read["notes"])


def test_a_cut_file_gives_what_is_whole(dump, tmp_path):
    wrote = segment(50)
    text = lvm([wrote])
    (tmp_path / "run.lvm").write_bytes(text[: len(text) // 2].encode())
    read = dump(tmp_path / "run.lvm")
    count = read["groups"][0]["length"]
    assert 5 < count < 45 and any("says 50 samples" in note for note in read["notes"])
    np.testing.assert_array_equal(np.array(read["groups"][0]["samples"])[0, : count - 1], wrote["data"][0][: count - 1])


def test_text_between_numbers_is_named(dump, tmp_path):
    text = lvm([segment()]).split("\r\n")
    text[-5] = "\t0.5\toops"
    (tmp_path / "run.lvm").write_text("\r\n".join(text), newline="")
    error = dump(tmp_path / "run.lvm", error=True)
    assert f"line {len(text) - 4}, column 3" in error and "`oops`" in error


def test_no_segment(dump, tmp_path):
    (tmp_path / "run.lvm").write_text("LabVIEW Measurement\t\nWriter_Version\t2\n***End_of_Header***\t\n")
    assert "no samples" in dump(tmp_path / "run.lvm", error=True)
    (tmp_path / "run.lvm").write_text("LabVIEW Measurement\t\nWriter_Version\t2\n")
    assert "does not end" in dump(tmp_path / "run.lvm", error=True)
