"""The numbers of a run of readings, exact; excluded readings are left out.

Probe faults (|D| ≥ R36) measure no part: they are counted as readings and in their zone, and in nothing else.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import fsum, sqrt
from typing import Any, NamedTuple

from sqlalchemy import text
from sqlalchemy.orm import Session

from app.core.decision.limits import FAULT, Zone, nanometres, nanometres_sql, within, within_sql
from app.core.natural_limit import half_width
from app.db.period import in_period_sql
from app.loop.summaries.queries.chart_data import excluded_of
from app.loop.summaries.queries.context import in_context_sql, written
from app.loop.summaries.queries.pyramid import Block, Run, cover_of
from app.loop.summaries.queries.window import Window
from app.loop.tables.characteristics import Characteristic, ParametersVersion

MOST_ONE_BY_ONE = (
    50_000  # readings that are aggregated as they are; more are taken from the pyramid where it settles them
)
MOST_IN_HISTOGRAM = 100_000

# regr_sxx is the sum of squares about the mean, which PostgreSQL accumulates without cancellation (Youngs and Cramer).
# A part is judged by its raw deviation and the tolerance of the version that was in force, in whole nanometres.
_OF_A_PART = f"r.zone <> '{Zone.PROBE_FAULT.value}'"
_PARTS = f"""
SELECT count(d), avg(d), regr_sxx(d, d), min(d), max(d), count(r.correction),
    count(*) FILTER (WHERE {within_sql("d", "v.tolerance")}),
    {", ".join(f"count(*) FILTER (WHERE r.zone = '{zone.value}')" for zone in Zone)}
FROM unnest(CAST(:firsts AS bigint[]), CAST(:lasts AS bigint[])) AS run(first, last)
JOIN reading r ON r.machine_id = :machine AND r.characteristic_id = :characteristic
    AND r.sequence BETWEEN run.first AND run.last
JOIN unnest(CAST(:versions AS int[]), CAST(:tolerances AS bigint[])) AS v(version, tolerance)
    ON v.version = r.parameters_version
CROSS JOIN LATERAL (SELECT CASE WHEN {_OF_A_PART} THEN r.deviation END) AS part(d)
WHERE {in_period_sql("r.measured_at")}
  AND NOT r.sequence = ANY(CAST(:excluded AS bigint[]))
"""  # noqa: S608 - made of the names of our zones

# width_bucket counts as `histogram_counts` does, by the same edges.
_HISTOGRAM = f"""
SELECT width_bucket({nanometres_sql("deviation")}, CAST(:edges AS float8[])) AS bar, count(*)
FROM reading r
WHERE machine_id = :machine AND characteristic_id = :characteristic AND sequence BETWEEN :first AND :last
  AND {_OF_A_PART} AND NOT sequence = ANY(CAST(:excluded AS bigint[]))
  AND {in_period_sql("measured_at")}
"""  # noqa: S608 - made of the names of our zones


_UNWORN = f"""
SELECT avg(deviation), stddev_samp(deviation) FROM reading r
WHERE machine_id = :machine AND characteristic_id = :characteristic AND sequence BETWEEN :first AND :last
  AND zone NOT IN ('{Zone.WEAR.value}', '{Zone.PROBE_FAULT.value}')
  AND NOT sequence = ANY(CAST(:excluded AS bigint[])) AND {in_period_sql("measured_at")}
"""  # noqa: S608 - made of the names of our zones


_EXCLUDED = f"""
SELECT count(*) FROM reading r WHERE machine_id = :machine AND characteristic_id = :characteristic
    AND sequence = ANY(CAST(:excluded AS bigint[])) AND {in_period_sql("measured_at")}
