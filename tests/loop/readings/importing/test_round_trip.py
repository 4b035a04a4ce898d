"""Export and import: Inband recognises what it wrote, whoever set the characteristic up and however its readings came."""

import csv
import io
import random
from datetime import UTC, datetime, timedelta
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest
from openpyxl import Workbook

from app.db.engine import Database
from app.files.aqdef.description import Source
from app.files.formats import spreadsheet
from app.loop.readings import actions, exporting, queries
from app.loop.readings.aqdef import actions as aqdef
from app.loop.readings.aqdef import matching
from app.loop.readings.aqdef.export import write_aqdef
from app.loop.readings.aqdef.sorting import Wishes
from app.loop.readings.importing.history import Flawed
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.batch import store_batch
from app.loop.tables.tools import AverageMemory
from tests.loop.readings.importing.test_history import PARAMETERS, run, scalar, set_up, table
from tests.loops import in_thread

D40, D41 = "shaft-d40", "shaft-d41"
FORMS = ("csv", "ndjson", "xlsx", "dfq")


@pytest.fixture
def plant(database: Database, tmp_path: Path) -> Database:
    """Readings of each way in: pushed with and without a key, many of one second; out of a table; out of AQDEF."""
    set_up(database)
    chance, start = random.Random(26), datetime(2026, 3, 2, 5, tzinfo=UTC)
    with database.begin() as session:
        session.get_one(AverageMemory, (1, PARAMETERS["average_memory"])).empirical_value = 0.0021
        entry = queries.entry_of(session, D40)
        assert entry is not None
    pushed = [
        ReadingIn(
            D40,
            measured=39.992 + chance.choice((0.0, 0.001, 1e-9, 0.00123456789)),
            measured_at=start + timedelta(seconds=chance.randrange(8) / 2),
            part=chance.choice((None, "SN-1", "=SN")),
            key=chance.choice((None, None, f"=k{at}", f"k{at}")),
        )
        for at in range(40)
    ]
    in_thread(lambda: store_batch(database, {}, [(entry, each) for each in pushed]))
    run(database, table(tmp_path / "a.csv", [39.992, 39.992, 39.9935]))
    head = ["K0100 1", "K1001 P1", "K2001/1 7", "K2002/1 Seat", "K2142/1 mm"]
    values = ["K0001/1 39.99123", "K0004/1 2.3.2026/6:00", "K0001/1 39.99123", "K0004/1 2.3.2026/6:00"]
    (tmp_path / "a.dfq").write_text("\r\n".join([*head, *values, ""]))
    assert import_dfq(database, tmp_path / "a.dfq", D40) == (2, 0)
    return database


def exported(database: Database, path: Path, key: str = D40) -> Path:
    with database.begin() as session:
        if path.suffix == ".dfq":
            write_aqdef(session, [key], path)
            return path
        entry = queries.entry_of(session, key)
        assert entry is not None
        text = io.StringIO(newline="")
        (exporting.write_ndjson if path.suffix == ".ndjson" else exporting.write_csv)(
            exporting.rows(session, entry), text
        )
    if path.suffix != ".xlsx":
        path.write_text(text.getvalue(), newline="")
        return path
    book = Workbook()
    assert book.active is not None
    text.seek(0)
    for row in csv.reader(text):  # as a spreadsheet opens it
        book.active.append([float(cell) if cell.replace(".", "", 1).isdigit() else cell for cell in row])
    book.save(path)
    return path


def import_dfq(database: Database, path: Path, to: str) -> tuple[int, int]:
    source = Source.at(path)
    description = aqdef.describe(source)
    chosen = {each.index: to for each in matching.contents(description)}
    wishes = Wishes(ZoneInfo("Europe/Belgrade"))
    done = aqdef.import_aqdef(
        database, source, description, chosen, wishes, machine=None, actor="tests", name=path.name
    )
    assert done.stored or all(not each.doubts for each in done.results)
    return done.stored, done.repeated


def imported(database: Database, path: Path, to: str = D40) -> tuple[int, int]:
    if path.suffix == ".dfq":
        return import_dfq(database, path, to)
    if path.suffix == ".xlsx":
        with spreadsheet.text_of(path, None) as text:
            text.replace(path.with_name("sheet.xlsx.csv"))
        path = path.with_name("sheet.xlsx.csv")
    done = run(database, path, to)
    return done.stored, done.repeated


