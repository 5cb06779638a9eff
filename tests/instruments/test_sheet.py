"""Spreadsheets as openpyxl, odfpy, xlwt and pandas write them."""
import datetime as dt
import io
import struct
import zipfile

import numpy as np
import openpyxl
import pandas as pd
import pytest
import xlwt
from odf.opendocument import OpenDocumentSpreadsheet
from odf.table import CoveredTableCell, Table, TableCell, TableRow
from odf.text import P

START = dt.datetime(2024, 3, 12, 10)


class Error(str):
    """An error cell."""


def xlsx(path, sheets):
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, rows in sheets.items():
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(path)


def xls(path, sheets):
    book = xlwt.Workbook()
    styles = {kind: xlwt.easyxf(num_format_str=text) for kind, text in [(dt.datetime, "yyyy-mm-dd hh:mm:ss.000"), (dt.time, "hh:mm:ss")]}
    for name, rows in sheets.items():
        sheet = book.add_sheet(name)
        for r, row in enumerate(rows):
            for c, value in enumerate(row):
                if isinstance(value, Error):
                    sheet.row(r).set_cell_error(c, str(value))
                elif isinstance(value, dt.datetime):  # xlwt drops fractions of seconds
                    sheet.write(r, c, (value - dt.datetime(1899, 12, 30)) / dt.timedelta(days=1), styles[dt.datetime])
                elif value is not None:
                    sheet.write(r, c, value, *filter(None, [styles.get(type(value))]))
    book.save(str(path))


def ods(path, sheets):
    book = OpenDocumentSpreadsheet()
    for name, rows in sheets.items():
        table = Table(name=name)
        for row in rows:
            line = TableRow()
            for value in row:
                if isinstance(value, Error):
                    cell = TableCell(valuetype="float", value="0")
                    cell.addElement(P(text=value))
                elif isinstance(value, dt.datetime):
                    cell = TableCell(valuetype="date", datevalue=value.isoformat())
                elif isinstance(value, dt.time):
                    cell = TableCell(valuetype="time", timevalue=f"PT{value.hour}H{value.minute}M{value.second + value.microsecond / 1e6}S")
                elif isinstance(value, bool):
                    cell = TableCell(valuetype="boolean", booleanvalue=str(value).lower())
                elif isinstance(value, (int, float)):
                    cell = TableCell(valuetype="float", value=repr(value))
                elif value is None:
                    cell = TableCell()
                else:
                    cell = TableCell(valuetype="string")
                    cell.addElement(P(text=value))
                line.addElement(cell)
            table.addElement(line)
        book.spreadsheet.addElement(table)
    book.save(str(path))


def xlsb(path, sheets):
    """Binary workbooks by hand (MS-XLSB): texts, numbers, booleans and errors; no library writes them."""
    def record(kind, data=b""):
        head = bytes([kind]) if kind < 128 else bytes([kind & 0x7F | 0x80, kind >> 7])
        length, size = b"", len(data)
        while True:
            length += bytes([size & 0x7F | (0x80 if size > 127 else 0)])
            size >>= 7
            if not size:
                return head + length + data

    def wide(text):
        return struct.pack("<I", len(text)) + text.encode("utf-16-le")

    relations = '<?xml version="1.0"?><Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">{}</Relationships>'
    to = '<Relationship Id="rId{0}" Type="http://schemas.openxmlformats.org/officeDocument/2006/relationships/{1}" Target="{2}"/>'
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as z:
        z.writestr("[Content_Types].xml", '<?xml version="1.0"?><Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types"/>')
        z.writestr("_rels/.rels", relations.format(to.format(1, "officeDocument", "xl/workbook.bin")))
        z.writestr("xl/_rels/workbook.bin.rels", relations.format("".join(to.format(i + 1, "worksheet", f"worksheets/sheet{i + 1}.bin") for i in range(len(sheets)))))
        names = b"".join(record(0x9C, struct.pack("<II", 0, i + 1) + wide(f"rId{i + 1}") + wide(name)) for i, name in enumerate(sheets))
        z.writestr("xl/workbook.bin", record(0x83) + record(0x99, struct.pack("<III", 0, 0, 0)) + record(0x8F) + names + record(0x90) + record(0x84))
        for i, rows in enumerate(sheets.values()):
            out = record(0x81) + record(0x94, struct.pack("<IIII", 0, len(rows), 0, 10)) + record(0x91)
            for r, row in enumerate(rows):
                out += record(0x00, struct.pack("<I", r) + bytes(21))
                for c, value in enumerate(row):
                    at = struct.pack("<II", c, 0)
                    if isinstance(value, Error):
                        out += record(0x03, at + b"\x07")
                    elif isinstance(value, bool):
                        out += record(0x04, at + bytes([value]))
                    elif isinstance(value, (int, float)):
                        out += record(0x05, at + struct.pack("<d", value))
                    elif value is not None:
                        out += record(0x06, at + wide(value))
            z.writestr(f"xl/worksheets/sheet{i + 1}.bin", out + record(0x92) + record(0x82))


