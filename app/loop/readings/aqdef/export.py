"""Readings of any choice of characteristics as an AQDEF file: what a CAQ system evaluates them from.

The value is the corrected size, which the drawing is compared with; limits are those in force now. Excluded readings are there,
marked (K0002). Events are corrections that a reading caused, alarms that it raised, and tool changes before it.
"""

from collections.abc import Iterator, Sequence
from datetime import datetime
from heapq import merge
from pathlib import Path
from typing import Any, NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.core.decision.limits import Zone
from app.core.decision.step import Code
from app.core.parameters import Parameters
from app.core.period import ALWAYS, Period
from app.errors import Invalid
from app.files.aqdef.context import TEMPERATURES
from app.files.aqdef.fields import OF_VALUES
from app.files.aqdef.writer import Catalogues, Described, Outcome, Part, Validity, Written, write
from app.language.i18n import _
from app.language.times import plant_zone
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.readings import exporting, queries
from app.loop.readings.origin import EMPIRICAL, guid_of
from app.loop.tables.tools import Correction, ToolEvent

MOST = 1000
CORRECTION, CHANGED, EXCLUDED = "correction sent", "tool changed", "excluded"
ZONES = {
    Zone.OVERSIZE: "oversize",
    Zone.UNDERSIZE: "undersize",
    Zone.WEAR: "tool worn",
    Zone.PROBE_FAULT: "probe fault",
}
EVENTS = (CORRECTION, CHANGED, EXCLUDED, *ZONES.values())
IN_EFFECT, NUMBER = "offset in effect, mm", "correction in effect"
GUID = "K0097"
PROCESS = (IN_EFFECT, NUMBER, EMPIRICAL)
"""K0011: the location's offset where it is known, the last correction in effect, and what was taken off the measured size."""
NO_SIZE = {Code.TOUCH_FAULT, Code.FIRST_MOVE_TRIGGERED}
"""Readings whose touches cannot be believed: what stands as their size was not measured."""
OF_THE_READING = {key for key, field in OF_VALUES.items() if field.ours}
"""One that a sender put beside it would be another value, or another time or part."""


class _Of(NamedTuple):
    """A characteristic, its place in the file, and its first and last readings there."""

    place: int
    current: CurrentCharacteristic
    ends: exporting.Ends


def write_aqdef(
    session: Session,
    keys: Sequence[str],
    path: Path,
    *,
    period: Period = ALWAYS,
    last: int | None = None,
    ends: dict[str, exporting.Ends] | None = None,
) -> Outcome:
    """Write the readings of these characteristics. period, last: as `exporting.rows` takes them, for each of them.

    ends: afterwards it has the first and last that were written, by characteristic.

    Raises `NotFound` and `Invalid`.
    """
    if not keys:
        raise Invalid.at("characteristic", _("name at least one"))
    if len(keys) > MOST:
        raise Invalid.at("characteristic", _("at most {most} go into one file").format(most=MOST))
    chosen = [characteristics.characteristic_named(session, key) for key in dict.fromkeys(keys)]
    # Characteristics of one part are together, as the file has them.
    chosen.sort(key=lambda each: (each.characteristic.part or "", each.machine.id, each.characteristic.id))
    parts = list(dict.fromkeys(_part(each) for each in chosen))
    described = [_described(each, parts.index(_part(each))) for each in chosen]
    places = list(dict.fromkeys(each.machine.id for each in chosen))
    names = {each.machine.id: (each.machine.key, each.machine.name) for each in chosen}
    catalogues = Catalogues(
        events=EVENTS,
        machines=[names[place] for place in places],
        gauges=[(names[place][0], f"probe of {names[place][1]}") for place in places],
        process=PROCESS,
    )
    ends = {} if ends is None else ends
    ends |= {each.characteristic.key: exporting.Ends() for each in chosen}
    values = merge(
        *(
            _values(session, _Of(place, each, ends[each.characteristic.key]), period=period, last=last)
            for place, each in enumerate(chosen)
        ),
        key=lambda value: value.at,
    )
    return write(path, parts, described, values, catalogues)


def _part(current: CurrentCharacteristic) -> Part:
    part = current.characteristic.part or current.machine.name
    return Part(part, part, current.machine.key, current.machine.name)


