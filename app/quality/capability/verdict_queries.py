"""The index of every characteristic at once, for the overview: as the periodic job stored it. Never writes. Lengths in mm.

The same window and the same decision as on the page of a characteristic. Where nothing is stored yet, or what is stored is
older than it may be, the index is worked out on the spot, for a bounded number of characteristics.
"""

from collections.abc import Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import NamedTuple

from sqlalchemy import select, text
from sqlalchemy.orm import Session

from app.core.spc.quoting import RULE, Quote, WhyNot
from app.loop.characteristics.queries import characteristic_named
from app.loop.summaries import queries as statistics
from app.quality.capability.kinds import Week
from app.quality.capability.queries import USUAL, Judgement, judgement_of
from app.quality.capability.tables import CapabilityVerdict
from app.quality.capability.weekly import weeks_of

DUE_SHARE, DUE_AFTER = 0.02, timedelta(minutes=10)
"""The job works an index out again after this share of new readings among those it is of, or after so long with any."""
OLD_SHARE, OLD_AFTER = 0.04, timedelta(hours=1)
"""Beyond these an index is worked out on the spot, of this many characteristics at most; others show what is stored."""
MOST_ON_THE_SPOT = 25
NOT_YET = "not_yet"
"""The reason where nothing is stored yet."""

_STATE = """
SELECT c.key, s.machine_id, s.characteristic_id, s.sequence AS newest, s.parameters_version, b.version AS baseline,
    (SELECT count(*) FROM exclusion e WHERE e.machine_id = s.machine_id AND e.characteristic_id = s.characteristic_id)
        AS excluded
FROM stream s
JOIN characteristic c ON c.machine_id = s.machine_id AND c.id = s.characteristic_id
LEFT JOIN LATERAL (
    SELECT CASE WHEN retired_at IS NULL THEN version END AS version FROM baseline
    WHERE machine_id = s.machine_id AND characteristic_id = s.characteristic_id ORDER BY version DESC LIMIT 1
) b ON true
WHERE (CAST(:machine AS int) IS NULL OR s.machine_id = :machine)
    AND (CAST(:characteristic AS int) IS NULL OR s.characteristic_id = :characteristic)
"""


class State(NamedTuple):
    """State of a characteristic that its index depends on: newest reading, parameters, baseline in force, excluded readings."""

    key: str
    machine_id: int
    characteristic_id: int
    newest: int
    parameters_version: int
    baseline: int | None
    excluded: int


class Stored(NamedTuple):
    """Verdicts that the job stored of one characteristic: of its newest readings, and the last that could be quoted, or the same."""

    newest: CapabilityVerdict | None = None
    quotable: CapabilityVerdict | None = None


class Verdict(NamedTuple):
    """The index to show, and those of the last weeks. now: why the newest readings carry none (`Quoting.why`), where an older one is shown."""

    of: CapabilityVerdict
    now: str | None = None
    weeks: Sequence[Week] = ()


def verdicts_by_characteristic(session: Session, machine_id: int | None = None) -> dict[int, Verdict]:
    """By the id of the characteristic, of one machine or of all."""
    now, left = datetime.now(UTC), MOST_ON_THE_SPOT
    verdicts = {}
    for state, stored in states(session, machine_id):
        newest, before = stored
        weeks = weeks_of(newest.weeks if newest else None)
        if left and (newest is None or is_older(newest, state, now, OLD_SHARE, OLD_AFTER)):
            newest, before = verdicts_of(session, state, before)
            left -= 1
        newest = newest or _not_yet()
        verdicts[state.characteristic_id] = (
            Verdict(newest, weeks=weeks) if newest.quotable or before is None else Verdict(before, newest.why, weeks)
        )
    return verdicts


def states(
    session: Session, machine_id: int | None = None, characteristic_id: int | None = None
) -> list[tuple[State, Stored]]:
    """Every characteristic, of all machines or of one, or one of them, with what is stored of it."""
    query = select(CapabilityVerdict)
    if machine_id is not None:
        query = query.where(CapabilityVerdict.machine_id == machine_id)
    if characteristic_id is not None:
        query = query.where(CapabilityVerdict.characteristic_id == characteristic_id)
    rows = {(row.machine_id, row.characteristic_id, row.quotable): row for row in session.scalars(query)}
    result = []
    places = {"machine": machine_id, "characteristic": characteristic_id}
    for state in (State(*row) for row in session.execute(text(_STATE), places)):
        place = (state.machine_id, state.characteristic_id)
        quotable = rows.get((*place, True))
        result.append((state, Stored(rows.get((*place, False), quotable), quotable)))
    return result


def is_older(row: CapabilityVerdict, state: State, now: datetime, share: float, after: timedelta) -> bool:
    """Tell whether something that it depends on has changed, or enough new readings have come, or some so long ago."""
    depends = (state.parameters_version, state.baseline, state.excluded, RULE)
    if (row.parameters_version, row.baseline, row.excluded, row.rule) != depends:
        return True
    new = state.newest - row.newest
    return new > share * row.readings or (new > 0 and row.at < now - after)


def verdicts_of(
    session: Session, state: State, before: CapabilityVerdict | None
) -> tuple[CapabilityVerdict, CapabilityVerdict | None]:
    """Work out the index of the last readings, and where it may not be quoted, the last one that could be.

    before: the one that is stored. It goes on to be the last, unless the tolerance has changed; one that was judged by an older
    rule is judged again, of its own readings. Where none is, and one reading lies far from all others, it is that of the
    readings before.
    """
    current = characteristic_named(session, state.key)
    window = statistics.window_of(session, current.characteristic, last=USUAL, usable=True)
    judgement = judgement_of(session, current, window)
    row = _row(judgement, state)
    if row.quotable:
        return row, row
    if before is not None and before.rule != RULE:
        assert before.first is not None
        assert before.last is not None
        own = replace(window, first=before.first, last=before.last)
        before = _row(judgement_of(session, current, own), state)
    if before is not None and before.quotable and before.half == row.half:
        return row, before
    if row.why == WhyNot.FAR_OFF.value:
        earlier = _row(judgement_of(session, current, replace(window, last=judgement.far[0] - 1)), state)
        return row, earlier if earlier.quotable else None
    return row, None


def _row(judgement: Judgement, state: State) -> CapabilityVerdict:
    quoting, sequence = judgement.quoting, judgement.sequence
    return CapabilityVerdict(
        machine_id=state.machine_id,
        characteristic_id=state.characteristic_id,
        quotable=quoting.value is not None,
        at=datetime.now(UTC),
        newest=state.newest,
        parameters_version=state.parameters_version,
        baseline=state.baseline,
        excluded=state.excluded,
        rule=RULE,
        half=judgement.half,
        readings=len(sequence),
        first=int(sequence[0]) if len(sequence) else None,
        last=int(sequence[-1]) if len(sequence) else None,
        first_at=judgement.first_at,
        last_at=judgement.last_at,
        quote=quoting.quote.value,
        value=quoting.value,
        low=quoting.low,
        high=quoting.high,
        preliminary=quoting.preliminary,
        why=quoting.why,
    )


def _not_yet() -> CapabilityVerdict:
    return CapabilityVerdict(
        quotable=False, at=datetime.now(UTC), readings=0, quote=Quote.NONE.value, preliminary=False, why=NOT_YET
    )
