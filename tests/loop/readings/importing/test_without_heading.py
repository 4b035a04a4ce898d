"""Tables without a heading, and those whose columns have numbers for names: no reading is lost, and what may be either is asked."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from app.cli.replay import replay_file
from app.errors import Invalid
from app.loop.readings.importing.layout import Wishes, look
from app.loop.readings.importing.lines import Line, lines
from tests.loop.readings.importing.doors import D40, ZONE, Plant

ASKED = "may name the columns, or be a reading"
BARE: list[tuple[str, dict[str, str], list[float]]] = [
    ("40\n41\n40\n", {"measured": "1"}, [40.0, 41.0, 40.0]),
    ("40\n41\n", {"measured": "40"}, [40.0, 41.0]),
    ("40 mm\n41 mm\n", {"measured": "1"}, [40.0, 41.0]),
    ("2;40,001;18.11.2025 06:05\n3;40,002;18.11.2025 06:06\n", {"measured": "2", "measured_at": "3"}, [40.001, 40.002]),
    ("P1;40;18.11.2025 06:05\nP2;41;18.11.2025 06:06\n", {"measured": "2", "measured_at": "3"}, [40.0, 41.0]),
    ("18.11.2025;06:05;40\n18.11.2025;06:06;41\n", {"measured": "3", "measured_at": "1+2"}, [40.0, 41.0]),
    ("3;40\n4;40\n3;40\n", {"measured": "2", "part": "1"}, [40.0, 40.0, 40.0]),
    ("40,01;16,01\n40,02;16,02\n", {"measured": "1"}, [40.01, 40.02]),
    ("P1;40,001\nP2;40\n", {"measured": "2"}, [40.001, 40.0]),
]
NAMED: list[tuple[str, dict[str, str], list[float]]] = [
    ("Part;1;2\nA;40,001;40,002\n", {"measured": "1"}, [40.001]),
    (";1;2\nD40;40,001;40,002\n", {"measured": "2"}, [40.002]),
    ("X;1;2\nD40;40,001;40,002\n", {"measured": "2"}, [40.002]),
    ("1;2;3\n40,001;40,002;40,003\n", {"measured": "3"}, [40.003]),
    ("Nr;40\n1;40,001\n2;40,002\n", {"measured": "40"}, [40.001, 40.002]),
    ("1\n40\n41\n", {"measured": "1"}, [40.0, 41.0]),
]
EITHER = ["40\n40,01\n", "P1;40\nP2;41\n", "1;2\n2;1\n", "16;40\n16,001;40,002\n", "Part;40,5\nA;40,001\n"]


def sizes(path: Path, mapping: Mapping[str, str], **said: Any) -> list[float | str | None]:
    found = lines(path, look(path, Wishes(mapping=mapping, timezone=ZONE, **said)), "x")
    return [each.reading.measured if isinstance(each, Line) else str(each) for each in found]


@pytest.mark.parametrize(("text", "mapping", "wanted"), [*BARE, *NAMED])
def test_a_first_line_of_values_is_a_reading_and_numbers_may_be_names(
    tmp_path: Path, text: str, mapping: dict[str, str], wanted: list[float]
) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    assert sizes(path, mapping) == wanted


@pytest.mark.parametrize("text", EITHER)
def test_what_may_be_a_heading_or_a_reading_is_asked(tmp_path: Path, text: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text)
    place = str(text.partition("\n")[0].count(";") + 1)
    with pytest.raises(Invalid, match=ASKED):
        look(path, Wishes(mapping={"measured": place}))
    count = len(text.splitlines())
    assert len(sizes(path, {"measured": place}, first_line=1)) == count
    assert len(sizes(path, {"measured": place}, header_line=1)) == count - 1


def test_a_table_without_a_heading_at_each_door(plant: Plant, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("40\n41\n40\n")
    wanted = [40.0, 41.0, 40.0]
    keys = [plant.shop.another(f"bare-{door}", **D40 | {"confidence_limit": 5.0}) for door in ("cli", "rest", "page")]
    assert plant.command(path, characteristic=keys[0], mapping="measured=1") == ""
    assert plant.table(path, path.read_text(), characteristic=keys[1], map={"measured": "1"})["status"] == 200
    assert plant.page(path, keys[2], column_measured="1") == ""
    assert [[size for size, _at in plant.stored(key)] for key in keys] == [wanted] * 3
    data = {"csrf": plant.engineer.csrf(), "characteristic": keys[2]}
    shown = plant.engineer.browser.post("/import", data=data, files={"file": ("a.csv", path.read_bytes())}).text
    assert "None: the first line is a reading." in shown, "the preview"
    answer = plant.table(path, "7;40\n8;41\n", characteristics={"2": plant.shop.another("bare-wide", **D40)})
    assert (answer["status"], answer["stored"]) == (200, 2), answer


def test_a_doubtful_heading_is_asked_at_each_door(plant: Plant, tmp_path: Path) -> None:
    path, key = tmp_path / "a.csv", plant.shop.another("doubt", **D40)
    path.write_text("40\n40,01\n")
    assert ASKED in plant.command(path, characteristic=key, mapping="measured=1")
    assert ASKED in str(plant.table(path, path.read_text(), characteristic=key, map={"measured": "1"}))
    assert ASKED in plant.page(path, key, column_measured="1")
    path.write_text("P1;40,001;16,002\nP2;40,002;16,003\n")
    assert ASKED in str(plant.table(path, path.read_text(), characteristics={"2": key}))
    assert ASKED in plant.page(path, to_2=key)
    assert plant.stored(key) == []
    assert plant.page(path, to_2=key, first_line="1") == ""
    assert [size for size, _at in plant.stored(key)] == [40.001, 40.002]


def test_a_doubtful_heading_is_answered_when_readings_are_replayed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path, rules = tmp_path / "a.csv", tmp_path / "p.json"
    path.write_text("40\n40,01\n")
    rules.write_text(json.dumps(D40 | {"zero_range": 0.001, "wear_limit": 0.5, "confidence_limit": 1.0}))
    with pytest.raises(Invalid, match=ASKED):
        replay_file(path, rules, mapping="measured=1", as_json=True)
    replay_file(path, rules, mapping="measured=1", as_json=True, first_line=1)
    assert len(capsys.readouterr().out.splitlines()) == 2
