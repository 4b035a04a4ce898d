"""The showcase, served for real, and a browser page that watches what no page may do."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass

import httpx
import pytest
import uvicorn
from playwright.sync_api import Browser, Page

from tests.servers import TLS, free_port
from tests.web.showcase import Stage, showcase


def until(page: Page, expression: str, seconds: float = 60) -> None:
    """Until the expression is true in the page. (Playwright's own waiting needs eval, which our policy forbids.)"""
    deadline = time.monotonic() + seconds
    while not page.evaluate(expression):
        assert time.monotonic() < deadline, f"never true: {expression}"
        page.wait_for_timeout(50)


@dataclass
class Show:
    """The running showcase."""

    url: str
    stage: Stage


@pytest.fixture(scope="session")
def served_show() -> Iterator[Show]:
    stage, port = Stage(), free_port()
    config = uvicorn.Config(
        showcase(stage), host="127.0.0.1", port=port, log_level="warning", timeout_graceful_shutdown=1
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        time.sleep(0.01)
    yield Show(f"http://127.0.0.1:{port}", stage)
    stage.over = server.should_exit = True
    thread.join(10)


@pytest.fixture
def show(served_show: Show) -> Show:
    """The showcase as it is at first."""
    served_show.stage.reset()
    return served_show


@pytest.fixture
def client(show: Show) -> Iterator[httpx.Client]:
    with httpx.Client(base_url=show.url, timeout=60, verify=TLS) as made:
        yield made


OpenPage = Callable[..., AbstractContextManager[Page]]


@pytest.fixture
def open_page(browser: Browser, show: Show) -> OpenPage:
    """``with open_page("/", width, height, theme) as page``: fails on console errors (but those with `forgive` in
    them), violations of the policy and foreign requests."""

    @contextmanager
    def opened(
        path: str = "/",
        width: int = 1280,
        height: int = 800,
        theme: str = "auto",
        forgive: str | None = None,
        **options: object,
    ) -> Iterator[Page]:
        complaints: list[str] = []
        context = browser.new_context(viewport={"width": width, "height": height}, locale="en-GB", **options)  # type: ignore[arg-type]
        context.add_cookies([{"name": "inband_theme", "value": theme, "url": show.url}])
        context.add_init_script(
            "document.addEventListener('securitypolicyviolation', (e) => console.error('policy: ' + e.violatedDirective))"
        )
        context.set_default_timeout(60_000)
        page = context.new_page()
        page.on("console", lambda m: complaints.append(m.text) if m.type in {"error", "warning"} else None)
        page.on("pageerror", lambda error: complaints.append(str(error)))
        page.on(
            "request", lambda r: None if r.url.startswith((show.url, "data:", "blob:")) else complaints.append(r.url)
        )
        page.goto(show.url + path)
        yield page
        context.close()
        complaints = [words for words in complaints if forgive is None or forgive not in words]
        assert not complaints, "\n".join(complaints)

    return opened
