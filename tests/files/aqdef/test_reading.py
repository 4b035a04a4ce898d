"""AQDEF files as the programs of many makers write them, and what is said of those that do not fit."""
# ruff: noqa: DTZ001 - the files name no zone

from contextlib import suppress
from datetime import datetime
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest

from app.files.aqdef import description as aqdef
from app.files.aqdef import values as aqdef_values
from app.files.aqdef.context import context_of
from app.files.aqdef.description import Source
from app.files.aqdef.times import WallClock, time_of
from app.files.aqdef.values import Measured, Value
from app.files.formats.cell_values import Unreadable
from app.files.formats.delimited import Unusable
from app.files.formats.repeats import Remark

F, C = aqdef_values.OF_FIELD, aqdef_values.OF_CHARACTERISTIC
HEAD = ["K0100 2", "K1001 08/15", "K2001/1 D40", "K2002/1 Seat", "K2001/2 L12", "K2002/2 Length"]


def parsed(
    tmp_path: Path, lines: list[str], *, end: str = "\r\n", encoding: str = "utf-8"
) -> tuple[aqdef.Description, list[Value | Remark]]:
    path = tmp_path / "file.dfq"
    path.write_bytes(end.join([*lines, ""]).encode(encoding))
    source = Source.at(path)
    description = aqdef.describe(source)
    return description, list(aqdef_values.values(source, description))


def numbers(found: list[Value | Remark]) -> list[tuple[int, str | None]]:
    return [(each.characteristic, each.fields.get("K0001")) for each in found if isinstance(each, Value)]


def good(value: Value | Remark) -> Measured:
    assert isinstance(value, Value)
    measured = aqdef_values.read_value(value)
    assert isinstance(measured, Measured)
    return measured


@pytest.mark.parametrize("end", ["\r\n", "\n", "\r"])
def test_values_in_one_line_for_all_characteristics(tmp_path: Path, end: str) -> None:
    rows = [
        f"39,998{F}0{F}12.08.2026/15:23:45{F}3,7{F}#123{F}4{F}2{F}1{F}1/0,5{F}9{C}12.01",
        f"4.0001E+0001{F}129{F}12.08.2026/15:24:00{C}{F}255",
    ]
    _description, found = parsed(tmp_path, HEAD + rows, end=end)
    first, second, third, missing = found
    assert good(first) == Measured(
        39.998, 0, datetime(2026, 8, 12, 15, 23, 45), "", "123", "", 4, 2, 1, 9, (3, 7), "1/0,5"
    )
    assert (good(second).measured, good(second).at, good(second).nest) == (12.01, datetime(2026, 8, 12, 15, 23, 45), 4)
    assert (good(third).measured, good(third).attribute) == (40.001, 129)
    assert isinstance(missing, Value)
    assert aqdef_values.read_value(missing) is None
    assert [each.line for each in found] == [7, 7, 8, 8]


@pytest.mark.parametrize("in_rows", [True, False])
def test_values_that_are_marked_are_there_and_not_to_be_evaluated(tmp_path: Path, in_rows: bool) -> None:
    """The example files of the format differ from a plain count of their numbers by such marks alone.

    304 marks the reference values of gauge studies, the sizes of masters; 1 lives of tools and parts that were cut off before
    their end: neither is a part that was made. 255 and 256 mark places where nothing was measured, with a 0 as their value.
    """
    marks = ["304", "0", "", "1", "256", "255", "0,304", "129"]
    rows = [f"40.00{at}{F}{mark}{F}12.08.2026/15:2{at}:00" for at, mark in enumerate(marks)]
    if not in_rows:
        rows = [line for at, mark in enumerate(marks) for line in (f"K0001/1 40.00{at}", f"K0002/1 {mark}")]
    _description, found = parsed(tmp_path, HEAD + rows)
    read = [aqdef_values.read_value(each) for each in found if isinstance(each, Value)]
    attributes = [each.attribute if isinstance(each, Measured) else each for each in read]
    assert attributes == [304, 0, 0, 1, None, None, 304, 129]


def test_values_in_lines_of_their_own(tmp_path: Path) -> None:
    rows = ["K0001/1 1", "K0004/1 1.2.2026/3:04:05", "K0001/1 1.1", "K0001/2 2", "K0002/2 290", "K0001/2 2.1"]
    _description, found = parsed(tmp_path, HEAD + rows)
    assert numbers(found) == [(1, "1"), (2, "2"), (1, "1.1"), (2, "2.1")]
    assert good(found[0]).at == datetime(2026, 2, 1, 3, 4, 5)