def _described(current: CurrentCharacteristic, part: int) -> Described:
    parameters, characteristic = current.parameters, current.characteristic
    lower, upper = parameters.sizes
    return Described(
        part,
        characteristic.key,
        characteristic.name,
        parameters.target if parameters.nominal is None else parameters.nominal,
        lower,
        upper,
        natural_limit=parameters.natural_limit,
        unit=characteristic.unit,
        decimals=_decimals(parameters),
        gauge=f"probe of {current.machine.name}",
    )


def _decimals(parameters: Parameters) -> int:
    """Places that show a fiftieth of the tolerance, from 3 to 6."""
    return next((places for places in range(3, 6) if parameters.tolerance_width / 50 >= 10.0**-places), 6)


def _values(session: Session, of: _Of, *, period: Period, last: int | None) -> Iterator[Written]:
    entry = queries.entry_named(session, of.current.characteristic.key)
    zone, machine = plant_zone(), of.current.machine
    parameters = of.current.parameters
    changes = _changes(session, machine.id, parameters.tool_memory)
    offsets = _offsets(session, machine.id, parameters.tool_memory)
    before: datetime | None = None
    for row in of.ends.of(exporting.rows(session, entry, period=period, last=last)):
        at: datetime = row["measured_at"]
        changed = before is not None and any(before < each <= at for each in changes)
        before = at
        context = row["context"] or {}
        kept: dict[str, str] = context.get("fields") or {}
        yield Written(
            of.place,
            row["corrected_size"],
            at.astimezone(zone).replace(tzinfo=None, microsecond=0),
            _validity(row, kept.get("K0002", "")),
            row["part"] or "",
            list(dict.fromkeys([*(context.get("events") or ()), *_events(row, changed=changed)])),
            order=context.get("order") or "",
            batch=context.get("batch") or "",
            nest=context.get("nest") or 0,
            operator=context.get("operator") or "",
            machine=context.get("machine") or machine.key,
            gauge=context.get("gauge") or machine.key,
            process=_process(context, row, offsets),
            comment=context.get("comment") or "",
            fields={name: text for name, text in kept.items() if name not in OF_THE_READING}
            | {GUID: guid_of(row["sequence"], row["received_at"])},
        )


def _validity(row: dict[str, Any], as_it_came: str) -> int:
    """K0002: of an excluded reading the one that it came with, if any; touches that cannot be believed are no good value."""
    if row["excluded"] is None:
        return Validity.IMPLAUSIBLE if row["code"] in NO_SIZE else Validity.GOOD
    if as_it_came.isascii() and as_it_came.isdigit():
        return int(as_it_came)
    return Validity.IMPLAUSIBLE if row["zone"] == Zone.PROBE_FAULT else Validity.INVALID


def _events(row: dict[str, Any], *, changed: bool) -> list[str]:
    events = [CHANGED] if changed else []
    if row["correction"] is not None:
        events.append(CORRECTION)
    if row["zone"] in ZONES:
        events.append(ZONES[Zone(row["zone"])])
    return [*events, EXCLUDED] if row["excluded"] is not None else events


def _process(context: dict[str, Any], row: dict[str, Any], offsets: dict[int, float]) -> dict[str, float]:
    process = {name: value for name, value in (context.get("process") or {}).items() if name != EMPIRICAL}
    process |= {each: context[name] for each, name in TEMPERATURES.items() if name in context}
    number = row["correction_in_effect"]
    if number is not None:
        process[NUMBER] = float(number)
        if number in offsets:
            process[IN_EFFECT] = offsets[number]
    empirical = round(row["measured"] - row["corrected_size"], 9)
    return process | {EMPIRICAL: empirical} if empirical else process


def _changes(session: Session, machine_id: int, tool: int) -> list[datetime]:
    here = (ToolEvent.machine_id == machine_id, ToolEvent.number == tool, ToolEvent.kind == "change")
    return list(session.scalars(select(ToolEvent.at).where(*here).order_by(ToolEvent.at)))


def _offsets(session: Session, machine_id: int, tool: int) -> dict[int, float]:
    """The offset after each correction that was applied, by its number."""
    rows = session.execute(
        select(Correction.number, Correction.offset_after).where(
            Correction.machine_id == machine_id, Correction.tool_memory == tool, Correction.offset_after.is_not(None)
        )
    )
    return {number: offset for number, offset in rows if offset is not None}
