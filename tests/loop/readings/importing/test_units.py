"""The unit of a size by its column, its row or its cell, at every door that takes tables: never a silent millimetre."""

import json
from pathlib import Path
from typing import Any

import pytest
from openpyxl import Workbook

from app.bridge.fields import Form
from app.bridge.messages import foreign_readings
from app.errors import Invalid
from app.files.formats import spreadsheet
from app.loop.readings.importing.cells import Flaw
from app.loop.readings.importing.layout import Wishes, look
from app.loop.readings.importing.lines import Line, lines
from app.quality.gauge_studies.form_reader import pasted_grid
from tests.bridge.kinds.test_text import printed
from tests.loop.readings.importing.doors import bridged

Answer = list[float] | str
"""Sizes, mm, or words of the refusal."""
NO_LENGTH, NOBODY = "which is no length that is known", "it cannot be determined which counts"

ROWS: dict[str, tuple[str, list[tuple[str, str]], Answer]] = {
    "a column of units": ("actual", [("0.4724", "inch"), ("12.003", "mm"), ("12.001", "")], [11.99896, 12.003, 12.001]),
    "in the cell": ("actual", [("12.003 mm", ""), ("0.4724 in", ""), ('0.4724"', "")], [12.003, 11.99896, 11.99896]),
    "cell and column agree": ("actual", [("0.4724 in", "inch")], [11.99896]),
    "header and column agree": ("actual [inch]", [("0.4724", "in"), ("0.4724", "")], [11.99896, 11.99896]),
    "header and column do not": ("actual [mm]", [("0.4724", "inch")], NOBODY),
    "header and cell do not": ("actual [mm]", [("0.4724 in", "")], NOBODY),
    "column and cell do not": ("actual", [("0.4724 in", "mm")], NOBODY),
    "no length in the column": ("actual", [("25.1", "Nm")], NO_LENGTH),
    "no length in the cell": ("actual", [("25.1 Nm", "")], "is not a number"),
}


def imported(path: Path, column: str, **wishes: Any) -> Answer:
    found = list(lines(path, look(path, Wishes(mapping={"measured": column}, **wishes)), "x"))
    flaws = " ".join(str(each) for each in found if isinstance(each, Flaw))
    return flaws or [each.reading.measured or 0.0 for each in found if isinstance(each, Line)]


def check(found: Answer, expected: Answer) -> None:
    if isinstance(expected, str):
        assert isinstance(found, str), found
        assert expected in found
    else:
        assert found == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("name", ROWS)
@pytest.mark.parametrize("unit", ["Unit", "Einheit", "uom"])
def test_a_table_in_import_and_bridge(tmp_path: Path, name: str, unit: str) -> None:
    header, rows, expected = ROWS[name]
    path = tmp_path / "a.csv"
    path.write_text(f"{header};{unit}\n" + "".join(f"{size};{said}\n" for size, said in rows))
    check(imported(path, header), expected)
    readings, _lines, words = bridged(path, {"*": "x"}, columns={"measured": header})
    check(words or [size for size, _at in readings], expected)


@pytest.mark.parametrize("name", ROWS)
def test_a_table_of_a_gauge_study(name: str) -> None:
    header, rows, expected = ROWS[name]
    table = f"Part;Operator;{header};Unit\n" + "".join(
        f"{at};A;{size};{said}\n" for at, (size, said) in enumerate(rows, 1)
    )
    try:
        _typed, grid = pasted_grid("grr", {"table": table})
    except Invalid as error:
        check(error.errors[0].message, expected)
        return
    assert grid.names == [str(at) for at in range(1, len(rows) + 1)]
    check([float(text) for line in grid.cells for text in line], expected)


def test_headings_of_a_gauge_study(tmp_path: Path) -> None:
    _typed, grid = pasted_grid("grr", {"table": "Part;A [inch];B [inch]\nP1;0.5;0.25\n", "operators": "A, B"})
    assert (grid.names, grid.cells) == (["P1"], [["12.7", "6.35"]])
    _typed, grid = pasted_grid("type_one", {"table": "Value [µm]\n12,5\n"})
    assert grid.cells[0][0] == "0.0125"
    with pytest.raises(Invalid) as refusal:
        pasted_grid("type_one", {"table": "Torque [Nm]\n12,5\n"})
    assert "row 1, column 1: the heading names the unit Nm" in refusal.value.errors[0].message


