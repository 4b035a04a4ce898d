"""In which state a characteristic is, found by its data alone. Pure."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum

from app.core.decision.limits import beyond_natural, nanometres, reaches, within_tolerance
from app.core.natural_limit import NaturalLimit
from app.core.parameters import Parameters

DRIFT = 7  # readings in a row on one side, beyond the zero range, are a drift
QUIET = timedelta(minutes=15)  # nobody expects a reading sooner
MISSED = 10  # usual intervals without a reading, after which what is known is old


class CharacteristicState(StrEnum):
    """From the most urgent to the calmest; the first that applies is shown."""

    PROBE_FAULT = "probe_fault"
    PAUSED = "paused"
    TOOL_WORN = "tool_worn"
    HELD = "held"
    OVERSIZE = "oversize"
    UNDERSIZE = "undersize"
    NO_DATA = "no_data"
    AWAITING_APPROVAL = "awaiting_approval"
    CORRECTING = "correcting"
    DRIFTING_UP = "drifting_up"
    DRIFTING_DOWN = "drifting_down"
    MEASURE_ONLY = "measure_only"
    IN_BAND = "in_band"


NEED_SOMEONE = frozenset(
    {
        CharacteristicState.PROBE_FAULT,
        CharacteristicState.PAUSED,
        CharacteristicState.TOOL_WORN,
        CharacteristicState.HELD,
        CharacteristicState.OVERSIZE,
        CharacteristicState.UNDERSIZE,
        CharacteristicState.AWAITING_APPROVAL,
    }
)
# What is only worth something while it is new: an old one of these is shown as old.
CALM = frozenset(
    {
        CharacteristicState.CORRECTING,
        CharacteristicState.DRIFTING_UP,
        CharacteristicState.DRIFTING_DOWN,
        CharacteristicState.MEASURE_ONLY,
        CharacteristicState.IN_BAND,
    }
)


@dataclass(frozen=True)
class Known:
    """Facts that the state is derived from.

    paused: by a probe fault; tool_paused: it is not known which offset its tool has.
    alarms: kinds of the active ones. corrections: statuses of the open ones. trend: the last deviations, oldest first, mm;
    since: when the first of them arrived. excluded: the last reading was taken out of the statistics.
    """

    parameters: Parameters
    readings: int
    zone: str | None
    deviation: float | None
    paused: bool
    alarms: Collection[str]
    corrections: Collection[str]
    trend: Sequence[float]
    since: datetime | None
    last_at: datetime | None
    tool_paused: bool = False
    excluded: bool = False

    @property
    def tells_of_the_part(self) -> bool:
        """Tell if the last reading is a size of the last part: neither declared false nor beyond R36 or a natural limit."""
        if self.excluded or self.deviation is None:
            return False
        size, rules = nanometres(self.deviation), self.parameters.rules
        return not reaches(size, rules.confidence) and not beyond_natural(size, rules.natural, rules.zero_range)

    @property
    def old_from(self) -> datetime | None:
        """From this moment on, what is known of the process is old; None while nothing is known."""
        if self.last_at is None:
            return None
        usual = timedelta(0)
        if self.since is not None and len(self.trend) > 1:
            usual = (self.last_at - self.since) / (len(self.trend) - 1)
        return self.last_at + max(QUIET, MISSED * usual)


def state_of(known: Known) -> CharacteristicState:
    """The most urgent thing that can be said."""
    if known.paused or "probe_fault" in known.alarms:
        return CharacteristicState.PROBE_FAULT
    if known.tool_paused:
        return CharacteristicState.PAUSED
    if "tool_worn" in known.alarms:
        return CharacteristicState.TOOL_WORN
    if "held" in known.corrections:
        return CharacteristicState.HELD
    if known.readings == 0 or known.deviation is None:
        return CharacteristicState.NO_DATA
    # The part itself: a reading that counts outstanding corrections may be decided in a milder zone.
    if known.tells_of_the_part and not within_tolerance(known.deviation, known.parameters.limits):
        return CharacteristicState.OVERSIZE if known.deviation > 0 else CharacteristicState.UNDERSIZE
    if "awaiting_approval" in known.corrections:
        return CharacteristicState.AWAITING_APPROVAL
    if "pending" in known.corrections:
        return CharacteristicState.CORRECTING
    trend = known.trend if known.tells_of_the_part else known.trend[:-1]
    return drift(trend, known.parameters) or (
        CharacteristicState.MEASURE_ONLY if known.parameters.measures_only else CharacteristicState.IN_BAND
    )


def drift(trend: Sequence[float], parameters: Parameters) -> CharacteristicState | None:
    """The drift state when the last readings all lie on one side beyond the zero range, else None.

    From a natural limit all readings lie on one side whatever the process does: there it takes the averaging limit.
    """
    last = [nanometres(deviation) for deviation in trend[-DRIFT:]]
    natural = parameters.natural_limit is not NaturalLimit.NONE
    beyond = parameters.limits.averaging if natural else parameters.limits.zero_range
    if len(last) == DRIFT and min(last) > beyond:
        return CharacteristicState.DRIFTING_UP
    if len(last) == DRIFT and max(last) < -beyond:
        return CharacteristicState.DRIFTING_DOWN
    return None
