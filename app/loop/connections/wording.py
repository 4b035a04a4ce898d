"""Connections in words: what state a bridge is in, and which of its numbers need a person."""

from datetime import timedelta

from app.language.i18n import _
from app.loop.connections.queries import ConnectionRow
from app.web.states import State, show

SILENT = "connection_silent"
CLOCK_LIMIT = 2.0
"""Seconds by which a control's clock may be off."""

show(
    State("connection_online", lambda: _("Online"), "steady", "applied"),
    State("connection_starting", lambda: _("Starting"), "waiting", "waiting"),
    State("connection_control_away", lambda: _("Control does not answer"), "attention", "no_data"),
    State("connection_wrong_machine", lambda: _("Wrong machine"), "stop", "rejected"),
    State("connection_counters_lost", lambda: _("Counters lost"), "stop", "alarm"),
    State("connection_full", lambda: _("Store is full"), "attention", "alarm"),
    State("connection_held", lambda: _("On hold"), "waiting", "held"),
    State("connection_configuration", lambda: _("Configuration wrong"), "stop", "alarm"),
    State(SILENT, lambda: _("Silent"), "attention", "old"),
)


def state(row: ConnectionRow, silent_after: timedelta) -> str:
    """The name of the state as pages show it: a bridge that is not heard is silent, whatever it said last."""
    return SILENT if row.silent(silent_after) else f"connection_{row.connection.state}"


def explained(name: str) -> str:
    """One sentence about a state of that name."""
    return {
        "connection_online": _("The control answers."),
        "connection_starting": _("The bridge has started; nothing is known of the control yet."),
        "connection_control_away": _("The control does not answer the bridge."),
        "connection_wrong_machine": _("Another machine answers at the address: nothing is read nor written."),
        "connection_counters_lost": _("The counters at the control began again: it has to be checked."),
        "connection_full": _("The store of the bridge is full: readings wait in the control."),
        "connection_held": _("The bridge is on hold: no correction reaches the control."),
        "connection_configuration": _("The bridge cannot work as it is set up."),
        SILENT: _("The bridge is not heard. Readings stay in the bridge or the control."),
    }.get(name, "")


def clock_is_off(offset: float | None) -> bool:
    """Tell if the control's clock is too far off for times of readings to be trusted; offset: s."""
    return offset is not None and abs(offset) > CLOCK_LIMIT


def clock(offset: float | None) -> str:
    """The offset of the control's clock: `+0.8 s`; a day and more in days."""
    if offset is None:
        return "–"
    if abs(offset) >= 86_400:
        return _("{n} days").format(n=f"{offset / 86_400:+.1f}".replace("-", "−"))
    return f"{offset:+.1f} s".replace("-", "−")


def touch_test(machine: str, tool_memory: int) -> str:
    """The command by which a touch test proves the mapping of a location."""
    return f"inband bridge touch-test --config plant.toml {machine} {tool_memory}"
