"""Form measurements by REST: evaluated, kept with their touches, computed anew, made readings of, refused with the touch."""

from typing import Any

import psycopg
import pytest
from sqlalchemy import delete, update
from sqlalchemy.exc import DBAPIError

from app.geometry.geometric_form.tables import FormEvaluation, FormMeasurement
from tests.servers import Server
from tests.shop import Shop

PRINTED: list[list[list[float]]] = [
    [[-6.096, 24.249], [22.578, 10.784], [12.465, -21.678]],
    [[23.99, -7.346], [20.880, 13.749], [-23.388, 8.859]],
    [[5.675, 24.341], [-24.71, -3.748], [23.78, -7.699]],
    [[-12.55, 21.611], [-6.82, -24.059], [23.699, 7.911]],
]
BORE: dict[str, Any] = {
    "feature": "bore-d56-axis",
    "kind": "axis_straightness",
    "sections": [{"height": 20.0 * at, "touches": touches} for at, touches in enumerate(PRINTED)],
    "tolerance": 0.005,
    "repeatability": 0.0005,
    "tip_diameter": 6.0,
    "side": "inside",
}
PLATE: dict[str, Any] = {
    "feature": "table",
    "kind": "flatness",
    "points": [[x, y, 0.002 * ((x + y) % 2)] for x in (0.0, 1.0, 2.0) for y in (0.0, 1.0, 2.0)],
    "tolerance": 0.002,
}
HOLE: dict[str, Any] = {"height": 3.0, "touches": [[5.0, 0.0], [0.0, 5.0], [-5.0, 0.0], [0.0, -5.0]]}


def post(shop: Shop, status: int = 201, **given: Any) -> Any:
    return shop.call("POST", "/forms", status, machine=shop.machine, **given)


