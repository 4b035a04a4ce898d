"""Offsets one can trust: an offset that differs pauses its tool, jumps are held, nothing is applied twice, old ones expire."""

import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime, timedelta
from typing import Any

import httpx
import pytest
from sqlalchemy import text
from sqlalchemy.orm import Session

from app.db.engine import Database
from app.jobs.actions import run_jobs
from app.loop.machines.queries import lock_machines
from app.loop.readings.actions import exclude_all
from app.loop.readings.queries import entry_of
from app.loop.tools.jobs import JOBS, expire_correction, expired
from tests.shop import Shop


@pytest.fixture
def served(server: Any) -> Database:
    """The server's own database, to go the rounds by hand."""
    made: Database = server.database
    return made


def pending(shop: Shop, micrometres: float = 6.0) -> int:
    number: int = shop.read(micrometres)["correction"]["number"]
    return number


def codes(alarm: Any) -> list[str]:
    return [item["code"] for item in alarm["outcome"]]


def reported_otherwise(shop: Shop) -> Any:
    """The tool after the machine has reported +10 µm where −6 µm was expected; the alarm."""
    shop.correction(pending(shop), "applied", offset_after=0.01)
    (alarm,) = shop.alarms()
    return alarm


class TestOffsetDiffers:
    def test_nothing_is_corrected_until_somebody_has_said_which_is_true(self, shop: Shop) -> None:
        alarm = reported_otherwise(shop)
        assert "No offset of this tool was entered before" in alarm["text"]
        assert shop.tool()["paused_by"] == alarm["id"]
        answer = shop.read(7.0)
        assert (answer["action"], answer["correction"], answer["reason"]["code"]) == ("none", None, "paused")
        out = shop.read(20.0)
        assert (out["action"], out["correction"], out["reason"]["code"]) == ("stop", None, "paused")
        assert out["reason"]["notes"] == ["stops"]
        assert "nothing brings the next one back: the decision is to stop" in out["reason"]["text"]
        assert shop.read(0.5)["action"] == "none", (
            "the reading that stops is no probe fault: the characteristic goes on"
        )
        assert f"paused by alarm {alarm['id']}" in answer["reason"]["text"]
        shop.add(f"{shop.characteristic}-b", average_memory=6)
        assert shop.read(20.0, f"{shop.characteristic}-b")["reason"]["code"] == "paused"  # the same tool
        shop.add(f"{shop.characteristic}-c", average_memory=7, tool_memory=4)
        assert shop.read(20.0, f"{shop.characteristic}-c")["action"] == "correct"  # another one

    def test_each_tool_asks_for_itself(self, shop: Shop) -> None:
        key = shop.another("bore", average_memory=6, tool_memory=4)
        first = reported_otherwise(shop)
        shop.correction(shop.read(6.0, key)["correction"]["number"], "applied", offset_after=0.02)
        second = next(alarm for alarm in shop.alarms() if alarm["id"] != first["id"])
        assert [(each["tool_memory"], each["count"]) for each in (first, second)] == [(3, 1), (4, 1)]
        assert [shop.tool(number)["paused_by"] for number in (3, 4)] == [first["id"], second["id"]]
        shop.acknowledge(second["id"], "noted")
        assert [shop.tool(number)["paused_by"] for number in (3, 4)] == [first["id"], None]
        assert [alarm["id"] for alarm in shop.alarms()] == [first["id"]]

    @pytest.mark.parametrize(("true", "offset"), [("reported", 0.01), ("expected", -0.006), (None, 0.003)])
    def test_the_true_offset_is_a_manual_edit(self, shop: Shop, true: str | None, offset: float) -> None:
        shop.read(0.8)
        assert shop.average() != 0
        alarm = reported_otherwise(shop)
        said = offset if true is None else alarm["data"][true]
        done = shop.acknowledge(
            alarm["id"], "offset_set", comment="part measured by hand", offset=said, changed_by="Ana, night shift"
        )
        assert codes(done) == ["offset_set", "averages_restarted", "tool_resumed"]
        tool = shop.tool()
        assert (tool["offset"], tool["paused_by"], tool["reset_at"] is not None) == (offset, None, True)
        assert shop.average() == 0
        (entry,) = [
            each
            for each in shop.call("GET", f"/audit?subject=tool/{shop.machine}/3")["items"]
            if each["action"] == "offset edited"
        ]
        assert entry["why"] == "Ana, night shift: part measured by hand"
        assert shop.read(20.0)["action"] == "correct"

    def test_open_corrections_fall_at_once_and_say_so(self, shop: Shop) -> None:
        first, second = pending(shop, 20.0), pending(shop, 50.0)
        answer = shop.correction(first, "applied", offset_after=0.5)
        assert f"Correction {second} was computed" in answer["note"]
        fallen = shop.correction(second)
        assert fallen["status"] == "superseded"
        assert f"alarm {shop.tool()['paused_by']}" in fallen["status_reason"]
        problem = shop.correction(second, "applied", 409)
        assert "manual edit" in problem["what_to_do"]

    def test_noted_takes_the_reported_one(self, shop: Shop) -> None:
        alarm = reported_otherwise(shop)
        shop.acknowledge(alarm["id"], "noted")
        assert (shop.tool()["offset"], shop.tool()["paused_by"]) == (0.01, None)

    def test_what_was_entered_by_hand_meanwhile_is_not_written_over(self, shop: Shop) -> None:
        alarm = reported_otherwise(shop)
        shop.call("PUT", f"/machines/{shop.machine}/tools/3", offset=0.007, reason="read at the control")
        assert shop.tool()["paused_by"] == alarm["id"]  # a person was asked, and a person answers
        assert shop.read(20.0)["reason"]["code"] == "paused"
        assert codes(shop.acknowledge(alarm["id"], "noted")) == ["offset_told_already", "tool_resumed"]
        assert shop.tool()["offset"] == 0.007

    def test_a_new_tool_answers_it_too(self, shop: Shop) -> None:
        alarm = reported_otherwise(shop)
        done = shop.acknowledge(alarm["id"], "tool_replaced", offset=0.1)
        assert codes(done)[0] == "tool_restarted"
        assert codes(done)[-1] == "tool_resumed"
        assert (shop.tool()["offset"], shop.tool()["paused_by"]) == (0.1, None)

    @pytest.mark.parametrize(
        ("action", "more", "field"),
        [
            ("offset_set", {}, "offset"),
            ("noted", {"offset": 0.1}, "offset"),
            ("noted", {"changed_by": "Ana"}, "changed_by"),
            ("tool_replaced", {"changed_by": "Ana"}, "changed_by"),
            ("offset_set", {"offset": 1e300}, "offset"),
            ("offset_set", {"offset": "0.1"}, "offset"),
            ("offset_set", {"offset": 0.1, "changed_by": "x" * 201}, "changed_by"),
        ],
    )
    def test_what_cannot_be_meant(self, shop: Shop, action: str, more: dict[str, Any], field: str) -> None:
        alarm = reported_otherwise(shop)
        problem = shop.acknowledge(alarm["id"], action, 422, **more)
        assert problem["errors"][0]["field"] == field
        assert shop.tool()["paused_by"] == alarm["id"]

    def test_other_alarms_have_no_offset_to_set(self, shop: Shop) -> None:
        shop.read(20.0)
        problem = shop.acknowledge(shop.alarms()[0]["id"], "offset_set", 422, offset=0.0)
        assert problem["errors"][0]["field"] == "action"

    def test_a_machine_that_applies_all_and_then_confirms_is_believed(self, shop: Shop) -> None:
        """It fetched three, added them up, and confirms the first with what its offset is now."""
        numbers = [pending(shop, 20.0), pending(shop, 50.0), pending(shop, 90.0)]
        total = round(sum(shop.correction(number)["amount"] for number in numbers), 9)
        for number in (*numbers, *numbers):
            answer = shop.correction(number, "applied", offset_after=total, client=shop.machine_client)
            assert answer["status"] == "applied"
        assert all(alarm["kind"] != "offset_differs" for alarm in shop.alarms())
        assert (shop.tool()["offset"], shop.tool()["total"], shop.tool()["paused_by"]) == (total, total, None)
        steps = shop.call("GET", f"/machines/{shop.machine}/tools/3/figure")["data"][0]["y"]
        assert steps == pytest.approx([-0.02, -0.05, -0.09])


