"""Folders with tables that say less than others: without a heading, or with times that the configuration does not name."""

import re
from pathlib import Path
from typing import Any

import pytest

from app.bridge.file_content import Content
from tests.bridge.kinds.measured_folder import read

ONE = {"*": "shaft-1"}
HELD = "holds values, so the table has no heading"
STAMPED = "actual;stamp\n40,01;23.11.2026 06:05:00\n40,02;23.11.2026 06:06:00\n"


def bodies(content: Content) -> list[tuple[Any, Any]]:
    assert content.faults == []
    return [(each.body["measured"], each.body.get("measured_at", "")[11:16]) for each in content.entries]


@pytest.mark.parametrize(
    ("text", "columns", "wanted"),
    [
        ("40\n41\n40\n", {"measured": "1"}, [(40.0, ""), (41.0, ""), (40.0, "")]),
        ("40,01\n40,02", {"measured": "1"}, [(40.01, ""), (40.02, "")]),
        (
            "2;40,01;23.11.2026 06:05:00\n3;40,02;23.11.2026 06:06:00\n",
            {"part": "1", "measured": "2", "measured_at": "3"},
            [(40.01, "06:05"), (40.02, "06:06")],
        ),
        ("23.11.2026;06:05:00;40\n23.11.2026;06:06:00;41\n", {"measured": "3", "measured_at": "1+2"}, [(40.0, "06:05"), (41.0, "06:06")]),
        ("P1;40\nP2;41\n", {"part": "1", "measured": "2"}, [(40.0, ""), (41.0, "")]),
        ("2;40\n1;2\n", {"part": "1", "measured": "2"}, [(40.0, ""), (2.0, "")]),
        ("Part;1;2\nA;40,01;40,02\n", {"part": "Part", "measured": "2"}, [(40.02, "")]),
        (";1;2\nA;40,01;40,02\n", {"measured": "2"}, [(40.02, "")]),
    ],
)  # fmt: skip
def test_columns_of_a_table_without_a_heading_are_named_by_their_places(
    tmp_path: Path, text: str, columns: dict[str, str], wanted: list[tuple[float, str]]
) -> None:
    assert bodies(read(tmp_path, text, columns=columns, names=ONE)) == wanted


def test_a_column_for_each_characteristic_by_its_place(tmp_path: Path) -> None:
    content = read(
        tmp_path, "P1;40,01;16,01\nP2;40,02;\n", columns={"part": "1"}, names={"2": "shaft-1", "3": "bore-1"}
    )
    assert [(each.body["characteristic"], each.body["measured"]) for each in content.entries] == [
        ("shaft-1", 40.01),
        ("bore-1", 16.01),
        ("shaft-1", 40.02),
    ]
    content = read(tmp_path, "40,01;16,01\n40,02;16,02\n", columns={}, names={"1": "shaft-1", "2": "bore-1"})
    assert len(content.entries) == 4, content.faults


@pytest.mark.parametrize(
    ("text", "columns", "words"),
    [
        ("40,01\n40,02\n", {"measured": "actual"}, 'columns.measured = "1"'),
        ("40,01\n40,02\n", {}, 'columns.measured = "1"'),
        ("7;40,01;23.11.2026 06:05:00\n", {"measured": "actual"}, '"3" (23.11.2026 06:05:00), such as columns.measured = "2"'),
        ("1;2\n2;1\n", {"measured": "2"}, "may name the columns, or be a reading"),
        ("Part;Actual\nA;40,01\n", {"measured": "2"}, "is no column of this file; it has Part, Actual"),
    ],
)  # fmt: skip
def test_a_table_without_a_heading_says_what_to_write(
    tmp_path: Path, text: str, columns: dict[str, str], words: str
) -> None:
    content = read(tmp_path, text, columns=columns, names=ONE)
    assert content.entries == []
    assert words in " ".join(map(str, content.faults))


