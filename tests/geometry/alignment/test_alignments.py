"""Alignments by REST: found, refused with the touch to move, composed, computed again."""

import re
from math import degrees
from typing import Any

import numpy as np
import psycopg
import pytest

from app.core.geometry.frames import from_angles
from tests.servers import Server
from tests.shop import Person, Shop

PLACES: list[tuple[list[float], str]] = [
    ([10.0, 10.0, 0.0], "+Z"),
    ([180.0, 15.0, 0.0], "+Z"),
    ([90.0, 120.0, 0.0], "+Z"),
    ([20.0, 0.0, -15.0], "+Y"),
    ([170.0, 0.0, -15.0], "+Y"),
    ([0.0, 60.0, -15.0], "+X"),
    ([30.0, 125.0, 0.0], "+Z"),
    ([150.0, 110.0, 0.0], "+Z"),
]


def touches(deviations: list[float], places: list[tuple[list[float], str]] = PLACES) -> list[dict[str, Any]]:
    return [
        {"nominal": place, "normal": normal, "deviation": off}
        for (place, normal), off in zip(places, deviations, strict=False)
    ]


SIX = touches([0.1, 0.1, 0.1, 0.0, 0.3, 0.02])


def post(shop: Shop, status: int = 201, **body: Any) -> Any:
    return shop.call("POST", "/alignments", status, machine=shop.machine, **body)


