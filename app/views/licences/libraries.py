"""The distributions that are installed and that Inband needs, by their own metadata. Nothing is said about what is not there."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib.metadata import Distribution, PackageNotFoundError, PackagePath, distribution
from pathlib import Path
from typing import Any, NamedTuple

EXTRAS = ("opcua", "heidenhain", "mqtt", "serial", "notify")
"""Of Inband, counted where they are installed; what develops Inband is no part of it."""
LONGEST_NAME = 60
"""Letters: some distributions write the whole text where the name of the licence belongs."""
_TEXT = re.compile(r"(?i)licen[cs]e|copying|notice|copyright")
_NO_TEXT = frozenset({".py", ".pyc", ".pyi", ".js", ".json", ".h", ".so"})
_EXTRA = re.compile(r"""extra\s*==\s*['"]([^'"]+)['"]""")


class Library(NamedTuple):
    """A distribution. name: as registries write it. licence: as its metadata says, empty if they say nothing."""

    name: str
    version: str
    licence: str
    summary: str
    homepage: str
    needs: tuple[str, ...]
    files: tuple[PackagePath, ...]

    @property
    def address(self) -> str:
        """The package URL (purl)."""
        return f"pkg:pypi/{self.name}@{self.version}"

    def texts(self) -> list[tuple[str, str]]:
        """Each file with terms that the distribution carries: its place, and what it says."""
        return [
            (str(path), _read(path)) for path in self.files if _TEXT.search(path.name) and path.suffix not in _NO_TEXT
        ]

    def parts(self) -> list[dict[str, Any]]:
        """Parts of others in its wheel, libraries in C for example, by the bills of material inside it (PEP 770)."""
        bills = (json.loads(_read(path)) for path in self.files if "sboms" in path.parts and path.suffix == ".json")
        found = [each for bill in bills for each in bill.get("components", ())]
        return [each for each in found if plain(each.get("name", "")) != self.name]


@cache
def libraries() -> Mapping[str, Library]:
    """Inband and everything it needs of what is installed, by name."""
    found: dict[str, tuple[Distribution, frozenset[str]]] = {}
    _walk("inband", frozenset(EXTRAS), found)
    return {name: _library(name, *each) for name, each in sorted(found.items())}


def plain(name: str) -> str:
    """The name as registries compare it.

    >>> plain("Typing_Extensions"), plain("ruamel.yaml")
    ('typing-extensions', 'ruamel-yaml')
    """
    return re.sub(r"[-_.]+", "-", name).lower()


def requirements(lines: Iterable[str], extras: frozenset[str]) -> Iterator[tuple[str, frozenset[str]]]:
    """The names of requirements, each with the extras that are asked of it.

    Conditions on the system are passed over: what they keep out is not installed.

    >>> lines = ["psycopg[binary,pool]>=3.3", 'tzdata; sys_platform == "win32"', 'asyncua>=2.1; extra == "opcua"', 'x; extra == "dev"']
    >>> [(name, sorted(extras)) for name, extras in requirements(lines, frozenset({"opcua"}))]
    [('psycopg', ['binary', 'pool']), ('tzdata', []), ('asyncua', [])]
    """
    for line in lines:
        needed, _semicolon, condition = line.partition(";")
        only_for = set(_EXTRA.findall(condition))
        name = re.match(r"[A-Za-z0-9._-]+", needed.strip())
        if name is not None and (not only_for or only_for & extras):
            asked = re.search(r"\[([^][]*)\]", needed)
            yield plain(name[0]), frozenset(each.strip() for each in asked[1].split(",")) if asked else frozenset()


def _walk(name: str, extras: frozenset[str], found: dict[str, tuple[Distribution, frozenset[str]]]) -> None:
    known = found.get(name)
    if known is not None and extras <= known[1]:
        return
    try:
        one = known[0] if known is not None else distribution(name)
    except PackageNotFoundError:
        return
    extras |= known[1] if known is not None else frozenset()
    found[name] = (one, extras)
    for needed, asked in requirements(one.requires or (), extras):
        _walk(needed, asked, found)


def _library(name: str, one: Distribution, extras: frozenset[str]) -> Library:
    about = one.metadata
    addresses = [each.partition(", ")[2] for each in about.get_all("Project-URL") or ()]
    return Library(
        name,
        one.version,
        _licence(one),
        about["Summary"] or "" if "Summary" in about else "",
        about["Home-page"] if "Home-page" in about else next(iter(addresses), ""),
        tuple(sorted({needed for needed, _asked in requirements(one.requires or (), extras)})),
        tuple(one.files or ()),
    )


def _licence(one: Distribution) -> str:
    """The expression (SPDX), else the name, else what the classifiers say."""
    about = one.metadata
    for field in ("License-Expression", "License"):
        said = (about[field] or "").strip() if field in about else ""
        if said and len(said) <= LONGEST_NAME and "\n" not in said:
            return said
    classes = [each.split(" :: ")[-1] for each in about.get_all("Classifier") or () if each.startswith("License :: ")]
    return ", ".join(classes)


def _read(path: PackagePath) -> str:
    try:
        return Path(str(path.locate())).read_bytes().decode(errors="replace")
    except OSError:  # the list of files names one that is not there
        return ""
