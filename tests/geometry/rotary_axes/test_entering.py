"""Entering runs on the control, undoing and putting back; two people at once."""

from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest

from tests.geometry.rotary_axes.bench import RUNS, axis, enter, plan, take
from tests.shop import Shop


class TestKinematics:
    def test_entered_backed_up_and_put_back(self, shop: Shop) -> None:
        first = take(shop, axes=[axis()])
        shop.call("POST", f"{RUNS}/{first['run']}/enter", reason="Monthly check")
        second = take(shop, axes=[axis((0.002, 0.0, 0.0, 0.0))])
        shop.call("POST", f"{RUNS}/{second['run']}/enter", reason="Warm now")
        backups = shop.call("GET", f"/machines/{shop.machine}/kinematics/backups")["items"]
        assert [(each["version"], each["run"]) for each in backups] == [
            (1, None), (2, first["run"]), (3, second["run"]),
        ]  # fmt: skip
        assert backups[0]["errors"] == {}
        assert backups[1]["errors"]["EX0C"] == pytest.approx(0.0123, abs=0.001)
        assert backups[2]["errors"]["EX0C"] == pytest.approx(0.0143, abs=0.001)
        restored = shop.call(
            "POST", f"/machines/{shop.machine}/kinematics/backups/2/restore", 201, reason="Worse than before"
        )
        assert (restored["version"], restored["restores"], restored["errors"]) == (4, 2, backups[1]["errors"])
        path = f"/machines/{shop.machine}/kinematics/backups"
        assert "in effect" in shop.call("POST", f"{path}/4/restore", 409, reason="again")["detail"]
        shop.call("POST", f"{path}/9/restore", 404, reason="none")
        actions = [
            each["action"] for each in shop.call("GET", "/audit?limit=100")["items"] if shop.machine in each["subject"]
        ]
        assert {"kinematics changed", "kinematics put back"} <= set(actions)

    def test_of_two_who_enter_one_is_informed(self, shop: Shop) -> None:
        one, two = take(shop, axes=[axis()]), take(shop, axes=[axis(seed=2)])
        shop.call("POST", f"{RUNS}/{two['run']}/enter", reason="mine")
        assert "already" in shop.call("POST", f"{RUNS}/{two['run']}/enter", 409, reason="mine")["detail"]
        assert "changed since" in shop.call("POST", f"{RUNS}/{one['run']}/enter", 409, reason="mine")["detail"]
        assert shop.call("GET", f"{RUNS}/{one['run']}")["overtaken"] is True

    def test_heads_have_kinematics_of_their_own(self, shop: Shop) -> None:
        one = take(shop, axes=[axis()], head="Fork 1")
        two = take(shop, axes=[axis((0.02, 0, 0, 0))], head="Fork 2")
        shop.call("POST", f"{RUNS}/{one['run']}/enter", reason="x")
        assert shop.call("POST", f"{RUNS}/{two['run']}/enter", reason="x")["status"] == "entered"
        assert len(shop.call("GET", f"{RUNS}?machine={shop.machine}&head=Fork 1")["items"]) == 1


def backups(shop: Shop) -> list[Any]:
    items: list[Any] = shop.call("GET", f"/machines/{shop.machine}/kinematics/backups")["items"]
    return items


def restore(shop: Shop, version: int, status: int = 201, **more: Any) -> Any:
    path = f"/machines/{shop.machine}/kinematics/backups/{version}/restore"
    return shop.call("POST", path, status, **({"reason": "Worse than before"} | more))


def undo(shop: Shop, run: Any, status: int = 200) -> Any:
    return shop.call("POST", f"{RUNS}/{run['run']}/undo", status, reason="Wrong ball")


