"""Tables of the store, and what is read out of them."""

import hashlib
import json
import sqlite3
from collections.abc import Sequence
from typing import Any, Final, NamedTuple

from app.bridge.links import Order, Outcome, Received

SCHEMA: Final = """
CREATE TABLE IF NOT EXISTS reading (
    id INTEGER PRIMARY KEY, machine TEXT NOT NULL, key TEXT NOT NULL, body TEXT NOT NULL,
    state TEXT NOT NULL CHECK (state IN ('waiting', 'sent', 'quarantined')),
    reason TEXT, at REAL NOT NULL, sent_at REAL, UNIQUE (machine, key)
);
CREATE INDEX IF NOT EXISTS reading_state ON reading (machine, state, id);
CREATE INDEX IF NOT EXISTS reading_sent ON reading (sent_at) WHERE state = 'sent';
CREATE TABLE IF NOT EXISTS ring (
    machine TEXT PRIMARY KEY, epoch INTEGER, sequence INTEGER NOT NULL, generation INTEGER NOT NULL
);
CREATE TABLE IF NOT EXISTS intent (
    machine TEXT NOT NULL, number INTEGER NOT NULL, tool_memory INTEGER NOT NULL, before REAL NOT NULL, after REAL NOT NULL,
    mapping TEXT NOT NULL, state TEXT NOT NULL CHECK (state IN ('open', 'answered', 'told', 'withdrawn')),
    applied INTEGER, held REAL, differs INTEGER, reason TEXT, at REAL NOT NULL, merged TEXT, turn INTEGER,
    PRIMARY KEY (machine, number)
);
CREATE INDEX IF NOT EXISTS intent_location ON intent (machine, tool_memory);
CREATE TABLE IF NOT EXISTS location (
    machine TEXT NOT NULL, tool_memory INTEGER NOT NULL, held REAL, told REAL, proved TEXT, proved_at REAL,
    PRIMARY KEY (machine, tool_memory)
);
CREATE TABLE IF NOT EXISTS decision (
    machine TEXT NOT NULL, key TEXT NOT NULL, characteristic TEXT NOT NULL, action TEXT NOT NULL, reason TEXT NOT NULL,
    measure_next INTEGER, PRIMARY KEY (machine, key)
);
CREATE TABLE IF NOT EXISTS fact (machine TEXT NOT NULL, name TEXT NOT NULL, value TEXT NOT NULL, PRIMARY KEY (machine, name));
"""


ADD: Final = (
    "INSERT INTO reading (machine, key, body, state, reason, at) VALUES (?, ?, ?, ?, ?, ?)"
    " ON CONFLICT (machine, key) DO NOTHING"
)
REPORTED: Final = "told"
"""The state of an order whose answer the server has heard. Stores of installed bridges hold this word, as they call the offset of a
location that the server knows."""
MOST_REASON: Final = 500  # characters
LATER_COLUMNS: Final = (
    ("intent", "merged", "TEXT"),
    ("intent", "turn", "INTEGER"),
    ("decision", "measure_next", "INTEGER"),
)
"""Those that a store of an older bridge does not have. merged: numbers that an order takes along; turn: answers in their order."""


class Waiting(NamedTuple):
    """A reading that the server does not have yet. again: it had it, before it went back in time."""

    id: int
    key: str
    body: dict[str, Any]
    at: float
    again: bool = False


class Added(NamedTuple):
    """Readings that were stored. new: the number of them that were not there; refused: reasons, by place, of those in the quarantine."""

    new: int
    refused: dict[int, str]


class Quarantined(NamedTuple):
    """A reading that the server, or the bridge, refuses, with the reason. at: when it came, seconds since 1970."""

    key: str
    body: dict[str, Any]
    reason: str
    at: float


class Counts(NamedTuple):
    """Readings of a machine: waiting, when the oldest of them came, quarantined."""

    waiting: int
    oldest: float | None
    quarantined: int


class Intent(NamedTuple):
    """A correction that was made known to the control. mapping: the hash it was converted by."""

    order: Order
    state: str
    mapping: str
    outcome: Outcome | None


def in_effect(database: sqlite3.Connection, machine: str, tool_memory: int, number: int) -> int | None:
    """See `Store.in_effect`."""
    row = database.execute(
        "SELECT CASE WHEN state IN ('answered', 'told') THEN coalesce(turn, 0) ELSE 1e18 END, tool_memory FROM intent"
        " WHERE machine = ? AND number = ? AND applied IS NOT 0",
        (machine, number),
    ).fetchone()
    if row is None:
        return None
    if row[1] == tool_memory:
        return number
    place = (machine, tool_memory, row[0], number)
    applied = "FROM intent WHERE machine = ? AND tool_memory = ? AND applied = 1 AND (coalesce(turn, 0), number)"
    [last] = database.execute(f"SELECT max(number) {applied} <= (?, ?)", place).fetchone()
    if last is not None:
        return int(last)
    merged = "min(coalesce(json_extract(merged, '$[0]'), number))"
    [first] = database.execute(f"SELECT {merged} {applied} > (?, ?)", place).fetchone()
    return None if first is None else int(first) - 1


def contradictions(database: sqlite3.Connection, machine: str, received: Sequence[Received], now: float) -> Added:
    """Put readings into the quarantine whose key another size has; those that came again and lie there already are refused too."""
    before, refused = database.total_changes, {}
    for place, each in enumerate(received):
        [text, state, lies] = database.execute(
            "SELECT body, state, reason FROM reading WHERE machine = ? AND key = ?", (machine, each.key)
        ).fetchone()
        known, size = (content.get("measured", content.get("touches")) for content in (json.loads(text), each.body))
        if known == size:
            if state == "quarantined":
                refused[place] = str(lies)
            continue
        reason = (
            f"Key {each.key} came with {known} before, and with {size} now: one of the two is wrong, or the machine counts"
            " again what it had counted."
        )
        written = size if not isinstance(size, list) else hashlib.sha256(json.dumps(size).encode()).hexdigest()[:16]
        row = (machine, f"{each.key}:{written}", json.dumps(each.body), "quarantined", reason[:MOST_REASON], now)
        database.execute(ADD, row)
        refused[place] = reason[:MOST_REASON]
    return Added(database.total_changes - before, refused)
