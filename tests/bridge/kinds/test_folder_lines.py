"""Files of measuring machines: what a line becomes, in which unit and at which time, and what is reported about a wrong one."""

from pathlib import Path
from typing import Any

import pytest

from app.bridge.configuration import ConfigurationError
from app.files.aqdef.values import OF_FIELD as F
from tests.bridge.kinds.measured_folder import HEAD, LINE, machine, read


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
