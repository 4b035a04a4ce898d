"""Set-up page: the record of changes."""

import json
from typing import Any
from urllib.parse import urlencode

from fastapi import APIRouter, Request, Response

from app.audit import queries
from app.setup.frame import setup_page
from app.web.deps import Engineer, SessionDep
from app.web.fields import LARGEST_ID

router = APIRouter()
SHOWN = 100


@router.get("/setup/audit")
def audit_page(
    request: Request, session: SessionDep, caller: Engineer, subject: str = "", actor: str = "", before: str = ""
) -> Response:
    subject, actor = subject.strip()[:200], actor.strip()[:200]
    cursor = int(before) if before.isascii() and before.isdigit() and int(before) <= LARGEST_ID else None
    entries = queries.entries(session, subject=subject, actor=actor, before=cursor, limit=SHOWN + 1)
    kept = {name: value for name, value in (("subject", subject), ("actor", actor)) if value}
    older = None
    if len(entries) > SHOWN:
        older = "/setup/audit?" + urlencode(kept | {"before": entries[SHOWN - 1].id})
    return setup_page(
        request,
        "audit.html",
        caller,
        "audit",
        entries=[(entry, changes(entry.before, entry.after)) for entry in entries[:SHOWN]],
        subject=subject,
        actor=actor,
        older=older,
        newest=f"/setup/audit?{urlencode(kept)}" if cursor else None,
    )


def changes(before: dict[str, Any] | None, after: dict[str, Any] | None) -> list[tuple[str, str, str]]:
    """What differs: (name, from, to), with sets within sets taken apart."""
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
            flat[prefix + name] = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
    return flat
