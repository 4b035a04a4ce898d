"""Fixtures: how far their zeros have shifted, and the alarm of it."""

from datetime import UTC, datetime, timedelta
from typing import Any

import psycopg
import pytest
from sqlalchemy import select

from app.geometry.work_zero import queries
from app.geometry.work_zero.tables import WorkZero
from app.loop.machines.queries import machine_named
from tests.geometry.work_zero.bench import POCKET, moved, moved_along, post
from tests.servers import Server
from tests.shop import Shop


class TestFixtures:
    def test_a_shifting_vice_is_seen_and_reported(self, shop: Shop) -> None:
        first = post(shop, fixture="vice")
        assert first["shift"]["state"] == "unknown"
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        limits: dict[str, Any] = {
            "basis": "first",
            "warning": 0.01,
            "alarm": 0.03,
            "reason": "a vice that is known to move",
        }
        shop.call("PUT", path, 200, **limits)
        near = post(shop, fixture="vice", touches=moved(0.012, -0.004))
        assert near["shift"]["shifts"] == {"x": 0.012, "y": -0.004}
        assert (near["shift"]["state"], near["shift"]["reference"]) == ("warning", first["id"])
        assert shop.alarms() == []
        far = post(shop, fixture="vice", touches=moved(0.05))
        assert far["shift"]["state"] == "alarm"
        (alarm,) = shop.alarms()
        assert alarm["kind"] == "fixture_shifted"
        assert "vice has shifted by X +50.0" in alarm["text"] if "text" in alarm else True
        post(shop, fixture="vice", touches=moved(0.06))
        (alarm,) = shop.alarms()
        assert alarm["count"] == 2
        post(shop, fixture="vice", touches=moved(0.001))
        assert shop.alarms() == []
        figure = shop.call("GET", f"{path}/figure?theme=dark")
        assert moved_along(figure, "x") == pytest.approx([12.0, 50.0, 60.0, 1.0])
        with shop.server.database.begin() as session:  # here a warning of a library is a fault
            history = queries.history(session, machine_named(session, shop.machine), "vice")
        assert [each.zero.id for each in history][:2] == [first["id"], near["id"]]

    def test_against_a_frozen_one_and_the_median(self, shop: Shop) -> None:
        numbers = [post(shop, fixture="vice", touches=moved(dx))["id"] for dx in (0.0, 0.010, 0.012, 0.5, 0.011)]
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        frozen = shop.call("PUT", path, 200, basis="frozen", reference=numbers[1], reason="aligned anew")
        assert frozen["shift"]["shifts"]["x"] == pytest.approx(0.001)
        median = shop.call("PUT", path, 200, basis="median", reason="no better one")
        assert median["shift"]["shifts"]["x"] == pytest.approx(0.0)  # of 0, 10, 12 and 500 µm: 11
        assert median["shift"]["reference"] is None
        shop.call("PUT", path, 422, basis="frozen", reason="x")
        shop.call("PUT", path, 422, basis="frozen", reference=10**9, reason="x")
        told = shop.call("PUT", path, 422, basis="first", warning=0.1, alarm=0.01, reason="x")
        assert told["errors"][0]["field"] == "warning"
        figure = shop.call("GET", f"{path}/figure")
        assert len(moved_along(figure, "x")) == 4  # the first has nothing before it

    def test_two_parts_in_one_fixture_are_kept_apart(self, shop: Shop) -> None:
        post(shop, fixture="vice", work_offset="G54")
        other = post(shop, fixture="vice", work_offset="G55", touches=moved(200.0))
        assert other["shift"]["shifts"] == {}
        assert post(shop, fixture="vice", work_offset="G55", touches=moved(200.01))["shift"]["shifts"]["x"] == 0.01

    def test_one_part_in_its_place_says_nothing_of_the_other(self, shop: Shop) -> None:
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        frozen = post(shop, fixture="vice", work_offset="G54")["id"]
        post(shop, fixture="vice", work_offset="G55", touches=moved(200.0))
        shop.call("PUT", path, 200, basis="frozen", reference=frozen, alarm=0.03, reason="aligned anew")
        assert shop.alarms() == []  # 200 mm beside it stands another part, not this one
        post(shop, fixture="vice", work_offset="G54", touches=moved(0.05))
        assert len(shop.alarms()) == 1
        shop.call("PUT", path, 200, basis="first", alarm=0.03, reason="each by its own")
        post(shop, fixture="vice", work_offset="G55", touches=moved(200.001))
        assert len(shop.alarms()) == 1
        post(shop, fixture="vice", work_offset="G54", touches=moved(0.001))
        assert shop.alarms() == []

    def test_the_first_one_computed_again_is_the_first_one_still(self, shop: Shop) -> None:
        first, _second = (post(shop, fixture="vice", touches=moved(dx)) for dx in (0.0, 0.004))
        again = shop.call("POST", f"/work-zeros/{first['id']}/recompute", 201, tip=5.9, reason="calibrated since")
        assert again["shift"]["reference"] is None
        third = post(shop, fixture="vice", touches=moved(0.009))
        assert (third["shift"]["reference"], third["shift"]["total"]) == (again["id"], 0.009)
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        assert shop.call("GET", path)["last"] == third["id"]
        assert moved_along(shop.call("GET", f"{path}/figure"), "x") == pytest.approx([4.0, 9.0])

    def test_what_comes_in_late_says_nothing_of_today(self, shop: Shop) -> None:
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        for day, dx in ((1, 0.0), (20, 0.05)):
            post(shop, fixture="vice", touches=moved(dx), touched_at=f"2026-11-{day:02}T06:00:00Z")
        shop.call("PUT", path, 200, basis="first", alarm=0.03, reason="watched")
        assert len(shop.alarms()) == 1
        late = post(shop, fixture="vice", touches=moved(0.001), touched_at="2026-11-10T06:00:00Z")
        assert len(shop.alarms()) == 1
        assert shop.call("GET", path)["last"] != late["id"]
        assert moved_along(shop.call("GET", f"{path}/figure"), "x") == pytest.approx([1.0, 50.0])

    def test_one_axis_in_its_place_says_nothing_of_the_other(self, shop: Shop) -> None:
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        along_x, along_y = POCKET["touches"][:2], POCKET["touches"][2:]
        post(shop, fixture="vice")
        shop.call("PUT", path, 200, basis="first", alarm=0.03, reason="watched")
        post(shop, fixture="vice", touches=moved(0.05)[:2])
        assert len(shop.alarms()) == 1
        assert post(shop, fixture="vice", touches=along_y)["shift"]["state"] == "steady"
        assert len(shop.alarms()) == 1  # where X is, nobody has looked again
        post(shop, fixture="vice", touches=along_x)
        assert shop.alarms() == []
        last = post(shop, fixture="vice", touches=moved(0.05)[:2])["id"]
        assert len(shop.alarms()) == 1
        shop.call("PUT", path, 200, basis="frozen", reference=last, alarm=0.03, reason="aligned anew")
        assert shop.alarms() == []

    def test_a_reference_computed_again_ends_what_its_mistake_raised(self, shop: Shop) -> None:
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        corner = [{"x": 0.0, "y": 50.0, "approach": "+X"}, {"x": 50.0, "y": 0.0, "approach": "+Y"}]
        first = post(shop, kind="corner", fixture="vice", touches=corner, tip=4.0)
        shop.call("PUT", path, 200, basis="first", alarm=0.03, reason="watched")
        last = post(shop, kind="corner", fixture="vice", touches=corner, tip=6.0)
        assert (last["shift"]["state"], len(shop.alarms())) == ("alarm", 1)
        shop.call("POST", f"/work-zeros/{first['id']}/recompute", 201, tip=6.0, reason="it was the other probe")
        assert shop.call("GET", path)["shift"]["state"] == "steady"
        assert shop.alarms() == []

    def test_the_median_is_the_same_wherever_it_is_shown(self, server: Server) -> None:
        """Of a hundred zeros of the same work offset, however many of others lie between."""
        shop = Shop(server)
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        last = post(shop, fixture="vice")
        shop.call("PUT", path, 200, basis="median", reason="it drifts")
        with server.database.begin() as session:
            like = session.scalars(select(WorkZero).where(WorkZero.id == last["id"])).one()
            kept = {column.name: getattr(like, column.name) for column in WorkZero.__table__.columns}
            del kept["id"], kept["received_at"]
            for number in range(240):
                at = like.touched_at + timedelta(milliseconds=number + 1)
                more = {"x": number / 1000, "touched_at": at, "work_offset": ("G54", "G55")[number % 2]}
                session.add(WorkZero(**kept | more))
        newest = shop.call("GET", f"/work-zeros/{shop.call('GET', path)['last']}")
        assert newest["shift"]["shifts"]["x"] == pytest.approx(0.101)
        assert moved_along(shop.call("GET", f"{path}/figure"), "x")[-1] == pytest.approx(101.0)

    def test_a_clock_that_is_ahead_keeps_no_later_zero_from_telling(self, shop: Shop) -> None:
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        ahead = (datetime.now(UTC) + timedelta(hours=2)).isoformat()  # local time that is sent as if it were UTC
        first = post(shop, fixture="vice", touched_at=ahead)
        assert datetime.fromisoformat(first["touched_at"]) <= datetime.now(UTC)
        shop.call("PUT", path, 200, basis="first", alarm=0.03, reason="watched")
        assert post(shop, fixture="vice", touches=moved(0.05))["shift"]["state"] == "alarm"
        assert len(shop.alarms()) == 1

    @pytest.mark.parametrize("count", [600, pytest.param(60_000, marks=pytest.mark.long)])
    def test_years_of_zeros_are_compared(self, shop: Shop, server: Server, count: int) -> None:
        """Each with the first one; looked for among all of them, a page of the list of years took half a minute."""
        first = post(shop, fixture="vice")
        with psycopg.connect(server.database.dsn, autocommit=True) as connection:
            connection.execute(
                "INSERT INTO work_zero (machine_id, kind, fixture, work_offset, touched_at, actor, given, x, y, result) "
                "SELECT machine_id, kind, fixture, work_offset, touched_at + n * interval '1 millisecond', actor, given, "
                "x + 0.004, y, result FROM work_zero, generate_series(1, %s) AS n WHERE id = %s",
                (count, first["id"]),
            )
            connection.execute("ANALYZE work_zero")
        zeros = shop.call("GET", f"/work-zeros?machine={shop.machine}&fixture=vice&limit=100&after={first['id']}")
        assert {zero["shift"]["shifts"]["x"] for zero in zeros["items"]} == {0.004}

    def test_one_that_is_not_there(self, shop: Shop) -> None:
        shop.call("GET", f"/work-zeros/fixtures/{shop.machine}/nowhere", 404)
        shop.call("GET", "/work-zeros/fixtures/nowhere/vice", 404)
