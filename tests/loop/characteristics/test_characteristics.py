"""Characteristics over HTTP: parameters under both names, versions, conflicts, and everything that can be wrong."""

import threading
from typing import Any

import pytest

from app.core.parameters import FIELDS
from tests.shop import PARAMETERS, Shop

CONTRACT: dict[str, Any] = {
    "tool_memory": 3,
    "average_memory": 5,
    "variant": "single",
    "points": 1,
    "repeats": 1,
    "axis": "X",
    "direction": "positive",
    "nominal": 40.0,
    "upper_deviation": 0.0,
    "lower_deviation": -0.016,
    "zero_range": 0.001,
    "averaging_limit": 0.0053,
    "wear_limit": 0.3,
    "confidence_limit": 1.0,
    "weighting_factor": 2,
    "path_factor": 1,
    "factor": -1,
    "accept": {"n": 1, "m": 1},
    "mode": "automatic",
    "wear_policy": "hold",
    "max_step": None,
    "max_total": None,
}


def path(common_shop: Shop, more: str = "") -> str:
    return f"/characteristics/{common_shop.characteristic}{more}"


def change(common_shop: Shop, status: int = 200, /, **parameters: Any) -> Any:
    return common_shop.call("PATCH", path(common_shop), status, parameters=parameters, reason="because")


