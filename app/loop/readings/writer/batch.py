"""A batch is stored in a thread of its own: it would keep the event loop of the single readings waiting."""

import asyncio
import gc
from collections.abc import Sequence

from app.db.engine import Database
from app.loop.readings.records import Entry
from app.loop.readings.schemas import ReadingIn
from app.loop.readings.writer.columnar import Outcome
from app.loop.readings.writer.load import ParametersCache
from app.loop.readings.writer.retry import ReadingStore
from app.loop.readings.writer.transaction import refuse_all

MOST_IDLE = 2  # connections kept for batches


def store_batch(
    database: Database,
    parameters: ParametersCache,
    readings: Sequence[tuple[Entry, ReadingIn]],
    idle: list[ReadingStore] | None = None,
) -> list[Outcome]:
    """Store a batch, all or nothing; call it in a thread without an event loop.

    idle: stores, and with them connections, that are taken from here and left here for the next batch. Raises `InbandError`
    naming every refused reading.
    """

    async def stored() -> list[Outcome]:
        store = idle.pop() if idle else ReadingStore(database, parameters)
        try:
            outcomes = await store.store(readings, all_or_nothing=True)
        except BaseException:
            await store.close()
            raise
        if idle is None or len(idle) >= MOST_IDLE:
            await store.close()
        else:
            idle.append(store)
        return outcomes

    # All of a batch lives until it is stored: looking through it for garbage every few hundred objects doubles its time.
    gc.disable()
    try:
        outcomes = asyncio.run(stored())
    finally:
        gc.enable()
    refuse_all(outcomes)
    return outcomes
