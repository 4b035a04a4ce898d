"""Folders of measuring machines: files that are half there, locked, empty, delivered twice; and what lines become."""

import asyncio
import json
import os
import threading
import time
from contextlib import AbstractAsyncContextManager
from pathlib import Path
from typing import Any

import msgspec
import pytest

from app.bridge.configuration import ConfigurationError, Machine, configuration_from
from app.bridge.file_content import Content, read_content
from app.bridge.file_rows import Fault
from app.bridge.kinds import folder
from app.bridge.kinds.folder import Folder
from app.bridge.links import ControlAway, Decided, Misconfigured, Position, Received, carries_decisions
from app.bridge.store import Store
from app.bridge.unit import Unit
from app.files.aqdef.values import OF_FIELD as F
from app.simulators.controls.folder import FolderSimulator
from app.simulators.controls.model import Model
from tests.bridge.plant import PATIENCE, controlled, store_in, until
from tests.loops import run

HEAD = "time;part;feature;actual\n"
LINE = "23.11.2026 06:05:00;P1;D40;40,0123\n"
COLUMNS = {"measured_at": "time", "part": "part", "characteristic": "feature", "measured": "actual"}


def machine(folder: Path, unit: str = "mm", names: dict[str, str] | None = None, **other: Any) -> Machine:
    settings = {"path": str(folder), "format": "csv", "every": 0.05, "settle": 0.3, "zone": "Europe/Belgrade"}
    if other.get("format", "csv") == "csv":
        settings |= {"columns": COLUMNS, "decimal": ","}
    table = {"kind": "folder", "unit": unit, "secret": "x", "corrections": "none", "interval": 0.02, "patience": 30.0}
    content = {
        "server": {"url": "http://127.0.0.1:1"},
        "machine": {"cmm-1": table | {"folder": settings | other, "characteristics": names or {"D40": "shaft-1"}}},
    }
    return configuration_from(content, folder).machines[0]


def fetching(chosen: Machine, store: Store) -> AbstractAsyncContextManager[Unit]:
    return controlled(Unit(chosen, Folder(chosen), store))


def write(path: Path, text: str, encoding: str = "utf-8") -> Path:
    path.write_text(text, encoding=encoding, newline="")
    return path


async def sizes(store: Store) -> list[float]:
    return [row.body["measured"] for row in await store.waiting("cmm-1", 10_000)]


def read(tmp_path: Path, text: str, name: str = "a.csv", stamp: str = "", **other: Any) -> Content:
    return read_content(machine(tmp_path, **other), (write(tmp_path / name, text),), stamp)


# --- what lines become


def test_a_line_becomes_a_reading_with_its_time_in_the_zone(tmp_path: Path) -> None:
    content = read(tmp_path, HEAD + LINE)
    assert content.faults == []
    [entry] = content.entries
    assert entry.body == {
        "characteristic": "shaft-1",
        "measured": 40.0123,
        "part": "P1",
        "measured_at": "2026-11-23T06:05:00+01:00",
    }


def test_cells_missing_or_left_over_at_the_end_are_empty(tmp_path: Path) -> None:
    head = HEAD.strip() + ";comment;by;shift\n"
    content = read(tmp_path, head + LINE + LINE.strip() + ";;;;;\n" + LINE.strip())
    assert [len(content.faults), len(content.entries)] == [0, 3]


def test_tables_that_people_print_are_read(tmp_path: Path) -> None:
    text = "Plate: T-7\n\n  feature    actual\n      D40   40.0123\n      D40       ---\n  feature    actual\n      D40   40.0124\n"
    columns = {"characteristic": "feature", "measured": "actual"}
    content = read(tmp_path, text, columns=columns, decimal=".", delimiter="blanks", missing=["---"])
    assert (content.faults, [each.body["measured"] for each in content.entries]) == ([], [40.0123, 40.0124])
    assert content.remarks == [
        "line 5: 'D40' is marked as missing; passed over",
        "line 6: is the heading again; passed over",
    ]


def test_a_temperature_with_the_other_decimal_sign_is_left_out_and_said_once(tmp_path: Path) -> None:
    text = "feature;actual;part;temp\nD40;40,0123;P1;21.5\nD40;40,0124;P2;21.6\nD40;40,0125;P3;21,7\nD40;40,0126;P4;\n"
    columns = {"characteristic": "feature", "measured": "actual", "part": "part", "part_temperature": "temp"}
    content = read(tmp_path, text, columns=columns, decimal=",")
    assert [each.body.get("context") for each in content.entries] == [None, None, {"part_temperature": 21.7}, None]
    assert content.remarks == ["lines 2, 3, temp: '21.5' is not a number of °C, with decimal = \",\"; left out"]


def test_values_of_aqdef_that_are_empty_are_not_called_marked(tmp_path: Path) -> None:
    rows = [f"{F}0{F}23.11.2026/06:05:00", f"40.001{F}255{F}23.11.2026/06:06:00", f"40.002{F}0{F}23.11.2026/06:07:00"]
    text = "\n".join(["K0100 1", "K2001/1 D40", "K2142/1 mm", *rows, ""])
    content = read(tmp_path, text, "a.dfq", format="aqdef")
    assert [entry.body["measured"] for entry in content.entries] == [40.002]
    assert [remark.partition("; ")[0] for remark in content.remarks] == [
        "line 4: 'D40' has no value",
        "line 5: 'D40' is marked as not valid (K0002)",
    ]


