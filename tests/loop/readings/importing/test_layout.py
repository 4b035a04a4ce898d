"""Meaning of a file's columns, and faults of its lines: no database."""

import json
import re
from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from openpyxl import Workbook

from app.bridge.file_rows import Table, cell_of, csv_rows
from app.errors import Invalid
from app.files.formats.delimited import BLANKS
from app.files.formats.spreadsheet import text_of
from app.loop.readings.aqdef.matching import parameters_of
from app.loop.readings.importing.cells import Flaw, Passed
from app.loop.readings.importing.drawn import contents
from app.loop.readings.importing.layout import NO_DIGIT, Wishes, look
from app.loop.readings.importing.lines import Line, lines
from app.loop.readings.importing.refusals import MOST_COLUMNS

NOW = datetime(2026, 11, 21, 12, tzinfo=UTC)


def read(path: Path, **wishes: object) -> list[Line | Flaw | Passed]:
    return list(lines(path, look(path, Wishes(**wishes)), "shaft-d40", now=NOW))  # type: ignore[arg-type]


def good(path: Path, **wishes: object) -> list[tuple[float | None, str | None]]:
    found = read(path, **wishes)
    flaws = [str(each) for each in found if isinstance(each, Flaw)]
    assert flaws == []
    return [(each.reading.measured, each.reading.part) for each in found if isinstance(each, Line)]


def write(tmp_path: Path, text: str, encoding: str = "utf-8", name: str = "file.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


@pytest.mark.parametrize(
    ("header", "row"),
    [
        ("measured,measured_at,part", "39.998,2026-11-20T08:00:00Z,Дугме"),
        ("Messwert;Datum;Uhrzeit;Teil", "39,998;20.11.2026;08:00:00;Дугме"),
        ("Izmereno\tVreme\tDeo", "39,998\t20.11.2026. 08:00:00\tДугме"),
        ("Izmerjena vrednost;Čas meritve;Kos", "39,998;2026-11-20 08:00:00;Дугме"),
        ("Значение|Дата и время|Серийный номер", "39,998|20.11.2026 08:00|Дугме"),
        ("Wert [µm];Zeitstempel;Seriennummer", "39998;2026-11-20T08:00:00Z;Дугме"),
        ("Ist;Datum/Uhrzeit;Teil-Nr.", "39,998;20.11.2026 08:00:00;Дугме"),
        ("MeasuredValue;Date & Time;Part No.", "39.998;2026-11-20 08:00:00;Дугме"),
        ("Valeur mesurée [mm];Date de mesure;Pièce", "39,998;20.11.2026 08:00;Дугме"),
        ("Cycle time;Date/Time;Valore misurato;Numero di serie", "12;20.11.2026 08:00;39,998;Дугме"),
        ("Pieza;Medida;Fecha;Hora", "Дугме;39,998;20.11.2026;08:00"),
        ("Wartość zmierzona:;Data pomiaru:;Część:", "39,998;2026-11-20 08:00;Дугме"),
        ("測定日時,測定値,部品番号", "2026/11/20 08:00,39.998,Дугме"),
    ],
)
def test_files_in_many_languages_are_understood_by_their_headers(tmp_path: Path, header: str, row: str) -> None:
    path = write(tmp_path, f"{header}\n{row}\n")
    assert good(path, timezone="UTC") == [(39.998, "Дугме")]
    first = read(path, timezone="UTC")[0]
    assert isinstance(first, Line)
    assert first.reading.measured_at == datetime(2026, 11, 20, 8, tzinfo=UTC)


@pytest.mark.parametrize(
    ("unit", "sizes"),
    [
        ("mil", (0.00254, 0.003048)), ("thou", (0.00254, 0.003048)), ("tenths", (0.000254, 0.0003048)), ("µin", (0.00000254, 0.000003048)),
        ("cm", (1.0, 1.2)), ("nm", (0.0000001, 0.00000012)), ("um", (0.0001, 0.00012)), ("inch", (2.54, 3.048)), ('"', (2.54, 3.048)),
    ],
)  # fmt: skip
def test_the_unit_of_the_header_is_converted(tmp_path: Path, unit: str, sizes: tuple[float, float]) -> None:
    path = write(tmp_path, f"Zeit;Run-out [{unit}]\n2025-11-18T06:05:00Z;0,10\n2025-11-18T06:06:00Z;0,12\n")
    assert [size for size, _part in good(path, mapping={"measured": "2"})] == list(sizes)


@pytest.mark.parametrize("unit", ["Nm", "furlong", "°"])
def test_a_header_that_names_no_length_is_refused_by_column(tmp_path: Path, unit: str) -> None:
    path = write(tmp_path, f"Zeit;Run-out [{unit}]\n2025-11-18T06:05:00Z;0,10\n")
    with pytest.raises(Invalid, match=re.escape(f"Run-out [{unit}] names the unit {unit}")):
        good(path, mapping={"measured": "2"})
    assert [size for size, _part in good(path, mapping={"measured": "2"}, unit="mil")] == [0.00254]
    listed = write(tmp_path, json.dumps([{f"measured [{unit}]": 0.1}]), name="a.json")
    with pytest.raises(Invalid, match="names the unit"):
        good(listed, mapping={"measured": f"measured [{unit}]"})


@pytest.mark.parametrize(
    "encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1250", "cp1251", "cp1252", "cp932", "cp949", "cp1253"]
)
def test_encodings(tmp_path: Path, encoding: str) -> None:
    part = {"cp1251": "Шипка", "cp1252": "Welle Ø", "cp932": "部品", "cp949": "부품", "cp1253": "Άξονας"}.get(
        encoding, "Žižek"
    )
    path = write(tmp_path, f"measured,part\r\n39.998,{part}\r\n", encoding)
    named = encoding if encoding.startswith("cp") else None
    assert good(path, encoding=named) == [(39.998, part)]


