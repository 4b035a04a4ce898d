"""Acknowledgements of warnings, and the limits of what is plausible on a machine, read. Never writes."""

from collections.abc import Iterable

from sqlalchemy.orm import Session

from app.core.geometry.plausible import Bounds
from app.core.warning import CodedWarning
from app.loop.tables.machines import Machine
from app.loop.warnings.tables import WarningAcknowledgement


def bounds_of(machine: Machine) -> Bounds:
    """The largest set-up error of a part that is plausible on this machine."""
    return Bounds(machine.plausible_turn, machine.plausible_shift)


def acknowledgement(session: Session, machine_id: int, subject: str) -> WarningAcknowledgement | None:
    """The acknowledgement of the warnings of this result, if there is one."""
    return session.get(WarningAcknowledgement, (machine_id, subject))


def unacknowledged(session: Session, machine_id: int, subject: str, warnings: Iterable[CodedWarning]) -> list[str]:
    """The codes of the warnings that stop a program text; none once a person has acknowledged them."""
    return [] if acknowledgement(session, machine_id, subject) else [warning.code for warning in warnings]
