"""A pool that no request may ask for a second connection while it holds one: many that do so wait for each other.

Replaced in the processes of the tests and in the servers that they start. What asks twice ends in an error that nothing takes
for one of the program's own.
"""

import threading
from collections import Counter
from typing import Any

from sqlalchemy import PoolProxiedConnection, event

from app.db.engine import Pool
from app.logs import REQUEST

HELD_BY = "held by"
_held: Counter[tuple[int, str]] = Counter()
_lock = threading.Lock()


class SecondConnection(BaseException):
    """A request asks for a connection while it holds another one of the same pool."""


def _connect(pool: Pool) -> PoolProxiedConnection:
    request = REQUEST.get()
    if request is None or pool._max_overflow == -1:  # nobody waits for one of a pool that has any number
        return _plain_connect(pool)
    holder = id(pool), request
    with _lock:
        if _held[holder]:
            raise SecondConnection(f"request {request} holds a connection and asks for another one")
        _held[holder] += 1
    try:
        connection = _plain_connect(pool)
    except BaseException:
        _let_go(holder)
        raise
    connection.record_info[HELD_BY] = holder  # type: ignore[index] # there is one as long as it belongs to the pool
    return connection


def _let_go(holder: tuple[int, str]) -> None:
    with _lock:
        _held[holder] -= 1
        if not _held[holder]:
            del _held[holder]


def _checked_in(_connection: object, record: Any) -> None:
    holder = record.record_info.pop(HELD_BY, None)
    if holder is not None:
        _let_go(holder)


_plain_connect = Pool.connect
Pool.connect = _connect  # type: ignore[method-assign, assignment]
event.listen(Pool, "checkin", _checked_in)
