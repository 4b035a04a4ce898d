"""Manual measurements of the operator at an alarm, stored beside the reading that raised it."""

from typing import Any, Literal, NamedTuple

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.errors import Invalid
from app.language.i18n import _
from app.loop.alarm_response import queries
from app.loop.alarm_response.queries import AlarmRow
from app.loop.readings import queries as reading_queries
from app.loop.readings.by_hand.actions import HandResult, measure


class ByHand(NamedTuple):
    """A size (mm), a verdict, or both; of which reading, if not of the last one behind the alarm."""

    measured: float | None = None
    verdict: Literal["good", "bad"] | None = None
    sequence: int | None = None

    @property
    def is_said(self) -> bool:
        """A number of a reading alone is enough to be looked at, and refused."""
        return any(value is not None for value in self)


def keep(session: Session, row: AlarmRow, found: ByHand, comment: str, caller: Caller) -> list[dict[str, Any]]:
    """Keep it beside the reading; the reading is neither excluded nor decided again. What followed, for the outcome.

    Raises `Invalid` for an alarm that no reading has raised, a reading that is not behind it, or nothing said.
    """
    characteristic, behind = queries.readings_behind(session, row)
    entry = reading_queries.entry_of(session, characteristic) if characteristic else None
    if entry is None or not behind:
        raise Invalid.at(
            "hand_measured",
            _("no reading has raised this alarm, so nothing can be measured by hand for it; leave it out"),
            do=_("Leave it out."),
        )
    sequence = behind[-1] if found.sequence is None else found.sequence
    if sequence not in behind:
        raise Invalid.at(
            "hand_sequence",
            _("reading {sequence} is not behind this alarm; its last one is {last}").format(
                sequence=sequence, last=behind[-1]
            ),
            do=_("Name one of its readings."),
        )
    good = None if found.verdict is None else found.verdict == "good"
    measurement = measure(
        session,
        entry,
        sequence,
        HandResult(found.measured, good, comment),
        caller.name,
        alarm=row.alarm.id,
        fields=("hand_measured", "hand_verdict"),
    )
    return [
        {
            "code": "measured_by_hand",
            "characteristic": entry.characteristic,
            "sequence": sequence,
            "measured": measurement.measured,
            "good": measurement.good,
        }
    ]
