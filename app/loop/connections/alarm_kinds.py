"""Alarm kinds of connections: a bridge is silent or backs up, or the server was unreachable. They end by themselves."""

from collections.abc import Callable, Mapping
from datetime import datetime
from typing import Any

from app.language.formatting import NOTHING, as_read
from app.language.i18n import _, ngettext
from app.loop.alarms.kinds import AlarmKind, register
from app.loop.tables.alarms import Alarm


def _since(alarm: Alarm, name: str) -> str:
    moment = alarm.data.get(name)
    return as_read(datetime.fromisoformat(str(moment)), "minutes") if moment else "–"


def _silent(alarm: Alarm) -> str:
    return _(
        "The bridge of this machine was heard last at {since}. Readings stay in the bridge or the control, and no correction "
        "reaches the machine."
    ).format(since=_since(alarm, "received_at"))


def _backing_up(alarm: Alarm) -> str:
    waiting = alarm.data.get("waiting", 0)
    if alarm.data.get("state") == "full":
        return _("The store of the bridge is full with {n} readings: it fetches no more from the control.").format(
            n=waiting
        )
    return _("{n} readings wait in the bridge, the oldest since {since}. Corrections come too late.").format(
        n=waiting, since=_since(alarm, "oldest_waiting_at")
    )


def _late(sentence: str, item: Mapping[str, Any]) -> str:
    late = int(item.get("late") or 0)
    if not late:
        return sentence
    return f"{sentence} " + ngettext(
        "{n} reading came late, and its decision with it.",
        "{n} readings came late, and their decisions with them.",
        late,
    ).format(n=late)


def _server_away(alarm: Alarm) -> str:
    return _(
        "The server was unreachable from {begin} to {end}: in that time no correction and no stop reached this machine. What was "
        "measured meanwhile is decided as it arrives."
    ).format(begin=_since(alarm, "from"), end=_since(alarm, "until"))


_REMOVED: dict[str, Callable[[Mapping[str, Any]], str]] = {
    "connection_removed": lambda _item: _("The connection was removed: the machine has no bridge any more.")
}
BRIDGE_SILENT = register(
    AlarmKind(
        "bridge_silent",
        word=lambda: _("Bridge is silent"),
        sentence=_silent,
        what_to_do=lambda: _(
            "Look whether the bridge's computer runs and reaches this server. The alarm ends when the bridge speaks again. If "
            "the machine has no bridge any more, an administrator removes the connection: Machines, Connections."
        ),
        icon="no_data",
        comments={"noted": lambda: [_("Bridge started again"), _("Network repaired"), _("Machine is switched off")]},
        outcomes={"bridge_heard": lambda item: _late(_("The bridge has spoken again."), item)} | _REMOVED,
    )
)
BRIDGE_BACKING_UP = register(
    AlarmKind(
        "bridge_backing_up",
        word=lambda: _("Bridge is backing up"),
        sentence=_backing_up,
        what_to_do=lambda: _(
            "Look under Machines, Connections, what the bridge says: a reading may be refused again and again, or the network "
            "is slow. The alarm ends when the backlog is gone."
        ),
        icon="waiting",
        comments={"noted": lambda: [_("Network repaired"), _("Disk made larger")]},
        outcomes={"backlog_gone": lambda _item: _("The backlog is gone.")} | _REMOVED,
    )
)
BRIDGE_QUARANTINE = register(
    AlarmKind(
        "bridge_quarantine",
        concerns_parts=True,
        word=lambda: _("Readings in quarantine"),
        sentence=lambda alarm: ngettext(
            "{n} reading was refused and lies in the bridge: nothing is decided by it. The newest is {key} of {characteristic}: {reason}",
            "{n} readings were refused and lie in the bridge: nothing is decided by them. The newest is {key} of {characteristic}: "
            "{reason}",
            int(alarm.data.get("quarantined") or 0),
        ).format(
            n=alarm.data.get("quarantined"),
            key=alarm.data.get("newest") or NOTHING,
            characteristic=alarm.data.get("characteristic") or NOTHING,
            reason=alarm.data.get("reason") or NOTHING,
        ),
        what_to_do=lambda: _(
            "Look at the page of the connection for why. Then send them again or drop them: inband bridge quarantine. The alarm ends "
            "when none is left."
        ),
        comments={"noted": lambda: [_("Characteristic added"), _("Program corrected"), _("Sent again")]},
        outcomes={"quarantine_empty": lambda _item: _("The quarantine is empty.")} | _REMOVED,
    )
)
SERVER_AWAY = register(
    AlarmKind(
        "server_away",
        word=lambda: _("Server was unreachable"),
        sentence=_server_away,
        what_to_do=lambda: _(
            "Look at the parts of that time, and at the server's log for why it was. The alarm ends when what was measured "
            "meanwhile has arrived."
        ),
        icon="no_data",
        comments={"noted": lambda: [_("Server updated"), _("Power failure"), _("Network repaired")]},
        outcomes={"server_back": lambda item: _late(_("The server is reachable again."), item)},
    )
)
READINGS_LATE = register(
    AlarmKind(
        "readings_late",
        concerns_parts=True,
        word=lambda: _("Readings came late"),
        sentence=lambda alarm: ngettext(
            "{n} reading came late: it was measured from {begin} to {end}. Parts were cut without its correction.",
            "{n} readings came late: measured from {begin} to {end}. Parts were cut without their corrections, and no stop came.",
            int(alarm.data.get("late") or 0),
        ).format(n=alarm.data.get("late"), begin=_since(alarm, "from"), end=_since(alarm, "until")),
        what_to_do=lambda: _(
            "Look at the parts of that time, and at the network between the machine and this server. Readings that are typed in later "
            "carry by_hand."
        ),
        icon="no_data",
        comments={"noted": lambda: [_("Network repaired"), _("Parts looked at")]},
    )
)
GONE = {
    BRIDGE_SILENT.name: "bridge_heard",
    BRIDGE_BACKING_UP.name: "backlog_gone",
    BRIDGE_QUARANTINE.name: "quarantine_empty",
}
"""The outcome of each when it ends by itself."""
