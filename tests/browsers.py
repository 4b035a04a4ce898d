"""Fixtures of the browser: Chromium, and pages whose complaints fail the test."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, Page, Playwright, Request, sync_playwright

from tests.servers import Server

BROWSER_OPTIONS = [
    "--no-sandbox",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]


@pytest.fixture(scope="session")
def playwright() -> Iterator[Playwright]:
    with sync_playwright() as running:
        yield running


@pytest.fixture(scope="session")
def browser(playwright: Playwright) -> Iterator[Browser]:
    """Chromium: Debian's where there is one, best without the windows that nobody sees, else Playwright's own."""
    found = next(
        filter(
            _works,
            filter(
                None, map(shutil.which, ["chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"])
            ),
        ),
        None,
    )
    running = playwright.chromium.launch(executable_path=found, args=BROWSER_OPTIONS, timeout=180_000)
    yield running
    running.close()


def _works(program: str) -> bool:
    """Some systems have a stand-in that only says how to get the real thing."""
    return subprocess.run([program, "--version"], capture_output=True).returncode == 0


@pytest.fixture
def complaints() -> list[str]:
    """Faults of the page that no page may have. A test that provokes an error on purpose looks at it and clears it."""
    return []


@pytest.fixture
def screen() -> dict[str, Any]:
    """What a page is seen on, as the browser's context names it; a class of tests may have another one."""
    return {"viewport": {"width": 1280, "height": 800}}


@contextmanager
def new_page(browser: Browser, url: str, complaints: list[str], **screen: Any) -> Iterator[Page]:
    """A page of the server at `url`, in a context of its own; console errors and requests to any other host are complaints."""
    host = urlsplit(url).netloc

    def look(request: Request) -> None:
        parts = urlsplit(request.url)
        if parts.scheme not in {"data", "blob", "about"} and parts.netloc != host:
            complaints.append(f"request to a foreign host: {request.url}")

    context = browser.new_context(base_url=url, locale="en-GB", **screen)
    context.on("request", look)
    opened = context.new_page()
    opened.set_default_timeout(60_000)
    opened.on("pageerror", lambda error: complaints.append(f"uncaught in {opened.url}: {error}"))
    opened.on(
        "console",
        lambda message: (
            complaints.append(f"console in {opened.url}: {message.text}") if message.type == "error" else None
        ),
    )
    yield opened
    context.close()


@pytest.fixture
def page(browser: Browser, server: Server, complaints: list[str], screen: dict[str, Any]) -> Iterator[Page]:
    """A page of the server; what it complains about fails the test."""
    with new_page(browser, server.url, complaints, **screen) as opened:
        yield opened
    assert not complaints, "\n".join(complaints)