def test_a_file_in_a_wrongly_named_encoding_is_refused_with_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(Invalid, match="cp1250 for Serbian"):
        look(write(tmp_path, "measured,part\n39.998,Žižek\n", "cp1250"), Wishes(encoding="utf-8"))


def test_quotes_blank_lines_and_the_line_a_spreadsheet_writes(tmp_path: Path) -> None:
    path = write(tmp_path, 'sep=;\n"measured";"part"\n\n39,998;"a ""b""; c"\n;\n39,997;"two\nlines is one"\n')
    found = read(path)
    assert isinstance(found[0], Line)
    assert found[0].reading.part == 'a "b"; c'
    assert isinstance(found[1], Flaw), "a text of two lines cannot be a part's name"
    assert found[1].line == 6


def test_cells_missing_or_left_over_at_the_end_of_a_row_are_empty(tmp_path: Path) -> None:
    rows = ["measured;part;comment;;", "39.998;a", "39.999", "40.001;b;;;;;", "40.002;c;good;;"]
    assert good(write(tmp_path, "\n".join([*rows, ""]))) == [
        (39.998, "a"),
        (39.999, None),
        (40.001, "b"),
        (40.002, "c"),
    ]
    assert [str(each) for each in read(write(tmp_path, "part;comment;measured\na;b\n"))] == [
        "line 2, measured: is empty; remove the line if the probe measured nothing"
    ]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16-le", "utf-16-be"])
def test_only_a_last_row_without_an_end_that_is_shorter_than_all_others_is_cut_off(
    tmp_path: Path, encoding: str
) -> None:
    rows = "measured;part;comment;by\n39.998;a;b\n39.999;c;d"
    assert len(good(write(tmp_path, rows, encoding))) == 2
    cut = "line 3: has 2 cells, lines above have 3, and has no end: the file is cut off here; take the whole one"
    assert [str(each) for each in read(write(tmp_path, rows[:-2], encoding))[1:]] == [cut]
    assert len(good(write(tmp_path, rows[:-2] + "\n", encoding))) == 2


def test_a_decimal_comma_in_quotes_between_commas(tmp_path: Path) -> None:
    assert good(write(tmp_path, 'measured,part\n"39,998",a\n')) == [(39.998, "a")]
    flaw = read(write(tmp_path, "measured,part\n39,998,a\n"))[0]
    assert isinstance(flaw, Flaw)
    assert "decimal comma" in flaw.reason


