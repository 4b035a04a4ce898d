"""MQTT over a real broker (mosquitto): killed and restarted, half messages, repeats, two bridges, refused logins."""

import asyncio
import json
import subprocess
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import AbstractAsyncContextManager, asynccontextmanager
from pathlib import Path
from typing import Any, Self

import aiomqtt
import msgspec
import pytest

from app.bridge.configuration import ConfigurationError, Machine, configuration_from
from app.bridge.kinds.mqtt import AT_ONCE, MqttLink, link
from app.bridge.links import (
    ControlAway,
    Decided,
    LinkError,
    Misconfigured,
    Order,
    Outcome,
    Position,
    Received,
    carries_decisions,
)
from app.bridge.store import Store
from app.bridge.unit import Unit
from app.simulators.controls.model import Model
from app.simulators.controls.mqtt import MqttSimulator, free_port, mosquitto, start_broker
from tests.bridge.plant import PATIENCE, bridge, controlled, store_in, until
from tests.loops import run
from tests.shop import Shop

pytestmark = pytest.mark.skipif(mosquitto() is None, reason="mosquitto is not installed")
TOPIC = "inband/v1/lathe-1"
READING = {"characteristic": "1", "measured": 40.012, "part": "P1"}


class Broker:
    """A mosquitto that can be killed; what it has saved survives."""

    def __init__(self, folder: Path, *lines: str) -> None:
        self.folder, self.lines = folder, lines
        self.port = free_port()
        self.process: asyncio.subprocess.Process | None = None

    async def start(self) -> None:
        self.process = await start_broker(self.folder, self.port, *self.lines)

    async def kill(self) -> None:
        assert self.process is not None
        self.process.kill()
        await self.process.wait()

    async def __aenter__(self) -> Self:
        await self.start()
        return self

    async def __aexit__(self, *_: object) -> None:
        if self.process is not None and self.process.returncode is None:
            await self.kill()


def machine(port: int, unit: str = "mm", corrections: str = "control", **settings: Any) -> Machine:
    place = {"tool_memory": 3, "tool": 3, "register": "wear_length_1", "holds": "diameter"}
    table = {
        "kind": "mqtt",
        "unit": unit,
        "secret": "x",
        "corrections": corrections,
        "interval": 0.02,
        "patience": 30.0,
    }
    table |= {"proof_needed": False, "location": [place], "characteristics": {"1": "shaft-1"}}
    content = {
        "server": {"url": "http://127.0.0.1:1"},
        "machine": {"lathe-1": table | {"mqtt": {"host": "127.0.0.1", "port": port} | settings}},
    }
    return configuration_from(content, Path()).machines[0]


@asynccontextmanager
async def connected(chosen: Machine) -> AsyncIterator[MqttLink]:
    there = link(chosen)
    try:
        await there.connect()
        yield there
    finally:
        await there.close()


def fetching(chosen: Machine, store: Store) -> AbstractAsyncContextManager[Unit]:
    return controlled(Unit(chosen, link(chosen), store))


async def fetched(there: MqttLink, count: int = 1) -> list[Received]:
    found: list[Received] = []

    async def enough() -> bool:
        found.extend(await there.fetch(Position()))
        return len(found) >= count

    await until(enough, "messages")
    return found


async def say(port: int, topic: str, *contents: object, **other: Any) -> None:
    async with aiomqtt.Client("127.0.0.1", port, **other) as client:
        for content in contents:
            payload = content if isinstance(content, bytes) else json.dumps(content)
            await client.publish(f"{TOPIC}/{topic}", payload, qos=1)


def test_a_reading_is_answered_with_its_key_when_it_is_stored(tmp_path: Path) -> None:
    async def work() -> None:
        async with Broker(tmp_path) as broker, connected(machine(broker.port)) as there:
            async with aiomqtt.Client("127.0.0.1", broker.port) as client:
                await client.subscribe(f"{TOPIC}/stored", qos=1)
                await say(broker.port, "readings", READING | {"key": "a"})
                received = await fetched(there)
                await there.acknowledge(received)
                message = await anext(aiter(client.messages))
                assert json.loads(bytes(message.payload)) == {"key": "a"}
            assert received[0].key == "a"
            assert received[0].body == READING | {"characteristic": "shaft-1"}

    run(work())