class TestPlausibility:
    @pytest.fixture
    def guarded(self, shop: Shop) -> Shop:
        shop.call(
            "PATCH", f"/characteristics/{shop.characteristic}", parameters={"plausible_jump": 0.01}, reason="chips"
        )
        return shop

    def test_a_jump_is_held_and_counts_while_it_lasts(self, guarded: Shop) -> None:
        guarded.read(0.5)
        average = guarded.average()
        first = guarded.read(40.0)
        assert (first["action"], first["reason"]["code"], first["correction"]["status"]) == (
            "hold",
            "implausible",
            "held",
        )
        assert "neither wear nor scatter" in first["reason"]["text"]
        second = guarded.read(41.0)
        assert guarded.correction(first["correction"]["number"])["superseded_by"] == second["correction"]["number"]
        alarm = next(alarm for alarm in guarded.alarms() if alarm["kind"] == "implausible")
        assert (alarm["count"], alarm["held_correction"]) == (
            2,
            {"number": second["correction"]["number"], "amount": -0.041},
        )
        assert alarm["data"]["limit"] == 0.01
        assert guarded.average() == average
        assert guarded.read(0.4)["reason"]["code"] == "within_zero_range"  # the level has not moved

    def test_keep_cutting_releases_it_and_expects_the_next_there(self, guarded: Shop) -> None:
        guarded.read(0.5)
        held = guarded.read(40.0)["correction"]["number"]
        alarm = next(alarm for alarm in guarded.alarms() if alarm["kind"] == "implausible")
        done = guarded.acknowledge(alarm["id"], "keep_cutting")
        assert codes(done) == ["correction_released", "level_followed"]
        guarded.correction(held, "applied")
        assert guarded.average() == 0
        assert guarded.read(0.2, correction_in_effect=held)["reason"]["code"] == "within_zero_range"
        assert guarded.read(6.0, correction_in_effect=held)["action"] == "correct"

    def test_keep_cutting_after_readings_at_the_old_level_drops_it(self, guarded: Shop) -> None:
        guarded.read(0.5)
        held = guarded.read(40.0)["correction"]["number"]
        guarded.read(0.6)
        alarm = next(alarm for alarm in guarded.alarms() if alarm["kind"] == "implausible")
        assert codes(guarded.acknowledge(alarm["id"], "keep_cutting")) == ["correction_withdrawn", "level_disagrees"]
        assert guarded.correction(held)["status"] == "rejected"

    def test_a_worn_tool_that_goes_on_cutting_is_expected_where_it_is(self, guarded: Shop) -> None:
        guarded.read(0.5)
        held = guarded.read(350.0)
        assert held["reason"]["code"] == "tool_worn_held"  # one question at a time
        guarded.acknowledge(guarded.alarms()[0]["id"], "keep_cutting")
        number = held["correction"]["number"]
        guarded.correction(number, "applied")
        assert guarded.read(0.5, correction_in_effect=number)["reason"]["code"] == "within_zero_range"
        assert guarded.alarms() == []

    def test_a_false_reading_is_excluded_and_its_correction_withdrawn(self, guarded: Shop) -> None:
        guarded.read(0.5)
        held = guarded.read(40.0)["correction"]["number"]
        alarm = next(alarm for alarm in guarded.alarms() if alarm["kind"] == "implausible")
        done = guarded.acknowledge(alarm["id"], "false_reading", comment="chip on the stylus")
        assert codes(done) == ["readings_excluded", "correction_withdrawn"]
        assert guarded.correction(held)["status"] == "rejected"
        assert guarded.read(0.7)["reason"]["code"] == "within_zero_range"
        assert guarded.read(40.0)["reason"]["code"] == "implausible"

    def test_corrections_tool_changes_and_edits_are_no_jumps(self, guarded: Shop) -> None:
        path = f"/characteristics/{guarded.characteristic}"
        guarded.call("PATCH", path, parameters={"plausible_jump": 0.02}, reason="wears fast")
        guarded.read(5.5)
        for _turn in range(6):  # 6 µm of wear from part to part, each corrected: without the corrections 36 µm apart
            answer = guarded.read(6.0, correction_in_effect=_last(guarded))
            assert answer["action"] == "correct", answer
        guarded.call("POST", f"/machines/{guarded.machine}/tools/3/change", reason="worn")
        assert guarded.read(60.0)["action"] == "correct"  # nothing is expected of a new edge
        guarded.call("PUT", f"/machines/{guarded.machine}/tools/3", offset=0.1, reason="set")
        assert guarded.read(-60.0)["action"] == "correct"

    def test_an_excluded_first_reading_is_not_what_is_expected(self, guarded: Shop) -> None:
        first = guarded.read(60.0)
        assert first["action"] == "correct"
        path = f"/readings/{guarded.characteristic}/{first['sequence']}/exclude"
        guarded.call("POST", path, 200, reason="chip")
        assert guarded.read(0.5)["reason"]["code"] == "within_zero_range"

    def test_a_new_target_or_empirical_value_is_no_jump(self, guarded: Shop) -> None:
        guarded.read(0.5)
        guarded.call("PUT", f"/machines/{guarded.machine}/averages/5", empirical_value=0.05, reason="gauge")
        assert guarded.read(0.5)["reason"]["code"] != "implausible"
        guarded.call("PATCH", f"/characteristics/{guarded.characteristic}", parameters={"target": 40.1}, reason="new")
        assert guarded.read(100.5)["reason"]["code"] != "implausible"

    def test_off_by_default(self, shop: Shop) -> None:
        shop.read(0.5)
        assert shop.read(40.0)["action"] == "correct"


