"""Whatever is decided, applied, held, rejected or forgotten: the wear curve is the planted wear plus scatter, exactly.

The machine's gateway and the people are simulated, the decisions are those of the house; no web and no database.
"""

from datetime import UTC, datetime, timedelta
from random import Random

import numpy as np
import pytest

from app.core.decision.step import DECIMALS
from app.core.parameters import read
from app.core.wear import wear
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.decide import decide_reading
from app.loop.readings.writer.pending import PendingCorrection, PendingWrites, Verdict
from app.loop.readings.writer.snapshot import LoadedAverage, LoadedStream, LoadedTool, NamedCorrection, Snapshot
from tests.shop import PARAMETERS

BEGIN = datetime(2026, 11, 21, 6, tzinfo=UTC)
ENTRIES = [Entry(1, "lathe-1", number, name) for number, name in ((1, "seat"), (2, "bore"))]


class Shift:
    """A lathe that cuts two features with one tool, and measures each part some parts later."""

    def __init__(self, seed: int, factors: tuple[float, float], delay: int, how: str, mode: str, policy: str) -> None:
        self.rng = Random(seed)
        self.factors, self.delay, self.how = factors, delay, how
        snapshot = Snapshot(last_correction={1: 0})
        snapshot.tools[1, 3] = LoadedTool(machine_id=1, number=3)
        for entry, factor in zip(ENTRIES, factors, strict=True):
            memory = entry.characteristic_id
            snapshot.averages[1, memory] = LoadedAverage(1, memory, 0.0, 0.0002)
            chosen = {"factor": factor, "average_memory": memory, "mode": mode, "wear_policy": policy, "max_step": 0.5}
            snapshot.parameters[memory] = read(PARAMETERS | chosen)[0]
            snapshot.streams[memory] = LoadedStream(entry=entry, version=1, average=memory, tool=3)
        self.pending = PendingWrites(snapshot)
        tool = self.pending.stream(ENTRIES[0].characteristic_id).tool
        assert tool is not None
        self.tool = tool
        self.now, self.in_effect = BEGIN, 0
        self.bias = [self.rng.gauss(0, 0.006) for _feature in factors]
        self.worn: list[tuple[Verdict, float]] = []  # a verdict, and what was planted in it

    def run(self, parts: int, *, change_at: int) -> None:
        waiting: list[tuple[list[float], list[float], datetime, int]] = []
        wear_ = 0.0
        for part in range(parts):
            self.now += timedelta(seconds=60)
            if part == change_at:
                while waiting and self.how == "number":  # a number alone does not tell which edge cut a part
                    self._measure(*waiting.pop(0))
                self._change_tool()
                wear_ = 0.0
            self._decide()
            self._apply()
            wear_ += 0.0001 + (0.4 if self.rng.random() < 0.01 else 0)  # now and then an edge breaks
            planted = [
                bias + wear_ * (1 if factor < 0 else -1) + self.rng.gauss(0, 0.002)
                for bias, factor in zip(self.bias, self.factors, strict=True)
            ]
            sizes = [
                round(40 + 0.0002 + error - self.tool.offset / factor, 9)
                for error, factor in zip(planted, self.factors, strict=True)
            ]
            waiting.append((planted, sizes, self.now, self.in_effect))
            if len(waiting) > self.delay:
                self._measure(*waiting.pop(0))

    def _measure(self, planted: list[float], sizes: list[float], cut_at: datetime, in_effect: int) -> None:
        for entry, truth, size in zip(ENTRIES, planted, sizes, strict=True):
            told = ReadingIn(entry.characteristic, measured=size, measured_at=self.now)
            if self.how == "number":
                told.correction_in_effect = in_effect
            elif self.how == "time":
                told.machined_at = cut_at
            self.tool.forget()  # people and machine have been at the corrections; a server would load them anew
            verdict = decide_reading(self.pending, entry, told, self.now)
            assert isinstance(verdict, Verdict)
            self.pending.stream(entry.characteristic_id).paused_by = None
            self.worn.append((verdict, truth))

    def _open(self, *statuses: str) -> list[PendingCorrection]:
        return [c for c in self.tool.written() if c.status in statuses]

    def _decide(self) -> None:
        """People release, approve and reject, or leave it."""
        for correction in self._open("held", "awaiting_approval"):
            if self.rng.random() < 0.3:
                correction.status = "rejected" if self.rng.random() < 0.3 else "pending"
                correction.decided_at = self.now

    def _apply(self) -> None:
        """The machine takes what is pending, in order, when it comes to it."""
        if self.rng.random() < 0.4:
            return
        for correction in self._open("pending"):
            self.tool.offset = round(self.tool.offset + correction.amount, DECIMALS)
            self.tool.total = round(self.tool.total + correction.amount, DECIMALS)
            correction.status, correction.applied_at = "applied", self.now
            correction.offset_after = self.tool.offset
            self.in_effect = correction.number
            self.pending.named[1, correction.number] = NamedCorrection(self.now, correction.decided_at)

    def _change_tool(self) -> None:
        self.tool.offset = self.tool.total = 0.0
        self.tool.reset_at = self.now
        for correction in self._open("held", "awaiting_approval", "pending"):
            correction.status = "superseded"
        self.bias = [self.rng.gauss(0, 0.006) for _feature in self.factors]


@pytest.mark.parametrize("mode", ["automatic", "approval"])
@pytest.mark.parametrize("policy", ["hold", "release"])
@pytest.mark.parametrize("how", ["number", "time", "nothing"])
@pytest.mark.parametrize("factors", [(-1.0, -0.5), (0.5, -0.5)])
@pytest.mark.parametrize("seed", [0, 2, 5, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 3, 4))])
def test_the_curve_is_the_planted_wear(
    factors: tuple[float, float], how: str, policy: str, mode: str, seed: int
) -> None:
    delay = 0 if how == "nothing" else seed
    shift = Shift(seed, factors, delay, how, mode, policy)
    shift.run(150, change_at=90)
    told = [(verdict, truth) for verdict, truth in shift.worn if verdict.compensated is not None]
    unknown = len(shift.worn) - len(told)
    assert unknown <= 2 * delay  # parts of the tool before, measured after the change
    for entry, factor in zip(ENTRIES, factors, strict=True):
        mine = [(v, truth) for v, truth in told if v.stream.entry == entry]
        curve = wear(
            np.array([v.decision.deviation for v, _truth in mine]),
            np.array([v.compensated for v, _truth in mine]),
            factor,
        )
        assert curve == pytest.approx(np.array([truth for _v, truth in mine]), abs=2e-9)
    assert any(verdict.compensated for verdict, _truth in told), "the loop was closed"