def test_what_was_not_stored_comes_again_from_the_broker(tmp_path: Path) -> None:
    """Acknowledged to the broker is what is stored: a bridge that is killed in between loses nothing."""

    async def work() -> None:
        async with Broker(tmp_path) as broker:
            chosen = machine(broker.port)
            async with connected(chosen) as there:
                await say(broker.port, "readings", READING | {"key": "a"}, READING | {"key": "b"})
                first, _ = await fetched(there, 2)
                await there.acknowledge([first])
            await say(broker.port, "readings", READING | {"key": "c"})  # while nobody listens
            async with connected(chosen) as there:
                assert [each.key for each in await fetched(there, 2)] == ["b", "c"]

    run(work())


@pytest.mark.parametrize(
    ("payload", "words"),
    [
        (b'{"characteristic": "shaft-1", "meas', "is no JSON"),
        (b"\xff\xfe{}", "is no"),
        (b"[1]", "is no JSON object"),
        (b'{"characteristic": "1", "measured": NaN, "key": "a"}', "holds NaN, which is not a number"),
        (b'{"characteristic": "1", "measured": 1e999, "key": "a"}', "holds 1e999, which is not a number"),
        (b'{"characteristic": "1", "touches": [[1e308, 0]], "key": "a"}', "holds 1e308, which is not a number"),
        (b'{"characteristic": "1", "measured": 1' + 400 * b"0" + b', "key": "a"}', "which is not a number"),
        (b'{"characteristic": "1", "measured": 1, "part": "\\ud800", "key": "a"}', "half a character"),
        (b'{"characteristic": "1", "measured": 1, "key": "\\udfff"}', "half a character"),
        (b'{"characteristic": "1", "measured": 1}', "has no key"),
        (b'{"characteristic": "1", "key": "a"}', "has either measured or touches"),
        (
            b'{"characteristic": "1", "measured": "40,01", "key": "a"}',
            'measured = "40,01" is not of the kind that a reading has there: a whole number or a number',
        ),
        (b'{"characteristic": "1", "measured": 1, "size": 2, "key": "a"}', "not known: 'size'"),
        (b'{"measured": 1, "key": "a"}', "has no characteristic"),
    ],
)
def test_what_is_no_reading_goes_to_the_quarantine(tmp_path: Path, payload: bytes, words: str) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        async with Broker(tmp_path) as broker, fetching(machine(broker.port), store) as unit:
            await until(lambda: unit.state == "online", "the bridge is connected")
            await say(broker.port, "readings", payload, READING | {"key": "good"})

            async def both() -> bool:
                return bool(await store.quarantine("lathe-1")) and bool(await store.waiting("lathe-1"))

            await until(both, "the bad one and the good one")
        [bad] = await store.quarantine("lathe-1")
        assert words in bad.reason
        assert [row.key for row in await store.waiting("lathe-1")] == ["good"]
        store.close()

    run(work())


def test_what_the_server_refuses_later_is_reported_to_the_machine(tmp_path: Path) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        async with Broker(tmp_path) as broker, fetching(machine(broker.port), store) as unit:
            await until(lambda: unit.state == "online", "the bridge is connected")
            async with aiomqtt.Client("127.0.0.1", broker.port) as client:
                await client.subscribe(f"{TOPIC}/stored", qos=1)
                await say(broker.port, "readings", {"characteristic": 1, "measured": 40, "key": 7, "part": 812})
                assert await said(client) == {"key": 7}
                [row] = await store.waiting("lathe-1")
                assert (row.key, row.body["characteristic"], row.body["part"]) == ("7", "shaft-1", "812")
                unit.refused.append(("7", "There is no characteristic 'shaft-1'."))  # as the server's side notes it
                assert await said(client) == {"key": "7", "refused": "There is no characteristic 'shaft-1'."}
        store.close()

    run(work())


