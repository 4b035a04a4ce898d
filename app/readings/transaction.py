"""One transaction of readings: decide them in their order, store them, commit.

What readings are judged against stays in memory after the commit. The next ones are decided on it at once, and lock,
proof that it still is what the database holds (`statements.GUARD`), rows and commit travel together. When somebody
else has changed the machine meanwhile, nothing is stored, and it is done again on what is loaded under the lock.
"""

from collections.abc import Sequence
from datetime import UTC, datetime

import psycopg

from app.db.pipeline import Pipeline
from app.errors import DatabaseAway, InbandError, Invalid, OutcomeUnknown
from app.readings.ground import Ground, Stored, Verdict
from app.readings.judge import judge
from app.readings.loading import Book, load
from app.readings.quiet import FEWEST, QuietReadings
from app.readings.records import Entry
from app.readings.saving import save
from app.readings.schemas import MOST_ERRORS, ReadingIn
from app.web.i18n import _

ROLLBACK = (("ROLLBACK",),)
Outcome = Verdict | QuietReadings | Stored | InbandError
"""What became of a reading; `QuietReadings` hold it by its place in the batch."""


class CommitLost(Exception):
    """The connection broke after COMMIT was sent: these outcomes are true if their readings are in the database."""

    def __init__(self, outcomes: list[Outcome]) -> None:
        super().__init__()
        self.outcomes = outcomes


class Doubtful(Exception):
    """A reading would be refused, but what it is refused by has not been asked of the database."""


# The ground is not true any more, a key is known already, or a refused reading may be the repetition of a stored one.
MISTRUST = (psycopg.errors.DivisionByZero, psycopg.errors.UniqueViolation, Doubtful)


async def transact(
    pipeline: Pipeline,
    book: Book,
    ground: Ground,
    wanted: Sequence[tuple[Entry, ReadingIn]],
    *,
    all_or_nothing: bool = False,
    trusting: bool = False,
    tell: bool = True,
) -> list[Outcome]:
    """Decide and store these readings in one transaction, in their order.

    trusting: take the ground for true and the keys for new ones; `MISTRUST` is raised when they are not, or may not be.
    tell: see `save`. Raises `Invalid` naming each refused reading when it is all or nothing, `CommitLost`, and psycopg's errors. The ground
    is of no use then.
    """
    columns = all_or_nothing and trusting and len(wanted) >= FEWEST and _keys_differ(wanted)
    asked = _examples(wanted) if columns else wanted
    begun = not trusting or not all(ground.knows(entry, reading) for entry, reading in asked)
    if begun:
        await load(pipeline, book, ground, asked, trusting=trusting)
    now = datetime.now(UTC)
    quiet = QuietReadings(ground, wanted, now) if columns else None
    outcomes = _decide(ground, wanted, now, quiet)
    if trusting and any(issubclass(kind, InbandError) for kind in set(map(type, outcomes))):
        raise Doubtful
    if all_or_nothing:
        refuse_all(outcomes)
    if not ground.verdicts and quiet is None:
        await pipeline.run(ROLLBACK)
        ground.settle()
        return outcomes
    try:
        await save(pipeline, ground, quiet, begun=begun, tell=tell)
    except psycopg.Error as error:
        if pipeline.closed:
            raise CommitLost(outcomes) from error
        raise
    ground.settle()
    if quiet is not None:
        ground.clear()  # it knows nothing of what the columns hold
    return outcomes


def _examples(wanted: Sequence[tuple[Entry, ReadingIn]]) -> list[tuple[Entry, ReadingIn]]:
    """One reading for each ground that readings of the batch ask for; their keys are new."""
    return list({(e.characteristic_id, r.correction_in_effect, r.machined_at): (e, r) for e, r in wanted}.values())


def _keys_differ(wanted: Sequence[tuple[Entry, ReadingIn]]) -> bool:
    keys = [(entry.characteristic_id, reading.key) for entry, reading in wanted if reading.key is not None]
    return len(set(keys)) == len(keys)


def _decide(
    ground: Ground, wanted: Sequence[tuple[Entry, ReadingIn]], now: datetime, quiet: QuietReadings | None
) -> list[Outcome]:
    """Decide the readings in their order: those that ask for nothing as columns, if there are any, the others one by one."""
    outcomes: list[Outcome] = []
    while True:
        if quiet is not None:
            outcomes += [quiet] * (quiet.run(len(outcomes)) - len(outcomes))
        at = len(outcomes)
        if at == len(wanted):
            break
        if quiet is not None:
            quiet.hand_over(at)
        try:
            outcomes.append(judge(ground, *wanted[at], now))
        except InbandError as refusal:
            outcomes.append(refusal)
        if quiet is not None:
            quiet.take_back(at)
    if quiet is not None:
        quiet.close()
    return outcomes


def new_ones(outcomes: Sequence[Outcome]) -> list[Verdict]:
    """The readings that were stored now, each once, in their order."""
    verdicts = [o.verdict(at) if isinstance(o, QuietReadings) else o for at, o in enumerate(outcomes)]
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
    kind = kinds.pop() if len(kinds) == 1 else Invalid
    raise kind(
        _("%(count)s of %(all)s readings cannot be taken; the first is [%(first)s]: %(detail)s")
        % {"count": len(refused), "all": len(outcomes), "first": refused[0][0], "detail": refused[0][1].detail},
        _("Nothing of this batch was stored. Correct what is named under errors and send the batch again."),
        errors=errors,
    )