def test_names_of_characteristics_may_be_columns(tmp_path: Path) -> None:
    columns = {"part": "part", "measured_at": "time"}
    names = {"D40 [mm]": "shaft-1", "D20 [mm]": "bore-1"}
    text = "time;part;D40 [mm];D20 [mm]\n23.11.2026 06:05:00;P1;40,01;20,02\n23.11.2026 06:06:00;P2;;20,03\n"
    content = read(tmp_path, text, columns=columns, names=names)
    assert [(each.body["characteristic"], each.body["measured"]) for each in content.entries] == [
        ("shaft-1", 40.01),
        ("bore-1", 20.02),
        ("bore-1", 20.03),
    ]


def test_the_unit_of_a_column_is_that_of_its_header(tmp_path: Path) -> None:
    names = {"D40 [µm]": "shaft-1", "D20": "bore-1"}
    content = read(tmp_path, "D40 [µm];D20;part\n40010;2,0;P1\n", columns={"part": "part"}, names=names, unit="inch")
    assert [each.body["measured"] for each in content.entries] == [40.01, 50.8]
    content = read(
        tmp_path, "measured [Nm];part\n25;P1\n", columns={"measured": "measured [Nm]"}, names={"*": "shaft-1"}
    )
    assert (content.entries, [each.field for each in content.faults]) == ([], ["Nm"])
    assert "names the unit Nm" in content.faults[0].reason


def test_ndjson_is_read_by_the_names_of_the_fields(tmp_path: Path) -> None:
    text = '{"characteristic": "D40", "measured": 1.5, "part": 7, "measured_at": "2026-11-23T05:05:00Z"}\n'
    content = read(tmp_path, text, "a.ndjson", format="ndjson", unit="inch")
    assert content.faults == []
    assert content.entries[0].body["measured"] == 38.1
    assert content.entries[0].body["part"] == "7"


def test_text_is_read_by_expressions_and_what_stands_above_holds(tmp_path: Path) -> None:
    text = "PART P7\nDATE 23.11.2026 06:05:00\nFEATURE D40\nSIZE 40.0 ACTUAL 40.012 DEV 0.012\nFEATURE D20\nSIZE 20.0 ACTUAL 20.1\n"
    lines = [
        r"^PART (?P<part>\S+)",
        r"^DATE (?P<measured_at>.+)$",
        r"^FEATURE (?P<characteristic>\S+)",
        r"ACTUAL (?P<measured>[-\d.]+)",
    ]
    names = {"D40": "shaft-1", "D20": "bore-1"}
    content = read(tmp_path, text, "a.txt", format="text", lines=lines, names=names)
    assert [(each.line, each.body["characteristic"], each.body["measured"]) for each in content.entries] == [
        (4, "shaft-1", 40.012),
        (6, "bore-1", 20.1),
    ]
    assert {each.body["part"] for each in content.entries} == {"P7"}


DESCRIPTION = "K0100 2\nK1001 4711\nK2001/1 10\nK2002/1 D40\nK2142/1 mm\nK2001/2 20\nK2002/2 D20\nK2142/2 µm\n"
VALUES = "40.0123\x140\x1423.11.2026/06:05:00\x0f20020\x140\x1423.11.2026/06:05:00\n40.0130\x14256\x1423.11.2026/06:06:00\x0f20021\x140\n"


AQDEF_NAMES = {"10": "shaft-1", "D20": "bore-1"}


@pytest.mark.parametrize("names", [AQDEF_NAMES, {"4711/10": "shaft-1", "4711/D20": "bore-1"}])
def test_aqdef_is_read_by_number_or_name_with_or_without_the_part(tmp_path: Path, names: dict[str, str]) -> None:
    content = read(tmp_path, DESCRIPTION + VALUES, "a.dfq", format="aqdef", names=names)
    assert content.faults == []
    assert [(each.body["characteristic"], each.body["measured"]) for each in content.entries] == [
        ("shaft-1", 40.0123),
        ("bore-1", 20.02),
        ("bore-1", 20.021),
    ]
    assert content.entries[0].body["measured_at"] == "2026-11-23T06:05:00+01:00"
    assert content.skipped == 1


@pytest.mark.parametrize(
    ("member", "words"),
    [
        ('"measured": 1' + 400 * "0", "line 1: holds 1000"),
        ('"measured": 1e999', "line 1: holds 1e999, which is not a number"),
        ('"measured": 1, "part": "\\ud800"', "line 1: holds half a character"),
        ('"measured": ' + 100_000 * "[", "line 1: is no reading: its JSON is nested too deep"),
    ],
    ids=["large", "infinite", "half a character", "deep"],
)
def test_json_that_could_not_be_sent_on_fails(tmp_path: Path, member: str, words: str) -> None:
    text = f'{{"characteristic": "D40", {member}}}\n'
    content = read(tmp_path, text, "a.ndjson", format="ndjson", unit="inch")
    assert words in str(content.faults[0])