def _last(shop: Shop) -> int | None:
    items = shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"]
    for item in items:
        shop.correction(item["number"], "applied")
    applied = shop.call("GET", f"/machines/{shop.machine}/corrections?status=applied")["items"]
    return applied[-1]["number"] if applied else None


class TestLimits:
    def test_the_largest_step_cuts_and_says_so(self, shop: Shop) -> None:
        key = f"{shop.characteristic}-s"
        shop.add(key, max_step=0.004, tool_memory=4, average_memory=6)
        answer = shop.read(20.0, key)
        assert answer["correction"]["amount"] == -0.004
        assert answer["reason"]["notes"] == ["clamped"]
        assert "limited to the largest step 4.0 µm" in answer["reason"]["text"]
        correction = shop.correction(answer["correction"]["number"])
        assert (correction["size_error"], correction["reason"]["notes"]) == (0.02, ["clamped"])

    def test_at_the_largest_sum_a_new_tool_or_a_wider_limit_goes_on(self, shop: Shop) -> None:
        key = f"{shop.characteristic}-s"
        shop.add(key, max_total=0.01, tool_memory=4, average_memory=6)
        first = shop.read(6.0, key)["correction"]["number"]
        shop.correction(first, "applied")
        stopped = shop.read(6.0, key, correction_in_effect=first)
        assert (stopped["correction"], stopped["reason"]["code"]) == (None, "offset_limit")
        assert "or the largest sum is raised" in stopped["reason"]["text"]
        (alarm,) = shop.alarms()
        assert (alarm["kind"], alarm["tool_memory"]) == ("offset_limit", 4)
        assert "raises the largest sum" in alarm["what_to_do"]
        assert shop.read(-6.0, key, correction_in_effect=first)["action"] == "correct"  # it leads back
        shop.correction(first + 1, "rejected", reason="not now")
        shop.acknowledge(alarm["id"], "noted", comment="limit is looked at")
        shop.call("PATCH", f"/characteristics/{key}", parameters={"max_total": 0.05}, reason="hard material")
        assert shop.read(6.0, key, correction_in_effect=first)["correction"]["amount"] == -0.006
        shop.call("PATCH", f"/characteristics/{key}", parameters={"max_total": 0.01}, reason="soft again")
        shop.read(20.0, key, correction_in_effect=first)
        again = next(alarm for alarm in shop.alarms() if alarm["kind"] == "offset_limit")
        done = shop.acknowledge(again["id"], "tool_replaced")
        assert codes(done)[0] == "tool_restarted"
        assert shop.read(6.0, key)["action"] == "correct"


