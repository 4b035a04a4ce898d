"""Corrections as program text for controls without a network: what the text holds, who fetched it, and that it is in.

A text that was fetched may be run at any time. Its corrections stay pending until a person confirms them or a reading names
one as in effect; those that are fetched together with later ones keep their place in front of them. Lengths are mm.
"""

from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from typing import NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.callers import Caller
from app.core.parameters import Axis
from app.core.programs.correction_forms import FORMS, Form
from app.core.programs.corrections import (
    LAST_REGISTER,
    MOST_STEPS,
    OffsetStep,
    PendingCorrection,
    steps,
    write,
)
from app.db.events import publish
from app.errors import Conflict, Invalid
from app.language.i18n import _
from app.loop.characteristics.correction_queries import correction_changed
from app.loop.machines.queries import lock_machines
from app.loop.tables.characteristics import ParametersVersion
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.loop.tables.tools import Correction, Tool
from app.loop.tools import queries, wording
from app.loop.tools.applying import mark_applied

AT_LARGE_FOR = timedelta(days=30)  # how long people are reminded of a text whose correction fell


class Handed(NamedTuple):
    """A text, the corrections in it in the order of the text, and the form and check sum by which it is known again."""

    text: str
    form: Form
    check: str
    chain: list[OffsetStep]
    corrections: list[Correction]

    @property
    def numbers(self) -> list[int]:
        return [correction.number for correction in self.corrections]


class Fetched(NamedTuple):
    """A correction that was marked. before: a person had fetched it earlier, and that is what stands."""

    correction: Correction
    before: bool


class Confirmed(NamedTuple):
    """Result of confirming several: numbers confirmed now, those already in effect, and those that must not be applied."""

    now: list[int]
    already: list[int]
    refused: list[Correction]


# --- looking


def form_for(machine: Machine, form: str | None) -> Form:
    """The form that was asked for, else the usual one of the machine's control. Raises `Invalid`."""
    forms = FORMS[machine.control]
    if form is None:
        return forms[0]
    if form not in forms:
        raise Invalid.at(
            "form",
            _("must be one of {forms} for the control of {machine}").format(
                forms=", ".join(forms), machine=machine.key
            ),
        )
    return Form(form)


def pending_text(session: Session, machine: Machine, form: str | None = None) -> Handed:
    """The pending corrections as text: those fetched before in their order, then the others, oldest first.

    Raises `Invalid` for a form that this control does not know; `Conflict` where one location is corrected in two axes.
    """
    wanted_form = form_for(machine, form)
    pending = session.scalars(
        select(Correction)
        .where(Correction.machine_id == machine.id, Correction.status == "pending")
        .order_by(Correction.fetched_at.nulls_last(), Correction.number)
        .limit(MOST_STEPS)
        .execution_options(populate_existing=True)
    ).all()
    axes = _axes(session, machine, pending)
    _one_axis_each(machine, pending, axes)
    offsets = {
        row.number: row.offset
        for row in session.execute(select(Tool.number, Tool.offset).where(Tool.machine_id == machine.id))
    }
    chain = steps(
        [PendingCorrection(c.number, c.tool_memory, c.amount, axes[c.characteristic_id]) for c in pending],
        offsets,
        *_applied(session, machine),
    )
    _has_register(wanted_form, chain)
    text = write(wanted_form, machine.key, chain)
    return Handed(text, wanted_form, sha256(text.encode()).hexdigest()[:12], chain, list(pending))


def _has_register(form: Form, chain: Sequence[OffsetStep]) -> None:
    """Beyond its last register a variable of the control belongs to another axis. Raises `Invalid`."""
    last = LAST_REGISTER.get(form)
    beyond = [step.tool for step in chain if last is not None and step.tool > last]
    if beyond:
        raise Invalid.at(
            "form",
            _("has registers for tools 1 to {last} only, and tool {tool} is corrected").format(
                last=last, tool=beyond[0]
            ),
            do=_("Take G10 or the list in place of it."),
        )


def _axes(session: Session, machine: Machine, corrections: Sequence[Correction]) -> dict[int, Axis]:
    axes = session.execute(
        select(Stream.characteristic_id, ParametersVersion.parameters["axis"].as_string())
        .join(
            ParametersVersion,
            (ParametersVersion.machine_id == Stream.machine_id)
            & (ParametersVersion.characteristic_id == Stream.characteristic_id)
            & (ParametersVersion.version == Stream.parameters_version),
        )
        .where(
            Stream.machine_id == machine.id,
            Stream.characteristic_id.in_({c.characteristic_id for c in corrections}),
        )
    )
    return {characteristic: Axis(axis) for characteristic, axis in axes}


