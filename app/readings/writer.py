"""Group commit: readings that arrive together are decided and stored together, and none is answered before the commit.

One writer per process takes what is waiting, without gathering: while one transaction commits, the next readings
collect. A reading that is refused fails alone.

What readings are judged against stays in memory after the commit. The next ones are decided on it at once, and lock,
proof that it still is what the database holds (`statements.GUARD`), rows and commit travel together. When somebody
else has changed the machine meanwhile, nothing is stored, and it is done again on what is loaded under the lock.

When the connection breaks, it is done again as well; when it breaks after the commit was sent, the database is asked
whether the readings are there, so that none is lost or stored twice.
"""

import asyncio
import gc
import logging
from collections.abc import Sequence
from datetime import UTC, datetime
from time import monotonic

import psycopg
from psycopg import AsyncConnection

from app.db.engine import LIMITS
from app.db.pipeline import Pipeline
from app.errors import DatabaseAway, InbandError, Invalid, OutcomeUnknown
from app.readings.ground import Ground, Stored, Verdict
from app.readings.judge import judge
from app.readings.quiet import FEWEST, QuietReadings
from app.readings.records import Entry
from app.readings.schemas import MOST_ERRORS, ReadingIn
from app.readings.store import Book, load, save
from app.web.i18n import _

log = logging.getLogger(__name__)

ROLLBACK = (("ROLLBACK", None),)
Outcome = Verdict | QuietReadings | Stored | InbandError
"""What became of a reading; `QuietReadings` hold it by its place in the batch."""
MOST_AT_ONCE = 256
MOST_WAITING = 20_000
MOST_SPARE = 2  # connections kept for batches
PATIENCE = 5.0  # s that a reading waits for a database that is away, before it is answered 503


SHY = 16  # transactions that load what they need, after one whose memory was not true any more


class CommitLost(Exception):
    """The connection broke after COMMIT was sent: these outcomes are true if their readings are in the database."""

    def __init__(self, outcomes: list[Outcome]) -> None:
        super().__init__()
        self.outcomes = outcomes


class Doubtful(Exception):
    """A reading would be refused, but what it is refused by has not been asked of the database."""


# The ground is not true any more, a key is known already, or a refused reading may be the repetition of a stored one.
MISTRUST = (psycopg.errors.DivisionByZero, psycopg.errors.UniqueViolation, Doubtful)

# Every statement of the writer finds its rows by an index, however small the tables are when it is first planned; planned
# anew each time, the planning would cost more than the work.
PLANNER = "-c plan_cache_mode=force_generic_plan -c enable_seqscan=off -c enable_sort=off -c enable_hashjoin=off"


async def connect(dsn: str) -> Pipeline:
    """A connection for readings: statements prepared at their first use, transactions by our own word."""
    connection = await AsyncConnection.connect(
        dsn, autocommit=True, options=f"{LIMITS} {PLANNER}", application_name="inband-readings", connect_timeout=5
    )
    return Pipeline(connection)


async def transact(
    pipeline: Pipeline,
    book: Book,
    ground: Ground,
    wanted: Sequence[tuple[Entry, ReadingIn]],
    *,
    all_or_nothing: bool = False,
    trusting: bool = False,
) -> list[Outcome]:
    """Decide and store these readings in one transaction, in their order.

    trusting: take the ground for true and the keys for new ones; `MISTRUST` is raised when they are not, or may not be.
    Raises `Invalid` naming each refused reading when it is all or nothing, `CommitLost`, and psycopg's errors. The ground
    is of no use then.
    """
    begun = not trusting or not all(ground.knows(entry, reading) for entry, reading in wanted)
    if begun:
        await load(pipeline, book, ground, wanted, trusting=trusting)
    now = datetime.now(UTC)
    quiet = None
    if all_or_nothing and trusting and len(wanted) >= FEWEST and _keys_differ(wanted):
        quiet = QuietReadings(ground, wanted, now)
    outcomes = _decide(ground, wanted, now, quiet)
    if trusting and any(isinstance(outcome, InbandError) for outcome in outcomes):
        raise Doubtful
    if all_or_nothing:
        refuse_all(outcomes)
    if not ground.verdicts and quiet is None:
        await pipeline.run(ROLLBACK)
        ground.settle()
        return outcomes
    try:
        await save(pipeline, ground, quiet, begun=begun)
    except psycopg.Error as error:
        if pipeline.closed:
            raise CommitLost(outcomes) from error
        raise
    ground.settle()
    if quiet is not None:
        ground.clear()  # it knows nothing of what the columns hold
    return outcomes


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


