"""Groups, who is on duty, and days off: by REST, on the pages, and in what is sent."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import UTC, datetime, time, timedelta
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from app.language.times import local
from app.loop.notifications import sending
from app.loop.notifications.calendar_queries import public_holidays
from app.loop.notifications.group_schemas import GroupIn
from app.loop.notifications.means import Job
from tests.servers import Server
from tests.shop import Person, Shop, unique
from tests.waits import until

pytestmark = pytest.mark.own_server  # days off are of the whole plant
DAYS = range(1, 8)


@pytest.fixture(scope="module")
def admin(server: Server) -> Person:
    return Person(server, "admin")


def receiver(shop: Shop, name: str) -> int:
    sent: dict[str, Any] = {"name": name, "means": "mail", "address": f"{unique('someone')}@example.com"}
    return int(shop.call("POST", "/notifications/receivers", 201, **sent)["id"])


def off_today(shop: Shop) -> str:
    return str(local(datetime.now(UTC)).date())


Planned = Callable[[], dict[int, Job]]


@contextmanager
def planning(shop: Shop, numbers: list[int]) -> Iterator[Planned]:
    """What goes to which of these receivers now; until it ends the server itself sends nothing, and nothing of it is kept."""
    with shop.server.database.begin() as session:
        until(lambda: session.scalar(sending._PLANNING))

        def now() -> dict[int, Job]:
            session.expire_all()
            with session.begin_nested() as tried:
                found = {job.receiver: job for job in sending.plan(session, "https://inband.test", frozenset())}
                tried.rollback()
            return {number: job for number, job in found.items() if number in numbers}

        yield now
        session.rollback()


class TestByRest:
    def test_a_group_says_who_is_on_duty(self, shop: Shop) -> None:
        anna, ben = receiver(shop, "Anna"), receiver(shop, "Ben")
        today = local(datetime.now(UTC)).isoweekday()
        rota = [
            {"receivers": [anna], "days": [day for day in DAYS if day != today]},
            {"receivers": [ben], "days": [today]},
        ]
        made = shop.call("POST", "/notifications/groups", 201, name="Setters", members=[anna, ben], rota=rota)
        path = f"/notifications/groups/{made['id']}"
        duty = {"group": made["id"], "receivers": [ben], "unattended": []}
        assert shop.call("GET", f"{path}/on-duty") == duty
        shop.call("PUT", path, name="Setters", members=[anna, ben])
        assert shop.call("GET", f"{path}/on-duty")["receivers"] == []
        entries = shop.call("GET", f"/audit?subject=receiver-group/{made['id']}")["items"]
        assert {each["action"] for each in entries} == {"group added", "group changed"}

    @pytest.mark.parametrize(
        ("turn", "field"),
        [
            ({"shift": "06:30"}, "rota"),
            ({"shift": "06:00", "begins": "06:00", "ends": "07:00"}, "rota[0].shift"),
            ({"begins": "06:00"}, "rota[0].begins"),
            ({"first": "2026-12-02", "last": "2026-12-01"}, "rota[0].last"),
            ({"receivers": [2**40]}, "rota"),
        ],
    )
    def test_a_rota_that_would_never_hold_is_refused(self, shop: Shop, turn: dict[str, Any], field: str) -> None:
        anna = receiver(shop, "Anna")
        body: dict[str, Any] = {"name": "Setters", "members": [anna], "rota": [{"receivers": [anna]} | turn]}
        problem = shop.call("POST", "/notifications/groups", 422, **body)
        assert [each["field"] for each in problem["errors"]] == [field]

    def test_what_is_named_cannot_be_deleted(self, shop: Shop) -> None:
        anna = receiver(shop, "Anna")
        group = shop.call("POST", "/notifications/groups", 201, name="Setters", members=[anna])["id"]
        shop.call("DELETE", f"/notifications/receivers/{anna}", 409)
        steps = [{"on_duty": [group]}]
        route = shop.call("POST", "/notifications/routes", 201, name="Off", enabled=False, steps=steps)["id"]
        assert shop.call("GET", f"/notifications/routes/{route}")["steps"][0]["on_duty"] == [group]
        shop.call("DELETE", f"/notifications/groups/{group}", 409)
        shop.call("DELETE", f"/notifications/routes/{route}", 204)
        shop.call("DELETE", f"/notifications/groups/{group}", 204)
        shop.call("POST", "/notifications/routes", 404, name="On", steps=steps)
        shop.call("POST", "/notifications/routes", 422, name="On", steps=[{"after": 0}])

    def test_days_off_are_public_holidays_and_those_of_the_plant(self, shop: Shop) -> None:
        today = off_today(shop)
        days: dict[str, Any] = {"country": "DE", "subdivision": "BY", "days": [today]}
        shop.call("PUT", "/notifications/calendar", **days)
        coming = shop.call("GET", "/notifications/calendar/coming")["days"]
        assert coming[0]["day"] == today
        assert sum(each["day"].endswith("-01-06") for each in coming) == 1, "Epiphany, of Bavaria"
        for wrong, field in (
            ({"country": "XX"}, "country"),
            ({"country": "DE", "subdivision": "XX"}, "subdivision"),
            ({"subdivision": "BY"}, "subdivision"),
        ):
            sent: dict[str, Any] = dict(wrong)
            problem = shop.call("PUT", "/notifications/calendar", 422, **sent)
            assert [each["field"] for each in problem["errors"]] == [field]
        assert shop.call("GET", "/notifications/calendar") == days
        shop.call("PUT", "/notifications/calendar", days=[])
        assert shop.call("GET", "/notifications/calendar/coming")["days"] == []


def test_holidays_are_those_of_the_part_of_the_country() -> None:
    bavaria, berlin = (set(public_holidays("DE", part, 2026)) for part in ("BY", "BE"))
    assert bavaria - berlin, "All Saints"
    assert berlin - bavaria, "International Women's Day"


def test_a_rota_follows_the_shifts_of_the_plant() -> None:
    at = [time(6), time(14), time(22)]
    given = GroupIn(name="Night", members=[1], rota=[{"receivers": [1], "shift": "22:00"}])  # type: ignore[list-item]
    (turn,) = given.value(at).turns
    assert (turn.hours.begins, turn.hours.ends) == (at[2], at[0])
    assert given.value(at[:2]).turns == (), "the plant has no such shift any more: nobody is on duty"


class TestSending:
    def test_who_is_on_duty_is_notified_else_the_next_step(self, shop: Shop) -> None:
        anna, ben, eve = numbers = [receiver(shop, name) for name in ("Anna", "Ben", "Eve")]
        body: dict[str, Any] = {"name": "Setters", "members": [anna, ben]}
        group = shop.call("POST", "/notifications/groups", 201, **body, rota=[{"receivers": [ben]}])["id"]
        steps = [{"on_duty": [group]}, {"after": 60, "receivers": [eve]}]
        shop.call("POST", "/notifications/routes", 201, name="Duty", machines=[shop.machine], steps=steps)
        with planning(shop, numbers) as planned:
            shop.read(350)
            assert planned().keys() == {ben}
            tomorrow = {"receivers": [ben], "first": str(local(datetime.now(UTC)).date() + timedelta(1))}
            shop.call("PUT", f"/notifications/groups/{group}", **body, rota=[tomorrow])
            assert planned().keys() == {eve}, "nobody is on duty"
            made = planned()[eve].message
            assert "Nobody is on duty now in: Setters." in made.text
            assert made.data["nobody_on_duty"] == ["Setters"]

    def test_a_route_is_closed_on_days_off(self, shop: Shop) -> None:
        always, working = numbers = [receiver(shop, name) for name in ("Always", "Working")]
        today = local(datetime.now(UTC)).date()
        days = [str(today + timedelta(days)) for days in (0, 1)]
        for number, on_days_off in ((always, True), (working, False)):
            rule: dict[str, Any] = {"machines": [shop.machine], "steps": [{"receivers": [number]}]}
            shop.call("POST", "/notifications/routes", 201, name="Days", on_days_off=on_days_off, **rule)
        with planning(shop, numbers) as planned:
            shop.call("PUT", "/notifications/calendar", days=days)
            shop.read(350)
            assert planned().keys() == {always}
            shop.call("PUT", "/notifications/calendar", days=[])
            assert planned().keys() == {always, working}


class TestPages:
    def test_a_group_is_made_and_changed(self, shop: Shop, admin: Person, page: Page) -> None:
        name, anna = unique("Setters"), unique("Anna")
        number = receiver(shop, anna)
        admin.sign_in(page)
        page.goto("/setup/notifications")
        page.get_by_role("link", name="Add group").click()
        page.get_by_label("Name", exact=True).fill(name)
        page.get_by_role("group", name="Who is in it").get_by_label(anna).check()
        page.get_by_role("group", name="Who is on duty").first.get_by_label(anna).check()
        page.get_by_role("button", name="Save").click()
        expect(page.locator("#groups tr").filter(has_text=name).locator("td").last).to_have_text(anna)
        (made,) = [each for each in shop.call("GET", "/notifications/groups")["items"] if each["name"] == name]
        assert [turn["receivers"] for turn in made["rota"]] == [[number]]
        path = f"/setup/notifications/groups/{made['id']}"
        member: dict[str, Any] = {f"member-{number}": "true", "name": name}
        assert "at least" in admin.send(path, 422, name=name).lower()
        expect(page.locator("#groups tr").filter(has_text=name)).not_to_contain_text("nobody")
        admin.send(path, **member)
        expect(page.locator("#groups tr").filter(has_text=name)).to_contain_text("nobody")  # it comes by itself
        step: dict[str, Any] = {f"duty-1-{made['id']}": "true", "after-1": "0"}
        assert f"on duty: {name}" in admin.send("/setup/notifications/routes/new", name="Duty", **step)
        assert "names this group" in admin.send(path, 409, do="delete")

    def test_days_off_are_set(self, shop: Shop, admin: Person) -> None:
        assert "No day off" in admin.open("/setup/notifications")
        fields: dict[str, Any] = {"country": "DE", "subdivision": "BY", "days": f"{off_today(shop)}\n"}
        assert off_today(shop) in admin.send("/setup/notifications/days-off", **fields)
        assert "BE, BW, BY" in admin.open("/setup/notifications/days-off").replace("Augsburg, BB, ", "")
        assert "tomorrow" in admin.send("/setup/notifications/days-off", 422, **fields | {"days": "tomorrow"})
        engineer = Person(shop.server, "engineer")
        engineer.open("/setup/notifications/days-off", 403)
        engineer.open("/setup/notifications/groups/new", 403)
        shop.call("PUT", "/notifications/calendar", days=[])
