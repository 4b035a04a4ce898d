"""One transaction of readings: decide them in their order, store them, commit.

Optimistic: what readings are decided against stays in memory after the commit. The next ones are decided on that snapshot
at once, and lock, proof that it still is what the database holds (`statements.GUARD`), rows and commit travel together: an
optimistic lock. Pessimistic: when someone else has changed the machine meanwhile, nothing is stored, and it is done again
on what is loaded under the lock.
"""

from collections.abc import Sequence
from datetime import UTC, datetime

import psycopg

from app.db.pipeline import Pipeline
from app.errors import DatabaseAway, InbandError, Invalid, OutcomeUnknown
from app.language.i18n import _
from app.loop.readings.miscounted import STOP, TooManyTouches
from app.loop.readings.records import Entry
from app.loop.readings.schemas import MOST_ERRORS, ReadingIn
from app.loop.readings.writer.columnar import FEWEST, ColumnarReadings, Outcome, decide_in_columns
from app.loop.readings.writer.decide import decide_one_by_one
from app.loop.readings.writer.load import ParametersCache, load
from app.loop.readings.writer.pending import PendingWrites, Stored, Verdict
from app.loop.readings.writer.save import save
from app.loop.readings.writer.snapshot import Snapshot

ROLLBACK = (("ROLLBACK",),)
COMMIT = (("COMMIT",),)


class CommitLost(Exception):
    """The connection broke after COMMIT was sent: these outcomes are true if their readings are in the database."""

    def __init__(self, outcomes: list[Outcome]) -> None:
        super().__init__()
        self.outcomes = outcomes


class StaleSnapshot(Exception):
    """A reading would be refused, but what it is refused by has not been asked of the database."""


# The snapshot is not true any more, a key is known already, or a refused reading may be the repetition of a stored one.
# InternalError_: Citus tells the unique violation of another node by its words, but not always by its code.
STALE = (psycopg.errors.DivisionByZero, psycopg.errors.UniqueViolation, psycopg.errors.InternalError_, StaleSnapshot)


async def transact(
    pipeline: Pipeline,
    parameters: ParametersCache,
    snapshot: Snapshot,
    readings: Sequence[tuple[Entry, ReadingIn]],
    *,
    all_or_nothing: bool = False,
    optimistic: bool = False,
    notify: bool = True,
) -> list[Outcome]:
    """Decide and store these readings in one transaction, in their order.

    optimistic: take the snapshot for true and the keys for new ones; an error of `STALE` is raised when they are not, or may
    not be. notify: see `save`. Raises `Invalid` naming each refused reading when it is all or nothing, `CommitLost`, and
    psycopg's errors. The snapshot is of no use then.
    """
    needed = _examples(readings) if optimistic else readings
    begun = not optimistic or not all(snapshot.covers(entry, reading) for entry, reading in needed)
    if begun:
        await load(pipeline, parameters, snapshot, needed, optimistic=optimistic)
    columnar = (
        all_or_nothing
        and optimistic
        and len(readings) >= FEWEST
        and _keys_differ(readings)
        and not any(_one_by_one(snapshot, number) for number in {entry.characteristic_id for entry, _ in readings})
    )
    decide_all = decide_in_columns if columnar else decide_one_by_one
    pending = PendingWrites(snapshot)
    outcomes: list[Outcome] = [*decide_all(pending, readings, datetime.now(UTC))]
    if optimistic and any(issubclass(kind, InbandError) for kind in set(map(type, outcomes))):
        raise StaleSnapshot
    if all_or_nothing:
        refuse_all(outcomes)
    if pending.touched:
        try:
            await save(pipeline, pending, begun=begun, notify=notify)
        except psycopg.Error as error:
            if pipeline.closed:
                raise CommitLost(outcomes) from error
            raise
    else:
        # A reading that is known already may be here alone: a commit that was broken off while it waited for its standby is
        # seen, and gone with this server. Having locked a machine, this commit waits for the standby too, and for all before it.
        await pipeline.run(COMMIT if any(isinstance(outcome, Stored) for outcome in outcomes) else ROLLBACK)
    pending.settle()
    return outcomes


def _examples(readings: Sequence[tuple[Entry, ReadingIn]]) -> list[tuple[Entry, ReadingIn]]:
    """Return one reading for each state that readings ask for; their keys are new."""
    return list({(e.characteristic_id, r.correction_in_effect, r.machined_at): (e, r) for e, r in readings}.values())


def _one_by_one(snapshot: Snapshot, characteristic_id: int) -> bool:
    """Tell if readings of a characteristic bring more with them than their own row."""
    return characteristic_id in snapshot.plans or bool(snapshot.streams[characteristic_id].forms)


def _keys_differ(readings: Sequence[tuple[Entry, ReadingIn]]) -> bool:
    keys = [(entry.characteristic_id, reading.key) for entry, reading in readings if reading.key is not None]
    return len(set(keys)) == len(keys)


def new_verdicts(outcomes: Sequence[Outcome]) -> list[Verdict]:
    """Return the readings that were stored now, each once, in their order."""
    verdicts = [o.verdict(at) if isinstance(o, ColumnarReadings) else o for at, o in enumerate(outcomes)]
    return list({id(verdict): verdict for verdict in verdicts if isinstance(verdict, Verdict)}.values())


def refuse_all(outcomes: Sequence[Outcome]) -> None:
    """Raise one error that names every refused reading by its position."""
    refused = [(at, outcome) for at, outcome in enumerate(outcomes) if isinstance(outcome, InbandError)]
    if not refused:
        return
    away = next((error for _at, error in refused if isinstance(error, DatabaseAway | OutcomeUnknown)), None)
    if away is not None:
        raise away
    errors = [
        error._replace(field=f"[{at}].{error.field}")
        for at, refusal in refused[:MOST_ERRORS]
        for error in refusal.errors
    ]
    kinds = {type(refusal) for _, refusal in refused}
    miscounted = next((error for _at, error in refused if isinstance(error, TooManyTouches)), None)
    kind = kinds.pop() if len(kinds) == 1 and miscounted is None else Invalid
    raise kind(
        _("%(count)s of %(all)s readings cannot be taken; the first is [%(first)s]: %(detail)s")
        % {"count": len(refused), "all": len(outcomes), "first": refused[0][0], "detail": refused[0][1].detail},
        _("Nothing of this batch was stored. Correct what is named under errors and send the batch again."),
        errors=errors,
        **({} if miscounted is None else STOP),
    ) from miscounted
