"""Which corrections a part was cut with, by the time at which it was cut: to the second, as controls tell it."""

from datetime import UTC, datetime, timedelta

import pytest

from app.core.parameters import read
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.corrections_in_effect import CorrectionsInEffect, confirm, corrections_in_effect
from app.loop.readings.writer.pending import PendingTool, PendingWrites
from app.loop.readings.writer.snapshot import LoadedCorrection, LoadedStream, LoadedTool, NamedCorrection, Snapshot
from tests.shop import PARAMETERS

TEN = datetime(2026, 11, 22, 10, tzinfo=UTC)
SECOND = timedelta(seconds=1)


def in_effect(machined_at: datetime, reset_at: datetime | None = None) -> CorrectionsInEffect:
    """Of a part cut then, with a tool whose correction 5, of -4 µm, was applied at ten; 6, of -2 µm, is pending."""
    corrections = [LoadedCorrection(5, -0.004, "applied", applied_at=TEN), LoadedCorrection(6, -0.002, "pending")]
    total = 0.0 if reset_at is not None and reset_at >= TEN else -0.004
    tool = PendingTool(
        machine_id=1, number=3, offset=-0.004, total=total, reset_at=reset_at, corrections=[*corrections]
    )
    reading = ReadingIn("shaft", measured=40.0, machined_at=machined_at)
    return corrections_in_effect(PendingWrites(Snapshot()), tool, reading, read(PARAMETERS)[0])


@pytest.mark.parametrize(
    ("machined_at", "outstanding", "compensated"),
    [(TEN - SECOND, [5, 6], 0.0), (TEN, [6], -0.004), (TEN + SECOND, [6], -0.004)],
)
def test_a_part_cut_from_that_moment_on_has_the_correction(
    machined_at: datetime, outstanding: list[int], compensated: float
) -> None:
    found = in_effect(machined_at)
    assert (list(found.outstanding), found.compensated, found.previous_tool) == (outstanding, compensated, False)
    assert sum(found.amounts) == pytest.approx(-0.002 if compensated else -0.006)


@pytest.mark.parametrize(
    ("machined_at", "previous_tool"), [(TEN, True), (TEN + SECOND, False), (TEN + 2 * SECOND, False)]
)
def test_a_part_cut_from_the_change_on_is_the_new_tools(machined_at: datetime, previous_tool: bool) -> None:
    found = in_effect(machined_at, reset_at=TEN + SECOND)
    assert (found.previous_tool, found.compensated) == (previous_tool, None if previous_tool else 0.0)
    assert list(found.outstanding) == [6], "what was applied before the change went out with the tool"


@pytest.mark.parametrize("waits", ["awaiting_approval", "held"])
def test_a_reading_applies_nothing_that_a_person_has_not_let_go(waits: str) -> None:
    """2 was approved, and the reading names it; 1 lies before it and still waits."""
    corrections = [LoadedCorrection(1, -0.006, waits), LoadedCorrection(2, -0.007, "pending", decided_at=TEN)]
    snapshot = Snapshot({1: read(PARAMETERS)[0]}, named={(1, 2): NamedCorrection(None, TEN)})
    snapshot.streams[1] = LoadedStream(entry=Entry(1, "lathe-1", 1, "shaft"), version=1, average=None, tool=3)
    snapshot.tools[1, 3] = LoadedTool(machine_id=1, number=3, corrections=corrections)
    pending = PendingWrites(snapshot)
    stream = pending.stream(1)
    tool = stream.tool
    assert tool is not None
    confirm(pending, stream, tool, 2, TEN + SECOND)
    assert [each.status for each in tool.corrections] == [waits, "applied"]
    assert (tool.offset, tool.total) == (-0.007, -0.007)
    assert [each.correction for each in pending.offset_changes] == [2]
