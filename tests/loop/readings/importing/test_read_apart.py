"""Files of others, read in a process of their own: the same values, once for all columns, and what is said at a limit."""

import tempfile
import time
from dataclasses import replace
from pathlib import Path
from zoneinfo import ZoneInfo

import pytest

from app.errors import Invalid
from app.files import apart
from app.files.apart import Limits
from app.files.aqdef.description import Source
from app.loop.readings.aqdef import actions
from app.loop.readings.aqdef.content import put_down
from app.loop.readings.aqdef.matching import contents
from app.loop.readings.aqdef.sorting import Wishes as AqdefWishes
from app.loop.readings.importing.cells import items
from app.loop.readings.importing.layout import Wishes, look
from app.loop.readings.importing.lines import Line, lines, look_apart, read_apart

FILES = {
    "a.csv": "measured,measured_at,part\n39.998,2026-03-29T08:00:00+05:30,Ä1\nbroken,2026-03-29T08:01Z,2\n40,2026-03-29T08:02Z,3\n",
    "a.ndjson": '{"measured": 39.998, "part": "\\ud800"}\n{"measured": 1e400}\n{"measured": 40.1, "context": {"order": "A"}}\n',
    "a.json": '[{"measured": 39.998}, 7, {"measured": "x"}]',
}


@pytest.mark.parametrize("name", FILES)
def test_the_values_are_those_of_this_process(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(FILES[name])
    looked = look_apart(path, Wishes(), name)
    assert looked.layout == look(path, Wishes(), name)
    assert len(looked.first) == 3
    with read_apart(path, [looked.layout]) as read:
        assert list(map(str, read(0, "c"))) == list(map(str, lines(path, looked.layout, "c")))
    with read_apart(path, [looked.layout], 1) as read:
        assert len(list(read(0, "c"))) == 1


def test_a_wide_sheet_is_read_once_for_all_its_columns(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "wide.csv"
    path.write_text("part,a,b\nP1,1,\nP2,2,5\nP3,x,6\n")
    layout = look(path, Wishes(), complete=False)
    layouts = [replace(layout, columns={"measured": (place,), "part": (0,)}, skips_blank=True) for place in (1, 2)]
    assert [(each.place, each.number) for each in items(path, layouts)] == [(0, 2), (0, 3), (1, 3), (0, 4), (1, 4)]
    with read_apart(path, layouts) as read:
        found = [[each.reading.measured for each in read(at, "c") if isinstance(each, Line)] for at in (0, 1)]
    assert found == [[1.0, 2.0], [5.0, 6.0]]


def test_a_table_of_many_names_takes_no_longer_for_each_of_them(tmp_path: Path) -> None:
    path = tmp_path / "many.csv"
    names = [f"Bore {at}" for at in range(1000)]
    path.write_text("Characteristic,Actual\n" + "".join(f"{name},40.001\n" for _part in range(20) for name in names))
    layout = look(path, Wishes())
    begun = time.thread_time()
    found = [each.place for each in items(path, [replace(layout, only=name) for name in names])]
    assert time.thread_time() - begun < 2.0, "7 s where each row is looked at for each name"
    assert found == [*range(1000)] * 20


def test_a_limit_is_said_where_the_file_is_chosen_and_nothing_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(apart, "LIMITS", Limits(written=200))
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    path = tmp_path / "a.csv"
    path.write_text("measured\n" + "40.001\n" * 1000)
    with (
        pytest.raises(Invalid, match="file: What this file unpacks to is more than"),
        read_apart(path, [look(path, Wishes())]),
    ):
        pass
    aqdef = tmp_path / "a.dfq"
    aqdef.write_text("K0100 1\nK2001/1 D\nK2142/1 mm\n" + "40.001\n" * 1000)
    source = Source(aqdef)
    wanted = {each.index: each for each in contents(actions.describe(source))}
    with (
        pytest.raises(ValueError, match="unpacks to is more"),
        put_down(source, wanted, AqdefWishes(ZoneInfo("UTC")), foreign=True),
    ):
        pass
    assert sorted(each.name for each in tmp_path.iterdir()) == ["a.csv", "a.dfq"]
