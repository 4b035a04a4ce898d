"""The page of the OpenAPI document: every operation with a command, found by searching, readable on paper."""

import subprocess
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from app.web.api_docs import _kind, curl, prose
from tests.servers import Server
from tests.web.api_operations import operations


class TestPage:
    def test_every_operation_stands_on_it_with_a_command(self, server: Server) -> None:
        ids = [operation.declared["operationId"] for operation in operations()]
        text = server.client().get("/api/docs").text
        for each in ids:
            assert f'id="{each}"' in text
        assert text.count("curl -sS") == len(ids)
        assert "correction_in_effect" in text
        assert "R33. Zero range." in text

    def test_searching_opening_and_printing(self, page: Page) -> None:
        page.goto("/api/docs")
        assert page.locator("details.operation[open]").count() == 0
        page.keyboard.press("/")
        page.keyboard.type("offset_after")
        expect(page.locator("#mark_applied")).to_be_visible()
        expect(page.locator("#list_people")).to_be_hidden()
        page.get_by_role("searchbox").fill("no such words anywhere")
        expect(page.get_by_role("status").first).to_have_text("Nothing has all of these words.")
        page.get_by_role("searchbox").fill("")
        page.get_by_role("navigation", name="Operations").get_by_role("link", name="Push reading").click()
        expect(page.locator("#push_reading[open]")).to_be_visible()
        page.evaluate("dispatchEvent(new Event('beforeprint'))")
        assert page.locator("details.operation:not([open])").count() == 0
        page.evaluate("dispatchEvent(new Event('afterprint'))")
        assert page.locator("details.operation[open]").count() == 1

    @pytest.mark.long
    def test_it_is_linked_and_knows_who_is_signed_in(self, page: Page, server: Server) -> None:
        password = server.person("Dora", "viewer")
        page.goto("/sign-in")
        page.get_by_label("Name").fill("Dora")
        page.locator("input[type=password]").fill(password)
        page.locator("main button[type=submit]").click()
        page.wait_for_url(f"{server.url}/")
        page.get_by_role("contentinfo").get_by_role("link", name="API").click()
        expect(page.get_by_role("heading", level=1)).to_have_text("API")
        expect(page.get_by_role("banner")).to_contain_text("Dora")

    def test_wide_things_do_not_widen_it(self, page: Page) -> None:
        page.set_viewport_size({"width": 800, "height": 1000})
        page.goto("/api/docs#add_characteristic")
        expect(page.locator("#add_characteristic[open]")).to_be_visible()
        assert page.evaluate("document.documentElement.scrollWidth") <= 800


class TestWords:
    @pytest.mark.parametrize(
        ("text", "html"),
        [
            ("a `b<c` d", "<p>a <code>b&lt;c</code> d</p>"),
            ("<script>", "<p>&lt;script&gt;</p>"),
            ("raises *offset differs*", "<p>raises <em>offset differs</em></p>"),
            ("3 * 4", "<p>3 * 4</p>"),
            ("First\nline\n\n- one\n- `two`", "<p>First line</p><ul><li>one</li><li><code>two</code></li></ul>"),
        ],
    )
    def test_docstrings_become_html(self, text: str, html: str) -> None:
        assert prose(text) == html

    @pytest.mark.parametrize(
        ("schema", "words"),
        [
            ({"type": "integer", "minimum": 1, "maximum": 32}, "whole number, 1 to 32"),
            ({"type": "string", "maxLength": 64}, "text, at most 64 characters"),
            ({"enum": ["a", "b", None]}, "a | b"),
            ({"type": ["number", "null"], "minimum": 0}, "number, at least 0 or null"),
            ({"anyOf": [{"type": "string", "format": "date-time"}, {"type": "null"}]}, "time or null"),
            ({"type": "array", "items": {"type": "boolean"}}, "list of true or false"),
            ({}, "any"),
        ],
    )
    def test_schemas_become_words(self, schema: dict[str, Any], words: str) -> None:
        assert _kind({}, schema) == words

    def test_the_command_survives_a_shell(self) -> None:
        body = {"content": {"application/json": {"example": {"reason": "it's $HOME `date`"}}}}
        line = curl("post", "/x/{key}", {"parameters": [], "requestBody": body, "responses": {}}, "http://host")
        said = subprocess.run(
            ["sh", "-c", f"curl() {{ printf '%s\\n' \"$@\"; }}\n{line}"], capture_output=True, text=True
        )
        assert '{"reason": "it\'s $HOME `date`"}' in said.stdout.splitlines()
