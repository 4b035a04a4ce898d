"""Readings by their context: those of an order, a nest, an operator …, and the strata that a run of readings has. Never writes.

There is no index on contexts: each would cost every reading that has one. A characteristic's contexts lie together in the order of
its readings, and are walked through: of a million readings in well under a second.
"""

import json
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import ColumnElement, exists, text
from sqlalchemy.orm import Session

from app.core.context import Chosen, ContextField, as_stored
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.readings import Reading, ReadingContext

Whole = NDArray[np.int64]
LOOKED_AT = 1_000  # newest contexts, for the values that a form offers
MOST_OFFERED = 50  # values of a field
MOST_STRATA = 12
MOST_NAMED = 100  # of which those are taken that the chosen readings have
WITHOUT, OLDER = -1, -2
"""In place of the number of a stratum: the reading has none; it is one of more than `MOST_STRATA`."""

_HERE = "machine_id = :machine AND characteristic_id = :characteristic"
_ENDS = f"""
SELECT min(sequence), max(sequence) FROM (
    SELECT sequence FROM reading_context WHERE {_HERE} AND sequence BETWEEN :first AND :last
        AND context @> CAST(:context AS jsonb) ORDER BY sequence DESC LIMIT :last_ones
) AS found
"""  # noqa: S608 - made of our own names
# A field may say something else of every part, such as a serial number: all but the newest names are one row without a name.
_STRATA = f"""
WITH said AS (
    SELECT context ->> :field AS name, sequence FROM reading_context
    WHERE {_HERE} AND sequence BETWEEN :first AND :last AND context ->> :field IS NOT NULL
), newest AS (SELECT name FROM said GROUP BY name ORDER BY max(sequence) DESC LIMIT {MOST_NAMED})
SELECT newest.name, string_agg(int8send(said.sequence), ''::bytea) AS sequences, max(said.sequence) AS newest_one
FROM said LEFT JOIN newest USING (name) GROUP BY newest.name ORDER BY newest.name IS NULL, newest_one DESC
"""  # noqa: S608 - made of our own names
_MATCHING = f"""
SELECT string_agg(int8send(sequence), ''::bytea) FROM reading_context
WHERE {_HERE} AND sequence BETWEEN :first AND :last AND context @> CAST(:context AS jsonb)
"""  # noqa: S608 - made of our own names
_OFFERED = f"""
SELECT field.key, field.value FROM (
    SELECT sequence, context FROM reading_context WHERE {_HERE} ORDER BY sequence DESC LIMIT {LOOKED_AT}
) AS newest, jsonb_each_text(newest.context) AS field WHERE field.key = ANY(:fields)
GROUP BY 1, 2 ORDER BY max(newest.sequence) DESC, 2
"""  # noqa: S608 - made of our own names


def written(chosen: Chosen) -> str:
    """The chosen values as JSON, for `@>`."""
    return json.dumps(as_stored(chosen))


def in_context(chosen: Chosen) -> ColumnElement[bool]:
    """Condition on `Reading` that its context has all of these values."""
    return exists().where(
        ReadingContext.machine_id == Reading.machine_id,
        ReadingContext.characteristic_id == Reading.characteristic_id,
        ReadingContext.sequence == Reading.sequence,
        ReadingContext.context.contains(as_stored(chosen)),
    )


def in_context_sql(chosen: Chosen, of: str) -> str:
    """The same in SQL as text, to be appended; `of`: the reading's table. :context is `written(chosen)`. Empty where nothing is chosen."""
    if not chosen:
        return ""
    return (
        f" AND EXISTS (SELECT FROM reading_context c WHERE c.machine_id = {of}.machine_id AND c.characteristic_id = "
        f"{of}.characteristic_id AND c.sequence = {of}.sequence AND c.context @> CAST(:context AS jsonb))"
    )


def ends_in_context(
    session: Session, characteristic: Characteristic, chosen: Chosen, first: int, last: int, last_ones: int | None
) -> tuple[int, int]:
    """The first and the last reading with this context of first … last, of the newest `last_ones`; (1, 0) where there is none."""
    where = _where(characteristic, first, last) | {"context": written(chosen), "last_ones": last_ones}
    low, high = session.execute(text(_ENDS), where).one()
    return (low, high) if low is not None else (1, 0)


def sequences_in_context(
    session: Session, characteristic: Characteristic, chosen: Chosen, first: int, last: int
) -> Whole:
    """Numbers of the readings of first … last with this context, in no order."""
    where = _where(characteristic, first, last) | {"context": written(chosen)}
    return _numbers(session.scalar(text(_MATCHING), where))


class Strata(NamedTuple):
    """Strata of some readings: their names, the newest first, and the place of each reading's name, `WITHOUT` or `OLDER`."""

    names: list[str]
    labels: Whole


def strata_of(session: Session, characteristic: Characteristic, field: ContextField, sequence: Whole) -> Strata:
    """Tell these readings (ascending) apart by a field of their context."""
    labels = np.full(len(sequence), WITHOUT, np.int64)
    names: list[str] = []
    if not len(sequence):
        return Strata(names, labels)
    where = _where(characteristic, int(sequence[0]), int(sequence[-1])) | {"field": field.value}
    for name, packed, _newest in session.execute(text(_STRATA), where):
        numbers = _numbers(packed)
        at = np.searchsorted(sequence, numbers)
        at = at[sequence[np.minimum(at, len(sequence) - 1)] == numbers]
        if not len(at):
            continue
        is_named = name is not None and len(names) < MOST_STRATA
        labels[at] = len(names) if is_named else OLDER
        if is_named:
            names.append(name)
    return Strata(names, labels)


def offered(session: Session, characteristic: Characteristic) -> dict[ContextField, list[str]]:
    """The values that the newest readings have, by field, the newest first: what a form offers to choose from."""
    where = {"machine": characteristic.machine_id, "characteristic": characteristic.id}
    found: dict[ContextField, list[str]] = {}
    for field, value in session.execute(text(_OFFERED), where | {"fields": list(ContextField)}):
        found.setdefault(ContextField(field), []).append(value)
    return {field: found[field][:MOST_OFFERED] for field in ContextField if field in found}


def _where(characteristic: Characteristic, first: int, last: int) -> dict[str, int]:
    return {"machine": characteristic.machine_id, "characteristic": characteristic.id, "first": first, "last": last}


def _numbers(packed: bytes | None) -> Whole:
    return np.frombuffer(packed or b"", ">i8").astype(np.int64)
