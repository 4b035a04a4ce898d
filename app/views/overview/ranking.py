"""Ranking of the characteristics by need for attention, with reasons. Pure.

What is urgent comes before what is wrong in the long run; within that, what is worse by its number comes first. Nothing is
weighed against anything else: the order can be explained, reason by reason.
"""

from dataclasses import dataclass
from enum import IntEnum
from math import inf

from app.core.spc.capability import CAPABLE
from app.core.state import NEED_SOMEONE, CharacteristicState

NEAR = 100
"""Parts: a limit that wear comes to sooner than this is to be planned for now."""
ALARM_FLOOD = 1.0
"""Alarms per shift of one characteristic, from which people begin to acknowledge without looking."""


class AttentionReason(IntEnum):
    """Reasons for attention, from the most urgent on."""

    STOPPED = 1  # probe fault, paused, tool worn, held
    OUTSIDE = 2  # the last part was out of tolerance
    ALARM = 3
    APPROVAL = 4  # a person has to release a correction
    NOT_EVALUATED = 5  # background work on it fails: what follows may be missing
    SIGNAL = 6
    NOT_CAPABLE = 7  # index below 1
    WEAR = 8
    HUNTING = 9
    ALARM_FLOOD = 10
    BARELY_CAPABLE = 11  # index below 1.33
    OLD = 12

    @property
    def code(self) -> str:
        """Code of the reason in the API."""
        return "loud" if self is AttentionReason.ALARM_FLOOD else self.name.lower()


STOPPED = frozenset(
    {
        CharacteristicState.PROBE_FAULT,
        CharacteristicState.PAUSED,
        CharacteristicState.TOOL_WORN,
        CharacteristicState.HELD,
    }
)
OUTSIDE = frozenset({CharacteristicState.OVERSIZE, CharacteristicState.UNDERSIZE})


@dataclass(frozen=True, slots=True)
class AttentionInputs:
    """Inputs of the ranking. ppk: Cpk or Ppk, None where none may be quoted; parts_left: None while no wear is to be seen.

    alarms: active ones. signals: open ones. per_shift: alarms raised per shift.
    failing: a periodic job fails on it.
    """

    state: CharacteristicState
    alarms: int
    signals: int
    ppk: float | None
    parts_left: float | None
    hunting: bool
    per_shift: float
    old: bool = False
    failing: bool = False

    @property
    def reasons(self) -> tuple[AttentionReason, ...]:
        """Reasons why it needs attention, the most urgent first; empty if it does not.

        >>> AttentionInputs(CharacteristicState.IN_BAND, 0, 2, 0.9, None, False, 0.0).reasons
        (<AttentionReason.SIGNAL: 6>, <AttentionReason.NOT_CAPABLE: 7>)
        """
        ppk = inf if self.ppk is None else self.ppk
        holds = {
            AttentionReason.STOPPED: self.state in STOPPED,
            AttentionReason.OUTSIDE: self.state in OUTSIDE,
            AttentionReason.ALARM: self.alarms > 0 and self.state not in STOPPED,  # else that is its alarm
            AttentionReason.APPROVAL: self.state in NEED_SOMEONE - STOPPED - OUTSIDE,
            AttentionReason.NOT_EVALUATED: self.failing,
            AttentionReason.SIGNAL: self.signals > 0,
            AttentionReason.NOT_CAPABLE: ppk < 1.0,
            AttentionReason.WEAR: self.parts_left is not None and self.parts_left <= NEAR,
            AttentionReason.HUNTING: self.hunting,
            AttentionReason.ALARM_FLOOD: self.per_shift > ALARM_FLOOD,
            AttentionReason.BARELY_CAPABLE: 1.0 <= ppk < CAPABLE,
            AttentionReason.OLD: self.old,
        }
        return tuple(reason for reason, true in holds.items() if true)

    @property
    def rank(self) -> tuple[float, ...]:
        """Smaller comes first: by the reasons in their order, then by Ppk and by the alarms per shift.

        >>> calm = AttentionInputs(CharacteristicState.IN_BAND, 0, 0, 1.7, None, False, 0.0)
        >>> near = AttentionInputs(CharacteristicState.IN_BAND, 0, 0, 1.9, 40.0, False, 0.0)
        >>> worn = AttentionInputs(CharacteristicState.TOOL_WORN, 1, 0, 1.9, None, False, 0.3)
        >>> waiting = AttentionInputs(CharacteristicState.AWAITING_APPROVAL, 0, 0, 0.4, None, False, 0.0)
        >>> alarmed = AttentionInputs(CharacteristicState.IN_BAND, 1, 0, 1.9, None, False, 0.0)
        >>> ranked = [worn, alarmed, waiting, near, calm]
        >>> sorted([calm, near, waiting, alarmed, worn], key=lambda each: each.rank) == ranked
        True
        """
        reasons = (*self.reasons, *(len(AttentionReason) + 1,) * len(AttentionReason))[: len(AttentionReason)]
        return (*reasons, inf if self.ppk is None else self.ppk, -self.per_shift)
