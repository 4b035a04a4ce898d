"""Maintenance: who may enter it, which times are refused, and how it ends."""

from datetime import UTC, datetime, timedelta
from typing import Any
from zoneinfo import ZoneInfo

import pytest

from app.errors import Invalid
from app.language.formatting import as_read
from app.language.times import in_zone
from app.loop.maintenance.pages import as_typed
from app.loop.maintenance.schemas import MaintenanceIn
from app.web.forms import typed
from tests.servers import Server
from tests.shop import Person, Shop

WHY = {"reason": "Bearing replaced"}


def ahead(hours: float) -> str:
    return (datetime.now(UTC) + timedelta(hours=hours)).isoformat()


def enter(shop: Shop, status: int = 201, **more: Any) -> Any:
    return shop.call("POST", "/maintenance", status, **{"machine": shop.machine} | WHY | more)


def listed(shop: Shop, **more: Any) -> list[Any]:
    return list(shop.call("GET", f"/maintenance?machine={shop.machine}" + ("&ahead=true" if more else ""))["items"])


class TestEntering:
    def test_it_begins_now_and_ends_after_a_shift(self, shop: Shop) -> None:
        made = enter(shop)
        begins, ends = (datetime.fromisoformat(made[each]) for each in ("begins", "ends"))
        assert abs(begins - datetime.now(UTC)) < timedelta(minutes=1)
        assert ends - begins == timedelta(hours=8)
        assert (made["state"], made["stopping_anyway"], made["machine"]) == ("running", True, shop.machine)

    def test_it_is_planned(self, shop: Shop) -> None:
        made = enter(shop, begins=ahead(24), ends=ahead(30), stopping_anyway=False)
        assert (made["state"], made["stopping_anyway"]) == ("planned", False)

    @pytest.mark.parametrize(
        ("times", "field", "words"),
        [
            ({"begins": -1, "ends": 1}, "begins", "lies in the past"),
            ({"ends": -1}, "ends", "must come after"),
            ({"begins": 5, "ends": 4}, "ends", "must come after"),
            ({"begins": 5, "ends": 5 + 63 * 24}, "ends", "within 62 days"),
            ({"begins": 367 * 24}, "begins", "more than a year ahead"),
        ],
    )
    def test_times_that_cannot_be_are_refused(
        self, shop: Shop, times: dict[str, float], field: str, words: str
    ) -> None:
        refused = enter(shop, 422, **{name: ahead(hours) for name, hours in times.items()})
        (error,) = refused["errors"]
        assert error["field"] == field
        assert words in error["message"]
        assert listed(shop) == []

    def test_it_overlaps_with_none_of_the_same_machine(self, shop: Shop) -> None:
        first = enter(shop, ends=ahead(2))
        refused = enter(shop, 409, begins=ahead(1), ends=ahead(3))
        assert f"maintenance {first['id']} from" in refused["detail"]
        enter(shop, begins=first["ends"], ends=ahead(3))  # one ends where the next begins
        assert len(listed(shop)) == 2

    def test_after_one_is_ended_the_next_may_be_entered(self, shop: Shop) -> None:
        first = enter(shop)
        shop.call("POST", f"/maintenance/{first['id']}/end")
        enter(shop)
        assert [each["state"] for each in listed(shop)] == ["running", "over"]
        assert [each["state"] for each in listed(shop, ahead=True)] == ["running"]


class TestTwice:
    """A button that is pressed twice, or an answer that was lost: the second is the first."""

    @pytest.mark.parametrize("times", [{}, {"begins": 5}, {"begins": 5, "ends": 7}, {"ends": 7}])
    def test_the_same_is_entered_once(self, shop: Shop, times: dict[str, float]) -> None:
        sent: dict[str, Any] = {name: ahead(hours) for name, hours in times.items()}
        first = enter(shop, **sent)
        assert enter(shop, **sent) == first
        assert len(listed(shop)) == 1
        audit = shop.call("GET", f"/audit?subject=maintenance/{first['id']}")["items"]
        assert [each["action"] for each in audit] == ["maintenance entered"]

    @pytest.mark.parametrize("other", [{"reason": "Oil"}, {"stopping_anyway": False}, {"begins": 1}, {"ends": 2}])
    def test_what_differs_is_refused(self, shop: Shop, other: dict[str, Any]) -> None:
        enter(shop)
        enter(
            shop, 409, **{name: ahead(value) if name in {"begins", "ends"} else value for name, value in other.items()}
        )

    def test_of_another_person_it_is_refused(self, shop: Shop, server: Server) -> None:
        enter(shop)
        shown = Person(server, "operator").send(
            "/maintenance/new", 409, machine=shop.machine, stopping_anyway="true", **WHY
        )
        assert "overlaps with it" in shown

    def test_on_the_page_too(self, shop: Shop, server: Server) -> None:
        person = Person(server, "operator")
        for _press in range(2):
            shown = person.send("/maintenance/new", machine=shop.machine, reason="Oil", stopping_anyway="true")
            assert f"Maintenance {listed(shop)[0]['id']} is entered." in shown
        assert len(listed(shop)) == 1


