"""Notifications in words."""

from collections.abc import Mapping
from typing import Any

from app.language.i18n import _


def means_word(means: str) -> str:
    """The name of a means."""
    return {"mail": _("Mail"), "webhook": _("Webhook"), "apprise": _("apprise")}.get(means, means)


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
        ("attention", _("Attention: somebody has to look")),
        ("waiting", _("Waiting: not urgent")),
        ("steady", _("For information")),
    ]


def when(hours: Mapping[str, Any]) -> str:
    """A stored part of the week, such as Mon–Fri 06:00–14:00."""
    names = [_("Mon"), _("Tue"), _("Wed"), _("Thu"), _("Fri"), _("Sat"), _("Sun")]
    days = sorted(hours["days"])
    text = ", ".join(names[day - 1] for day in days)
    if len(days) > 2 and days == list(range(days[0], days[-1] + 1)):
        text = f"{names[days[0] - 1]}–{names[days[-1] - 1]}"
    return f"{text} {hours['begins']}–{hours['ends']}"
