"""Set-up page: the record of changes."""

import re
from datetime import datetime
from functools import partial
from typing import Any, NamedTuple
from urllib.parse import quote

from fastapi import APIRouter, Request, Response

from app.access import devices
from app.access.audit import queries
from app.access.deps import Engineer
from app.core.parameters import BY_NAME, Field, FieldKind
from app.language.formatting import as_read
from app.language.i18n import _
from app.loop.alarm_response.wording import action_word
from app.loop.characteristics.wording import choice, label
from app.views.set_up.frame import setup_page
from app.web.deps import SessionDep
from app.web.fields import LARGEST_ID
from app.web.paging import address, part_of

router = APIRouter(include_in_schema=False)
SHOWN = 100
CODES = {"action", "kind", "state", "status", "means"}
LENGTHS = {"offset", "total", "average", "hand_measured", "empirical_value"}
DIGEST = re.compile(r"[0-9a-f]{40,}")
MOMENT = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?(Z|[+-]\d\d:\d\d)")


@router.get("/setup/audit")
def audit_page(
    request: Request,
    session: SessionDep,
    caller: Engineer,
    subject: str = "",
    actor: str = "",
    q: str = "",
    before: str = "",
) -> Response:
    subject, actor, text = (typed.replace("\0", "").strip()[:200] for typed in (subject, actor, q))
    cursor = int(before) if before.isascii() and before.isdigit() and int(before) <= LARGEST_ID else None
    entries = queries.entries(session, subject=subject, actor=actor, text=text, before=cursor, limit=SHOWN + 1)
    part = part_of(
        entries,
        SHOWN,
        cursor,
        lambda entry: entry.id,
        partial(address, "/setup/audit", subject=subject or None, actor=actor or None, q=text or None),
    )
    return setup_page(
        request,
        "audit.html",
        caller,
        "audit",
        entries=[
            (
                entry,
                changes(entry.before, entry.after, of_parameters=entry.subject.startswith("characteristic/")),
                shown(entry.subject),
            )
            for entry in part.rows
        ],
        devices=devices.names_of(session, {entry.device_id for entry in part.rows if entry.device_id}),
        subject=subject,
        actor=actor,
        q=text,
        part=part,
    )


class Shown(NamedTuple):
    """The subject of a change in words, and its page; None: it has none of its own that an engineer may open."""

    words: str
    path: str | None = None


def shown(subject: str) -> Shown:
    """Return the subject of a change as people read it.

    >>> shown("correction/lathe-2/190")
    Shown(words='Correction 190, lathe-2', path='/machines/lathe-2/corrections/190')
    >>> shown("receiver/7").words, shown("average/lathe-1/3/pair/2")
    ('Receiver 7', Shown(words='average lathe-1 3 pair 2', path=None))
    """
    kind, *parts = subject.split("/")
    words, path = _subjects().get((kind, len(parts)), (None, None))
    if words is None:
        return Shown(" ".join([kind.replace("-", " "), *parts]))
    return Shown(words.format(*parts), path and path.format(*(quote(part, safe="") for part in parts)))


def _subjects() -> dict[tuple[str, int], tuple[str, str | None]]:
    """By the kind of a subject and how many names follow: its words, and the path of its page."""
    return {
        ("alarm", 1): (_("Alarm {0}"), "/alarms/{0}"),
        ("alignment", 1): (_("Alignment {0}"), "/alignments/{0}"),
        ("catalogue", 1): (_("Catalogue entry {0}"), "/setup/reactions"),
        ("characteristic", 1): (_("Characteristic {0}"), "/setup/characteristics/{0}"),
        ("correction", 2): (_("Correction {1}, {0}"), "/machines/{0}/corrections/{1}"),
        ("kinematics", 2): (_("Kinematics version {1}, {0}"), "/kinematics/machines/{0}"),
        ("machine", 1): (_("Machine {0}"), "/setup/machines/{0}"),
        ("maintenance", 1): (_("Maintenance {0}"), "/maintenance"),
        ("note", 1): (_("Note {0}"), "/notes/{0}"),
        ("person", 1): (_("Person {0}"), None),
        ("quarantine", 1): (_("Quarantine {0}"), "/quarantines/{0}"),
        ("quarantine", 2): (_("Part {1}, quarantine {0}"), "/quarantines/{0}"),
        ("reaction-plan", 1): (_("Reaction plan {0}"), "/setup/reactions/{0}"),
        ("reading", 2): (_("Reading {1} of {0}"), "/characteristics/{0}/readings/{1}"),
        ("receiver", 1): (_("Receiver {0}"), None),
        ("reports", 1): (_("Report {0}"), "/reports"),
        ("signal", 1): (_("Signal {0}"), "/signals/{0}"),
        ("station", 1): (_("Station {0}"), None),
        ("tool", 2): (_("Tool {1}, {0}"), "/machines/{0}/tools/{1}"),
        ("wall-screen", 1): (_("Wall screen {0}"), None),
    }


