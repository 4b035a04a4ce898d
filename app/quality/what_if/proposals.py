"""Proposals of parameter changes as they are. Never writes."""

from typing import Any, NamedTuple

from sqlalchemy import Select, case, func, select
from sqlalchemy.orm import Session

from app.db.text import holds_words
from app.errors import NotFound
from app.language.i18n import _
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.quality.what_if.tables import ParameterProposal

STATUSES = ("open", "outdated", "approved", "rejected", "withdrawn")


class ProposalRow(NamedTuple):
    """A proposal, where it belongs, the version in force now, and its status: an open one of an older version is outdated."""

    proposal: ParameterProposal
    characteristic: Characteristic
    machine: Machine
    version: int
    status: str


_status = case(
    (
        (ParameterProposal.status == "open") & (ParameterProposal.from_version != Stream.parameters_version),
        "outdated",
    ),
    else_=ParameterProposal.status,
)
_ROWS: Select[Any] = (
    select(ParameterProposal, Characteristic, Machine, Stream.parameters_version, _status)
    .join(
        Characteristic,
        (Characteristic.machine_id == ParameterProposal.machine_id)
        & (Characteristic.id == ParameterProposal.characteristic_id),
    )
    .join(Machine, Machine.id == ParameterProposal.machine_id)
    .join(
        Stream,
        (Stream.machine_id == ParameterProposal.machine_id)
        & (Stream.characteristic_id == ParameterProposal.characteristic_id),
    )
)


def proposals(
    session: Session,
    *,
    characteristic: Characteristic | None = None,
    machine_id: int | None = None,
    status: str | None = None,
    holding: str = "",
    before: int | None = None,
    limit: int = 100,
) -> list[ProposalRow]:
    """Newest first: of one characteristic, of one machine, of all; with one status or any.

    holding: those in whose names, reason or author these words are found.
    """
    names = (
        Characteristic.name,
        Characteristic.key,
        Machine.name,
        ParameterProposal.reason,
        ParameterProposal.proposed_by,
    )
    query = _ROWS.where(*holds_words(holding, *names)).order_by(ParameterProposal.id.desc()).limit(limit)
    if characteristic is not None:
        query = query.where(
            ParameterProposal.machine_id == characteristic.machine_id,
            ParameterProposal.characteristic_id == characteristic.id,
        )
    if machine_id is not None:
        query = query.where(ParameterProposal.machine_id == machine_id)
    if status is not None:
        query = query.where(_status == status)
    if before is not None:
        query = query.where(ParameterProposal.id < before)
    return [ProposalRow(*row) for row in session.execute(query)]


def count_open(session: Session) -> int:
    """Number of proposals that wait for an engineer."""
    waiting = _ROWS.with_only_columns(func.count(), maintain_column_froms=True).where(_status == "open")
    return session.scalar(waiting) or 0


def proposal(session: Session, number: int) -> ProposalRow:
    """One of them. Raises `NotFound`."""
    row = session.execute(_ROWS.where(ParameterProposal.id == number)).one_or_none()
    if row is None:
        raise NotFound(
            _("There is no proposal {number}.").format(number=number),
            _("GET /api/v1/proposals lists them."),
        )
    return ProposalRow(*row)
