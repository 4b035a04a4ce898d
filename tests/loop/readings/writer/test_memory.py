"""The writer keeps in memory exactly the state that it would have loaded: the same things done to two machines, one read from memory."""

import json
import random
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import pytest
from anyio.from_thread import BlockingPortal, start_blocking_portal

from app.core.clock import FEWEST
from app.loop.readings.door import Directory
from app.loop.readings.schemas import decode_one
from app.loop.readings.writer.connection import connect
from app.loop.readings.writer.load import load
from app.loop.readings.writer.snapshot import Snapshot
from app.loop.readings.writer.transaction import ROLLBACK, transact
from tests.loop.readings.record import history, must_hold
from tests.servers import Server
from tests.shop import Shop

pytestmark = pytest.mark.own_server  # the whole record of its database is held against the rules

TOLD = ("sequence", "measured", "deviation", "decided", "average_before", "average_after", "zone", "action", "code",
        "late", "correction", "amount", "status", "correction_in_effect", "outstanding", "parameters_version")  # fmt: skip


class Twin:
    """A machine with three characteristics, two of them on one tool, to which the same is done as to another."""

    def __init__(self, server: Server) -> None:
        self.shop = Shop(server)
        name = self.shop.characteristic
        self.names = [name, f"{name}-s", f"{name}-w"]
        self.shop.add(self.names[1], average_memory=6, mode="approval", max_total=0.1)
        self.shop.add(self.names[2], tool_memory=4, average_memory=7, wear_limit=0.009, confidence_limit=0.02)

    def push(self, which: int, reading: dict[str, Any]) -> None:
        answer = self.shop.machine_client.post(
            "/api/v1/readings", json={"characteristic": self.names[which], **reading}
        )
        assert answer.status_code in {201, 422}, answer.text

    def do(self, verb: str, pick: int, at: str) -> None:
        """Something a person or the machine does; nothing where there is nothing to do it to."""
        shop = self.shop
        if verb == "change":
            shop.call("POST", f"/machines/{shop.machine}/tools/3/change", 200, offset=0.1, reason="worn")
        elif verb == "alarm":
            if alarms := shop.alarms():
                alarm = alarms[pick % len(alarms)]
                action = {"tool_worn": "keep_cutting", "probe_fault": "false_reading"}.get(alarm["kind"], "noted")
                shop.acknowledge(alarm["id"], action)
        elif verb == "version":
            parameters = {"weighting_factor": 1 + pick % 3}
            shop.call("PATCH", f"/characteristics/{self.names[0]}", 200, parameters=parameters, reason="try")
        else:
            status = {"applied": "pending", "approve": "awaiting_approval", "rejected": "pending", "release": "held"}[
                verb
            ]
            waiting = shop.call("GET", f"/machines/{shop.machine}/corrections?status={status}")["items"]
            if waiting:
                body: dict[str, Any] = {"applied_at": at} if verb == "applied" and pick % 2 else {"reason": "so"}
                body = {} if verb == "applied" and not pick % 2 else body
                shop.correction(waiting[pick % len(waiting)]["number"], verb, **body)


class Forgetful(Twin):
    """The twin whose readings are decided on what is loaded for each of them, over one connection."""

    def __init__(self, server: Server, portal: BlockingPortal) -> None:
        super().__init__(server)
        self.portal = portal
        self.directory = Directory(server.database)
        self.pipeline = portal.call(connect, server.database)

    def close(self) -> None:
        """Close the connection."""
        self.portal.call(self.pipeline.connection.close)

    def push(self, which: int, reading: dict[str, Any]) -> None:
        name = self.names[which]
        entry = self.directory.look_up(name)
        wanted = decode_one(json.dumps({"characteristic": name, **reading}).encode(), datetime.now(UTC))
        self.portal.call(transact, self.pipeline, {}, Snapshot(), [(entry, wanted)])


@pytest.fixture
def forgetful(server: Server) -> Iterator[Forgetful]:
    with start_blocking_portal() as portal:
        made = Forgetful(server, portal)
        yield made
        made.close()


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.long) for seed in (2, 3))])
def test_readings_are_decided_from_memory_as_if_all_were_loaded(
    server: Server, forgetful: Forgetful, seed: int
) -> None:
    twins = [Twin(server), forgetful]
    chance = random.Random(seed)
    clock = datetime.now(UTC) - timedelta(hours=3)
    last = 0
    for _step in range(150):
        clock += timedelta(seconds=20)
        if chance.random() < 0.75:
            size = chance.gauss(0, 4) + (chance.random() < 0.05) * 12
            reading: dict[str, Any] = {"measured": round(40 + size / 1000, 6), "measured_at": clock.isoformat()}
            told = chance.random()
            if told < 0.5:
                last = max(0, last + chance.choice([-1, 0, 0, 1, 1]))
                last = min(last, numbers(twins[0]))
                reading["correction_in_effect"] = last
            elif told < 0.7:
                reading["machined_at"] = (clock - timedelta(seconds=chance.choice([10, 60, 600]))).isoformat()
            which = chance.randrange(3)
            for twin in twins:
                twin.push(which, reading)
        else:
            verb = chance.choice(
                ["applied", "applied", "applied", "approve", "rejected", "release", "change", "version", "alarm"]
            )
            pick = chance.randrange(10)
            for twin in twins:
                twin.do(verb, pick, clock.isoformat())
    dsn = server.database.dsn
    for one, other in zip(*(twin.names for twin in twins), strict=True):
        remembered, loaded = ([{name: row[name] for name in TOLD} for row in history(dsn, key)] for key in (one, other))
        assert remembered == loaded
        assert len(loaded) > 20
    assert any(row["outstanding"] for row in history(dsn, twins[0].names[0]))
    must_hold(dsn)


def test_what_is_kept_of_a_stream_is_what_would_be_loaded(forgetful: Forgetful) -> None:
    """With its times of arrival: measured later and earlier, in another zone, and without a time."""
    kept, now = Snapshot(), datetime.now(UTC)
    zone = timezone(timedelta(hours=5, minutes=30))
    tells = [
        {"measured_at": (now - timedelta(minutes=20)).isoformat()},
        {"measured_at": (now - timedelta(minutes=30)).astimezone(zone).isoformat()},
        {"machined_at": (now - timedelta(minutes=40)).astimezone(zone).isoformat()},
        {},
    ]
    forgetful.shop.add(f"{forgetful.names[0]}-m", mode="measure_only", average_memory=0)
    names = [forgetful.names[0], f"{forgetful.names[0]}-m"]
    for size, told in zip((0, 1, 8, 2, 1, 0, 1), [*tells, *tells[:3]], strict=True):
        for name in names:
            entry = forgetful.directory.look_up(name)
            body = {"characteristic": name, "measured": 40 + size / 1000, **told}
            wanted = [(entry, decode_one(json.dumps(body).encode(), datetime.now(UTC)))]
            forgetful.portal.call(transact, forgetful.pipeline, {}, kept, wanted)
            fresh = Snapshot()
            forgetful.portal.call(load, forgetful.pipeline, {}, fresh, wanted)
            forgetful.portal.call(forgetful.pipeline.run, ROLLBACK)
            assert kept.streams[entry.characteristic_id] == fresh.streams[entry.characteristic_id]
    assert len(kept.streams[forgetful.directory.look_up(names[0]).characteristic_id].arrivals) == FEWEST


def numbers(twin: Twin) -> int:
    """Number of corrections."""
    return len(twin.shop.call("GET", f"/machines/{twin.shop.machine}/corrections?limit=1000")["items"])