def test_no_index_is_the_first_and_zero_is_all(tmp_path: Path) -> None:
    lines = [
        "K0100 2",
        "K1002/0 Shaft",
        "K1001 A",
        "K1001/2 B",
        "K1002/2 Own",
        "K2001 D40",
        "K2001/2 L12",
        "K2142/0 mm",
        "K2022/2 3",
        "K2022/0 4",
    ]
    description, _found = parsed(tmp_path, lines)
    assert description.parts == {1: {"K1001": "A", "K1002": "Shaft"}, 2: {"K1001": "B", "K1002": "Own"}}
    assert [each.fields["K2142"] for each in description.characteristics.values()] == ["mm", "mm"]
    assert [each.fields["K2022"] for each in description.characteristics.values()] == ["4", "3"]


def test_fields_of_all_belong_to_the_values_above_them(tmp_path: Path) -> None:
    rows = [
        "K0001/1 1",
        "K0001/2 3",
        "K0014/0 SN-1",
        "K0001/1 2",
        "K0014/0 SN-2",
        "K0001/1 5",
        "K0001/2 6",
        "K0014/0 SN-3",
    ]
    _description, found = parsed(tmp_path, HEAD + rows)
    parts = [
        (each.characteristic, each.fields["K0001"], each.fields["K0014"]) for each in found if isinstance(each, Value)
    ]
    assert parts == [(1, "1", "SN-1"), (2, "3", "SN-1"), (1, "2", "SN-2"), (1, "5", "SN-3"), (2, "6", "SN-3")]


def test_fields_below_a_line_belong_to_its_values(tmp_path: Path) -> None:
    rows = [f"1{F}0{C}2{F}0", "K0014/0 SN-1", "K0097/1 {A}", f"3{F}0", "K0014/0 SN-2"]
    _description, found = parsed(tmp_path, HEAD + rows)
    assert [each.fields.get("K0014") for each in found if isinstance(each, Value)] == ["SN-1", "SN-1", "SN-2"]


def test_a_field_before_the_values_belongs_to_the_next_ones(tmp_path: Path) -> None:
    _description, found = parsed(tmp_path, [*HEAD, "K0014/0 SN-1", "K0001/1 1", "K0001/1 2"])
    assert [each.fields.get("K0014") for each in found if isinstance(each, Value)] == ["SN-1", None]


SETS = [[f"1{F}0{C}3{F}0"], ["K0001/1 1", "K0001/2 3"]], [[f"2{F}0{C}4{F}0"], ["K0001/1 2", "K0001/2 4"]]


@pytest.mark.parametrize("lines", [0, 1])
@pytest.mark.parametrize("index", [0, 1])
def test_fields_that_stand_above_the_first_values_stand_above_all(tmp_path: Path, lines: int, index: int) -> None:
    rows = [f"K0014/{index} SN-1", *SETS[0][lines], f"K0014/{index} SN-2", *SETS[1][lines]]
    _description, found = parsed(tmp_path, HEAD + rows)
    values = [each for each in found if isinstance(each, Value)]
    assert len(values) == len(found) == 4
    parts = {each.fields["K0001"]: each.fields.get("K0014") for each in values}
    others = {"3": "SN-1", "4": "SN-2"} if index == 0 else {"3": None, "4": None}
    assert parts == {"1": "SN-1", "2": "SN-2"} | others


@pytest.mark.parametrize("index", [0, 1])
def test_fields_above_the_first_and_below_the_last_values_are_refused(tmp_path: Path, index: int) -> None:
    rows = [f"K0014/{index} SN-1", *SETS[0][0], f"K0014/{index} SN-2", *SETS[1][0], f"K0014/{index} SN-3"]
    _description, found = parsed(tmp_path, HEAD + rows)
    [remark] = [str(each) for each in found if isinstance(each, Remark)]
    assert remark.startswith(f"line 11, K0014/{index}: 'SN-3' is above the first values and below the last ones")


def test_fields_above_a_line_that_holds_nothing_are_of_no_other(tmp_path: Path) -> None:
    rows = ["K0014/1 SN-1", "K0001/1 1", "K0014/1 SN-2", f"{F}{F}12.08.2026{C}3", f"2{F}0{C}4{F}0", f"{F}"]
    _description, found = parsed(tmp_path, HEAD + rows)
    assert [(each.fields.get("K0001"), each.fields.get("K0014")) for each in found if isinstance(each, Value)] == [
        ("1", "SN-1"),
        (None, "SN-2"),
        ("3", None),
        ("2", None),
        ("4", None),
        (None, None),
    ]