@pytest.mark.parametrize(
    ("text", "settings", "words"),
    [
        (HEAD + LINE.replace("40,0123", "40.0123"), {}, "line 2, actual: '40.0123' has a point"),
        (HEAD + LINE.replace("D40", "D50"), {}, "line 2: 'D50' is not named in machine.cmm-1.characteristics"),
        (HEAD + LINE, {"zone": None}, "line 2, time: '23.11.2026 06:05:00' does not say in which time zone"),
        (HEAD + "23.11.2026 06:05:00;P1\n", {}, "line 2: names no characteristic"),
        (HEAD + "23.11.2026 06:05:00;P1;D40\n", {}, "line 2, actual: is empty"),
        (
            HEAD + LINE + LINE[:-9],
            {},
            "line 3: has 3 cells, lines above have 4, and has no end: the file is cut off here",
        ),
        (HEAD + LINE.replace("40,0123", "40,0123;1"), {}, "line 2: has 5 columns, the header has 4"),
        (LINE + LINE, {}, "is no column of this file"),
        (HEAD, {}, "The file holds no readings"),
        (HEAD + LINE.replace("23.11.2026 06:05:00", "25.10.2026 02:30:00"), {}, "is there twice in Europe/Belgrade"),
    ],
)
def test_what_is_wrong_is_said_with_line_and_field(tmp_path: Path, text: str, settings: Any, words: str) -> None:
    content = read(tmp_path, text, **settings)
    assert words in str(content.faults[0])
    [entry] = content.received("cmm-1", "a.csv")
    assert entry.fault is not None
    assert words in entry.fault


def test_the_hour_that_is_there_twice_goes_by_the_order_of_each_characteristic(tmp_path: Path) -> None:
    times = [f"K0001/{at} {size}\nK0004/{at} 25.10.2026/02:{minute}:00\n" for at, size, minute in
             ((1, 40.01, 10), (1, 40.02, 50), (2, 20010, 10), (2, 20020, 50), (2, 20030, 20))]  # fmt: skip
    content = read(tmp_path, DESCRIPTION + "".join(times), "a.dfq", format="aqdef", names=AQDEF_NAMES)
    offsets = [each.body["measured_at"][11:] for each in content.entries if each.body["characteristic"] == "bore-1"]
    assert offsets == ["02:10:00+02:00", "02:50:00+02:00", "02:20:00+01:00"]


def test_doubtful_dates_of_aqdef_are_not_guessed(tmp_path: Path) -> None:
    text = DESCRIPTION + "40.01\x140\x1403/04/2026/06:05:00\n"
    names = {"D40": "shaft-1", "D20": "bore-1"}
    assert "day_first" in str(read(tmp_path, text, "a.dfq", format="aqdef", names=names).faults[0])
    content = read(tmp_path, text, "a.dfq", format="aqdef", names=names, day_first=True)
    assert content.entries[0].body["measured_at"].startswith("2026-04-03T06:05:00")


def test_a_size_too_large_to_be_converted_fails(tmp_path: Path) -> None:
    for unit, text in (
        ("inch", DESCRIPTION.replace("K2142/1 mm\n", "")),
        ("mm", DESCRIPTION.replace("1 mm", "1 inch")),
    ):
        values = "1E308\x140\x1423.11.2026/06:05:00\x0f20020\x140\x1423.11.2026/06:05:00\n"
        content = read(tmp_path, text + values, "a.dfq", format="aqdef", names=AQDEF_NAMES, unit=unit)
        assert "1e+308 is not a number" in str(content.faults[0])


def test_others_are_passed_over_where_it_is_said(tmp_path: Path) -> None:
    content = read(tmp_path, HEAD + LINE + LINE.replace("D40", "D50"), others="skip")
    assert (len(content.entries), content.skipped, content.faults) == (1, 1, [])


def test_keys_stay_when_a_file_grows_or_changes_its_line_ends(tmp_path: Path) -> None:
    first = read(tmp_path, HEAD + LINE, stamp="a")
    grown = read(tmp_path, (HEAD + LINE + LINE).replace("\n", "\r\n"), stamp="b")
    keys = [each.key for each in grown.entries]
    assert keys[0] == first.entries[0].key
    assert len(set(keys)) == 2
    assert all(len(key) <= 128 for key in keys)


def test_keys_of_aqdef_stay_whatever_the_head_of_the_file_becomes(tmp_path: Path) -> None:
    first = read(tmp_path, DESCRIPTION + VALUES, "a.dfq", format="aqdef", names=AQDEF_NAMES)
    other = DESCRIPTION.replace("K2142/1 mm", "K1205 24.11.2026\nK2142/1 mm") + VALUES.replace("20020", "2.0020E+0004")
    again = read(tmp_path, other, "b.dfq", format="aqdef", names=AQDEF_NAMES)
    assert [each.key for each in again.entries] == [each.key for each in first.entries]
    assert len({each.key for each in first.entries}) == 3


def test_readings_without_time_and_part_are_distinguished_by_the_file(tmp_path: Path) -> None:
    columns = {"measured": "actual", "characteristic": "feature"}
    text = "feature;actual\nD40;40,01\n"
    keys = {read(tmp_path, text, stamp=stamp, columns=columns).entries[0].key for stamp in ("a", "b", "b")}
    assert len(keys) == 2


@pytest.mark.parametrize(("field", "keys"), [("K0006/1 B7", 2), ("K0014/1 S7", 1), ("K0004/1 23.11.2026/06:05", 1)])
def test_parts_of_one_batch_that_are_as_large_are_not_taken_for_one(tmp_path: Path, field: str, keys: int) -> None:
    text = f"{DESCRIPTION}K0001/1 40.01\n{field}\n"
    files = [read(tmp_path, text, f"{name}.dfq", name, format="aqdef", names=AQDEF_NAMES) for name in "abb"]
    assert len({file.entries[0].key for file in files}) == keys


