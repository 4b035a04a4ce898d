"""Templates are compiled once, however many pages need them at once."""

from collections.abc import MutableMapping
from concurrent.futures import ThreadPoolExecutor
from threading import Barrier, Event
from typing import Any

from jinja2 import DictLoader, Environment, Template

from app.web.templates import OneByOne

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
