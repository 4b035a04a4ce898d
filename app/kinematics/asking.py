"""What the pages ask before a run is confirmed or entered, or a kinematics is put back."""

from dataclasses import dataclass

from app.core.kinematics.axis import ERRORS
from app.errors import Conflict, NotFound
from app.kinematics import wording
from app.kinematics.queries import RunRow
from app.kinematics.tables import KinematicsBackup
from app.kinematics.values import errors_of
from app.web.fields import Reason
from app.web.i18n import _
from app.web.validation import checked


@dataclass(frozen=True)
class Question:
    """The second touch, in words."""

    title: str
    button: str
    follows: list[str]
    reasons: list[str]


def about_run(row: RunRow, what: str) -> Question:
    """Asks before it is done. Raises `NotFound` for what cannot be asked; `Conflict` where it cannot be done."""
    number = row.run.id
    if what == "confirm":
        if row.status != "to_confirm":
            raise Conflict(*wording.cannot_confirm(row))
        return Question(
            _("Confirm run {n}?").format(n=number),
            _("Confirm"),
            [wording.sentence(row.run), _("Confirmed, it may be entered on the control like any other.")],
            [_("After a collision"), _("New head"), _("Axis was adjusted"), _("Measured twice, the same")],
        )
    if what == "enter":
        if row.status == "to_confirm" or not row.may_be_entered:
            raise Conflict(*wording.cannot_enter(row))
        values = errors_of(row.run.results)
        follows = [
            "{}: {}".format(axis, ", ".join(f"{n} {wording.written(n, values[n])}" for n in names if n in values))
            for axis, names in ERRORS.items()
            if any(n in values for n in names)
        ]
        follows.append(_("The kinematics before and after is backed up, so that it can be put back."))
        return Question(
            _("Entered on the control?"),
            _("It is entered"),
            follows,
            [_("Monthly check"), _("Drift"), _("Head changed"), _("After a collision")],
        )
    raise NotFound(_("There is nothing at this address."), _("Go back to the rotary axes."))


def about_backup(old: KinematicsBackup) -> Question:
    """Asks before a kinematics is put back."""
    said = ", ".join(f"{name} {wording.written(name, value)}" for name, value in old.errors.items())
    return Question(
        _("Put back kinematics {n}?").format(n=old.version),
        _("It is put back"),
        [
            _("Entered so far it has {what}.").format(what=said or _("nothing")),
            _("Put it back on the control as well (cycle 450)."),
            _("That becomes a new version; nothing is lost."),
        ],
        [_("Worse than before"), _("Old head is in again"), _("Entered by mistake")],
    )


def reason(text: str) -> str:
    """Why, as people chose or typed it. Raises `Invalid`."""
    return checked(Reason, text, "reason")
