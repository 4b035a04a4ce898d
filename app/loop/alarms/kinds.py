"""Alarm kinds: the registry that each room fills with the kinds that it raises.

A kind is written once, in the `alarm_kinds.py` of the room that raises it, and raised by its name:

    HUNTING = register(AlarmKind("hunting", word=lambda: _("Hunting"), sentence=..., what_to_do=...))
    alarms.raise_for_characteristic(session, ..., HUNTING.name, data)

Texts are functions, because each reader's language is known only when an alarm is shown.
"""

import pkgutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from types import MappingProxyType
from typing import Any, Literal, get_args

import app
from app.language.i18n import _
from app.loop.tables.alarms import Alarm
from app.web.states import State, show

Action = Literal[
    "tool_replaced", "keep_cutting", "false_reading", "sister_tool", "offset_set", "measured_by_hand", "noted"
]
ACTIONS: tuple[Action, ...] = get_args(Action)
Text = Callable[[], str]
Texts = Callable[[], Sequence[str]]
NONE: Mapping[Any, Any] = MappingProxyType({})


def _nothing(_alarm: Alarm) -> Sequence[Action]:
    return ()


@dataclass(frozen=True, slots=True)
class AlarmKind:
    """One kind of alarm: its words, its look, and the answers that a person may give.

    ``sentence``: the statement of what is wrong, worded from the values of the alarm. ``tone`` and ``icon``: as in
    `app.web.states`. ``actions``: the answers that make sense, the likeliest first; ``more_actions``: those that depend on
    the alarm. ``comments``: comments to choose from with one touch, by action, where they differ from the usual ones.
    ``outcomes``: sentences of what followed, by code.
    ``concerns_parts``: parts cut before may be bad. ``chart``: the address of the chart about it, of a characteristic's key and the alarm's values.
    """

    name: str
    word: Text
    sentence: Callable[[Alarm], str]
    what_to_do: Text
    tone: str = "attention"
    icon: str = "alarm"
    actions: Sequence[Action] = ("noted",)
    more_actions: Callable[[Alarm], Sequence[Action]] = _nothing
    comments: Mapping[str, Texts] = field(default_factory=lambda: NONE)
    outcomes: Mapping[str, Callable[[Mapping[str, Any]], str]] = field(default_factory=lambda: NONE)
    concerns_parts: bool = False
    chart: Callable[[str, Mapping[str, Any]], str] | None = None


_KINDS: dict[str, AlarmKind] = {}


def register(kind: AlarmKind) -> AlarmKind:
    """Add a kind to the registry. Raises `ValueError` for a name that is taken."""
    if kind.name in _KINDS:
        raise ValueError(f"two alarm kinds are called {kind.name}")
    _KINDS[kind.name] = kind
    show(State(kind.name, kind.word, kind.tone, kind.icon))
    return kind


@cache
def _import_every_room() -> None:
    """Import each room's `alarm_kinds.py`, so that every process words every alarm, whichever rooms it uses itself."""
    for module in pkgutil.walk_packages(app.__path__, "app."):
        if module.name.endswith(".alarm_kinds"):
            import_module(module.name)


def kind_named(name: str) -> AlarmKind:
    """Return the kind of this name; one of a newer version of Inband is shown by its name."""
    _import_every_room()
    return _KINDS.get(name) or AlarmKind(
        name,
        word=lambda: name,
        sentence=lambda alarm: str(alarm.data.get("text") or name),
        what_to_do=lambda: _("Check it and report what it was."),
        actions=("noted", "tool_replaced", "false_reading"),
    )


def kinds() -> Iterator[AlarmKind]:
    """Return every kind that is registered."""
    _import_every_room()
    return iter(tuple(_KINDS.values()))
