"""Corrections without a network: fetched as text, run on a simulated control, confirmed by hand or by the next reading."""

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import httpx
import pytest

from app.jobs.actions import run_jobs
from app.loop.tools.jobs import JOBS
from tests.core.programs.controls import Fanuc, Sinumerik
from tests.shop import Shop


def text_of(shop: Shop, status: int = 200, **query: str) -> httpx.Response:
    answer = shop.admin.get(f"/api/v1/machines/{shop.machine}/corrections/program", params=query)
    assert answer.status_code == status, answer.text
    return answer


def numbers_in(answer: httpx.Response, header: str = "Inband-Corrections") -> list[int]:
    return [int(number) for number in answer.headers[header].split(", ") if number]


def fetched(shop: Shop, *numbers: int, status: int = 200, **more: Any) -> Any:
    return shop.call("POST", f"/machines/{shop.machine}/corrections/fetched", status, numbers=list(numbers), **more)


def confirmed(shop: Shop, *numbers: int, status: int = 200) -> Any:
    return shop.call("POST", f"/machines/{shop.machine}/corrections/applied", status, numbers=list(numbers))


class TestFetching:
    def test_again_it_is_the_same_text_and_says_so(self, shop: Shop) -> None:
        shop.read(6.1)
        first = text_of(shop)
        assert numbers_in(first) == [1]
        assert numbers_in(first, "Inband-Fetched") == []
        (mine,) = fetched(shop, 1)["items"]
        again = text_of(shop)
        assert (again.text, again.headers["etag"]) == (first.text, first.headers["etag"])
        assert numbers_in(again, "Inband-Fetched") == [1]
        (second,) = fetched(shop, 1)["items"]
        assert (mine.pop("fetched_before"), second.pop("fetched_before")) == (False, True)
        assert mine == second
        assert mine["fetched_as"].split()[0] == "turning"
        found = shop.correction(1)
        assert (found["status"], found["fetched_at"], found["fetched_by"]) == (
            "pending",
            mine["fetched_at"],
            mine["fetched_by"],
        )
        assert found["offset_expected"] == -0.0061

    def test_it_is_on_record(self, shop: Shop) -> None:
        shop.read(6.1)
        fetched(shop, 1)
        fetched(shop, 1)
        entries = shop.call("GET", f"/audit?subject=machine/{shop.machine}")["items"]
        found = [entry for entry in entries if entry["action"] == "corrections fetched as text"]
        assert [entry["after"]["corrections"] for entry in found] == [[1]]

    def test_what_is_not_pending_cannot_be_fetched(self, shop: Shop) -> None:
        shop.read(6.1)
        shop.read(350.0)
        fetched(shop, 1, 2, status=409)  # the second is held
        assert shop.correction(1)["fetched_at"] is None
        fetched(shop, 99, status=404)
        fetched(shop, 1, status=422, form="g10")
        text_of(shop, 422, form="g10")
        text_of(shop, 422, form="nonsense")
        assert numbers_in(text_of(shop)) == [1]

    def test_nothing_pending_is_a_text_that_does_nothing(self, shop: Shop) -> None:
        assert "NONE" in text_of(shop).text
        control = Sinumerik()
        control.run(text_of(shop).text)
        assert (control.wear, control.variables) == ({}, {})

    def test_two_at_once_mark_it_once(self, shop: Shop) -> None:
        shop.read(6.1)

        def fetch(_n: int) -> Any:
            return fetched(shop, 1)["items"][0]

        with ThreadPoolExecutor(8) as pool:
            answers = list(pool.map(fetch, range(8)))
        assert sorted(answer["fetched_before"] for answer in answers) == [False] + [True] * 7
        assert len({answer["fetched_at"] for answer in answers}) == 1

    def test_one_location_in_two_axes_is_refused(self, shop: Shop) -> None:
        shop.add(f"{shop.characteristic}-z", axis="Z", average_memory=0)
        shop.read(6.1)
        shop.read(20.0, f"{shop.characteristic}-z", correction_in_effect=0)
        text_of(shop, 409)

    def test_the_form_follows_the_control(self, shop: Shop) -> None:
        shop.read(6.1)
        for control, form in (("fanuc", "#[2700+3]=-0.0061"), ("other", "TOOL 3 X: 0 - 0.0061 = -0.0061")):
            shop.call("PATCH", f"/machines/{shop.machine}", control=control)
            assert form in text_of(shop).text
        shop.call("PATCH", f"/machines/{shop.machine}", control="fanuc")
        assert "G10 P3 U-0.0061" in text_of(shop, form="g10").text

    def test_a_machine_handles_its_own_only(self, shop: Shop, server: Any) -> None:
        other = Shop(server)
        shop.call("POST", f"/machines/{other.machine}/corrections/fetched", 403, shop.machine_client, numbers=[1])
        shop.call("POST", f"/machines/{other.machine}/corrections/applied", 403, shop.machine_client, numbers=[1])
        answer = shop.machine_client.get(f"/api/v1/machines/{other.machine}/corrections/program")
        assert answer.status_code == 403

    def test_it_does_not_expire(self, shop: Shop, server: Any) -> None:
        """Its text may have been run: the machine says so with its next reading, perhaps after the weekend."""
        shop.read(6.1)
        shop.read(20.0, correction_in_effect=0)
        fetched(shop, 1)
        shop.call("PATCH", f"/machines/{shop.machine}", corrections_expire_after=1e-6)
        run_jobs(server.database, JOBS)
        assert [shop.correction(n)["status"] for n in (1, 2)] == ["pending", "superseded"]