def test_columns_that_are_named_or_numbered_win(tmp_path: Path) -> None:
    path = write(tmp_path, "value,Höhe,x\n1,39.998,a\n")
    assert good(path, mapping={"measured": "Höhe", "part": "3"}) == [(39.998, "a")]
    assert look(path, Wishes(mapping={"measured": "2"})).ignored == ["value", "x"]
    with pytest.raises(Invalid, match="no column 'Hohe'; the file has: value, Höhe, x"):
        look(path, Wishes(mapping={"measured": "Hohe"}))
    with pytest.raises(Invalid, match="no field 'size'"):
        look(path, Wishes(mapping={"size": "x"}))


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "The file is empty"),
        ("\n\n", "The file is empty"),
        ("Höhe;Breite\n1;2\n", "No column is recognised as the measured value.*The columns are: Höhe, Breite"),
        ('measured,part\n39.99,"open\n', "never closed"),
    ],
)
def test_files_that_cannot_be_read_at_all_say_why(tmp_path: Path, text: str, why: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(Invalid) as refusal:
        found = list(lines(path, look(path, Wishes()), "c", now=NOW))
        raise Invalid(str(found))
    assert re.search(why, refusal.value.detail)


def test_every_flaw_has_its_line_its_column_and_a_reason(tmp_path: Path) -> None:
    rows = ["1e999,a", "NaN,b", ",c", "39.998,ok", "four,d", "5e7,e", "39.99", "39.99,f,g", "39.99,\x07bell"]
    found = read(write(tmp_path, "measured,part\n" + "\n".join(rows) + "\n"))
    flaws = [each for each in found if isinstance(each, Flaw)]
    assert [(f.line, f.column) for f in flaws] == [
        (2, "measured"), (3, "measured"), (4, "measured"), (6, "measured"), (7, "measured"), (9, ""), (10, "part"),
    ]  # fmt: skip
    assert "longer than any machine" in flaws[4].reason
    assert str(flaws[0]) == "line 2, measured: '1e999' is too large to be a number of this world"


def test_times_of_tomorrow_and_before_1900_are_refused(tmp_path: Path) -> None:
    path = write(
        tmp_path, "measured,measured_at\n40,2026-11-23T12:00:01Z\n40,1899-06-30T23:59:59Z\n40,2026-11-20T12:00Z\n"
    )
    found = read(path)
    assert [type(each) for each in found] == [Flaw, Flaw, Line]


def test_the_key_of_a_line_comes_from_the_files_content_not_its_name(tmp_path: Path) -> None:
    text = "measured\n39.998\n39.997\n"
    one, two = read(write(tmp_path, text)), read(write(tmp_path, text, name="other.csv"))
    keys = [each.reading.key for each in one if isinstance(each, Line)]
    assert keys == [each.reading.key for each in two if isinstance(each, Line)]
    assert len(set(keys)) == 2
    changed = read(write(tmp_path, text + "39.996\n"))[0]
    assert isinstance(changed, Line)
    assert changed.reading.key != keys[0]


def test_json_lines_and_json_lists(tmp_path: Path) -> None:
    objects: list[object] = [
        {"measured": 39.998, "part": "a", "measured_at": "2026-11-20T08:00:00Z", "zone": "zero"},
        {"measured": "39.998"},
        {"part": "b"},
        17,
        {"measured": 39.997},
    ]
    as_lines = write(tmp_path, "\n".join(map(json.dumps, objects)) + "\nnot json\n", name="a.ndjson")
    as_list = write(tmp_path, json.dumps(objects), name="a.json")
    for path, numbers in ((as_lines, [2, 3, 4, 6]), (as_list, [2, 3, 4])):
        found = read(path)
        assert [each.line for each in found if isinstance(each, Flaw)] == numbers
        assert [each.number for each in found if isinstance(each, Line)] == [1, 5]
        assert look(path, Wishes()).ignored == ["zone"]


def test_touches_stand_in_place_of_a_measured_value(tmp_path: Path) -> None:
    path = write(tmp_path, '{"measured": 40, "touches": [[39.998], [39.996]]}\n', name="a.ndjson")
    (line,) = read(path)
    assert isinstance(line, Line)
    assert line.reading.touches == [[39.998], [39.996]]
    assert line.reading.measured is None


def test_comments_above_the_header_are_passed_over_and_a_column_of_numbers_called_hash_is_not(tmp_path: Path) -> None:
    plain = write(tmp_path, "# written by the cell, line 3\n# second shift\nmeasured;part\n40.001;a\n39.998;b\n")
    assert good(plain) == [(40.001, "a"), (39.998, "b")]
    numbered = write(tmp_path, "#;measured;part\n1;40.001;a\n2;39.998;b\n", name="numbered.csv")
    assert good(numbered) == [(40.001, "a"), (39.998, "b")]


@pytest.mark.parametrize("name", ["wide.csv", "wide.ndjson", "wide.json"])
def test_a_file_of_very_many_columns_is_refused_before_each_is_looked_at(tmp_path: Path, name: str) -> None:
    def file(columns: int) -> Path:
        names = ["measured", *(f"c{number}" for number in range(1, columns))]
        as_json = json.dumps(dict.fromkeys(names, 39.998))
        texts = {
            "wide.csv": f"{','.join(names)}\n{','.join(['39.998'] * columns)}\n",
            "wide.ndjson": as_json,
            "wide.json": f"[{as_json}]",
        }
        return write(tmp_path, texts[name], name=name)

    assert len(look(file(MOST_COLUMNS), Wishes()).header) == MOST_COLUMNS
    for columns in (MOST_COLUMNS + 1, 50_000):
        with pytest.raises(Invalid, match=rf"{columns} columns; at most {MOST_COLUMNS}"):
            look(file(columns), Wishes())


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", f"measured;{'n' * 1_001}\n40,1;2\n"),
        ("a.ndjson", json.dumps({"measured": 40.1, "n" * 1_001: 2}) + "\n"),
        ("a.csv", f"characteristic;measured\n{'n' * 1_001};40,1\n"),
    ],
    ids=["column", "name of JSON", "characteristic"],
)
def test_a_name_of_a_hundred_thousand_letters_is_no_name(tmp_path: Path, name: str, text: str) -> None:
    """Each stands a dozen times on the page: 500 of them, in a workbook of some kB, made a page of gigabytes."""
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(Invalid, match=r"has a name of 1001 characters; at most 1000 are taken\. It begins: nnnn"):
        look(path, Wishes())


