"""Corrections in effect when the part of a reading was cut, its tool, and the corrections that a reading confirms.

Every reading of a batch asks for them, and a batch may leave as many corrections behind as it has readings. So a tool keeps
a tally for the parts that name the same correction (`PendingTool.tallies`), which goes on when a correction is issued;
whatever else happens to a correction makes it forgotten.
"""

from collections.abc import Iterator, Sequence
from datetime import datetime
from itertools import islice
from typing import NamedTuple, overload

from app.core.decision.step import DECIMALS, rounded
from app.core.parameters import Feature, Parameters
from app.loop.readings.records import MOST_OUTSTANDING
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.doubts import fell
from app.loop.readings.writer.pending import (
    EffectTally,
    OffsetChange,
    PendingCorrection,
    PendingStream,
    PendingTool,
    PendingWrites,
)
from app.loop.readings.writer.snapshot import LoadedCorrection, NamedCorrection
from app.loop.tables.tools import OUTSTANDING

MOST_TALLIES = 8  # that a tool keeps; each is as long as its open corrections are many


class FirstNumbers(Sequence[int]):
    """The first numbers of a list that goes on growing: a batch's readings share one list of outstanding corrections.

    At most MOST_OUTSTANDING of them, because each reading is stored with its own.
    """

    __slots__ = ("_count", "_numbers")

    def __init__(self, numbers: list[int]) -> None:
        self._numbers, self._count = numbers, min(len(numbers), MOST_OUTSTANDING)

    def __len__(self) -> int:
        return self._count

    @overload
    def __getitem__(self, at: int) -> int: ...
    @overload
    def __getitem__(self, at: slice) -> list[int]: ...
    def __getitem__(self, at: int | slice) -> int | list[int]:
        if isinstance(at, slice):
            return self._numbers[: self._count][at]
        return self._numbers[range(self._count)[at]]

    def __iter__(self) -> Iterator[int]:
        return islice(self._numbers, self._count)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and list(self) == list(other)

    def __hash__(self) -> int:
        return hash(tuple(self))

    def __repr__(self) -> str:
        return repr(list(self))


class CorrectionsInEffect(NamedTuple):
    """Corrections that a part was cut with, and without.

    previous_tool: with an offset from before a tool change or an edit by hand. outstanding: numbers of the corrections it
    was cut without, of very many the first; amounts: of all of them, mm of offset, valid until the next reading is decided.
    compensated: the sum (mm) of those of this tool's life that it was cut with; None with a previous tool, and where one that has
    fallen may be among them.
    """

    previous_tool: bool
    outstanding: Sequence[int]
    amounts: Sequence[float]
    compensated: float | None


WITHOUT_TOOL = CorrectionsInEffect(previous_tool=False, outstanding=(), amounts=(), compensated=0.0)


def corrections_in_effect(
    pending: PendingWrites, tool: PendingTool | None, reading: ReadingIn, parameters: Parameters
) -> CorrectionsInEffect:
    """Return what the part of a reading was cut with; the size of a tool itself depends on no correction."""
    if tool is None or parameters.feature is Feature.TOOL:
        return _of_tool(pending, tool, reading) if parameters.rules.of_tool and tool is not None else WITHOUT_TOOL
    tally = _tally(pending, tool, reading.correction_in_effect)
    if tally.in_effect is None and tally.has_applied and reading.machined_at is not None:
        tally = _extend(EffectTally(None, None), tool, reading.machined_at)
    previous_tool = tally.previous_tool
    if tool.reset_at is not None and reading.machined_at is not None:
        previous_tool = reading.machined_at < tool.reset_at
    compensated = None
    if not previous_tool and not fell(pending, tool, reading.correction_in_effect):
        compensated = tool.total
        for amount in tally.applied_since:
            compensated -= amount
        compensated = rounded(compensated)
    return CorrectionsInEffect(
        previous_tool, FirstNumbers(tally.numbers) if tally.numbers else (), tally.amounts, compensated
    )


def _of_tool(pending: PendingWrites, tool: PendingTool, reading: ReadingIn) -> CorrectionsInEffect:
    """Return what the size of the tool itself shows: nothing of all that was corrected since it was changed."""
    at = reading.machined_at or reading.measured_at
    if tool.reset_at is not None and at is not None and at < tool.reset_at:
        return CorrectionsInEffect(previous_tool=True, outstanding=(), amounts=(), compensated=None)
    if tool.set_by_hand:
        return WITHOUT_TOOL
    amounts = (tool.total, *_tally(pending, tool, None).issued)
    return CorrectionsInEffect(
        previous_tool=False, outstanding=(), amounts=amounts if any(amounts) else (), compensated=0.0
    )


def confirms(pending: PendingWrites, tool: PendingTool | None, in_effect: int | None) -> bool:
    """Tell if a reading that names this correction confirms one that is pending."""
    return tool is not None and in_effect is not None and _tally(pending, tool, in_effect).confirms


