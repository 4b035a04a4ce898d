"""Lines of files as readings: the same line is the same reading, wherever it stands and however often the file is read."""

from pathlib import Path
from typing import Any

import pytest

from app.bridge.kinds.folder import Folder
from tests.bridge.kinds.measured_folder import HEAD, LINE, machine, read, sizes, write
from tests.bridge.kinds.test_folder import fetched
from tests.bridge.kinds.test_folder_lines import AQDEF_NAMES, DESCRIPTION, VALUES
from tests.bridge.plant import store_in
from tests.loops import run


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