HEADS = {
    "a title": ("Messprotokoll Halle 3\n\nTeil;D35;D40\nA1;35,001;40\n", 3, ("Teil", "D35", "D40")),
    "a title as wide as the table": ("Messprotokoll;;\nTeil;D35;D40\nA1;35,001;40\n", 2, ("Teil", "D35", "D40")),
    "two lines, merged": (
        "Teil;Dreh 1;;Dreh 2\n;D35;D40;D35\nA1;35,001;40;35\n",
        2,
        ("Teil", "Dreh 1 D35", "D40", "Dreh 2 D35"),
    ),
    "a column without a name": (";D35;D40\nA1;35,001;40\n", 1, ("", "D35", "D40")),
    "numbers as names": ("Teil;1;2\nA1;35,001;40\n", 1, ("Teil", "1", "2")),
    "nothing but words": ("Teil;D35\nA1;broken\n", 1, ("Teil", "D35")),
}


@pytest.mark.parametrize("what", HEADS)
def test_the_line_of_the_column_names_is_found(tmp_path: Path, what: str) -> None:
    content, line, header = HEADS[what]
    layout = look(write(tmp_path, content), Wishes(), complete=False)
    assert (layout.header_line, layout.header) == (line, header)


def test_the_lines_of_names_and_of_readings_can_be_said(tmp_path: Path) -> None:
    path = write(tmp_path, "shift;35\nTeil;Messwert\nA0;40\nA1;40,001\n")
    assert look(path, Wishes(), complete=False).header == ("Teil", "Messwert"), "below a title with a number"
    assert good(path, header_line=2) == [(40.0, "A0"), (40.001, "A1")]
    assert good(path, header_line=2, first_line=4) == [(40.001, "A1")]
    with pytest.raises(Invalid, match="Line 9 is empty"):
        read(path, header_line=9)


