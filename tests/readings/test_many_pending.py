"""Batches whose readings each leave a correction behind that the machine has not applied: as fast as they are long."""

from datetime import UTC, datetime
from random import Random
from typing import Any

import pytest

from app.core.parameters import read
from app.readings import cutting, quiet
from app.readings.cutting import Firsts
from app.readings.ground import AverageState, Ground, IssuedCorrection, Named, StreamState, ToolState, Verdict
from app.readings.judge import judge
from app.readings.quiet import QuietReadings
from app.readings.records import MOST_OUTSTANDING, Entry, Record
from app.readings.rows import HEADER, TRAILER, array_of_int4
from app.readings.schemas import ReadingIn
from app.readings.transaction import _decide
from app.readings.wording import reason
from tests.shop import PARAMETERS

NOW = datetime(2026, 11, 22, 6, tzinfo=UTC)
ENTRY = Entry(1, "lathe-1", 1, "seat")
COUNT = 300


def ground_of(**parameters: Any) -> Ground:
    ground = Ground(last_correction={1: 0}, versions={1: 0})
    tool = ground.tools[1, 3] = ToolState(1, 3, 0.0, 0.0, None)
    memory = ground.averages[1, 5] = AverageState(1, 5, 0.0, 0.0)
    given = read(PARAMETERS | parameters)[0]
    ground.streams[1] = StreamState(ENTRY, 0, 1, given, memory, tool, None, None)
    return ground


def sizes(count: int, step: float = 0.007) -> list[float]:
    """Each asks for a correction, although all those before are counted in."""
    return [40 + (step if at % 2 == 0 else 0) for at in range(count)]


def counted(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str) -> list[int]:
    calls = [0]
    inner = getattr(owner, name)

    def outer(*args: Any, **kwargs: Any) -> Any:
        calls[0] += 1
        return inner(*args, **kwargs)

    monkeypatch.setattr(owner, name, outer)
    return calls


@pytest.mark.parametrize("in_effect", [None, 0])
@pytest.mark.parametrize("max_total", [None, 5.0])
def test_each_correction_is_looked_at_once(
    monkeypatch: pytest.MonkeyPatch, in_effect: int | None, max_total: float | None
) -> None:
    calls = counted(monkeypatch, cutting, "_not_in_effect")
    ground = ground_of(max_total=max_total)
    for size in sizes(COUNT):
        judge(ground, ENTRY, ReadingIn("seat", measured=size, correction_in_effect=in_effect), NOW)
    assert len(ground.issued) == COUNT
    assert calls[0] <= 3 * COUNT


def test_a_batch_asks_once_for_each_reading_however_many_corrections_its_readings_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = counted(monkeypatch, quiet._Kind, "lane")
    ground = ground_of()
    wanted = [(ENTRY, ReadingIn("seat", measured=40.007, correction_in_effect=at, key=str(at))) for at in range(COUNT)]
    columns = QuietReadings(ground, wanted, NOW)
    _decide(ground, wanted, NOW, columns)
    assert len(ground.issued) == COUNT
    assert calls[0] <= 2 * COUNT
    assert len(columns) == 0
    assert len(columns.rows()) == len(HEADER) + len(TRAILER)


@pytest.mark.parametrize("seed", range(12))
def test_what_is_kept_of_a_tool_changes_no_decision(seed: int) -> None:
    """The same readings, once with all that is kept forgotten before each of them."""

    def records(*, forgetting: bool) -> list[Record]:
        rng = Random(seed)
        ground = ground_of(mode="approval" if seed % 3 == 1 else "automatic", max_total=0.05 if seed % 2 else None)
        found = []
        for at in range(120):
            named = rng.choice([None, 0, ground.last_correction[1], rng.randint(0, ground.last_correction[1])])
            when = NOW if rng.random() < 0.2 else None
            size = 40 + rng.choice([0.0005, 0.003, 0.007, -0.007, 0.4])
            ground.streams[1].paused_by = None
            if named is not None:
                ground.named.setdefault((1, named), Named(None, None))
            if forgetting:
                ground.tools[1, 3].forget()
            reading = ReadingIn("seat", measured=size, correction_in_effect=named, machined_at=when, key=str(at))
            verdict = judge(ground, ENTRY, reading, NOW)
            assert isinstance(verdict, Verdict)
            found.append(verdict.record())
        return found

    kept, fresh = records(forgetting=False), records(forgetting=True)
    assert kept == fresh
    assert any(len(record.outstanding or ()) > 3 for record in kept)


def test_of_very_many_the_first_are_stored_and_all_count() -> None:
    """Where nobody confirms, the numbers of a year of corrections would be stored with each reading."""
    ground = ground_of()
    tool = ground.tools[1, 3]
    tool.corrections = [IssuedCorrection(1, number, 3, -0.00001, "pending") for number in range(1, 1001)]
    verdict = judge(ground, ENTRY, ReadingIn("seat", measured=40.013), NOW)
    assert isinstance(verdict, Verdict)
    record = verdict.record()
    assert list(record.outstanding or ()) == list(range(1, MOST_OUTSTANDING + 1))
    assert (record.deviation, record.decided) == (0.013, 0.003)
    assert "before correction 1, 2, 3 and at least 97 more took effect" in reason(record, verdict.parameters)["text"]


def test_readings_share_the_numbers_and_each_keeps_its_own_count() -> None:
    numbers = [3, 5]
    first = Firsts(numbers)
    numbers.append(8)
    assert list(first) == [3, 5] == first[:9]
    assert (len(first), first[-1]) == (2, 5)
    assert array_of_int4(first) == array_of_int4([3, 5]) != array_of_int4(numbers)
    with pytest.raises(IndexError):
        _ = first[2]


def test_what_another_tool_tells_of_the_named_correction_is_not_missed() -> None:
    """17 is another tool's and pending; once a part there shows when it took effect, 5, approved later, was not in it."""
    eight, nine, ten = (datetime(2026, 11, 22, hour, tzinfo=UTC) for hour in (8, 9, 10))
    ground = ground_of()
    tool = ground.tools[1, 3]
    tool.corrections = [IssuedCorrection(1, 5, 3, -0.004, "applied", applied_at=ten, decided_at=nine)]
    ground.named[1, 17] = Named(None, None)
    reading = ReadingIn("shaft", measured=40.0, correction_in_effect=17)
    assert list(cutting.cut_with(ground, tool, reading).outstanding) == []
    ground.named[1, 17].applied_at = eight
    assert list(cutting.cut_with(ground, tool, reading).outstanding) == [5]
