"""What is worked out on the rounds: the outlook of each characteristic, and an alarm where a loop begins to hunt.

Outlooks are not what readings are decided by: no machine is locked for them, and what the writer has in memory stays true.
"""

import logging
from typing import Any

from sqlalchemy import Select, func, or_, select
from sqlalchemy.dialects.postgresql import insert
from sqlalchemy.orm import Session

from app.alarms import actions as alarms
from app.characteristics import queries as characteristics
from app.characteristics.queries import Standing
from app.characteristics.tables import Characteristic
from app.core.hunting import Hunting, State
from app.core.wear import LONGEST
from app.db.events import publish
from app.machines.queries import lock_machines
from app.readings.tables import Stream
from app.statistics.queries import Window
from app.wear import queries, wording
from app.wear.queries import Wear
from app.wear.tables import Outlook

log = logging.getLogger(__name__)

MOST = 200  # characteristics on one round; those whose outlook is oldest come first


def look_ahead(session: Session) -> None:
    """Work out the outlook of what was measured since, and raise *hunting* once where a loop has begun to hunt."""
    begun: list[tuple[Standing, Hunting]] = []
    for key in session.scalars(_moved()):
        standing = characteristics.characteristic_named(session, key)
        before = session.get(Outlook, (standing.machine.id, standing.characteristic.id))
        hunted = before is not None and before.hunting in queries.OVERCORRECTS
        try:
            with session.begin_nested():
                wear = queries.wear_of(session, standing, _newest(session, standing))
                _note(session, wear)
        except Exception:  # one that cannot be worked out takes nothing of the others with it
            log.exception("the outlook of %s could not be made", key)
            continue
        found = wear.hunting
        if found is not None and found.state.value in queries.OVERCORRECTS and not hunted:
            begun.append((standing, found))
    if begun:
        lock_machines(session, {standing.machine.id for standing, _found in begun})
        publish(session, *(_tell(session, standing, found) for standing, found in begun))


def _tell(session: Session, standing: Standing, found: Hunting) -> dict[str, Any]:
    """Raise the alarm: under the machine's lock, as whoever acknowledges the one before it. What is told to live pages."""
    alarm = alarms.raise_for_characteristic(
        session,
        standing.machine.id,
        standing.characteristic.id,
        standing.parameters.tool_memory,
        "hunting",
        wording.hunting_data(found) | {"settings": {name: standing.version.parameters[name] for name in SAID}},
    )
    return {
        "kind": "alarm",
        "machine": standing.machine.key,
        "characteristic": standing.characteristic.key,
        "tool": alarm.tool_memory,
        "id": alarm.id,
        "alarm": alarm.kind,
        "state": "active",
    }


SAID = ("zero_range", "averaging_limit", "weighting_factor", "tolerance_width")  # settings that the sentences name


def _moved() -> Select[str]:
    """Keys of the characteristics that have been measured, or set otherwise, since their outlook was made."""
    return (
        select(Characteristic.key)
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
        .limit(MOST)
    )


def _newest(session: Session, standing: Standing) -> Window:
    """What the outlook is made of: the line needs no more."""
    life = queries.life_of(session, standing)
    return Window(max(1, life.last - LONGEST + 1), life.last, life.newest)


def _note(session: Session, wear: Wear) -> None:
    towards, forecast = wear.first or (None, None)
    finite = forecast is not None and forecast.high != float("inf")
    values = {
        "sequence": wear.window.last,
        "parameters_version": wear.standing.version.version,
        "at": func.now(),
        "towards": towards.value if towards else None,
        "parts": forecast.parts if forecast else None,
        "parts_low": forecast.low if forecast else None,
        "parts_high": forecast.high if forecast and finite else None,
        "hunting": (wear.hunting.state if wear.hunting else State.QUIET).value,
    }
    where = {"machine_id": wear.standing.machine.id, "characteristic_id": wear.standing.characteristic.id}
    session.execute(
        insert(Outlook)
        .values(**where, **values)
        .on_conflict_do_update(index_elements=["machine_id", "characteristic_id"], set_=values)
        .execution_options(synchronize_session=False)
    )