def _one_axis_each(machine: Machine, corrections: Sequence[Correction], axes: dict[int, Axis]) -> None:
    by_tool: dict[int, set[Axis]] = {}
    for correction in corrections:
        by_tool.setdefault(correction.tool_memory, set()).add(axes[correction.characteristic_id])
    for tool, both in by_tool.items():
        if len(both) > 1:
            raise Conflict(
                _("Tool {tool} of {machine} is corrected in {axes}, but one location R10 holds one offset.").format(
                    tool=tool, machine=machine.key, axes=" + ".join(sorted(both))
                ),
                _("Give one of the characteristics another location R10, then decide about what is pending."),
            )


def _applied(session: Session, machine: Machine) -> tuple[int, int]:
    """Of the corrections in effect: the highest number, and the one applied last."""
    applied = select(Correction.number).where(Correction.machine_id == machine.id, Correction.status == "applied")
    highest = session.scalar(applied.order_by(Correction.number.desc()).limit(1)) or 0
    newest_each = (
        select(Correction.number, Correction.applied_at)
        .where(
            Correction.machine_id == machine.id,
            Correction.tool_memory == Tool.number,
            Correction.status == "applied",
        )
        .order_by(Correction.applied_at.desc(), Correction.number.desc())
        .limit(1)
        .lateral()
    )
    last = session.scalar(
        select(newest_each.c.number)
        .select_from(Tool)
        .join(newest_each, Tool.machine_id == machine.id)
        .order_by(newest_each.c.applied_at.desc(), newest_each.c.number.desc())
        .limit(1)
    )
    return highest, last or 0


def at_large(session: Session, machine: Machine) -> Sequence[Correction]:
    """Corrections that fell after they were fetched: their texts are out in the world and must not be run. Newest first."""
    return session.scalars(
        select(Correction)
        .where(
            Correction.machine_id == machine.id,
            Correction.status.in_(("rejected", "superseded")),
            Correction.fetched_at > datetime.now(UTC) - AT_LARGE_FOR,
        )
        .order_by(Correction.number.desc())
        .limit(20)
    ).all()


# --- doing


def mark_fetched(
    session: Session, machine: Machine, numbers: Sequence[int], form: str | None, caller: Caller
) -> list[Fetched]:
    """These corrections were fetched as text. Marking twice is harmless: who fetched first stands.

    All of them or none. Raises `NotFound`; `Conflict` for one that is not pending any more; `Invalid` for the form.
    """
    lock_machines(session, [machine.id])
    handed = pending_text(session, machine, form)
    corrections = [queries.correction(session, machine, number) for number in sorted(set(numbers))]
    for correction in corrections:
        if correction.status != "pending":
            detail, instead = wording.refused(correction, machine.key, "applied")
            raise Conflict(detail, instead, correction_status=correction.status)
    now = datetime.now(UTC)
    marked = [Fetched(correction, correction.fetched_at is not None) for correction in corrections]
    fresh = [fetched.correction for fetched in marked if not fetched.before]
    for correction in fresh:
        correction.fetched_at, correction.fetched_by = now, caller.name
        correction.fetched_as = f"{handed.form.value} {handed.check}"
    if fresh:
        after = {"corrections": [correction.number for correction in fresh], "as": fresh[0].fetched_as}
        record(session, caller.name, "corrections fetched as text", f"machine/{machine.key}", None, after)
        publish(session, *(correction_changed(session, machine, correction) for correction in fresh))
    return marked


def confirm_all(session: Session, machine: Machine, numbers: Sequence[int], caller: Caller) -> Confirmed:
    """These corrections are in the control. Those that are applied already stay as they are; those that fell are named.

    Raises `NotFound`, and then nothing was confirmed.
    """
    lock_machines(session, [machine.id])
    done = Confirmed([], [], [])
    corrections = [queries.correction(session, machine, number) for number in dict.fromkeys(numbers)]
    for correction in sorted(corrections, key=_place):
        if correction.status == "applied":
            done.already.append(correction.number)
        elif correction.status == "pending":
            mark_applied(session, machine, correction.number, caller)
            done.now.append(correction.number)
        else:
            done.refused.append(correction)
    return done


def _place(correction: Correction) -> tuple[bool, datetime, int]:
    """The order in which a text applies them."""
    return correction.fetched_at is None, correction.fetched_at or correction.created_at, correction.number


def must_not_be_in(correction: Correction, machine: Machine) -> str:
    """Said of one that was to be confirmed and may not be in."""
    return " ".join(wording.refused(correction, machine.key, "applied"))
