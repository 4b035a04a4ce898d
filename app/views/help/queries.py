"""The documents of `docs/`: rendered once when a person opens one, with links that lead to pages of the program; their sections.

Raw HTML in them is shown as it is written; a document that is not there when the program starts is no page.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from posixpath import dirname, join, normpath
from typing import NamedTuple

from markdown_it import MarkdownIt
from markdown_it.token import Token
from markupsafe import Markup

from app.web.terms import DOCS, PAGE, anchor_of, plain, slug

HELP = "/help"
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_PICTURES = {".png": "image/png", ".svg": "image/svg+xml"}
PLAIN = "text/plain; charset=utf-8"


class Section(NamedTuple):
    """A heading of a document, the document's own included: title, address, and the Markdown below it."""

    title: str
    path: str
    words: str


class Document(NamedTuple):
    """A page of help. name: its place below `docs/` without ending; contents: the headings below its title, with addresses."""

    name: str
    title: str
    body: Markup
    contents: Sequence[tuple[str, str]]

    @property
    def path(self) -> str:
        """The page in the program."""
        return f"{HELP}/{self.name}"


@cache
def documents() -> Mapping[str, str]:
    """The title of every document by its name, in the order of their names."""
    found = {}
    for path in sorted(DOCS.rglob("*.md")):
        heading = path.read_text(encoding="utf-8").split("\n", 1)[0]
        found[path.relative_to(DOCS).with_suffix("").as_posix()] = plain(heading.removeprefix("# "))
    return found


@cache
def files() -> Mapping[str, str]:
    """Pictures and files that documents show or hand out: the place below `docs/`, and the media type."""
    found = (path for path in DOCS.rglob("*") if path.suffix in {*_PICTURES, ".yml"})
    return {path.relative_to(DOCS).as_posix(): _PICTURES.get(path.suffix, PLAIN) for path in found}


@cache
def document(name: str) -> Document:
    """A document by its name, rendered. Raises `KeyError` for one that is not there."""
    title = documents()[name]
    text = _COMMENT.sub("", (DOCS / f"{name}.md").read_text(encoding="utf-8"))
    reader = MarkdownIt("commonmark", {"html": False}).enable(["table", "strikethrough"])
    tokens = reader.parse(text)[3:]  # without the title
    path = f"{HELP}/{name}"
    contents = []
    for at, token in enumerate(tokens):
        if token.type == "heading_open":
            token.attrs["id"] = slug(tokens[at + 1].content)
            if token.tag == "h2":
                contents.append((plain(tokens[at + 1].content), f"{path}#{token.attrs['id']}"))
        elif token.type == "tr_open" and path == PAGE and tokens[at + 1].type == "td_open":
            token.attrs["id"] = anchor_of(tokens[at + 2].content)
        _lead(token, name)
    tables = {"table_open": '<div class="table-wrap"><table class="table">\n', "table_close": "</table></div>\n"}
    for kind, html in tables.items():
        reader.add_render_rule(kind, lambda *_all, html=html: html)
    body = Markup(reader.renderer.render(tokens, reader.options, {}))  # noqa: S704 - its HTML is escaped by the renderer
    return Document(name, title, body, contents)


def _lead(token: Token, name: str) -> None:
    """Have the links and pictures of a token lead into the program; a link to what is not in it becomes plain words."""
    kept: list[Token] = []
    outside = False  # within a link that leads out of the program
    for child in token.children or ():
        attribute = {"link_open": "href", "image": "src"}.get(child.type)
        address = _address(str(child.attrs[attribute]), name) if attribute else None
        if attribute and address is not None:
            child.attrs[attribute] = address
        if child.type == "link_open":
            outside = address is None
        elif child.type == "link_close" and outside:
            outside = False
            continue
        if attribute is None or address is not None:
            kept.append(child)
    token.children = kept


def _address(target: str, name: str) -> str | None:
    """Address in the program of a link's target in this document; None where that is not in the program."""
    if "://" in target or target.startswith(("mailto:", "#")):
        return target
    place, mark, heading = target.partition("#")
    place = normpath(join(dirname(name), place))
    if place.removesuffix(".md") in documents():
        return f"{HELP}/{place.removesuffix('.md')}{mark}{heading}"
    return f"{HELP}/{place}" if place in files() else None


@cache
def sections() -> Sequence[Section]:
    """The sections of how-tos and reference, each from a heading to the next: search looks through them."""
    found: list[Section] = []
    for name, title in documents().items():
        if name.startswith("decisions/"):
            continue
        here, path, words, in_code = title, f"{HELP}/{name}", list[str](), False
        for line in _COMMENT.sub("", (DOCS / f"{name}.md").read_text(encoding="utf-8")).split("\n")[1:]:
            in_code ^= line.startswith("```")
            if line.startswith("#") and not in_code:
                found.append(Section(here, path, "\n".join(words)))
                heading = line.lstrip("# ")
                here, path, words = f"{title}: {plain(heading)}", f"{HELP}/{name}#{slug(heading)}", []
            else:
                words.append(line)
        found.append(Section(here, path, "\n".join(words)))
    return found
