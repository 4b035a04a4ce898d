"""Which corrections a part was cut with, by the time at which it was cut: to the second, as controls tell it."""

from datetime import UTC, datetime, timedelta

import pytest

from app.core.parameters import read
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.corrections_in_effect import CorrectionsInEffect, corrections_in_effect
from app.loop.readings.writer.pending import PendingTool, PendingWrites
from app.loop.readings.writer.snapshot import LoadedCorrection, Snapshot
from tests.shop import PARAMETERS

TEN = datetime(2026, 11, 22, 10, tzinfo=UTC)
SECOND = timedelta(seconds=1)


def in_effect(machined_at: datetime, reset_at: datetime | None = None) -> CorrectionsInEffect:
    """Of a part cut then, with a tool whose correction 5, of -4 µm, was applied at ten; 6, of -2 µm, is pending."""
    corrections = [LoadedCorrection(5, -0.004, "applied", applied_at=TEN), LoadedCorrection(6, -0.002, "pending")]
    total = 0.0 if reset_at is not None and reset_at >= TEN else -0.004
    tool = PendingTool(1, 3, -0.004, total, reset_at, corrections=[*corrections])
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


def test_what_was_applied_at_the_moment_of_the_change_went_out_too() -> None:
    assert list(in_effect(TEN, reset_at=TEN).outstanding) == [6]
