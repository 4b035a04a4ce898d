"""Every sentence that people read can be translated: none stands in a template by itself, and all can be extracted."""

import re
import subprocess
import sys
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

import pytest
from jinja2 import Environment, nodes

from app import HOUSE
from app.web.templates import TEMPLATE_DIR, environment

TEMPLATES = sorted(path.relative_to(TEMPLATE_DIR).as_posix() for path in TEMPLATE_DIR.rglob("*.html"))
READ_ATTRIBUTES = {"alt", "aria-label", "placeholder", "title"}
WORD = re.compile(r"[^\W\d_]{3,}")
# Symbols of the standards too: they are the same in every language.
NAMES = {"Inband", "curl", "Cpk", "Cpm", "Pmk", "Ppk", "ndc", "ppm"}
UNREAD = {"script", "style", "code", "kbd", "svg", "template"}
TRANSLATING = {"_", "gettext", "ngettext", "pgettext", "npgettext"}
HOLE = "\N{OBJECT REPLACEMENT CHARACTER}"  # where the template puts a value


class Text(HTMLParser):
    """The words that stand in the HTML itself: between the tags, and in attributes that are read to people."""

    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []
        self._unread = 0

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._unread += tag in UNREAD
        self.found += [value for name, value in attrs if name in READ_ATTRIBUTES and value]

    def handle_endtag(self, tag: str) -> None:
        self._unread -= tag in UNREAD

    def handle_data(self, data: str) -> None:
        if not self._unread:
            self.found.append(data)


def html_of(template: nodes.Node) -> str:
    """The HTML that stands in a template, with a hole for each value."""
    classes = {
        id(output) for block in template.find_all(nodes.Block) if block.name == "body_class" for output in block.body
    }
    return "".join(
        node.data if isinstance(node, nodes.TemplateData) else HOLE
        for output in template.find_all(nodes.Output)
        if id(output) not in classes
        for node in output.nodes
    )


def sentences(node: nodes.Node) -> Iterator[str]:
    """Texts in expressions that begin like a sentence and are not handed to gettext."""
    for child in node.iter_child_nodes():
        if isinstance(child, nodes.Call) and isinstance(child.node, nodes.Name) and child.node.name in TRANSLATING:
            continue
        if isinstance(child, nodes.Const) and isinstance(child.value, str) and re.match(r"[A-Z][a-z]+\b", child.value):
            yield child.value
        yield from sentences(child)


def untranslated(env: Environment, source: str) -> list[str]:
    template = env.parse(source)
    parser = Text()
    parser.feed(html_of(template))
    parser.close()
    words = [text.replace(HOLE, "…").strip() for text in (*parser.found, *sentences(template))]
    attributes = re.compile(r'(\S+="[^"]*"\s*)+')  # a macro that writes nothing but some
    written = [text for text in words if not text.startswith("curl ")]  # a command is no sentence
    return [text for text in written if set(WORD.findall(text)) - NAMES and not attributes.fullmatch(text)]


@pytest.mark.parametrize("name", TEMPLATES)
def test_no_words_stand_in_a_template_by_themselves(name: str) -> None:
    assert untranslated(environment(), (TEMPLATE_DIR / name).read_text()) == []


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("<p>{{ _('All is well') }}</p>", []),
        ("<p>All is well</p>", ["All is well"]),
        ("<p>{% trans %}All is well{% endtrans %}</p>", []),
        ("<a title='Go further' class='some words'>{{ x }}</a>", ["Go further"]),
        ("{{ ui.button('Save', 'primary big') }}", ["Save"]),
        ("{{ ui.button(_('Save')) }}{{ ngettext('One', 'Many', n) }}", []),
        ("<p>{{ x }} of {{ y }} parts</p>", ["… of … parts"]),
        ("<p>R33 = {{ x }} µm, Inband</p><code>select</code>{# a remark #}", []),
    ],
)
def test_what_counts_as_words(source: str, found: list[str]) -> None:
    assert untranslated(environment(), source) == found


def test_messages_are_extracted_from_code_and_templates(tmp_path: Path) -> None:
    catalog = tmp_path / "inband.pot"
    command = [
        sys.executable,
        "-m",
        "babel.messages.frontend",
        "-q",
        "extract",
        "-F",
        "pyproject.toml",
        "-o",
        str(catalog),
        ".",
    ]
    done = subprocess.run(command, cwd=HOUSE, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    text = catalog.read_text()
    assert 'msgid "Skip to content"' in text  # base.html
    assert 'msgid "averaging is stored (zero compensation)"' in text  # the zone chart
    assert "msgid_plural" in text
    assert " tests/" not in text  # each place stands behind a blank; app/…/touch_tests/ is one