def test_a_key_that_lies_in_the_quarantine_is_refused_however_often_it_comes(tmp_path: Path) -> None:
    """Whether the bridge found it wrong, a second size under a key, or the server did and the machine has not heard of it."""

    async def work() -> None:
        store = store_in(tmp_path / "store")
        async with Broker(tmp_path) as broker, fetching(machine(broker.port), store) as unit:
            await until(lambda: unit.state == "online", "the bridge is connected")
            async with aiomqtt.Client("127.0.0.1", broker.port) as client:
                await client.subscribe(f"{TOPIC}/stored", qos=1)
                await say(broker.port, "readings", READING | {"key": "a"}, READING | {"key": "b"})
                assert [await said(client) for _ in range(2)] == [{"key": "a"}, {"key": "b"}]
                await say(broker.port, "readings", READING | {"key": "a", "measured": 41.5})
                answer = await said(client)
                assert "Key a came with 40.012 before, and with 41.5 now" in answer.pop("refused")
                assert answer == {"key": "a"}
                row = next(row for row in await store.waiting("lathe-1") if row.key == "b")
                await store.refuse("lathe-1", row.id, "There is no characteristic 'shaft-1'.")
                await say(broker.port, "readings", READING | {"key": "b"}, READING | {"key": "a"})
                assert await said(client) == {"key": "b", "refused": "There is no characteristic 'shaft-1'."}
                assert await said(client) == {"key": "a"}
        store.close()

    run(work())


async def said(client: aiomqtt.Client) -> Any:
    async with asyncio.timeout(PATIENCE):
        return json.loads(bytes((await anext(aiter(client.messages))).payload))


def test_messages_of_another_form_and_topic_become_readings(tmp_path: Path) -> None:
    settings: dict[str, Any] = {
        "readings": "gauges/line-3/result",
        "fields": {"measured": "values.d40", "measured_at": "time", "part": "serial", "characteristic": "feature"},
        "times": "seconds since 1970-01-01",
    }

    async def work() -> None:
        async with Broker(tmp_path) as broker:
            chosen = machine(broker.port, **settings)
            async with connected(chosen) as there, aiomqtt.Client("127.0.0.1", broker.port) as client:
                message = {"feature": 1, "values": {"d40": 40.01, "unit": "mm"}, "time": 1_780_000_000, "serial": 17}
                for _ in range(2):
                    await client.publish("gauges/line-3/result", json.dumps(message), qos=1)
                first, again = await fetched(there, 2)
                assert first.key == again.key
                assert first.body == {
                    "characteristic": "shaft-1",
                    "measured": 40.01,
                    "measured_at": "2026-05-28T20:26:40+00:00",
                    "part": "17",
                }
                await there.acknowledge([first, again])

    run(work())


def test_a_temperature_that_is_left_out_is_reported_until_a_good_one_comes(tmp_path: Path) -> None:
    fields = {"characteristic": "f", "measured": "d40", "key": "id", "part_temperature": "t"}

    async def work() -> None:
        async with (
            Broker(tmp_path) as broker,
            connected(machine(broker.port, fields=fields, readings="gauges/1", prefix="gauges")) as there,
            aiomqtt.Client("127.0.0.1", broker.port) as client,
        ):
            for number, (sent, words) in enumerate(
                [(21.4, ""), ("21,5", "part_temperature"), (None, "part_temperature"), (21.6, "")]
            ):
                await client.publish("gauges/1", json.dumps({"f": 1, "d40": 40.01, "id": number, "t": sent}), qos=1)
                [received] = await fetched(there)
                assert received.fault is None
                assert there.remark.partition(" ")[0] == words

    run(work())


def test_sizes_are_in_the_unit_of_the_machine(tmp_path: Path) -> None:
    async def work() -> None:
        async with Broker(tmp_path) as broker, connected(machine(broker.port, unit="inch")) as there:
            await say(broker.port, "readings", {"characteristic": "1", "touches": [[1.0, None]], "key": "a"})
            [received] = await fetched(there)
            assert received.body["touches"] == [[25.4, None]]

    run(work())