class TestUndo:
    def test_what_was_entered_is_taken_back_and_the_next_may_be_entered(self, shop: Shop) -> None:
        one, two = take(shop, axes=[axis()]), take(shop, axes=[axis(seed=2)])
        entered = enter(shop, one)
        assert (entered["status"], entered["undone"]) == ("entered", False)
        assert enter(shop, two, 409)["run_status"] == "measured"
        undone = undo(shop, one)
        assert (undone["status"], undone["undone"]) == ("entered", True)
        assert [(each["version"], each["run"], each["restores"]) for each in backups(shop)] == [
            (1, None, None), (2, one["run"], None), (3, None, 1),
        ]  # fmt: skip
        assert backups(shop)[-1]["errors"] == {}
        assert "undone already" in undo(shop, one, 409)["detail"]
        assert enter(shop, two)["status"] == "entered"  # the kinematics is the one it was measured on again
        assert len([each for each in backups(shop) if each["reason"].startswith("As it was")]) == 1

    def test_an_undo_is_undone_by_putting_back_its_version(self, shop: Shop) -> None:
        run = take(shop, axes=[axis()])
        enter(shop, run)
        undo(shop, run)
        again = restore(shop, 2)
        assert again["errors"] == backups(shop)[1]["errors"]
        assert shop.call("GET", f"{RUNS}/{run['run']}")["undone"] is False
        assert undo(shop, run)["undone"] is True
        assert [each["errors"] == {} for each in backups(shop)] == [True, False, True, False, True]

    def test_what_others_stand_on_is_not_taken_from_under_them(self, shop: Shop) -> None:
        one = take(shop, axes=[axis()])
        enter(shop, one)
        two = take(shop, axes=[axis((0.002, 0, 0, 0))])
        enter(shop, two)
        problem = undo(shop, one, 409)
        assert problem["later"] == [two["run"]]
        assert "version 1" in problem["what_to_do"]
        undo(shop, two)
        assert undo(shop, one)["undone"] is True
        assert backups(shop)[-1]["errors"] == {}

    def test_what_was_never_entered(self, shop: Shop) -> None:
        run = take(shop, axes=[axis()])
        assert "not entered" in undo(shop, run, 409)["detail"]
        shop.call("POST", f"{RUNS}/999999/undo", 404, reason="x")
        shop.call("POST", f"{RUNS}/{run['run']}/undo", 403, client=shop.machine_client, reason="x")

    def test_of_two_at_once_one_undoes(self, shop: Shop) -> None:
        run = take(shop, axes=[axis()])
        for verb in ("enter", "undo"):
            path = f"/api/v1{RUNS}/{run['run']}/{verb}"
            with ThreadPoolExecutor(6) as pool:
                answers = list(pool.map(lambda _n, path=path: shop.admin.post(path, json={"reason": "x"}), range(6)))
            assert sorted(each.status_code for each in answers) == [200, 409, 409, 409, 409, 409]
        assert [each["version"] for each in backups(shop)] == [1, 2, 3]

    def test_who_looked_at_another_version_is_informed(self, shop: Shop) -> None:
        one = take(shop, axes=[axis()])
        enter(shop, one)
        two = take(shop, axes=[axis((0.002, 0, 0, 0))])
        enter(shop, two, reason="Ana was first")
        problem = restore(shop, 1, 409, instead_of=2)
        assert "Ana was first" in problem["detail"]
        assert restore(shop, 1, instead_of=3)["errors"] == {}
        assert "in effect" in restore(shop, 1, 409)["detail"]
        assert "version 4" in restore(shop, 1, 409)["detail"]

    def test_heads_are_undone_by_themselves(self, shop: Shop) -> None:
        one, two = take(shop, axes=[axis()], head="Fork 1"), take(shop, axes=[axis()], head="Fork 2")
        enter(shop, one)
        enter(shop, two)
        assert undo(shop, one)["undone"] is True
        assert shop.call("GET", f"{RUNS}/{two['run']}")["undone"] is False


class TestWhen:
    def test_last_months_run_that_comes_in_late_was_measured_before_the_entry(self, shop: Shop) -> None:
        run = take(shop, axes=[axis()], measured_at="2025-11-20T06:00:00Z")
        enter(shop, run)
        late = take(shop, axes=[axis((0.005, 0, 0, 0))], measured_at="2025-10-20T06:00:00Z")
        today = take(shop, axes=[axis((0.001, 0, 0, 0))], measured_at="2025-11-21T06:00:00Z")
        assert (late["overtaken"], today["overtaken"]) == (True, False)
        found = shop.call("GET", f"{RUNS}/{late['run']}/comparison?with={today['run']}")["changes"]
        x = next(each for each in found if each["name"] == "EX0C")
        assert (x["before"], x["after"]) == (pytest.approx(0.005, abs=1e-3), pytest.approx(0.0133, abs=1e-3))

    def test_what_was_entered_is_not_asked_for_again(self, shop: Shop) -> None:
        old = take(shop, axes=[axis((0.001, 0, 0, 0))], measured_at="2025-10-20T06:00:00Z")
        new = take(shop, axes=[axis()], measured_at="2025-11-20T06:00:00Z")
        asked = []
        for _time in range(2):
            changes = shop.call("GET", f"{RUNS}/{old['run']}/comparison?with={new['run']}")["changes"]
            asked.append({each["name"] for each in changes if each["enter"] is not None})
            if new["status"] != "entered":
                new = enter(shop, new)
        assert asked == [{"EX0C", "EY0C", "EA0C", "EB0C", "Q147", "Q148", "Q149"}, set()]

    def test_an_entry_of_then(self, shop: Shop) -> None:
        run = take(shop, axes=[axis()], measured_at="2025-10-20T06:00:00Z")
        for at in ("2025-10-19T06:00:00Z", (datetime.now(UTC) + timedelta(hours=2)).isoformat()):
            assert enter(shop, run, 422, at=at)["errors"][0]["field"] == "at"
        assert enter(shop, run, at="2025-10-20T07:00:00Z")["status"] == "entered"
        assert backups(shop)[-1]["since"] == "2025-10-20T07:00:00Z"
        between = take(shop, axes=[axis()], measured_at="2025-10-20T06:30:00Z")
        after = take(shop, axes=[axis((0.001, 0, 0, 0))], measured_at="2025-10-20T07:30:00Z")
        assert (between["overtaken"], after["overtaken"]) == (True, False)
        late = take(shop, axes=[axis((0.001, 0, 0, 0))], measured_at="2025-10-21T07:30:00Z")
        problem = enter(shop, after, 422, at="2025-10-20T08:00:00Z")
        assert str(late["run"]) in problem["detail"]


class TestOffsets:
    def test_of_the_ball_alone_they_are_what_is_entered(self, shop: Shop) -> None:
        plan(shop, limits={"Q147": 0.01})
        run = take(shop, shift={"nominal": [0.0, 0.0, 0.0], "centre": [0.012, -0.003, 0.001]})
        assert len(shop.alarms()) == 1
        enter(shop, run)
        assert backups(shop)[-1]["errors"] == {"Q147": 0.012, "Q148": -0.003, "Q149": 0.001}
        assert shop.alarms() == []

    def test_besides_axes_only_where_it_is_said(self, shop: Shop) -> None:
        one = take(shop, axes=[axis()])
        enter(shop, one)
        assert "Q147" not in backups(shop)[-1]["errors"]
        two = take(shop, axes=[axis()])
        enter(shop, two, offsets=True)
        assert {"Q147", "Q148", "Q149"} < set(backups(shop)[-1]["errors"])
