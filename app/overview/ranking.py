"""Which characteristic needs somebody first, and why. Pure.

What is urgent comes before what is wrong in the long run; within that, what is worse by its number comes first. Nothing is
weighed against anything else: the order can be told in words, reason by reason.
"""

from dataclasses import dataclass
from enum import IntEnum
from math import inf

from app.core.state import NEED_SOMEONE, State

CAPABLE = 1.33
"""Ppk from which a process is usually called capable (ISO 22514-2; AIAG SPC asks for 1.33 or more)."""
NEAR = 100
"""Parts: a limit that wear comes to sooner than this is to be planned for now."""
LOUD = 1.0
"""Alarms per shift of one characteristic, from which people begin to acknowledge without looking."""


class Why(IntEnum):
    """What asks for attention, from the most urgent on."""

    STOPPED = 1  # probe fault, paused, tool worn, held
    OUTSIDE = 2  # the last part was out of tolerance, or somebody has to release a correction
    ALARM = 3
    SIGNAL = 4
    NOT_CAPABLE = 5  # Ppk below 1
    WEAR = 6
    HUNTING = 7
    LOUD = 8
    BARELY_CAPABLE = 9  # Ppk below 1.33
    OLD = 10


STOPPED = frozenset({State.PROBE_FAULT, State.PAUSED, State.TOOL_WORN, State.HELD})


@dataclass(frozen=True, slots=True)
class Told:
    """What the ranking is made of. ppk: None of too few readings; parts_left: None while no wear is to be seen.

    alarms: active ones. signals: open ones. per_shift: alarms raised per shift.
    """

    state: State
    alarms: int
    signals: int
    ppk: float | None
    parts_left: float | None
    hunting: bool
    per_shift: float
    old: bool = False

    @property
    def reasons(self) -> tuple[Why, ...]:
        """Why it asks for attention, the most urgent first; empty if it does not.

        >>> Told(State.IN_BAND, 0, 2, 0.9, None, False, 0.0).reasons
        (<Why.SIGNAL: 4>, <Why.NOT_CAPABLE: 5>)
        """
        ppk = inf if self.ppk is None else self.ppk
        told = {
            Why.STOPPED: self.state in STOPPED,
            Why.OUTSIDE: self.state in NEED_SOMEONE - STOPPED,
            Why.ALARM: self.alarms > 0 and self.state not in STOPPED,  # that is what its alarm says
            Why.SIGNAL: self.signals > 0,
            Why.NOT_CAPABLE: ppk < 1.0,
            Why.WEAR: self.parts_left is not None and self.parts_left <= NEAR,
            Why.HUNTING: self.hunting,
            Why.LOUD: self.per_shift > LOUD,
            Why.BARELY_CAPABLE: 1.0 <= ppk < CAPABLE,
            Why.OLD: self.old,
        }
        return tuple(why for why, applies in told.items() if applies)

    @property
    def rank(self) -> tuple[float, ...]:
        """Smaller comes first: by the reasons in their order, then by Ppk and by the alarms per shift.

        >>> calm = Told(State.IN_BAND, 0, 0, 1.7, None, False, 0.0)
        >>> near = Told(State.IN_BAND, 0, 0, 1.9, 40.0, False, 0.0)
        >>> worn = Told(State.TOOL_WORN, 1, 0, 1.9, None, False, 0.3)
        >>> sorted([calm, near, worn], key=lambda told: told.rank) == [worn, near, calm]
        True
        """
        reasons = (*self.reasons, *(len(Why) + 1,) * len(Why))[: len(Why)]
        return (*reasons, inf if self.ppk is None else self.ppk, -self.per_shift)
