"""A batch decided as columns is the batch decided one by one: the same readings pushed to two machines."""

import json
import random
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from app.db.engine import Database
from app.loop.readings.door import Directory
from app.loop.readings.records import Record
from app.loop.readings.schemas import decode_many
from app.loop.readings.writer import transaction
from app.loop.readings.writer.batch import store_batch
from app.loop.readings.writer.columnar import ColumnarReadings
from app.loop.readings.writer.transaction import new_verdicts
from tests.loop.readings.record import must_hold, rows
from tests.loops import in_thread
from tests.servers import Server
from tests.shop import Shop

pytestmark = pytest.mark.own_server  # the whole record of its database is held against the rules

ROWS = f"""SELECT {", ".join(f"r.{name}" for name in Record.__struct_fields__ if name not in {"machine_id", "characteristic_id", "received_at", "paused_by", "alarms"})},
    r.paused_by IS NULL, cardinality(r.alarms), c.amount, c.status, c.applied_by ~ '^reading'
    FROM reading r JOIN characteristic h ON h.id = r.characteristic_id AND h.machine_id = r.machine_id
    LEFT JOIN correction c ON c.machine_id = r.machine_id AND c.number = r.correction
    WHERE h.key = %s ORDER BY r.sequence"""  # noqa: S608 - names of columns


def twin(server: Server) -> tuple[Shop, list[str]]:
    """A machine with characteristics that share a tool, a memory, or nothing; one is never quiet."""
    shop = Shop(server)
    name = shop.characteristic
    shop.add(f"{name}-s", average_memory=5, weighting_factor=3)
    shop.add(f"{name}-m", mode="measure_only", average_memory=0)
    shop.add(f"{name}-p", tool_memory=4, average_memory=7, plausible_jump=0.05)
    shop.add(f"{name}-a", mode="approval", tool_memory=5, average_memory=8, zero_range=0)
    return shop, [name, *(f"{name}-{letter}" for letter in "smpa")]


def readings(chance: random.Random, count: int, numbers: int) -> list[tuple[int, dict[str, Any]]]:
    """So many readings of a process that drifts; which characteristic each is of."""
    clock = datetime.now(UTC) - timedelta(hours=5)
    made = []
    for at in range(count):
        clock += timedelta(seconds=chance.choice([20, 20, 20, -45]))
        size = chance.gauss(0, 1.5) + (chance.random() < 0.01) * chance.choice([7, 12, 400, 1500, -9])
        reading: dict[str, Any] = {"measured": round(40 + size / 1000, chance.choice([4, 6, 9]))}
        ahead = timedelta(hours=chance.choice([0] * 40 + [8, 20]))
        reading["measured_at"] = (clock + ahead).isoformat()
        if chance.random() < 0.7:
            reading["part"] = f"SN-Š{at}"
        if chance.random() < 0.7:
            reading["key"] = f"k{count}-{at}"
        told = chance.random()
        if numbers and told < 0.3:
            reading["correction_in_effect"] = chance.choice([numbers, numbers, max(0, numbers - 1), 0])
        elif told < 0.33:
            reading["machined_at"] = (clock - timedelta(seconds=600)).isoformat()
        elif told < 0.36:
            reading["touches"] = [[reading.pop("measured")]]
        made.append((chance.randrange(5), reading))
    return made


def store(database: Database, batch: list[dict[str, Any]]) -> int:
    """Store a batch; how many of its readings were decided as columns."""
    directory = Directory(database)
    decoded = decode_many(json.dumps(batch).encode(), datetime.now(UTC), lines=False)
    outcomes = in_thread(
        lambda: store_batch(database, {}, [(directory.look_up(reading.characteristic), reading) for reading in decoded])
    )
    assert [verdict.reading for verdict in new_verdicts(outcomes)] == decoded
    return sum(isinstance(outcome, ColumnarReadings) for outcome in outcomes)


@pytest.mark.parametrize(
    ("seed", "largest"), [(1, 600), *(pytest.param(seed, 1500, marks=pytest.mark.long) for seed in (1, 2, 3))]
)
def test_as_columns_is_as_one_by_one(server: Server, monkeypatch: pytest.MonkeyPatch, seed: int, largest: int) -> None:
    chance = random.Random(seed)
    (one, names), (other, others) = twin(server), twin(server)
    dsn = server.database.dsn
    for size in (64, 300, largest):
        numbers = len(one.call("GET", f"/machines/{one.machine}/corrections?limit=1000")["items"])
        wanted = readings(chance, size, numbers)
        answers = []
        for shop, keys, fewest in ((one, names, 64), (other, others, 10**9)):
            monkeypatch.setattr(transaction, "FEWEST", fewest)
            answers.append(store(server.database, [{"characteristic": keys[n], **reading} for n, reading in wanted]))
            for alarm in shop.alarms():
                if alarm["kind"] == "probe_fault":
                    shop.acknowledge(alarm["id"], "false_reading")
            for correction in shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"][::2]:
                shop.correction(correction["number"], "applied")
        assert answers[0] > size / 10, "hardly any was quiet"
        assert answers[1] == 0
    for key, twin_key in zip(names, others, strict=True):
        assert rows(dsn, ROWS, key) == rows(dsn, ROWS, twin_key)
    must_hold(dsn)
