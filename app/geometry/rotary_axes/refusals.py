"""Refusals to put a kinematics back or to undo an entry, with their reasons."""

from __future__ import annotations

from typing import TYPE_CHECKING

from app.language.i18n import _
from app.language.times import in_sentence

if TYPE_CHECKING:
    from app.geometry.rotary_axes.queries import RunRow
    from app.geometry.rotary_axes.tables import KinematicsBackup


def is_in_effect(old: KinematicsBackup, now: KinematicsBackup) -> tuple[str, str]:
    """Reason for which nothing is put back."""
    done = _("There is nothing to put back.")
    if now.version == old.version:
        return _("The kinematics of back-up {version} is in effect.").format(version=old.version), done
    text = _("The values of back-up {version} are in effect, as version {now}: {who}, {at}, {reason}")
    return (
        text.format(
            version=old.version,
            now=now.version,
            who=now.actor,
            at=in_sentence(now.at),
            reason=now.reason,
        ),
        done,
    )


def changed_meanwhile(seen: int, now: KinematicsBackup) -> tuple[str, str]:
    """Someone else has changed the kinematics since it was looked at."""
    text = _("Version {seen} is not in effect any more: {who} made version {now} on {at}: {reason}")
    return (
        text.format(seen=seen, now=now.version, who=now.actor, at=in_sentence(now.at), reason=now.reason),
        _("Look at the kinematics again before you put anything back."),
    )


def cannot_undo(row: RunRow) -> tuple[str, str]:
    """Reason for which an entry is not undone."""
    number = row.run.id
    if row.undone:
        return (
            _("Run {number} was undone already.").format(number=number),
            _("To have its values again, put back the version that it led to."),
        )
    return (
        _("Run {number} was not entered.").format(number=number),
        _("There is nothing to undo."),
    )


def stands_below(row: RunRow, later: list[int], version: int) -> tuple[str, str]:
    """Reason for which an entry is not undone: others were made after it."""
    runs = ", ".join(map(str, later))
    return (
        _("After run {number} others were entered on top of it: {runs}.").format(number=row.run.id, runs=runs),
        _(
            "Undo those first, the latest before the others; or put back version {version}, which undoes all of them."
        ).format(version=version),
    )