class TestSix:
    def test_six_touches_are_a_frame(self, common_shop: Shop) -> None:
        made = post(common_shop, touches=SIX, repeatability=0.002, name="pallet 4")
        gamma = 0.3 / 150
        assert made["shift"]["c"] == pytest.approx(0.1)
        assert made["angles"]["z"] == pytest.approx(degrees(np.arctan(gamma)), abs=1e-9)
        assert made["turns"]["lambda"] == pytest.approx(0, abs=1e-9)
        assert set(made["uncertainty"]) == {"a", "b", "c", "lambda", "beta", "gamma"}
        assert made["leverage"] == pytest.approx([1.0] * 6)
        assert "well" in made["condition"]["text"]
        assert made["advice"]["text"].startswith("One more point near")
        assert f"$P_PFRAME=CTRANS(X,{made['shift']['a']:.6f}".rstrip("0")[:24] in made["program"]
        assert ":CROT(Z," in made["program"]
        assert common_shop.call("GET", f"/alignments/{made['id']}") == made

    def test_by_the_printed_short_form(self, common_shop: Shop) -> None:
        made = post(common_shop, touches=SIX, method="printed")
        gamma = 0.3 / 150
        assert made["turns"]["gamma"] == pytest.approx(degrees(gamma), abs=1e-9)
        assert made["shift"] == pytest.approx({"a": 0.02, "b": -20 * gamma, "c": 0.1})
        told = post(common_shop, 422, touches=touches([0.0] * 8), method="printed")
        assert "printed short form" in told["detail"]

    def test_the_work_offset_is_set_again_where_it_is_known(self, common_shop: Shop) -> None:
        made = post(common_shop, touches=SIX, work_offset="g55", base=[100.0, 200.0, -300.0])
        assert made["given"]["work_offset"] == "G55"
        assert "$P_UIFR[2]=CTRANS(X,10" in made["program"]
        told = post(common_shop, 422, touches=SIX, work_offset="G55")
        assert told["errors"][0]["field"] == "base"
        assert (
            post(common_shop, 422, touches=SIX, work_offset="G58", base=[0.0, 0.0, 0.0])["errors"][0]["field"]
            == "work_offset"
        )

    def test_the_old_work_offset_is_kept_and_set_back(self, common_shop: Shop) -> None:
        made = post(common_shop, touches=SIX, work_offset="G55", base=[100.0, 200.0, -300.0])
        path = f"/api/v1/alignments/{made['id']}/program?restore=true"
        assert made["program"].index("R91=$P_UIFR[2,X,TR]") < made["program"].index("$P_UIFR[2]=CTRANS")
        assert f"IF R90<>-{made['id']} GOTOF INBAND_OTHER" in common_shop.admin.get(path).text
        assert "X#601 Y#602 Z#603" in common_shop.admin.get(f"{path}&control=fanuc").text
        frame = post(common_shop, touches=SIX)["id"]
        told = common_shop.admin.get(f"/api/v1/alignments/{frame}/program?restore=true")
        assert told.status_code == 404
        assert "sets a work offset back" in told.json()["detail"]

    def test_the_table_takes_the_turn(self, common_shop: Shop) -> None:
        made = post(common_shop, touches=SIX, table={"centre": [100.0, 50.0], "position": 90.0})
        assert made["table"]["turn"] == pytest.approx(-made["angles"]["z"])
        assert made["table"]["position"] == pytest.approx(90 + made["angles"]["z"])
        assert made["table"]["angles"]["z"] == 0
        assert "G0 C=DC(90." in made["program"]
        assert "CROT" not in made["program"]

    def test_where_the_tip_stood_or_where_it_touched(self, common_shop: Shop) -> None:
        found = [([0.0, 0.0, 0.1], "+Z"), ([100.0, 0.0, 0.1], "+Z"), ([0.0, 80.0, 0.1], "+Z")]
        found += [([10.0, 0.3, 0.0], "-Y"), ([90.0, 0.3, 0.0], "-Y"), ([0.02, 40.0, 0.0], "-X")]
        nominal = [place[:2] + [0.0] if normal == "+Z" else [round(p, -1) for p in place] for place, normal in found]
        away = {"+Z": [0.0, 0.0, 3.0], "-Y": [0.0, -3.0, 0.0], "-X": [-3.0, 0.0, 0.0]}
        asked = [
            [{"nominal": n, "normal": to, "measured": place} for n, (place, to) in zip(nominal, found, strict=True)],
            [
                {"nominal": n, "normal": to, "measured": [p + d for p, d in zip(place, away[to], strict=True)]}
                for n, (place, to) in zip(nominal, found, strict=True)
            ],
        ]
        surface, centre = post(common_shop, touches=asked[0]), post(common_shop, touches=asked[1], tip=6.0)
        assert surface["shift"] == pytest.approx({"a": 0.02, "b": 0.3, "c": 0.1}, abs=1e-9)
        assert centre["shift"] == pytest.approx(surface["shift"], abs=1e-9)
        assert centre["given"]["tip"] == 6.0
        again = common_shop.call(
            "POST", f"/alignments/{centre['id']}/recompute", 201, method="small", reason="to compare"
        )
        assert again["shift"] == pytest.approx(surface["shift"], abs=1e-6)

    def test_what_a_person_does_is_on_record(self, common_shop: Shop) -> None:
        made = post(common_shop, touches=SIX)
        again = common_shop.call(
            "POST", f"/alignments/{made['id']}/recompute", 201, method="small", reason="for comparison"
        )
        record = {each["subject"]: each for each in common_shop.call("GET", "/audit?limit=20")["items"]}
        last = record[f"alignment/{made['id']}"]
        assert (last["action"], last["why"]) == ("alignment computed again", "for comparison")
        assert last["after"]["shift"] == pytest.approx(list(again["shift"].values()))

    def test_only_of_its_own_machine(self, server: Server, common_shop: Shop) -> None:
        other = Shop(server)
        made = post(other, touches=SIX)
        common_shop.call("GET", f"/alignments/{made['id']}", 404, common_shop.machine_client)
        common_shop.call("POST", "/alignments", 403, common_shop.machine_client, machine=other.machine, touches=SIX)
        post(common_shop, touches=SIX)
        own = common_shop.call("GET", "/alignments?limit=1000", 200, common_shop.machine_client)["items"]
        assert {each["machine"] for each in own} == {common_shop.machine}

    def test_once_only_with_a_key(self, common_shop: Shop) -> None:
        given = {"machine": common_shop.machine, "touches": SIX, "key": "align-1"}
        first = common_shop.call("POST", "/alignments", 201, common_shop.machine_client, **given)
        assert common_shop.call("POST", "/alignments", 200, common_shop.machine_client, **given) == first
        common_shop.call("POST", "/alignments", 409, common_shop.machine_client, **(given | {"method": "small"}))

    def test_a_shift_becomes_readings(self, shop: Shop) -> None:
        pallet = f"{shop.characteristic}-c"
        shop.add(pallet, target=0.1, tool_memory=0, average_memory=0, mode="measure_only")
        made = post(shop, touches=SIX, characteristics={"c": pallet})
        assert made["readings"][0]["sequence"] == 1
        assert shop.call("GET", f"/readings/{pallet}/1")["deviation"] == pytest.approx(0.0)

    def test_of_touches_computed_again_the_last_result_counts(self, server: Server, common_shop: Shop) -> None:
        """However often, and of which one: a trend has one point for each time the part was touched."""
        one, other = (post(common_shop, touches=SIX, name="again")["id"] for _ in range(2))
        for of, method in ((one, "small"), (one, "exact"), (one + 2, "printed"), (one, "small")):
            last = common_shop.call("POST", f"/alignments/{of}/recompute", 201, method=method, reason="to compare")[
                "id"
            ]
        figure = common_shop.call("GET", f"/machines/{common_shop.machine}/alignments/figure?name=again")
        assert {len(trace["y"]) for trace in figure["data"]} == {2}
        page = Person(server, "viewer").open(f"/alignments/history?machine={common_shop.machine}&name=again")
        assert {int(each) for each in re.findall(r"/alignments/(\d+)", page)} == {last, other}