def test_the_pending_list_is_retained_and_expires(tmp_path: Path) -> None:
    async def work() -> None:
        async with Broker(tmp_path) as broker:
            chosen = machine(broker.port)
            async with connected(chosen) as there:
                await there.offer([Order(7, 3, 0.01, 0.002)])
            async with aiomqtt.Client("127.0.0.1", broker.port) as client:
                await client.subscribe(f"{TOPIC}/corrections", qos=1)
                message = await anext(aiter(client.messages))
                [told] = json.loads(bytes(message.payload))["corrections"]
                assert message.retain
                assert (told["number"], told["before"], told["after"], told["unit"]) == (7, 0.01, 0.002, "mm")
                async with connected(chosen) as there:  # begun anew: nothing is pending until the server has said so
                    await there.offer([])
                    message = await anext(aiter(client.messages))
                    assert json.loads(bytes(message.payload)) == {"corrections": []}

    run(work())


def test_answers_to_corrections_are_read(tmp_path: Path) -> None:
    async def work() -> None:
        async with Broker(tmp_path) as broker, connected(machine(broker.port)) as there:
            await there.offer([Order(7, 3, 0.01, 0.002)])
            answers = ({"number": 7}, {"number": 7, "offset_after": 0.002}, {"number": 7, "refused": "locked"})
            await say(broker.port, "applied", b"{", *answers)
            found: list[Outcome] = []

            async def enough() -> bool:
                found.extend(await there.outcomes())
                return len(found) == 2

            await until(enough, "both answers")
            assert found == [Outcome(7, applied=True, offset=0.002), Outcome(7, False, None, "locked")]
            await say(broker.port, "offsets", {"3": 0.05})

            async def offsets() -> bool:
                return await there.offsets() == {3: 0.05}

            await until(offsets, "the offsets")

    run(work())


def test_decisions_are_published_and_the_list_is_in_the_order_of_the_numbers(tmp_path: Path) -> None:
    async def work() -> None:
        async with Broker(tmp_path) as broker, connected(machine(broker.port)) as there:
            assert carries_decisions(there)
            async with aiomqtt.Client("127.0.0.1", broker.port) as client:
                for topic in ("decisions", "corrections"):
                    await client.subscribe(f"{TOPIC}/{topic}", qos=1)
                messages = aiter(client.messages)
                await there.decide([Decided("k1", "shaft-1", "stop", "probe_fault", 1)])
                told = json.loads(bytes((await anext(messages)).payload))
                assert told == {
                    "key": "k1", "characteristic": "shaft-1", "action": "stop", "reason": "probe_fault", "measure_next": 1,
                }  # fmt: skip
                await there.offer([Order(7, 3, 0.01, 0.002), Order(5, 3, 0.0, 0.01)])
                listed = json.loads(bytes((await anext(messages)).payload))["corrections"]
                assert [each["number"] for each in listed] == [5, 7]

    run(work())


def test_a_broker_that_is_away_and_direct_writing_are_reported() -> None:
    async def work() -> None:
        with pytest.raises(ControlAway, match=r"The broker 127\.0\.0\.1:\d+ does not answer"):
            await link(machine(free_port())).connect()
        with pytest.raises(Misconfigured, match="sets its offsets itself"):
            await link(machine(1, corrections="direct")).connect()

    run(work())


def test_a_refused_login_is_reported(tmp_path: Path) -> None:
    async def work() -> None:
        users = tmp_path / "users"
        users.write_text("other:$7$101$AAAA$AAAA\n", encoding="utf-8")
        async with Broker(tmp_path, "allow_anonymous false") as broker:
            with pytest.raises(Misconfigured, match="refuses the login"):
                await link(machine(broker.port)).connect()

    run(work())


def test_a_broker_that_lets_the_bridge_not_write_is_reported(tmp_path: Path) -> None:
    async def work() -> None:
        rights = tmp_path / "rights"
        rights.write_text("topic read inband/v1/#\n", encoding="utf-8")
        async with (
            Broker(tmp_path, "allow_anonymous true", f"acl_file {rights}") as broker,
            connected(machine(broker.port)) as there,
        ):
            with pytest.raises(Misconfigured, match=r"does not let the bridge write .*/corrections: Not authorized"):
                await there.offer([])

    run(work())


