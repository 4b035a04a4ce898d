"""Pages in Chromium that find the library of charts read, as for everybody who goes from one page to the next.

To read it takes four times as long as all else that a page of charts does, and contexts of a browser share nothing. One
is therefore kept for each server that was looked at last. A page that stays open in it keeps the process of its pages (with
``--renderer-process-limit=1`` they share one) and what this has compiled. Whoever comes next finds no cookie, nothing stored
and no permission of the one before.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from playwright.sync_api import Browser, BrowserContext, Page

MOST = 4  # contexts that are kept: the server of the worker and the showcase, with and without fingers
PATIENCE = 60_000  # ms


class Visits:
    """A browser with its kept contexts."""

    def __init__(self, browser: Browser) -> None:
        self._browser = browser
        self._kept: dict[str, BrowserContext] = {}

    @contextmanager
    def page(self, url: str, *, viewport: dict[str, Any], **options: Any) -> Iterator[Page]:
        """A page for somebody who has never been at the server `url`; `options` are those of a browser's context."""
        context = self._context(url, options)
        opened = context.new_page()
        try:
            opened.set_viewport_size(viewport)  # type: ignore[arg-type]
            yield opened
        finally:
            self._leave(context)

    def _context(self, url: str, options: dict[str, Any]) -> BrowserContext:
        name = f"{url} {sorted(options.items())}"
        context = self._kept.pop(name, None)
        if context is None:
            context = self._browser.new_context(base_url=url, locale="en-GB", **options)
            context.set_default_timeout(PATIENCE)
            context.new_page().goto("/health/live")
        self._kept[name] = context
        while len(self._kept) > MOST:
            self._kept.pop(next(iter(self._kept))).close()
        return context

    def _leave(self, context: BrowserContext) -> None:
        stays, *others = context.pages
        for each in others:
            each.close()
        stays.evaluate("localStorage.clear()")
        context.clear_cookies()
        context.clear_permissions()
