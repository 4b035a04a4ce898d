"""Rounds: what has to be looked after although nobody asks, once a minute.

A chore is an action without a caller, e.g. "corrections that nobody fetched expire". Each part of the shop floor offers
its own, `app.main.CHORES` names them. Of several processes on one database one goes the rounds: the one that holds an
advisory lock on a connection of its own. When it ends, however it ends, another takes over within a minute.
"""

import asyncio
import logging
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import psycopg
from psycopg import AsyncConnection
from sqlalchemy.orm import Session

from app.db.engine import Database

log = logging.getLogger(__name__)

EVERY = 60.0  # s between two rounds
_OURS = "SELECT pg_try_advisory_lock(7291, 2)"


class Chore(NamedTuple):
    """Something to be done on every round, in a transaction of its own.

    ``do`` that answers True has done a part and is done again at once, in another transaction: a machine that is locked
    keeps its readings waiting until the commit, so it does one machine at a time. ``do`` looks first whether there is anything to do, without a lock: on most rounds there is nothing. What it changes
    it locks with one call of `lock_machines`, like everybody. It says nothing when it finds nothing, and doing it again
    changes nothing.
    """

    name: str
    do: Callable[[Session], object]


def go_round(database: Database, chores: Sequence[Chore]) -> None:
    """Do every chore once. One that fails is logged and takes nothing of the others with it."""
    for chore in chores:
        _do(database, chore)


def _do(database: Database, chore: Chore) -> None:
    try:
        more = True
        while more:
            with database.begin() as session:
                more = chore.do(session) is True
    except Exception:
        log.exception("on the rounds, this failed and is tried again in a minute: %s", chore.name)


class Rounds:
    """The rounds of one process."""

    def __init__(self, database: Database, chores: Sequence[Chore], every: float = EVERY) -> None:
        self._database = database
        self._chores = chores
        self._every = every
        self._closing = asyncio.Event()
        self._task: asyncio.Task[None] | None = None

    def start(self) -> None:
        """Begin; call it on the loop that serves requests."""
        self._task = asyncio.get_running_loop().create_task(self._go(), name="rounds")

    async def stop(self) -> None:
        """End after the chore that is being done."""
        self._closing.set()
        if self._task is not None:
            await self._task

    async def _go(self) -> None:
        while not self._closing.is_set():
            try:
                await self._go_while_it_is_ours()
            except psycopg.Error as error:
                log.warning("the rounds are interrupted: %s", error)
            except Exception:
                log.exception("the rounds met what nobody foresaw")
            await self._rest()

    async def _go_while_it_is_ours(self) -> None:
        async with await AsyncConnection.connect(
            self._database.dsn, autocommit=True, application_name="inband-rounds", connect_timeout=5
        ) as conn:
            # Asked anew before every round: it is granted again to the connection that has it, and fails with the connection.
            while not self._closing.is_set() and await _granted(conn):
                for chore in self._chores:
                    if self._closing.is_set():
                        return
                    await asyncio.to_thread(_do, self._database, chore)
                await self._rest()

    async def _rest(self) -> None:
        with suppress(TimeoutError):
            await asyncio.wait_for(self._closing.wait(), self._every)


async def _granted(conn: AsyncConnection[Any]) -> bool:
    row = await (await conn.execute(_OURS)).fetchone()
    return row is not None and bool(row[0])
