"""Work zeros by REST: found, kept, idempotent, compared, made readings of."""

from math import radians, tan
from typing import Any

import psycopg
import pytest
from sqlalchemy import delete, update
from sqlalchemy.exc import DBAPIError

from app.zeros.tables import WorkZero
from tests.conftest import Server
from tests.shop import Shop

POCKET: dict[str, Any] = {
    "kind": "pocket",
    "tip": 6.0,
    "touches": [
        {"x": -353.012, "approach": "-X"},
        {"x": -259.008, "approach": "+X"},
        {"y": -181.254, "approach": "-Y"},
        {"y": -127.246, "approach": "+Y"},
    ],
}


@pytest.fixture(scope="module")
def shop(server: Server) -> Shop:
    return Shop(server)


def post(shop: Shop, status: int = 201, **more: Any) -> Any:
    return shop.call("POST", "/work-zeros", status, machine=shop.machine, **(POCKET | more))


def moved(dx: float, dy: float = 0.0) -> list[dict[str, Any]]:
    touches: list[dict[str, Any]] = []
    for touch in POCKET["touches"]:
        name, by = ("x", dx) if "x" in touch else ("y", dy)
        touches.append(touch | {name: round(touch[name] + by, 6)})
    return touches


def moved_along(figure: Any, axis: str) -> list[float]:
    (trace,) = [each for each in figure["data"] if each["meta"] == axis]
    found: list[float] = trace["y"]
    return found


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
        assert "RT]" not in made["program"]
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
            ({"touches": None}, "touches", "0 touches came"),
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


class TestFixtures:
    def test_a_shifting_vice_is_seen_and_told(self, server: Server) -> None:
        shop = Shop(server)
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

    def test_against_a_frozen_one_and_the_median(self, server: Server) -> None:
        shop = Shop(server)
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

    def test_two_parts_in_one_fixture_are_kept_apart(self, server: Server) -> None:
        shop = Shop(server)
        post(shop, fixture="vice", work_offset="G54")
        other = post(shop, fixture="vice", work_offset="G55", touches=moved(200.0))
        assert other["shift"]["shifts"] == {}
        assert post(shop, fixture="vice", work_offset="G55", touches=moved(200.01))["shift"]["shifts"]["x"] == 0.01

    def test_one_part_in_its_place_says_nothing_of_the_other(self, server: Server) -> None:
        shop = Shop(server)
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

    def test_the_first_one_computed_again_is_the_first_one_still(self, server: Server) -> None:
        shop = Shop(server)
        first, _second = (post(shop, fixture="vice", touches=moved(dx)) for dx in (0.0, 0.004))
        again = shop.call("POST", f"/work-zeros/{first['id']}/recompute", 201, tip=5.9, reason="calibrated since")
        assert again["shift"]["reference"] is None
        third = post(shop, fixture="vice", touches=moved(0.009))
        assert (third["shift"]["reference"], third["shift"]["total"]) == (again["id"], 0.009)
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        assert shop.call("GET", path)["last"] == third["id"]
        assert moved_along(shop.call("GET", f"{path}/figure"), "x") == pytest.approx([4.0, 9.0])

    def test_what_comes_in_late_says_nothing_of_today(self, server: Server) -> None:
        shop = Shop(server)
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        for day, dx in ((1, 0.0), (20, 0.05)):
            post(shop, fixture="vice", touches=moved(dx), touched_at=f"2026-11-{day:02}T06:00:00Z")
        shop.call("PUT", path, 200, basis="first", alarm=0.03, reason="watched")
        assert len(shop.alarms()) == 1
        late = post(shop, fixture="vice", touches=moved(0.001), touched_at="2026-11-10T06:00:00Z")
        assert len(shop.alarms()) == 1
        assert shop.call("GET", path)["last"] != late["id"]
        assert moved_along(shop.call("GET", f"{path}/figure"), "x") == pytest.approx([1.0, 50.0])

    def test_one_that_is_not_there(self, shop: Shop) -> None:
        shop.call("GET", f"/work-zeros/fixtures/{shop.machine}/nowhere", 404)
        shop.call("GET", "/work-zeros/fixtures/nowhere/vice", 404)


class TestReadings:
    def test_a_zero_becomes_readings(self, server: Server) -> None:
        shop = Shop(server)
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

    def test_a_fixture_remembers_what_becomes_readings_and_their_alarms_are_raised(self, server: Server) -> None:
        shop = Shop(server)
        limits = {"tolerance_width": 0.02, "zero_range": 0.002, "averaging_limit": 0.006, "mode": "measure_only"}
        shop.add(f"{shop.characteristic}-y", target=-154.25, tool_memory=0, average_memory=0, **limits)
        post(shop, fixture="vice")
        path = f"/work-zeros/fixtures/{shop.machine}/vice"
        shop.call("PUT", path, 200, characteristics={"y": f"{shop.characteristic}-y"}, reason="SPC on the vice")
        made = post(shop, fixture="vice", touches=moved(0.0, 0.05))
        assert made["readings"][0]["sequence"] == 1
        assert {alarm["kind"] for alarm in shop.alarms()} == {"oversize"}
