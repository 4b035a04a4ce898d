"""Every regular expression of the program takes time in proportion to its text, whatever the text is: nobody else runs meanwhile.

Tried with texts that are made of the signs of the expression itself, repeated behind one of its beginnings, and with a sign at the
end that fits nowhere. What is compared is the time for four times the text, where a text takes any time at all.
"""

import ast
import importlib
import pkgutil
import re
import time
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from re import _constants as codes  # type: ignore[attr-defined]
from re import _parser as parser  # type: ignore[attr-defined]
from typing import Any, NamedTuple

import pytest

import app
from app import HOUSE

ROOM = HOUSE / "app"
NOT_OURS = ("app.simulators.controls", "app.cli", "app.client")
"""Read what we have written ourselves, or what is typed at the server's own command line."""
WAYS = {
    "search": "search",
    "sub": "search",
    "subn": "search",
    "findall": "search",
    "finditer": "search",
    "split": "search",
}
ANY = {"match", "fullmatch", "search"}
LENGTHS = (15, 60, 250, 1_000, 4_000)  # characters
SLOW = 0.01  # s of a processor, a hundred times what is usual for the longest: looked at more closely
PROPORTION = 7.0  # times as long for four times the text; 16 is a square
BOUNDED = {
    r"access.passwords ^(.{3,}?)\1+$": "a password is short",
    r"db.binaries (\d+)\.(\d+)": "what PostgreSQL's own programs say",
}
IN_SHORT_LINES = "core.programs."
"""Lines of program texts have a thousand characters and single blanks: tests/core/programs/test_long_lines.py reads such."""


class Expression(NamedTuple):
    """A regular expression, where it stands, and the ways in which it is used."""

    name: str
    pattern: re.Pattern[Any]
    ways: frozenset[str]


def modules() -> Iterator[str]:
    for found in pkgutil.walk_packages(app.__path__, "app."):
        if not found.name.startswith(NOT_OURS):
            yield found.name


def compiled(value: Any, depth: int = 0) -> Iterator[re.Pattern[Any]]:
    """The expressions in a value of a module: itself, in its collections, in the fields of our own objects."""
    if isinstance(value, re.Pattern):
        yield value
    elif depth < 4:
        if isinstance(value, dict):
            value = list(value.values())
        elif type(value).__module__.startswith("app.") and hasattr(value, "__dict__"):
            value = list(vars(value).values())
        if isinstance(value, list | tuple | set | frozenset):
            for each in value:
                yield from compiled(each, depth + 1)


@cache
def expressions() -> dict[str, Expression]:
    """By name. Not for parameters: to read the whole program takes some seconds, and each worker collects all tests."""
    sources = {path: path.read_text() for path in ROOM.rglob("*.py")}
    used: defaultdict[tuple[str, str], set[str]] = defaultdict(set)
    for path, source in sources.items():
        module = ".".join(path.relative_to(HOUSE).with_suffix("").parts)
        for name, way in re.findall(r"\b(\w+)\.(match|fullmatch|search|subn?|findall|finditer|split)\b", source):
            used[module, name].add(WAYS.get(way, way))
        for way, name in re.findall(r"\bre\.(subn?|search|match|fullmatch|findall|split)\((\w+)\b", source):
            used[module, name].add(WAYS.get(way, way))
    found: dict[str, Expression] = {}
    for name in modules():
        for label, value in vars(importlib.import_module(name)).items():
            for number, pattern in enumerate(compiled(value)):
                ways = used[name, label] if isinstance(value, re.Pattern) else set()
                at = f"{name.removeprefix('app.')}.{label}" + (f"[{number}]" if number else "")
                found.setdefault(
                    repr((pattern.pattern, pattern.flags)), Expression(at, pattern, frozenset(ways or ANY))
                )
    for path, source in sources.items():
        module = ".".join(path.relative_to(HOUSE).with_suffix("").parts)
        if module.startswith(NOT_OURS):
            continue
        for call in ast.walk(ast.parse(source)):
            match call:
                case ast.Call(
                    func=ast.Attribute(value=ast.Name(id="re"), attr=way), args=[ast.Constant(value=text), *_]
                ):
                    flags = [ast.unparse(each.value) for each in call.keywords if each.arg == "flags"] or [
                        ast.unparse(each)
                        for each in call.args[1:]
                        if re.fullmatch(r"re\.[A-Z]+( \| re\.[A-Z]+)*", ast.unparse(each))
                    ]
                    pattern = re.compile(text, eval(flags[0]) if flags else 0)  # noqa: S307 - of our own source
                    ways = {WAYS.get(way, way)} if way != "compile" else ANY
                    at = (
                        f"{module.removeprefix('app.')} {text!r}"
                        if isinstance(text, bytes)
                        else f"{module.removeprefix('app.')} {text}"
                    )
                    found.setdefault(repr((pattern.pattern, pattern.flags)), Expression(at, pattern, frozenset(ways)))
    return {each.name: each for each in found.values()}