def test_utf_16_is_known_without_its_mark(tmp_path: Path) -> None:
    for encoding in ("utf-16-le", "utf-16-be"):
        path = write(tmp_path, "measured;part\n39.998;Žižek Ø\n", encoding)
        assert good(path) == [(39.998, "Žižek Ø")]


def test_times_as_counts_are_read_where_somebody_says_of_what(tmp_path: Path) -> None:
    path = write(tmp_path, "measured;time\n39.998;46347.34375\n")
    (flaw,) = read(path, timezone="Europe/Berlin")
    assert isinstance(flaw, Flaw)
    assert "days since 1899-12-30" in flaw.reason
    (line,) = read(path, timezone="Europe/Berlin", time_format="days since 1899-12-30")
    assert isinstance(line, Line)
    assert line.reading.measured_at == datetime(2026, 11, 21, 7, 15, tzinfo=UTC)
    path = write(tmp_path, "measured;time\n39.998;1795245300\n")
    (line,) = read(path, time_format="seconds since 1970-01-01")
    assert isinstance(line, Line)
    assert line.reading.measured_at == datetime.fromtimestamp(1795245300, UTC)


def passed(path: Path, **wishes: object) -> list[str]:
    return [f"{each.line}: {each.reason}" for each in read(path, **wishes) if isinstance(each, Passed)]


MARKS = "measured;part\n40,001;a\n---;b\nn.i.O.;c\n;d\n40,002;e\n"


def test_marks_of_missing_sizes_are_passed_over_once_they_are_named(tmp_path: Path) -> None:
    path, every = write(tmp_path, MARKS), frozenset({NO_DIGIT})
    assert [each.line for each in read(path) if isinstance(each, Flaw)] == [3, 4, 5]
    assert good(path, missing=every) == [(40.001, "a"), (40.002, "e")]
    assert [each[:2] for each in passed(path, missing=every)] == ["3:", "4:", "5:"]
    assert [each.line for each in read(path, missing=frozenset({"---"})) if isinstance(each, Flaw)] == [4, 5]


def test_headings_again_are_passed_over_and_footers_cut_off_where_the_last_line_is_said(tmp_path: Path) -> None:
    path = write(tmp_path, "measured;part\n40,001;a\nmeasured;part\n40,002;b\n\nMean;40,0015\nCpk;1,45\n")
    assert [each.line for each in read(path) if isinstance(each, Flaw)] == [6, 7]
    assert good(path, last_line=4) == [(40.001, "a"), (40.002, "b")]
    assert passed(path, last_line=4) == ["3: is the heading again"]


TABLE = "Plate: T-7\n\n   Meas X    Meas Y  Meas D\n  -80.754  -215.282   2.176\n  -40.120  -115.205   2.171\n    1.000     2.000\n"


def test_columns_aligned_by_blanks_are_read_and_nothing_is_shifted(tmp_path: Path) -> None:
    found = read(write(tmp_path, TABLE), delimiter=BLANKS, mapping={"measured": "Meas D"})
    assert [each.reading.measured for each in found if isinstance(each, Line)] == [2.176, 2.171]
    assert [str(each) for each in found if isinstance(each, Flaw)] == [
        "line 6: has 2 cells between blanks, the header has 3: it cannot be determined which of them is empty"
    ]


def test_a_text_among_the_numbers_of_a_workbook_is_read_in_the_one_way_it_can_be(tmp_path: Path) -> None:
    book = Workbook()
    assert book.active is not None
    for row in (["measured", "part"], [40.001, "a"], ["40,002", "b"], ["1.040,003", "c"]):
        book.active.append(row)
    book.save(tmp_path / "a.xlsx")
    with text_of(tmp_path / "a.xlsx", None) as path:
        found = list(lines(path, look(path, Wishes(), "a.xlsx"), "shaft-d40", now=NOW))
    assert [each.reading.measured for each in found if isinstance(each, Line)] == [40.001, 40.002]
    assert [each.line for each in found if isinstance(each, Flaw)] == [4]