class TestConfirming:
    def test_all_in_one_go_and_again(self, shop: Shop) -> None:
        shop.read(6.1)
        shop.read(12.3, correction_in_effect=0)
        assert confirmed(shop, 1, 2) == {"applied": [1, 2], "applied_before": [], "must_not_be_in": [], "note": None}
        assert confirmed(shop, 2, 1)["applied_before"] == [1, 2]
        assert shop.tool()["offset"] == pytest.approx(-0.0123)

    def test_one_that_fell_is_named_and_not_confirmed(self, shop: Shop) -> None:
        shop.read(6.1)
        fetched(shop, 1)
        shop.correction(1, "rejected", 409, reason="no")
        shop.correction(1, "rejected", 200, reason="no", although_fetched=True)
        answer = confirmed(shop, 1)
        assert (answer["applied"], answer["must_not_be_in"]) == ([], [1])
        assert "6.1" in answer["note"]
        assert shop.tool()["offset"] == 0

    def test_an_unknown_number_confirms_nothing(self, shop: Shop) -> None:
        shop.read(6.1)
        confirmed(shop, 1, 99, status=404)
        assert shop.correction(1)["status"] == "pending"

    def test_many_at_once_apply_it_once(self, shop: Shop) -> None:
        shop.read(6.1)
        with ThreadPoolExecutor(8) as pool:
            answers = list(pool.map(lambda _n: confirmed(shop, 1), range(8)))
        assert sorted(len(answer["applied"]) for answer in answers) == [0] * 7 + [1]
        assert shop.tool()["offset"] == -0.0061

    def test_fetching_and_confirming_at_once_loses_nothing(self, shop: Shop) -> None:
        for deviation in (6.1, 12.5, 18.9):
            shop.read(deviation, correction_in_effect=0)

        def do(n: int) -> int:
            body = {"numbers": [1, 2, 3]}
            path = f"/api/v1/machines/{shop.machine}/corrections/{'fetched' if n % 2 else 'applied'}"
            return shop.admin.post(path, json=body).status_code

        with ThreadPoolExecutor(8) as pool:
            statuses = set(pool.map(do, range(16)))
        assert statuses <= {200, 409}
        assert [shop.correction(n)["status"] for n in (1, 2, 3)] == ["applied"] * 3
        assert shop.tool()["offset"] == pytest.approx(-0.0189)


