"""Prepared statements sent together and answered together: one round trip, one wake-up of the event loop.

psycopg's own pipelines wait for every statement by itself, which costs the writer of readings more than the database
does. This speaks libpq through `psycopg.pq`, on a connection that psycopg has made: parameters go and rows come as text.
"""

import asyncio
from collections.abc import Sequence
from itertools import count

from psycopg.errors import OperationalError, error_from_result
from psycopg.pq import ExecStatus, TransactionStatus
from psycopg.pq.abc import PGresult

from app.db.connections import LOOK, WatchedAsyncConnection

Step = tuple[str, *tuple[str, ...]]
"""A statement and its parameters."""
Rows = list[tuple[bytes | None, ...]]

_names = count()


class Pipeline:
    """One connection and the statements that have been prepared on it."""

    def __init__(self, connection: WatchedAsyncConnection, *, distributed: bool = False) -> None:
        """distributed: the tables may lie on another node (`app.db.citus`), where nobody listens for notifications."""
        self.connection = connection
        self.distributed = distributed
        self.begin: tuple[Step, ...] = (("BEGIN",),)
        """By which transactions begin that say so."""
        self.until: float | None = None
        """By the clock of the event loop: when waiting for an answer ends. None: as long as the database is heard."""
        self._prepared: dict[str, bytes] = {}

    @property
    def closed(self) -> bool:
        """Tell if the connection is of no use any more."""
        return self.connection.closed

    @property
    def begun(self) -> bool:
        """Tell if a transaction is open, or has failed and waits for its ROLLBACK."""
        return self.connection.pgconn.transaction_status != TransactionStatus.IDLE

    def look(self) -> None:
        """See whether the server has ended the idle connection meanwhile, which it says by itself, or is silent.

        Raises psycopg's `OperationalError`. Found out only after statements were sent, nobody knew what became of them.
        """
        self.connection.check()
        pgconn = self.connection.pgconn
        for _last_words_then_end in range(2):
            pgconn.consume_input()
            pgconn.is_busy()

    async def run(self, steps: Sequence[Step]) -> list[Rows]:
        """Run the statements in their order; the rows of each.

        The first one that fails ends it: what comes after is not run. They are a transaction of their own where none has
        begun. Raises psycopg's errors.
        """
        pgconn = self.connection.pgconn
        asked_for: list[bool] = []  # whether the answer is one that was asked for, or that of a preparation
        preparing: dict[str, bytes] = {}
        pgconn.enter_pipeline_mode()
        for statement, *parameters in steps:
            name = self._prepared.get(statement) or preparing.get(statement)
            if name is None:
                name = preparing[statement] = b"inband_%d" % next(_names)
                pgconn.send_prepare(name, statement.encode())
                asked_for.append(False)
            pgconn.send_query_prepared(name, [parameter.encode() for parameter in parameters])
            asked_for.append(True)
        pgconn.pipeline_sync()
        results = await self._results()
        pgconn.exit_pipeline_mode()
        for result in results:
            if result.status not in (ExecStatus.TUPLES_OK, ExecStatus.COMMAND_OK):
                raise error_from_result(result)
        self._prepared |= preparing
        return [_rows(result) for result, is_asked in zip(results, asked_for, strict=True) if is_asked]

    async def _results(self) -> list[PGresult]:
        """One result for each thing sent, and one more where only the commit at the end of them failed."""
        pgconn = self.connection.pgconn
        results: list[PGresult] = []
        unsent = bool(pgconn.flush())
        while True:
            while not pgconn.is_busy():
                result = pgconn.get_result()
                if result is None:
                    continue  # the end of one statement's answer
                if result.status == ExecStatus.PIPELINE_SYNC:
                    return results
                results.append(result)
            if not await _ready(pgconn.socket, write=unsent):
                self._look_up()
            pgconn.consume_input()
            unsent = unsent and bool(pgconn.flush())

    def _look_up(self) -> None:
        """Go on waiting, or close the connection: what was sent may still be done."""
        self.connection.check()
        if self.until is not None and asyncio.get_running_loop().time() > self.until:
            self.connection.pgconn.finish()
            raise OperationalError("the database has taken too long to answer")


async def _ready(socket: int, *, write: bool) -> bool:
    """Wait for a moment until there is something to read, or room to send the rest; whether there is."""
    loop = asyncio.get_running_loop()
    woken: asyncio.Future[bool] = loop.create_future()

    def wake(ready: bool = True) -> None:
        if not woken.done():
            woken.set_result(ready)

    looking_up = loop.call_later(LOOK, wake, False)
    loop.add_reader(socket, wake)
    if write:
        loop.add_writer(socket, wake)
    try:
        return await woken
    finally:
        looking_up.cancel()
        loop.remove_reader(socket)
        if write:
            loop.remove_writer(socket)


def _rows(result: PGresult) -> Rows:
    columns = range(result.nfields)
    return [tuple(result.get_value(row, column) for column in columns) for row in range(result.ntuples)]
