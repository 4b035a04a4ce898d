"""Prepared statements sent together and answered together: one round trip, one wake-up of the event loop.

psycopg's own pipelines wait for every statement by itself, which costs the writer of readings more than the database
does. This speaks libpq through `psycopg.pq`, on a connection that psycopg has made: parameters go and rows come as text.
"""

import asyncio
from collections.abc import Sequence
from itertools import count
from typing import Any

from psycopg import AsyncConnection
from psycopg.errors import error_from_result
from psycopg.pq import ExecStatus, TransactionStatus
from psycopg.pq.abc import PGresult

Step = tuple[str, *tuple[str, ...]]
"""A statement and its parameters."""
Rows = list[tuple[bytes | None, ...]]

_names = count()


class Pipeline:
    """One connection and the statements that have been prepared on it."""

    def __init__(self, connection: AsyncConnection[Any]) -> None:
        self.connection = connection
        self._prepared: dict[str, bytes] = {}

    @property
    def closed(self) -> bool:
        """Whether the connection is of no use any more."""
        return self.connection.closed

    @property
    def begun(self) -> bool:
        """Whether a transaction is open, or has failed and waits for its ROLLBACK."""
        return self.connection.pgconn.transaction_status != TransactionStatus.IDLE

    def look(self) -> None:
        """See whether the server has ended the idle connection meanwhile, which it says by itself.

        Raises psycopg's `OperationalError`. Found out only after statements were sent, nobody knew what became of them.
        """
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
        kept: list[bool] = []  # whether the answer is one that was asked for, or that of a preparation
        preparing: dict[str, bytes] = {}
        pgconn.enter_pipeline_mode()
        for statement, *parameters in steps:
            name = self._prepared.get(statement) or preparing.get(statement)
            if name is None:
                name = preparing[statement] = b"inband_%d" % next(_names)
                pgconn.send_prepare(name, statement.encode())
                kept.append(False)
            pgconn.send_query_prepared(name, [parameter.encode() for parameter in parameters])
            kept.append(True)
        pgconn.pipeline_sync()
        results = await self._results()
        pgconn.exit_pipeline_mode()
        for result in results:
            if result.status not in (ExecStatus.TUPLES_OK, ExecStatus.COMMAND_OK):
                raise error_from_result(result)
        self._prepared |= preparing
        return [_rows(result) for result, asked in zip(results, kept, strict=True) if asked]

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
            await _ready(pgconn.socket, write=unsent)
            pgconn.consume_input()
            unsent = unsent and bool(pgconn.flush())


async def _ready(socket: int, *, write: bool) -> None:
    """Wait until there is something to read, or room to send the rest."""
    loop = asyncio.get_running_loop()
    woken: asyncio.Future[None] = loop.create_future()

    def wake() -> None:
        if not woken.done():
            woken.set_result(None)

    loop.add_reader(socket, wake)
    if write:
        loop.add_writer(socket, wake)
    try:
        await woken
    finally:
        loop.remove_reader(socket)
        if write:
            loop.remove_writer(socket)


def _rows(result: PGresult) -> Rows:
    columns = range(result.nfields)
    return [tuple(result.get_value(row, column) for column in columns) for row in range(result.ntuples)]