class TestFound:
    def test_the_printed_table_is_seen_through(self, common_shop: Shop) -> None:
        made = post(common_shop, **BORE)
        assert [value["method"] for value in made["values"]] == ["minimum_zone", "least_squares", "printed"]
        assert made["values"][2]["value"] == pytest.approx(0.1555, abs=5e-5)
        assert (made["method"], made["verdict"]["code"], made["verdict"]["good"]) == ("minimum_zone", "bad", False)
        (suspect,) = made["suspects"]
        assert (suspect["section"], suspect["touch"], suspect["given"]) == (2, 1, [23.99, -7.346])
        assert suspect["alone"][0] == pytest.approx(23.896, abs=0.006)
        assert suspect["text"].startswith("Section 2, point 1 (23.990 −7.346) deviates by +8")
        assert "With X near 23.90" in suspect["text"]
        assert made["corrected"] < 0.02
        assert made["details"]["sections"][0]["diameter"] == pytest.approx(56.0045, abs=5e-4)
        assert common_shop.call("GET", f"/forms/{made['id']}") == made

    def test_by_the_printed_method_by_name_without_heights(self, common_shop: Shop) -> None:
        given = BORE | {"method": "printed", "sections": [{"touches": touches} for touches in PRINTED]}
        made = post(common_shop, **given)
        assert (made["method"], round(made["value"], 4), made["verdict"]["good"]) == ("printed", 0.1555, False)
        assert [value["method"] for value in made["values"]] == ["printed"]

    def test_a_deviation_on_the_limit_is_good(self, common_shop: Shop) -> None:
        made = post(common_shop, **PLATE)
        assert made["value"] == pytest.approx(0.002, abs=1e-9)
        assert (made["verdict"]["code"], made["uncertainty"]) == ("good", None)
        unsure = post(common_shop, **PLATE, repeatability=0.0005)
        assert (unsure["verdict"]["good"], unsure["verdict"]["sure"]) == (True, False)
        assert post(common_shop, **(PLATE | {"tolerance": None}))["verdict"] is None

    @pytest.mark.parametrize(
        ("given", "value"),
        [
            ({"kind": "roundness", "sections": [{"touches": [[10.01, 0], [0, 9.99], [-10.01, 0], [0, -9.99]]}]}, 0.02),
            ({"kind": "straightness", "points": [[0, 0], [10, 0.01], [20, 0]]}, 0.01),
            ({"kind": "position", "sections": [{"centre": [30.003, -9.996]}], "nominal": [30, -10]}, 0.01),
            (
                {
                    "kind": "coaxiality",
                    "sections": [{"height": 80, "centre": [0.003, 0.004]}],
                    "datum": {"sections": [{"height": 0, "centre": [0, 0]}, {"height": 50, "centre": [0, 0]}]},
                },
                0.01,
            ),
            (
                {
                    "kind": "perpendicularity",
                    "sections": [{"height": 0, "centre": [5, 5]}, {"height": 100, "centre": [5.01, 5]}],
                    "datum": {"points": [[0, 0, 0], [100, 0, 0], [0, 100, 0], [100, 100, 0]]},
                },
                0.01,
            ),
            (
                {
                    "kind": "parallelism",
                    "points": [[0, 0, 10], [100, 0, 10.01], [0, 100, 10], [100, 100, 10.01]],
                    "datum": {"points": [[0, 0, 0], [100, 0, 0], [0, 100, 0], [100, 100, 0]]},
                },
                0.01,
            ),
        ],
    )
    def test_every_kind(self, common_shop: Shop, given: dict[str, Any], value: float) -> None:
        made = post(common_shop, feature="any", **given)
        assert made["value"] == pytest.approx(value, rel=1e-4)
        assert made["values"][0]["method"] == made["method"]

    def test_numbers_may_come_far_from_zero_and_in_hundreds(self, common_shop: Shop) -> None:
        far = [[x + 90_000.0, y - 50_000.0, z] for x, y, z in PLATE["points"]]
        assert post(common_shop, **(PLATE | {"points": far}))["value"] == pytest.approx(0.002, abs=1e-8)
        many = [[float(at % 40), float(at // 40), 0.001 * (at % 3)] for at in range(2000)]
        assert post(common_shop, **(PLATE | {"points": many}))["value"] == pytest.approx(0.002, abs=1e-6)
        told = post(common_shop, 422, **(PLATE | {"points": [*many, [0.0, 0.0, 0.0]]}))
        assert "2000" in told["detail"]


class TestKept:
    def test_a_machine_sends_it_twice_and_it_happens_once(self, common_shop: Shop) -> None:
        given = BORE | {"machine": common_shop.machine, "key": "form-1"}
        first = common_shop.call("POST", "/forms", 201, common_shop.machine_client, **given)
        assert common_shop.machine in first["by"]
        assert common_shop.call("POST", "/forms", 200, common_shop.machine_client, **given) == first
        common_shop.call("POST", "/forms", 409, common_shop.machine_client, **(given | {"tip_diameter": 5.0}))
        common_shop.call("POST", "/forms", 409, common_shop.machine_client, **(given | {"tolerance": 0.5}))

    def test_only_of_its_own_machine(self, server: Server, common_shop: Shop) -> None:
        other = Shop(server)
        made = post(other, **PLATE)
        common_shop.call("POST", "/forms", 403, common_shop.machine_client, **(PLATE | {"machine": other.machine}))
        common_shop.call("GET", f"/forms/{made['id']}", 403, common_shop.machine_client)
        own = post(common_shop, **PLATE)
        mine = common_shop.call("GET", "/forms?limit=1000", 200, common_shop.machine_client)["items"]
        assert own["id"] in [each["id"] for each in mine]
        assert {each["machine"] for each in mine} == {common_shop.machine}

    def test_lists_in_pages(self, server: Server) -> None:
        other = Shop(server)
        numbers = [post(other, **(PLATE | {"feature": f"f{at % 2}"}))["id"] for at in range(5)]
        first = other.call("GET", f"/forms?machine={other.machine}&limit=2")
        rest = other.call("GET", f"/forms?machine={other.machine}&limit=9&after={first['next']}")
        assert [each["id"] for each in first["items"] + rest["items"]] == numbers
        assert rest["next"] is None
        some = other.call("GET", f"/forms?machine={other.machine}&feature=f1&kind=flatness")["items"]
        assert [each["id"] for each in some] == numbers[1::2]

    def test_it_is_computed_again_and_both_results_stay(self, common_shop: Shop) -> None:
        made = post(common_shop, **BORE)
        again = common_shop.call("POST", f"/forms/{made['id']}/recompute", 201, reason="new version")
        assert (again["id"], again["evaluation"], again["value"]) == (made["id"], 2, made["value"])
        assert again["given"] == made["given"]
        with common_shop.server.database.begin() as session:
            kept = session.query(FormEvaluation).filter_by(form_id=made["id"]).count()
        assert kept == 2
        (entry,) = common_shop.call("GET", f"/audit?subject=form/{common_shop.machine}/{made['id']}")["items"]
        assert entry["why"] == "new version"

    def test_touches_and_results_cannot_be_changed(self, common_shop: Shop) -> None:
        post(common_shop, **PLATE)
        for statement in (
            update(FormMeasurement).values(tolerance=1.0),
            delete(FormMeasurement),
            update(FormEvaluation).values(value=0.0),
            delete(FormEvaluation),
        ):
            with pytest.raises(DBAPIError) as refused, common_shop.server.database.begin() as session:
                session.execute(statement)
            assert isinstance(refused.value.orig, psycopg.Error)


class TestReadings:
    def test_a_result_becomes_a_reading_whose_zones_and_alarms_work(self, shop: Shop) -> None:
        """Set up as the how-to says: the tolerance is the upper deviation, so a little more than it is out."""
        flat = f"{shop.characteristic}-flat"
        shop.add(
            flat,
            target=None,
            tolerance_width=None,
            nominal=0.0,
            upper_deviation=0.004,
            lower_deviation=0.0,
            averaging_limit=0.003,
            mode="measure_only",
            tool_memory=0,
            average_memory=0,
        )
        good = post(shop, **PLATE, characteristic=flat, part="SN-1")
        assert good["reading"]["characteristic"] == flat
        reading = shop.call("GET", f"/readings/{flat}/1")
        assert (reading["measured"], reading["part"]) == (pytest.approx(0.002), "SN-1")
        assert shop.call("GET", f"/forms/{good['id']}")["reading"]["sequence"] == 1
        before = len(shop.alarms())
        warped = [[x, y, 2.5 * z] for x, y, z in PLATE["points"]]
        post(shop, **(PLATE | {"points": warped}), characteristic=flat)
        assert shop.call("GET", f"/readings/{flat}/2")["measured"] == pytest.approx(0.005)
        assert len(shop.alarms()) > before
        assert shop.call("GET", f"/readings/{flat}/2")["zone"] == "oversize"
        assert shop.call("GET", f"/characteristics/{flat}")["parameters"]["natural_limit"] == "lower"

    def test_only_of_a_characteristic_of_this_machine(self, server: Server, common_shop: Shop) -> None:
        other = Shop(server)
        told = post(common_shop, 422, **PLATE, characteristic=other.characteristic)
        assert told["errors"][0]["field"] == "characteristic"
        assert post(common_shop, 422, **PLATE, characteristic="nowhere")["errors"]


class TestRefused:
    @pytest.mark.parametrize(
        ("given", "field", "words"),
        [
            ({"points": [[0, 0, 0], [1, 1, 0], [2, 2, 0], [3, 3, 0]]}, "points", "one straight line"),
            ({"points": [[0, 0, 0], [0, 0, 0], [1, 0, 0], [1, 0, 0]]}, "points", "coincide"),
            ({"points": [[0, 0, 0], [1, 0, 0]]}, "points", "4 points or more"),
            ({"points": [[0, 0, 0], [9, 0, 0], [0, 9, 0], [0, 9, 0]]}, "points", "coincide"),
            ({"points": [[0, 0], [1, 0]]}, "", "3 coordinates"),
            ({"datum": {"points": [[0, 0, 0], [9, 0, 0], [0, 9, 0]]}}, "", "datum means nothing for this kind"),
            ({"nominal": [0, 0]}, "", "nominal means nothing"),
            ({"length": 5.0}, "", "length means nothing"),
            (
                {"kind": "coaxiality", "points": [], "datum": {"sections": [HOLE]}, "sections": [HOLE]},
                "datum.sections",
                "Datum: Coaxiality needs 2 sections",
            ),
            (
                {"kind": "roundness", "points": [], "sections": [HOLE], "tip_diameter": 10.0, "side": "outside"},
                "tip_diameter",
                "no shaft remains",
            ),
            ({"kind": "roundness", "points": []}, "", "needs sections"),
            (
                {
                    "kind": "roundness",
                    "points": [],
                    "sections": [{"touches": [[25, 0], [24.9, 2], [24.7, 3.9], [24.8, 3]]}],
                },
                "sections[0].touches",
                "arc",
            ),
            (
                {"kind": "roundness", "points": [], "sections": [{"touches": [[0, 0], [1, 1], [2, 2], [3, 3]]}]},
                "sections[0].touches",
                "line",
            ),
            (
                {
                    "kind": "axis_straightness",
                    "points": [],
                    "sections": [{"height": 5, "centre": [0, at]} for at in (0, 1, 2)],
                },
                "sections",
                "same height",
            ),
            ({"kind": "parallelism"}, "", "needs a datum"),
            ({"kind": "parallelism", "datum": {"points": [[0, 0, 0], [1, 0, 0], [2, 0, 0]]}}, "datum.points", "line"),
            ({"kind": "position", "points": [], "sections": [{"centre": [0, 0]}]}, "nominal", "needs nominal"),
            ({"kind": "roundness", "points": [], "sections": []}, "sections", "needs sections"),
            ({"tip_diameter": 4.0}, "", "side"),
            ({"tolerance": -1.0}, "tolerance", ""),
            ({"points": [[0, 0, 1e9]] * 4}, "points[0][2]", ""),
            ({"points": [["a", 0, 0]] * 4}, "points[0][0]", ""),
        ],
    )
    def test_with_the_reason_and_nothing_stored(
        self, common_shop: Shop, given: dict[str, Any], field: str, words: str
    ) -> None:
        count = len(common_shop.call("GET", f"/forms?machine={common_shop.machine}&limit=1000")["items"])
        told = post(common_shop, 422, **(PLATE | given))
        assert words in str(told)
        if field:
            assert field in [each["field"] for each in told["errors"]]
        assert len(common_shop.call("GET", f"/forms?machine={common_shop.machine}&limit=1000")["items"]) == count

    def test_a_bore_far_from_its_place_and_one_in_inches_are_warned_of(self, common_shop: Shop) -> None:
        def codes(centre: list[float]) -> list[tuple[str, str]]:
            given = {"kind": "position", "sections": [{"centre": centre}], "nominal": [254, -127], "points": []}
            made = post(common_shop, **(PLATE | given))
            assert common_shop.call("GET", f"/forms/{made['id']}")["warnings"] == made["warnings"]
            return [(each["code"], each["field"]) for each in made["warnings"]]

        assert codes([254.01, -127.02]) == []
        assert codes([200.0, -127.0]) == [("shifted_far", "nominal")]
        assert codes([10.0, -5.001]) == [("looks_like_inches", "sections")]
        assert codes([6451.6, -3225.8]) == [("looks_like_inches", "nominal")]

    def test_what_is_not_there(self, common_shop: Shop) -> None:
        for number in (999_999, 0, -1, 10**19):
            common_shop.call("GET", f"/forms/{number}", 404)
        common_shop.call("POST", "/forms", 404, **(PLATE | {"machine": "nowhere"}))


class TestPictures:
    @pytest.mark.parametrize("theme", ["light", "dark"])
    def test_of_every_kind_and_the_trend(self, common_shop: Shop, theme: str) -> None:
        made = post(common_shop, **BORE)
        drawn = common_shop.call("GET", f"/forms/{made['id']}/figure?theme={theme}")
        assert any("suspect" in str(trace.get("name", "")).lower() for trace in drawn["data"])
        flat = post(common_shop, **(PLATE | {"feature": "trend"}))
        assert common_shop.call("GET", f"/forms/{flat['id']}/figure?theme={theme}")["data"]
        worse = [[x, y, 3 * z] for x, y, z in PLATE["points"]]
        post(common_shop, **(PLATE | {"feature": "trend", "points": worse}))
        trend = common_shop.call(
            "GET", f"/machines/{common_shop.machine}/forms/trend/figure?kind=flatness&theme={theme}"
        )
        heights = sorted({round(y, 3) for trace in trend["data"] if trace.get("mode") == "markers" for y in trace["y"]})
        assert heights == [2.0, 6.0]
