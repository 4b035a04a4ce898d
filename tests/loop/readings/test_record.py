"""The plainest bookkeeping of decisions, by which campaigns judge the record: corrections that fell with a pause count no more."""

from typing import Any

from app.core.parameters import read
from tests.loop.readings.record import replay
from tests.shop import PARAMETERS


def test_corrections_that_fell_with_a_pause_are_outstanding_up_to_its_reading() -> None:
    def row(correction: int | None, status: str | None, paused_by: int | None = None) -> dict[str, Any]:
        known = {"measured": 40.006, "correction_in_effect": 0, "paused_by": paused_by}
        return known | {"correction": correction, "status": status}

    stored = [row(1, "applied"), row(2, "superseded"), row(None, None, 7), row(None, None, 7)]
    for each, outside in zip(stored, (0.006, 0.018, 0.0, 0.0), strict=True):
        each["measured"] = 40 + outside
    done = replay(read(PARAMETERS)[0], stored)
    assert [reading["expected_outstanding"] for reading, _decision in done] == [[], [1], [1, 2], [1]]