class TestMore:
    def test_the_touch_that_does_not_fit_is_named_and_left_out(self, common_shop: Shop) -> None:
        bad = touches([0.1, 0.1, 0.1, 0.0, 0.3, 0.02, 0.15, 0.1])
        made = post(common_shop, touches=bad, repeatability=0.001)
        assert made["misfits"] == [[7]]
        again = common_shop.call("POST", f"/alignments/{made['id']}/recompute", 201, leave_out=[7], reason="burr")
        assert again["recomputed_from"] == made["id"]
        assert again["misfits"] == []
        assert len(again["touches"]) == 7
        assert again["shift"]["c"] == pytest.approx(0.1)
        small = common_shop.call(
            "POST", f"/alignments/{made['id']}/recompute", 201, method="small", reason="to compare"
        )
        assert small["method"] == "small"
        common_shop.call("POST", f"/alignments/{made['id']}/recompute", 422, leave_out=[9], reason="x")


class TestRefused:
    @pytest.mark.parametrize(
        ("body", "field", "words", "remedy"),
        [
            ({}, "touches", "is needed", "points"),
            ({"touches": SIX[:5]}, "touches", "5 points cannot determine 6 motions", "A point near"),
            ({"touches": [SIX[0], SIX[3], SIX[5]]}, "touches", "3 points cannot determine", "solve_for"),
            ({"touches": [*touches([0.0] * 3, [([x, x, 0.0], "+Z") for x in (0.0, 50.0, 90.0)]), *SIX[3:]]}, "touches[0]", "one line", "Move point 2"),
            ({"touches": [*SIX[:4], SIX[3] | {"nominal": [20.0, 0.0, -40.0]}, SIX[5]]}, "touches[3]", "same place", "Move point 5"),
            ({"touches": [*SIX[:5], SIX[4] | {"nominal": [50.0, 0.0, -4.0]}]}, "touches[3]", "shift in X", "another face"),
            ({"touches": [*SIX[:5], {"nominal": [0, 0, 0], "normal": [0, 0, 0], "deviation": 0}]}, "touches[5]", "no direction", "0, 0, 0"),
            ({"kind": "two_points"}, "side", "is needed", "points"),
            ({"kind": "two_points", "side": [{"nominal": [0, 0], "measured": [0, 0]}] * 2}, "side[0]", "same place", "spread"),
            ({"kind": "two_holes", "holes": [{"nominal": [0, 0], "touches": [[0, 0], [1, 0], [2, 0]]}, {"nominal": [9, 0], "centre": [9, 0]}]}, "holes[0].touches", "one line", "spread"),
        ],
    )  # fmt: skip
    def test_with_a_reason_and_what_to_do(
        self, common_shop: Shop, body: dict[str, Any], field: str, words: str, remedy: str
    ) -> None:
        told = post(common_shop, 422, **body)
        assert told["errors"][0]["field"] == field
        assert words in told["detail"]
        assert remedy in told["what_to_do"]

    @pytest.mark.parametrize(
        "touch",
        [
            {"nominal": [0, 0, 0], "normal": "+Q", "deviation": 0.1},
            {"nominal": [0, 0, 0], "normal": "+Z"},
            {"nominal": [0, 0, 0], "normal": "+Z", "deviation": 0.1, "measured": [0, 0, 0]},
            {"nominal": [0, 0], "normal": "+Z", "deviation": 0.1},
        ],
    )
    def test_what_is_no_touch(self, common_shop: Shop, touch: dict[str, Any]) -> None:
        assert post(common_shop, 422, touches=[*SIX, touch])["errors"][0]["field"].startswith("touches[6]")


