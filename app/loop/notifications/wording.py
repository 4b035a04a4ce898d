"""Notifications in words."""

from collections.abc import Mapping
from datetime import datetime
from typing import Any

from app.language.i18n import _
from app.loop.notifications.group_schemas import DutyOut
from app.loop.notifications.tables import ReceiverGroup

MOST_TIMES = 4


def means_word(means: str) -> str:
    """The name of a means."""
    return {"mail": _("Mail"), "webhook": _("Webhook"), "apprise": _("apprise"), "browser": _("Browser")}.get(
        means, means
    )


def changes_word(kind: str) -> str:
    """The name of a kind of changes that webhooks get."""
    return {
        "alarm": _("Alarms"),
        "reading": _("Readings and decisions"),
        "correction": _("Corrections"),
        "tool": _("Tools"),
    }.get(kind, kind)


def delivery_word(state: str) -> str:
    """The state of a delivery."""
    return {
        "waiting": _("waiting"),
        "sending": _("sending"),
        "delivered": _("delivered"),
        "failed": _("failed"),
        "lost": _("lost, sent again"),
    }.get(state, state)


def tones() -> list[tuple[str, str]]:
    """Urgencies of alarms, the most urgent first."""
    return [
        ("stop", _("Stop: the machine must not go on")),
        ("wear", _("Wear: a tool has to be changed")),
        ("attention", _("Attention: needs a look")),
        ("waiting", _("Waiting: not urgent")),
        ("steady", _("For information")),
    ]


def _days() -> list[str]:
    return [_("Mon"), _("Tue"), _("Wed"), _("Thu"), _("Fri"), _("Sat"), _("Sun")]


def when(hours: Mapping[str, Any]) -> str:
    """A stored part of the week: Mon–Fri 06:00–14:00; Sat, Sun all day."""
    names, days = _days(), sorted(hours["days"])
    text = ", ".join(names[day - 1] for day in days)
    if len(days) > 2 and days == list(range(days[0], days[-1] + 1)):
        text = f"{names[days[0] - 1]}–{names[days[-1] - 1]}"
    begins, ends = hours["begins"], hours["ends"]
    if begins == "00:00" and ends in ("00:00", "24:00"):
        return _("{days} all day").format(days=text)
    return f"{text} {begins}–{ends}"


def on_duty_word(group: str) -> str:
    """Those on duty in a group, as a route names them."""
    return _("on duty: {group}").format(group=group)


def _rota(row: ReceiverGroup, names: Mapping[int, str]) -> list[str]:
    """The rota of a group, a sentence for each turn."""
    words = []
    for turn in row.rota:
        whom = ", ".join(names.get(number, str(number)) for number in turn["receivers"])
        hours = {"days": turn["days"], "begins": turn["shift"] or turn["begins"] or "00:00"}
        hours["ends"] = turn["ends"] or (_("end of shift") if turn["shift"] else "24:00")
        parts = [when(hours)]
        if turn["first"]:
            parts.append(_("from {day}").format(day=turn["first"]))
        if turn["last"]:
            parts.append(_("until {day}").format(day=turn["last"]))
        words.append(f"{whom}: {' '.join(parts)}")
    return words


def group_words(row: ReceiverGroup, names: Mapping[int, str], now: datetime) -> tuple[str, list[str], str, str]:
    """The members of a group, its rota, those on duty at this moment, and when nobody is in the week to come."""
    members = ", ".join(names.get(number, str(number)) for number in row.members)
    duty = DutyOut.of(row, now)
    on_duty = ", ".join(names.get(number, str(number)) for number in duty.receivers)
    return members, _rota(row, names), on_duty, _unattended(duty)


def _unattended(duty: DutyOut) -> str:
    names = _days()
    times = [
        "–".join(f"{names[at.weekday()]} {at:%H:%M}" for at in (each.begins, each.ends))
        for each in duty.unattended[:MOST_TIMES]
    ]
    return ", ".join(times) + (" …" if len(duty.unattended) > MOST_TIMES else "")