class TestSetUp:
    def test_the_example_of_the_contract(self, common_shop: Shop) -> None:
        body: dict[str, Any] = {
            "key": "shaft-d40",
            "name": "Bearing seat Ø40 h6",
            "machine": common_shop.machine,
            "part": "shaft-0815",
            "unit": "mm",
        }
        made = common_shop.call("POST", "/characteristics", 201, **body, parameters=CONTRACT)
        assert {name: made[name] for name in body} == body
        assert made["parameters"].items() >= CONTRACT.items()
        assert (made["parameters"]["target"], made["parameters"]["tolerance_width"]) == (39.992, 0.016)
        assert (made["parameters_version"], made["warnings"]) == (1, [])
        assert common_shop.call("GET", "/characteristics/shaft-d40") == made

    def test_r_numbers_mean_the_same_as_names(self, common_shop: Shop) -> None:
        r_of = {field.name: field.r or field.name for field in FIELDS}
        under_r = {r_of.get(name, name): value for name, value in CONTRACT.items()}
        assert "R33" in under_r
        body: dict[str, Any] = {"name": "x", "machine": common_shop.machine}
        by_r = common_shop.call("POST", "/characteristics", 201, key="by-r", **body, parameters=under_r)
        by_name = common_shop.call("POST", "/characteristics", 201, key="by-name", **body, parameters=CONTRACT)
        assert by_r["parameters"] == by_name["parameters"]

    def test_codes_of_the_control_and_two_points(self, common_shop: Shop) -> None:
        given = PARAMETERS | {"r31": 1, "R30": 2, "R24": 1}
        made = common_shop.call(
            "POST", "/characteristics", 201, key="coded", name="x", machine=common_shop.machine, parameters=given
        )["parameters"]
        assert (made["direction"], made["axis"], made["variant"]) == ("negative", "Z", "two_point")

    def test_r24_beside_r25_in_a_change(self, common_shop: Shop) -> None:
        common_shop.add("switched", R25=1, R28=2)

        def changed(**given: Any) -> tuple[str, list[str]]:
            body: dict[str, Any] = {"parameters": given, "reason": "the tables of the source print both"}
            answer = common_shop.call("PATCH", "/characteristics/switched", **body)
            return answer["parameters"]["variant"], [each["code"] for each in answer["warnings"]]

        assert changed(R24=0) == ("indexed", [])
        assert changed(R24=1, R25=1)[0] == changed(R25=0, R24=1)[0] == "two_point"
        assert "switch_wins" in changed(R25=1, R24=1)[1]
        assert changed(R25=1, R24=0) == ("indexed", [])
        assert changed(R25=0, R24=0) == ("single", [])
        assert changed(R24=1)[0] == "two_point"
        assert changed(R24=0)[0] == "single"

    def test_a_target_changed_to_the_same_in_inches_is_named(self, common_shop: Shop) -> None:
        common_shop.add("to-inches")
        given: dict[str, Any] = {"parameters": {"target": 1.5748}, "reason": "new drawing"}
        made = common_shop.call("PATCH", "/characteristics/to-inches", **given)
        assert ("looks_like_inches", "parameters.target") in {
            (each["code"], each["field"]) for each in made["warnings"]
        }

    def test_unusual_values_are_taken_with_a_warning(self, common_shop: Shop) -> None:
        given = PARAMETERS | {"weighting_factor": 7, "wear_limit": 0.05}
        made = common_shop.call(
            "POST", "/characteristics", 201, key="unusual", name="x", machine=common_shop.machine, parameters=given
        )
        assert made["warnings"] == [
            {
                "code": "source_range",
                "field": "parameters.wear_limit",
                "text": "R37 wear limit 0.05 mm is unusual: the control's range is 0.3 to 3 mm; check that it is in mm",
            },
            {
                "code": "source_range",
                "field": "parameters.weighting_factor",
                "text": "R29 weighting factor k 7 is unusual: the control's range is 1 to 4",
            },
        ]

    @pytest.mark.parametrize(
        ("given", "code", "field"),
        [
            ({"path_factor": 7}, "source_range", "path_factor"),
            ({"R25": 1, "R26": 400}, "source_range", "index"),
            ({"R25": 1, "R30": 2}, "variant_axis", "axis"),
            ({"R25": 3, "R23": 3, "R26": 8, "R30": 2}, "variant_axis", "axis"),
            ({"R25": 3, "R23": 3}, "spacing_missing", "index"),
            ({"R25": 2, "R23": 4, "R26": 0}, "places_coincide", "index"),
            ({"R25": 2, "R23": 5, "R26": 90}, "places_coincide", "index"),
            ({"average_memory": 0, "weighting_factor": 3, "zero_range": 0.0018}, "averages_never", "average_memory"),
            ({"R25": 2}, "points_missing", "points"),
            ({"R24": 1}, "not_on_lathe", "variant"),
            ({"factor": 0.5}, "factor_on_lathe", "factor"),
            ({"R27": 11}, "source_range", "repeats"),
            ({"factor": -25.4}, "factor_of_a_unit", "factor"),
            ({"factor": -0.001}, "factor_of_a_unit", "factor"),
            ({"confidence_limit": 2.000001}, "out_of_reach", "confidence_limit"),
        ],
    )
    def test_what_the_cycles_would_not_take_is_warned_of(
        self, common_shop: Shop, given: dict[str, Any], code: str, field: str
    ) -> None:
        common_shop.call("PATCH", f"/machines/{common_shop.machine}", type="lathe")
        key = f"unusual-{code}-{field}".replace("_", "-")
        made = common_shop.call(
            "POST", "/characteristics", 201, key=f"{key}-{len(str(given))}", name="x", machine=common_shop.machine,
            parameters=PARAMETERS | {"path_factor": 2} | given,
        )  # fmt: skip
        assert [(each["code"], each["field"]) for each in made["warnings"]] == [(code, f"parameters.{field}")]
        common_shop.call("PATCH", f"/machines/{common_shop.machine}", type="mill")
        on_a_mill = [each["code"] for each in common_shop.call("GET", f"/characteristics/{made['key']}")["warnings"]]
        assert on_a_mill == {"not_on_lathe": [], "factor_on_lathe": ["factor_outside"]}.get(code, [code])

    @pytest.mark.parametrize(
        ("machine", "given", "codes"),
        [
            ("mill", {"factor": -0.5}, []),
            ("mill", {"factor": 0.5, "feature": "inside"}, []),
            ("mill", {"factor": -1, "feature": "inside", "axis": "Z"}, []),  # a length
            ("mill", {"factor": 0.5}, ["factor_outside"]),
            ("other", {"factor": 1}, ["factor_outside"]),
            ("mill", {"factor": -0.5, "feature": "inside"}, ["factor_inside"]),
            ("other", {"factor": -1, "feature": "inside"}, []),  # a bore that is turned
            ("mill", {"factor": 0.5, "mode": "measure_only"}, []),
        ],
    )
    def test_a_factor_of_the_other_sign_is_warned_of(
        self, shop: Shop, machine: str, given: dict[str, Any], codes: list[str]
    ) -> None:
        shop.call("PATCH", f"/machines/{shop.machine}", type=machine)
        body: dict[str, Any] = {
            "key": f"{shop.characteristic}-b",
            "name": "x",
            "machine": shop.machine,
            "parameters": PARAMETERS | given,
        }
        assert [each["code"] for each in shop.call("POST", "/characteristics", 201, **body)["warnings"]] == codes

    def test_a_taken_key_is_a_conflict_and_an_unknown_machine_is_named(self, common_shop: Shop) -> None:
        body: dict[str, Any] = {"name": "x", "parameters": PARAMETERS}
        common_shop.call(
            "POST", "/characteristics", 409, key=common_shop.characteristic, machine=common_shop.machine, **body
        )
        problem = common_shop.call("POST", "/characteristics", 422, key="lost", machine="nowhere", **body)
        assert problem["errors"] == [{"field": "machine", "message": "There is no machine 'nowhere'; set it up first"}]

    def test_it_takes_readings_at_once(self, common_shop: Shop) -> None:
        common_shop.add("ready")
        assert common_shop.read(3.0, "ready")["parameters_version"] == 1

    def test_lists(self, common_shop: Shop) -> None:
        keys: list[str] = []
        page: Any = {"next": ""}
        while page["next"] is not None:
            page = common_shop.call(
                "GET", f"/characteristics?machine={common_shop.machine}&limit=2&after={page['next']}"
            )
            keys += [item["key"] for item in page["items"]]
        assert keys == sorted(keys)
        assert common_shop.characteristic in keys
        common_shop.call("GET", "/characteristics?machine=nowhere", 404)


