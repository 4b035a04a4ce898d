"""Tables whose rows are cards on a phone: each cell says the name of its column, with scripts and without (components.css)."""

import re
from collections.abc import Iterator, Sequence

from markupsafe import Markup, escape

_TAG = re.compile(r"""<(/?)(table|tr|td|th)\b((?:[^<>"']|"[^"]*"|'[^']*')*)>""")
_WIDE = re.compile(r'\bcolspan="(\d+)"')
_WORDLESS = re.compile(r"<(?!svg|img|input|select|button|textarea|plotly)[^<>]*>")

Head = str | tuple[str | None, ...] | None


def labelled(rows: str, heads: Sequence[Head]) -> Markup:
    """The rows of a table with the name of its column in each cell: none in an empty one, its own where it has one.

    heads: as of `ui.table` of components.html.

    >>> labelled('<tr><td class="num">7</td><td> </td></tr>', [("Parts", "num"), "Why"])
    Markup('<tr><td class="num" data-label="Parts">7</td><td> </td></tr>')
    """
    names = [head if isinstance(head, str) else head[0] for head in heads if head is not None]
    return Markup("".join(_pieces(rows, names)))  # noqa: S704 - what was rendered, and names that are escaped


def _pieces(rows: str, names: Sequence[str | None]) -> Iterator[str]:
    done = column = inner = 0
    for tag in _TAG.finditer(rows):
        closes, what, attributes = tag.groups()
        if what == "table":
            inner += -1 if closes else 1
        elif inner or closes:
            continue
        elif what == "tr":
            column = 0
        else:
            name = names[column] if column < len(names) else None
            wide = _WIDE.search(attributes)
            column += int(wide.group(1)) if wide else 1
            if name and what == "td" and not wide and "data-label=" not in attributes and _says(rows, tag.end()):
                yield f'{rows[done : tag.end() - 1]} data-label="{escape(name)}">'
                done = tag.end()
    yield rows[done:]


def _says(rows: str, start: int) -> bool:
    return bool(_WORDLESS.sub("", rows[start : rows.find("</td>", start)]).strip())
