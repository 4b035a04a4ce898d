"""That the fixtures do what other tests rely on."""

import pytest
from playwright.sync_api import Page
from sqlalchemy import text
from sqlalchemy.orm import Session

from app.db.engine import Database
from tests.servers import Server


@pytest.mark.parametrize("_", [1, 2])
def test_a_session_leaves_nothing(session: Session, _: int) -> None:
    insert = text("INSERT INTO machine (key, name, control) VALUES ('lathe-1', 'Lathe', 'other')")
    session.execute(insert)
    session.commit()
    assert session.scalar(text("SELECT count(*) FROM machine")) == 1


@pytest.mark.parametrize("_", [1, 2])
def test_a_database_is_new(database: Database, _: int) -> None:
    with database.begin() as session:
        assert session.scalar(text("SELECT count(*) FROM machine")) == 0
        session.execute(text("INSERT INTO machine (key, name, control) VALUES ('lathe-1', 'Lathe', 'other')"))


def test_a_page_may_not_complain_nor_call_elsewhere(page: Page, server: Server, complaints: list[str]) -> None:
    page.goto("/health/live")
    page.evaluate("console.error('broken')")
    with page.expect_event("pageerror"):
        page.evaluate("setTimeout(() => { throw new Error('uncaught') })")
    page.goto(elsewhere := f"{server.url}/health/live".replace("127.0.0.1", "localhost"))
    page.goto("about:blank")
    found = "\n".join(complaints)
    complaints.clear()
    assert "broken" in found
    assert "uncaught" in found
    assert f"foreign host: {elsewhere}" in found
