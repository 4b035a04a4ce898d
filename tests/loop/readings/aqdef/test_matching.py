"""Which characteristic here one of the file is: by what is remembered, name and part; thousands as quickly as one."""

import time
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

from app.loop.readings.aqdef.matching import Content, guessed, key_for, named

MANY = 6_000
MOST = 3.0  # s of a processor, ten times what is needed; what grows with the square takes minutes


def content(index: int = 1, number: str = "D40", name: str = "Seat", part: str = "", part_name: str = "") -> Content:
    return Content(index, part, part_name, number, name, "mm")


def here(key: str, name: str = "", part: str | None = None) -> Any:
    return SimpleNamespace(characteristic=SimpleNamespace(key=key, name=name or key, part=part))


@pytest.mark.parametrize(
    ("known", "part", "found"),
    [
        ([here("d40")], "", "d40"),
        ([here("d40")], "shaft", "d40"),  # nothing said is no contradiction
        ([here("d40", part="shaft")], "", "d40"),
        ([here("d40", part="shaft")], "Shaft", "d40"),
        ([here("d40", part="bush")], "shaft", None),
        ([here("a", "D40", "shaft"), here("b", "D40", "bush")], "shaft", "a"),
        ([here("a", "D40", "shaft"), here("b", "D40", "bush")], "", None),
        ([here("a", "D40", "shaft"), here("b", "D40")], "shaft", "a"),  # the one of which the part is said
        ([here("a", "D40", "shaft"), here("b", "D40")], "", "a"),
        ([here("a", "D40"), here("b", "D40")], "shaft", None),
        ([here("a", "D40", "shaft"), here("b", "D40", "shaft")], "shaft", None),
        ([here("D40", "d40", "shaft")], "shaft", "D40"),  # one by key and by name
        ([here("seat", part="shaft"), here("x")], "shaft", "seat"),  # by name, where the number is not known
    ],
)
def test_the_one_of_its_part_with_its_number_or_name(known: list[Any], part: str, found: str | None) -> None:
    assert guessed([content(part=part)], known, {}).get(1) == found


def test_none_is_guessed_twice_and_what_is_remembered_comes_first() -> None:
    contents = [content(1), content(2), content(3, "X", "X")]
    assert guessed(contents, [here("d40")], {("", "X", "X"): "other"}) == {1: "d40", 3: "other"}


def test_said_by_number_name_part_or_index() -> None:
    found = [
        content(1, "D40", "Seat", "shaft", "Shaft 0815"),
        content(2, "D40", "Bore", "bush"),
        content(3, "4", "A:B"),
    ]
    for name, index in {
        "Seat": 1, "Bore": 2, "shaft:D40": 1, "Shaft 0815:D40": 1, "bush:D40": 2, "bush:Bore": 2, "2": 2, "4": 3, "A:B": 3,
    }.items():  # fmt: skip
        assert named([(name, "here")], found) == {index: "here"}
    for name, reason in {
        "D40": "is 2 characteristics", "shaft:Bore": "is no characteristic", "shaft:2": "is no characteristic",
    }.items():  # fmt: skip
        with pytest.raises(ValueError, match=reason):
            named([(name, "here")], found)


def test_keys_that_are_not_taken() -> None:
    taken = dict.fromkeys(["shaft-d40", "shaft-d40-2"], 1)
    assert [key_for(content(part="Shaft"), taken) for _each in range(3)] == [
        "shaft-d40-3",
        "shaft-d40-4",
        "shaft-d40-5",
    ]
    assert key_for(content(number="D40-4", part="Shaft"), taken) == "shaft-d40-4-2"
    assert key_for(content(7, "Ø", "°"), taken) == key_for(content(7, "Ø", "°"), {})


def many_keys() -> None:
    taken: dict[str, int] = {}
    assert len({key_for(content(part="Shaft"), taken) for _each in range(MANY)}) == MANY


def many_of_one_name() -> None:
    known = [here(f"c{at}", "D40", f"part {at}") for at in range(MANY)]
    found = [content(at, part=f"Part {at}") for at in range(MANY)]
    assert guessed(found, known, {}) == {at: f"c{at}" for at in range(MANY)}


def many_said() -> None:
    found = [content(at, f"D{at}", "Seat", "shaft") for at in range(MANY)]
    assert len(named([(f"shaft:D{at}", f"c{at}") for at in range(MANY)], found)) == MANY


@pytest.mark.parametrize("work", [many_keys, many_of_one_name, many_said])
def test_as_quickly_for_thousands(work: Callable[[], None]) -> None:
    begun = time.thread_time()
    work()
    assert time.thread_time() - begun < MOST
