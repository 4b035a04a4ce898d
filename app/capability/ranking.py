"""Ppk of every characteristic at once, from the last readings of each: for overviews that rank them. Never writes."""

from typing import NamedTuple

from sqlalchemy import text
from sqlalchemy.orm import Session

from app.core.spc.capability import FEWEST_READINGS, Index, Limits, ppk_of

LOOKED_BACK = 200
"""Readings of each characteristic that count."""

_LAST = """
SELECT s.characteristic_id, l.count, l.mean, l.deviation, (v.parameters ->> 'tolerance_width')::float8 / 2
FROM stream s
JOIN parameters_version v ON v.machine_id = s.machine_id AND v.characteristic_id = s.characteristic_id
    AND v.version = s.parameters_version
CROSS JOIN LATERAL (
    SELECT count(*) AS count, avg(r.deviation) AS mean,
        CASE WHEN max(r.deviation) > min(r.deviation) THEN stddev_samp(r.deviation) END AS deviation
    FROM reading r
    WHERE r.machine_id = s.machine_id AND r.characteristic_id = s.characteristic_id
        AND r.sequence > s.sequence - :back AND r.zone <> 'probe_fault' AND NOT EXISTS (
            SELECT FROM exclusion e WHERE e.machine_id = r.machine_id AND e.characteristic_id = r.characteristic_id
                AND e.sequence = r.sequence)
) l
WHERE CAST(:machine AS int) IS NULL OR s.machine_id = :machine
"""


class Ranked(NamedTuple):
    """How one characteristic stands. readings: that counted, of the last 200; ppk: None where they do not carry it.

    The interval reaches from ppk.low to ppk.high (95 %). mean and standard deviation of the deviations, mm.
    """

    readings: int
    mean: float | None
    standard_deviation: float | None
    ppk: Index | None


def capability_by_characteristic(session: Session, machine_id: int | None = None) -> dict[int, Ranked]:
    """Ppk by the id of the characteristic, of one machine or of all; by the limits in force now, normally distributed.

    For ranking alone: it tests neither stability nor shape. Reads 200 rows of each characteristic.
    """
    made = {}
    for key, count, mean, deviation, half in session.execute(text(_LAST), {"machine": machine_id, "back": LOOKED_BACK}):
        ppk = None
        if count >= FEWEST_READINGS and deviation and half > 0:
            ppk = ppk_of(Limits(-half, half), mean, deviation, count)
        made[key] = Ranked(count, mean, deviation, ppk)
    return made
