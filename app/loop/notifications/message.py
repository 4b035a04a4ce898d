"""Messages in words, and as the JSON that webhooks get."""

import logging
from collections.abc import Collection, Mapping, Sequence
from datetime import datetime
from typing import Any

from app.language.formatting import as_read
from app.language.i18n import _, ngettext
from app.loop.alarm_response import wording
from app.loop.alarm_response.queries import AlarmRow
from app.loop.alarm_response.reaction_queries import Reactions
from app.loop.notifications.failing_wording import what_to_look_at
from app.loop.notifications.means import Message
from app.loop.notifications.tables import Receiver
from app.loop.notifications.wording import means_word

log = logging.getLogger(__name__)

MOST_IN_WORDS = 20
"""Alarms that a message describes; of more it says how many they are."""
MOST_SHOWN = 3
"""Alarms that a notification of a browser describes: it shows few lines."""


def of_alarms(
    rows: Sequence[AlarmRow],
    count: int,
    again: Collection[int],
    address: str,
    reactions: Reactions,
    unattended: Sequence[str] = (),
) -> Message:
    """A message about active alarms. rows: the most urgent `MOST_IN_WORDS` of `count`; again: those it reminds of.

    unattended: names of groups in which nobody is on duty who should have been notified.
    """
    steps = {row.alarm.id: _steps(reactions, row) for row in rows}
    reminder = len(again) >= count
    if count == 1:
        subject = f"{wording.kind_word(rows[0].alarm.kind)}: {_where(rows[0])}"
    else:
        subject = ngettext("{n} alarm", "{n} alarms", count).format(n=count)
        subject = f"{subject}: {_which(rows, count)}"
    if reminder:
        subject = _("Reminder: {subject}").format(subject=subject)
    parts = [_in_words(row, steps[row.alarm.id], address) for row in rows]
    if count > len(rows):
        parts.append(_("… and {n} more: {link}").format(n=count - len(rows), link=f"{address}/alarms"))
    if unattended:
        parts.append(_("Nobody is on duty now in: {groups}.").format(groups=", ".join(unattended)))
    parts.append(_("Acknowledge an alarm on its page; then nobody is reminded of it any more."))
    data = {
        "type": "alarms",
        "reminder": reminder,
        "subject": subject,
        "count": count,
        "nobody_on_duty": list(unattended),
        "alarms": [_as_json(row, steps[row.alarm.id], address) for row in rows],
    }
    return Message(subject, "\n\n".join(parts) + "\n", data)


def _which(rows: Sequence[AlarmRow], count: int) -> str:
    """The first kinds of alarms, and the machine if it is one, for a subject."""
    words = list(dict.fromkeys(wording.kind_word(row.alarm.kind) for row in rows))
    more = " …" if len(words) > 2 or count > len(rows) else ""
    machines = {row.machine.name for row in rows}
    where = f" – {machines.pop()}" if len(machines) == 1 and count == len(rows) else ""
    return f"{', '.join(words[:2])}{more}{where}"


def _where(row: AlarmRow) -> str:
    names = [row.machine.name, row.characteristic.name if row.characteristic else None]
    if row.alarm.tool_memory is not None:
        names.append(_("tool {n}").format(n=row.alarm.tool_memory))
    return ", ".join(name for name in names if name)


def _steps(reactions: Reactions, row: AlarmRow) -> list[str]:
    """The steps of its reaction plan."""
    plan = reactions.plan_of(row)
    return [] if plan is None else [step["text"] for step in plan.steps]


def _in_words(row: AlarmRow, steps: Sequence[str], address: str) -> str:
    alarm = row.alarm
    times = ngettext("{n} time", "{n} times", alarm.count).format(n=alarm.count)
    lines = (
        f"{wording.kind_word(alarm.kind)}: {_where(row)}",
        f"{as_read(alarm.raised_at, 'minutes')}{f', {times}' if alarm.count > 1 else ''}",
        _sentence(row),
        wording.what_to_do(alarm.kind),
        *(f"{number}. {step}" for number, step in enumerate(steps, 1)),
        _link(row, address),
    )
    return "\n".join(lines)


def _sentence(row: AlarmRow) -> str:
    """The statement of what is wrong. An alarm that cannot be worded must not keep the others waiting."""
    try:
        return wording.sentence(row.alarm)
    except Exception:
        log.exception("alarm %d cannot be worded", row.alarm.id)
        return wording.kind_word(row.alarm.kind)