def test_the_check_publishes_what_the_bridge_will_publish(tmp_path: Path) -> None:
    """A bridge that may read and not write what it answers would else be found out at the first part."""

    async def work() -> None:
        rights = tmp_path / "rights"
        rights.write_text("topic readwrite inband/v1/lathe-1/stored\ntopic read inband/v1/#\n", encoding="utf-8")
        async with (
            Broker(tmp_path, "allow_anonymous true", f"acl_file {rights}") as broker,
            connected(machine(broker.port)) as there,
        ):
            wrong = await there.try_out()
            assert [
                f"write {TOPIC}/{topic}: Not authorized" in words
                for topic, words in zip(("decisions", "corrections"), wrong, strict=True)
            ] == [True, True]
        async with Broker(tmp_path) as broker, connected(machine(broker.port)) as there:
            assert await there.try_out() == []
            assert await there.offsets() == {}

    run(work())


def test_two_bridges_with_one_client_id_are_reported(tmp_path: Path) -> None:
    async def work() -> None:
        async with Broker(tmp_path) as broker:
            chosen = machine(broker.port)
            async with connected(chosen) as first, connected(chosen):
                with pytest.raises(LinkError, match="a second bridge"):
                    for _ in range(600):
                        await first.fetch(Position())
                        await asyncio.sleep(0.05)

    run(work())


@pytest.mark.filterwarnings(
    "ignore::pytest.PytestUnraisableExceptionWarning"
)  # paho leaves the socket of a failed handshake
def test_certificates_on_both_sides(tmp_path: Path) -> None:
    """The broker wants a certificate of the client; a bridge without one, or with another authority, is told."""
    for name in ("ca", "other"):
        _openssl(tmp_path, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", f"/CN={name}",
                 "-keyout", f"{name}.key", "-out", f"{name}.crt")  # fmt: skip
    for name in ("broker", "client"):
        _openssl(tmp_path, "req", "-newkey", "rsa:2048", "-nodes", "-subj", f"/CN={name}",
                 "-keyout", f"{name}.key", "-out", f"{name}.csr")  # fmt: skip
        (tmp_path / "names").write_text("subjectAltName=IP:127.0.0.1\n", encoding="utf-8")
        _openssl(tmp_path, "x509", "-req", "-in", f"{name}.csr", "-CA", "ca.crt", "-CAkey", "ca.key", "-CAcreateserial",
                 "-days", "2", "-extfile", "names", "-out", f"{name}.crt")  # fmt: skip
    for file in tmp_path.iterdir():
        file.chmod(0o644)  # mosquitto leaves root's rights
    lines = [f"cafile {tmp_path}/ca.crt", f"certfile {tmp_path}/broker.crt", f"keyfile {tmp_path}/broker.key"]
    lines += ["require_certificate true", "use_identity_as_username true"]
    own = {"certificate": f"{tmp_path}/client.crt", "private_key": f"{tmp_path}/client.key"}

    async def work() -> None:
        async with Broker(tmp_path, *lines) as broker:
            async with connected(machine(broker.port, tls=True, ca=f"{tmp_path}/ca.crt", **own)) as there:
                assert await there.fetch(Position()) == []
            with pytest.raises(Misconfigured, match="is not to be trusted"):
                await link(machine(broker.port, tls=True, ca=f"{tmp_path}/other.crt", **own)).connect()
            with pytest.raises(Misconfigured, match="cannot be read"):
                await link(machine(broker.port, tls=True, ca=f"{tmp_path}/missing.crt")).connect()

    run(work())