class TestExpiry:
    @pytest.fixture
    def hasty(self, shop: Shop) -> Shop:
        shop.call("PATCH", f"/machines/{shop.machine}", corrections_expire_after=8.0)
        return shop

    def test_it_is_superseded_and_the_next_reading_decides_again(self, hasty: Shop, served: Database) -> None:
        number = pending(hasty)
        rounds(served)
        assert hasty.correction(number)["status"] == "pending"
        age(served, hasty, number, hours=8.1)
        rounds(served)
        rounds(served)
        gone = hasty.correction(number)
        assert (gone["status"], gone["decided_by"]) == ("superseded", None)
        assert "expired" in gone["status_reason"]
        assert "8 h" in gone["status_reason"]
        assert hasty.read(6.0)["correction"]["amount"] == -0.006
        subject = f"correction/{hasty.machine}/{number}"
        assert [each["action"] for each in hasty.call("GET", f"/audit?subject={subject}")["items"]] == [
            "correction expired"
        ]

    def test_a_machine_that_applied_it_after_all_learns_what_to_do(self, hasty: Shop, served: Database) -> None:
        number = pending(hasty)
        age(served, hasty, number, hours=9)
        rounds(served)
        problem = hasty.correction(number, "applied", 409, offset_after=-0.006)
        assert "expired" in problem["detail"]
        assert "manual edit of tool 3" in problem["what_to_do"]
        hasty.call(
            "PUT",
            f"/machines/{hasty.machine}/tools/3",
            offset=-0.006,
            reason="applied late",
            client=hasty.machine_client,
        )
        assert hasty.tool()["offset"] == -0.006

    def test_held_ones_wait_and_approved_ones_begin_again(self, hasty: Shop, served: Database) -> None:
        hasty.add(f"{hasty.characteristic}-a", mode="approval", tool_memory=4, average_memory=6)
        approved = hasty.read(6.0, f"{hasty.characteristic}-a")["correction"]["number"]
        waiting = hasty.read(12.0, f"{hasty.characteristic}-a")["correction"]["number"]
        held = hasty.read(350.0)["correction"]["number"]
        for number in (approved, waiting, held):
            age(served, hasty, number, hours=9)
        hasty.correction(approved, "approve", reason="agrees")
        rounds(served)
        assert [hasty.correction(number)["status"] for number in (approved, waiting, held)] == [
            "pending",
            "superseded",
            "held",
        ]

    def test_one_machine_at_a_time_and_only_under_its_lock(self, hasty: Shop, server: Any, served: Database) -> None:
        """The state that decides readings changes under the lock; the readings of one machine wait for no other."""
        rounds(served)
        shops = [hasty, Shop(server)]
        shops[1].call("PATCH", f"/machines/{shops[1].machine}", corrections_expire_after=8.0)
        for shop in shops:
            age(served, shop, pending(shop), hours=9)
        before = [version(served, shop) for shop in shops]
        with served.begin() as session:
            units = expired(session)
            assert len(units) == 2
            expire_correction(session, units[0])
        now = [shop.correction(1)["status"] for shop in shops]
        assert sorted(now) == ["pending", "superseded"]
        moved = [version(served, shop) > old for shop, old in zip(shops, before, strict=True)]
        assert moved == [status == "superseded" for status in now]
        rounds(served)
        assert [shop.correction(1)["status"] for shop in shops] == ["superseded", "superseded"]

    def test_never_unless_it_is_asked_for(self, shop: Shop, served: Database) -> None:
        number = pending(shop)
        age(served, shop, number, hours=10_000)
        rounds(served)
        assert shop.correction(number)["status"] == "pending"

    def test_the_setting(self, shop: Shop) -> None:
        path = f"/machines/{shop.machine}"
        assert shop.call("GET", path)["corrections_expire_after"] is None
        assert shop.call("PATCH", path, corrections_expire_after=0.5)["corrections_expire_after"] == 0.5
        assert shop.call("PATCH", path, name="Lathe")["corrections_expire_after"] == 0.5
        answer = shop.admin.patch(f"/api/v1{path}", json={"corrections_expire_after": None})
        assert answer.json()["corrections_expire_after"] is None
        for wrong in (0, -1, 1e9, "8", True):
            problem = shop.call("PATCH", path, 422, corrections_expire_after=wrong)
            assert problem["errors"][0]["field"] == "corrections_expire_after"