def test_validity_below_a_line_counts_for_its_value(tmp_path: Path) -> None:
    time = "12.08.2026/15:23:45"
    _description, found = parsed(tmp_path, [*HEAD, f"1{F}0{F}{time}{C}3{F}0", "K0002/1 129", f"2{F}0", "K0002/1 256"])
    values = [each for each in found if isinstance(each, Value)]
    assert [(each.fields["K0001"], each.fields["K0002"]) for each in values] == [("1", "129"), ("3", "0"), ("2", "256")]


def test_a_field_of_a_value_that_the_line_leaves_out_is_no_other_s(tmp_path: Path) -> None:
    rows = [f"{C}3{F}0", "K0014/1 SN-1", "K0014/2 SN-1", f"2{F}0{C}4{F}0"]
    _description, found = parsed(tmp_path, HEAD + rows)
    assert [(each.fields.get("K0001"), each.fields.get("K0014")) for each in found if isinstance(each, Value)] == [
        ("3", "SN-1"),
        (None, "SN-1"),
        ("2", None),
        ("4", None),
    ]


def test_values_with_numbers_of_their_own(tmp_path: Path) -> None:
    _description, found = parsed(tmp_path, [*HEAD, "K0001/1/1 5", "K0001/1/2 6", "K0014/1/1 A", "K0014/1/2 B"])
    assert [(each.fields["K0001"], each.fields["K0014"]) for each in found if isinstance(each, Value)] == [
        ("5", "A"),
        ("6", "B"),
    ]


def test_fields_by_the_number_of_a_value_belong_to_it_wherever_they_stand(tmp_path: Path) -> None:
    rows = ["K0014/1/2 B", f"1{F}0{C}5{F}0", f"2{F}0{C}6{F}0", "K0014/0/1 A", "K0053/2/0 P7", "K0014/1/9 Z"]
    _description, found = parsed(tmp_path, HEAD + rows)
    values = [each for each in found if isinstance(each, Value)]
    assert [
        (each.characteristic, each.fields["K0001"], each.fields.get("K0014"), each.fields.get("K0053"))
        for each in values
    ] == [(1, "1", "A", None), (2, "5", "A", "P7"), (1, "2", "B", None), (2, "6", None, "P7")]
    assert [str(each) for each in found if isinstance(each, Remark)] == [
        "line 12, K0014/1/9: 'Z' belongs to value 9, but the file has 2"
    ]


def test_a_field_without_an_index_may_describe_all_characteristics(tmp_path: Path) -> None:
    lines = ["K0100 2", "K1001 P", f"K2001 D40{C}L12", f"K2002 Seat{C} Length", "K2142/0 mm"]
    description, _found = parsed(tmp_path, lines)
    assert [(each.number, each.name) for each in description.characteristics.values()] == [
        ("D40", "Seat"),
        ("L12", "Length"),
    ]


def test_values_whose_separators_are_gone_are_refused_by_line(tmp_path: Path) -> None:
    lost = ["6.00100000000000E+0000006.09.2002/12:41:27#0000", "57.96205.7.2006/10:48:726.05105.7.2006/10:48:7"]
    _description, found = parsed(tmp_path, [*HEAD, *lost, f"1{F}0", "1 2", "what"])
    said = [(each.line, each.wrong) for each in found if isinstance(each, Remark)]
    assert said == [(7, True), (8, True), (10, True), (11, False)]
    assert "the characters 15 and 20 that part values are missing" in str(found[0])


@pytest.mark.parametrize(
    ("rows", "cut"),
    [
        ([f"1{F}0{F}2.3.2026/6:00:00{C}5{F}0", f"2{F}0{F}2.3.2026/6:01:00{C}6"], True),
        ([f"1{F}0{F}2.3.2026/6:00:00", f"2{F}0{F}2.3.2026/6:0"], True),
        ([f"1{F}0{F}2.3.2026/6:00:00{C}5{F}0", f"2{F}0{F}2.3.2026/6:01:00"], False),  # what comes last may be left out
        (["K0001/1 1", "K0004/1 2.3.2026/6:00", "K0001/1 39.9"], True),
        (["K0001/1 1", "K0001/1 39.9"], False),
    ],
)
def test_a_file_that_is_cut_off_is_refused(tmp_path: Path, rows: list[str], *, cut: bool) -> None:
    path = tmp_path / "file.dfq"
    for end, wrong in (("", cut), ("\r\n", False)):
        path.write_bytes(("\r\n".join([*HEAD, *rows]) + end).encode())
        source = Source.at(path)
        found = list(aqdef_values.values(source, aqdef.describe(source)))
        assert any(isinstance(each, Remark) and each.wrong for each in found) is wrong