def test_a_wide_sheet_and_a_sheet_of_touches(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("D40;D12;unit\n1.5;0.5;inch\n")
    readings, _lines, words = bridged(path, {"D40": "d40", "D12": "d12"}, columns={"part": "D40"})
    assert (words, [size for size, _at in readings]) == ("", [38.1, 12.7])
    path.write_text("touches;unit\n[[1.5, 1.6]];inch\n")
    layout = look(path, Wishes(mapping={"touches": "touches"}))
    [line] = lines(path, layout, "x")
    assert isinstance(line, Line), line
    assert line.reading.touches == [[38.1, 40.64]]


def test_a_number_format_of_a_workbook_that_shows_a_unit(tmp_path: Path) -> None:
    book = Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(["actual", "note"])
    for row, (size, shown) in enumerate(
        [(0.4724, '0.0000" in"'), (12.003, '0.000"mm"'), (0.4724, '0.00\\"'), (12.001, "0.000")], 2
    ):
        sheet.cell(row, 1, size).number_format = shown
    book.save(tmp_path / "a.xlsx")
    with spreadsheet.text_of(tmp_path / "a.xlsx", None) as path:
        layout = look(path, Wishes(mapping={"measured": "actual"}), "a.xlsx")
        found = [each.reading.measured for each in lines(path, layout, "x") if isinstance(each, Line)]
    check([size or 0.0 for size in found], [11.99896, 12.003, 11.99896, 12.001])


def test_objects_name_their_unit_as_rows_do(tmp_path: Path) -> None:
    rows = [{"measured": 0.4724, "unit": "inch"}, {"measured": 12.003}]
    (tmp_path / "a.ndjson").write_text("".join(json.dumps(row) + "\n" for row in rows))
    (tmp_path / "a.json").write_text(json.dumps(rows))
    for name in ("a.ndjson", "a.json"):
        check(imported(tmp_path / name, "measured"), [11.99896, 12.003])
    readings, _lines, _words = bridged(tmp_path / "a.ndjson", {"*": "x"}, format="ndjson")
    check([size for size, _at in readings], [11.99896, 12.003])
    (tmp_path / "a.ndjson").write_text('{"measured": 25.1, "unit": "Nm"}\n')
    check(imported(tmp_path / "a.ndjson", "measured"), NO_LENGTH)
    check(bridged(tmp_path / "a.ndjson", {"*": "x"}, format="ndjson")[2], NO_LENGTH)


def test_a_column_that_is_called_so_and_holds_no_units_can_be_left_out(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("actual;unit\n40.001;A7\n")
    assert "--map unit=" in str(imported(path, "actual"))
    found = list(lines(path, look(path, Wishes(mapping={"measured": "actual", "unit": ""})), "x"))
    assert [each.reading.measured for each in found if isinstance(each, Line)] == [40.001]
    assert "columns.unit" in bridged(path, {"*": "x"}, columns={"measured": "actual"})[2]
    readings, _lines, _words = bridged(path, {"*": "x"}, columns={"measured": "actual", "unit": ""})
    assert readings == [(40.001, None)]


@pytest.mark.parametrize(
    ("content", "fields", "expected"),
    [
        ({"v": 0.4724, "unit": "inch"}, {"measured": "v"}, 11.99896),
        ({"d": {"v": 0.4724, "Unit": "in"}, "unit": "mm"}, {"measured": "d.v"}, 11.99896),
        ({"d": [{"v": "0.4724"}], "unit": "in"}, {"measured": "d.0.v"}, 11.99896),
        ({"v": "0.4724 in"}, {"measured": "v"}, 11.99896),
        ({"v": 0.4724, "eu": "in"}, {"measured": "v", "unit": "eu"}, 11.99896),
        ({"v": 25.1, "unit": "Nm"}, {"measured": "v"}, NO_LENGTH),
        ({"d": {"v [µm]": 12345}}, {"measured": "d.v [µm]"}, 12.345),
        ({"v_inch": 0.4724}, {"measured": "v_inch"}, 11.99896),
        ({"v_inch": 0.4724, "unit": "mm"}, {"measured": "v_inch"}, "it cannot be determined which counts"),
        ({"v [Nm]": 25.1}, {"measured": "v [Nm]"}, "unit Nm, in the name of the member, is no length"),
    ],
)
def test_messages_of_others(content: Any, fields: dict[str, str], expected: float | str) -> None:
    message = json.dumps(content | {"id": 1}).encode()
    [found] = foreign_readings(message, "m", fields | {"key": "id"}, {"*": "x"}, Form(1.0))
    check(found.fault or [found.body["measured"]], expected if isinstance(expected, str) else [expected])


def test_printed_lines_may_capture_their_unit() -> None:
    lines = [r"(?P<characteristic>D\d+) ACTUAL (?P<measured>\S+) ?(?P<unit>\S*)"]
    found = printed(b"D40 ACTUAL 1.5 in\nD20 ACTUAL 20.1\nD20 ACTUAL 25 Nm\n", lines=lines)
    assert [each.body.get("measured") for each in found] == [38.1, 20.1, None]
    assert NO_LENGTH in str(found[2].fault)
