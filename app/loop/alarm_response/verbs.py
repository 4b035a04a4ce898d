"""Acts on an alarm: declared once, drawn on its page, at stations and as JSON."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.loop.alarm_response import acknowledging, queries
from app.loop.alarm_response.by_hand import ByHand
from app.loop.alarm_response.queries import AlarmRow
from app.loop.alarm_response.reaction_queries import Handled
from app.loop.alarm_response.schemas import AlarmAcknowledgeIn
from app.web.verb import Act, Outcome, carry_out


@dataclass(frozen=True)
class OfAlarm:
    """An alarm, and who acts on it. action: the one that was chosen on a page."""

    session: Session
    number: int
    caller: Caller
    action: str = ""

    @property
    def values(self) -> Mapping[str, Any]:
        """Its number."""
        return {"number": self.number}


def acknowledge_alarm(on: OfAlarm, given: AlarmAcknowledgeIn) -> AlarmRow:
    """Say what the alarm was; what follows from that follows at once and is in `outcome`.

    - `tool_replaced`: open corrections of the tool are superseded, its averages and its life begin again, with `offset`
    - `keep_cutting`: the held correction is released to the machine
    - `false_reading`: the readings behind the alarm are excluded, and what they asked for is withdrawn
    - `sister_tool`: the characteristics of the tool correct its sister from now on
    - `offset_set`: *offset differs* only: `offset` is true, `changed_by` has changed it; handled as a manual edit
    - `measured_by_hand`: needs `hand_measured`, `hand_verdict` or both; nothing else follows
    - `noted`: nothing else; at *offset differs* the reported offset is true

    What was measured by hand (`hand_measured`, `hand_verdict`) is kept beside the machine's value of the last reading behind
    the alarm, or of `hand_sequence`; that reading is neither excluded nor decided again.

    `cause` and `corrective_action` are entries of the plant's catalogue. The reaction plan of the alarm may ask for them
    (`reaction_plan`): 422 where one is missing.

    After a probe fault the paused characteristic goes on, after *offset differs* the paused tool, whichever it was. Acknowledging twice is 409 and says who was
    first.
    """
    return acknowledging.acknowledge(
        on.session,
        on.number,
        given.action,
        given.comment,
        on.caller,
        offset=given.offset,
        changed_by=given.changed_by,
        hand=ByHand(given.hand_measured, given.hand_verdict, given.hand_sequence),
        handled=Handled(given.cause, given.corrective_action),
    )


def _acknowledged_so(on: OfAlarm) -> bool:
    alarm = queries.alarm(on.session, on.number).alarm
    return alarm.acknowledged_by == on.caller.name and alarm.action == on.action


ACKNOWLEDGE = Act(name="acknowledge", body=AlarmAcknowledgeIn, act=acknowledge_alarm, own=_acknowledged_so)


def acknowledge(session: Session, number: int, form: Mapping[str, str], caller: Caller) -> Outcome:
    """Acknowledge it as typed; `true` is the offset that a person has pointed at. Raises `Invalid`, `NotFound`."""
    if form.get("true") in {"reported", "expected"}:
        offset = queries.alarm(session, number).alarm.data.get(form["true"])
        form = {**form, "offset": "" if offset is None else f"{offset:.9f}"}
    return carry_out(ACKNOWLEDGE, OfAlarm(session, number, caller, form.get("action", "")), form)
