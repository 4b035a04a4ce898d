"""Files of others are read in a process of its own: its limits, its end, and the small files that once stopped a server."""

import os
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from app.files import apart as apart_module
from app.files.apart import PREFIX, Limits, apart, spend, sweep
from app.files.formats import delimited, spreadsheet
from app.files.formats.delimited import Unusable
from tests.waits import until

SMALL = Limits(seconds=120, memory=200_000_000, written=1_000_000)


@pytest.mark.parametrize(
    ("work", "given", "limits", "said"),
    [
        (sum, (range(10**15),), replace(SMALL, seconds=1), "takes longer to read than the 1 s"),
        (bytearray, (10**9,), SMALL, "takes more memory to read than the 200 MB"),
        (spend, (10**9,), SMALL, "more than the 1 MB"),
        (os.abort, (), SMALL, "has ended on this one"),
        (int, ("x",), SMALL, "cannot be read: ValueError"),
    ],
)
def test_the_sentence_says_which_limit_it_was(
    work: Callable[..., Any], given: tuple[Any, ...], limits: Limits, said: str
) -> None:
    with pytest.raises(Unusable, match=said):
        apart(work, *given, limits=limits)


def test_what_the_file_is_refused_for_comes_back_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "x.csv"
    path.write_bytes(b"a,b\n\xff,1\n")
    with pytest.raises(Unusable, match="not UTF-8 text"):
        apart(delimited.delimiter_of, path, "utf-8")
    assert apart(delimited.encoding_of, path) == "cp1252"


