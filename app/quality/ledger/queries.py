"""The ledger of a machine: each of its characteristics replayed without corrections, held against what happened. Never writes."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from app.core.decision.limits import in_nanometres, reaches, within
from app.core.decision.loops import Mark
from app.core.ledger import Flags, Tally, tally, together
from app.core.parameters import Feature, Mode
from app.core.period import Period, moment_of
from app.core.replay import Policy, run
from app.language.times import begin_of_day, local
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.tables.machines import Machine
from app.quality.what_if.queries import ToolHistory, past_of, turn

WEEKS = 8  # where no period is named
MOST = 200_000  # readings of a characteristic, the newest


class Entry(NamedTuple):
    """The parts of one characteristic that one tool has cut in one week. week: its Monday, by the plant's clock."""

    characteristic: str
    tool: int
    week: datetime
    tally: Tally


class OfCharacteristic(NamedTuple):
    """A characteristic of the ledger. unknown: readings left out, because their corrections are not known."""

    key: str
    name: str
    tool: int
    tally: Tally
    unknown: int


class Ledger(NamedTuple):
    """The ledger of a machine. others: characteristics that correct nothing, or have nothing in the period."""

    machine: Machine
    period: Period
    characteristics: list[OfCharacteristic]
    entries: list[Entry]
    others: list[str]

    @property
    def total(self) -> Tally:
        """All of it. A part that two characteristics reject counts at each."""
        return together([each.tally for each in self.characteristics])

    def by_week(self) -> list[tuple[datetime, Tally]]:
        """Each week, the newest first."""
        weeks = sorted({entry.week for entry in self.entries}, reverse=True)
        return [(week, together([each.tally for each in self.entries if each.week == week])) for week in weeks]

    def by_tool(self) -> list[tuple[int, Tally]]:
        """Each tool."""
        tools = sorted({each.tool for each in self.characteristics})
        return [(tool, together([each.tally for each in self.characteristics if each.tool == tool])) for tool in tools]


class Verdicts(NamedTuple):
    """Of each reading that counts: out of tolerance without corrections, truly, and for being late alone."""

    without: Flags
    truly: Flags
    late: Flags
    counted: Flags


def verdicts_of(past: ToolHistory) -> Verdicts:
    """The replay that only measures, held against what happened; probe faults are no rejects."""
    lanes = tuple(
        lane._replace(parameters=replace(lane.parameters, mode=Mode.MEASURE_ONLY)) for lane in past.then.lanes
    )
    free = run(past.trace, Policy(lanes))[0].deviation[past.mine]
    lane = past.trace.lane[past.mine]
    limits = [known.parameters.limits for known in past.then.lanes]
    tolerance, confidence = (
        np.array([getattr(each, name) for each in limits])[lane] for name in ("tolerance", "confidence")
    )

    def out(deviation: NDArray[np.float64]) -> Flags:
        size = in_nanometres(deviation)
        return np.asarray(~within(size, tolerance) & ~reaches(size, confidence))

    counted = (past.trace.marks[past.mine] & Mark.LEFT_OUT) == 0
    truly = out(past.history["deviation"])
    late = truly & within(in_nanometres(past.history["decided"]), tolerance)
    return Verdicts(out(free)[counted], truly[counted], late[counted], counted)


def usual_period(now: datetime) -> Period:
    """The last eight weeks, today's included."""
    return Period(begin_of_day(now, -local(now).weekday() - 7 * (WEEKS - 1)), None)


def ledger_of(session: Session, machine: Machine, period: Period, now: datetime) -> Ledger:
    """The ledger of a machine. Raises `TooManyRequests` while other replays run."""
    if not period.bounded:
        period = usual_period(now)
    found: list[OfCharacteristic] = []
    entries: list[Entry] = []
    others: list[str] = []
    with turn():
        for current in characteristics.characteristics(session, machine_id=machine.id):
            past = _past(session, current, period)
            if past is None or not len(past.history):
                others.append(current.characteristic.name)
                continue
            of_all, of_weeks = _of(past)
            key, tool = current.characteristic.key, current.parameters.tool_memory
            found.append(OfCharacteristic(key, current.characteristic.name, tool, of_all, past.unknown))
            entries += [Entry(key, tool, week, each) for week, each in of_weeks]
    return Ledger(machine, period, found, entries, others)


def _past(session: Session, current: CurrentCharacteristic, period: Period) -> ToolHistory | None:
    parameters = current.parameters
    if not parameters.tool_memory or parameters.feature is Feature.TOOL:
        return None
    window = statistics.window_of(session, current.characteristic, last=MOST, period=period)
    past = past_of(session, current, window) if window.count else None
    return None if past is None or past.imported else past


def _of(past: ToolHistory) -> tuple[Tally, list[tuple[datetime, Tally]]]:
    found = verdicts_of(past)
    without, truly, late, counted = found
    at = past.history["measured_at"][counted]
    of_weeks = []
    if len(at):
        weeks = _weeks(at.min(), at.max())
        place = np.searchsorted(np.array([moment_of(week) for week in weeks]), at, side="right") - 1
        for number in np.unique(place).tolist():
            here = place == number
            of_weeks.append((weeks[number], tally(without[here], truly[here], late[here])))
    return tally(without, truly, late), of_weeks


def _weeks(first: np.datetime64, last: np.datetime64) -> list[datetime]:
    """The Mondays of the weeks from the first moment to the last, at midnight by the plant's clock."""
    begin, end = (moment.astype("datetime64[us]").item().replace(tzinfo=UTC) for moment in (first, last))
    week = begin_of_day(begin, -local(begin).weekday())
    weeks = []
    while week <= end:
        weeks.append(week)
        week = begin_of_day(week, 7)
    return weeks