def test_the_only_times_are_taken_and_said(tmp_path: Path) -> None:
    content = read(tmp_path, STAMPED, columns={"measured": "actual"}, names=ONE)
    assert bodies(content) == [(40.01, "06:05"), (40.02, "06:06")]
    assert "stamp: holds dates and times and is taken for the time of measuring" in " ".join(content.remarks)
    assert bodies(read(tmp_path, STAMPED, columns={"measured": "actual", "measured_at": ""}, names=ONE)) == [
        (40.01, ""),
        (40.02, ""),
    ]
    text = '{"measured": 40.01, "stamp": "2026-11-23T06:05:00+01:00"}\n'
    assert bodies(read(tmp_path, text, "a.ndjson", format="ndjson", names=ONE)) == [(40.01, "06:05")]


def test_times_that_may_be_several_are_asked(tmp_path: Path) -> None:
    text = "actual;begin;end\n40,01;23.11.2026 06:05:00;23.11.2026 06:15:00\n"
    content = read(tmp_path, text, columns={"measured": "actual"}, names=ONE)
    assert "begin, end: hold dates, and columns.measured_at names none" in str(content.faults[0])
    assert [bool(each.fault) for each in content.received("cmm-1", "a.csv")] == [True]


def test_a_full_time_beside_days_is_taken_and_said(tmp_path: Path) -> None:
    text = "measured;measured_at;stamp;cycle\n40,01;23.11.2026;23.11.2026 06:05:00;00:01:35\n40,02;23.11.2026;23.11.2026 06:06:00;00:01:36\n"
    content = read(tmp_path, text, columns={}, names=ONE)
    assert bodies(content) == [(40.01, "06:05"), (40.02, "06:06")]
    assert "stamp: holds dates and times" in " ".join(content.remarks)
    content = read(tmp_path, text.replace("23.11.2026 06:06", "24.11.2026 06:06"), columns={}, names=ONE)
    assert "stamp: hold times, and measured_at holds days alone" in str(content.faults[0])
    said = {"measured": "measured", "measured_at": "measured_at"}
    assert bodies(read(tmp_path, text, columns=said, names=ONE)) == [(40.01, "00:00"), (40.02, "00:00")]


def test_numbers_that_may_be_times_are_said(tmp_path: Path) -> None:
    """They stop no file: what comes in as it is measured has the time of now without them."""
    text = "actual;tick\n40,01;1763442300\n40,02;1763442360\n40,03;1763442420\n"
    content = read(tmp_path, text, columns={"measured": "actual"}, names=ONE)
    assert [time for _size, time in bodies(content)] == ["", "", ""]
    assert "tick: may be times" in " ".join(content.remarks)
    assert 'columns.measured_at = "tick" and times = "seconds since 1970-01-01"' in " ".join(content.remarks)
    assert read(tmp_path, text, columns={"measured": "actual", "measured_at": ""}, names=ONE).remarks == []


@pytest.mark.parametrize(
    "text",
    [
        "measured;part;measured_at;stamp\n40,01;A;23.11.2026;23.11.2026 06:05:00\n40,02;B;23.11.2026;24.11.2026 06:06:00\n",
        "measured;part;stamp\n40,01;A;23.11.2026 06:05:00\n40,02;B;23.11.2026 06:06:00\n",
        "measured;part;begin;end\n40,01;A;23.11.2026 06:05:00;23.11.2026 06:06:00\n40,02;B;23.11.2026 07:05:00;23.11.2026 07:06:00\n",
        "measured;part;tick\n40,01;A;1763442300\n40,02;B;1763442393\n40,02;C;1763442481\n",
    ],
)
def test_what_is_said_of_times_where_columns_names_none_can_be_followed(tmp_path: Path, text: str) -> None:
    """Where `columns` names one field, no other is found by its name: the sentence names them too."""
    content = read(tmp_path, text, columns={}, names=ONE)
    said = " ".join([*map(str, content.faults), *content.remarks])
    columns = dict(re.findall(r'columns\.(\w+) = "([^"]*)"', said))
    form = re.search(r' times = "([^"]+)"', said)
    assert columns.keys() == {"measured", "part", "measured_at"}
    followed = read(tmp_path, text, columns=columns, names=ONE, times=form and form[1])
    assert bodies(followed)[:2] != []
    assert [each.body["part"] for each in followed.entries][:2] == ["A", "B"]
