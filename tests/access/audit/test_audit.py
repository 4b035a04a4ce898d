"""The record of changes: complete, in order, and written once."""

from typing import Any

import pytest
from sqlalchemy import delete, text, update
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.access.audit.queries import entries
from app.access.audit.tables import AuditEntry
from tests.shop import Shop


@pytest.mark.parametrize(
    "tampering",
    [update(AuditEntry).values(actor="somebody else"), delete(AuditEntry), text("TRUNCATE audit_entry")],
    ids=["update", "delete", "truncate"],
)
def test_nothing_is_altered_or_removed(session: Session, tampering: Any) -> None:
    record(session, "Ana", "machine changed", "machine/lathe-1", {"name": "a"}, {"name": "b"}, "moved")
    with pytest.raises(DBAPIError, match="append-only"), session.begin_nested():
        session.execute(tampering)
    entry = entries(session, subject="machine/lathe-1")[0]
    assert (entry.actor, entry.before, entry.after, entry.why) == ("Ana", {"name": "a"}, {"name": "b"}, "moved")


def test_a_subject_takes_what_lies_below_it_and_nothing_beside_it(session: Session) -> None:
    for subject in ("tool/lathe-1/3", "tool/lathe-1", "tool/lathe-10/3", "tool/lathe_1/3"):
        record(session, "Ana", "tool changed", subject)
    assert [entry.subject for entry in entries(session, subject="tool/lathe-1")] == ["tool/lathe-1", "tool/lathe-1/3"]
    assert [entry.subject for entry in entries(session, subject="tool/lathe_1")] == ["tool/lathe_1/3"]


def test_nothing_before_is_null_not_a_json_null(session: Session) -> None:
    record(session, "Ana", "machine added", "machine/new", None, {"name": "b"})
    assert session.scalar(text("SELECT before IS NULL FROM audit_entry ORDER BY id DESC LIMIT 1"))


def test_pages_newest_first(server: Any) -> None:
    shop = Shop(server)
    for number in range(5):
        shop.call("PATCH", f"/machines/{shop.machine}", name=f"Name {number}")
    names: list[str] = []
    page: Any = {"next": 2**62}
    while page["next"] is not None:
        page = shop.call("GET", f"/audit?subject=machine/{shop.machine}&limit=2&before={page['next']}")
        names += [entry["after"]["name"] for entry in page["items"] if entry["action"] == "machine changed"]
    assert names == [f"Name {number}" for number in (4, 3, 2, 1, 0)]
    assert {entry["actor"] for entry in shop.call("GET", "/audit")["items"]} >= {"tests", "key a test's key"}


@pytest.mark.parametrize(
    ("query", "field"),
    [
        ("limit=0", "limit"),
        ("limit=1001", "limit"),
        ("limit=x", "limit"),
        ("before=0", "before"),
        ("before=x", "before"),
        ("before=99999999999999999999", "before"),
        ("subject=%00", "subject"),
        ("actor=" + "x" * 201, "actor"),
    ],
)
def test_bad_queries_are_named(server: Any, query: str, field: str) -> None:
    answer = server.client(server.key()).get(f"/api/v1/audit?{query}")
    assert answer.status_code == 422
    assert [error["field"] for error in answer.json()["errors"]] == [field]