def _link(row: AlarmRow, address: str) -> str:
    return f"{address}/alarms/{row.alarm.id}"


def _as_json(row: AlarmRow, steps: Sequence[str], address: str) -> dict[str, Any]:
    alarm = row.alarm
    return {
        "id": alarm.id,
        "kind": alarm.kind,
        "word": wording.kind_word(alarm.kind),
        "machine": row.machine.key,
        "machine_name": row.machine.name,
        "characteristic": row.characteristic.key if row.characteristic else None,
        "characteristic_name": row.characteristic.name if row.characteristic else None,
        "tool": alarm.tool_memory,
        "raised_at": alarm.raised_at,
        "count": alarm.count,
        "text": _sentence(row),
        "what_to_do": wording.what_to_do(alarm.kind),
        "steps": steps,
        "link": _link(row, address),
    }


def of_receivers(fail: Sequence[Receiver], address: str) -> Message:
    """A message about receivers that fail, the longest first."""
    first = fail[0].name
    if len(fail) == 1:
        subject = _("{name} is not reached: notifications do not arrive").format(name=first)
    else:
        text = _("{n} receivers are not reached: notifications do not arrive – {name} …")
        subject = text.format(n=len(fail), name=first)
    parts = [
        "\n".join(filter(None, (_failing(row), row.failure, what_to_look_at(row)))) for row in fail[:MOST_IN_WORDS]
    ]
    link = f"{address}/setup/notifications#receivers"
    if len(fail) > MOST_IN_WORDS:
        parts.append(_("… and {n} more: {link}").format(n=len(fail) - MOST_IN_WORDS, link=link))
    parts.append(_("An administrator repairs it, then presses Send a test: {link}").format(link=link))
    said = [
        {
            "id": row.id,
            "name": row.name,
            "means": row.means,
            "failing_since": row.failing_since,
            "failures": row.failures,
            "failure": row.failure,
            "what_to_do": what_to_look_at(row),
        }
        for row in fail
    ]
    body = "\n\n".join(parts)
    data = {"type": "receivers", "subject": subject, "text": body, "receivers": said, "link": link}
    return Message(subject, body + "\n", data)


def _failing(row: Receiver) -> str:
    since = as_read(row.failing_since, "minutes") if row.failing_since else "–"
    text = ngettext(
        "{name} ({means}), since {since}, {n} failure:",
        "{name} ({means}), since {since}, {n} failures in a row:",
        row.failures,
    )
    return text.format(name=row.name, means=means_word(row.means), since=since, n=row.failures)


def of_changes(changes: Sequence[Mapping[str, Any]], last: int, *, gap: bool) -> Message:
    """Changes for a webhook. last: number of the last event; gap: some before were too old to be kept."""
    subject = ngettext("{n} change", "{n} changes", len(changes)).format(n=len(changes))
    return Message(subject, "", {"type": "changes", "last": last, "gap": gap, "changes": list(changes)})


def change(number: int, at: datetime, said: Mapping[str, Any], address: str) -> dict[str, Any]:
    """One change, with the number and the time of its event, and the address of what it is about."""
    machine, characteristic = said.get("machine"), said.get("characteristic")
    api = f"{address}/api/v1"
    found = {
        "alarm": f"{api}/alarms/{said.get('id')}",
        "reading": f"{api}/readings/{characteristic}/{said.get('sequence')}",
        "correction": f"{api}/corrections/{machine}/{said.get('number')}",
        "tool": f"{api}/machines/{machine}/tools/{said.get('tool')}",
    }
    return {"event": number, "at": at, **said, "link": found.get(str(said.get("kind")), "")}


def in_short(made: Message) -> str:
    """The words of a browser's notification below its heading: of each alarm what is wrong and what to do."""
    said = [f"{each['text']} {each['what_to_do']}" for each in made.data.get("alarms", ())[:MOST_SHOWN]]
    return "\n\n".join(said) or made.data["text"]


def of_test(name: str, by: str, address: str) -> Message:
    """A message that only shows that it arrives."""
    subject = _("Inband: test")
    text = _("{by} has sent this test to {name}. Notifications arrive here.").format(by=by, name=name)
    return Message(
        subject, f"{text}\n\n{address}\n", {"type": "test", "subject": subject, "text": text, "link": address}
    )