class TestChange:
    def test_a_part_of_the_parameters_makes_a_new_version(self, server: Any) -> None:
        common_shop = Shop(server)
        assert common_shop.read(3.0)["parameters_version"] == 1
        before = common_shop.call("GET", path(common_shop))["parameters"]
        after = common_shop.call(
            "PATCH", path(common_shop), parameters={"R33": 0.002, "mode": "approval"}, reason="new probe"
        )
        assert after["parameters"] == before | {"zero_range": 0.002, "mode": "approval"}
        assert after["parameters_version"] == 2
        assert common_shop.read(3.0)["parameters_version"] == 2
        assert common_shop.call("GET", f"/readings/{common_shop.characteristic}/1")["parameters_version"] == 1
        versions = common_shop.call("GET", path(common_shop, "/parameters"))["items"]
        assert [(one["version"], one["reason"], one["by"]) for one in versions] == [
            (2, "new probe", "key a test's key"),
            (1, None, "key a test's key"),
        ]
        assert versions[1]["parameters"] == before
        entry = common_shop.call("GET", f"/audit?subject=characteristic/{common_shop.characteristic}")["items"][0]
        assert (entry["before"], entry["after"], entry["why"]) == (
            {"zero_range": 0.001, "mode": "automatic"},
            {"zero_range": 0.002, "mode": "approval", "superseded": [1]},
            "new probe",
        )

    def test_a_tolerance_class_in_place_of_the_nominal_size(self, server: Any) -> None:
        common_shop = Shop(server)
        after = common_shop.call("PATCH", path(common_shop), parameters={"nominal": "40 g6"}, reason="new drawing")[
            "parameters"
        ]
        assert (after["nominal"], after["upper_deviation"], after["lower_deviation"]) == (40, -0.009, -0.025)
        assert after["target"] == 39.983
        (error,) = common_shop.call("PATCH", path(common_shop), 422, parameters={"R42": "40 q6"}, reason="typed wrong")[
            "errors"
        ]
        assert error["field"] == "parameters.nominal"
        assert "ISO 286" in error["message"]

    def test_without_a_reason_nothing_changes(self, common_shop: Shop) -> None:
        for reason in ({}, {"reason": None}, {"reason": "   "}):
            problem = common_shop.call("PATCH", path(common_shop), 422, parameters={"R33": 0.002}, **reason)
            assert problem["errors"][0]["field"] == "reason"
        assert common_shop.call("GET", path(common_shop))["parameters"]["zero_range"] == 0.001

    def test_name_and_part_need_none_and_make_no_version(self, common_shop: Shop) -> None:
        before = common_shop.call("GET", path(common_shop))
        after = common_shop.call("PATCH", path(common_shop), name="Седиште „А”", part="0815")
        assert after == before | {"name": "Седиште „А”", "part": "0815"}
        assert common_shop.call("PATCH", path(common_shop), part=None)["part"] is None

    def test_what_does_not_differ_makes_no_version(self, common_shop: Shop) -> None:
        before = common_shop.call("GET", path(common_shop))
        assert change(common_shop, 200, **before["parameters"]) == before
        assert (
            common_shop.call("PATCH", path(common_shop), parameters=before["parameters"], name=before["name"]) == before
        )

    def test_null_goes_back_to_the_default(self, server: Any) -> None:
        common_shop = Shop(server)
        assert change(common_shop, R34=None, max_step=0.01)["parameters"]["averaging_limit"] == pytest.approx(0.016 / 3)
        assert change(common_shop, max_step=None)["parameters"]["max_step"] is None
        problem = change(common_shop, 422, R33=None)
        assert problem["errors"][0] == {
            "field": "parameters.zero_range",
            "message": "R33 zero range is missing; enter it",
        }

    def test_an_averaging_limit_left_to_its_default_follows_the_tolerance(self, server: Any) -> None:
        common_shop = Shop(server)
        change(common_shop, averaging_limit=None)
        narrowed = change(common_shop, tolerance_width=0.008)["parameters"]
        assert narrowed["averaging_limit"] == pytest.approx(0.008 / 3, abs=1e-9)
        assert (
            change(common_shop, averaging_limit=0.003, tolerance_width=0.01)["parameters"]["averaging_limit"] == 0.003
        )

    def test_drawing_and_target_replace_each_other(self, server: Any) -> None:
        common_shop = Shop(server)
        drawn = change(common_shop, nominal=40, upper_deviation=0.02, lower_deviation=0.0)["parameters"]
        assert (drawn["target"], drawn["tolerance_width"], drawn["nominal"]) == (40.01, 0.02, 40.0)
        moved = change(common_shop, R42=41)["parameters"]
        assert (moved["target"], moved["upper_deviation"]) == (41.01, 0.02)
        direct = change(common_shop, target=40.0)["parameters"]
        assert (direct["target"], direct["tolerance_width"], direct["nominal"]) == (40.0, 0.02, None)
        problem = change(common_shop, 422, nominal=40)
        assert {error["field"] for error in problem["errors"]} == {
            "parameters.upper_deviation",
            "parameters.lower_deviation",
        }

    def test_a_new_target_restarts_the_average_and_only_that_one(self, server: Any) -> None:
        common_shop = Shop(server)
        common_shop.read(1.0)
        assert common_shop.average() == pytest.approx(0.0005)
        change(common_shop, weighting_factor=3)
        assert common_shop.average() == pytest.approx(0.0005)
        change(common_shop, target=40.0000000001)
        assert common_shop.average() == pytest.approx(0.0005), "the same to the nanometre"
        change(common_shop, target=40.001)
        assert common_shop.average() == 0

    def test_two_engineers_at_once(self, server: Any) -> None:
        common_shop = Shop(server)
        seen = common_shop.call("GET", path(common_shop))["parameters_version"]
        common_shop.call("PATCH", path(common_shop), parameters={"R29": 3}, reason="first", parameters_version=seen)
        problem = common_shop.call(
            "PATCH", path(common_shop), 409, parameters={"R29": 4}, reason="second", parameters_version=seen
        )
        assert problem["parameters_version"] == 2
        assert "key a test's key" in problem["detail"]
        assert common_shop.call("GET", path(common_shop))["parameters"]["weighting_factor"] == 3

    def test_changes_at_the_same_moment_all_get_a_version(self, server: Any) -> None:
        common_shop = Shop(server)
        statuses: list[int] = []

        def one(number: int) -> None:
            body = {"parameters": {"R27": number}, "reason": f"change {number}"}
            client = common_shop.server.client(common_shop.admin.headers["Authorization"].removeprefix("Bearer "))
            statuses.append(client.patch(f"/api/v1{path(common_shop)}", json=body).status_code)

        threads = [threading.Thread(target=one, args=(number,)) for number in range(2, 10)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert statuses == [200] * 8
        versions = common_shop.call("GET", path(common_shop, "/parameters"))["items"]
        assert [one["version"] for one in versions] == list(range(9, 0, -1))
        assert versions[0]["parameters"] == common_shop.call("GET", path(common_shop))["parameters"]

    def test_key_and_machine_stay(self, common_shop: Shop) -> None:
        other = Shop(common_shop.server)
        body: dict[str, Any] = {"key": "other", "machine": other.machine, "name": "Moved"}
        problem = common_shop.call("PATCH", path(common_shop), 422, **body)
        assert [error["field"] for error in problem["errors"]] == ["key", "machine"]
        assert (
            common_shop.call("PATCH", path(common_shop), key=common_shop.characteristic, machine=common_shop.machine)[
                "name"
            ]
            != "Moved"
        )

    def test_another_tool_counts_its_own_parts(self, server: Any) -> None:
        common_shop = Shop(server)
        for _part in range(3):
            common_shop.read(0.9)
        assert common_shop.average() > 0
        change(common_shop, tool_memory=7)
        assert common_shop.tool(7)["parts"] == 0
        assert common_shop.average() == 0, "it was the average of the other tool"
        common_shop.read(0.0)
        assert common_shop.tool(7)["parts"] == 1


ORDER = [
    (
        {"R34": 0.009},
        "averaging_limit",
        (
            "R34 averaging limit 0.0090 mm must not be larger than R35/2 = 0.0080 mm; lower it, or leave it empty for a "
            "third of the tolerance"
        ),
    ),
    (
        {"R33": 0.005},
        "averaging_limit",
        "R33 zero range 0.0050 mm must be smaller than R34 averaging limit 0.0050 mm; lower the one or raise the other",
    ),
    (
        {"R33": 0, "R34": 1e-10},
        "averaging_limit",
        (
            "R33 and R34 are the same to a nanometre (0.000001 mm), finer than which nothing is compared; lower the one or raise "
            "the other"
        ),
    ),
    ({"R37": 0.0079}, "wear_limit", "R37 wear limit 0.0079 mm must not be smaller than R35/2 = 0.0080 mm; raise it"),
    (
        {"R36": 0.299999},
        "confidence_limit",
        "R37 wear limit 0.3000 mm must not be larger than R36 confidence limit 0.299999 mm; lower the one or raise the other",
    ),
]


@pytest.mark.parametrize(("given", "field", "message"), ORDER)
def test_a_broken_order_names_the_pair_and_what_to_do(
    common_shop: Shop, given: dict[str, float], field: str, message: str
) -> None:
    assert change(common_shop, 422, **given)["errors"] == [{"field": f"parameters.{field}", "message": message}]


def test_a_whole_number_as_text_is_no_length(common_shop: Shop) -> None:
    wrong = change(common_shop, 422, R10="3")["errors"][0]["message"]
    assert wrong == "R10 tool memory must be a whole number, in JSON without quotation marks"


NUMBERS = [field.name for field in FIELDS if field.kind in {"length", "number", "whole"}]
CHOICES = [field.name for field in FIELDS if field.kind == "choice"]
HUGE = 10**400
BAD: dict[str, list[Any]] = (
    {name: ["0.001", "", True, [], {}, HUGE, 1e300, -1e300] for name in NUMBERS}
    | {name: ["", "nonsense", 99, -1, True, [], {"a": 1}, 0.5] for name in CHOICES}
    | {
        "rejected_may_correct": [1, "true", "", []],
        "accept": [
            *[2, "2 of 3", [2, 3], {}, {"n": 1}, {"n": 2, "m": 1}, {"n": 0, "m": 1}, {"n": 1.5, "m": 3}],
            *[{"n": True, "m": True}, {"n": 1, "m": 101}, {"n": 1, "m": 1, "x": 1}],
        ],
        "R99": [1],
        "zero_rnage": [0.001],
    }
)
MORE: dict[str, list[Any]] = {
    "tool_memory": [33, 1.5],
    "average_memory": [21],
    "weighting_factor": [0.999],
    "factor": [0],
    "zero_range": [-0.001],
}
for name, more in MORE.items():
    BAD[name] += more


@pytest.mark.parametrize(("name", "bad"), [(name, bad) for name, values in BAD.items() for bad in values])
def test_every_bad_parameter_is_named_and_nothing_is_changed(common_shop: Shop, name: str, bad: Any) -> None:
    before = common_shop.call("GET", path(common_shop, "/parameters"))
    if name in {"nominal", "upper_deviation", "lower_deviation"}:
        drawing = {"nominal": 40, "upper_deviation": 0, "lower_deviation": -0.016}
        problem = change(common_shop, 422, **(drawing | {name: bad}))
    else:
        problem = change(common_shop, 422, **{name: bad})
    assert f"parameters.{name}" in [error["field"] for error in problem["errors"]]
    assert all(error["message"] for error in problem["errors"])
    assert common_shop.call("GET", path(common_shop, "/parameters")) == before


@pytest.mark.parametrize("bad", ["NaN", "Infinity", "-Infinity", "1e999", '"\\u0000"', '"\\ud800"', "1" * 5000])
def test_what_json_readers_disagree_about_is_refused(common_shop: Shop, bad: str) -> None:
    answer = common_shop.admin.patch(
        f"/api/v1{path(common_shop)}",
        content=f'{{"parameters": {{"zero_range": {bad}}}, "reason": "x"}}',
        headers={"Content-Type": "application/json"},
    )
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] in {"parameters.zero_range", "body"}