def test_an_own_key_names_the_reading_wherever_it_stands(tmp_path: Path) -> None:
    columns = {"measured": "actual", "characteristic": "feature", "key": "id"}
    one = read(tmp_path, "id;feature;actual\n7;D40;40,01\n", columns=columns)
    two = read(tmp_path, "id;feature;actual\n6;D40;40,02\n7;D40;40,01\n", columns=columns)
    assert one.entries[0].key == two.entries[1].key


# --- lines that move: newest first, rolling windows, files that are written again

A, B, C = (f"23.11.2026 06:0{minute}:30;P{minute};D40;40,01{minute}\n" for minute in (5, 6, 7))
OTHERWISE = '{"id": 2, "machined_at": "2026-11-23T06:05:00+00:00", "measured": 40.010, "characteristic": "D40"}\n'
LATER_TITLE = "Printed 23.11.2026 06:08\n"
NO_PART = {"measured_at": "time", "characteristic": "feature", "measured": "actual"}


def keys_of(tmp_path: Path, *lines: str, head: str = HEAD, **other: Any) -> list[str]:
    return [each.key for each in read(tmp_path, head + "".join(lines), **other).entries]


@pytest.mark.parametrize(
    ("before", "after", "new"),
    [
        ((A, B), (A, B, C), 1),  # appended
        ((B, A), (C, B, A), 1),  # newest first
        ((A, B), (B, C), 1),  # a rolling window
        ((B, A), (C, B), 1),  # a rolling window, newest first
        ((A, B, C), (A, C), 0),  # a line was deleted
        ((A, B), (B, A), 0),  # sorted otherwise
        ((A, A), (A, A), 0),
        ((A, A), (A, A, A), 1),
        ((A, A), (B, A, A), 1),
        ((A, A, B), (A, B, B), 1),
        ((A,), (A.replace("40,015", "40,0150"),), 0),  # the same size written otherwise
        ((A,), (A.replace("40,015", "40,016"),), 1),  # measured again, as large as never before
        ((A,), (A.replace("P5", "P6"),), 1),
        ((A,), (A.replace(":30", ":31"),), 1),
    ],
)
def test_a_line_with_a_time_is_the_same_reading_wherever_it_stands(
    tmp_path: Path, before: tuple[str, ...], after: tuple[str, ...], new: int
) -> None:
    first = keys_of(tmp_path, *before, stamp="a")
    second = keys_of(tmp_path, *after, stamp="b", name="b.csv")
    assert len({*first}) == len(first)
    assert len({*second}) == len(second)
    assert len({*second} - {*first}) == new


@pytest.mark.parametrize(
    ("before", "after", "settings"),
    [
        (HEAD + A, LATER_TITLE + HEAD + B + A, {}),
        ("nr;" + HEAD + "1;" + A, "nr;" + HEAD + "1;" + B + "2;" + A, {}),  # numbered again from above
        (HEAD[:-1] + ";remark\n" + A[:-1] + ";\n", HEAD[:-1] + ";remark\n" + B[:-1] + ";\n" + A[:-1] + ";ok\n", {}),
        (
            "time;D40;D41\n23.11.2026 06:05:00;40,01;\n",  # the second size comes later
            "time;D40;D41\n23.11.2026 06:05:00;40,01;41,02\n",
            {"columns": {"measured_at": "time"}, "names": {"D40": "shaft-1", "D41": "shaft-2"}},
        ),
        (
            '{"measured": 40.01, "characteristic": "D40", "machined_at": "2026-11-23T06:05:00Z", "id": 1}\n',
            OTHERWISE + '{"measured": 40.02, "characteristic": "D40", "machined_at": "2026-11-23T06:06:00Z"}\n',
            {"format": "ndjson"},
        ),
        (
            "PART 1\nD40 40.01 2026-11-23T06:05:00\n",
            "PART 2\nD40 40.02 2026-11-23T06:06:00\nPART 1\nD40 40.01 2026-11-23T06:05:00\n",
            {
                "format": "text",
                "lines": [r"^PART (?P<part>\S+)", r"^(?P<characteristic>D40) (?P<measured>\S+) (?P<measured_at>\S+)"],
            },
        ),
    ],
)
def test_what_stands_around_a_size_makes_no_other_reading_of_it(
    tmp_path: Path, before: str, after: str, settings: dict[str, Any]
) -> None:
    first, second = read(tmp_path, before, **settings), read(tmp_path, after, **settings)
    assert first.faults == second.faults == []
    assert len(first.entries) == 1
    assert len(second.entries) == 2
    assert first.entries[0].key in {each.key for each in second.entries}


def test_parts_that_were_measured_in_one_second_stay_as_many(tmp_path: Path) -> None:
    line = "23.11.2026 06:05:00;D40;40,01\n"
    keys = keys_of(tmp_path, line, line, line, head="time;feature;actual\n", columns=NO_PART)
    assert len({*keys}) == 3


def test_a_line_without_a_time_belongs_to_what_stands_above_it(tmp_path: Path) -> None:
    """Its part may be the number of a drawing: as large a size of the next file is another part."""
    columns = {"part": "part", "characteristic": "feature", "measured": "actual"}
    first = keys_of(tmp_path, "4711;D40;40,01\n", head="part;feature;actual\n", columns=columns)
    text = "4711;D40;40,02\n", "4711;D40;40,01\n"
    assert not {*first} & {*keys_of(tmp_path, *text, head="part;feature;actual\n", columns=columns)}


