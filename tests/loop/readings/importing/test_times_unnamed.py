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
DAYS = "Wert;Datum;Zyklus;Aufnahme\n40,001;18.11.2025;00:01:35;18.11.2025 06:05\n40,002;18.11.2025;00:01:36;18.11.2025 06:06\n"
OF_DAYS = "Datum holds days without a time of day"
DAYS_ASKED = {
    "another day": DAYS.replace("18.11.2025 06:06", "19.11.2025 06:06"),
    "not in every row": DAYS.replace("18.11.2025 06:06", ""),
    "two": DAYS.replace("Zyklus", "Ende")
    .replace("00:01:35", "18.11.2025 06:15")
    .replace("00:01:36", "18.11.2025 06:16"),
}
COUNTED = "Wert;Takt;Nummer\n40,001;1763442300;1700000001\n40,002;1763442360;1700000002\n40,003;1763442420;1700000003\n"
SECONDS = "seconds since 1970-01-01"
COUNTS = {
    COUNTED: SECONDS,
    "Wert;Takt\n40,003;1763442420\n40,002;1763442360\n40,001;1763442300\n": SECONDS,
    "Wert;Takt\n40,001;1763442300123\n40,002;1763442360456\n40,003;1763442420789\n": "milliseconds since 1970-01-01",
    "Wert;Takt\n40,001;20251118060500\n40,002;20251118060600\n40,003;20251118060700\n": "",
    "Wert;Takt\n" + "".join(f"40,00{at};{45979 + at},25{at}\n" for at in range(6)): "days since 1899-12-30",
}
NONE = [
    "Wert;Nr\n40,001;1700000001\n40,002;1700000002\n40,003;1700000004\n40,004;1700000005\n",
    "Wert;Nr\n40,001;1763442300\n40,002;1763442500\n40,003;1763442400\n",
    "Wert;Nr\n40,001;1763442300\n40,002;\n40,003;1763442400\n40,004;1763442500\n",
    "Wert;Nr\n40,001;2025111801\n40,002;2025111803\n40,003;2025111901\n",
    "Wert;Nr\n40,001;2511180100\n40,002;2511180120\n40,003;2511180140\n",
    "Wert;D41\n40,001;40001,1\n40,002;40001,4\n40,003;40002,3\n",
    "Wert;Auftrag\n40,001;40001\n40,002;40003\n40,003;40007\n40,003;40010\n40,003;40014\n40,003;40019\n",
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


def test_a_full_time_beside_days_is_taken_at_each_door(plant: Plant, tmp_path: Path, capsys: Any) -> None:
    """Days under a known name gave midnight before, and the full time was passed over."""
    path = written(tmp_path / "a.csv", DAYS)
    keys = [plant.shop.another(f"days-{door}", **D40) for door in ("cli", "rest", "page")]
    assert plant.command(path, characteristic=keys[0]) == ""
    assert f"{OF_DAYS}. Aufnahme is taken" in " ".join(capsys.readouterr().err.split())
    answer = plant.table(path, DAYS, characteristic=keys[1], timezone=ZONE)
    assert "(--map measured_at=Datum)" in str(answer["characteristics"][0]["notes"])
    assert plant.page(path, keys[2]) == ""
    assert [plant.stored(key) for key in keys] == [morning(40.001, 40.002)] * 3
    other = plant.shop.another("days-said", **D40)
    assert plant.page(path, other, column_measured_at="2") == ""
    assert [at for _size, at in plant.stored(other)] == ["2025-11-17T23:00:00"] * 2


@pytest.mark.parametrize("why", DAYS_ASKED)
def test_a_full_time_that_is_not_plain_is_asked_beside_days(plant: Plant, tmp_path: Path, why: str) -> None:
    text, key = DAYS_ASKED[why], plant.shop.another(f"asked-{len(why)}", **D40)
    path = written(tmp_path / "a.csv", text)
    said = f"{OF_DAYS}, and dates with one stand under"
    assert said in plant.command(path, characteristic=key)
    assert said in str(plant.table(path, text, characteristic=key))
    assert said in str(plant.table(path, text, characteristics={"1": key}))
    assert said in plant.page(path, key)
    assert said in plant.page(path, key, column_measured_at="?"), "the form of the preview, sent again"
    assert plant.stored(key) == []
    assert plant.page(path, key, column_measured_at="2") == ""
    assert [at for _size, at in plant.stored(key)] == ["2025-11-17T23:00:00"] * 2


def test_the_form_of_the_preview_chooses_no_days(plant: Plant, tmp_path: Path) -> None:
    """Sent as it is shown, the page asks again: it does not say for a person that the days are meant."""
    path, key = written(tmp_path / "a.csv", DAYS_ASKED["two"]), plant.shop.another("shown", **D40)
    data = {"csrf": plant.engineer.csrf(), "characteristic": key}
    shown = plant.engineer.browser.post("/import", data=data, files={"file": ("a.csv", path.read_bytes())}).text
    form = dict(re.findall(r'<input type="hidden" name="(column_\w+)" value="([^"]*)"', shown))
    assert form["column_measured_at"] == "?"
    assert "every reading gets" not in shown, "nothing is said of what a person is asked"
    assert OF_DAYS in plant.page(path, key, **form)


@pytest.mark.parametrize(
    "text",
    [
        DAYS.replace("18.11.2025 06:05", "A").replace("18.11.2025 06:06", "B"),
        DAYS.replace("Zyklus", "Uhrzeit").replace("18.11.2025 06:05", "").replace("18.11.2025 06:06", ""),
        DAYS.replace("Zyklus", "Uhrzeit"),
    ],
)
def test_cycle_times_and_times_of_day_are_not_asked_about(tmp_path: Path, text: str) -> None:
    layout = look(written(tmp_path / "a.csv", text), Wishes(timezone=ZONE))
    assert (layout.questions, layout.takes_times) == ((), False)
    assert layout.named("measured_at") == ("Datum+Uhrzeit" if "Uhrzeit" in text else "Datum")
    assert ("midnight at the beginning of its day" in layout.on_times) == ("Uhrzeit" not in text)


def test_days_with_midnights_are_days(tmp_path: Path) -> None:
    path = written(tmp_path / "a.csv", DAYS.replace("2025;", "2025 00:00:00;"))
    assert look(path, Wishes(timezone=ZONE)).named("measured_at") == "Aufnahme"


def test_objects_with_days_are_as_tables(tmp_path: Path) -> None:
    text = '{"value": 40.001, "date": "2025-11-18", "stamp": "2025-11-18T06:05:00+01:00"}\n'
    layout = look(written(tmp_path / "a.ndjson", text), Wishes(timezone=ZONE))
    assert (layout.named("measured_at"), layout.days) == ("stamp", "date")
    numbers = "".join(f'{{"value": 40.001, "tick": {1763442300 + 60 * at}}}\n' for at in range(3))
    path = written(tmp_path / "a.ndjson", numbers)
    with pytest.raises(Invalid, match="tick"):
        look(path, Wishes())
    for text in (numbers, numbers.replace("tick", "measured_at")):
        column = "tick" if text == numbers else "measured_at"
        path = written(tmp_path / "a.ndjson", text)
        layout = look(path, Wishes(mapping={"measured_at": column}, time_format=SECONDS))
        found = [each.reading.measured_at for each in lines(path, layout, "x") if isinstance(each, Line)]
        assert [each.minute for each in found if each] == [5, 6, 7]
        refused = [str(each) for each in lines(path, look(path, Wishes(mapping={"measured_at": column})), "x")]
        assert [SECONDS in each for each in refused] == [True] * 3, "no time of the import instead, as it was before"


@pytest.mark.parametrize("text", COUNTS)
def test_numbers_that_may_be_times_are_asked_about(tmp_path: Path, text: str) -> None:
    path = written(tmp_path / "a.csv", text)
    with pytest.raises(Invalid, match=r"The numbers under Takt \(") as refusal:
        look(path, Wishes())
    assert COUNTS[text] in str(refusal.value)
    said = look(path, Wishes(mapping={"measured_at": "Takt"}, time_format=COUNTS[text] or None, timezone=ZONE))
    assert all(isinstance(each, Line) for each in lines(path, said, "x"))
    assert "no column of times" in look(path, Wishes(mapping={"measured_at": ""})).on_times


def test_numbers_that_may_be_times_at_each_door(plant: Plant, tmp_path: Path) -> None:
    path, key = written(tmp_path / "a.csv", COUNTED), plant.shop.another("counted", **D40)
    said = f"form of times “{SECONDS}”"
    assert said in plant.command(path, characteristic=key)
    assert said in str(plant.table(path, COUNTED, characteristic=key))
    assert said in html.unescape(plant.page(path, key))
    assert plant.stored(key) == []
    assert plant.page(path, key, column_measured_at="2", time_format=SECONDS) == ""
    assert plant.stored(key) == morning(40.001, 40.002, 40.003)
