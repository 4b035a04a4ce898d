"""Times under a name that nobody knows: taken where one column alone can hold them, and said; else asked by column."""

import html
import re
from pathlib import Path
from typing import Any

import pytest

from app.errors import Invalid
from app.loop.readings.importing.layout import Wishes, look
from app.loop.readings.importing.lines import Line, lines
from tests.loop.readings.importing.doors import D40, ZONE, Plant, morning

ONE = "Wert;Zeitmarke;Prüfer\n40,001;18.11.2025 06:05;A\n40,002;18.11.2025 06:06;B\n"
TAKEN = "Zeitmarke is taken for it"
TWO = "Wert;Begin;Ende\n40,001;18.11.2025 06:05;18.11.2025 06:15\n40,002;18.11.2025 06:06;18.11.2025 06:16\n"
ASKED = "Say which it is (measured_at=COLUMN)"
AMBIGUOUS = {
    TWO: "Begin, Ende",
    "Wert;Tag\n40,001;18.11.2025\n40,002;18.11.2025\n": "Tag",
    "Wert;Stempel\n40,001;18.11.2025 06:05\n40,002;\n40,002;18.11.2025 06:07\n": "Stempel",
}
NONE = [
    "Wert;Nr\n40,001;4711-01-02\n40,002;4711-01-03\n",
    "Wert;Stempel\n40,001;01.01.1970 00:00:00\n40,002;01.01.1970 00:00:00\n",
    "Wert;Charge\n40,001;20251118060500\n40,002;20251118060600\n",
    "Wert;Remark\n40,001;\n40,002;seen 18.11.2025 06:05\n",
]


def written(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def test_the_only_column_of_dates_and_times_holds_the_times(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", ONE)
    layout = look(path, Wishes(timezone=ZONE))
    assert (layout.named("measured_at"), layout.takes_times) == ("Zeitmarke", True)
    assert TAKEN in layout.on_times
    assert "no column of times" in look(path, Wishes(mapping={"measured_at": ""})).on_times
    assert look(path, Wishes(mapping={"measured_at": "Zeitmarke"})).on_times == ""
    stroked = written(tmp_path / "a.csv", "Wert;Stempel\n40;11/5/2025 6:05\n40;11/18/2025 6:06\n")
    found = [each for each in lines(stroked, look(stroked, Wishes(timezone=ZONE)), "x") if isinstance(each, Line)]
    assert [each.reading.measured_at.day for each in found if each.reading.measured_at] == [5, 18]


def test_times_in_a_form_that_has_to_be_named_are_refused_by_line(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", "Wert;Stempel\n40,001;18.11.25 06:05\n40,002;18.11.25 06:06\n")
    found = [str(each) for each in lines(path, look(path, Wishes(timezone=ZONE)), "x")]
    assert ["%d.%m.%y %H:%M:%S" in each for each in found] == [True, True], found
    layout = look(path, Wishes(timezone=ZONE, time_format="%d.%m.%y %H:%M"))
    assert len([each for each in lines(path, layout, "x") if isinstance(each, Line)]) == len(found)


def test_objects_are_as_tables(tmp_path: Path) -> None:
    text = '{"value": 40.001, "stamp": "2025-11-18T06:05:00+01:00"}\n{"value": 40.002, "stamp": "2025-11-18T06:06:00+01:00"}\n'
    layout = look(written(tmp_path / "a.ndjson", text), Wishes())
    assert (layout.named("measured_at"), layout.takes_times) == ("stamp", True)
    with pytest.raises(Invalid, match="stamp, begin"):
        look(written(tmp_path / "a.ndjson", text.replace("}", ', "begin": "2025-11-18T06:00:00Z"}')), Wishes())


@pytest.mark.parametrize("text", AMBIGUOUS)
def test_what_is_ambiguous_is_asked_by_column(tmp_path: Path, text: str) -> None:
    path = written(tmp_path / "a.csv", text)
    with pytest.raises(Invalid, match=re.escape(f"Dates stand under {AMBIGUOUS[text]},")):
        look(path, Wishes())
    assert "measured_at" not in look(path, Wishes(mapping={"measured_at": ""})).columns


@pytest.mark.parametrize("text", NONE)
def test_what_is_no_time_is_none(tmp_path: Path, text: str) -> None:
    assert "no column of times" in look(written(tmp_path / "a.csv", text), Wishes()).on_times


def test_times_without_a_known_name_at_each_door(plant: Plant, tmp_path: Path, capsys: Any) -> None:
    path = written(tmp_path / "a.csv", ONE)
    keys = [plant.shop.another(f"unnamed-{door}", **D40) for door in ("cli", "rest", "page")]
    assert plant.command(path, characteristic=keys[0]) == ""
    assert TAKEN in " ".join(capsys.readouterr().err.split())
    answer = plant.table(path, ONE, characteristic=keys[1], timezone=ZONE)
    assert TAKEN in str(answer["characteristics"][0]["notes"])
    assert plant.page(path, keys[2]) == ""
    assert [plant.stored(key) for key in keys] == [morning(40.001, 40.002)] * 3
    data = {"csrf": plant.engineer.csrf(), "characteristic": keys[2]}
    shown = plant.engineer.browser.post("/import", data=data, files={"file": ("a.csv", path.read_bytes())})
    assert TAKEN in html.unescape(shown.text)
    wide = ONE.replace("Wert", "unnamed-cli").replace("40,00", "40,01")
    assert TAKEN in str(plant.table(path, wide, characteristics={"1": keys[0]}, timezone=ZONE)["characteristics"])


def test_ambiguous_times_are_asked_at_each_door(plant: Plant, tmp_path: Path) -> None:
    path, key = written(tmp_path / "a.csv", TWO), plant.shop.another("asked", **D40)
    assert ASKED in plant.command(path, characteristic=key)
    assert ASKED in str(plant.table(path, TWO, characteristic=key))
    assert ASKED in str(plant.table(path, TWO, characteristics={"1": key}))
    assert ASKED in plant.page(path, key)
    assert ASKED in plant.page(path, key, column_measured_at="?"), "the form of the preview, sent again"
    assert plant.stored(key) == []
    assert plant.page(path, key, column_measured_at="3") == ""
    assert [at for _size, at in plant.stored(key)] == ["2025-11-18T05:15:00", "2025-11-18T05:16:00"]


def test_a_heading_that_is_named_later_is_looked_through_for_times(plant: Plant, tmp_path: Path) -> None:
    """The form of the first preview says of no column that it is none of times."""
    path = written(tmp_path / "a.csv", "Job;4711\nTime;D40\n18.11.2025 06:05;40,001\n18.11.2025 06:06;40,002\n")
    key = plant.shop.another("later", **D40)
    data = {"csrf": plant.engineer.csrf(), "characteristic": key}
    shown = plant.engineer.browser.post("/import", data=data, files={"file": ("a.csv", path.read_bytes())}).text
    form = dict(re.findall(r'<input type="hidden" name="(column_\w+)" value="([^"]*)"', shown))
    assert plant.page(path, key, **form | {"header_line": "2", "column_measured": "2"}) == ""
    assert plant.stored(key) == morning(40.001, 40.002)