@pytest.mark.parametrize("time", ["23.11.2026", "23.11.2026 06:05"])
def test_as_large_a_size_of_the_same_day_or_minute_is_another_part(tmp_path: Path, time: str) -> None:
    first = keys_of(tmp_path, f"{time};D40;40,01\n", head="time;feature;actual\n", columns=NO_PART)
    text = f"{time};D40;40,02\n", f"{time};D40;40,01\n"
    assert not {*first} & {*keys_of(tmp_path, *text, head="time;feature;actual\n", columns=NO_PART)}


def test_a_time_that_is_a_program_s_default_makes_no_line_known(tmp_path: Path) -> None:
    """It means that there is none, though it is written to the second."""
    dated, undated = "23.11.2026 06:05:00;D40;40,02\n", "01.01.1970 00:00:00;D40;40,01\n"
    first, second = (
        keys_of(tmp_path, *lines, head="time;feature;actual\n", columns=NO_PART)
        for lines in ((dated, undated), (dated, dated, undated))
    )
    assert set(first) & set(second) == {first[0]}


def test_readings_that_stand_newest_first_come_in_the_order_of_time(tmp_path: Path) -> None:
    def parts(*lines: str) -> list[str]:
        return [each.body["part"] for each in read(tmp_path, HEAD + "".join(lines)).entries]

    twin = B.replace("P6", "twin")
    assert parts(C, B, A) == ["P5", "P6", "P7"]
    assert parts(C, twin, B, A) == ["P5", "P6", "twin", "P7"]
    assert parts(A, C, B) == ["P5", "P7", "P6"]  # as the program wrote them
    assert parts(B, twin) == ["P6", "twin"]
    assert parts(B, A) == ["P6", "P5"]  # one step back is a late reading


def test_a_window_that_rolls_stores_each_part_once_though_the_bridge_starts_again(tmp_path: Path) -> None:
    async def work() -> None:
        lines = [f"23.11.2026 06:{at // 2:02}:00;D40;40,0{at // 2 % 10}\n" for at in range(24)]  # pairs of equal ones
        store = store_in(tmp_path / "store")
        for newest in range(6, 25, 2):
            window = lines[newest - 6 : newest]
            link = Folder(machine(tmp_path, columns=NO_PART))
            await link.connect()
            write(tmp_path / "a.csv", "time;feature;actual\n" + "".join(reversed(window)))
            received = await fetched(link)
            await store.add("cmm-1", received)
            if newest % 4:  # else the bridge ends before the file is moved
                await link.acknowledge(received)
            await link.close()
        assert len(await sizes(store)) == 24
        times = [row.body["measured_at"] for row in await store.waiting("cmm-1")]
        assert times == sorted(times)
        store.close()

    run(work())


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"path": "out"}, "is not absolute"),
        ({"zone": "Belgrade"}, "There is no time zone 'Belgrade'"),
        ({"columns": {"size": "actual"}}, "columns.size is no field"),
        ({"format": "text", "lines": ["(?P<measured>"]}, "is no regular expression"),
        ({"format": "text"}, "needs the group"),
        ({"done": "."}, "two other folders"),
    ],
)
def test_contradictions_are_reported_with_their_place(tmp_path: Path, settings: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigurationError, match=r"machine.cmm-1.folder") as caught:
        machine(tmp_path, **settings)
    assert words in str(caught.value)


# --- the folder