def test_nothing_is_left_behind(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    for work in (len, bytearray):
        try:
            apart(work, [1] if work is len else 10**9, limits=SMALL)
        except Unusable:
            assert work is bytearray
    assert list(tmp_path.iterdir()) == []
    old, new = tmp_path / f"{PREFIX}old", tmp_path / f"{PREFIX}new"
    old.mkdir()
    new.mkdir()
    os.utime(old, (0, 0))
    sweep()
    assert list(tmp_path.iterdir()) == [new]


def test_it_ends_with_the_server_however_that_ends(tmp_path: Path) -> None:
    program = "from app.files.apart import apart; apart(sum, range(10**15))"
    here = str(Path(apart_module.__file__).parents[2])
    environment = {"PYTHONPATH": here, "TMPDIR": str(tmp_path), "PATH": os.environ["PATH"]}
    server = subprocess.Popen([sys.executable, "-c", program], env=environment)
    try:
        (child,) = until(lambda: Path(f"/proc/{server.pid}/task/{server.pid}/children").read_text().split())
        until(lambda: b"begin()" in Path(f"/proc/{child}/cmdline").read_bytes())
    finally:
        server.kill()
        server.wait()
    until(lambda: not _runs(int(child)))


def _runs(pid: int) -> bool:
    try:
        return "\nState:\tZ" not in Path(f"/proc/{pid}/status").read_text()
    except FileNotFoundError:
        return False


# --- workbooks

FIRST = '<c r="A1" t="inlineStr"><is><t>measured</t></is></c>'
OFFICE = "http://schemas.openxmlformats.org/"
SHEETS, RELATIONS = f"{OFFICE}spreadsheetml/2006/main", f"{OFFICE}officeDocument/2006/relationships"


def book(path: Path, rows: str, *, shared: str = "x", sheets: int = 1, behind: str = "") -> Path:
    """A workbook as another program writes it: these rows, one shared text, so many sheets of the same part."""
    relations = f'Relationships xmlns="{OFFICE}package/2006/relationships"'
    listed = "".join(f'<sheet name="S{n}" sheetId="{n}" r:id="a"/>' for n in range(1, sheets + 1))
    kinds = {"workbook": "sheet.main", "worksheets/sheet1": "worksheet", "sharedStrings": "sharedStrings"}
    of_kinds = "".join(
        f'<Override PartName="/xl/{part}.xml"'
        f' ContentType="application/vnd.openxmlformats-officedocument.spreadsheetml.{kind}+xml"/>'
        for part, kind in kinds.items()
    )
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as parts:
        parts.writestr(
            "[Content_Types].xml",
            f'<Types xmlns="{OFFICE}package/2006/content-types"><Default Extension="rels" '
            f'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>{of_kinds}</Types>',
        )
        parts.writestr(
            "_rels/.rels",
            f'<{relations}><Relationship Id="r" Type="{RELATIONS}/officeDocument" Target="xl/workbook.xml"/></Relationships>',
        )
        parts.writestr(
            "xl/workbook.xml", f'<workbook xmlns="{SHEETS}" xmlns:r="{RELATIONS}"><sheets>{listed}</sheets></workbook>'
        )
        parts.writestr(
            "xl/_rels/workbook.xml.rels",
            f'<{relations}><Relationship Id="a" Type="{RELATIONS}/worksheet" Target="worksheets/sheet1.xml"/>'
            f'<Relationship Id="b" Type="{RELATIONS}/sharedStrings" Target="sharedStrings.xml"/></Relationships>',
        )
        parts.writestr(
            "xl/worksheets/sheet1.xml",
            f'<worksheet xmlns="{SHEETS}"><sheetData>{rows}</sheetData>{behind}</worksheet>',
        )
        parts.writestr("xl/sharedStrings.xml", f'<sst xmlns="{SHEETS}"><si><t>{shared}</t></si></sst>')
    return path


def read(path: Path, folder: Path, limits: Limits = SMALL) -> list[str]:
    sheets = apart(spreadsheet.texts, path, folder, "sheet", spend, limits=limits)
    return next(iter(sheets.values())).read_text().splitlines()


def test_formulas_come_from_the_parser_however_the_sheet_is_written(tmp_path: Path) -> None:
    cells = (
        "<c r='B1'><f>1</f><v>7</v></c><c s='0' r='C1' ><f>1</f></c><c r='D1'><f t='shared' si='0'/><v/></c>"
        "<c r='E1' t='str'><f>A1</f><v></v></c><c r='F1'><f><![CDATA[a<b]]></f></c>"
    )
    path = book(tmp_path / "a.xlsx", f'<row r="1">{FIRST}{cells}</row><!-- {"<c " * 300_000} -->')
    assert read(path, tmp_path) == ["measured\t7\t#FORMULA?\t#FORMULA?\t\t#FORMULA?"]


@pytest.mark.parametrize(
    ("rows", "more", "said"),
    [
        ('<row r="60000000"><c r="A60000000"><v>40.001</v></c></row>', {}, "ends with row 1,048,576"),
        ("".join(f'<row r="{n}"><c t="s"><v>0</v></c></row>' for n in range(1, 99)), {"shared": "a" * 99_999}, "1 MB"),
        ('<row r="1"><c t="s"><v>0</v></c></row>', {"sheets": 300}, "has 300 sheets; at most 100"),
        ('<row r="1"><c t="s"><v>7</v></c></row>', {}, "cannot be read"),
    ],
)
def test_small_workbooks_that_ask_for_much_are_refused(
    tmp_path: Path, rows: str, more: dict[str, Any], said: str
) -> None:
    path = book(tmp_path / "a.xlsx", rows, **more)
    assert path.stat().st_size < 50_000
    with pytest.raises(Unusable, match=said):
        read(path, tmp_path)


def test_rows_keep_their_numbers_and_a_wide_sheet_its_filled_cells(tmp_path: Path) -> None:
    rows = '<row r="2"><c r="C2"><v>1.5</v></c><c r="XFD2"><v>1</v></c></row><row r="1"><c><v>9</v></c></row><row r="4"><c><v>2</v></c></row>'
    assert read(book(tmp_path / "a.xlsx", rows), tmp_path) == ["", "\t\t1.5", "", "2"]
