"""A long run of readings as columns: a million of them in the time the server needs to walk through them.

The server packs a column of some thousand readings into one string of bytes (`float8send`, `int8send`), and NumPy takes
it as it is. Row by row it would be ten times as long, nearly all of it spent on making Python objects.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy.orm import Session

from app.core.decision.limits import Zone
from app.core.decision.step import Code
from app.errors import Invalid
from app.language.i18n import _
from app.loop.summaries.queries.chart_data import excluded_of
from app.loop.summaries.queries.context import sequences_in_context
from app.loop.summaries.queries.window import Window
from app.loop.tables.characteristics import Characteristic

BLOCK = 8_192  # readings in one string
MOST_AT_ONCE = 10_000_000  # readings: 80 MB a column
MOST_KEPT = 2_000_000  # for a session that asks for them again

Whole = NDArray[np.int64]

# What can be had: how it is sent, how NumPy reads it. A missing float is NaN, a missing whole number or moment -1.
_FLOAT, _WHOLE, _SMALL, _FLAG = ">f8", ">i8", ">i4", "?"
_ZONES = " ".join(f"WHEN '{zone.value}' THEN {number}" for number, zone in enumerate(Zone))
_CODES = " ".join(f"WHEN '{code.value}' THEN {number}" for number, code in enumerate(Code))
COLUMNS: dict[str, tuple[str, str]] = {
    "sequence": ("int8send(r.sequence)", _WHOLE),
    "measured": ("float8send(r.measured)", _FLOAT),
    "deviation": ("float8send(r.deviation)", _FLOAT),
    "decided": ("float8send(r.decided)", _FLOAT),
    "average_before": ("float8send(r.average_before)", _FLOAT),
    "average_after": ("float8send(r.average_after)", _FLOAT),
    "compensated": ("float8send(coalesce(r.compensated, 'NaN'))", _FLOAT),
    "measured_at": ("timestamptz_send(r.measured_at)", _WHOLE),
    "received_at": ("timestamptz_send(r.received_at)", _WHOLE),
    "machined_at": ("coalesce(timestamptz_send(r.machined_at), int8send(-9223372036854775807))", _WHOLE),
    "parameters_version": ("int4send(r.parameters_version)", _SMALL),
    "correction_in_effect": ("int4send(coalesce(r.correction_in_effect, -1))", _SMALL),
    "correction": ("int4send(coalesce(r.correction, -1))", _SMALL),
    "part": ("int8send(coalesce(hashtextextended(r.part, 0) & 9223372036854775807, -1))", _WHOLE),
    "paused": ("boolsend(r.paused_by IS NOT NULL)", _FLAG),
    "zone": (f"int4send(CASE r.zone {_ZONES} END)", _SMALL),
    "code": (f"int4send(CASE r.code {_CODES} END)", _SMALL),
}
"""Columns of `reading` by name; zone and code are the place of each in `Zone` and `Code` of the core, part is a number that
equal serial numbers have in common, -1 without one."""
MOMENTS = frozenset({"measured_at", "received_at", "machined_at"})
POSTGRES_EPOCH = np.datetime64("2000-01-01T00:00:00", "us")


@dataclass(frozen=True, slots=True)
class History:
    """Readings as columns, ascending by sequence; lengths in mm, moments as datetime64[us] in UTC (NaT where unknown).

    `columns` holds what was asked for, `sequence` always. `excluded` is True for readings taken out of the statistics.
    """

    columns: dict[str, NDArray[Any]]
    excluded: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.excluded)

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.columns[name]

    @property
    def counted(self) -> "History":
        """Without the excluded readings."""
        return self.only(~self.excluded) if self.excluded.any() else self

    def only(self, wanted: NDArray[np.bool_] | NDArray[np.int64]) -> "History":
        """Those readings for which `wanted` is True; or those at these places, in this order."""
        return History({name: values[wanted] for name, values in self.columns.items()}, self.excluded[wanted])


def history_of(
    session: Session,
    characteristic: Characteristic,
    window: Window,
    columns: Iterable[str] = ("deviation",),
) -> History:
    """The readings of the window; excluded ones are marked. Those of a context are taken out of all: a session reads these once.

    columns: names of `COLUMNS`; `sequence` comes in any case. Raises `Invalid` for more than ten million readings.
    """
    if window.count > MOST_AT_ONCE:
        raise Invalid(
            _("These are {count} readings; at most {most} can be worked on at once.").format(
                count=window.count, most=MOST_AT_ONCE
            ),
            _("Choose a shorter period, or fewer readings."),
        )
    if window.context:
        whole = history_of(session, characteristic, replace(window, context=()), columns)
        ends = window.first, window.last
        meant = sequences_in_context(session, characteristic, window.context, *ends) if window.count else ()
        return whole.only(np.isin(whole["sequence"], np.asarray(meant, np.int64)))
    names = [name for name in dict.fromkeys(["sequence", *columns]) if name != "sequence" or window.narrowed]
    if window.narrowed:
        values = _columns(session, characteristic, window, names)
    else:  # they are numbered without a gap
        values = _whole(session, characteristic, window, names or ["sequence"])
        values["sequence"] = np.arange(window.first, window.first + max(map(len, values.values())))
    left_out = excluded_of(session, characteristic, window.first, window.last) if window.count else ()
    return History(values, np.isin(values["sequence"], np.array(left_out, np.int64)))


class _Kept(NamedTuple):
    """Columns of a run of readings that a session has read, every one of them stored."""

    machine: int
    characteristic: int
    first: int
    last: int
    columns: dict[str, NDArray[Any]]


def _whole(
    session: Session, characteristic: Characteristic, window: Window, names: list[str]
) -> dict[str, NDArray[Any]]:
    """Columns of the window. A report asks for the same readings again and again: what its session read last is kept, since
    readings are never changed. Not to be written to.
    """
    here = (characteristic.machine_id, characteristic.id)
    remembered: _Kept | None = session.info.get(_Kept)
    if (
        remembered is None
        or remembered[:2] != here
        or not remembered.first <= window.first <= window.last <= remembered.last
    ):
        remembered = _Kept(*here, window.first, window.last, {})
    missing = [name for name in names if name not in remembered.columns]
    many = remembered.last - remembered.first + 1
    if many > MOST_KEPT or (missing and many > 2 * window.count):
        return _columns(session, characteristic, window, names)
    if missing:
        new_columns = _columns(
            session, characteristic, Window(remembered.first, remembered.last, window.newest), missing
        )
        remembered.columns.update(new_columns)
        if any(len(values) != many for values in new_columns.values()):  # not all of them are stored yet
            return new_columns
        session.info[_Kept] = remembered
    at = slice(window.first - remembered.first, window.last - remembered.first + 1)
    return {name: remembered.columns[name][at] for name in names}


def _columns(
    session: Session, characteristic: Characteristic, window: Window, names: list[str]
) -> dict[str, NDArray[Any]]:
    """The columns, ascending by sequence. Block by block by the index: grouped, the server would sort what lies in order."""
    packed = ", ".join(f"string_agg({COLUMNS[name][0]}, ''::bytea ORDER BY r.sequence)" for name in names)
    query = f"""
        SELECT block.*, at FROM generate_series(%(first)s::bigint / {BLOCK}, %(last)s::bigint / {BLOCK}) AS at, LATERAL (
            SELECT {packed} FROM reading r
            WHERE machine_id = %(machine)s AND characteristic_id = %(characteristic)s
                AND sequence BETWEEN greatest(at * {BLOCK}, %(first)s) AND least(at * {BLOCK} + {BLOCK - 1}, %(last)s)
                {"AND measured_at >= %(start)s" if window.period.start is not None else ""}
                {"AND measured_at < %(end)s" if window.period.end is not None else ""}
        ) AS block
    """  # noqa: S608 - made of our own names
    bounds: dict[str, Any] = {"machine": characteristic.machine_id, "characteristic": characteristic.id}
    bounds |= {"first": window.first, "last": window.last, **window.period._asdict()}
    rows: list[Any] = []
    if window.count:
        # As bytes, not as the text that bytes are written in: half of what travels, and nothing to decode.
        cursor: Any = session.connection().connection.cursor(binary=True)
        cursor.execute(query, bounds)
        # One by one: fetched at once, they are a hundred megabytes that are copied while nothing else in the process goes on.
        rows = sorted(cursor, key=lambda row: row[-1])
        cursor.close()
    columns: dict[str, NDArray[Any]] = {}
    for at, name in enumerate(names):
        kind = COLUMNS[name][1]
        raw = np.frombuffer(b"".join(row[at] or b"" for row in rows), kind)
        values = raw.astype(np.dtype(kind).newbyteorder("="))
        columns[name] = _moments(values) if name in MOMENTS else values
    return columns


def _moments(microseconds: Whole) -> NDArray[np.datetime64]:
    """Microseconds since 2000-01-01 as moments; the number that stands for none becomes NaT."""
    moments = POSTGRES_EPOCH + microseconds.astype("timedelta64[us]")
    moments[microseconds == np.iinfo(np.int64).min + 1] = np.datetime64("NaT")
    return moments