def test_a_file_is_stored_once_and_moved_then(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        inbox = tmp_path / "in"
        inbox.mkdir()
        async with fetching(machine(inbox), store):
            write(inbox / "a.csv", HEAD + LINE)
            await until((inbox / "done" / "a.csv").exists, "the first file is done")
            write(inbox / "a.csv", HEAD + LINE)
            await until((inbox / "done" / "a-2.csv").exists, "the same file again is done")
            write(inbox / "b.csv", HEAD + LINE)
            await until((inbox / "done" / "b.csv").exists, "the same under another name is done")
        assert await sizes(store) == [40.0123]
        store.close()

    run(work())


def test_nothing_is_moved_before_it_is_stored(tmp_path: Path) -> None:
    async def work() -> None:
        link = Folder(machine(tmp_path))
        path = write(tmp_path / "a.csv", HEAD + LINE)
        assert await link.connect() == str(tmp_path)
        received = await link.fetch(Position())
        assert [each.body["measured"] for each in received] == [40.0123]
        assert path.exists()
        assert not (tmp_path / "done").exists()
        await link.acknowledge(received)
        assert not path.exists()
        await link.close()

    run(work())


def test_a_file_that_cannot_be_read_fails_as_a_whole_and_says_why(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        async with fetching(machine(tmp_path), store):
            write(tmp_path / "a.csv", HEAD + LINE + LINE.replace("40,0123", "forty"))
            await until((tmp_path / "failed" / "a.csv").exists, "the file has failed")
            assert await store.waiting("cmm-1") == []
            [refused] = await store.quarantine("cmm-1")
            assert "line 3, actual: 'forty' is not a number" in refused.reason
            why = (tmp_path / "failed" / "a.csv.why.txt").read_text(encoding="utf-8")
            assert "line 3, actual: 'forty'" in why
            assert str(tmp_path) in why
            (tmp_path / "failed" / "a.csv").unlink()
            write(tmp_path / "a.csv", HEAD + LINE + LINE)  # put right
            await until((tmp_path / "done" / "a.csv").exists, "the file is done")
        assert await sizes(store) == [40.0123, 40.0123]
        store.close()

    run(work())


def test_a_reason_of_many_lines_is_said_once_and_that_of_the_whole_file_first(tmp_path: Path) -> None:
    rows = [*["23.11.2026 06:05:00;P1;D40;forty\n"] * 30, "23.11.2026 06:05:00;P1;D99;1\n" * 2, LINE.strip()]
    content = read(tmp_path, HEAD + "".join(rows))
    content.faults.append(Fault(None, "", "The file is too old."))
    seen = folder.Seen((tmp_path / "a.csv",), ((1, 1),))
    [first, second, third] = [line for line in folder._why(seen, content, tmp_path).splitlines() if line[:2] == "- "]
    assert first == "- The file is too old."
    assert second.startswith("- lines 2, 3, 4 and 27 more, actual: 'forty' is not a number")
    assert third.startswith("- lines 32, 33: 'D99' is not named in machine.cmm-1.characteristics")
    [refused] = content.received("cmm-1", "a.csv")
    assert str(refused.fault).endswith("The file is too old. (and 2 more)")


def test_a_file_that_is_being_written_is_waited_for(tmp_path: Path) -> None:
    """Cut in the middle of a number, with its size unchanged over several looks: never 40.0 in place of 40.0123."""

    async def work() -> None:
        chosen = machine(tmp_path, settle=3600.0)
        link = Folder(chosen)
        whole = HEAD + LINE
        path = write(tmp_path / "a.csv", whole[:-4])
        await link.connect()
        for _ in range(4):
            assert await link.fetch(Position()) == []
            await asyncio.sleep(0.06)
        write(path, whole)
        received = await fetched(link)
        assert [each.body["measured"] for each in received] == [40.0123]
        await link.close()

    run(work())


def test_later_files_wait_for_one_that_is_being_written(tmp_path: Path) -> None:
    """Readings come in the order in which they were measured; a file that is never whole holds nothing up for long."""

    async def work() -> None:
        link = Folder(machine(tmp_path, settle=3600.0))
        write(tmp_path / "a.csv", HEAD + LINE[:-4])
        write(tmp_path / "b.csv", HEAD + LINE.replace("P1", "P2"))
        os.utime(tmp_path / "b.csv", (time.time() + 1, time.time() + 1))
        await link.connect()
        for _ in range(4):
            assert await link.fetch(Position()) == []
            await asyncio.sleep(0.06)
        write(tmp_path / "a.csv", HEAD + LINE)
        os.utime(tmp_path / "a.csv", (time.time() - 1, time.time() - 1))
        parts = []
        for _ in range(2):
            received = await fetched(link)
            parts += [each.body["part"] for each in received]
            await link.acknowledge(received)
        assert parts == ["P1", "P2"]
        await link.close()
        link = Folder(machine(tmp_path, settle=0.3))
        await link.connect()
        for number in range(40):  # a file that grows all the time, with an old time of modification
            write(tmp_path / "log.csv", HEAD + LINE[:-4] + "0" * number)
            os.utime(tmp_path / "log.csv", (1, 1))
            if number == 1:
                write(tmp_path / "d.csv", HEAD + LINE.replace("P1", "P3"))
            if found := await link.fetch(Position()):
                break
            await asyncio.sleep(0.06)
        assert [each.body["part"] for each in found] == ["P3"]
        await link.close()

    run(work())


async def fetched(link: Folder) -> list[Received]:
    found: list[Received] = []

    async def some() -> bool:
        found.extend(await link.fetch(Position()))
        return bool(found)

    await until(some, "readings")
    return found


def test_empty_files_and_single_halves_of_a_pair_fail_after_a_time(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        chosen = machine(tmp_path, format="aqdef", empty_after=0.5, names={"D40": "shaft-1", "D20": "bore-1"})
        async with fetching(chosen, store):
            write(tmp_path / "pair.dfx", VALUES)
            write(tmp_path / "pair.DFD", DESCRIPTION)
            await until((tmp_path / "done" / "pair.dfx").exists, "the pair is done")
            assert (tmp_path / "done" / "pair.DFD").exists()
            write(tmp_path / "empty.dfq", "")
            write(tmp_path / "single.dfx", VALUES)
            await until((tmp_path / "failed" / "empty.dfq").exists, "the empty file has failed")
            await until((tmp_path / "failed" / "single.dfx").exists, "the single file has failed")
        reasons = " ".join(each.reason for each in await store.quarantine("cmm-1"))
        assert "The file is empty" in reasons
        assert "one file is missing" in reasons
        assert await sizes(store) == [40.0123, 20.02, 20.021]
        store.close()

    run(work())


def test_a_file_that_has_grown_since_it_was_stored_is_not_moved_unread(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        link = Folder(machine(tmp_path))
        path = write(tmp_path / "a.csv", HEAD + LINE)
        await link.connect()
        received = await link.fetch(Position())
        await store.add("cmm-1", received)
        write(path, HEAD + LINE + LINE.replace("P1", "P2"))
        await link.acknowledge(received)
        assert path.exists()
        again = await fetched(link)
        await store.add("cmm-1", again)
        await link.acknowledge(again)
        assert not path.exists()
        assert [row.body["part"] for row in await store.waiting("cmm-1")] == ["P1", "P2"]
        await link.close()
        store.close()

    run(work())


def test_a_file_that_goes_on_growing_brings_its_new_lines_only(tmp_path: Path) -> None:
    """Nothing tells its readings apart but the file, and the bridge has not moved it yet."""

    async def work() -> None:
        store = store_in(tmp_path / "store")
        columns = {"measured": "actual", "characteristic": "feature"}
        link = Folder(machine(tmp_path, columns=columns))
        text = "feature;actual\n"
        await link.connect()
        for size in ("40,01", "40,02", "40,02"):
            text += f"D40;{size}\n"
            path = write(tmp_path / "a.csv", text)
            received = await fetched(link)
            await store.add("cmm-1", received)
            write(path, text + "D40;40,03\n")  # before it can be moved
            await link.acknowledge(received)
        again = await fetched(link)
        await store.add("cmm-1", again)
        await link.acknowledge(again)
        assert await sizes(store) == [40.01, 40.02, 40.02, 40.03]
        write(tmp_path / "a.csv", text)  # another file under the same name
        await store.add("cmm-1", await fetched(link))
        assert len(await sizes(store)) == 7
        await link.close()
        store.close()

    run(work())


def test_a_file_that_takes_longer_than_a_call_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    read_in_time, began, go_on = read_content, [], threading.Event()

    def slow(*given: Any) -> Content:
        began.append(given)
        go_on.wait(PATIENCE)
        return read_in_time(*given)

    monkeypatch.setattr(folder, "read_content", slow)

    async def work() -> None:
        store = store_in(tmp_path / "store")
        write(tmp_path / "a.csv", HEAD + LINE)
        async with fetching(msgspec.structs.replace(machine(tmp_path), patience=0.3), store) as unit:
            await until(lambda: "a.csv is still being read" in unit.detail, "the bridge says so")
            go_on.set()
            await until((tmp_path / "done" / "a.csv").exists, "the file is done")
        assert await sizes(store) == [40.0123]
        assert len(began) == 1
        store.close()

    run(work())


def test_a_folder_that_is_away_is_reported_and_comes_back(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        inbox = tmp_path / "in"
        async with fetching(machine(inbox), store) as unit:
            await until(lambda: "is the share mounted" in unit.detail, "the bridge says so")
            assert unit.state == "control_away"
            inbox.mkdir()
            write(inbox / "a.csv", HEAD + LINE)
            await until((inbox / "done" / "a.csv").exists, "the file is done")
        store.close()

    run(work())


def test_a_file_in_the_folder_names_it(tmp_path: Path) -> None:
    async def work() -> None:
        write(tmp_path / "inband-identity.txt", "CMM-4711\n")
        link = Folder(machine(tmp_path))
        assert await link.connect() == "CMM-4711"
        await link.close()

    run(work())


def test_files_that_cannot_be_moved_hold_up_no_others_and_are_reported(tmp_path: Path) -> None:
    async def work() -> None:
        write(tmp_path / "done", "a file where the folder should be")
        link = Folder(machine(tmp_path))
        await link.connect()
        for name in ("a.csv", "b.csv"):
            write(tmp_path / name, HEAD + LINE.replace("P1", name))
        parts = set()
        for _ in range(2):
            received = await fetched(link)
            parts.add(received[0].body["part"])
            await link.acknowledge(received)
        assert parts == {"a.csv", "b.csv"}
        with pytest.raises(Misconfigured, match=r"is stored, but cannot be moved"):
            await fetched(link)
        (tmp_path / "done").unlink()
        await asyncio.sleep(0.06)
        await link.fetch(Position())
        assert {path.name for path in (tmp_path / "done").iterdir()} == parts
        await link.close()

    run(work())


TEMPERATURES = {"characteristic": "feature", "measured": "actual", "part": "part", "part_temperature": "temp"}


def test_a_temperature_that_is_left_out_is_logged_once_and_reported_until_a_good_one_comes(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    head = "feature;actual;part;temp\n"
    words = "File a.csv, lines 2, 3, temp: '21.5' is not a number of °C, with decimal = \",\"; left out."

    async def work() -> None:
        store = store_in(tmp_path)
        watched = tmp_path / "watched"
        watched.mkdir()

        def measure(name: str, *lines: str) -> None:
            write(watched / name, "\n".join([head.strip(), *lines, ""]))

        async with fetching(machine(watched, columns=TEMPERATURES), store) as unit:
            measure("a.csv", "D40;40,0123;P1;21.5", "D40;40,0124;P2;21.6", "D40;40,0125;P3;21,7")
            await until(lambda: unit.detail == words, "the temperature is named")
            measure("b.csv", "D40;40,0126;P4;")
            await until((watched / "done" / "b.csv").exists, "a file without a temperature")
            assert unit.detail == words
            measure("c.csv", "D40;40,0127;P5;21,8")
            await until(lambda: not unit.detail, "a good temperature")
        assert len(await sizes(store)) == 5
        store.close()

    with caplog.at_level("INFO"):
        run(work())
    assert sum(words in each.getMessage() for each in caplog.records) == 1


SECRET = "inband_the-key-of-the-machine;x\nmore;of it\n"


def test_links_are_neither_read_nor_quoted_and_files_beside_them_are_taken(tmp_path: Path) -> None:
    async def work() -> None:
        watched = tmp_path / "watched"
        watched.mkdir()
        secret = write(tmp_path / "m.key", SECRET)
        (watched / "p_k.csv").symlink_to(secret)
        (watched / "inband-identity.txt").symlink_to(secret)
        os.mkfifo(watched / "pipe.csv")
        write(watched / "a.csv", HEAD + LINE)
        link = Folder(machine(watched))
        with pytest.raises(Misconfigured) as caught:
            await link.connect()
        assert "inband_" not in str(caught.value)
        (watched / "inband-identity.txt").unlink()
        await link.connect()
        received = await fetched(link)
        assert [each.body["part"] for each in received] == ["P1"]
        assert "p_k.csv is a link, which is not followed" in link.remark
        await link.acknowledge(received)
        assert [path.name for path in (watched / "done").iterdir()] == ["a.csv"]
        assert (watched / "p_k.csv").is_symlink()
        await link.close()

    run(work())


@pytest.mark.parametrize("other", ["link", "pipe"])
def test_a_file_that_becomes_a_link_or_a_pipe_before_it_is_opened_is_not_read(tmp_path: Path, other: str) -> None:
    secret = write(tmp_path / "m.key", SECRET)
    watched = tmp_path / "watched"
    watched.mkdir()
    file = write(watched / "a.csv", HEAD + LINE)
    link = Folder(machine(watched))
    [seen] = link._files()
    file.unlink()
    if other == "link":
        file.symlink_to(secret)
    else:
        os.mkfifo(file)
    assert link._read(seen, unchanged=1000.0) is None


def test_the_reason_of_a_failed_file_is_not_written_through_a_link(tmp_path: Path) -> None:
    async def work() -> None:
        watched = tmp_path / "watched"
        (watched / "failed").mkdir(parents=True)
        victim = write(tmp_path / "victim", "untouched")
        (watched / "failed" / "a.csv.why.txt").symlink_to(victim)
        write(watched / "a.csv", HEAD + LINE.replace("40,0123", "x"))
        link = Folder(machine(watched))
        await link.connect()
        await link.acknowledge(await fetched(link))
        assert "'x' is not a number" in (watched / "failed" / "a.csv.why.txt").read_text()
        assert victim.read_text() == "untouched"
        (watched / "failed" / "a.csv").unlink()
        (watched / "failed").rename(tmp_path / "elsewhere")
        (watched / "failed").symlink_to(tmp_path / "elsewhere")
        write(watched / "b.csv", HEAD + LINE.replace("40,0123", "y"))
        await link.acknowledge(await fetched(link))
        assert (watched / "b.csv").exists()
        with pytest.raises(Misconfigured, match=r"failed is a link"):
            await fetched(link)
        await link.close()

    run(work())


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read every file")
def test_a_locked_file_is_reported_after_a_while(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("app.bridge.kinds.folder.LOCKED_FOR", 0.0)

    async def work() -> None:
        write(tmp_path / "a.csv", HEAD + LINE).chmod(0)
        link = Folder(machine(tmp_path))
        await link.connect()
        with pytest.raises(ControlAway, match=r"a\.csv cannot be read"):
            await fetched(link)
        (tmp_path / "a.csv").chmod(0o600)
        assert len(await fetched(link)) == 1
        await link.close()

    run(work())


def test_every_part_of_the_simulated_machine_arrives_once(tmp_path: Path) -> None:
    """With halves and repeats, and the bridge cut and begun anew in between."""

    async def work() -> None:
        store = store_in(tmp_path / "store")
        model = Model()
        inbox = tmp_path / "in"
        simulator = FolderSimulator(model, inbox, pause=0.2)
        await simulator.start()
        table = simulator.table()
        settings: Any = table["folder"]
        chosen = machine(inbox, names={"D1": "shaft-1"}, **settings | {"every": 0.05, "settle": 3600.0})
        parts = 15
        for _ in range(3):
            async with fetching(chosen, store):
                for _ in range(parts // 3):
                    for _ in model.part():
                        await asyncio.sleep(0.01)
                await asyncio.sleep(0.2)
        async with fetching(chosen, store):
            await until(lambda: simulator.files == parts and not list(inbox.glob("*.csv")), "every file is moved")
        await simulator.stop()
        rows = await store.waiting("cmm-1", 1000)
        assert sorted(row.body["part"] for row in rows) == sorted(f"P{number}" for number in range(1, parts + 1))
        assert sorted(row.body["measured"] for row in rows) == pytest.approx(sorted(model.truth().values()))
        assert not (inbox / "failed").exists()
        store.close()

    run(work())


def test_a_stop_that_could_not_be_written_is_found_before(tmp_path: Path) -> None:
    place = tmp_path / "andon" / "stop.json"
    link = Folder(machine(tmp_path, decisions=str(place)))
    [wrong] = run(link.try_out())
    assert f"cannot be written to {place}" in wrong
    place.parent.mkdir()
    assert run(link.try_out()) == []
    assert list(place.parent.iterdir()) == []


def test_a_stop_lies_in_a_file_until_somebody_removes_it(tmp_path: Path) -> None:
    place = tmp_path / "cell" / "decision.json"
    place.parent.mkdir()

    def told(*actions: str) -> str | None:
        run(link.decide([Decided(f"k{n}", "shaft-1", action, "x") for n, action in enumerate(actions)]))
        return json.loads(place.read_text())["action"] if place.exists() else None

    link = Folder(machine(tmp_path, decisions=str(place)))
    assert carries_decisions(link)
    assert [told("none"), told("hold"), told("none", "stop", "hold"), told("hold")] == [None, "hold", "stop", "stop"]
    assert json.loads(place.read_text()).keys() == {"key", "characteristic", "action", "reason"}
    place.unlink()
    assert told("hold") == "hold"
    assert not carries_decisions(Folder(machine(tmp_path)))
    with pytest.raises(ConfigurationError, match="in another folder than path"):
        machine(tmp_path, decisions=str(tmp_path / "decision.json"))
