"""Set-up page: the record of changes."""

import json
from functools import partial
from typing import Any

from fastapi import APIRouter, Request, Response

from app.access import devices
from app.access.audit import queries
from app.access.deps import Engineer
from app.views.set_up.frame import setup_page
from app.web.deps import SessionDep
from app.web.fields import LARGEST_ID
from app.web.paging import address, part_of

router = APIRouter(include_in_schema=False)
SHOWN = 100


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
        entries=[(entry, changes(entry.before, entry.after)) for entry in part.rows],
        devices=devices.names_of(session, {entry.device_id for entry in part.rows if entry.device_id}),
        subject=subject,
        actor=actor,
        q=text,
        part=part,
    )


def changes(before: dict[str, Any] | None, after: dict[str, Any] | None) -> list[tuple[str, str, str]]:
    """List the differences: (name, from, to), with nested sets taken apart."""
    old, new = _flat(before or {}), _flat(after or {})
    return [
        (name, old.get(name, "–"), new.get(name, "–"))
        for name in dict.fromkeys([*old, *new])
        if old.get(name) != new.get(name)
    ]


def _flat(values: dict[str, Any], prefix: str = "") -> dict[str, str]:
    flat: dict[str, str] = {}
    for name, value in values.items():
        if isinstance(value, dict):
            flat |= _flat(value, f"{prefix}{name}.")
        elif value is not None:
            flat[prefix + name] = _said(value)
    return flat


def _said(value: Any) -> str:
    """A value as people read it: what is in a list is reported, not written as JSON."""
    if isinstance(value, str):
        return value
    if isinstance(value, list):
        sets = any(isinstance(item, dict) for item in value)
        return ("; " if sets else ", ").join(map(_said, value))
    if isinstance(value, dict):
        # What followed an alarm is a code with its values; the code says what the values are of.
        values = [f"{name} {_said(item)}" for name, item in value.items() if name != "code" and item is not None]
        return f"{value['code']}: {', '.join(values)}" if "code" in value else ", ".join(values)
    return json.dumps(value, ensure_ascii=False)