class TestExtending:
    def extend(self, shop: Shop, number: int, status: int, **sent: Any) -> Any:
        return shop.call("POST", f"/maintenance/{number}/extend", status, **sent)

    def test_its_end_is_moved_and_on_record(self, shop: Shop) -> None:
        made, ends = enter(shop), ahead(20)
        moved = self.extend(shop, made["id"], 200, ends=ends, reason="The bearing comes at noon")
        assert datetime.fromisoformat(moved["ends"]) == datetime.fromisoformat(ends)
        assert moved["state"] == "running"
        assert self.extend(shop, made["id"], 200, ends=ends) == moved, "sent twice"
        last, entered = shop.call("GET", f"/audit?subject=maintenance/{made['id']}")["items"]
        assert (last["action"], last["why"]) == ("maintenance extended", "The bearing comes at noon")
        assert last["before"] == entered["after"]
        assert datetime.fromisoformat(last["after"]["ends"]) == datetime.fromisoformat(ends)

    @pytest.mark.parametrize(
        ("hours", "words"), [(-1, "must come after"), (7, "must come after"), (63 * 24, "within 62 days")]
    )
    def test_an_end_that_cannot_be_is_refused(self, shop: Shop, hours: float, words: str) -> None:
        made = enter(shop)
        (error,) = self.extend(shop, made["id"], 422, ends=ahead(hours))["errors"]
        assert error["field"] == "ends"
        assert words in error["message"]
        assert listed(shop)[0]["ends"] == made["ends"]

    def test_it_does_not_run_into_the_next(self, shop: Shop) -> None:
        made = enter(shop, ends=ahead(2))
        after = enter(shop, begins=ahead(3), ends=ahead(4))
        refused = self.extend(shop, made["id"], 409, ends=ahead(3.5))
        assert f"maintenance {after['id']} from" in refused["detail"]
        self.extend(shop, made["id"], 200, ends=after["begins"])

    def test_what_is_over_is_entered_again(self, shop: Shop) -> None:
        made = enter(shop)
        shop.call("POST", f"/maintenance/{made['id']}/end")
        assert "Enter maintenance again" in self.extend(shop, made["id"], 409, ends=ahead(20))["what_to_do"]

    def test_an_operator_extends_within_a_day(self, shop: Shop, server: Server) -> None:
        made, operator = enter(shop), server.client(server.key("operator"))
        self.extend(shop, made["id"], 403, client=operator, ends=ahead(25))
        self.extend(shop, made["id"], 200, client=operator, ends=ahead(23))
        self.extend(shop, made["id"], 403, client=server.client(server.key("viewer")), ends=ahead(23.5))

    def test_on_the_page(self, shop: Shop, server: Server) -> None:
        made, person = enter(shop, ends=ahead(2)), Person(server, "operator")
        assert "must come after" in person.send(f"/maintenance/{made['id']}/extend", 422, ends=ahead(1)[:16]).lower()
        assert "is extended." in person.send(f"/maintenance/{made['id']}/extend", ends=ahead(10)[:16])
        assert listed(shop)[0]["ends"] > made["ends"]


class TestRoles:
    def test_an_operator_puts_one_machine_under_maintenance_for_a_day(self, shop: Shop, server: Server) -> None:
        operator = server.client(server.key("operator"))

        def sent(status: int, **more: Any) -> Any:
            return shop.call("POST", "/maintenance", status, client=operator, **{"machine": shop.machine} | WHY | more)

        for beyond in ({"machine": None}, {"ends": ahead(25)}, {"stopping_anyway": False}, {"begins": ahead(20)}):
            assert "requires the Engineer role" in sent(403, **beyond)["what_to_do"]
        made = sent(201, ends=ahead(23))
        assert shop.call("POST", f"/maintenance/{made['id']}/end", client=operator)["state"] == "over"

    def test_who_may_only_look_enters_and_ends_nothing(self, shop: Shop, server: Server) -> None:
        made, viewer = enter(shop), server.client(server.key("viewer"))
        shop.call("POST", "/maintenance", 403, client=viewer, machine=shop.machine, **WHY)
        shop.call("POST", f"/maintenance/{made['id']}/end", 403, client=viewer)
        assert shop.call("GET", f"/maintenance/{made['id']}", client=viewer)["state"] == "running"

    def test_the_key_of_a_machine_sees_its_own(self, shop: Shop) -> None:
        made = enter(shop)
        seen = shop.call("GET", "/maintenance", client=shop.machine_client)["items"]
        assert [each["id"] for each in seen if each["machine"]] == [made["id"]]
        enter(shop, 403, client=shop.machine_client)