REPORT = """\
PART NAME  : HOUSING
REV NUMBER : B
SER NUMBER : {serial}
STATS COUNT: 1

DIM LOC1= LOCATION OF CIRCLE CIR1  UNITS={unit} ,$
GRAPH=OFF  TEXT=OFF  MULT=10.00  OUTPUT=BOTH
AX    NOMINAL       +TOL       -TOL       MEAS        DEV     OUTTOL
X      25.000      0.050      0.050     25.012      0.012      0.000 ----#----
D      10.000      0.030      0.010     {size}      0.004      0.000 ----#----
A      90.000      1.000      1.000     90.200      0.200      0.000
END OF DIMENSION LOC1

DIM LOC2= POSITION OF CIRCLE CIR2  UNITS={unit}
AX       MEAS    NOMINAL       +TOL       -TOL      BONUS        DEV     OUTTOL
X     -28.623    -28.600                                      -0.023
TP      0.068        MMC      0.200                 0.054      0.068      0.000
"""


def of_report(tmp_path: Path, text: str) -> dict[str, list[tuple[int, float | None, str | None] | str]]:
    """Lines, sizes and parts of each of its characteristics, or the reason for which one cannot be read."""
    path = write(tmp_path, text, name="report.txt")
    layout = look(path, Wishes())
    return {
        name: [
            (each.number, each.reading.measured, each.reading.part) if isinstance(each, Line) else str(each)
            for each in lines(path, replace(layout, only=name), "c", now=NOW)
            if not (isinstance(each, Passed) and "not chosen" in each.reason)
        ]
        for name in layout.names
    }


def test_the_blocks_of_a_report_are_one_table(tmp_path: Path) -> None:
    two = REPORT.format(serial=12, size="10.004", unit="MM") + REPORT.format(serial=13, size="10.005", unit="MM")
    found = of_report(tmp_path, two)
    assert list(found) == ["LOC1 X", "LOC1 D", "LOC1 A", "LOC2 X", "LOC2 TP"]
    assert found["LOC1 D"] == [(10, 10.004, "12"), (27, 10.005, "13")]
    assert found["LOC2 X"] == [(16, -28.623, "12"), (33, -28.623, "13")]
    assert found["LOC2 TP"] == [(17, 0.068, "12"), (34, 0.068, "13")]
    assert "names the unit 'deg'" in str(found["LOC1 A"]), "an angle is no length"
    [d] = [each for each in contents(look(tmp_path / "report.txt", Wishes())) if each.title.endswith("LOC1 D")]
    assert [parameters_of(d)[name] for name in ("nominal", "upper_deviation", "lower_deviation")] == [10, 0.03, -0.01]
    assert of_report(tmp_path, REPORT.format(serial=1, size="10.004", unit="IN"))["LOC2 TP"] == [(17, 1.7272, "1")]


def test_a_bridge_reads_the_same_rows_of_a_report(tmp_path: Path) -> None:
    path = write(tmp_path, REPORT.format(serial=12, size="10.004", unit="MM"), name="report.txt")
    rows = csv_rows(path, Table("utf-8", None, {"Feature+AX", "MEAS", "Serial number"}, set()))
    found = {cell_of(row, "Feature+AX"): (at, row["MEAS"]) for at, row in rows if isinstance(row, Mapping)}
    assert (found["LOC1 D"], found["LOC2 TP"], len(found)) == ((10, "10.004"), (17, "0.068"), 5)


def test_a_row_of_a_report_that_is_cut_or_moved_is_refused_by_line(tmp_path: Path) -> None:
    cut = of_report(tmp_path, REPORT.format(serial=1, size="10.004", unit="MM").partition("0.068")[0] + "0.06")
    assert cut["LOC2 TP"] == ["line 17, MEAS: '0.06 ?' is not a number; write it like 39.9981, without a unit"]
    moved = REPORT.format(serial=1, size="10.004", unit="MM").replace(
        "X     -28.623    -28.600", "X   -28.623  -28.600"
    )
    assert of_report(tmp_path, moved)["LOC2 X"] == [
        "line 16, MEAS: '-28.623 -28.600 -0.023 ?' is not a number; write it like 39.9981, without a unit"
    ]