def changes(
    before: dict[str, Any] | None, after: dict[str, Any] | None, *, of_parameters: bool = False
) -> list[tuple[str, str, str]]:
    """List the differences: (name, from, to), with nested sets taken apart. of_parameters: names are those of parameters.

    >>> changes({"parameters": {"zero_range": 0.001}}, {"parameters": {"zero_range": 0.002}}, of_parameters=True)
    [('Zero range (R33)', '0.001 mm', '0.002 mm')]
    >>> changes({}, {"action": "tool_replaced"})
    [('action', '–', 'Tool changed')]
    """
    old, new = _flat(before or {}), _flat(after or {})
    found = []
    for path in dict.fromkeys([*old, *new]):
        if old.get(path) != new.get(path) and path != "digest":  # of a photo: for programs, which read it as JSON
            field = BY_NAME.get(path.rpartition(".")[2]) if of_parameters else None
            was, is_now = (_said(side[path], field) if path in side else "–" for side in (old, new))
            if path in CODES:
                was, is_now = _code_words(path, was), _code_words(path, is_now)
            elif path in LENGTHS:
                was, is_now = (f"{said} mm" if said != "–" else said for said in (was, is_now))
            found.append((_named(path, field), was, is_now))
    return found


def _code_words(path: str, code: str) -> str:
    """A code in words; what was done about an alarm as it is on its button."""
    return (action_word(code) if path == "action" else code).replace("_", " ")


def _named(path: str, field: Field | None) -> str:
    if field is None:
        return path.replace("_", " ").replace(".", " · ")
    return f"{label(field.name)} ({field.r})" if field.r else label(field.name)


def _flat(values: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, dict) and "code" not in value:
            flat |= _flat(value, f"{prefix}{name}.")
        elif value is not None:
            flat[prefix + name] = value
    return flat


def _said(value: Any, field: Field | None = None) -> str:
    """A value as people read it: what is in a list is reported, not written as JSON.

    >>> _said([]), _said({"after": 0, "groups": [], "receivers": [1]})
    ('–', 'after 0, receivers 1')
    >>> _said(True), _said(0.1 + 0.2), _said(["a", 2]), _said("9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08")
    ('yes', '0.3', 'a, 2', '9f86d081884c…')
    """
    if isinstance(value, bool):
        return _("yes") if value else _("no")
    if isinstance(value, int | float):
        number = f"{value:.7f}".rstrip("0").rstrip(".").replace("-", "−")
        return f"{number} mm" if field and field.kind is FieldKind.LENGTH else number
    if isinstance(value, str):
        if field and value in field.choices:
            return choice(field.name, value)
        if MOMENT.fullmatch(value):
            return as_read(datetime.fromisoformat(value))
        return f"{value[:12]}…" if DIGEST.fullmatch(value) else value
    if isinstance(value, list) and value:
        sets = any(isinstance(item, dict) for item in value)
        return ("; " if sets else ", ").join(map(_said, value))
    if isinstance(value, dict):
        # What followed an alarm is a code with its values; the code says what the values are of.
        values = [
            f"{name.replace('_', ' ')} {_said(item)}"
            for name, item in value.items()
            if name != "code" and item not in (None, "", [])
        ]
        return f"{value['code'].replace('_', ' ')}: {', '.join(values)}" if "code" in value else ", ".join(values)
    return "–"
