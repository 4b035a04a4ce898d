"""Confirmations before a run is confirmed or entered, or a kinematics is put back."""

from collections.abc import Mapping
from dataclasses import dataclass

from app.core.rotary.axis import ERRORS
from app.core.rotary.results import OFFSETS
from app.errors import Conflict, NotFound
from app.geometry.rotary_axes import refusals, wording
from app.geometry.rotary_axes.queries import RunRow
from app.geometry.rotary_axes.result_values import UNITS, errors_of, to_enter
from app.geometry.rotary_axes.tables import KinematicsBackup
from app.language.i18n import _
from app.web.fields import Reason
from app.web.validation import checked


@dataclass(frozen=True)
class Question:
    """The second touch, in words."""

    title: str
    button: str
    follows: list[str]
    reasons: list[str]
    offsets: bool = False  # Q147 to Q149 can be entered as well
    when: bool = False  # it may have been done earlier
    seen: int | None = None  # the version that was in effect when it was asked


def about_run(row: RunRow, what: str) -> Question:
    """Asks before it is done. Raises `NotFound` for what cannot be asked; `Conflict` where it cannot be done."""
    number = row.run.id
    if what == "confirm":
        if row.status != "to_confirm":
            raise Conflict(*wording.cannot_confirm(row))
        return Question(
            _("Confirm run {n}?").format(n=number),
            _("Confirm"),
            [wording.sentence(row.run), _("A confirmed run may be entered on the control like any other.")],
            [_("After a collision"), _("New head"), _("Axis was adjusted"), _("Measured twice, the same")],
        )
    if what == "enter":
        if row.status == "to_confirm" or not row.may_be_entered:
            raise Conflict(*wording.cannot_enter(row))
        values = to_enter(row.run.results)
        groups = [*ERRORS.values(), tuple(OFFSETS)]
        follows = [
            ", ".join(f"{name} {wording.entered(name, values[name])}" for name in names if name in values)
            for names in groups
            if any(name in values for name in names)
        ]
        follows.append(_("The kinematics before and after is backed up, so that it can be put back."))
        follows.append(_("Nothing is sent to the control from here: this records that the values were entered there."))
        return Question(
            _("Entered on the control?"),
            _("Record entry"),
            follows,
            [_("Monthly check"), _("Drift"), _("Head changed"), _("After a collision")],
            offsets=bool(errors_of(row.run.results)) and any((row.run.results["offsets"] or {}).values()),
            when=True,
        )
    if what == "undo":
        if row.status != "entered":
            raise Conflict(*refusals.cannot_undo(row))
        return Question(
            _("Undo the entry of run {n}?").format(n=number),
            _("Undo entry"),
            [
                _("The kinematics before it is put back, as a new version; nothing is lost."),
                _("Put it back on the control as well (cycle 450): nothing is sent to it from here."),
            ],
            [_("Worse than before"), _("Entered by mistake"), _("Never entered on the control")],
        )
    raise nothing_here()


def about_backup(old: KinematicsBackup, now: Mapping[str, float], version: int) -> Question:
    """Asks before a kinematics is put back; now, version: what is entered at present with that head."""
    differing = [name for name in UNITS if old.errors.get(name, 0.0) != now.get(name, 0.0)]
    follows = [
        _("{name}: {now} becomes {then}").format(
            name=name,
            now=wording.entered(name, now.get(name, 0.0)),
            then=wording.entered(name, old.errors.get(name, 0.0)),
        )
        for name in differing
    ] or [_("Its values are already in effect.")]
    return Question(
        _("Put back kinematics {n}?").format(n=old.version),
        _("Put back"),
        [
            *follows,
            _("Put it back on the control as well (cycle 450): nothing is sent to it from here."),
            _("This becomes a new version; nothing is lost."),
        ],
        [_("Worse than before"), _("Old head mounted again"), _("Entered by mistake")],
        seen=version,
    )


def reason(text: str) -> str:
    """Reason as people chose or typed it. Raises `Invalid`."""
    return str(checked(Reason, text, "reason"))


def seen(text: str | None) -> int | None:
    """The version that was in effect when it was asked; what is no number was not sent by our page."""
    return int(text) if text and text.isascii() and text.isdigit() and len(text) < 10 else None


def nothing_here() -> NotFound:
    """For addresses that no page is at."""
    return NotFound(_("There is nothing at this address."), _("Go back to the rotary axes."))


def done(what: str, number: int | None) -> str | None:
    """Sentence on the last action."""
    text = {
        "taken": _("Run {n} is stored."),
        "again": _("Run {n} was already stored; nothing was changed."),
        "confirm": _("Run {n} is confirmed: it may be entered on the control."),
        "enter": _("Run {n} is entered. The kinematics before and after is backed up."),
        "undo": _("The entry of run {n} is undone: the previous kinematics is in effect again."),
        "restore": _("The kinematics is put back; it is version {n} now."),
        "plan": _("The limits are saved; they apply from the next run."),
    }.get(what)
    return None if text is None else text.format(n=number or "")
