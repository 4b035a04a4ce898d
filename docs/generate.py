"""Writes the parts of the documents that are made from the program: `python -m docs.generate`. A test tells when that is due.

A part stands between the lines `<!-- generated: NAME -->` and `<!-- end -->`; what lies between them is replaced.
"""

import re
from collections.abc import Callable, Iterable, Iterator
from importlib import import_module
from itertools import zip_longest
from pathlib import Path
from typing import Any, get_args

from app import HOUSE
from app.core.parameters import FIELDS, Field, FieldKind
from app.core.spc.rules import RULES
from app.errors import InbandError
from app.loop.characteristics import wording
from app.loop.summaries import wording as words
from app.settings import Settings, variable_of

PART = re.compile(r"(<!-- generated: ([a-z-]+) -->\n).*?(<!-- end -->)", re.DOTALL)


def documents() -> list[Path]:
    """Every Markdown file of the project."""
    names = ("README.md", "CONTRIBUTING.md", "SECURITY.md", "CHANGELOG.md")
    return [*(HOUSE / name for name in names), *sorted((HOUSE / "docs").rglob("*.md"))]


def renewed(text: str) -> str:
    """The text with every generated part as it should be. Raises `KeyError` for a part that nobody makes."""
    return PART.sub(lambda found: f"{found[1]}\n{PARTS[found[2]]()}\n\n{found[3]}", text)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = list(head)
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


# --- the command line


def commands() -> Iterator[tuple[str, Any]]:
    """Every command with its whole name, as typer has it, in the order of the names: modules are imported in any."""
    from typer.main import get_command

    from app.cli import PARTS as COMMANDS
    from app.cli.base import cli

    for module in COMMANDS:
        import_module(module)

    def walk(group: Any, words: list[str]) -> Iterator[tuple[str, Any]]:
        for name, command in sorted(group.commands.items()):
            if hasattr(command, "commands"):
                if command.invoke_without_command:
                    yield " ".join([*words, name]), command
                yield from walk(command, [*words, name])
            else:
                yield " ".join([*words, name]), command

    yield from walk(get_command(cli), ["inband"])


def _sentence(command: Any) -> str:
    return " ".join(str(command.help or "").split("\n\n")[0].split())


def _command_list() -> str:
    return _table(("command", "what it does"), ((f"`{name}`", _sentence(command)) for name, command in commands()))


def _option(option: Any) -> tuple[str, str, str, str]:
    name = ", ".join(f"`{each}`" for each in option.opts)
    if option.name == option.opts[0]:
        name = f"`{option.name.upper()}`"
    if option.required:
        default = "required"
    elif isinstance(option.show_default, str):
        default = option.show_default
    else:
        default = "" if option.default in {None, "", False} else f"`{option.default}`"
    return name, f"`{option.envvar}`" if option.envvar else "", " ".join((option.help or "").split()), default


def _command_reference() -> str:
    parts = []
    for name, command in commands():
        options = [_option(option) for option in command.params if option.name != "help"]
        parts.append(f"## `{name}`\n\n{_sentence(command)}")
        if options:
            parts.append(_table(("option", "variable", "meaning", "default"), options))
    return "\n\n".join(parts)


# --- settings


def _default(name: str, field: Any) -> str:
    if name == "data_dir":
        return "`~/.local/share/inband`"
    if name == "timezone":
        return "the computer's"
    if field.default is None:
        return ""
    return f"`{str(field.default).lower() if isinstance(field.default, bool) else field.default}`"


def _settings() -> str:
    return _table(
        ("variable", "default", "meaning"),
        (
            (f"`{variable_of(name)}`", _default(name, field), field.description or "")
            for name, field in Settings.model_fields.items()
        ),
    )


# --- parameters


def _number(value: float | None) -> str:
    if value is None:
        return ""
    return f"{value:,g}".replace(",", " ") if value == 0 or abs(value) >= 1e-4 else f"{value:.9f}".rstrip("0")


