"""One answer about times: of a table and of AQDEF, imported or in a folder of the bridge. No database, but for lines without one."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

import msgspec
import pytest

from app.bridge.file_content import read_content
from app.db.engine import Database
from app.errors import Invalid
from app.files.aqdef.description import Source
from app.files.aqdef.values import OF_FIELD as F
from app.loop.readings.aqdef.sorting import Kept, Wanted, sort_out
from app.loop.readings.aqdef.sorting import Wishes as AqdefWishes
from app.loop.readings.importing.cells import Flaw
from app.loop.readings.importing.layout import Wishes, look
from app.loop.readings.importing.lines import Line, lines
from tests.bridge.kinds.measured_folder import machine
from tests.loop.readings.importing.test_history import plant, run  # noqa: F401 - a fixture
from tests.loop.readings.record import rows

ZONE = "Europe/Belgrade"
NOW = datetime(2026, 11, 21, 12, tzinfo=UTC)
Answer = list[str | None] | str
"""Times in UTC, None for none; or words of the refusal."""

NEVER = "does not exist in Europe/Belgrade: the clocks went forward in that hour"
DEFAULT = "is what programs write where they have no time"
CASES: dict[str, tuple[list[str], Answer]] = {
    "month first": (
        ["11/18/2025 6:05:10 AM", "11/18/2025 6:06:10 PM", "11/07/2025 12:06:10 AM"],
        ["2025-11-18T05:05:10", "2025-11-18T17:06:10", "2025-11-06T23:06:10"],
    ),
    "day first": (["07/11/2025 06:05:10", "18/11/2025 06:05:10"], ["2025-11-07T05:05:10", "2025-11-18T05:05:10"]),
    "said by a late line": (
        ["03/04/2025 06:00:00"] * 300 + ["03/14/2025 06:00:00"],
        [*["2025-03-04T05:00:00"] * 300, "2025-03-14T05:00:00"],
    ),
    "either": (["07/11/2025 06:05:10", "08/11/2025 06:05:10"], "day/month or month/day"),
    "the same": (["11/11/2025 06:05:10"], ["2025-11-11T05:05:10"]),
    "24:00": (
        ["18.11.2025 24:00:00", "19.11.2025 00:00:10"],
        ["2025-11-18T23:00:00", "2025-11-18T23:00:10"],
    ),
    "an hour that never was": (["30.03.2025 02:30:00", "30.03.2025 03:15:00"], NEVER),
    "empty": (["18.11.2025 06:05:00", "", "18.11.2025 06:07:00"], ["2025-11-18T05:05:00", None, "2025-11-18T05:07:00"]),
    "Unix": (["18.11.2025 06:05:00", "01.01.1970 01:00:00"], ["2025-11-18T05:05:00", None]),
    "a spreadsheet": (["30.12.1899 00:00:00", "18.11.2025 06:05:00"], [None, "2025-11-18T05:05:00"]),
    "a clock that was never set": (["18.11.2025 06:05:00", "01.01.2000 00:00:00"], ["2025-11-18T05:05:00", None]),
    "a true midnight": (
        ["31.12.1999 23:59:00", "01.01.2000 00:00:00"],
        ["1999-12-31T22:59:00", "1999-12-31T23:00:00"],
    ),
    "history": (["07.05.1992 13:43:21"], ["1992-05-07T11:43:21"]),
    "a default alone": (["01.01.1970 00:00:00"] * 300, [None] * 300),
    "zeros": (["18.11.2025 06:05:00", "00.00.0000 00:00:00"], ["2025-11-18T05:05:00", None]),
    "zeros alone": (["00.00.0000 00:00:00", "30.12.1899 00:00:00"], [None, None]),
    "dated below many without": (
        ["01.01.1900 00:00:00"] * 300 + ["18.11.2025 06:05:00"],
        [*[None] * 300, "2025-11-18T05:05:00"],
    ),
}


def utc(at: Any) -> str | None:
    moment = datetime.fromisoformat(at) if isinstance(at, str) else at
    return None if moment is None else moment.astimezone(UTC).replace(tzinfo=None).isoformat()


def table(path: Path, times: list[str]) -> Path:
    path.write_text("time;actual\n" + "".join(f"{at};40,00{n % 10}\n" for n, at in enumerate(times)))
    return path


def imported(path: Path) -> Answer:
    found = list(lines(path, look(path, Wishes(timezone=ZONE, mapping={"measured": "actual"})), "shaft-d40", now=NOW))
    flaws = [str(each) for each in found if isinstance(each, Flaw)]
    return flaws[0] if flaws else [utc(each.reading.measured_at) for each in found if isinstance(each, Line)]


def through_the_bridge(path: Path, **settings: Any) -> Answer:
    content = read_content(machine(path.parent, **settings), (path,))
    return str(content.faults[0]) if content.faults else [utc(each.body.get("measured_at")) for each in content.entries]


def aqdef(path: Path, times: list[str]) -> Path:
    head = ["K0100 1", "K1001 P", "K2001/1 D40", "K2002/1 Bore", "K2142/1 mm", "K2004/1 0"]
    values = [f"40.00{n % 10}{F}0{F}{at.replace(' ', '/', 1)}" for n, at in enumerate(times)]
    path.write_text("\r\n".join([*head, *values, ""]), newline="")
    return path


def aqdef_imported(path: Path, folder: Path) -> Answer:
    found = sort_out(Source.at(path), {1: Wanted(1.0, ("P", "D40", "Bore"))}, AqdefWishes(ZoneInfo(ZONE)), folder, None)
    if found.flaws:
        return str(found.flaws[0])
    kept = (msgspec.json.decode(line, type=Kept) for line in (folder / "1").read_bytes().splitlines())
    return [utc(each.at) for each in kept]


def check(found: Answer, expected: Answer) -> None:
    if isinstance(expected, str):
        assert isinstance(found, str), found
        assert expected in found
    else:
        assert found == expected


@pytest.mark.parametrize("name", CASES)
def test_tables_are_read_alike_by_import_and_bridge(tmp_path: Path, name: str) -> None:
    times, expected = CASES[name]
    path = table(tmp_path / "a.csv", times)
    check(imported(path), expected)
    columns = {"measured_at": "time", "measured": "actual"}
    check(through_the_bridge(path, names={"*": "shaft-1"}, columns=columns, decimal=","), expected)


@pytest.mark.parametrize("name", CASES)
def test_aqdef_is_read_alike_by_import_and_bridge(tmp_path: Path, name: str) -> None:
    times, expected = CASES[name]
    if name == "empty":  # a field that is empty goes on as above in AQDEF: the same time that a table's line gets
        expected = ["2025-11-18T05:05:00", "2025-11-18T05:05:00", "2025-11-18T05:07:00"]
    path = aqdef(tmp_path / "a.dfq", times)
    folder = tmp_path / "kept"
    folder.mkdir()
    check(aqdef_imported(path, folder), expected)
    check(through_the_bridge(path, format="aqdef", names={"D40": "shaft-1"}), expected)


@pytest.mark.parametrize(
    "times", [["30.12.1899 06:05:00", "30.12.1899 06:06:00"], ["01.01.2000 00:00:00"]], ids=["of a day", "a midnight"]
)
def test_a_default_that_may_say_something_is_refused_where_no_line_has_another(
    tmp_path: Path, times: list[str]
) -> None:
    check(imported(table(tmp_path / "a.csv", times)), DEFAULT)


def test_a_column_without_a_single_time_is_none_of_times(tmp_path: Path) -> None:
    for times in (["01.01.1970 01:00:00"] * 2, [""] * 300, ["0000-00-00 00:00:00", ""]):
        layout = look(table(tmp_path / "a.csv", times), Wishes(timezone=ZONE, mapping={"measured": "actual"}))
        assert layout.columns == {"measured": (1,)}, "so it is said that all get the time of the import"


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (["1763442300123"], "milliseconds since 1970-01-01"),
        (["1763442300"], "seconds since 1970-01-01"),
        (["45979.2534"], "days since 1899-12-30"),
        (["18.11.25 06:05:11"], "--time-format"),
        (["2025-11-18 06:07:00 CET"], "is not a time"),
        (["26.10.2025 02:15"], "2025-10-26T02:15:00+02:00 or 2025-10-26T02:15:00+01:00"),
    ],
)
def test_a_refusal_names_a_form_that_reads_it(tmp_path: Path, times: list[str], said: str) -> None:
    path = table(tmp_path / "a.csv", times)
    check(imported(path), said)
    if said.endswith(("1970-01-01", "1899-12-30")):
        form = Wishes(timezone=ZONE, mapping={"measured": "actual"}, time_format=said)
        (line,) = lines(path, look(path, form), "shaft-d40", now=NOW)
        assert isinstance(line, Line), line
        assert line.reading.measured_at is not None
        assert line.reading.measured_at.year == 2025


def test_a_footer_without_a_time_is_no_reading(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(
        "nr;time;actual\n1;18.11.2025 06:05:00;40,001\n2;;40,002\n3;18.11.2025 06:07:00;40,003\nMean;;40,002\n"
    )
    check(imported(path), "line 5: 'Mean' holds limits or statistics, no part")
    path.write_text(path.read_text().replace("Mean;;40,002\n", ""))
    check(imported(path), ["2025-11-18T05:05:00", None, "2025-11-18T05:07:00"])


def test_a_line_without_a_time_has_that_of_the_line_above_and_is_named(plant: Database, tmp_path: Path) -> None:  # noqa: F811
    path = table(tmp_path / "a.csv", ["18.11.2025 06:05:00", "", "01.01.1970 00:00:00", "18.11.2025 06:07:00"])
    wishes = Wishes(timezone=ZONE, mapping={"measured": "actual"})
    summary = run(plant, path, wishes=wishes)
    assert summary.notes == ["lines 3, 4: no time; it is that of the line above."]
    stored = rows(plant.dsn, "SELECT extract(minute FROM measured_at), late FROM reading ORDER BY sequence")
    assert [(int(minute), late) for minute, late in stored] == [(5, False), (5, False), (5, False), (7, False)]
    assert run(plant, path, wishes=wishes).stored == 0, "the same file again"


def test_lines_above_the_first_time_have_that_of_it(plant: Database, tmp_path: Path) -> None:  # noqa: F811
    """Not that of today, by which a history would begin with its newest reading."""
    path = table(tmp_path / "a.csv", ["", "01.01.1980 00:12:00", "18.11.2025 06:05:00", "18.11.2025 06:07:00"])
    summary = run(plant, path, wishes=Wishes(timezone=ZONE, mapping={"measured": "actual"}))
    assert summary.notes == ["lines 2, 3: no time; it is that of the first line below that has one."]
    assert summary.first_at == datetime(2025, 11, 18, 5, 5, tzinfo=UTC)
    stored = rows(plant.dsn, "SELECT extract(minute FROM measured_at), late FROM reading ORDER BY sequence")
    assert [(int(minute), late) for minute, late in stored] == [(5, False), (5, False), (5, False), (7, False)]


def test_a_table_of_missing_values_is_refused_for_them(plant: Database, tmp_path: Path) -> None:  # noqa: F811
    path = tmp_path / "a.csv"
    path.write_text("time;actual\n18.11.2025 06:05:00;---\n")
    with pytest.raises(Invalid, match=r"holds no readings: line 2: .*missing"):
        run(plant, path, wishes=Wishes(timezone=ZONE, mapping={"measured": "actual"}, missing=frozenset(["---"])))
