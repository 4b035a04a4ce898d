"""States that pages show as a badge: zones, alarm kinds, statuses of corrections; each with its word, tone and icon.

A tone is how urgent a state is (`URGENCY`); an icon is one of `icons.html`. Never
colour alone: shape, word and colour together. A room adds the states that it owns with `show`.
"""

from collections.abc import Callable
from dataclasses import dataclass

from app.language.i18n import _

URGENCY = ("stop", "wear", "attention", "waiting", "steady")
"""Tones, the most urgent first."""


@dataclass(frozen=True, slots=True)
class State:
    """One state as pages show it."""

    name: str
    word: Callable[[], str]
    tone: str = "steady"
    icon: str = ""


_STATES: dict[str, State] = {}


def show(*states: State) -> None:
    """Make these states known to pages; the last of a name counts."""
    _STATES.update({state.name: state for state in states})


def state_of(name: str) -> State:
    """Return how this state is shown; an unknown one by its name."""
    return _STATES.get(name) or State(name, lambda: name)


def word_of(name: str) -> str:
    """Return the word of a state in the reader's language."""
    return state_of(name).word()


def tone_of(name: str) -> str:
    """Return how urgent a state is."""
    return state_of(name).tone


def icon_of(name: str) -> str:
    """Return the icon of a state; by default the one of its name."""
    return state_of(name).icon or name


# Zones. An alarm kind of the same name looks the same.
show(
    State("zero", lambda: _("Zero")),
    State("average", lambda: _("Averaging")),
    State("full", lambda: _("Full")),
    State("oversize", lambda: _("Oversize"), "attention"),
    State("undersize", lambda: _("Undersize"), "attention"),
    State("wear", lambda: _("Tool worn"), "wear"),
    State("probe_fault", lambda: _("Probe fault"), "stop"),
    State("paused", lambda: _("Paused"), "stop"),
    State("correcting", lambda: "correcting", "waiting"),
)
# Statuses of corrections.
show(
    State("held", lambda: _("Held"), "wear"),
    State("awaiting_approval", lambda: _("Awaiting approval"), "waiting", "waiting"),
    State("pending", lambda: _("Pending"), "waiting", "waiting"),
    State("applied", lambda: _("Applied")),
    State("rejected", lambda: _("Rejected")),
    State("superseded", lambda: _("Superseded")),
)
