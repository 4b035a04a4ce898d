"""The signals that rules gave. Never writes."""

from collections import defaultdict
from collections.abc import Sequence
from typing import Literal, NamedTuple

from sqlalchemy import ColumnElement, Select, and_, func, or_, select
from sqlalchemy.orm import Session

from app.errors import NotFound
from app.language.i18n import _
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine
from app.quality.chart_signals.tables import Signal
from app.web.fields import LARGEST_ID

SignalState = Literal["open", "explained", "withdrawn", "all"]


class SignalRow(NamedTuple):
    """A signal with the names of what it is about, and the alarm that it raised."""

    signal: Signal
    machine: Machine
    characteristic: Characteristic
    alarm: Alarm | None

    @property
    def state(self) -> SignalState:
        """Open until a person has said what it was: of the signal itself, or by acknowledging its alarm."""
        if self.signal.withdrawn_at is not None:
            return "withdrawn"
        answered = self.alarm is not None and self.alarm.acknowledged_at is not None
        return "explained" if self.signal.explained_at is not None or answered else "open"


_OPEN = and_(Signal.explained_at.is_(None), Signal.withdrawn_at.is_(None), Alarm.acknowledged_at.is_(None))
_STATES: dict[SignalState, ColumnElement[bool]] = {
    "open": _OPEN,
    "explained": and_(
        Signal.withdrawn_at.is_(None), or_(Signal.explained_at.is_not(None), Alarm.acknowledged_at.is_not(None))
    ),
    "withdrawn": Signal.withdrawn_at.is_not(None),
}


def _rows() -> Select[Signal, Machine, Characteristic, Alarm]:
    return (
        select(Signal, Machine, Characteristic, Alarm)
        .join(Machine, Machine.id == Signal.machine_id)
        .join(
            Characteristic,
            (Characteristic.machine_id == Signal.machine_id) & (Characteristic.id == Signal.characteristic_id),
        )
        .outerjoin(Alarm, (Alarm.machine_id == Signal.machine_id) & (Alarm.id == Signal.alarm))
        .execution_options(populate_existing=True)
    )


def signal(session: Session, number: int) -> SignalRow:
    """One signal by its number. Raises `NotFound`."""
    row = session.execute(_rows().where(Signal.id == number)).one_or_none() if 0 < number <= LARGEST_ID else None
    if row is None:
        raise unknown(number)
    return SignalRow(*row)


def unknown(number: int) -> NotFound:
    """This signal is not known, or not here."""
    return NotFound(
        _("There is no signal {number}.").format(number=number),
        _("Check the number; GET /api/v1/signals lists them."),
    )


def signals(
    session: Session,
    *,
    machine_id: int | None = None,
    characteristic: Characteristic | None = None,
    state: SignalState = "all",
    chart: str | None = None,
    first: int | None = None,
    through: int | None = None,
    before: int | None = None,
    limit: int = 50,
) -> list[SignalRow]:
    """Signals, newest first; those whose run has to do with the readings `first` to `through`, where these are given."""
    query = _rows().order_by(Signal.id.desc()).limit(limit)
    if characteristic is not None:
        query = query.where(
            Signal.machine_id == characteristic.machine_id, Signal.characteristic_id == characteristic.id
        )
    elif machine_id is not None:
        query = query.where(Signal.machine_id == machine_id)
    if state != "all":
        query = query.where(_STATES[state])
    if chart is not None:
        query = query.where(Signal.chart == chart)
    if first is not None:
        query = query.where(Signal.last_sequence >= first)
    if through is not None:
        query = query.where(Signal.first_sequence <= through)
    if before is not None:
        query = query.where(Signal.id < before)
    return [SignalRow(*row) for row in session.execute(query)]


def counts(session: Session, characteristic: Characteristic) -> dict[SignalState, int]:
    """Number of signals of a characteristic in each state."""
    query = (
        select(*(func.count().filter(condition) for condition in _STATES.values()))
        .select_from(Signal)
        .outerjoin(Alarm, (Alarm.machine_id == Signal.machine_id) & (Alarm.id == Signal.alarm))
        .where(Signal.machine_id == characteristic.machine_id, Signal.characteristic_id == characteristic.id)
    )
    counts = dict(zip(_STATES, session.execute(query).one(), strict=True))
    return counts | {"all": sum(counts.values())}


def open_signals_by_characteristic(session: Session, machine_id: int | None) -> dict[int, Sequence[int]]:
    """Numbers of the open signals, newest first, by the id of the characteristic; of one machine or of all."""
    query = (
        select(Signal.characteristic_id, Signal.id)
        .outerjoin(Alarm, (Alarm.machine_id == Signal.machine_id) & (Alarm.id == Signal.alarm))
        .where(_OPEN)
        .order_by(Signal.id.desc())
    )
    comments: dict[int, list[int]] = defaultdict(list)
    for characteristic_id, number in session.execute(
        query if machine_id is None else query.where(Signal.machine_id == machine_id)
    ):
        comments[characteristic_id].append(number)
    return dict(comments)