@pytest.mark.parametrize("form", FORMS)
def test_what_was_written_stores_nothing_where_it_comes_from(plant: Database, tmp_path: Path, form: str) -> None:
    before = scalar(plant, "SELECT count(*) FROM reading")
    assert imported(plant, exported(plant, tmp_path / f"out.{form}")) == (0, before)
    assert scalar(plant, "SELECT count(*) FROM reading") == before == 45


@pytest.mark.parametrize("form", FORMS)
def test_sizes_in_inches_come_back_as_the_same_readings(database: Database, tmp_path: Path, form: str) -> None:
    set_up(database)
    path = table(tmp_path / "a.csv", [1.57449, 1.574487, 1.574493, 1.5744931234])
    path.write_text(
        path.read_text().replace("measured\n", "measured [inch]\n").replace("measured\r", "measured [inch]\r")
    )
    assert run(database, path, D41).stored == 4
    first = scalar(database, "SELECT min(measured) FROM reading")
    assert first == pytest.approx(39.9919698, abs=1e-9)
    assert imported(database, exported(database, tmp_path / f"out.{form}", D41), D41) == (0, 4)


@pytest.mark.parametrize("form", FORMS)
def test_elsewhere_it_is_stored_once_and_a_later_one_brings_what_is_new(
    plant: Database, tmp_path: Path, form: str
) -> None:
    assert imported(plant, exported(plant, tmp_path / f"one.{form}"), D41) == (45, 0)
    run(plant, table(tmp_path / "b.csv", [39.993, 39.993]))
    later = exported(plant, tmp_path / f"two.{form}")
    assert imported(plant, later, D41) == (2, 45)
    assert imported(plant, exported(plant, tmp_path / f"back.{form}", D41), D41) == (0, 47)


@pytest.mark.parametrize("form", ["csv", "ndjson", "dfq"])
def test_a_size_that_was_changed_in_the_file_is_refused_by_line(plant: Database, tmp_path: Path, form: str) -> None:
    path = exported(plant, tmp_path / f"out.{form}")
    lines = path.read_text().splitlines()
    size, at = ("39.98913", -2) if form == "dfq" else ("39.99123", -1)  # of AQDEF the corrected one, above its GUID
    assert size in lines[at]
    lines[at] = lines[at].replace(size, "39.993", 1)
    path.write_text("\n".join([*lines, ""]), newline="")
    with pytest.raises(Flawed) as refusal:
        imported(plant, path)
    read = 39.9951 if form == "dfq" else 39.993
    assert [flaw.reason for flaw in refusal.value.flaws] == [
        f"belongs to reading 45, which measured 39.99123 mm, not {read} mm"
    ]


@pytest.mark.parametrize("form", FORMS)
def test_what_counted_for_nothing_does_not_count_elsewhere(database: Database, tmp_path: Path, form: str) -> None:
    set_up(database)
    with database.begin() as session:
        entry = queries.entry_of(session, D40)
    assert entry is not None
    at = [datetime(2026, 3, 2, 5, minute, tzinfo=UTC) for minute in range(5)]
    pushed = [
        ReadingIn(D40, measured=39.991, measured_at=at[0]),
        ReadingIn(D40, touches=[[None]], measured_at=at[1]),
        ReadingIn(D40, measured=39.998, measured_at=at[2]),
        ReadingIn(D40, measured=39.993, measured_at=at[3]),
        ReadingIn(D40, first_move_triggered=True, measured_at=at[4]),
    ]
    in_thread(lambda: store_batch(database, {}, [(entry, each) for each in pushed]))
    with database.begin() as session:
        actions.exclude(session, entry, 3, "tests", "chip in the bore")
    out = exported(database, tmp_path / f"out.{form}")
    assert imported(database, out)[0] == 0
    imported(database, out, D41)
    counting = "SELECT array_agg(measured ORDER BY sequence) FROM reading r WHERE characteristic_id = 2 AND NOT EXISTS (SELECT FROM exclusion e WHERE e.characteristic_id = 2 AND e.sequence = r.sequence)"
    assert scalar(database, counting) == [39.991, 39.993]
