"""Batches whose readings each leave a correction behind that the machine has not applied: as fast as they are long."""

from datetime import UTC, datetime
from random import Random
from typing import Any

import pytest

from app.core.parameters import read
from app.loop.readings.records import MOST_OUTSTANDING, Entry, Record
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.wording import reason
from app.loop.readings.writer import columnar, corrections_in_effect
from app.loop.readings.writer.binary_copy import HEADER, TRAILER, array_of_int4
from app.loop.readings.writer.columnar import ColumnarReadings, decide_in_columns
from app.loop.readings.writer.corrections_in_effect import FirstNumbers
from app.loop.readings.writer.decide import decide_reading
from app.loop.readings.writer.pending import PendingWrites, Verdict
from app.loop.readings.writer.snapshot import (
    LoadedAverage,
    LoadedCorrection,
    LoadedStream,
    LoadedTool,
    NamedCorrection,
    Snapshot,
)
from tests.shop import PARAMETERS

NOW = datetime(2026, 11, 22, 6, tzinfo=UTC)
ENTRY = Entry(1, "lathe-1", 1, "seat")
COUNT = 300


def pending_on(*corrections: LoadedCorrection, **parameters: Any) -> PendingWrites:
    snapshot = Snapshot({1: read(PARAMETERS | parameters)[0]}, last_correction={1: 0}, versions={1: 0})
    snapshot.tools[1, 3] = LoadedTool(machine_id=1, number=3, corrections=corrections)
    snapshot.averages[1, 5] = LoadedAverage(1, 5)
    snapshot.streams[1] = LoadedStream(entry=ENTRY, version=1, average=5, tool=3)
    return PendingWrites(snapshot)


def sizes(count: int) -> list[float]:
    """Each asks for a correction, although all those before are counted in; in no order that looks like their effect."""
    rng, deviations = Random(7), [0.0]
    for _part in range(count):
        deviations.append(rng.choice([each for each in (-0.0075, -0.0025, 0.0025, 0.0075) if each != deviations[-1]]))
    return [40 + each for each in deviations[1:]]


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
    calls = counted(monkeypatch, corrections_in_effect, "_not_in_effect")
    pending = pending_on(max_total=max_total)
    for size in sizes(COUNT):
        decide_reading(pending, ENTRY, ReadingIn("seat", measured=size, correction_in_effect=in_effect), NOW)
    assert len(pending.issued) == COUNT
    assert calls[0] <= 3 * COUNT


def test_a_batch_asks_once_for_each_reading_however_many_corrections_its_readings_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    calls = counted(monkeypatch, columnar._Group, "series")
    pending = pending_on()
    wanted = [(ENTRY, ReadingIn("seat", measured=40.007, correction_in_effect=at, key=str(at))) for at in range(COUNT)]
    outcomes = decide_in_columns(pending, wanted, NOW)
    assert len(pending.issued) == COUNT
    assert calls[0] <= 2 * COUNT
    assert not any(isinstance(outcome, ColumnarReadings) for outcome in outcomes)
    assert pending.column_rows is not None
    assert len(pending.column_rows()) == len(HEADER) + len(TRAILER)


@pytest.mark.parametrize("seed", range(12))
def test_what_is_kept_of_a_tool_changes_no_decision(seed: int) -> None:
    """The same readings, once with all that is kept forgotten before each of them."""

    def records(*, forgetting: bool) -> list[Record]:
        rng = Random(seed)
        pending = pending_on(mode="approval" if seed % 3 == 1 else "automatic", max_total=0.05 if seed % 2 else None)
        rows = []
        for at in range(120):
            named = rng.choice([None, 0, pending.last_number(1), rng.randint(0, pending.last_number(1))])
            when = NOW if rng.random() < 0.2 else None
            size = 40 + rng.choice([0.0005, 0.003, 0.007, -0.007, 0.4])
            pending.stream(1).paused_by = None
            if named is not None:
                pending.named.setdefault((1, named), NamedCorrection(None, None))
            if forgetting and (tool := pending.stream(1).tool) is not None:
                tool.forget()
            reading = ReadingIn("seat", measured=size, correction_in_effect=named, machined_at=when, key=str(at))
            verdict = decide_reading(pending, ENTRY, reading, NOW)
            assert isinstance(verdict, Verdict)
            rows.append(verdict.record())
        return rows

    kept, fresh = records(forgetting=False), records(forgetting=True)
    assert kept == fresh
    assert any(len(record.outstanding or ()) > 3 for record in kept)


def test_of_very_many_the_first_are_stored_and_all_count() -> None:
    """Where nobody confirms, the numbers of a year of corrections would be stored with each reading."""
    pending = pending_on(*(LoadedCorrection(number, -0.00001, "pending") for number in range(1, 1001)))
    verdict = decide_reading(pending, ENTRY, ReadingIn("seat", measured=40.013), NOW)
    assert isinstance(verdict, Verdict)
    record = verdict.record()
    assert list(record.outstanding or ()) == list(range(1, MOST_OUTSTANDING + 1))
    assert (record.deviation, record.decided) == (0.013, 0.003)
    assert "before corrections 1, 2, 3 and at least 97 more took effect" in reason(record, verdict.parameters)["text"]


def test_readings_share_the_numbers_and_each_keeps_its_own_count() -> None:
    numbers = [3, 5]
    first = FirstNumbers(numbers)
    numbers.append(8)
    assert list(first) == [3, 5] == first[:9]
    assert (len(first), first[-1]) == (2, 5)
    assert array_of_int4(first) == array_of_int4([3, 5]) != array_of_int4(numbers)
    with pytest.raises(IndexError):
        _ = first[2]


def test_what_another_tool_tells_of_the_named_correction_is_not_missed() -> None:
    """17 is another tool's and pending; once a part there shows when it took effect, 5, approved later, was not in it."""
    eight, nine, ten = (datetime(2026, 11, 22, hour, tzinfo=UTC) for hour in (8, 9, 10))
    pending = pending_on(LoadedCorrection(5, -0.004, "applied", applied_at=ten, decided_at=nine))
    tool = pending.stream(1).tool
    pending.named[1, 17] = NamedCorrection(None, None)
    reading = ReadingIn("shaft", measured=40.0, correction_in_effect=17)
    assert (
        list(corrections_in_effect.corrections_in_effect(pending, tool, reading, read(PARAMETERS)[0]).outstanding) == []
    )
    pending.named[1, 17] = NamedCorrection(eight, None)
    assert list(
        corrections_in_effect.corrections_in_effect(pending, tool, reading, read(PARAMETERS)[0]).outstanding
    ) == [5]