"""  # noqa: S608 - made of our own names


@dataclass(frozen=True, slots=True)
class Numbers:
    """Statistics of the readings; deviations in mm, None where there are too few readings.

    count: readings that nobody excluded, probe faults among them; `measured` are those that measured a part, and of them
    are mean, spread, extremes and shares. in_tolerance counts parts by their raw deviation; zones are those by which was
    decided.
    """

    count: int
    excluded: int
    mean: float | None
    standard_deviation: float | None
    minimum: float | None
    maximum: float | None
    in_tolerance: int
    corrections: int
    zones: dict[str, int]

    @property
    def probe_faults(self) -> int:
        return self.zones[Zone.PROBE_FAULT.value]

    @property
    def measured(self) -> int:
        return self.count - self.probe_faults

    @property
    def outside(self) -> int:
        return self.measured - self.in_tolerance

    @property
    def share_in_tolerance(self) -> float | None:
        return self.in_tolerance / self.measured if self.measured else None


@dataclass(frozen=True, slots=True)
class _Spread:
    measured: int
    mean: float
    squares: float  # about the mean
    minimum: float
    maximum: float


@dataclass(frozen=True, slots=True)
class _Part:
    spread: _Spread | None  # None: nothing but probe faults
    corrections: int
    in_tolerance: int
    zones: Sequence[int]


def numbers_of(session: Session, characteristic: Characteristic, window: Window) -> Numbers:
    """Exact for any number of readings."""
    excluded = excluded_of(session, characteristic, window.first, window.last) if window.count else ()
    tolerances = _tolerances(session, characteristic)
    parts: list[_Part] = []
    runs: list[Run] = [(window.first, window.last)]
    if window.count > MOST_ONE_BY_ONE and not window.context:
        # Where even the extremes are in the tightest tolerance there ever was, no part is outside. The sums of a block
        # hold its probe faults, so one with any is looked into; they are outside as a rule, and few.
        tightest = min(tolerances.values())
        cover = cover_of(
            session,
            characteristic,
            window.first,
            window.last,
            window.period,
            without=excluded,
            settles=lambda block: (
                within(nanometres(max(-block.minimum, block.maximum)), tightest) and not block.zones[FAULT]
            ),
        )
        runs, parts = cover.runs, [_part(block) for block in cover.blocks]
    where = {"machine": characteristic.machine_id, "characteristic": characteristic.id, "excluded": list(excluded)}
    if window.count and runs:
        row = session.execute(
            text(_PARTS + in_context_sql(window.context, "r")),
            where
            | {
                "firsts": [first for first, _last in runs],
                "lasts": [last for _first, last in runs],
                "versions": list(tolerances),
                "tolerances": list(tolerances.values()),
                **_meant(window),
            },
        ).one()
        measured, mean, squares, minimum, maximum, corrections, in_tolerance, *zones = row
        spread = _Spread(measured, mean, squares, minimum, maximum) if measured else None
        parts.append(_Part(spread, corrections, in_tolerance, zones))
    return _total(parts, _excluded_in_time(session, characteristic, excluded, window))


def _meant(window: Window) -> dict[str, Any]:
    """The values of the conditions that readings of a window meet."""
    return {**window.period._asdict(), **({"context": written(window.context)} if window.context else {})}


class Unworn(NamedTuple):
    """Mean and standard deviation (mm) without the parts of worn tools; `worn` are those."""

    worn: int
    mean: float | None
    standard_deviation: float | None


def unworn_of(session: Session, characteristic: Characteristic, window: Window, numbers: Numbers) -> Unworn | None:
    """The spread without parts in the zone of wear, where there are any: a few of a broken edge hide what the process does.

    Reads every reading of the window.
    """
    worn = numbers.zones[Zone.WEAR.value]
    if not worn:
        return None
    found = session.execute(
        text(_UNWORN + in_context_sql(window.context, "r")),
        {
            "machine": characteristic.machine_id,
            "characteristic": characteristic.id,
            "first": window.first,
            "last": window.last,
            "excluded": list(excluded_of(session, characteristic, window.first, window.last)),
            **_meant(window),
        },
    ).one()
    return Unworn(worn, *found)


def _part(block: Block) -> _Part:
    squares = max(0.0, block.sum_squares - block.sum * block.sum / block.count)
    spread = _Spread(block.count, block.mean, squares, block.minimum, block.maximum)
    return _Part(spread, block.corrections, block.count, block.zones)


def _total(parts: Sequence[_Part], excluded: int) -> Numbers:
    """Put the parts together: the sum of squares about the common mean, without ever subtracting large numbers."""
    spreads = [part.spread for part in parts if part.spread is not None]
    zones = {zone.value: sum(part.zones[at] for part in parts) for at, zone in enumerate(Zone)}
    mean = deviation = None
    if measured := sum(spread.measured for spread in spreads):
        mean = fsum(spread.measured * spread.mean for spread in spreads) / measured
        if measured > 1:
            squares = fsum(spread.squares + spread.measured * (spread.mean - mean) ** 2 for spread in spreads)
            deviation = sqrt(squares / (measured - 1))
    return Numbers(
        count=sum(zones.values()),
        excluded=excluded,
        mean=mean,
        standard_deviation=deviation,
        minimum=min((spread.minimum for spread in spreads), default=None),
        maximum=max((spread.maximum for spread in spreads), default=None),
        in_tolerance=sum(part.in_tolerance for part in parts),
        corrections=sum(part.corrections for part in parts),
        zones=zones,
    )


def _tolerances(session: Session, characteristic: Characteristic) -> dict[int, int]:
    """Distance from the target to a limit (nm) by the version of the parameters."""
    rows = session.execute(
        text(
            "SELECT version, CAST(parameters ->> 'tolerance_width' AS float8), parameters ->> 'natural_limit' "
            "FROM parameters_version "
            "WHERE machine_id = :machine AND characteristic_id = :characteristic"
        ).columns(ParametersVersion.version),
        {"machine": characteristic.machine_id, "characteristic": characteristic.id},
    )
    return {version: nanometres(half_width(width, natural)) for version, width, natural in rows}


def _excluded_in_time(session: Session, characteristic: Characteristic, excluded: Sequence[int], window: Window) -> int:
    if not excluded or not window.narrowed:
        return len(excluded)
    return int(
        session.execute(
            text(_EXCLUDED + in_context_sql(window.context, "r")),
            {
                "machine": characteristic.machine_id,
                "characteristic": characteristic.id,
                "excluded": list(excluded),
                **_meant(window),
            },
        ).scalar_one()
    )


def histogram_of(session: Session, characteristic: Characteristic, window: Window, edges: Sequence[float]) -> list[int]:
    """Counts of the deviations between the edges (nm, ascending); one count more than edges.

    Without excluded readings and probe faults. Of more than `MOST_IN_HISTOGRAM` readings the last ones count.
    """
    counts = [0] * (len(edges) + 1)
    first = max(window.first, window.last - MOST_IN_HISTOGRAM + 1)
    if first > window.last:
        return counts
    rows: Iterable[Any] = session.execute(
        text(_HISTOGRAM + in_context_sql(window.context, "r") + " GROUP BY bar"),
        {
            "machine": characteristic.machine_id,
            "characteristic": characteristic.id,
            "first": first,
            "last": window.last,
            "excluded": list(excluded_of(session, characteristic, first, window.last)),
            "edges": list(edges),
            **_meant(window),
        },
    )
    for bar, count in rows:
        counts[bar] = count
    return counts