def rounds(database: Database) -> None:
    run_jobs(database, JOBS)


def version(database: Database, shop: Shop) -> int:
    with database.begin() as session:
        found: int = session.scalars(
            text("SELECT version FROM machine_state s JOIN machine m ON m.id = s.machine_id WHERE m.key = :machine"),
            {"machine": shop.machine},
        ).one()
        return found


def age(database: Database, shop: Shop, number: int, hours: float) -> None:
    """As if it had been issued so long ago."""
    with database.begin() as session:
        session.execute(text("SET LOCAL session_replication_role = replica"))  # a fact, which nobody else changes
        session.execute(
            text(
                "UPDATE correction SET created_at = :at WHERE number = :number"
                " AND machine_id = (SELECT id FROM machine WHERE key = :machine)"
            ),
            {"at": datetime.now(UTC) - timedelta(hours=hours), "number": number, "machine": shop.machine},
        )


def at_once(*calls: Any) -> list[httpx.Response]:
    with ThreadPoolExecutor(len(calls)) as pool:
        return [future.result() for future in [pool.submit(call) for call in calls]]


def _until_somebody_waits(session: Session) -> None:
    waits = text(
        "SELECT count(*) FROM pg_stat_activity WHERE datname = current_database() AND wait_event_type = 'Lock'"
    )
    deadline = time.monotonic() + 60
    while not session.scalar(waits):
        assert time.monotonic() < deadline
        time.sleep(0.02)


