"""JSON route: the record of changes."""

from datetime import datetime
from typing import Annotated, Any

from fastapi import Query
from pydantic import BaseModel, ConfigDict, Field

from app.access.audit import queries
from app.access.deps import require
from app.web.api import Before, Limit, api_router
from app.web.deps import SessionDep
from app.web.fields import LARGEST_SERIAL, Page, Text200, page_of

router = api_router("audit")


class AuditEntryOut(BaseModel):
    """One change: who, what, from what, to what, and why."""

    model_config = ConfigDict(from_attributes=True)

    id: int
    at: datetime
    actor: str = Field(description="The name as it was then.")
    person_id: int | None = Field(description="The person's number; null for keys, the system and the command line.")
    key_id: int | None = Field(description="The key's number; null for people, the system and the command line.")
    action: Annotated[str, Field(description="What was done, such as `parameters changed`.")]
    subject: Annotated[str, Field(description="To what, as kind and key, such as `characteristic/shaft-d40`.")]
    before: Annotated[
        dict[str, Any] | None, Field(description="What was changed, as it was before; null where there was nothing.")
    ]
    after: Annotated[dict[str, Any] | None, Field(description="The same as it is since; null where nothing is left.")]
    why: Annotated[str | None, Field(description="The reason that was given, if one was.")]
    device_id: int | None = Field(
        description="The station device where the person identified themselves; null for what was done elsewhere."
    )


@router.get("/audit", dependencies=[require("engineer")])
def list_audit_entries(
    session: SessionDep,
    subject: Annotated[
        Text200 | None,
        Query(description="Only what changed this, or what lies below it.", examples=["machine/lathe-1"]),
    ] = None,
    actor: Annotated[Text200 | None, Query(description="Only what this person or key changed.")] = None,
    person: Annotated[
        int | None, Query(ge=1, le=LARGEST_SERIAL, description="Only what the person with this number changed.")
    ] = None,
    key: Annotated[
        int | None, Query(ge=1, le=LARGEST_SERIAL, description="Only what the key with this number changed.")
    ] = None,
    before: Before = None,
    limit: Limit = 100,
) -> Page[AuditEntryOut]:
    """The record of changes, newest first. Nothing in it is ever altered."""
    rows = queries.entries(
        session, subject=subject, actor=actor, person=person, key=key, before=before, limit=limit + 1
    )
    return page_of([AuditEntryOut.model_validate(row) for row in rows], limit, lambda entry: entry.id)
