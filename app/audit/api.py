"""JSON route: the record of changes."""

from datetime import datetime
from typing import Annotated, Any

from fastapi import Query
from pydantic import BaseModel, ConfigDict

from app.audit import queries
from app.web.api import api_router
from app.web.deps import SessionDep, require
from app.web.fields import LARGEST_ID, Limit, Page, Text200, page_of

router = api_router("audit")


class AuditEntryOut(BaseModel):
    """One change: who, what, from what, to what, and why."""

    model_config = ConfigDict(
        from_attributes=True,
        json_schema_extra={
            "example": {
                "id": 318,
                "at": "2026-11-21T08:15:02.120Z",
                "actor": "Ana",
                "action": "parameters changed",
                "subject": "characteristic/shaft-d40",
                "before": {"zero_range": 0.001},
                "after": {"zero_range": 0.0015},
                "why": "scatter of the new probe is larger",
            }
        },
    )

    id: int
    at: datetime
    actor: str
    action: str
    subject: str
    before: dict[str, Any] | None
    after: dict[str, Any] | None
    why: str | None


@router.get("/audit", dependencies=[require("engineer")])
def list_audit_entries(
    session: SessionDep,
    subject: Annotated[
        Text200 | None,
        Query(description="Only what changed this, or what lies below it.", examples=["machine/lathe-1"]),
    ] = None,
    actor: Annotated[Text200 | None, Query(description="Only what this person or key changed.")] = None,
    before: Annotated[
        int | None, Query(ge=1, le=LARGEST_ID, description="Cursor: the `next` of the page before.")
    ] = None,
    limit: Annotated[Limit, Query()] = 100,
) -> Page[AuditEntryOut]:
    """The record of changes, newest first. Nothing in it is ever altered."""
    rows = queries.entries(session, subject=subject, actor=actor, before=before, limit=limit + 1)
    return page_of([AuditEntryOut.model_validate(row) for row in rows], limit, lambda entry: entry.id)