KINDS = {"xlsx": xlsx, "xls": xls, "ods": ods, "xlsb": xlsb}
ALL, DATED = sorted(KINDS), ["ods", "xls", "xlsx"]


def channels(group):
    return [(c["name"], c["unit"], s) for c, s in zip(group["channels"], group["samples"])]


@pytest.mark.parametrize("kind", ALL)
def test_names_units_and_lines_above(dump, tmp_path, kind):
    rows = [["Drop test 7"], ["Operator", "Müller"], ["Rate", 1000, "Hz"], [], ["Time", "Force", "Remark", "a [m/s²]"], ["s", "kN", None, None]]
    rows += [[i / 1000, round(float(np.sin(i)), 9), "ok", i * 2] for i in range(3000)]
    KINDS[kind](tmp_path / f"a.{kind}", {"Drop 1": rows, "Words": [["only"], ["text"]], "Second": [[1, 2], [3, 4]]})
    result = dump(tmp_path / f"a.{kind}")
    first, second = result["groups"]
    assert first["name"] == "Drop 1" and first["length"] == 3000
    assert channels(first) == [("Time", "s", [i / 1000 for i in range(3000)]), ("Force", "kN", [round(float(np.sin(i)), 9) for i in range(3000)]), ("a", "m/s²", [i * 2 for i in range(3000)])]
    assert first["properties"][:3] == [["header", "Drop test 7"], ["Operator", "Müller"], ["Rate", "1000 Hz"]]
    assert second["name"] == "Second" and channels(second) == [("", "", [1, 3]), ("", "", [2, 4])]
    assert any('"Remark"' in n and "cell C7" in n for n in result["notes"])


@pytest.mark.parametrize("kind", ALL)
def test_missing_cells_errors_and_tables_side_by_side(dump, tmp_path, kind):
    error = Error("#DIV/0!")
    rows = [["t", "x", None, "t2", "y"], [0, 1, None, 0, True], [1, None, None, 2, False], [2, error, None, None, None], [3, "lost", None, None, None], [4, 5.5, None, None, None]]
    KINDS[kind](tmp_path / f"a.{kind}", {"Sheet": rows})
    result = dump(tmp_path / f"a.{kind}")
    (group,) = result["groups"]
    assert channels(group) == [("t", "", [0, 1, 2, 3, 4]), ("x", "", [1, None, None, None, 5.5]), ("t2", "", [0, 2, None, None, None]), ("y", "", [1, 0, None, None, None])]
    assert [n for n in result["notes"] if "cell B4" in n and "#DIV/0!" in n and "1 further" in n]


@pytest.mark.parametrize("kind", ALL)
def test_numbers_written_as_text_with_a_decimal_comma(dump, tmp_path, kind):
    rows = [["Kraftmessung"], ["Abtastrate", "2", "kHz"], ["Nr.", "Kraft [kN]", "Uhr"]] + [[i, f"{1000 + i}.{i:03}".replace(".", ","), f"12:00:0{i % 10},5"] for i in range(10)]
    rows += [[10, "1.234,5", "12:00:10,25"], [11, "n/a", "12:00:11"], [12, "defekt", None]]
    KINDS[kind](tmp_path / f"a.{kind}", {"S": rows})
    result = dump(tmp_path / f"a.{kind}")
    (group,) = result["groups"]
    assert channels(group)[:2] == [("Nr.", "", list(range(13))), ("Kraft", "kN", [float(f"{1000 + i}.{i:03}") for i in range(10)] + [1234.5, None, None])]
    assert channels(group)[2] == ("Uhr", "s", [*range(10), 9.75, 10.5, None])
    assert any("cell B16" in n and "`defekt`" in n for n in result["notes"]) and ["Abtastrate", "2 kHz"] in group["properties"]


@pytest.mark.parametrize("kind", ALL)
def test_steps_of_time_above_a_table(dump, tmp_path, kind):
    KINDS[kind](tmp_path / f"a.{kind}", {"S": [["Sample rate", "51,2", "kHz"], [], ["kN"], ["Force"]] + [[i] for i in range(9)]})
    (group,) = dump(tmp_path / f"a.{kind}")["groups"]
    assert channels(group) == [("Force", "kN", list(range(9)))] and group["clock"] == {"start": 0, "step": 1 / 51200}


