"""Decisions about a correction as people type them, on whatever page they are asked."""

from collections.abc import Mapping
from typing import Literal

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.errors import Conflict
from app.loop.tables.machines import Machine
from app.loop.tools import actions, applying, confirmation, queries
from app.loop.tools.schemas import AppliedIn, CorrectionDecisionIn
from app.web.forms import length, parsed, words

Outcome = Literal["done", "late", "fetched"]


def decide_as_typed(
    session: Session, machine: Machine, number: int, form: Mapping[str, str], caller: Caller
) -> Outcome:
    """Approve, release or reject a correction, or mark it applied, as `do` of the form says.

    `late`: somebody else had decided already, and nothing was done; sent twice by one person it is `done`. `fetched`: its text
    was fetched while this was asked, so it is to be asked again with the warning. Raises `NotFound`, `Invalid`.
    """
    verb, correction = form.get("do", ""), queries.correction(session, machine, number)
    try:
        if verb == "applied":
            applied = parsed(AppliedIn, {"offset_after": length(form.get("offset_after"))})
            applying.mark_applied(session, machine, number, caller, offset_after=applied.offset_after)
        else:
            decision = parsed(CorrectionDecisionIn, {"reason": words(form, "reason")})
            warned = form.get("although_fetched") == "true"
            actions.decide(
                session, machine, number, confirmation.verb(verb), decision.reason, caller, although_fetched=warned
            )
    except Conflict as error:
        session.refresh(correction)
        if "fetched_at" in error.more:
            return "fetched"
        sent_twice = correction.decided_by == caller.name and correction.status == actions.INTO.get(verb)
        return "done" if sent_twice else "late"
    return "done"
