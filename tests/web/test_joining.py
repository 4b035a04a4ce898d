"""Files joined at start: each script holds what it needs, once on a page."""

import re
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Page, Route

from app.web.joining import EVERYWHERE, SHEETS, joined

INNER = b"let count = 0;\nexport const next = () => (count += 1);\n"
FILES = {f"css/{each}.css": f".{each} {{}}".encode() for each in SHEETS} | {
    "js/inner.js": INNER,
    EVERYWHERE: b'import "./other.js";\nimport { next } from "./inner.js";\nnext();\n',
    "js/other.js": b'import { next } from "./inner.js";\nconst count = "its own";\nnext();\n',
    "js/some-page.js": b'import { next } from "./inner.js";\nimport { two } from "./alone.js";\nwindow.told = [next(), two];\n',
    "js/alone.js": b"export const two = 2;\n",
}


def test_what_is_imported_is_not_served_by_itself() -> None:
    assert {name for name in joined(FILES) if name.startswith("js/")} == {EVERYWHERE, "js/some-page.js"}


def test_the_sheets_of_every_page_keep_their_order() -> None:
    assert re.findall(r"\.(\w+) ", joined(FILES)["css/inband.css"].decode()) == list(SHEETS)


def test_a_page_has_one_of_each_module_in_whatever_script_it_is_used(page: Page) -> None:
    served = joined(FILES)
    tags = "".join(f'<script type="module" src="{name}"></script>' for name in (EVERYWHERE, "js/some-page.js"))

    def answer(route: Route) -> None:
        name = urlsplit(route.request.url).path.removeprefix("/tried/")
        kind = "text/javascript" if name else "text/html"
        route.fulfill(body=served.get(name, f"<!doctype html>{tags}".encode()), content_type=kind)

    page.route("**/tried/**", answer)
    page.goto("/tried/")
    assert page.evaluate("window.told") == [3, 2]  # counted on from the two of inband.js


@pytest.mark.parametrize(
    ("source", "words"),
    [
        (b'import { two } from "./nothing.js";\n', "nothing.js, which does not exist"),
        (b'import * as inner from "./inner.js";\n', "import * as inner"),
        (b"export default 1;\n", "export default 1"),
        (b"export let two = 2;\n", "export let two"),
    ],
)
def test_what_is_not_read_is_refused_at_start(source: bytes, words: str) -> None:
    with pytest.raises(ValueError, match=re.escape(words)):
        joined(FILES | {"js/some-page.js": source})
