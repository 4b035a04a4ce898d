"""Both clients against a real server: what a machine does all day, and what the server says when it will not."""

import threading
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta

import pytest

from inband_client import (
    Conflict,
    Correction,
    Forbidden,
    Invalid,
    NotFound,
    Reading,
    Stopped,
    StoredReading,
    TooLarge,
    Unauthorized,
    Unavailable,
)
from tests.client.conftest import Connect, Either
from tests.servers import RunServer, Server, free_port
from tests.shop import Shop


@pytest.fixture
def machine(connect: Connect, server: Server, shop: Shop) -> Either:
    """A client with the key of the shop's machine."""
    return connect(server.url, server.key(machine=shop.machine))


@pytest.fixture(scope="module")
def mortal_server(run_server: RunServer) -> Iterator[Server]:
    """A server that tests may kill, if they start it again."""
    with run_server() as running:
        yield running


class TestReadings:
    def test_a_reading_is_decided_and_the_same_key_decided_once(self, machine: Either, shop: Shop) -> None:
        first = machine.push(characteristic=shop.characteristic, measured=40.006, key="part-1", part="SN-1")
        assert (first.sequence, first.zone, first.action, first.part) == (1, "full", "correct", "SN-1")
        assert first.correction == Correction(number=1, tool_memory=3, amount=-0.006, status="pending")
        assert first.reason.code == "full_deviation"
        assert first.measured_at.tzinfo is not None
        assert machine.push(characteristic=shop.characteristic, measured=40.006, key="part-1", part="SN-1") == first

    def test_one_object_is_one_reading_however_often_it_is_pushed(self, machine: Either, shop: Shop) -> None:
        reading = Reading(characteristic=shop.characteristic, measured=40.0002)
        assert machine.push(reading).sequence == machine.push(reading).sequence == 1
        assert machine.push({"characteristic": shop.characteristic, "measured": 40.0002}).sequence == 2

    def test_everything_that_a_reading_may_say_arrives(self, machine: Either, shop: Shop) -> None:
        cut = datetime.now(UTC) - timedelta(minutes=2)
        pushed = Reading(
            characteristic=shop.characteristic,
            measured=40.0004,
            measured_at=cut + timedelta(minutes=1),
            machined_at=cut,
            correction_in_effect=0,
            first_move_triggered=True,
        )
        assert machine.push(pushed).action == "stop"
        detail = machine.get(f"/readings/{shop.characteristic}/1")
        assert datetime.fromisoformat(detail["machined_at"]) == cut
        assert (detail["correction_in_effect"], detail["key"]) == (0, pushed.key)

    def test_many_are_decided_in_order_in_chunks(self, machine: Either, shop: Shop) -> None:
        many = [Reading(characteristic=shop.characteristic, measured=40 + at / 10_000) for at in (1, 2, 1, 60, 2, 1, 1)]
        batch = machine.push_many(iter(many), chunk=3)
        assert (batch.stored, batch.repeated) == (7, 0)
        assert batch.corrections == sum(decision.correction is not None for decision in batch.decisions) > 0
        assert [decision.sequence for decision in batch.decisions] == [1, 2, 3, 4, 5, 6, 7]
        assert sum(batch.zones.values()) == 7
        again = machine.push_many(many, decisions=False)
        assert (again.stored, again.repeated, again.decisions) == (0, 7, ())
        assert machine.push_many([]).stored == 0

    def test_of_many_a_wrong_one_is_named_by_its_place_among_all(self, machine: Either, shop: Shop) -> None:
        many = [{"characteristic": shop.characteristic, "measured": 40.0, "key": f"n{at}"} for at in range(5)]
        many[4]["measured"] = "wide"
        with pytest.raises(Invalid) as refused:
            machine.push_many(many, chunk=3)
        assert [error.field for error in refused.value.errors] == ["[4].measured"]
        many[4]["measured"] = 40.0
        batch = machine.push_many(many, chunk=3)
        assert (batch.stored, batch.repeated) == (2, 3)

    def test_stored_readings_come_page_after_page(
        self, machine: Either, shop: Shop, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        machine.push_many([Reading(characteristic=shop.characteristic, measured=40.0 + at / 1e4) for at in range(7)])
        monkeypatch.setattr("inband_client.calls.LARGEST_PAGE", 3)
        found = list(machine.readings(characteristic=shop.characteristic, start=datetime.now(UTC) - timedelta(hours=1)))
        assert [reading.sequence for reading in found] == [1, 2, 3, 4, 5, 6, 7]
        assert isinstance(found[0], StoredReading)
        newest = next(iter(machine.readings(machine=shop.machine, order="newest", zone=["zero", "average"])))
        assert newest.sequence == 7


class TestCorrections:
    def test_a_correction_is_fetched_and_confirmed_twice(self, machine: Either, shop: Shop) -> None:
        shop.read(6)
        (correction,) = machine.pending(shop.machine)
        assert (correction.number, correction.amount, correction.offset_expected) == (1, -0.006, -0.006)
        for _again in range(2):
            applied = machine.confirm(shop.machine, 1, offset_after=-0.006, applied_at=datetime.now(UTC))
            assert (applied.status, applied.offset_after) == ("applied", -0.006)
        assert machine.pending(shop.machine) == []
        assert shop.tool()["offset"] == -0.006

    def test_a_correction_is_rejected_once_with_a_reason(self, machine: Either, shop: Shop) -> None:
        shop.read(6)
        assert machine.reject(shop.machine, 1, "The step is too large").status == "rejected"
        with pytest.raises(Conflict) as refused:
            machine.reject(shop.machine, 1, "The step is too large")
        assert refused.value.document["correction_status"] == "rejected"

    def test_a_fault_is_an_alarm_until_it_is_over(self, machine: Either, shop: Shop) -> None:
        assert machine.report_fault(shop.machine, "battery_low", "A 700")["active"] is True
        assert [alarm["kind"] for alarm in shop.alarms()] == ["machine_fault"]
        assert machine.report_fault(shop.machine, "battery_low", active=False)["active"] is False
        assert shop.alarms() == []


class TestWhatTheServerSays:
    def test_each_refusal_is_an_exception_of_its_own(self, connect: Connect, machine: Either, shop: Shop) -> None:
        with pytest.raises(NotFound, match=r"POST /readings: 404 .*no characteristic nothing"):
            machine.push(characteristic="nothing", measured=1.0)
        with pytest.raises(Forbidden):
            machine.pending(Shop(shop.server).machine)
        with pytest.raises(Unauthorized):
            connect(shop.server.url, "ib_unknown").pending(shop.machine)
        machine.push(characteristic=shop.characteristic, measured=40.0, key="taken")
        with pytest.raises(Conflict):
            machine.push(characteristic=shop.characteristic, measured=41.0, key="taken")
        with pytest.raises(TooLarge):
            machine.post("/machines", {"name": "n" * 2_000_000})

    def test_a_refusal_names_the_field_what_to_do_and_the_request(self, machine: Either, shop: Shop) -> None:
        with pytest.raises(Invalid) as refused:
            machine.push(characteristic=shop.characteristic)
        error = refused.value
        assert (error.status, error.kind, error.errors[0].field) == (422, "invalid", "measured")
        assert error.what_to_do
        assert error.request_id
        assert str(error).count("A reading needs measured") == 1

    def test_a_key_that_lacks_a_role_learns_so(self, connect: Connect, server: Server) -> None:
        viewer = connect(server.url, server.key("viewer"))
        with pytest.raises(Forbidden, match="role"):
            viewer.post("/machines", {"key": "m", "name": "M", "control": "other"})


class TestTheRestOfTheContract:
    def test_a_plant_is_set_up_and_listed(self, connect: Connect, server: Server, shop: Shop) -> None:
        admin = connect(server.url, server.key())
        key = f"{shop.machine}-more"
        assert admin.post("/machines", {"key": key, "name": "More", "control": "other"})["key"] == key
        assert admin.call("PATCH", f"/machines/{key}", {"name": "Much more"})["name"] == "Much more"
        another = admin.post("/machines", {"key": f"{key}-still", "name": "Still more", "control": "other"})
        listed = admin.items("/machines", limit=1, after=shop.machine)  # a page for each
        assert [next(listed)["key"], next(listed)["key"]] == [key, another["key"]]
        made = admin.post(f"/machines/{key}/keys", {"name": "one"})
        assert admin.call("DELETE", f"/machines/{key}/keys/{made['id']}") is None


class TestAway:
    def test_a_server_that_comes_back_gets_everything_once(self, connect: Connect, mortal_server: Server) -> None:
        shop = Shop(mortal_server)
        machine = connect(mortal_server.url, mortal_server.key(machine=shop.machine), patience=None)
        mortal_server.kill()
        later = threading.Timer(0.7, mortal_server.restart)
        later.start()
        assert machine.push(characteristic=shop.characteristic, measured=40.0, key="k").sequence == 1
        later.join()

    def test_one_that_stays_away_is_reported_when_patience_ends(self, connect: Connect) -> None:
        away = connect(f"http://127.0.0.1:{free_port()}", "key", patience=0.5)
        with pytest.raises(Unavailable, match=r"POST /readings: No answer after \d attempts") as given_up:
            away.push(characteristic="c", measured=1.0)
        assert given_up.value.may_have_happened is False
        assert given_up.value.__cause__ is not None

    def test_a_client_that_waits_for_ever_can_be_stopped(self, connect: Connect) -> None:
        away = connect(f"http://127.0.0.1:{free_port()}", "key", patience=None)
        threading.Timer(0.3, away.stop).start()
        with pytest.raises(Stopped):
            away.pending("lathe-1")
        with pytest.raises(Stopped):
            away.pending("lathe-1")


class TestFollowing:
    def test_what_happens_to_the_machine_is_reported_and_taken_up_after_a_restart(
        self, connect: Connect, mortal_server: Server
    ) -> None:
        shop = Shop(mortal_server)
        machine = connect(mortal_server.url, mortal_server.key(machine=shop.machine), patience=None)
        events = machine.follow()
        assert next(events).kind == "hello"
        shop.read(6)
        issued = next(event for event in events if event.kind == "correction")
        assert (issued.machine, issued.number, issued.tool, issued.status) == (shop.machine, 1, 3, "pending")
        mortal_server.kill()
        mortal_server.restart()
        shop.read(0.2)
        told = next(event for event in events if event.sequence == 2)
        assert (told.kind, told.characteristic) == ("reading", shop.characteristic)
