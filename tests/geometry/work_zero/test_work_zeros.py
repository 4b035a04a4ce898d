"""Work zeros by REST: found, kept, idempotent, compared, made readings of."""

from concurrent.futures import ThreadPoolExecutor
from math import radians, tan
from typing import Any

import psycopg
import pytest
from sqlalchemy import delete, update
from sqlalchemy.exc import DBAPIError

from app.db.engine import Database
from app.geometry.work_zero.tables import WorkZero
from app.loop.readings.results_actions import push_results
from app.settings import Settings
from tests.geometry.work_zero.bench import POCKET, moved, post
from tests.servers import Server
from tests.shop import Shop
from tests.waits import until

LOCKED = "SELECT pid FROM pg_stat_activity WHERE wait_event_type = 'Lock' AND datname = current_database()"


class TestImplausible:
    def test_far_from_the_zero_of_its_fixture_the_text_stops_until_acknowledged(self, shop: Shop) -> None:
        assert post(shop, fixture="vice-far")["warnings"] == []
        made = post(shop, fixture="vice-far", touches=moved(25.0))
        assert [each["code"] for each in made["warnings"]] == ["shifted_far"]
        assert made["program"].index("GOTOB INBAND_STOP") < made["program"].index("$P_UIFR")
        path = f"/work-zeros/{made['id']}"
        assert "INBAND_STOP" in shop.admin.get(f"/api/v1{path}/program").text
        seen = shop.call("POST", f"{path}/acknowledge", reason="the long part")
        assert (seen["warnings"], seen["acknowledged"]["reason"]) == (made["warnings"], "the long part")
        assert "INBAND_STOP" not in seen["program"] + shop.admin.get(f"/api/v1{path}/program").text
        shop.call("POST", f"{path}/acknowledge", 409, reason="again")

    def test_a_thick_feeler_and_a_turned_part(self, shop: Shop) -> None:
        made = post(shop, z_touched=-100.0, feeler=5.0)
        assert [(each["code"], each["field"]) for each in made["warnings"]] == [("feeler_unusual", "feeler")]
        assert post(shop, z_touched=-100.0, feeler=1.0)["warnings"] == []