def confirm(
    pending: PendingWrites, stream: PendingStream, tool: PendingTool | None, in_effect: int | None, at: datetime
) -> None:
    """Apply this tool's pending corrections up to `in_effect`, which the machine says it cut with."""
    if tool is None or in_effect is None or not confirms(pending, tool, in_effect):
        return
    last = pending.named_correction(tool.machine_id, in_effect)
    for place, issued in enumerate(tool.corrections):
        if issued.status != "pending" or not _took_effect(issued, in_effect, last):
            continue
        correction = tool.changing(place)
        before = tool.offset
        tool.offset = round(before + correction.amount, DECIMALS)
        tool.total = round(tool.total + correction.amount, DECIMALS)
        tool.changed = True
        tool.applied.append((correction.number, correction.amount))
        actor = f"reading {stream.entry.characteristic} {stream.sequence + 1}"
        correction.status, correction.applied_at, correction.applied_by = "applied", at, actor
        correction.offset_after = tool.offset
        if (named := pending.named_correction(tool.machine_id, correction.number)) is not None:
            pending.named[tool.machine_id, correction.number] = named._replace(applied_at=at)
        pending.offset_changes.append(
            OffsetChange(
                machine_id=tool.machine_id,
                number=tool.number,
                at=at,
                offset_before=before,
                offset_after=tool.offset,
                correction=correction.number,
                actor=actor,
            )
        )
        pending.touched_machines.add(tool.machine_id)
    tool.forget()


def issued_total(pending: PendingWrites, tool: PendingTool | None) -> float:
    """Return the sum of the tool's corrections since it was changed, those not yet applied included, mm."""
    return 0.0 if tool is None else tool.total + sum(_tally(pending, tool, None).issued)


def _tally(pending: PendingWrites, tool: PendingTool, in_effect: int | None) -> EffectTally:
    """Return the tally for parts that name this correction as the last in effect, up to the newest correction."""
    last = None if in_effect is None else pending.named_correction(tool.machine_id, in_effect)
    tally = tool.tallies.get(in_effect)
    # By value: a part of another tool may show meanwhile when the named correction was applied.
    if tally is None or tally.last != last or tally.seen > len(tool.corrections):
        if len(tool.tallies) >= MOST_TALLIES:
            del tool.tallies[next(iter(tool.tallies))]
        tally = tool.tallies[in_effect] = EffectTally(in_effect, last)
    return tally if tally.seen == len(tool.corrections) else _extend(tally, tool, None)


def _extend(tally: EffectTally, tool: PendingTool, machined_at: datetime | None) -> EffectTally:
    """Count the corrections that the tally has not seen."""
    in_effect, last = tally.in_effect, tally.last
    for correction in islice(tool.corrections, tally.seen, None):
        status = correction.status
        had = in_effect is not None and _took_effect(correction, in_effect, last)
        if status == "applied":
            tally.has_applied = True
            at = correction.applied_at
            if tool.reset_at is not None and in_effect is not None and not had and at is not None:
                tally.previous_tool |= at <= tool.reset_at
        elif status in OUTSTANDING:
            tally.issued.append(correction.amount)
            tally.confirms |= had and status == "pending"
        if _not_in_effect(correction, tool, machined_at, had=had if in_effect is not None else None):
            tally.numbers.append(correction.number)
            tally.amounts.append(correction.amount)
            if status == "applied":
                tally.applied_since.append(correction.amount)
    tally.seen = len(tool.corrections)
    return tally


def _took_effect(
    correction: LoadedCorrection | PendingCorrection, in_effect: int, last: NamedCorrection | None
) -> bool:
    """Tell if a machine whose last applied correction was `in_effect` had applied this one too.

    Corrections take effect in the order of their numbers, but one that waited for a person may have been overtaken: by
    those that were applied, or fetched as program text, before it was let go.
    """
    if correction.number == in_effect:
        return True
    if correction.number < in_effect:
        since = (last.fetched_at or last.applied_at) if last is not None else None
        return correction.decided_at is None or since is None or correction.decided_at <= since
    since = correction.fetched_at or correction.applied_at
    if last is None or last.decided_at is None or since is None:
        return False
    return since < last.decided_at


def _not_in_effect(
    correction: LoadedCorrection | PendingCorrection,
    tool: PendingTool,
    machined_at: datetime | None,
    *,
    had: bool | None,
) -> bool:
    """Tell if the part of a reading was cut without that correction, which has been issued since.

    had: by the correction that the reading names, if it names one.
    """
    if correction.status == "awaiting_approval":
        return True
    if correction.status not in OUTSTANDING and correction.status != "applied":
        return False
    applied_at = correction.applied_at
    if applied_at is not None and tool.reset_at is not None and applied_at <= tool.reset_at:
        return False  # it went out with the tool, or was written over by hand
    if had is not None:
        return not had
    if machined_at is not None:
        return applied_at is None or applied_at > machined_at
    return applied_at is None