class TestAtOnce:
    """However they come together, a correction is in the offset once or not at all, and the sum agrees."""

    def consistent(self, shop: Shop, number: int, before: float) -> str:
        status: str = shop.correction(number)["status"]
        applied = shop.correction(number)["amount"] if status == "applied" else 0.0
        assert shop.tool()["offset"] == pytest.approx(before + applied, abs=1e-9)
        return status

    def test_a_confirmation_against_expiry(self, shop: Shop, served: Database) -> None:
        shop.call("PATCH", f"/machines/{shop.machine}", corrections_expire_after=1.0)
        for _turn in range(4):
            before, number = shop.tool()["offset"], pending(shop)
            age(served, shop, number, hours=2)
            path = f"/api/v1/corrections/{shop.machine}/{number}/applied"
            with ThreadPoolExecutor(2) as pool:
                expiring = pool.submit(rounds, served)
                answer = pool.submit(shop.machine_client.post, path).result()
                expiring.result()
            status = self.consistent(shop, number, before)
            assert status == {200: "applied", 409: "superseded"}[answer.status_code]

    def test_excluding_waits_for_the_machine_before_it_takes_a_row(self, shop: Shop, served: Database) -> None:
        """Whoever acknowledges an alarm as a false reading has the machine, then excludes: the other order would deadlock."""
        shop.call(
            "PATCH", f"/characteristics/{shop.characteristic}", parameters={"plausible_jump": 0.01}, reason="chip"
        )
        shop.read(0.5)
        path = f"/api/v1/readings/{shop.characteristic}/1/exclude"
        with ThreadPoolExecutor(1) as pool:
            with served.begin() as session:
                lock_machines(session, [entry_of(session, shop.characteristic).machine_id])  # type: ignore[union-attr]
                waiting = pool.submit(lambda: shop.admin.post(path, json={"reason": "chip"}))
                _until_somebody_waits(session)
                session.execute(text("SET LOCAL lock_timeout = '2s'"))
                exclude_all(session, entry_of(session, shop.characteristic), [1], "ana", "chip")  # type: ignore[arg-type]
            assert waiting.result().status_code == 409

    def test_a_confirmation_against_a_tool_change(self, shop: Shop, server: Any) -> None:
        other = server.client(server.key())
        for _turn in range(4):
            number = pending(shop)
            path = f"/api/v1/corrections/{shop.machine}/{number}/applied"
            change = f"/api/v1/machines/{shop.machine}/tools/3/change"
            confirmed, changed = at_once(
                lambda path=path: shop.machine_client.post(path),
                lambda change=change: other.post(change, json={"offset": 0.2, "reason": "worn"}),
            )
            assert changed.status_code == 200
            # Confirmed first: the change then wrote over it. Changed first: it was superseded. Never on the new tool.
            assert confirmed.status_code in {200, 409}
            assert (shop.tool()["offset"], shop.tool()["total"]) == (0.2, 0.0)

    def test_a_confirmation_by_a_reading_and_by_hand(self, shop: Shop) -> None:
        for _turn in range(4):
            before, number = shop.tool()["offset"], pending(shop)
            body = {"characteristic": shop.characteristic, "measured": 40.0, "correction_in_effect": number}
            confirmed, read = at_once(
                lambda number=number: shop.machine_client.post(f"/api/v1/corrections/{shop.machine}/{number}/applied"),
                lambda body=body: shop.machine_client.post("/api/v1/readings", json=body),
            )
            assert (confirmed.status_code, read.status_code) == (200, 201)
            assert self.consistent(shop, number, before) == "applied"

    def test_a_confirmation_again_after_a_lost_answer(self, shop: Shop, server: Any) -> None:
        number = pending(shop)
        path = f"{server.url}/api/v1/corrections/{shop.machine}/{number}/applied"
        key = server.key(machine=shop.machine)
        for _turn in range(3):  # the machine hangs up before it hears the answer, and asks again
            with httpx.Client(headers={"Authorization": f"Bearer {key}"}, timeout=0.001) as impatient:
                try:
                    impatient.post(path, json={"offset_after": -0.006})
                except httpx.TimeoutException:
                    continue
        patient = server.client(key).post(path, json={"offset_after": -0.006})
        assert (patient.status_code, patient.json()["status"]) == (200, "applied")
        assert (shop.tool()["offset"], shop.tool()["total"], shop.alarms()) == (-0.006, -0.006, [])
        assert len(shop.call("GET", f"/machines/{shop.machine}/tools/3/figure")["data"][0]["y"]) == 1

    def test_two_who_approve_all_at_once(self, shop: Shop, server: Any) -> None:
        shop.add(f"{shop.characteristic}-a", mode="approval", tool_memory=4, average_memory=6)
        numbers = [shop.read(d, f"{shop.characteristic}-a")["correction"]["number"] for d in (20.0, 50.0, 90.0)]
        path = f"/api/v1/corrections/{shop.machine}/approve"
        clients = [server.client(server.key("operator")) for _who in range(3)]
        body = {"numbers": numbers, "reason": "agrees"}
        answers = at_once(*(lambda client=client: client.post(path, json=body) for client in clients))
        assert sorted(answer.status_code for answer in answers) == [200, 409, 409]
        late = next(answer for answer in answers if answer.status_code == 409).json()
        assert f"Correction {numbers[0]} " in late["detail"]
        assert {shop.correction(number)["status"] for number in numbers} == {"pending"}


