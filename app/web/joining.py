"""Joining files at start, so that a page asks for few: the style sheets of every page, and scripts with what they import.

``js/inband.js`` runs on every page and holds all that it imports. Any other script that no script imports statically holds what
it imports, but takes from ``inband.js`` what is there: a page has one connection for live events, no matter who listens. What is
imported is not served by itself.

Modules keep to what is read here: ``import "./x.js"`` and ``import { a, b } from "./x.js"``, each on a line of its own, and
``export`` before ``const``, ``class``, ``function`` and ``async function``. They do not import each other in a circle.
"""

import re
from collections.abc import Mapping

SHEETS = ("tokens", "base", "components", "forms", "charts", "forced", "print")
"""The style sheets of every page, in their order."""
JOINED_SHEET = "css/inband.css"
EVERYWHERE = "js/inband.js"
IMPORT = re.compile(r'^import (?:\{(?P<names>[^}]+)\} from )?"\./(?P<file>[\w-]+\.js)";\n', re.MULTILINE)
EXPORT = re.compile(r"^export (?=(?:const|class|(?:async )?function) (?P<name>\w+))", re.MULTILINE)
OTHER = re.compile(r"^(?:import|export)\b(?!\().*", re.MULTILINE)


def joined(files: Mapping[str, bytes]) -> dict[str, bytes]:
    """The files to serve, by name, made out of those that lie in the folder.

    Raises:
        ValueError: a module imports or exports in a way that is not read here, or what does not exist
    """
    sources = {name: content.decode() for name, content in files.items() if name.startswith("js/")}
    imports = {name: _imported(name, source, sources) for name, source in sources.items()}
    inner = {each for names in imports.values() for each in names}
    everywhere = _in_order(EVERYWHERE, imports)
    scripts = {
        name: _script(_in_order(name, imports), [] if name == EVERYWHERE else everywhere, sources)
        for name in sources
        if name not in inner
    }
    sheet = b"\n".join(files[f"css/{each}.css"] for each in SHEETS)
    return {name: content for name, content in files.items() if name not in sources} | scripts | {JOINED_SHEET: sheet}


def _imported(name: str, source: str, sources: Mapping[str, str]) -> list[str]:
    imported = [f"js/{found['file']}" for found in IMPORT.finditer(source)]
    if missing := [each for each in imported if each not in sources]:
        raise ValueError(f"{name} imports {missing[0]}, which does not exist")
    if other := OTHER.search(EXPORT.sub("", IMPORT.sub("", source))):
        raise ValueError(f"{name}: {other[0]!r} is not read at start; app/web/joining.py says what is")
    return imported


def _in_order(name: str, imports: Mapping[str, list[str]]) -> list[str]:
    """A module behind all that it needs, in the order in which a browser runs them."""
    ordered: dict[str, None] = {}
    for each in imports[name]:
        ordered |= dict.fromkeys(_in_order(each, imports))
    return [*ordered, name]


def _variable(name: str) -> str:
    """The name of a module in the joined script."""
    return "$" + name.removeprefix("js/").removesuffix(".js").replace("-", "_")


def _script(parts: list[str], elsewhere: list[str], sources: Mapping[str, str]) -> bytes:
    own = [each for each in parts if each not in elsewhere]
    taken = ", ".join(_variable(each) for each in parts if each in elsewhere)
    given = "" if elsewhere else f"export {{ {', '.join(map(_variable, own))} }};\n"
    head = f'import {{ {taken} }} from "./{EVERYWHERE.removeprefix("js/")}";\n' if taken else ""
    return (head + "".join(_closed(each, sources[each]) for each in own) + given).encode()


def _closed(name: str, source: str) -> str:
    """A module as a function that runs once, with names of its own, and returns what it exports."""

    def take(found: re.Match[str]) -> str:
        names = found["names"]
        return f"const {{{names}}} = {_variable('js/' + found['file'])};\n" if names else ""

    exported = ", ".join(found["name"] for found in EXPORT.finditer(source))
    body = EXPORT.sub("", IMPORT.sub(take, source))
    return f"const {_variable(name)} = (() => {{\n{body}return {{ {exported} }};\n}})();\n"