class TestInThePlane:
    def test_two_points(self, common_shop: Shop) -> None:
        side = [{"nominal": [0, 0], "measured": [0, 0.1]}, {"nominal": [100, 0], "measured": [100, 0.3]}]
        made = post(common_shop, kind="two_points", side=side, repeatability=0.001)
        assert made["angles"]["z"] == pytest.approx(degrees(np.arctan(0.002)))
        assert made["condition"] is None
        assert set(made["uncertainty"]) == {"a", "b", "gamma"}

    def test_two_holes_from_their_touches(self, common_shop: Shop) -> None:
        turned = from_angles(0, 0, 0.4)
        holes = []
        for x in (0.0, 120.0):
            centre = turned @ np.array([x, 40.0, 0.0]) + [3.0, -2.0, 0.0]
            ring = [
                [centre[0] + 12 * c, centre[1] + 12 * s] for c, s in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
            ]
            holes.append({"nominal": [x, 40.0], "touches": ring, "tip": 6.0})
        made = post(common_shop, kind="two_holes", holes=holes)
        assert made["angles"]["z"] == pytest.approx(0.4, abs=1e-7)
        assert (made["shift"]["a"], made["shift"]["b"]) == pytest.approx((3.0, -2.0), abs=1e-7)
        assert made["off"] == pytest.approx(0.0, abs=1e-7)


class TestPallets:
    def test_composed_with_the_part_on_it(self, common_shop: Shop) -> None:
        pallet = post(
            common_shop, touches=touches([0.1, 0.1, 0.1, 0.0, 0.15, 0.02]), work_offset="G54", base=[1.0, 2.0, 3.0]
        )
        part = post(common_shop, touches=touches([0.0, 0.05, 0.0, 0.0, 0.0, 0.3]))
        made = common_shop.call("POST", "/alignments/pallets", 201, pallet=pallet["id"], part=part["id"], key="p1")
        whole = np.array(pallet["matrix"]) @ np.array(part["matrix"])
        assert np.array(made["matrix"]) == pytest.approx(whole, abs=1e-12)
        assert (made["kind"], made["pallet"], made["part_on_pallet"]) == ("pallet", pallet["id"], part["id"])
        assert "$P_UIFR[1]=" in made["program"]
        again = common_shop.call("POST", "/alignments/pallets", 200, pallet=pallet["id"], part=part["id"], key="p1")
        assert again == made
        posed = common_shop.call(
            "POST",
            "/alignments/pallets",
            201,
            pallet=pallet["id"],
            part=part["id"],
            pose={"shift": [500.0, 0.0, 0.0], "rotation": 90.0},
        )
        assert posed["matrix"] != made["matrix"]
        common_shop.call("POST", f"/alignments/{made['id']}/recompute", 409, reason="x")
        common_shop.call("POST", "/alignments/pallets", 422, pallet=pallet["id"], part=pallet["id"])
        common_shop.call("POST", "/alignments/pallets", 404, pallet=pallet["id"], part=10**9)

    def test_lists_in_pages(self, server: Server) -> None:
        shop = Shop(server)
        numbers = [post(shop, touches=SIX)["id"] for _ in range(3)]
        first = shop.call("GET", f"/alignments?machine={shop.machine}&limit=2")
        rest = shop.call("GET", f"/alignments?machine={shop.machine}&after={first['next']}")
        assert [each["id"] for each in first["items"] + rest["items"]] == numbers


FAR = touches([0.0, 0.0, 500.0, 0.0, 0.0, 0.0])