def _openssl(folder: Path, *words: str) -> None:
    subprocess.run(["openssl", *words], cwd=folder, check=True, capture_output=True)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"ca": "a.crt"}, "need tls = true"),
        ({"tls": True, "certificate": "a"}, "belong together"),
        ({"prefix": "inband/#"}, "is no part of a topic"),
        ({"password_env": "X"}, "a password needs a username"),
    ],
)
def test_contradictions_are_reported_with_their_place(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(ConfigurationError, match=r"machine.lathe-1.mqtt") as caught:
        machine(1, **settings)
    assert words in str(caught.value)


@pytest.mark.parametrize("kills", [2, pytest.param(8, marks=pytest.mark.long)])
def test_every_reading_once_while_broker_and_bridge_are_killed(tmp_path: Path, kills: int) -> None:
    async def work() -> None:
        store = store_in(tmp_path / "store")
        async with Broker(tmp_path) as broker:
            model = Model(serial="LATHE-1")
            simulator = MqttSimulator(model, "127.0.0.1", broker.port, again=0.5)
            await simulator.start()
            chosen = machine(broker.port)
            try:
                for number in range(kills):
                    async with fetching(chosen, store):
                        for _ in range(5):
                            await _part(model)
                        if number % 2 == 0:
                            await broker.kill()
                            await _part(model)
                            await broker.start()
                        await asyncio.sleep(0.2)
                async with fetching(chosen, store):
                    await until(lambda: len(simulator.stored) == len(model.truth()), "everything is stored")
            finally:
                await simulator.stop()
            rows = await store.waiting("lathe-1", 1000)
            assert {row.key: row.body["measured"] for row in rows} == {
                f"lathe-1:{key}": size for key, size in model.truth().items()
            }
            assert len(rows) == len(model.truth())
        store.close()

    run(work())


def test_a_backlog_comes_through_a_broker_that_is_slow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It answers for some messages before a call is given up, never for all that it has sent."""
    count, answered, publish = 2 * AT_ONCE, AT_ONCE + 10, MqttLink._publish
    connections: Counter[object] = Counter()

    async def slow(there: MqttLink, topic: str, content: object, **other: Any) -> None:
        client = there._there()
        if topic == "stored":
            connections[client] += 1
            if connections[client] > answered:
                await asyncio.Event().wait()  # until the call is given up
        await publish(there, topic, content, **other)

    monkeypatch.setattr(MqttLink, "_publish", slow)

    async def work() -> None:
        store = store_in(tmp_path)
        async with Broker(tmp_path) as broker:
            chosen = msgspec.structs.replace(machine(broker.port), patience=2.0)
            async with connected(chosen):
                pass  # the session is there: the broker keeps messages for it
            await say(broker.port, "readings", *(READING | {"key": f"k{number}"} for number in range(count)))
            told: set[str] = set()
            async with aiomqtt.Client("127.0.0.1", broker.port) as client, fetching(chosen, store) as unit:
                await client.subscribe(f"{TOPIC}/stored", qos=1)
                async with asyncio.timeout(PATIENCE):
                    async for message in client.messages:
                        told.add(json.loads(bytes(message.payload))["key"])
                        if len(told) == count:
                            break
                polls = unit.polls
                await until(lambda: unit.polls > polls, "the last are acknowledged to the broker")
            assert len(connections) > 1
            await say(broker.port, "readings", READING | {"key": "later"})
            async with connected(chosen) as there:  # nothing else is left at the broker
                assert [each.key for each in await fetched(there)] == ["later"]
        store.close()

    run(work())


async def _part(model: Model) -> None:
    for _ in model.part():
        await asyncio.sleep(0.005)


def test_corrections_reach_the_machine_once_through_a_server(shop: Shop, tmp_path: Path) -> None:
    """The loop closed over the broker, which is killed in between."""

    async def work() -> None:
        store = store_in(tmp_path / "store")
        async with Broker(tmp_path) as broker:
            model = Model(serial=shop.machine.upper())
            simulator = MqttSimulator(model, "127.0.0.1", broker.port, again=0.5)
            await simulator.start()
            fields = {"key": shop.machine, "characteristics": {"1": shop.characteristic}}
            chosen = msgspec.structs.replace(machine(broker.port), **fields)
            unit = Unit(chosen, link(chosen), store)
            try:
                async with bridge(shop, unit):
                    for number in range(8):
                        await _part(model)
                        if number == 4:
                            await broker.kill()
                            await broker.start()
                        await until(lambda: len(simulator.stored) == len(model.truth()), "everything is stored")

                    async def applied() -> bool:
                        if not model.applied:
                            await _part(model)
                            await asyncio.sleep(0.3)
                            return False
                        answer = await asyncio.to_thread(shop.correction, model.applied[0].number)
                        return bool(answer["status"] == "applied")

                    await until(applied, "the server knows of the first correction")
            finally:
                await simulator.stop()
            numbers = [each.number for each in model.applied]
            assert numbers == sorted(set(numbers))
            total = sum(each.after - each.before for each in model.applied)
            assert model.offsets[3, 1, "wear_length_1"] == pytest.approx(total, abs=1e-6)
        store.close()

    run(work())
