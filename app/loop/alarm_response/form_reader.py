"""The form of the second touch at an alarm, read and carried out."""

from collections.abc import Mapping

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.loop.alarm_response import acknowledging, queries
from app.loop.alarm_response.by_hand import ByHand
from app.loop.alarm_response.schemas import AlarmAcknowledgeIn
from app.web.forms import length, parsed, words


def acknowledge_as_typed(session: Session, number: int, form: Mapping[str, str], caller: Caller) -> None:
    """Acknowledge an alarm as the person has said it. Raises what `acknowledge` raises, and `Invalid` for the form."""
    offset = length(form.get("offset"))
    if form.get("true") in {"reported", "expected"}:
        offset = queries.alarm(session, number).alarm.data.get(form["true"])
    said = parsed(
        AlarmAcknowledgeIn,
        {
            "action": form.get("action"),
            "comment": words(form, "comment"),
            "offset": offset,
            "changed_by": form.get("changed_by"),
            "hand_measured": length(form.get("hand_measured")),
            "hand_verdict": form.get("hand_verdict"),
        },
    )
    acknowledging.acknowledge(
        session,
        number,
        said.action,
        said.comment,
        caller,
        offset=said.offset,
        changed_by=said.changed_by,
        hand=ByHand(said.hand_measured, said.hand_verdict),
    )