def test_a_heading_may_be_far_below_the_beginning(tmp_path: Path) -> None:
    preamble = "".join(f"Remark {at}: the parts of this week, as they came\n" for at in range(120))
    path = write(tmp_path, f"{preamble}Part;Measured [mm];Time\na;39,998;18.11.2025 06:05\nb;39,997;18.11.2025 06:06\n")
    assert good(path, timezone="UTC") == [(39.998, "a"), (39.997, "b")]
    assert look(path, Wishes(timezone="UTC")).header_line == 121


@pytest.mark.parametrize("parts", [20, 300])
def test_a_table_of_means_below_a_wide_one_is_not_read_in_its_place(tmp_path: Path, parts: int) -> None:
    rows = "".join(f"P{at};40,01;41,02\n" for at in range(parts))
    path = write(tmp_path, f"Part;D40;D41\n{rows}\nFeature;Value\nMean D40;40,01\n")
    assert look(path, Wishes(), complete=False).header == ("Part", "D40", "D41")
    assert good(path, mapping={"measured": "2"}, last_line=parts + 1) == [(40.01, f"P{at}") for at in range(parts)]
    [flaw] = [each for each in read(path, mapping={"measured": "2"}) if isinstance(each, Flaw)]
    assert flaw.line == parts + 3, "what is below it is refused until its last line is said"
    below = Table("utf-8", None, {"Feature", "Value"}, set())
    taken = [row for _line, row in csv_rows(path, below) if isinstance(row, Mapping)]
    assert len(taken) == (1 if parts == 20 else 0), "a bridge is given the names, and looks near the beginning"


def test_a_cell_far_beside_the_table_of_a_sheet_is_no_part_of_it(tmp_path: Path) -> None:
    book = Workbook()
    assert book.active is not None
    book.active.append(["Part", "Measured [mm]"])
    for at in range(80):
        book.active.append([f"P{at}", 40.01])
    book.active.cell(70, MOST_COLUMNS + 100, "checked")
    book.save(tmp_path / "a.xlsx")
    with text_of(tmp_path / "a.xlsx", None) as path:
        assert look(path, Wishes(), "a.xlsx").header == ("Part", "Measured [mm]")


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        (
            "Merkmal;Soll;OGW;UGW;Teil 7;Teil 8\nD40;40;40,1;39,9;40,01;40,02\nD35;35;35,1;34,9;35,01;\n",
            "Teil 7, Teil 8",
        ),
        ("Dim,Nominal,P1,P2,P3,P4\nD40,40,40.01,40.02,40.01,40.02\n", "P1, P2, P3, …"),
        ("\t1\t2\t3\nD40\t40.01\t40.02\t40.03\n", "1, 2, 3"),
    ],
)
def test_a_table_with_parts_across_says_how_to_turn_it_round(tmp_path: Path, text: str, parts: str) -> None:
    path = write(tmp_path, text)
    first = parts.partition(",")[0]
    with pytest.raises(Invalid) as refusal:
        look(path, Wishes())
    assert f"Each row is a characteristic and each of the columns {parts} a part" in refusal.value.detail
    assert f"measured={first}" in refusal.value.detail
    layout = look(path, Wishes(mapping={"measured": first}))
    assert layout.turned == ""
    name = layout.names[0] if layout.names else ""
    found = [each for each in lines(path, replace(layout, only=name), "c", now=NOW) if isinstance(each, Line)]
    assert found[0].reading.measured == 40.01, "what the sentence names works"


@pytest.mark.parametrize("text", ["Höhe;Breite\n1;2\n", "Part;D40;D41\nP1;40.01;41.02\n", "Zeit;A\n18.11.2025;1\n"])
def test_other_tables_without_a_measured_column_are_no_turned_ones(tmp_path: Path, text: str) -> None:
    with pytest.raises(Invalid, match="No column is recognised as the measured value"):
        look(write(tmp_path, text), Wishes())


@pytest.mark.parametrize(
    ("begin", "words"),
    [("K0100 1\nK1001 4711\n", ".dfq"), ("<?xml version='1.0'?>\n<a/>\n", "XML"), ("%PDF-1.4\n1 0 obj\n", "PDF")],
)
def test_what_is_no_table_is_said_to_be_what_it_is(tmp_path: Path, begin: str, words: str) -> None:
    path = tmp_path / "a.txt"
    path.write_text(begin)
    with pytest.raises(Invalid, match=words):
        look(path, Wishes())
