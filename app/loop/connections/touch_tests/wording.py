"""Touch tests in words: states, questions, and what a person has to do."""

from app.language.i18n import _
from app.loop.connections.touch_tests.queries import TouchTestRow
from app.loop.tables.touch_tests import TouchTest
from app.web.states import State, show

show(
    State("touch_test_asked", lambda: _("Asked for"), "waiting", "waiting"),
    State("touch_test_read", lambda: _("Compare"), "attention", "waiting"),
    State("touch_test_go", lambda: _("The bridge writes"), "waiting", "waiting"),
    State("touch_test_written", lambda: _("Compare"), "attention", "waiting"),
    State("touch_test_compared", lambda: _("Compare"), "attention", "waiting"),
    State("touch_test_answered", lambda: _("Is taken back"), "waiting", "waiting"),
    State("touch_test_stopping", lambda: _("Is taken back"), "waiting", "waiting"),
    State("touch_test_proved", lambda: _("Proved"), "steady", "applied"),
    State("touch_test_not_proved", lambda: _("Not proved"), "attention", "rejected"),
    State("touch_test_failed", lambda: _("Failed"), "stop", "alarm"),
    State("touch_test_cancelled", lambda: _("Stopped"), "waiting", "rejected"),
)


def explained(state: str) -> str:
    """One sentence about a state, without its full stop."""
    return {
        "asked": _("the bridge hears of it within some seconds, and reads the offset"),
        "read": _("the bridge has read the offset and waits for a person"),
        "go": _("the bridge writes the offset and reads it back"),
        "written": _("the offset is changed, and a person compares"),
        "compared": _("the offset is changed, and a person compares"),
        "answered": _("the bridge takes the offset back"),
        "stopping": _("it was stopped, and the bridge takes the offset back"),
        "proved": _("the mapping is proved"),
        "not_proved": _("the mapping is not proved"),
        "failed": _("it failed"),
        "cancelled": _("it was stopped"),
    }[state]


def awaited(row: TouchTestRow, late: float, *, silent: bool) -> bool:
    """Tell if a bridge that may have changed the offset is waited for in vain; late: s."""
    state = row.test.state
    overdue = state in {"go", "answered", "stopping"} and row.state_age > late
    return overdue or (silent and row.test.ended_at is None and state not in {"asked", "read"})


def how_to_allow(machine: str) -> str:
    """The setting that is missing where a bridge makes no touch tests by the page."""
    return _(
        "Set touch_tests_by_page = true in [machine.{machine}] of the bridge's configuration and restart it, or use the command."
    ).format(machine=machine)


def shown(value: float | None) -> str:
    """A number as the control's screen shows it, without a unit."""
    return "–" if value is None else f"{value:.4f}".replace("-", "−")


def by_hand(test: TouchTest) -> str:
    """The sentence for a person where the bridge cannot take back."""
    return _("Set {value} {unit} in {place} by hand.").format(
        value=shown(test.shown_before), unit=test.unit, place=test.place
    )


def larger(amount: float) -> str:
    """The change as the last question says it."""
    size = f"{abs(amount) * 1000:g} µm"
    return _("{size} larger").format(size=size) if amount > 0 else _("{size} smaller").format(size=size)