class TestFound:
    def test_with_size_text_and_uncertainty(self, shop: Shop) -> None:
        made = post(shop, z_touched=-201.5, feeler=0.1, tool_length=98.25, repeatability=0.001, part="SN-1")
        assert (made["x"], made["y"], made["z"]) == (-306.01, -154.25, -299.85)
        assert (made["length"], made["width"], made["diameter"], made["rotation"]) == (100.004, 60.008, None, None)
        assert made["uncertainty"]["x"] == pytest.approx(0.002 / 2**0.5)
        assert made["uncertainty"]["length"] == pytest.approx(0.002 * 2**0.5)
        assert "$P_UIFR[1]=CTRANS(X,-306.01,Y,-154.25,Z,-299.85)\n" in made["program"]
        assert made["shift"] is None
        assert shop.call("GET", f"/work-zeros/{made['id']}") == made
        assert made["touches"][0] == {"x": -353.012, "y": None, "approach": "-X"}

    def test_as_the_printed_macros_have_it(self, shop: Shop) -> None:
        sinumerik = shop.call(
            "POST", "/work-zeros", 201, machine=shop.machine, kind="bore", tip=6.0, R1=12.0, R2=60.0, R3=7.0, R4=43.0
        )
        assert (sinumerik["x"], sinumerik["y"], sinumerik["diameter"]) == (36.0, 25.0, 66.0)
        fanuc: dict[str, Any] = {"#501": 53.0, "#502": -53.0, "#504": -33.0, "#505": 37.0, "#508": -150.0, "#2": 0.1}
        made = shop.call("POST", "/work-zeros", 201, machine=shop.machine, kind="web", tip=6.0, **fanuc)
        assert (made["x"], made["y"], made["z"], made["length"], made["width"]) == (0.0, 2.0, -150.1, 100.0, 64.0)
        assert made["records"] == [53.0, -53.0, -33.0, 37.0]

    def test_a_bore_touched_in_pairs(self, shop: Shop) -> None:
        made = post(shop, kind="bore")  # what is touched from within is the same for the tip
        assert (made["x"], made["y"], made["diameter"]) == (-306.01, -154.25, 100.004)
        assert made["notices"][0]["code"] == "chords"
        two = post(shop, kind="bore", touches=POCKET["touches"][:2])
        assert (two["y"], two["diameter"]) == (None, 100.004)
        assert "$P_UIFR[1,X,TR]=-306.01\n" in two["program"]

    def test_turned_about_a_place_that_nobody_touched(self, shop: Shop) -> None:
        """1° turned, and Y stands 400 mm beside the touches: with the rotation the part would lie 7 mm off."""
        slope = tan(radians(1.0))
        jaws: list[dict[str, Any]] = [
            {"x": -50.0 - 20 * slope, "y": 120.0, "approach": "-X"},
            {"x": -50.0 + 20 * slope, "y": 80.0, "approach": "-X"},
            {"x": 50.0, "y": 100.0, "approach": "+X"},
        ]
        made = post(shop, kind="pocket", touches=jaws)
        assert (made["x"], made["y"]) == (pytest.approx(0.0, abs=1e-9), None)
        assert made["rotation"] == pytest.approx(1.0)
        assert [each["code"] for each in made["notices"]] == ["one_axis"]
        assert "$P_UIFR[1,X,TR]=" in made["program"]
        assert "RT]=" not in made["program"]
        ends = [{"y": 0.0, "x": 0.0, "approach": "-Y"}, {"y": 200.0, "x": 0.0, "approach": "+Y"}]
        both = post(shop, kind="pocket", touches=[*jaws, *ends])
        assert both["notices"] == []
        assert "$P_UIFR[1,Z,RT]=1\n" in both["program"]

    def test_the_text_for_another_control(self, shop: Shop) -> None:
        made = post(shop)
        path = f"/api/v1/work-zeros/{made['id']}/program"
        own = shop.admin.get(path)
        assert own.text == made["program"]
        assert own.headers["content-disposition"].endswith('.spf"')
        fanuc = shop.admin.get(path, params={"control": "fanuc"})
        assert "G90 G10 L2 P1 X-306.01 Y-154.25\n" in fanuc.text
        other = post(shop, work_offset="G505")
        assert (
            shop.admin.get(f"/api/v1/work-zeros/{other['id']}/program", params={"control": "fanuc"}).status_code == 404
        )
        assert shop.admin.get(path, params={"control": "abacus"}).status_code == 422

    def test_for_a_fanuc_as_g10(self, server: Server) -> None:
        other = Shop(server)
        other.call("PATCH", f"/machines/{other.machine}", control="fanuc")
        made = post(other, work_offset="g54.1 p12")
        assert made["work_offset"] == "G54.1 P12"
        assert "G90 G10 L20 P12 X-306.01 Y-154.25\n" in made["program"]
        refused = post(other, 422, work_offset="G505")
        assert refused["errors"][0]["field"] == "work_offset"

    def test_a_machine_sends_it_twice_and_it_happens_once(self, shop: Shop) -> None:
        given = POCKET | {"machine": shop.machine, "key": "zero-1"}
        first = shop.call("POST", "/work-zeros", 201, shop.machine_client, **given)
        assert first["by"] == f"machine {shop.machine}" or shop.machine in first["by"]
        assert shop.call("POST", "/work-zeros", 200, shop.machine_client, **given) == first
        shop.call("POST", "/work-zeros", 409, shop.machine_client, **(given | {"tip": 5.0}))

    def test_only_of_its_own_machine(self, server: Server, shop: Shop) -> None:
        other = Shop(server)
        made = post(other)
        shop.call("POST", "/work-zeros", 403, shop.machine_client, **(POCKET | {"machine": other.machine}))
        shop.call("GET", f"/work-zeros/{made['id']}", 404, shop.machine_client)
        assert all(
            z["machine"] == shop.machine for z in shop.call("GET", "/work-zeros", 200, shop.machine_client)["items"]
        )

    def test_lists_in_pages(self, server: Server) -> None:
        other = Shop(server)
        numbers = [post(other, fixture="vice" if at % 2 else None)["id"] for at in range(5)]
        first = other.call("GET", f"/work-zeros?machine={other.machine}&limit=2")
        rest = other.call("GET", f"/work-zeros?machine={other.machine}&limit=9&after={first['next']}")
        assert [each["id"] for each in first["items"] + rest["items"]] == numbers
        assert rest["next"] is None
        mine = other.call("GET", f"/work-zeros?machine={other.machine}&fixture=vice")["items"]
        assert [each["id"] for each in mine] == numbers[1::2]

    def test_computed_again_with_another_tip(self, shop: Shop) -> None:
        first = post(shop, fixture="recomputed")
        again = shop.call("POST", f"/work-zeros/{first['id']}/recompute", 201, tip=5.998, reason="tip calibrated since")
        assert (again["length"], again["recomputed_from"]) == (100.002, first["id"])
        assert again["touched_at"] == first["touched_at"]
        late = shop.call("POST", f"/work-zeros/{first['id']}/recompute", 409, tip=6.0, reason="x")
        assert late["number"] == again["id"]
        fixture = shop.call("GET", f"/work-zeros/fixtures/{shop.machine}/recomputed")
        assert fixture["last"] == again["id"]
        shop.call("POST", f"/work-zeros/{again['id']}/recompute", 422, leave_out=[9], reason="x")

    def test_what_was_found_stays(self, shop: Shop) -> None:
        post(shop)
        for statement in (update(WorkZero).values(x=0.0), delete(WorkZero)):
            with pytest.raises(DBAPIError) as refused, shop.server.database.begin() as session:
                session.execute(statement)
            assert isinstance(refused.value.orig, psycopg.Error)


