"""What the part of a reading was cut with: which corrections, with which tool, and what a reading confirms by naming one.

Every reading of a batch asks it, and a batch may leave as many corrections behind as it has readings. So what was found
for parts that name the same correction is kept with the tool (`ToolState.cuts`), and goes on from there when a correction
is issued; whatever else happens to a correction makes it forgotten.
"""

from collections.abc import Iterator, Sequence
from copy import copy
from datetime import datetime
from itertools import islice
from typing import NamedTuple, overload

from app.core.compensation import DECIMALS
from app.offsets.tables import OUTSTANDING
from app.readings.ground import Cut, Ground, IssuedCorrection, Named, Step, StreamState, ToolState
from app.readings.records import MOST_OUTSTANDING
from app.readings.schemas import ReadingIn

MOST_CUTS = 8  # that a tool keeps; each is as long as its open corrections are many


class Firsts(Sequence[int]):
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


class Circumstance(NamedTuple):
    """What a part was cut with.

    previous_tool: with an offset from before a tool change or an edit by hand. outstanding: numbers of the corrections it
    was cut without, of very many the first; amounts: of all of them, mm of offset, good until the next reading is judged. compensated: the sum (mm) of
    those of this tool's life that it was cut with, None with a previous tool.
    """

    previous_tool: bool
    outstanding: Sequence[int]
    amounts: Sequence[float]
    compensated: float | None


WITHOUT_TOOL = Circumstance(previous_tool=False, outstanding=(), amounts=(), compensated=0.0)


def cut_with(ground: Ground, tool: ToolState | None, reading: ReadingIn) -> Circumstance:
    """What the part of a reading was cut with."""
    if tool is None:
        return WITHOUT_TOOL
    cut = _cut(ground, tool, reading.correction_in_effect)
    if cut.in_effect is None and cut.has_applied and reading.machined_at is not None:
        cut = _extended(Cut(None, None), tool, reading.machined_at)
    previous_tool = cut.previous_tool
    if tool.reset_at is not None and reading.machined_at is not None:
        previous_tool = reading.machined_at < tool.reset_at
    compensated = None
    if not previous_tool:
        compensated = tool.total
        for amount in cut.applied_since:
            compensated -= amount
        compensated = round(compensated, DECIMALS) + 0.0
    return Circumstance(previous_tool, Firsts(cut.numbers) if cut.numbers else (), cut.amounts, compensated)


def confirms(ground: Ground, tool: ToolState | None, in_effect: int | None) -> bool:
    """Whether a reading that names this correction confirms one that is pending."""
    return tool is not None and in_effect is not None and _cut(ground, tool, in_effect).confirms


def confirm(ground: Ground, stream: StreamState, tool: ToolState, in_effect: int, at: datetime) -> None:
    """The machine says it cut with correction `in_effect`: this tool's pending ones up to it are applied."""
    if not confirms(ground, tool, in_effect):
        return
    last = ground.named.get((tool.machine_id, in_effect))
    for correction in tool.corrections:
        if correction.status != "pending" or not _had(correction, in_effect, last):
            continue
        before = tool.offset
        tool.offset = round(before + correction.amount, DECIMALS)
        tool.total = round(tool.total + correction.amount, DECIMALS)
        tool.changed = True
        actor = f"reading {stream.entry.characteristic} {stream.sequence + 1}"
        correction.status, correction.applied_at, correction.applied_by = "applied", at, actor
        correction.offset_after, correction.changed = tool.offset, True
        if (named := ground.named.get((tool.machine_id, correction.number))) is not None:
            named.applied_at = at
        ground.steps.append(Step(tool.machine_id, tool.number, at, before, tool.offset, correction.number, actor))
        ground.touched_machines.add(tool.machine_id)
    tool.forget()


def issued_total(ground: Ground, tool: ToolState | None) -> float:
    """Corrections of the tool since it was changed, those not yet applied included, mm."""
    return 0.0 if tool is None else tool.total + sum(_cut(ground, tool, None).issued)


def _cut(ground: Ground, tool: ToolState, in_effect: int | None) -> Cut:
    """What is known of parts that name this correction as the last one in effect, up to the newest correction."""
    last = None if in_effect is None else ground.named.get((tool.machine_id, in_effect))
    cut = tool.cuts.get(in_effect)
    # By value, and a copy kept: a part of another tool may tell meanwhile when the named correction was applied.
    if cut is None or cut.last != last or cut.seen > len(tool.corrections):
        if len(tool.cuts) >= MOST_CUTS:
            del tool.cuts[next(iter(tool.cuts))]
        cut = tool.cuts[in_effect] = Cut(in_effect, copy(last))
    return cut if cut.seen == len(tool.corrections) else _extended(cut, tool, None)


def _extended(cut: Cut, tool: ToolState, machined_at: datetime | None) -> Cut:
    """Go on with the corrections that it has not seen."""
    in_effect, last = cut.in_effect, cut.last
    for correction in islice(tool.corrections, cut.seen, None):
        status = correction.status
        had = in_effect is not None and _had(correction, in_effect, last)
        if status == "applied":
            cut.has_applied = True
            at = correction.applied_at
            if tool.reset_at is not None and in_effect is not None and not had and at is not None:
                cut.previous_tool |= at <= tool.reset_at
        elif status in OUTSTANDING:
            cut.issued.append(correction.amount)
            cut.confirms |= had and status == "pending"
        if _not_in_effect(correction, tool, machined_at, had=had if in_effect is not None else None):
            cut.numbers.append(correction.number)
            cut.amounts.append(correction.amount)
            if status == "applied":
                cut.applied_since.append(correction.amount)
    cut.seen = len(tool.corrections)
    return cut


def _had(correction: IssuedCorrection, in_effect: int, last: Named | None) -> bool:
    """Whether a machine whose last applied correction was `in_effect` had applied this one too.

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
    correction: IssuedCorrection, tool: ToolState, machined_at: datetime | None, *, had: bool | None
) -> bool:
    """Whether the part of a reading was cut without that correction, which has been issued since.

    had: what the correction says that the reading names, if it names one.
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
