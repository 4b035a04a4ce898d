"""The periodic job that works out the outlook of each characteristic, and alarms where a loop begins to hunt.

Outlooks are not what readings are decided by: no machine is locked for them, and what the writer has in memory stays true.
"""

from dataclasses import replace
from typing import Any

from sqlalchemy import Select, func, or_, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.core.forecast import Record
from app.core.hunting import Hunting, LoopVerdict
from app.core.wear import LONGEST
from app.db.events import publish
from app.jobs.actions import PeriodicJob, Unit
from app.loop.alarms import actions as alarms
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.machines.queries import lock_machines
from app.loop.summaries.queries import Window
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import Stream
from app.quality.wear import queries, wording
from app.quality.wear.alarm_kinds import HUNTING
from app.quality.wear.queries import Wear
from app.quality.wear.tables import Outlook


def to_look_ahead(session: Session) -> list[Unit]:
    """Characteristics that have been measured, or set otherwise, since their outlook was made, the oldest first."""
    return [
        Unit(f"characteristic/{key}", (key,), machine, characteristic)
        for key, machine, characteristic in session.execute(_moved())
    ]


def look_ahead(session: Session, unit: Unit) -> None:
    """Work out the outlook of one characteristic, and raise *hunting* once where its loop has begun to hunt."""
    current = characteristics.characteristic_named(session, str(unit.key[0]))
    before = session.get(Outlook, (current.machine.id, current.characteristic.id))
    hunted = before is not None and before.hunting in queries.OVERCORRECTS
    changed, record = _record(session, current, before)
    wear = queries.wear_of(session, current, _newest(session, current))
    _note(session, replace(wear, record=record), changed)
    hunting = wear.hunting
    if hunting is not None and hunting.state.value in queries.OVERCORRECTS and not hunted:
        lock_machines(session, [current.machine.id])
        publish(session, _tell(session, current, hunting))


def _tell(session: Session, current: CurrentCharacteristic, hunting: Hunting) -> dict[str, Any]:
    """Raise the alarm: under the machine's lock, as an acknowledgement of the one before it. The news for live pages."""
    alarm = alarms.raise_for_characteristic(
        session,
        current.machine.id,
        current.characteristic.id,
        current.parameters.tool_memory,
        HUNTING,
        wording.hunting_data(hunting) | {"settings": {name: current.version.parameters[name] for name in SAID}},
    )
    return {
        "kind": "alarm",
        "machine": current.machine.key,
        "characteristic": current.characteristic.key,
        "tool": alarm.tool_memory,
        "id": alarm.id,
        "alarm": alarm.kind,
        "state": "active",
    }


SAID = (
    "zero_range",
    "averaging_limit",
    "weighting_factor",
    "tolerance_width",
    "natural_limit",
)  # settings that the sentences name


def _moved() -> Select[str, int, int]:
    return (
        select(Characteristic.key, Characteristic.machine_id, Characteristic.id)
        .join(
            Stream,
            (Stream.machine_id == Characteristic.machine_id) & (Stream.characteristic_id == Characteristic.id),
        )
        .outerjoin(
            Outlook,
            (Outlook.machine_id == Stream.machine_id) & (Outlook.characteristic_id == Stream.characteristic_id),
        )
        .where(
            Stream.sequence > 0,
            or_(
                Outlook.sequence.is_(None),
                Outlook.sequence != Stream.sequence,
                Outlook.parameters_version != Stream.parameters_version,
            ),
        )
        .order_by(Outlook.at.nulls_first())
    )


def _newest(session: Session, current: CurrentCharacteristic) -> Window:
    """Readings that the outlook is made of: the line needs no more."""
    life = queries.life_of(session, current)
    return Window(max(1, life.last - LONGEST + 1), life.last, life.newest)


def _record(session: Session, current: CurrentCharacteristic, before: Outlook | None) -> tuple[int, Record]:
    """Accuracy of the forecasts of earlier edges, and its tool change: computed once after each change."""
    changed = queries.life_of(session, current).first - 1
    if before is not None and before.record_of == changed:
        return changed, queries.record_of(before)
    return changed, queries.backtested(session, current)


def _note(session: Session, wear: Wear, changed: int) -> None:
    towards, forecast = wear.first or (None, None)
    finite = forecast is not None and forecast.high != float("inf")
    values = {
        "sequence": wear.window.last,
        "parameters_version": wear.current.version.version,
        "at": func.now(),
        "towards": towards.value if towards else None,
        "parts": forecast.parts if forecast else None,
        "parts_low": forecast.low if forecast else None,
        "parts_high": forecast.high if forecast and finite else None,
        "hunting": (wear.hunting.state if wear.hunting else LoopVerdict.QUIET).value,
        "record_of": changed,
        "lives": wear.record.lives,
        "tested": wear.record.tested,
        "held": wear.record.held,
        "widening": wear.record.widening,
    }
    where = {"machine_id": wear.current.machine.id, "characteristic_id": wear.current.characteristic.id}
    row = insert(Outlook).values(**where, **values)
    session.execute(
        row.on_conflict_do_update(
            index_elements=["machine_id", "characteristic_id"], set_={name: row.excluded[name] for name in values}
        ).execution_options(synchronize_session=False)
    )


JOB = PeriodicJob("wear_and_hunting", to_look_ahead, look_ahead)
