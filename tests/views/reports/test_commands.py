"""`inband report` as somebody types it."""

import csv
import io
import sys
import zipfile
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import pytest
from openpyxl import load_workbook
from pypdf import PdfReader

from tests.forked import inband
from tests.shop import Shop
from tests.views.reports.story import facts, report


@pytest.fixture(scope="module")
def second(story: Shop) -> str:
    """A characteristic beside that of the story."""
    return story.another("second")


def written(shop: Shop, *arguments: object) -> CompletedProcess[str]:
    return inband("report", *arguments, INBAND_DATABASE_URL=shop.server.database.dsn)


def test_one_as_pdf_xlsx_and_csv_by_the_name_of_the_file(story: Shop, tmp_path: Path) -> None:
    key, whole = story.characteristic, report(story, "last=200&section=numbers&section=capability")
    mean, ppk = facts(whole, "numbers")["mean"], facts(whole, "capability")["ppk"]
    names = [fact["name"] for fact in facts(whole, "capability").values()]
    assert sorted(set(names)) == sorted(names), "a sheet is looked up by name"
    for form in ("pdf", "xlsx", "csv"):
        path = tmp_path / f"r.{form}"
        done = written(story, key, "--last", 200, "--section", "numbers", "--section", "capability", "-o", path)
        assert (done.returncode, done.stdout) == (0, ""), done.stderr
        assert "1 report written." in done.stderr
    text = "".join(page.extract_text() for page in PdfReader(tmp_path / "r.pdf").pages)
    assert mean["text"].replace("\N{NO-BREAK SPACE}", " ") in text.replace("\N{NO-BREAK SPACE}", " ")
    assert ppk["text"] in text
    cells = {row[0]: row[2] for row in load_workbook(tmp_path / "r.xlsx")["Report"].iter_rows(values_only=True)}
    assert cells["Ppk"] == pytest.approx(ppk["value"])
    rows = csv.DictReader(io.StringIO((tmp_path / "r.csv").read_text("utf-8-sig")))
    values = {(row["section"], row["row"], row["key"]): row["value"] for row in rows}
    assert float(values["capability", "", "ppk"]) == pytest.approx(ppk["value"])


def test_what_is_meant_for_programs_is_alone_on_standard_output(
    story: Shop, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from app.cli import main

    out = io.TextIOWrapper(io.BytesIO(), encoding="utf-8")
    for name, value in (("INBAND_DATABASE_URL", story.server.database.dsn), ("INBAND_DATA_DIR", str(tmp_path))):
        monkeypatch.setenv(name, value)
    monkeypatch.setattr(sys, "argv", ["inband", "report", story.characteristic, "--format", "csv"])
    monkeypatch.setattr(sys, "stdout", out)
    with pytest.raises(SystemExit) as ended:
        main()
    assert not ended.value.code
    out.seek(0)
    first = out.read().removeprefix("\ufeff").splitlines()[0]
    assert first == "section,row,key,name,value,unit,text"


@pytest.mark.long
def test_several_in_a_folder_a_zip_or_a_workbook(story: Shop, second: str, tmp_path: Path) -> None:
    both: tuple[Any, ...] = (story.characteristic, second, "--section", "numbers")
    folder = tmp_path / "week 47 Đ"
    assert written(story, *both, "-o", folder).returncode == 0
    assert sorted(path.name for path in folder.iterdir()) == sorted(
        [f"report-{story.characteristic}.pdf", f"report-{second}.pdf"]
    )
    assert written(story, *both, "--format", "csv", "-o", tmp_path / "w.zip").returncode == 0
    with zipfile.ZipFile(tmp_path / "w.zip") as whole:
        assert "summary.csv" in whole.namelist()
        assert len(whole.namelist()) == 3
    assert written(story, *both, "-o", tmp_path / "w.xlsx").returncode == 0
    assert load_workbook(tmp_path / "w.xlsx").sheetnames == ["Summary", story.characteristic, second]


def test_one_that_there_is_not_spoils_no_other_and_is_said(story: Shop, second: str, tmp_path: Path) -> None:
    done = written(story, second, "nobody", "--section", "numbers", "-o", tmp_path / "some.zip")
    assert done.returncode == 1
    assert "nobody" in done.stderr
    assert "1 report written." in done.stderr
    with zipfile.ZipFile(tmp_path / "some.zip") as whole:
        assert sorted(whole.namelist()) == [f"report-{second}.pdf", "summary.csv"]
        assert "nobody" in whole.read("summary.csv").decode()


@pytest.mark.parametrize(
    ("arguments", "status", "said"),
    [
        (("second", "third"), 2, "--output"),
        (("second", "third", "-o", "r.pdf"), 2, "one report"),
        (("second", "-o", "nowhere/r.pdf"), 2, "no folder"),
        (("second", "--last", "0", "-o", "r.pdf"), 2, "last"),
        (("second", "--section", "poetry", "-o", "r.pdf"), 2, "poetry"),
        (("second", "--from", "yesterday", "-o", "r.pdf"), 1, "from"),
        (("second", "--timezone", "Mars/Base", "-o", "r.pdf"), 1, "Mars/Base"),
        (("second", "--from", "2026-11-22", "--to", "2026-11-21", "-o", "r.pdf"), 1, "later than"),
        (("nobody", "-o", "r.pdf"), 1, "nobody"),
    ],
)
def test_wrong_use_writes_nothing(
    story: Shop,
    second: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: tuple[str, ...],
    status: int,
    said: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    done = written(story, *arguments)
    assert done.returncode == status, done.stderr
    assert said in done.stderr
    assert "Traceback" not in done.stderr
    assert [path.name for path in tmp_path.iterdir() if path.suffix in {".pdf", ".part"}] == []