class TestImplausible:
    def test_a_typing_error_turns_no_part_by_100_degrees(self, common_shop: Shop, server: Server) -> None:
        made = post(common_shop, touches=FAR)
        assert [(each["code"], each["field"]) for each in made["warnings"]][:2] == [
            ("touch_far_off", "touches[2]"),
            ("turned_far", None),
        ]
        assert "500\N{NO-BREAK SPACE}mm" in made["warnings"][0]["text"]
        assert made["acknowledged"] is None
        frame_at, loop_at = made["program"].index("$P_PFRAME"), made["program"].index("GOTOB INBAND_STOP")
        assert loop_at < frame_at
        path = f"/alignments/{made['id']}"
        fetched = common_shop.admin.get(f"/api/v1{path}/program?control=fanuc").text
        assert fetched.index("#3000=2(INBAND: TOUCH FAR OFF)"[:25]) < fetched.index("G68")

        viewer, machine = server.client(server.key("viewer")), common_shop.machine_client
        common_shop.call("POST", f"{path}/acknowledge", 403, viewer, reason="x")
        common_shop.call("POST", f"{path}/acknowledge", 403, machine, reason="x")
        common_shop.call("POST", f"{path}/acknowledge", 422)
        seen = common_shop.call("POST", f"{path}/acknowledge", reason="a fixture that stands at 105 degrees")
        assert seen["warnings"] == made["warnings"]
        assert seen["acknowledged"]["reason"] == "a fixture that stands at 105 degrees"
        assert "INBAND_STOP" not in seen["program"]
        assert "#3000=2" not in common_shop.admin.get(f"/api/v1{path}/program?control=fanuc").text
        told = common_shop.call("POST", f"{path}/acknowledge", 409, reason="again")
        assert seen["acknowledged"]["by"] in told["detail"]
        record = common_shop.call("GET", f"/audit?subject=alignment/{made['id']}&limit=1")["items"][0]
        assert (record["action"], record["why"]) == ("warnings acknowledged", seen["acknowledged"]["reason"])

    def test_half_a_turn_is_stated_as_a_turn(self, common_shop: Shop) -> None:
        side = [{"nominal": [0, 0], "measured": [100, 0.1]}, {"nominal": [100, 0], "measured": [0, 0.1]}]
        made = post(common_shop, kind="two_points", side=side)
        assert made["warnings"][0]["code"] == "points_exchanged"
        assert (made["angles"]["z"], made["turns"]["gamma"]) == (pytest.approx(180), pytest.approx(180))

    def test_inches(self, common_shop: Shop) -> None:
        holes = [{"nominal": [0, 0], "centre": [0, 0]}, {"nominal": [254, 0], "centre": [10, 0]}]
        made = post(common_shop, kind="two_holes", holes=holes)
        assert made["warnings"][0]["code"] == "looks_like_inches"
        assert "INBAND_STOP" in made["program"]

    def test_what_is_plausible_is_set_for_each_machine(self, server: Server) -> None:
        shop = Shop(server)
        tilted = touches([0.0, 0.0, 0.0, 0.0, 20.0, 0.0])  # 7.6 degrees
        assert "turned_far" in [each["code"] for each in post(shop, touches=tilted)["warnings"]]
        machine = shop.call("PATCH", f"/machines/{shop.machine}", plausible_turn=10)
        assert (machine["plausible_turn"], machine["plausible_shift"]) == (10, 10)
        made = post(shop, touches=tilted)
        assert made["warnings"] == []
        shop.call("POST", f"/alignments/{made['id']}/acknowledge", 409, reason="nothing")
        shop.call("PATCH", f"/machines/{shop.machine}", plausible_turn=1)
        assert shop.call("GET", f"/alignments/{made['id']}") == made  # judged by the limits of then
        assert (
            shop.call("PATCH", f"/machines/{shop.machine}", 422, plausible_turn=0)["errors"][0]["field"]
            == "plausible_turn"
        )

    def test_a_pallet_composed_with_a_suspicious_part_is_suspicious(self, common_shop: Shop) -> None:
        pallet, part = post(common_shop, touches=SIX)["id"], post(common_shop, touches=FAR)["id"]
        made = common_shop.call("POST", "/alignments/pallets", 201, pallet=pallet, part=part)
        assert {"turned_far", "composed_of_warned"} <= {each["code"] for each in made["warnings"]}
        assert "INBAND_STOP" in made["program"]

    def test_of_one_kept_before_there_were_warnings_they_are_worked_out(
        self, common_shop: Shop, server: Server
    ) -> None:
        made = post(common_shop, touches=FAR)
        with psycopg.connect(server.database.dsn, autocommit=True) as connection:
            connection.execute("ALTER TABLE alignment DISABLE TRIGGER append_only")
            connection.execute("UPDATE alignment SET result = result - 'warnings' WHERE id = %s", [made["id"]])
            connection.execute("ALTER TABLE alignment ENABLE TRIGGER append_only")
        assert common_shop.call("GET", f"/alignments/{made['id']}") == made

    def test_the_holes_of_a_plate(self, common_shop: Shop) -> None:
        """A hundred holes of ten touches: as many as there are on a plate."""
        many = [touch for touch in SIX for _ in range(166)]
        for at, touch in enumerate(many):
            many[at] = touch | {"nominal": [touch["nominal"][0] + at / 10, *touch["nominal"][1:]]}
        assert len(post(common_shop, touches=many)["residuals"]) == len(many)