@pytest.mark.parametrize(
    "line",
    ["K2004/1 ²", "K0100 " + "9" * 5000, "K5111/1 " + "9" * 5000, "K0004/1 01.01.0001/00:00:00",
     "K0004/1 31.12.9999/23:59:59", "K0011/1 1/1e999", "K2001/" + "9" * 5000 + " x", "K0001/1/" + "9" * 5000 + " 5",
     "K2003/1 a\0b"],
)  # fmt: skip
def test_numbers_and_signs_of_no_sense_are_said_or_passed_over(tmp_path: Path, line: str) -> None:
    description, found = parsed(tmp_path, [*HEAD, "K0001/1 1", line])
    assert "\0" not in description.characteristics[1].fields.get("K2003", "")
    clock = WallClock(ZoneInfo("Europe/Berlin"))
    for each in found:
        if isinstance(each, Value) and isinstance(read := aqdef_values.read_value(each), Measured):
            context_of(each, read, description, lambda _remark: None)
            with suppress(Unreadable):  # the first day of the calendar has no UTC everywhere
                assert read.at is None or isinstance(clock.moment(read.at), datetime)


def test_more_characteristics_than_a_file_may_have_are_refused(tmp_path: Path) -> None:
    for lines in (["K0100 10001"], [f"K2001/{number} x" for number in range(1, 10_002)]):
        with pytest.raises(Unusable, match="at most 10000 characteristics"):
            parsed(tmp_path, lines)


def test_parts_with_values_after_each_and_without_indices(tmp_path: Path) -> None:
    lines = ["K0100 2", "K1001 A", "K2001/1 D40", "K0001/1 1", "K1001 B", "K2001/2 D40", "K0001/2 2"]
    description, found = parsed(tmp_path, lines)
    assert [description.part_of(each)["K1001"] for each in description.characteristics.values()] == ["A", "B"]
    assert numbers(found) == [(1, "1"), (2, "2")]


def test_counted_parts_have_another_layout(tmp_path: Path) -> None:
    lines = [*HEAD, "K2004/2 1", f"39.99{F}0{C}100000{F}1{F}{F}0{F}12.08.2026/15:23:45"]
    description, found = parsed(tmp_path, lines)
    assert description.characteristics[2].counts
    assert isinstance(found[1], Value)
    assert found[1].fields == {"K0020": "100000", "K0021": "1", "K0002": "0", "K0004": "12.08.2026/15:23:45"}


def test_more_values_than_characteristics_are_refused_by_line(tmp_path: Path) -> None:
    _description, found = parsed(tmp_path, [*HEAD, f"1{F}0{C}2{F}0{C}3{F}0", "K0001/7 5"])
    wrong = [each for each in found if isinstance(each, Remark)]
    assert [(each.line, each.wrong) for each in wrong] == [(7, True), (8, True)]
    assert str(wrong[0]) == "line 7, K0001: '3' belongs to characteristic 3, but the file describes 2"


def test_characteristics_without_values_and_without_a_name(tmp_path: Path) -> None:
    description, found = parsed(tmp_path, ["K0100 3", "K1001 A", "K2001/1 D40"])
    assert (list(description.characteristics), found) == ([1, 2, 3], [])


def test_what_is_not_understood_is_said_and_kept(tmp_path: Path) -> None:
    lines = [
        "\ufeffK0100 2",
        "K10",
        "K1001 A",
        "K2001/1 D40",
        "K2001/1 D41",
        "K9876/1 x",
        "K12345 y",
        "what",
        "K0099/1 z",
        "K2004/1-2 0",
        "K0001/1 40.1",
        "K0008/1/ 4",
    ]
    description, found = parsed(tmp_path, lines)
    said = [str(each) for each in [*description.remarks, *found] if isinstance(each, Remark)]
    assert said == [
        "line 2: 'K10' is too short or no K field; it is passed over",
        "line 5, K2001/1: 'D41' is written twice, in line 4 too; the last one counts",
        "line 6, K9876: 'x' is no field that is known here; it is kept and not used",
        "line 7, K12345: 'y' is no field that is known here; it is kept and not used",
        "line 10: 'K2004/1-2 0' has an index that is not a number ('1-2'); it is passed over",
        "line 8: 'what' is neither a K field nor a value; it is passed over",
        "line 9, K0099: 'z' is no field that is known here; it is kept and not used",
        "line 12, K0008/1/: '4' has a second stroke, but no number of a value behind it; it is taken for K0008/1",
    ]
    assert description.others["K9876", 1] == "x"