class Keeper:
    """Stores readings over one connection, and sees to it when the database goes away in the middle."""

    def __init__(self, dsn: str, book: Book) -> None:
        self.dsn = dsn
        self.book = book
        self._ground = Ground()
        self._shy = 0
        self._pipeline: Pipeline | None = None
        self._away_since: float | None = None

    async def close(self) -> None:
        """Give the connection back."""
        if self._pipeline is not None:
            await self._pipeline.connection.close()

    async def store(self, wanted: Sequence[tuple[Entry, ReadingIn]], *, all_or_nothing: bool = False) -> list[Outcome]:
        """What becomes of each reading, after the commit. Raises only when it is all or nothing."""
        # Whoever comes while the database has been away for long is not kept waiting once more.
        deadline = (monotonic() if self._away_since is None else self._away_since) + PATIENCE
        pause = 0.02
        trusting = not self._shy
        while True:
            try:
                if self._pipeline is None or self._pipeline.closed:
                    self._pipeline = await connect(self.dsn)
                self._pipeline.look()
                outcomes = await transact(
                    self._pipeline, self.book, self._ground, wanted, all_or_nothing=all_or_nothing, trusting=trusting
                )
            except CommitLost as lost:
                self._ground = Ground()
                if (settled := await self._settle(lost, deadline)) is not None:
                    return settled
            except psycopg.OperationalError as error:
                await self._roll_back()
                self._away_since = self._away_since or monotonic()
                if monotonic() + pause > deadline:
                    log.warning("readings could not be stored, the database is away: %s", error)
                    return [DatabaseAway()] * len(wanted)
                await asyncio.sleep(pause)
                pause = min(2 * pause, 0.5)
            except InbandError:
                await self._roll_back()
                self._away_since = None
                raise
            except Exception as error:
                await self._roll_back()
                if trusting and isinstance(error, MISTRUST):
                    trusting = False
                    if isinstance(error, psycopg.errors.DivisionByZero):
                        self._shy = SHY
                    continue
                if all_or_nothing:
                    raise
                if len(wanted) == 1:
                    log.exception("a reading of %s could not be stored", wanted[0][0].characteristic)
                    return [_unexpected()]
                log.exception("%s readings together could not be stored; storing them one by one", len(wanted))
                return [(await self.store([item]))[0] for item in wanted]
            else:
                self._away_since = None
                self._shy = max(0, self._shy - 1)
                return outcomes

    async def _roll_back(self) -> None:
        self._ground = Ground()
        if self._pipeline is not None and not self._pipeline.closed:
            try:
                await self._pipeline.run(ROLLBACK)
            except psycopg.Error:
                await self._pipeline.connection.close()

    async def _settle(self, lost: CommitLost, deadline: float) -> list[Outcome] | None:
        """How the commit ended: its outcomes if it is in the database, None if it must be done again."""
        pause = 0.02
        while True:
            try:
                self._pipeline = await connect(self.dsn)
                return lost.outcomes if await committed(self._pipeline, lost) else None
            except psycopg.OperationalError as error:
                log.warning("how a commit ended cannot be asked yet: %s", error)
            if monotonic() + pause > deadline:
                return [OutcomeUnknown() if isinstance(o, Verdict | QuietReadings) else o for o in lost.outcomes]
            await asyncio.sleep(pause)
            pause = min(2 * pause, 0.5)