class TestApproveSeveral:
    def test_all_or_none(self, shop: Shop) -> None:
        key = f"{shop.characteristic}-a"
        shop.add(key, mode="approval", tool_memory=4, average_memory=6)
        first, second = (shop.read(d, key)["correction"]["number"] for d in (20.0, 50.0))
        shop.correction(second, "rejected", reason="no")
        path = f"/corrections/{shop.machine}/approve"
        problem = shop.call("POST", path, 409, numbers=[first, second], reason="x")
        assert f"Correction {second}" in problem["detail"]
        assert "rejected by" in problem["detail"]
        assert shop.correction(first)["status"] == "awaiting_approval"
        shop.call("POST", path, 404, numbers=[first, 9999], reason="x")
        done = shop.call("POST", path, numbers=[first, first], reason="agrees")
        assert [(item["number"], item["status"]) for item in done["items"]] == [(first, "pending")]
        assert shop.correction(first)["status_reason"] == "agrees"

    @pytest.mark.parametrize("numbers", [[], [0], [-1], ["1"], [1.5], [True], [2**40], "1", None])
    def test_bad_numbers(self, shop: Shop, numbers: Any) -> None:
        shop.call("POST", f"/corrections/{shop.machine}/approve", 422, numbers=numbers, reason="x")

    def test_who_may(self, shop: Shop, server: Any) -> None:
        viewer = server.client(server.key("viewer"))
        for client in (viewer, shop.machine_client):
            shop.call("POST", f"/corrections/{shop.machine}/approve", 403, client=client, numbers=[1], reason="x")
