"""The plant as the wall screen shows it. Never writes."""

from collections.abc import Iterable
from datetime import UTC, datetime
from typing import NamedTuple

from sqlalchemy.orm import Session

from app.core.state import CharacteristicState
from app.language.formatting import as_read
from app.language.i18n import _
from app.loop.alarm_response import queries as responses
from app.loop.alarm_response import wording as alarm_wording
from app.loop.maintenance.queries import MaintenanceRow, running
from app.views.characteristic import state_queries as plant
from app.views.characteristic.state_queries import Group
from app.views.characteristic.wording import state_word
from app.views.shift.queries import made_in, period_at
from app.web.states import URGENCY, icon_of, tone_of

MOST_ALARMS = 6
MOST_MACHINES = 24


class Tile(NamedTuple):
    """A machine: its most urgent state in a word, the parts of the shift, and its maintenance with its end and who entered it."""

    name: str
    word: str
    tone: str
    icon: str
    parts: int
    outside: int
    maintenance: str = ""


class WallAlarm(NamedTuple):
    """An active alarm, and where it is."""

    word: str
    tone: str
    icon: str
    where: str
    raised_at: datetime


class Wall(NamedTuple):
    """All that the screen shows. folded: machines that are not shown, none of which needs anybody more than those that are."""

    at: datetime
    since: datetime
    tiles: list[Tile]
    folded: int
    alarms: list[WallAlarm]
    active: int
    parts: int
    outside: int


def wall(session: Session, now: datetime | None = None) -> Wall:
    """The plant now; the most urgent alarms first, of those the oldest, and where machines are many the most urgent of them."""
    now = now or datetime.now(UTC)
    period = period_at(now, now)
    assert period.start is not None
    made = made_in(session, period)
    tiles, maintained = [], running(session, now)
    for group in plant.plant(session, trends=False):
        state, word = _state(group, now)
        of_shift = made.get(group.machine.id)
        parts, outside = (of_shift.parts, of_shift.outside) if of_shift else (0, 0)
        under = [row for row in maintained if row.machine is None or row.machine.id == group.machine.id][:1]
        tiles.append(
            Tile(
                group.machine.name, word, tone_of(state), icon_of(state), parts, outside,
                "".join(_under(row, now) for row in under),
            )
        )  # fmt: skip
    if len(tiles) > MOST_MACHINES:
        tiles.sort(key=lambda tile: URGENCY.index(tile.tone))
    rows = responses.alarms(session, state="active", limit=MOST_ALARMS, by_urgency=True)
    return Wall(
        now,
        period.start,
        tiles[:MOST_MACHINES],
        len(tiles[MOST_MACHINES:]),
        [
            WallAlarm(
                alarm_wording.kind_word(row.alarm.kind),
                tone_of(row.alarm.kind),
                icon_of(row.alarm.kind),
                f"{row.machine.name} · {row.characteristic.name}" if row.characteristic else row.machine.name,
                row.alarm.raised_at,
            )
            for row in rows
        ],
        responses.active_count(session),
        sum(each.parts for each in made.values()),
        sum(each.outside for each in made.values()),
    )


def _under(row: MaintenanceRow, now: datetime) -> str:
    until = row.maintenance.over_at
    style = "time" if as_read(until, "date") == as_read(now, "date") else "minutes"
    return _("Maintenance until {at}, {name}").format(at=as_read(until, style), name=row.maintenance.entered_by)


def _state(group: Group, now: datetime) -> tuple[str, str]:
    """The most urgent of the states of its characteristics and of its alarms, and its word."""
    kinds = [kind for row in group.rows for _number, kind in row.alarms] + [kind for _number, kind in group.alarms]
    states: list[tuple[str, str]] = [(row.state.value, state_word(row.state)) for row in group.rows]
    worst = _most_urgent([*states, *((kind, alarm_wording.kind_word(kind)) for kind in kinds)])
    if worst is None or tone_of(worst[0]) in ("stop", "wear", "attention"):
        return worst or (CharacteristicState.NO_DATA.value, state_word(CharacteristicState.NO_DATA))
    if all(row.is_calm and row.is_old(now) for row in group.rows):
        return "old", _("Old data")
    return worst


def _most_urgent(states: Iterable[tuple[str, str]]) -> tuple[str, str] | None:
    return min(states, key=lambda each: URGENCY.index(tone_of(each[0])), default=None)