async def committed(pipeline: Pipeline, lost: CommitLost) -> bool:
    """Whether the transaction whose commit was sent has stored its readings; if not, it cannot any more.

    Under the lock of a machine it has either ended or not begun, and moving the version keeps it from beginning.
    """
    first = new_ones(lost.outcomes)[0]
    entry = first.stream.entry
    async with pipeline.connection.transaction():
        await pipeline.connection.execute(
            "UPDATE machine_state SET version = version + 1 WHERE machine_id = %s", (entry.machine_id,)
        )
        cursor = await pipeline.connection.execute(
            "SELECT 1 FROM reading WHERE machine_id = %s AND characteristic_id = %s AND sequence = %s AND received_at = %s",
            (entry.machine_id, entry.characteristic_id, first.sequence, first.received_at),
        )
        return await cursor.fetchone() is not None


def store_batch(
    dsn: str, book: Book, wanted: Sequence[tuple[Entry, ReadingIn]], spare: list[Keeper] | None = None
) -> list[Outcome]:
    """Store a batch, all or nothing, from a thread of its own: it would keep the loop of the single readings waiting.

    spare: where keepers, and with them connections, are taken from and left for the next batch.
    """

    async def stored() -> list[Outcome]:
        keeper = spare.pop() if spare else Keeper(dsn, book)
        try:
            outcomes = await keeper.store(wanted, all_or_nothing=True)
        except BaseException:
            await keeper.close()
            raise
        if spare is None or len(spare) >= MOST_SPARE:
            await keeper.close()
        else:
            spare.append(keeper)
        return outcomes

    # All of a batch lives until it is stored: looking through it for garbage every few hundred objects doubles its time.
    gc.disable()
    try:
        outcomes = asyncio.run(stored())
    finally:
        gc.enable()
    refuse_all(outcomes)
    return outcomes


class Writer:
    """The one who stores the single readings of a process."""

    def __init__(self, dsn: str) -> None:
        self.book: Book = {}
        self.spare: list[Keeper] = []
        self._keeper = Keeper(dsn, self.book)
        self._waiting: list[tuple[Entry, ReadingIn, asyncio.Future[Outcome]]] = []
        self._wake = asyncio.Event()
        self._ending = False
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin to take readings; call it on the loop that serves requests."""
        self._task = asyncio.get_running_loop().create_task(self._run(), name="readings writer")

    async def stop(self) -> None:
        """Store what is waiting, then end."""
        self._ending = True
        self._wake.set()
        if self._task:
            await self._task
        for keeper in (self._keeper, *self.spare):
            await keeper.close()

    def submit(self, entry: Entry, reading: ReadingIn) -> asyncio.Future[Outcome]:
        """Hand a reading over; the future holds its outcome after the commit."""
        if len(self._waiting) >= MOST_WAITING:
            raise DatabaseAway(_("Too many readings are waiting to be stored. Nothing of this request was stored."))
        future: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()
        self._waiting.append((entry, reading, future))
        self._wake.set()
        return future

    async def _run(self) -> None:
        while self._waiting or not self._ending:
            await self._wake.wait()
            batch, self._waiting = self._waiting[:MOST_AT_ONCE], self._waiting[MOST_AT_ONCE:]
            if not self._waiting:
                self._wake.clear()
            if not batch:
                continue
            try:
                outcomes = await self._keeper.store([item[:2] for item in batch])
            except Exception:
                log.exception("the writer met what nobody foresaw")
                outcomes = [OutcomeUnknown()] * len(batch)
            for (_entry, _reading, future), outcome in zip(batch, outcomes, strict=True):
                if not future.done():  # the client may be gone; what it sent is stored all the same
                    future.set_result(outcome)


def _unexpected() -> InbandError:
    return InbandError(
        _("This reading could not be stored because of a fault in the server. It was not stored."),
        _("Keep the reading and tell whoever runs the server; its log names the fault."),
    )