@pytest.mark.parametrize("kind", DATED)
def test_dates_and_times_count_from_the_first(dump, tmp_path, kind):
    steps = range(0, 2000, 250)
    rows = [["When", "Clock", "x"]] + [[START + dt.timedelta(milliseconds=ms), (START + dt.timedelta(seconds=ms)).time(), ms] for ms in steps]
    KINDS[kind](tmp_path / f"a.{kind}", {"Sheet": rows})
    (group,) = dump(tmp_path / f"a.{kind}")["groups"]
    (when, unit, stamps), (clock, clock_unit, times), _ = channels(group)
    assert (when, unit, clock, clock_unit) == ("When", "s", "Clock", "s")
    assert np.allclose(stamps, [ms / 1000 for ms in steps], atol=2e-6) and np.allclose(times, list(steps), atol=1e-6)
    assert ["When.first", "2024-03-12T10:00:00"] in group["properties"]


def test_the_calendar_of_1904(dump, tmp_path):
    book = openpyxl.Workbook()
    book.epoch = openpyxl.utils.datetime.CALENDAR_MAC_1904
    for row in [["When", "x"], [START, 1], [START + dt.timedelta(seconds=2), 2]]:
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    (group,) = dump(tmp_path / "a.xlsx")["groups"]
    assert np.allclose(group["samples"][0], [0, 2], atol=2e-6) and ["When.first", "2024-03-12T10:00:00"] in group["properties"]


def test_values_of_formulas_and_document_properties(dump, tmp_path):
    xlsx(tmp_path / "a.xlsx", {"Sheet": [["x", "double"], [1, "=A2*2"], [2, "=A3*2"]]})
    with zipfile.ZipFile(tmp_path / "a.xlsx") as z:
        parts = {n: z.read(n) for n in z.namelist()}
    text = parts["xl/worksheets/sheet1.xml"].decode()
    for n in (2, 3):
        assert f"<f>A{n}*2</f><v" in text
        text = text.replace(f"<f>A{n}*2</f><v/>", f"<f>A{n}*2</f><v>{(n - 1) * 2}</v>").replace(f"<f>A{n}*2</f><v></v>", f"<f>A{n}*2</f><v>{(n - 1) * 2}</v>")
    parts["xl/worksheets/sheet1.xml"] = text.encode()
    with zipfile.ZipFile(tmp_path / "b.xlsx", "w", zipfile.ZIP_DEFLATED) as z:
        for name, data in parts.items():
            z.writestr(name, data)
    (group,) = dump(tmp_path / "b.xlsx")["groups"]
    assert channels(group) == [("x", "", [1, 2]), ("double", "", [2, 4])] and ["creator", "openpyxl"] in group["properties"]


@pytest.mark.parametrize("engine,kind", [("openpyxl", "xlsx"), ("odf", "ods")])
def test_written_by_pandas(dump, tmp_path, engine, kind):
    frame = pd.DataFrame({"t": np.arange(500) / 10, "F": np.sin(np.arange(500))})
    frame.to_excel(tmp_path / f"a.{kind}", engine=engine, index=False, startrow=3, startcol=2)
    (group,) = dump(tmp_path / f"a.{kind}")["groups"]
    assert [c["name"] for c in group["channels"]] == ["t", "F"]
    assert np.allclose(group["samples"], frame.T, rtol=1e-15, atol=0)  # openpyxl writes 16 digits


def test_repeated_cells_and_rows_of_ods(dump, tmp_path):
    book = OpenDocumentSpreadsheet()
    table = Table(name="Sheet")

    def row(*cells, **how):
        line = TableRow(**how)
        for cell in cells:
            line.addElement(cell)
        table.addElement(line)

    names = [TableCell(valuetype="string") for _ in "nmk"]
    for cell, name in zip(names, "nmk"):
        cell.addElement(P(text=name))
    row(TableCell(numbercolumnsrepeated=2), *names)
    row(TableCell(numbercolumnsrepeated=2), TableCell(valuetype="float", value="1", numbercolumnsrepeated=3), numberrowsrepeated=4)
    row(CoveredTableCell(), TableCell(), TableCell(valuetype="percentage", value="0.5"), TableCell(valuetype="currency", value="2"), TableCell(valuetype="float", value="3"))
    row(TableCell(numbercolumnsrepeated=16384), numberrowsrepeated=1048570)
    book.spreadsheet.addElement(table)
    book.save(str(tmp_path / "a.ods"))
    (group,) = dump(tmp_path / "a.ods")["groups"]
    assert channels(group) == [("n", "", [1] * 4 + [0.5]), ("m", "", [1] * 4 + [2]), ("k", "", [1] * 4 + [3])]