class TestEnding:
    def test_it_is_on_record_who_ended_it(self, shop: Shop) -> None:
        made = enter(shop)
        ended = shop.call("POST", f"/maintenance/{made['id']}/end")
        assert (ended["state"], bool(ended["ended_by"])) == ("over", True)
        again = shop.call("POST", f"/maintenance/{made['id']}/end", 409)
        assert f"Maintenance {made['id']} ended at" in again["detail"]
        audit = shop.call("GET", f"/audit?subject=maintenance/{made['id']}")["items"]
        assert [each["action"] for each in audit] == ["maintenance ended", "maintenance entered"]

    def test_the_page_says_until_when_it_was_and_what_was_planned(self, shop: Shop, server: Server) -> None:
        made = enter(shop, ends=ahead(6))
        path = f"/maintenance?machine={shop.machine}"
        viewer = Person(server, "viewer")
        assert "planned:" not in viewer.open(path)
        ended = shop.call("POST", f"/maintenance/{made['id']}/end")
        row = viewer.open(path).partition("<tbody")[2]
        assert row.index(as_read(datetime.fromisoformat(ended["ended_at"]), "minutes")) < row.index("planned:")

    def test_what_is_planned_is_cancelled(self, shop: Shop) -> None:
        made = enter(shop, begins=ahead(5), ends=ahead(6))
        assert shop.call("POST", f"/maintenance/{made['id']}/end")["state"] == "cancelled"
        enter(shop, begins=ahead(5), ends=ahead(6))  # its time is free again


class TestClock:
    """The night of the summer time is an hour shorter, that of the winter time an hour longer."""

    def typed(self, begins: str, ends: str) -> tuple[datetime | None, datetime | None]:
        with in_zone(ZoneInfo("Europe/Belgrade")):
            read = typed(MaintenanceIn, {"reason": "Oil", "begins": begins, "ends": ends})
        return read.begins, read.ends

    def test_a_time_that_the_clock_skips_is_refused(self) -> None:
        with pytest.raises(Invalid) as refused:
            self.typed("2027-03-28T02:30", "2027-03-28T06:00")
        assert refused.value.errors[0].message.endswith("the clocks go forward in that hour")

    def test_one_that_is_there_twice_holds_both_hours(self) -> None:
        begins, ends = self.typed("2027-10-31T02:15", "2027-10-31T02:45")
        assert begins is not None
        assert ends is not None
        assert ends - begins == timedelta(hours=1, minutes=30)


class TestPages:
    def test_it_is_entered_seen_and_ended(self, shop: Shop, server: Server) -> None:
        person = Person(server, "operator")
        shown = person.send("/maintenance/new", machine=shop.machine, reason="New way covers", stopping_anyway="true")
        assert "New way covers" in shown
        (made,) = listed(shop)
        for path in (f"/machines/{shop.machine}", f"/alarms?machine={shop.machine}", f"/station/{shop.machine}"):
            shown = person.open(path)
            assert "under maintenance until" in shown
            assert f"“New way covers”, {person.name}" in shown
        assert "is ended. People are notified again." in person.send(f"/maintenance/{made['id']}/end")
        assert "is ended." in person.send(f"/maintenance/{made['id']}/end"), "sent twice"
        assert "under maintenance until" not in person.open(f"/machines/{shop.machine}")

    @pytest.mark.parametrize(
        ("begins", "ends", "words"),
        [
            ("", "never", "Is not a time"),
            ("2020-01-01T06:00", "", "Lies in the past"),
        ],
    )
    def test_what_is_refused_stands_at_its_field(
        self, shop: Shop, server: Server, begins: str, ends: str, words: str
    ) -> None:
        person = Person(server, "engineer")
        shown = person.send("/maintenance/new", 422, machine=shop.machine, reason="Oil", begins=begins, ends=ends)
        assert words in shown
        assert 'value="Oil"' in shown
        assert listed(shop) == []

    def test_an_operator_who_asks_for_more_sees_who_may(self, shop: Shop, server: Server) -> None:
        person = Person(server, "operator")
        shown = person.send("/maintenance/new", 403, machine=shop.machine, reason="Oil", ends=ahead(30)[:16])
        assert "requires the Engineer role" in shown

    def test_all_machines_are_chosen_and_no_default(self, shop: Shop, server: Server) -> None:
        """Notifications of the whole plant must not stop because a field was left as it was."""
        person = Person(server, "engineer")
        assert "Choose one, or all machines" in person.send("/maintenance/new", 422, machine="", reason="Oil")
        assert listed(shop) == []
        assert as_typed({"machine": "*", "reason": "Power cut"}).machine is None

    def test_its_ticks_count(self, shop: Shop, server: Server) -> None:
        Person(server, "engineer").send("/maintenance/new", machine=shop.machine, reason="Oil")
        (made,) = listed(shop)
        assert made["stopping_anyway"] is False, "the tick was taken away"