SIGNS = {codes.CATEGORY_DIGIT: "1", codes.CATEGORY_SPACE: " ", codes.CATEGORY_WORD: "a_"}


def of_set(items: Any) -> str:
    signs = ""
    for code, value in items:
        if code is codes.LITERAL:
            signs += chr(value)
        elif code is codes.RANGE:
            signs += chr(value[0])
        elif code is codes.CATEGORY:
            signs += SIGNS.get(value, "a;")
        else:
            signs += "a"
    return signs


def inner(code: Any, value: Any) -> list[Any]:
    """The parts of a part of an expression."""
    if code in (codes.MAX_REPEAT, codes.MIN_REPEAT, codes.POSSESSIVE_REPEAT):
        return [value[2]]
    if code is codes.SUBPATTERN:
        return [value[3]]
    if code is codes.BRANCH:
        return list(value[1])
    if code in (codes.ASSERT, codes.ASSERT_NOT):
        return [value[1]]
    return [value] if code is codes.ATOMIC_GROUP else []


def signs_of(parts: Any) -> Iterator[str]:
    """Signs that the expression takes somewhere."""
    for code, value in parts:
        if code is codes.LITERAL:
            yield chr(value)
        elif code is codes.IN:
            yield from of_set(value)
        elif code in (codes.ANY, codes.NOT_LITERAL):
            yield "a"
        for each in inner(code, value):
            yield from signs_of(each)


def text_of(parts: Any) -> str:
    """A text that begins as the expression does."""
    text = ""
    for code, value in parts:
        if code is codes.LITERAL:
            text += chr(value)
        elif code is codes.IN:
            text += of_set(value)[:1]
        elif code in (codes.ANY, codes.NOT_LITERAL):
            text += "a"
        elif code not in (codes.ASSERT, codes.ASSERT_NOT):
            times = max(1, min(value[0], 5)) if "REPEAT" in str(code) else 1
            text += "".join(text_of(each) for each in inner(code, value)[:1]) * times
    return text


def texts(pattern: re.Pattern[Any]) -> Iterator[tuple[str, str]]:
    """Beginnings, and what is repeated behind them."""
    parsed = parser.parse(
        pattern.pattern, pattern.flags & ~re.UNICODE if isinstance(pattern.pattern, bytes) else pattern.flags
    )
    signs, whole = sorted(set(signs_of(parsed))), text_of(parsed)
    few = signs[:: max(1, len(signs) // 8)]
    repeated = dict.fromkeys([*signs[:40], *(a + b for a in few for b in few if a != b), *([whole] if whole else [])])
    beginnings = dict.fromkeys(whole[:length] for length in (0, 1, 2, 3, 5, 8, 13, len(whole)))
    for each in repeated:
        yield "", each
    for beginning in beginnings:
        for each in (" ", "\t", "1", "a", "(", *(sign for sign in few)):
            yield beginning, each


def seconds(pattern: re.Pattern[Any], way: str, beginning: str, repeated: str, length: int) -> float:
    text: Any = beginning + repeated * (length // len(repeated)) + "\x00"
    if isinstance(pattern.pattern, bytes):
        text = text.encode("latin-1", "replace")
    begun = time.thread_time()
    getattr(pattern, way)(text)
    return time.thread_time() - begun


def out_of_proportion(pattern: re.Pattern[Any], way: str, beginning: str, repeated: str, length: int) -> bool:
    """Tell if a text takes too long for its length each time: once is chance, on a busy computer."""
    for _time in range(5):
        short, long = (
            min(seconds(pattern, way, beginning, repeated, each) for _again in range(3))
            for each in (length // 4, length)
        )
        if long < PROPORTION * short:
            return False
    return True


def slow(expression: Expression) -> tuple[str, str, str] | None:
    """The way, beginning and repeated signs for which it takes more than in proportion."""
    for beginning, repeated in texts(expression.pattern):
        for way in expression.ways:
            given = expression.pattern, way, beginning, repeated
            for length in LENGTHS[1:]:
                if seconds(*given, length) > SLOW:
                    if out_of_proportion(*given, length):
                        return way, beginning, repeated
                    break
    return None


ROOMS = sorted(each.name for each in pkgutil.iter_modules([str(ROOM)]))


def room_of(name: str) -> str:
    return name.replace(" ", ".").partition(".")[0]


def test_all_are_found() -> None:
    found = expressions()
    assert len(found) > 200
    assert {"core.programs.fanuc._MACRO", "web.json_bodies._TEXT", "bridge.kinds.text.FILLING"} <= set(found)
    assert set(BOUNDED) <= set(found)
    assert {room_of(name) for name in found} <= set(ROOMS)


@pytest.mark.parametrize("room", ROOMS)
def test_time_in_proportion_to_the_text(room: str) -> None:
    tried = {
        name: each
        for name, each in expressions().items()
        if room_of(name) == room and name not in BOUNDED and not name.startswith(IN_SHORT_LINES)
    }
    assert not {name: how for name, each in tried.items() if (how := slow(each))}