class TestRejecting:
    def test_a_text_in_the_world_asks_twice(self, shop: Shop) -> None:
        shop.read(6.1)
        fetched(shop, 1)
        refused = shop.correction(1, "rejected", 409, reason="dirty part")
        assert "program text" in refused["detail"]
        assert refused["correction_status"] == "pending"
        done = shop.correction(1, "rejected", 200, reason="dirty part", although_fetched=True)
        assert done["status"] == "rejected"
        assert "program text" in done["note"]

    def test_one_that_nobody_fetched_falls_as_ever(self, shop: Shop) -> None:
        shop.read(6.1)
        assert shop.correction(1, "rejected", 200, reason="dirty part")["note"] is None


class TestOnTheControl:
    """The whole way: readings, text, control, and what the machine says afterwards."""

    def offset(self, control: Sinumerik, tool: int = 3) -> float:
        return round(control.wear.get(f"$TC_DP12[{tool},1]", 0.0), 6)

    def test_the_next_reading_confirms_by_the_marker(self, shop: Shop) -> None:
        shop.read(6.1)
        control = Sinumerik()
        answer = text_of(shop)
        fetched(shop, *numbers_in(answer))
        for _ in range(3):
            control.run(answer.text)
        assert self.offset(control) == -0.0061
        shop.read(0.2, correction_in_effect=int(control.variables[99]))
        assert shop.correction(1)["status"] == "applied"
        assert shop.tool()["offset"] == self.offset(control)

    def test_offsets_agree_however_often_and_late_texts_are_run(self, shop: Shop) -> None:
        control, out = Sinumerik(), []
        for deviation in (6.1, 5.4, -7.0):
            shop.read(deviation, correction_in_effect=int(control.variables.get(99, 0)))
            answer = text_of(shop)
            fetched(shop, *numbers_in(answer))
            out.append(answer.text)
            control.run(answer.text)
            control.run(answer.text)
        confirmed(shop, *numbers_in(text_of(shop)))
        assert shop.tool()["offset"] == self.offset(control) == -0.0045

    def test_a_released_one_behind_a_fetched_one(self, shop: Shop) -> None:
        """17 held, 18 fetched and run; then 17 is released. A reading with 18 in effect says nothing about 17."""
        other = f"{shop.characteristic}-b"
        shop.add(other, tool_memory=7, average_memory=6)
        held = shop.read(350.0)["correction"]["number"]
        control = Sinumerik()
        later = shop.read(6.0, other)["correction"]["number"]
        first = text_of(shop)
        assert numbers_in(first) == [later]
        fetched(shop, later)
        control.run(first.text)
        shop.correction(held, "release", 200, reason="edge is good")
        shop.read(1.0, correction_in_effect=int(control.variables[99]))
        assert shop.correction(held)["status"] == "pending"
        second = text_of(shop)
        control.run(second.text)
        control.run(first.text)
        control.run(second.text)
        assert int(control.variables[99]) == held
        assert (self.offset(control), self.offset(control, 7)) == (-0.35, -0.006)
        shop.read(0.4, other, correction_in_effect=int(control.variables[99]))
        shop.read(0.4, correction_in_effect=int(control.variables[99]))
        assert [shop.correction(n)["status"] for n in (held, later)] == ["applied", "applied"]
        assert (shop.tool()["offset"], shop.tool(7)["offset"]) == (-0.35, -0.006)

    def test_the_lathe_line(self, shop: Shop) -> None:
        shop.call("PATCH", f"/machines/{shop.machine}", control="fanuc")
        shop.read(6.1)
        control, answer = Fanuc(), text_of(shop)
        for _ in range(3):
            control.run(answer.text)
        assert (control.variables[2703], control.variables[599]) == (-0.0061, 1)

    def test_an_offset_set_by_hand_stops_the_text_that_is_out(self, shop: Shop) -> None:
        shop.read(6.1)
        answer = text_of(shop)
        fetched(shop, 1)
        shop.call("PUT", f"/machines/{shop.machine}/tools/3", offset=0.05, reason="set at the control")
        assert shop.correction(1)["status"] == "superseded"
        control = Sinumerik()
        control.wear["$TC_DP12[3,1]"] = 0.05
        with pytest.raises(Exception, match="NOT AS EXPECTED"):
            control.run(answer.text)
        assert self.offset(control) == 0.05