def test_under_two_names_at_once(common_shop: Shop) -> None:
    problem = change(common_shop, 422, R33=0.001, zero_range=0.002)
    assert "is given twice" in problem["errors"][0]["message"]


def test_everything_wrong_is_said_at_once(common_shop: Shop) -> None:
    problem = common_shop.call("PATCH", path(common_shop), 422, parameters={"R34": "x", "R10": 40, "mode": "auto"})
    assert {error["field"] for error in problem["errors"]} == {
        "parameters.averaging_limit",
        "parameters.tool_memory",
        "parameters.mode",
        "reason",
    }


BODY: dict[str, list[Any]] = {
    "key": [None, "", "Shaft", 7, "a" * 65],
    "name": [None, "", "x" * 201, 7],
    "machine": [None, "", 7, "no such"],
    "part": ["", "x" * 201, 7],
    "unit": ["inch", None, 1],
    "parameters": [None, [], "x", 7, {}],
    "sequence": [1],
}


@pytest.mark.parametrize(("field", "bad"), [(field, bad) for field, values in BODY.items() for bad in values])
def test_every_bad_field_of_a_new_one_is_named(common_shop: Shop, field: str, bad: Any) -> None:
    body = {"key": "never", "name": "x", "machine": common_shop.machine, "parameters": PARAMETERS} | {field: bad}
    problem = common_shop.call("POST", "/characteristics", 422, **body)
    assert {error["field"].partition(".")[0] for error in problem["errors"]} == {field}
    common_shop.call("GET", "/characteristics/never", 404)