def _values(field: Field) -> str:
    if field.kind is FieldKind.CHOICE:
        codes = zip_longest(field.choices, field.codes)
        return ", ".join(f"`{choice}`" + ("" if code is None else f" = {code}") for choice, code in codes)
    if field.kind is FieldKind.YES_NO:
        return "`true`, `false`"
    unit = {FieldKind.LENGTH: "mm", FieldKind.WHOLE: "whole number"}.get(field.kind, "number")
    if field.lowest is not None and field.highest is not None:
        return f"{unit}, {_number(field.lowest)} to {_number(field.highest)}"
    return f"{unit}, from {_number(field.lowest)}" if field.lowest is not None else unit


def _parameters() -> str:
    def row(field: Field) -> tuple[str, ...]:
        low, high = field.source_range or (None, None)
        usual = "" if low is None else f"{_number(low)} to {_number(high)}"
        must = "required" if field.required else "" if field.default is None else f"`{str(field.default).lower()}`"
        if field.name == "axis":
            must = f"`{field.default}`"
        meaning = ". ".join(
            part.rstrip(".") for part in (wording.label(field.name), wording.explanation(field.name)) if part
        )
        return field.r or "", f"`{field.name}`", f"{meaning}.", _values(field), usual, must

    rows = [row(field) for field in FIELDS]
    accept = "Acceptance: n of m sections must lie inside the tolerance."
    rows.append(("", "`accept`", accept, '`{"n": 2, "m": 3}`', "", '`{"n": 1, "m": 1}`'))
    return _table(("R", "name", "meaning", "value", "usual", "default"), rows)


# --- run rules


def _rules() -> str:
    rows = (
        (words.rule_name(name), f"{words.rule(rule)} {words.hint(name)}", "Nelson 1984; Western Electric 1956")
        for name, rule in RULES.items()
    )
    return _table(("term", "meaning", "source"), rows)


# --- errors


def _kinds(base: type[InbandError]) -> Iterator[type[InbandError]]:
    for kind in base.__subclasses__():
        if kind.__module__ == "app.errors":
            yield kind
            yield from _kinds(kind)


def _errors() -> str:
    rows = (
        (str(kind.status), f"`urn:inband:problem:{kind.kind}`", kind.title, " ".join((kind.__doc__ or "").split()))
        for kind in sorted(_kinds(InbandError), key=lambda each: each.status)
    )
    return _table(("status", "`type`", "title", "meaning"), rows)


# --- words that the program tells apart


def vocabulary() -> dict[str, tuple[str, ...]]:
    """Words that must be explained in the reference: what they are, and the words."""
    from app.access.callers import Role
    from app.core.decision.limits import Zone
    from app.core.decision.step import Action, Code
    from app.loop.alarms.kinds import ACTIONS, kinds
    from app.loop.tools.schemas import Status

    return {
        "zones": tuple(Zone),
        "actions": tuple(Action),
        "codes": tuple(Code),
        "alarm kinds": tuple(kind.name for kind in kinds()),
        "acknowledgements": ACTIONS,
        "statuses": get_args(Status),
        "roles": get_args(Role),
        "metrics": _metrics(),
    }


def _metrics() -> tuple[str, ...]:
    source = (HOUSE / "app" / "web" / "health.py").read_text()
    return tuple(dict.fromkeys(re.findall(r'MetricFamily\(\s*"(\w+)"', source)))


PARTS: dict[str, Callable[[], str]] = {
    "commands": _command_list,
    "command-reference": _command_reference,
    "settings": _settings,
    "parameters": _parameters,
    "errors": _errors,
    "rules": _rules,
}


def main() -> None:
    """Bring every document up to date."""
    for path in documents():
        text = path.read_text(encoding="utf-8")
        if renewed(text) != text:
            path.write_text(renewed(text), encoding="utf-8")


if __name__ == "__main__":
    main()
