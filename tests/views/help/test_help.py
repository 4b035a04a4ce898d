"""Help inside the program: every document is a page, every page of the program leads to one, every R number has its sentence."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from app.core.parameters import FIELDS
from app.core.spc.rules import RuleName
from app.loop.summaries.wording import rule_name
from app.views.help import queries as help_documents
from app.views.help.contents import groups
from app.views.help.queries import document, documents, files, sections
from app.web.help_ways import help_of
from app.web.terms import PAGE, term_of, terms
from tests.pages.house import PAGES
from tests.servers import Server
from tests.shop import Person, Shop

INDICES = ("Cp", "Cpk", "Pp", "Ppk", "Cpm", "Pm", "Pmk", "ppm", "Cg", "Cgk", "%GRR", "GRR of the variation", "ndc")


def test_every_document_stands_in_the_contents_once() -> None:
    listed = [address for group in groups() for address, _title in group.documents]
    assert sorted(listed) == sorted(f"/help/{name}" for name in documents())


@pytest.mark.parametrize(
    "name", ["how-to/run-for-real", "how-to/bridge", "how-to/python-client", "reference/glossary", "decisions/README"]
)
def test_links_lead_to_pages_and_headings_that_are_there(name: str) -> None:
    for address in re.findall(r' (?:href|src)="([^"]*)"', document(name).body):
        place, _mark, heading = address.partition("#")
        if "://" in place:
            continue
        target = place.removeprefix("/help/") or name
        assert target in documents() or target in files(), address
        if heading and target in documents():
            assert f'id="{heading}"' in document(target).body, address


def test_html_in_a_document_is_shown_as_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (
        "# Odd\n\n<!-- generated: x -->\n<script>alert(1)</script> a <b onclick=x>word</b> [a](javascript:alert(1)) "
        "[b](../outside.md) ![c](../../secret.png) [d](other.md#here) [e](https://x.example)\n\n## Two `words`\n\n[f](#two-words)\n"
    )
    (tmp_path / "odd.md").write_text(text)
    (tmp_path / "other.md").write_text("# Other\n")
    monkeypatch.setattr(help_documents, "DOCS", tmp_path)
    for cached in (documents, files, document, sections):
        monkeypatch.setattr(help_documents, cached.__name__, cached.__wrapped__)
    found = help_documents.document("odd")
    assert "<script" not in found.body
    assert "<b" not in found.body
    assert "generated" not in found.body
    assert set(re.findall(r'(?:href|src)="([^"]*)"', found.body)) == {
        "/help/other#here",
        "https://x.example",
        "#two-words",
    }
    assert " b " in found.body, "the words of a link that leads outside stay"
    assert found.contents == [("Two words", "/help/odd#two-words")]


def test_every_page_of_the_program_leads_to_its_help() -> None:
    without = set()
    for route in PAGES:
        address = help_of(re.sub(r"\{[^}]*\}", "x", route))
        assert address == "/help" or address.removeprefix("/help/") in documents(), route
        if address == "/help":
            without.add(route)
    of_all = ("/help", "/licences", "/parts", "/notes", "/search", "/account", "/api/docs", "/setup/jobs")
    assert {route for route in without if not route.startswith(of_all)} == {
        "/",
        "/plant/{machine}",
        "/machines",
        "/machines/{machine}",
        "/setup",
    }


def test_every_number_index_and_rule_has_its_sentence() -> None:
    numbers = {field.r for field in FIELDS if field.r}
    assert {name for name in (*numbers, *INDICES) if term_of(name) is None} == set()
    assert term_of("R33") == term_of("zero range")
    assert term_of("R11 = 5") == term_of("average memory")
    assert {name for name in RuleName if term_of(rule_name(name)) is None} == set()
    body = document("reference/glossary").body
    assert {term.path for term in terms().values() if f'id="{term.path.removeprefix(f"{PAGE}#")}"' not in body} == set()


def test_pages_for_everyone_who_is_signed_in_and_nobody_else(server: Server, viewer: Person) -> None:
    assert 'href="/help/how-to/run-rules"' in viewer.open("/help")
    text = viewer.open("/help/how-to/run-rules")
    assert 'href="/help/how-to/control-charts"' in text
    assert viewer.browser.get("/help/images/zone-chart.png").headers["content-type"] == "image/png"
    for nothing in ("no-such", "../app/settings", "%2e%2e/pyproject.toml", "generate.py", "how-to/run-rules.md"):
        viewer.open(f"/help/{nothing}", 404)
    stranger = server.client()
    for path in ("/help", "/help/how-to/run-rules", "/help/images/zone-chart.png", "/help/no-such"):
        assert stranger.get(path).status_code in {303, 401}, path


@pytest.mark.browser
def test_a_number_says_its_sentence_by_keyboard_and_touch(server: Server, viewer: Person, page: Page) -> None:
    shop = Shop(server)
    viewer.sign_in(page)
    page.goto(f"/machines/{shop.machine}/tools")
    page.wait_for_load_state("networkidle")
    number = page.get_by_role("link", name="R10", exact=True)
    note = page.locator(".term-note")
    number.focus()
    page.keyboard.press("Enter")
    expect(note).to_contain_text("the location of a tool's offset")
    page.keyboard.press("Escape")
    expect(note).not_to_be_visible()
    number.click()
    note.get_by_role("link", name="Glossary").click()
    expect(page.get_by_role("heading", name="Glossary", level=1)).to_be_visible()
    expect(page.locator("#term-tool-memory")).to_be_in_viewport()
