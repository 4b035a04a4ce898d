"""Templates are compiled once, however many pages need them at once; a page that refuses keeps nothing."""

from collections.abc import MutableMapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from threading import Barrier, Event
from types import SimpleNamespace
from typing import Any

from fastapi import Request
from jinja2 import DictLoader, Environment, Template
from sqlalchemy import text

from app.db.engine import Database
from app.web.deps import get_session
from app.web.templates import OneByOne, page

PAGES = 8


class Counting(DictLoader):
    """Compiles when every page is on its way. count: how often it has compiled."""

    def __init__(self) -> None:
        super().__init__({"page.html": "read"})
        self.count, self.all_here = 0, Event()

    def load(
        self,
        environment: Environment,
        name: str,
        globals: MutableMapping[str, Any] | None = None,  # noqa: A002 - its name in jinja2
    ) -> Template:
        self.count += 1
        self.all_here.wait(60)
        return super().load(environment, name, globals)


def test_pages_that_come_at_once_compile_a_template_once() -> None:
    loader, here = Counting(), Barrier(PAGES)
    environment = OneByOne(loader=loader)

    def read(_page: int) -> str:
        if here.wait(60) == 0:
            loader.all_here.set()
        return environment.get_template("page.html").render()

    with ThreadPoolExecutor(PAGES) as pool:
        assert list(pool.map(read, range(PAGES))) == ["read"] * PAGES
    assert loader.count == 1


def test_a_page_that_refuses_keeps_nothing_of_its_request(database: Database) -> None:
    """An action that has written before it refuses is undone, whoever draws the form again."""
    app = SimpleNamespace(state=SimpleNamespace(replica=None, database=database))
    with database.begin() as session:
        session.execute(text("CREATE TABLE written (status int)"))
    for status in (200, 422, 409, 404, 200):
        request = Request(
            {"type": "http", "method": "POST", "path": "/", "query_string": b"", "headers": [], "app": app}
        )
        with contextmanager(get_session)(request) as session:
            session.execute(text("INSERT INTO written VALUES (:status)"), {"status": status})
            page(request, Template("the form"), status=status)
    with database.begin() as session:
        kept = list(session.scalars(text("SELECT status FROM written")))
    assert kept == [200, 200]
