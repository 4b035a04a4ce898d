"""Two characteristics that ask for opposite corrections of one tool. Never writes. Lengths in mm of offset."""

from typing import Any

from sqlalchemy import func, literal_column, select
from sqlalchemy.orm import Session

from app.core.disagreement import LONGEST, Asked, disagreement
from app.loop.tables.alarms import Alarm
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import Stream
from app.loop.tables.tools import OUTSTANDING, Correction, Tool
from app.loop.tools.effect_alarm_kinds import CHARACTERISTICS_DISAGREE


def disagreement_on(session: Session, machine_id: int, number: int) -> dict[str, Any] | None:
    """The values of the alarm *characteristics disagree* of this tool, or None.

    Corrections count since the tool was changed or its offset edited, the last such alarm was answered, and factor, target
    or empirical value of their characteristic were changed.
    """
    since = func.greatest(
        select(Tool.reset_at).where(Tool.machine_id == machine_id, Tool.number == number).scalar_subquery(),
        select(func.max(Alarm.acknowledged_at))
        .where(
            Alarm.machine_id == machine_id,
            Alarm.tool_memory == number,
            Alarm.kind == CHARACTERISTICS_DISAGREE.name,
        )
        .scalar_subquery(),
        literal_column("'-infinity'::timestamptz"),
    )
    rows = session.execute(
        select(Correction.characteristic_id, Correction.amount, Characteristic.key)
        .join(
            Stream,
            (Stream.machine_id == Correction.machine_id) & (Stream.characteristic_id == Correction.characteristic_id),
        )
        .join(
            Characteristic,
            (Characteristic.machine_id == Correction.machine_id) & (Characteristic.id == Correction.characteristic_id),
        )
        .where(
            Correction.machine_id == machine_id,
            Correction.tool_memory == number,
            Correction.status.in_(("applied", *OUTSTANDING)),
            Correction.created_at > since,
            Correction.sequence > Stream.gain_from,
        )
        .order_by(Correction.number.desc())
        .limit(LONGEST)
    ).all()
    found = disagreement([Asked(each, amount) for each, amount, _key in reversed(rows)])
    if found is None:
        return None
    keys = {each: key for each, _amount, key in rows}
    return {
        "down": keys[found.down],
        "up": keys[found.up],
        "mean_down": round(found.mean_down, 6),
        "mean_up": round(found.mean_up, 6),
        "times": found.times,
    }
