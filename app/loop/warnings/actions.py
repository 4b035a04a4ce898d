"""Acknowledging warnings."""

from collections.abc import Sequence

from sqlalchemy.orm import Session

from app.access.audit.actions import record as audit
from app.access.callers import Caller
from app.core.warning import CodedWarning
from app.db.events import publish
from app.errors import Conflict
from app.language.i18n import _
from app.language.times import in_sentence
from app.loop.machines.queries import lock_machines
from app.loop.tables.machines import Machine
from app.loop.warnings import queries
from app.loop.warnings.tables import WarningAcknowledgement


def acknowledge(
    session: Session, machine: Machine, subject: str, warnings: Sequence[CodedWarning], reason: str, caller: Caller
) -> WarningAcknowledgement:
    """Keep that a person takes the result as it is; its program text runs from now on.

    Raises `Conflict` where there is no warning, or someone else was first.
    """
    lock_machines(session, [machine.id])
    if not warnings:
        raise Conflict(
            _("There is no warning to acknowledge."), _("The program text can be used as it is."), warnings=[]
        )
    before = queries.acknowledgement(session, machine.id, subject)
    if before is not None:
        raise Conflict(
            _("The warnings were acknowledged already: {who}, {at}, {reason}").format(
                who=before.actor, at=in_sentence(before.at), reason=before.reason
            ),
            _("The program text can be used as it is."),
            by=before.actor,
        )
    codes = [warning.code for warning in warnings]
    acknowledgement = WarningAcknowledgement(
        machine_id=machine.id, subject=subject, actor=caller.name, reason=reason, codes=codes
    )
    session.add(acknowledgement)
    session.flush()
    session.refresh(acknowledgement)
    audit(session, caller.name, "warnings acknowledged", subject, None, {"warnings": codes}, reason)
    kind = subject.partition("/")[0].replace("-", "_")
    publish(session, {"kind": kind, "machine": machine.key, "id": int(subject.rpartition("/")[2])})
    return acknowledgement