def zipped(parts, compression=zipfile.ZIP_DEFLATED):
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", compression) as z:
        for name, data in parts.items():
            z.writestr(name, data)
    return out.getvalue()


def test_bombs_and_damage_are_refused(dump, tmp_path):
    head = '<office:document-content xmlns:office="o" xmlns:table="t" xmlns:text="x"><office:body><office:spreadsheet><table:table table:name="S">'
    row = '<table:table-row{}><table:table-cell office:value-type="float" office:value="{}"{}/></table:table-row>'
    tail = "</table:table></office:spreadsheet></office:body></office:document-content>"
    bad = {
        "many.ods": head + row.format(' table:number-rows-repeated="1048576"', 1, ' table:number-columns-repeated="16384"') + tail,
        "endless.ods": head + row.format(' table:number-rows-repeated="99999999999999999999999"', 1, "") + tail,
        "cut.ods": head + row.format("", 1, ""),
        "word.ods": head + row.format("", "seven", "") + tail,
    }
    want = {"many.ods": "few cells are repeated very often", "endless.ods": "no count", "cut.ods": "ends within an element", "word.ods": "`seven` is no number"}
    for name, content in bad.items():
        (tmp_path / name).write_bytes(zipped({"mimetype": "application/vnd.oasis.opendocument.spreadsheet", "content.xml": content}))
        text = dump(tmp_path / name, error=True)
        assert want[name] in text and name in text
    xlsx(tmp_path / "a.xlsx", {"S": [[1, 2], [3, 4]]})
    with zipfile.ZipFile(tmp_path / "a.xlsx") as z:
        parts = {n: z.read(n) for n in z.namelist()}
    sheet = parts["xl/worksheets/sheet1.xml"].decode()
    far = sheet.replace("</sheetData>", "".join(f'<row r="{r}"><c r="XFD{r}"><v>1</v></c></row>' for r in range(3, 2100)) + "</sheetData>")
    (tmp_path / "far.xlsx").write_bytes(zipped({**parts, "xl/worksheets/sheet1.xml": far}))
    assert "few cells far apart" in dump(tmp_path / "far.xlsx", error=True)
    texts = f'<sst xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main" uniqueCount="{10**15}"><si><t>a</t></si></sst>'
    (tmp_path / "texts.xlsx").write_bytes(zipped({**parts, "xl/sharedStrings.xml": texts}))
    assert "more texts than it can hold" in dump(tmp_path / "texts.xlsx", error=True)
    (tmp_path / "cut.xlsx").write_bytes((tmp_path / "a.xlsx").read_bytes()[:-500])
    assert "cut.xlsx" in dump(tmp_path / "cut.xlsx", error=True)


def test_a_zip_bomb_is_refused_by_its_claim(dump, tmp_path):
    xlsx(tmp_path / "a.xlsx", {"S": [[1, 2], [3, 4]]})
    with zipfile.ZipFile(tmp_path / "a.xlsx") as z:
        size = z.getinfo("xl/worksheets/sheet1.xml").file_size
    data = (tmp_path / "a.xlsx").read_bytes()
    index = data.index(b"PK\x01\x02")  # the index of the archive, which holds the sizes
    assert data[index:].count(struct.pack("<I", size)) == 1
    (tmp_path / "b.xlsx").write_bytes(data[:index] + data[index:].replace(struct.pack("<I", size), struct.pack("<I", 3 << 30)))
    assert "2 GiB" in dump(tmp_path / "b.xlsx", error=True)


def test_cells_of_xls_beyond_the_last_column_are_refused(dump, tmp_path):
    xls(tmp_path / "a.xls", {"S": [[float(np.pi), 2.5], [3.25, float(np.e)]]})
    data = (tmp_path / "a.xls").read_bytes()
    number = struct.pack("<HHHH", 0x0203, 14, 1, 1)
    claim = struct.pack("<HHIIHH", 0x0200, 14, 0, 2, 0, 2)
    assert data.count(number) == 1 and data.count(claim) == 1
    for good, bad in [(number, struct.pack("<HHHH", 0x0203, 14, 1, 60000)), (claim, struct.pack("<HHIIHH", 0x0200, 14, 0, 2**32 - 1, 0, 2))]:
        (tmp_path / "b.xls").write_bytes(data.replace(good, bad))
        assert "last column" in dump(tmp_path / "b.xls", error=True)


def test_sheets_without_numbers_are_refused(dump, tmp_path):
    xlsx(tmp_path / "a.xlsx", {"S": [["a"], ["b"]]})
    assert "no sheet holds a table of numbers" in dump(tmp_path / "a.xlsx", error=True)
