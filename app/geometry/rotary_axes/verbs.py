"""Acts on a run and on a kinematics that was in effect: each is asked first on its page."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.core.rotary.axis import ERRORS
from app.core.rotary.results import OFFSETS
from app.errors import Conflict
from app.geometry.rotary_axes import actions, queries, refusals, wording
from app.geometry.rotary_axes.queries import RunRow
from app.geometry.rotary_axes.result_values import UNITS, to_enter
from app.geometry.rotary_axes.schemas import EnterIn, RestoreIn
from app.geometry.rotary_axes.tables import KinematicsBackup
from app.language.i18n import _
from app.loop.tables.machines import Machine
from app.web.fields import ReasonIn
from app.web.verb import Verb, said


@dataclass(frozen=True)
class OfRun:
    """A run, and who acts on it."""

    session: Session
    number: int
    caller: Caller

    @property
    def row(self) -> RunRow:
        """It as it is now. Raises `NotFound`."""
        return queries.run(self.session, self.number)

    @property
    def values(self) -> Mapping[str, Any]:
        """Its number."""
        return {"number": self.number}


@dataclass(frozen=True)
class OfBackup:
    """A kinematics of a machine that was in effect, by its version, and who puts it back."""

    session: Session
    machine: Machine
    number: int
    caller: Caller

    @property
    def values(self) -> Mapping[str, Any]:
        """Its version."""
        return {"number": self.number}


def _confirming(on: OfRun) -> list[str]:
    row = on.row
    if row.status != "to_confirm":
        raise Conflict(*wording.cannot_confirm(row))
    return [wording.sentence(row.run), _("A confirmed run may be entered on the control like any other.")]


def _entering(on: OfRun) -> list[str]:
    row = on.row
    if row.status == "to_confirm" or not row.may_be_entered:
        raise Conflict(*wording.cannot_enter(row))
    values = to_enter(row.run.results)
    lines = [[name for name in names if name in values] for names in (*ERRORS.values(), tuple(OFFSETS))]
    return [
        *(", ".join(f"{name} {wording.entered(name, values[name])}" for name in names) for names in lines if names),
        _("The kinematics before and after is backed up, so that it can be put back."),
        _("Nothing is sent to the control from here: this records that the values were entered there."),
    ]


def _undoing(on: OfRun) -> list[str]:
    if on.row.status != "entered":
        raise Conflict(*refusals.cannot_undo(on.row))
    return [
        _("The kinematics before it is put back, as a new version; nothing is lost."),
        _("Put it back on the control as well (cycle 450): nothing is sent to it from here."),
    ]


RUN: tuple[Verb[OfRun, Any], ...] = (
    Verb(
        name="confirm",
        body=ReasonIn,
        act=lambda on, why: actions.confirm(on.session, on.number, why.reason, on.caller),
        word=lambda: _("Confirm"),
        title=lambda _on: _("Confirm run {number}?"),
        follows=_confirming,
        reasons=lambda: [_("After a collision"), _("New head"), _("Axis was adjusted"), _("Measured twice, the same")],
        said=lambda: _("Run {n} is confirmed: it may be entered on the control."),
    ),
    Verb(
        name="enter",
        body=EnterIn,
        act=lambda on, entry: actions.enter(
            on.session, on.number, entry.reason, on.caller, offsets=entry.offsets, at=entry.at
        ),
        word=lambda: _("Record entry"),
        title=lambda _on: _("Entered on the control?"),
        follows=_entering,
        reasons=lambda: [_("Monthly check"), _("Drift"), _("Head changed"), _("After a collision")],
        said=lambda: _("Run {n} is entered. The kinematics before and after is backed up."),
    ),
    Verb(
        name="undo",
        body=ReasonIn,
        act=lambda on, why: actions.undo(on.session, on.number, why.reason, on.caller),
        role="engineer",
        word=lambda: _("Undo entry"),
        title=lambda _on: _("Undo the entry of run {number}?"),
        follows=_undoing,
        reasons=lambda: [_("Worse than before"), _("Entered by mistake"), _("Never entered on the control")],
        said=lambda: _("The entry of run {n} is undone: the previous kinematics is in effect again."),
    ),
)


def _restore(on: OfBackup, sent: RestoreIn) -> KinematicsBackup:
    seen = sent.instead_of
    return actions.restore(on.session, on.machine, on.number, sent.reason, on.caller, instead_of=seen)


def _restoring(on: OfBackup) -> list[str]:
    old = queries.backup(on.session, on.machine, on.number)
    now = queries.in_effect(on.session, on.machine.id, old.head)
    words = _("{name}: {now} becomes {then}")
    changes = [(name, now.get(name, 0.0), old.errors.get(name, 0.0)) for name in UNITS]
    becomes = [
        words.format(name=name, now=wording.entered(name, before), then=wording.entered(name, then))
        for name, before, then in changes
        if before != then
    ]
    return [
        *(becomes or [_("Its values are already in effect.")]),
        _("Put it back on the control as well (cycle 450): nothing is sent to it from here."),
        _("This becomes a new version; nothing is lost."),
    ]


def _version_now(on: OfBackup) -> dict[str, str]:
    """The version in effect, so that another one is not replaced unseen."""
    old = queries.backup(on.session, on.machine, on.number)
    return {"instead_of": str(queries.version_of(on.session, on.machine.id, old.head))}


RESTORE: Verb[OfBackup, RestoreIn] = Verb(
    name="restore",
    body=RestoreIn,
    act=_restore,
    role="engineer",
    word=lambda: _("Put back"),
    title=lambda _on: _("Put back kinematics {number}?"),
    follows=_restoring,
    reasons=lambda: [_("Worse than before"), _("Old head mounted again"), _("Entered by mistake")],
    hidden=_version_now,
    said=lambda: _("The kinematics is put back; it is version {n} now."),
)


def done(code: str, number: int | None) -> str | None:
    """The page's message after an act, or after something was sent; None for an unknown one."""
    sent = {
        "taken": _("Run {n} is stored."),
        "again": _("Run {n} was already stored; nothing was changed."),
        "plan": _("The limits are saved; they apply from the next run."),
    }
    return said((*RUN, RESTORE), code, number, sent)