class TestRefused:
    @pytest.mark.parametrize(
        ("change", "field", "words"),
        [
            ({"touches": None}, "touches", "0 points received"),
            ({"touches": [{"x": 1.0, "approach": "+X"}, {"x": 2.0, "approach": "-X"}]}, "touches[0]", "wrong side"),
            ({"touches": [{"x": 1.0}, {"x": 2.0, "approach": "-X"}]}, "touches[0]", "direction"),
            ({"kind": "bore", "touches": [{"x": 1.0, "y": 1.0}] * 3}, "touches[0]", "same place"),
            ({"kind": "bore", "touches": [{"x": float(x), "y": 0.0} for x in range(3)]}, "touches", "one line"),
            (
                {"kind": "web", "touches": [{"x": 4.0, "approach": "-X"}, {"x": 0.0, "approach": "+X"}]},
                "touches",
                "tip",
            ),
            ({"records": [1.0, 2.0, 3.0, 4.0]}, "records", "not both"),
            ({"work_offset": "G58"}, "work_offset", "no work offset"),
            ({"characteristics": {"x": "nowhere"}}, "characteristics.x", "no characteristic"),
        ],
    )
    def test_with_the_field_and_what_to_do(self, shop: Shop, change: dict[str, Any], field: str, words: str) -> None:
        before = len(shop.call("GET", f"/work-zeros?machine={shop.machine}&limit=1000")["items"])
        told = post(shop, 422, **change)
        assert told["errors"][0]["field"] == field
        assert words in told["detail"]
        assert told["what_to_do"]
        assert len(shop.call("GET", f"/work-zeros?machine={shop.machine}&limit=1000")["items"]) == before


class TestReadings:
    def test_what_cannot_become_readings_now_is_no_error(self, caplog: pytest.LogCaptureFixture) -> None:
        """The zero is stored by then: an answer that says it is not would have it sent twice."""
        push_results(Database("postgresql://nobody@127.0.0.1:9/none"))
        assert "tried again within a minute" in caplog.text

    def test_many_at_once_do_not_wait_for_each_other(self, server: Server) -> None:
        """More of them than the server has connections: each holds one while it looks for its machine."""
        shop = Shop(server)
        senders = [server.client(server.key()) for _ in range(48)]
        given = POCKET | {"machine": shop.machine}
        settings = Settings(database_url=server.database.dsn)
        overflow = settings.pool_size if settings.pool_overflow is None else settings.pool_overflow
        with psycopg.connect(server.database.dsn) as holding, ThreadPoolExecutor(len(senders)) as pool:
            for client in senders:
                assert client.get("/api/v1/machines").status_code == 200  # its key is known from now on
            holding.execute("LOCK TABLE machine IN ACCESS EXCLUSIVE MODE")
            waiting = [pool.submit(client.post, "/api/v1/work-zeros", json=given) for client in senders]
            with psycopg.connect(server.database.dsn, autocommit=True) as looking:
                until(lambda: len(looking.execute(LOCKED).fetchall()) >= settings.pool_size + overflow)  # all are taken
            assert not any(each.done() for each in waiting)
            holding.rollback()
            assert {each.result().status_code for each in waiting} == {201}

    def test_a_zero_becomes_readings(self, shop: Shop) -> None:
        limits = {"tolerance_width": 0.02, "zero_range": 0.002, "averaging_limit": 0.006, "mode": "measure_only"}
        shop.add(f"{shop.characteristic}-x", target=-306.01, tool_memory=0, average_memory=0, **limits)
        named = {"x": f"{shop.characteristic}-x"}
        made = post(shop, characteristics=named, key="twice", part="SN-7")
        (pushed,) = made["readings"]
        assert (pushed["result"], pushed["characteristic"], pushed["sequence"]) == ("x", named["x"], 1)
        reading = shop.call("GET", f"/readings/{named['x']}/1")
        assert (reading["measured"], reading["deviation"], reading["part"]) == (-306.01, 0.0, "SN-7")
        assert reading["key"] == f"work-zero:{made['id']}:x"
        assert post(shop, 200, characteristics=named, key="twice", part="SN-7") == made
        assert len(shop.call("GET", f"/readings?characteristic={named['x']}")["items"]) == 1

    def test_a_fixture_remembers_what_becomes_readings_and_their_alarms_are_raised(self, shop: Shop) -> None:
        limits = {"tolerance_width": 0.02, "zero_range": 0.002, "averaging_limit": 0.006, "mode": "measure_only"}
        shop.add(f"{shop.characteristic}-y", target=-154.25, tool_memory=0, average_memory=0, **limits)
        post(shop, fixture="vice")
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        shop.call("PUT", path, 200, characteristics={"y": f"{shop.characteristic}-y"}, reason="SPC on the vice")
        made = post(shop, fixture="vice", touches=moved(0.0, 0.05))
        assert made["readings"][0]["sequence"] == 1
        assert {alarm["kind"] for alarm in shop.alarms()} == {"oversize"}