def test_a_field_written_twice_for_a_value(tmp_path: Path) -> None:
    _description, found = parsed(tmp_path, [*HEAD, "K0001/1 1", "K0014/1 A", "K0014/1 B", "K0001/1 2"])
    assert "written twice for one value" in str(found[0])
    assert [each.fields.get("K0014") for each in found if isinstance(each, Value)] == ["B", None]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16", "utf-16-le", "utf-16-be"])
def test_letters(tmp_path: Path, encoding: str) -> None:
    description, _found = parsed(
        tmp_path, ["K0100 1", "K2002/1 Länge Ø", *["K2092/1 ascii"] * 70_000], encoding=encoding
    )
    assert description.characteristics[1].name == "Länge Ø"


def test_letters_that_come_late_count_too(tmp_path: Path) -> None:
    description, found = parsed(tmp_path, [*HEAD, *["K0001/1 1"] * 130_000, "K0014/1 Stück"], encoding="cp1252")
    assert description.encoding == "cp1252"
    assert isinstance(found[-1], Value)
    assert found[-1].fields["K0014"] == "Stück"


def test_several_files_one_after_the_other_are_refused(tmp_path: Path) -> None:
    with pytest.raises(Unusable, match="several files, one after the other") as refusal:
        parsed(tmp_path, [*HEAD, "K0001/1 1", "K0100 2", "K1001 08/15", "K2001/1 D35"])
    assert refusal.value.line == 10


@pytest.mark.parametrize("content", ["", "measured,part\n39.9,1\n", "\x00\x01\x02"])
def test_other_files_are_refused(tmp_path: Path, content: str) -> None:
    with pytest.raises(Unusable, match="no AQDEF file"):
        parsed(tmp_path, [content])


def test_a_pair_is_found_by_either_file(tmp_path: Path) -> None:
    (tmp_path / "a.DFD").write_text("\n".join(HEAD))
    (tmp_path / "a.dfx").write_text(f"1{F}0{C}2{F}0\n")
    for name in ("a.DFD", "a.dfx"):
        source = Source.at(tmp_path / name)
        found = list(aqdef_values.values(source, aqdef.describe(source)))
        assert numbers(found) == [(1, "1"), (2, "2")]
    (tmp_path / "b.dfx").write_text("1")
    with pytest.raises(Unusable, match=r"b\.dfd"):
        Source.at(tmp_path / "b.dfx")


def spellings() -> list[tuple[str, datetime]]:
    found = []
    for year in ("26", "2026"):
        for date in (f"3.4.{year}", f"4/3/{year}", f"{year}-4-3"):
            for between in ("/", " ", "."):
                found += [
                    (f"{date}{between}7:08:09", datetime(2026, 4, 3, 7, 8, 9)),
                    (f"{date}{between}7:08", datetime(2026, 4, 3, 7, 8)),
                ]
    return [*found, ("2026-04-03T07:08:09", datetime(2026, 4, 3, 7, 8, 9)), ("03.04.2026", datetime(2026, 4, 3))]


@pytest.mark.parametrize(("text", "at"), spellings())
def test_times(text: str, at: datetime) -> None:
    assert time_of(text) == at


def test_day_before_month_has_to_be_said() -> None:
    assert time_of("3/4/2026 7:08").month == 3
    assert time_of("3/4/2026 7:08", "day_first").month == 4
    assert time_of("23/4/2026 7:08").month == 4, "it can be read one way only"
    with pytest.raises(Unreadable, match="is not a time"):
        time_of("23/4/2026 7:08", "month_first")
    assert time_of("18.11.2025/24:00:00") == datetime(2025, 11, 19)
    with pytest.raises(Unreadable, match="is not a time"):
        time_of("31.2.2026/7:08")
    with pytest.raises(Unreadable, match="is not a time"):
        time_of("yesterday")


