"""The life of a proposed change of parameters: proposed with its evidence, then approved, rejected or withdrawn."""

from datetime import UTC, datetime
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.db.events import publish
from app.errors import Conflict, Invalid, NotAllowed
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.actions import CharacteristicChange, change_characteristic
from app.loop.machines import queries as machines
from app.quality.what_if import proposals
from app.quality.what_if.evidence import evidence_of
from app.quality.what_if.proposals import ProposalRow
from app.quality.what_if.queries import Simulation
from app.quality.what_if.tables import ParameterProposal

SETTINGS = ("weighting_factor", "zero_range", "averaging_limit", "factor")
LONGEST_REASON = 1000


def changes_of(answer: Simulation) -> dict[str, float]:
    """New values of the parameters that a what-if changes against those in force."""
    today = answer.past.current.parameters
    return {
        name: getattr(answer.parameters, name)
        for name in SETTINGS
        if getattr(answer.parameters, name) != getattr(today, name)
    }


def propose(session: Session, answer: Simulation, reason: str, caller: Caller) -> ProposalRow:
    """Propose the settings of a what-if, with what was found kept as evidence.

    Raises `Invalid` where they are today's; `Conflict` where the same is proposed already, or the parameters have changed
    while it was replayed.
    """
    caller.must("operator")
    current = answer.past.current
    changes = changes_of(answer)
    if not changes:
        raise Invalid(
            _("These settings are already in force."),
            _("Choose other settings: k, R33, R34 or the factor."),
        )
    evidence, before = evidence_of(answer), {name: getattr(current.parameters, name) for name in changes}
    machines.lock_machines(session, [current.machine.id])  # of two who propose the same at once one is first
    replayed = current.version.version
    session.expire_all()
    current = characteristics.characteristic_named(session, current.characteristic.key)
    if current.version.version != replayed:
        raise Conflict(
            _("While this was replayed the parameters have changed: version {now} is in force.").format(
                now=current.version.version
            ),
            _("Simulate again with the current settings, and propose the result."),
            parameters_version=current.version.version,
        )
    for row in proposals.proposals(session, characteristic=current.characteristic, status="open"):
        if row.proposal.changes == changes:
            raise Conflict(
                _("{who} has proposed the same already: proposal {number}.").format(
                    who=row.proposal.proposed_by, number=row.proposal.id
                ),
                _("An engineer can approve that one."),
                proposal=row.proposal.id,
            )
    proposal = ParameterProposal(
        machine_id=current.machine.id,
        characteristic_id=current.characteristic.id,
        from_version=current.version.version,
        changes=changes,
        evidence=evidence,
        reason=reason,
        proposed_by=caller.name,
    )
    session.add(proposal)
    session.flush()
    row = proposals.proposal(session, proposal.id)
    _note(session, row, "change proposed", caller, before, dict(changes), reason)
    return row


def approve(session: Session, number: int, reason: str, caller: Caller) -> ProposalRow:
    """Put the change in force as a new version of the parameters; the proposer may do it, too, who is an engineer.

    Raises `NotFound`; `NotAllowed` below an engineer; `Conflict` when it is decided already, or the parameters have changed
    since it was proposed.
    """
    caller.must("engineer")
    row = _open(session, number)
    proposal = row.proposal
    if row.status == "outdated":
        raise Conflict(
            _(
                "Since this was proposed the parameters have changed: version {now} is in force, it was for {then}."
            ).format(now=row.version, then=proposal.from_version),
            _("Simulate again with the current settings, and propose the result. This one can be rejected."),
            parameters_version=row.version,
        )
    why = _("{reason} (proposal {number} of {who}: {proposed})").format(
        reason=reason, number=proposal.id, who=proposal.proposed_by, proposed=proposal.reason
    )
    change = CharacteristicChange(
        parameters=proposal.changes, parameters_version=proposal.from_version, reason=why[:LONGEST_REASON]
    )
    current = change_characteristic(session, row.characteristic.key, change, caller.name)
    return _decide(session, row, "approved", reason, caller, current.version.version)


def reject(session: Session, number: int, reason: str, caller: Caller) -> ProposalRow:
    """Say no, and why. Raises `NotFound`; `NotAllowed` below an engineer; `Conflict` when it is decided already."""
    caller.must("engineer")
    return _decide(session, _open(session, number), "rejected", reason, caller, None)


def withdraw(session: Session, number: int, reason: str, caller: Caller) -> ProposalRow:
    """Take back what one has proposed oneself.

    Raises `NotFound`; `NotAllowed` for anybody else, who may reject it as an engineer; `Conflict` when it is decided already.
    """
    caller.must("operator")
    row = _open(session, number)
    if row.proposal.proposed_by != caller.name:
        raise NotAllowed(
            _("Only {who}, who proposed it, can withdraw it.").format(who=row.proposal.proposed_by),
            _("An engineer can reject it."),
        )
    return _decide(session, row, "withdrawn", reason, caller, None)


def _open(session: Session, number: int) -> ProposalRow:
    """The proposal and its machine, held until the transaction ends."""
    row = proposals.proposal(session, number)
    machines.lock_machines(session, [row.machine.id])
    session.scalars(  # read to the end: until a row is taken, what was loaded before the lock stays as it was
        select(ParameterProposal)
        .where(ParameterProposal.id == number)
        .with_for_update()
        .execution_options(populate_existing=True)
    ).one()
    row = proposals.proposal(session, number)
    if row.proposal.status != "open":
        raise Conflict(
            _("{who} has decided about proposal {number} already: {status}.").format(
                who=row.proposal.decided_by,
                number=number,
                status=_decided(row.proposal.status),
            ),
            _("Nothing was changed. Propose it again if need be."),
            status_of_proposal=row.proposal.status,
        )
    return row


def _decided(status: str) -> str:
    return {"approved": _("approved"), "rejected": _("rejected"), "withdrawn": _("withdrawn")}[status]


def _decide(
    session: Session, row: ProposalRow, status: str, reason: str, caller: Caller, version: int | None
) -> ProposalRow:
    proposal = row.proposal
    proposal.status, proposal.decided_at, proposal.decided_by = status, datetime.now(UTC), caller.name
    proposal.decided_why, proposal.made_version = reason, version
    session.flush()
    after = {"status": status} | ({"parameters_version": version} if version is not None else {})
    _note(session, row, f"proposal {status}", caller, {"status": "open"}, after, reason)
    return proposals.proposal(session, proposal.id)


def _note(
    session: Session,
    row: ProposalRow,
    action: str,
    caller: Caller,
    before: dict[str, Any],
    after: dict[str, Any],
    reason: str,
) -> None:
    key = row.characteristic.key
    record(session, caller.name, action, f"characteristic/{key}", before, after | {"proposal": row.proposal.id}, reason)
    publish(
        session,
        {"kind": "characteristic", "machine": row.machine.key, "characteristic": key},
        {"kind": "proposal", "machine": row.machine.key, "characteristic": key, "id": row.proposal.id},
    )
