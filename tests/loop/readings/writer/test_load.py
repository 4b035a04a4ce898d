"""Loading the state of readings: what the first load finds goes into the second, for readings of form."""

from datetime import UTC, datetime
from typing import Any, cast

import msgspec

from app.db.pipeline import Pipeline
from app.loop.readings.writer import load
from app.loop.readings.writer.snapshot import Snapshot
from tests.loops import run


class Answer:
    """A database that has this one answer."""

    def __init__(self, **document: Any) -> None:
        self.text = msgspec.json.encode({"streams": [], "named": None, "known": None} | document)

    async def run(self, _steps: object) -> Any:
        return (((self.text,),),)


def test_tools_of_form_go_back_to_the_oldest_correction_that_any_reading_names() -> None:
    """A correction that was released between two that are named is in the part of neither, and may be corrected only once."""
    nine, ten = (datetime(2026, 3, 2, hour, tzinfo=UTC) for hour in (9, 10))
    machines: dict[int, dict[str, Any]] = {1: {"number": 3, "since": None}}
    times = [(5, ten), (3, nine), (6, None)]
    named = [(1, number, (at, None, None, "applied" if at else "pending", 3, nine)) for number, at in times]
    answer = cast("Pipeline", Answer(named=named))
    run(load._load(answer, {}, Snapshot(), (), machines, (), optimistic=True))
    assert machines == {1: {"number": 3, "since": nine}}