def test_the_hour_that_is_there_twice_goes_by_the_order_of_the_file() -> None:
    clock = WallClock(ZoneInfo("Europe/Berlin"))
    local = [
        datetime(2026, 10, 25, 2, 30),
        datetime(2026, 10, 25, 2, 59),
        datetime(2026, 10, 25, 2, 10),
        datetime(2026, 10, 25, 3, 0),
    ]
    assert [clock.moment(at).isoformat()[11:] for at in local] == [
        "02:30:00+02:00",
        "02:59:00+02:00",
        "02:10:00+01:00",
        "03:00:00+01:00",
    ]


@pytest.mark.parametrize(
    ("field", "said"),
    [
        ("K0002/1 a", "line 7, K0002/1: 'a' is not a whole number"),
        ("K0004/1 32.1.2026/0:0", "line 7, K0004/1: '32.1.2026/0:0' is not a time: day is out of range for month"),
        ("K0002/1 0,a", "line 7, K0002/1: '0,a' is not a whole number"),
    ],
)
def test_fields_that_cannot_be_read_are_named(tmp_path: Path, field: str, said: str) -> None:
    _description, found = parsed(tmp_path, [*HEAD, "K0001/1 1", field])
    assert isinstance(found[0], Value)
    assert str(aqdef_values.read_value(found[0])) == said


@pytest.mark.parametrize(
    "row",
    [
        "1¶0¶2.3.2026/6:00¤2¶0¶2.3.2026/6:00",  # as manuals print both
        f"1¤0¤2.3.2026/6:00{C}2¤0¤2.3.2026/6:00",  # one of them came through
        "1☼2",
    ],
)
def test_separators_as_they_are_shown(tmp_path: Path, row: str) -> None:
    _description, found = parsed(tmp_path, [*HEAD, row])
    assert numbers(found) == [(1, "1"), (2, "2")]


def test_a_lone_sign_with_a_time_behind_it_parts_fields(tmp_path: Path) -> None:
    _description, found = parsed(tmp_path, [*HEAD, "1¤0¤2.3.2026/6:00¤¤#7"])
    assert [(good(each).measured, good(each).batch) for each in found] == [(1.0, "7")]


def test_names_in_place_of_numbers_are_taken(tmp_path: Path) -> None:
    rows = ["K0001/1 1", "K0007/1 A", "K0008/1 Eva", "K0005/1 2, chip", "K0009/1 a remark"]
    catalogue = ["K4092/1 EV", "K4093/2 Adam", "K4092/2 AD"]
    description, found = parsed(tmp_path, [*HEAD, *catalogue, *rows])
    value = good(found[0])
    assert (value.nest, value.operator, value.events, value.text) == ("A", "Eva", (2, "chip"), "a remark")
    assert [description.named(entry, "K4093", "K4092") for entry in (1, 2, 3, 0, "Eva")] == [
        "EV",
        "Adam",
        "3",
        "",
        "Eva",
    ]


@pytest.mark.parametrize("fields", ["K0002/1 0", "K0002/1 255", "K0002/1 129,256"])
def test_what_is_empty_missing_or_deleted_is_no_value(tmp_path: Path, fields: str) -> None:
    lines = [f"K0001/1 {'' if fields.endswith(' 0') else '1'}", fields]
    _description, found = parsed(tmp_path, HEAD + lines)
    assert isinstance(found[0], Value)
    assert aqdef_values.read_value(found[0]) is None


def test_the_tree_says_which_part_a_characteristic_is_of(tmp_path: Path) -> None:
    lines = ["K0100 3", "K1001/1 A", "K1001/2 B", "K2001/1 D1", "K2001/2 D2", "K2001/3 D3"]
    flat, _found = parsed(tmp_path, lines)
    assert [each.part for each in flat.characteristics.values()] == [2, 2, 2]
    assert str(flat.remarks[0]) == (
        "line 2, K1001/1: 'A' has no characteristic below it: those of the file count as parts of B"
    )
    tree = ["K5111/1 1", "K5111/2 2", "K5112/3 2", "K5102/1 1", "K5103/1 3", "K5102/2 3", "K5103/3 1"]
    description, _found = parsed(tmp_path, lines + tree)
    assert [each.part for each in description.characteristics.values()] == [1, 1, 2]
    assert description.remarks == []


def test_a_second_file_with_the_same_characteristics_is_refused(tmp_path: Path) -> None:
    first = ["K0100 1", "K1001 P", "K2001 D40", "1"]
    with pytest.raises(Unusable, match="K2001/1 is of the part 'Q' here and was of the part 'P' above"):
        parsed(tmp_path, [*first, *(line.replace("P", "Q") for line in first)])
