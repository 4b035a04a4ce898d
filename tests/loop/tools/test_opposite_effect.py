"""A correction whose effect is opposite: its tool is paused before a third goes out, whichever way the machine confirms."""

from typing import Any

import numpy as np
import pytest

from app.jobs.actions import run_jobs
from app.loop.tools.jobs import JOBS
from tests.shop import Person, Shop

SHAFT = {"tolerance_width": 0.1, "averaging_limit": 0.004, "weighting_factor": 1, "factor": 1}
"""The loop of cases/wrong-sign-loop.csv: the factor is +1, the tool needs -1."""

WORN = {"tolerance_width": 0.06, "wear_limit": 0.04}


@pytest.fixture
def loop(shop: Shop) -> "Loop":
    return Loop(shop)


class Loop:
    """A machine whose offset changes the size by `effect` times as much."""

    def __init__(self, shop: Shop, effect: float = 1.0) -> None:
        self.shop, self.effect = shop, effect
        self.key = shop.another("wrong", tool_memory=4, average_memory=6, **SHAFT)
        self.offset, self.size, self.last = 0.0, 5.0, 0

    def part(self, scatter: float = 0.0, **more: Any) -> Any:
        """One part: measured, corrected, confirmed by REST; sizes in µm."""
        answer = self.shop.read(
            round(self.size + self.effect * self.offset * 1000 + scatter, 3), self.key, correction_in_effect=self.last
        )
        if answer["correction"] and answer["action"] == "correct":
            self.apply(answer["correction"])
        return answer

    def part_before(self, answers: list[Any], scatter: float) -> Any:
        """One part, cut before the corrections of these answers are applied."""
        offset, last = self.offset, self.last
        for answer in answers:
            if answer["correction"] and answer["action"] == "correct":
                self.apply(answer["correction"])
        size = round(self.size + self.effect * offset * 1000 + scatter, 3)
        return self.shop.read(size, self.key, correction_in_effect=last)

    def apply(self, correction: Any) -> None:
        self.offset = round(self.offset + correction["amount"], 9)
        self.last = correction["number"]
        self.shop.correction(self.last, "applied", offset_after=self.offset, client=self.shop.machine_client)


def test_a_wrong_sign_is_stopped_by_the_second_correction(loop: Loop) -> None:
    shop = loop.shop
    answers = [loop.part(scatter) for scatter in (0.0, 0.3, 0.0)]
    assert [(each["action"], each["reason"]["code"]) for each in answers] == [
        ("correct", "full_deviation"),
        ("correct", "full_deviation"),
        ("none", "paused"),
    ]
    (alarm,) = [each for each in shop.alarms() if each["kind"] == "opposite_effect"]
    assert (alarm["tool_memory"], alarm["characteristic"]) == (4, None)
    assert "correction 1 of +5.0\u00a0µm asked for −5.0\u00a0µm and the size changed by +5.3\u00a0µm" in alarm["text"]
    assert (
        "correction 2 of +10.3\u00a0µm asked for −10.3\u00a0µm and the size changed by +10.0\u00a0µm" in alarm["text"]
    )
    assert "sign of the factor" in alarm["what_to_do"]
    assert "offset register" in alarm["what_to_do"]
    assert shop.tool(4)["paused_by"] == alarm["id"]
    [known] = shop.tool(4)["gains"]
    assert (known["gain"], known["verdict"], known["corrections"]) == (alarm["data"]["gain"], "opposite", 2)
    assert known["gain"] < -0.9
    page = Person(shop.server, "operator").open(f"/machines/{shop.machine}/tools?tool=4")
    assert "from 2 corrections" in page
    assert f"paused by alarm {alarm['id']}" in answers[-1]["reason"]["text"]
    assert shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"] == []
    assert loop.part()["reason"]["code"] == "paused"
    assert shop.read(40.0, shop.characteristic)["action"] == "correct"  # another tool


def test_a_part_on_the_way_does_not_hide_a_wrong_sign(shop: Shop) -> None:
    """Each part is cut before the correction of the one before is applied: small corrections of its scatter come between."""
    loop, chance, answers = Loop(shop), np.random.default_rng(16), list[Any]()
    shop.call("PATCH", f"/characteristics/{loop.key}", parameters={"zero_range": 0.0005}, reason="follows each part")
    while not answers or answers[-1]["reason"]["code"] != "paused":
        answers.append(loop.part_before(answers[-1:], round(float(chance.normal(0, 0.5)), 2)))
        assert abs(answers[-1]["deviation"]) < 0.025, "four times as far off as it was, and stopped"
    asked = [each["correction"]["amount"] for each in answers if each["correction"]]
    assert sum(abs(amount) > 3 * 0.0005 for amount in asked) == 2
    assert len(asked) > 2


def test_what_was_before_the_resume_no_longer_counts(loop: Loop) -> None:
    shop = loop.shop
    for _part in range(3):
        loop.part()
    (alarm,) = [each for each in shop.alarms() if each["kind"] == "opposite_effect"]
    shop.call("PATCH", f"/characteristics/{loop.key}", parameters={"factor": -1}, reason="sign corrected")
    done = shop.acknowledge(alarm["id"], "noted")
    assert [each["code"] for each in done["outcome"]] == ["tool_resumed"]
    assert shop.tool(4)["paused_by"] is None
    assert loop.part()["action"] == "correct"
    assert loop.part()["zone"] == "zero"


def test_resumed_without_a_remedy_it_takes_two_again(loop: Loop) -> None:
    for _part in range(3):
        loop.part()
    (alarm,) = [each for each in loop.shop.alarms() if each["kind"] == "opposite_effect"]
    loop.shop.acknowledge(alarm["id"], "noted")
    assert [loop.part()["action"] for _part in range(3)] == ["correct", "correct", "stop"]


@pytest.mark.parametrize("happens", ["edit", "change"])
def test_an_edit_and_a_tool_change_begin_the_evidence_again(loop: Loop, happens: str) -> None:
    loop.part()
    loop.part()
    if happens == "edit":
        loop.shop.call("PUT", f"/machines/{loop.shop.machine}/tools/4", offset=loop.offset, reason="looked at")
    else:
        loop.shop.call("POST", f"/machines/{loop.shop.machine}/tools/4/change", offset=loop.offset, reason="new")
    assert [loop.part()["action"] for _part in range(3)] == ["correct", "correct", "stop"]


@pytest.mark.parametrize(
    ("effect", "verdict", "said"),
    [
        (-2.0, "strong", "Radius taken for diameter?"),
        (-0.2, "weak", "too weakly"),
        (0.0, "none", "does not use this offset"),
    ],
)
def test_an_unusual_gain_is_reported_with_its_number(
    shop: Shop, server: Any, effect: float, verdict: str, said: str
) -> None:
    loop, chance = Loop(shop, effect), np.random.default_rng(4)
    shop.call("PATCH", f"/characteristics/{loop.key}", parameters={"factor": -1}, reason="as it is usual")
    loop.effect = -effect
    for _part in range(24):
        loop.part(round(float(chance.normal(0, 0.3)), 2))
    (told,) = shop.tool(4)["gains"]
    assert told["verdict"] == verdict
    assert told["gain"] == pytest.approx(-effect, abs=0.25)
    assert told["corrections"] >= 4
    run_jobs(server.database, JOBS)
    run_jobs(server.database, JOBS)  # and says it once
    (alarm,) = [each for each in shop.alarms() if each["kind"] == "unusual_gain"]
    assert said in alarm["text"]
    assert f"{told['corrections']} corrections" in alarm["text"]
    assert shop.tool(4)["paused_by"] is None
    page = Person(shop.server, "operator").open(f"/machines/{shop.machine}/tools?tool=4")
    assert f"from {told['corrections']} corrections" in page


def test_a_radius_for_a_diameter_pauses_the_tool_once_parts_are_out(shop: Shop, server: Any) -> None:
    """A pause as that of a wrong sign, answered and resumed as that is; the warning is not raised beside it."""
    loop, chance = Loop(shop, 2.0), np.random.default_rng(7)
    loop.size = 7.0
    changed = {"factor": -1, "tolerance_width": 0.016}
    shop.call("PATCH", f"/characteristics/{loop.key}", parameters=changed, reason="as it is usual")
    answers: list[Any] = []
    while not answers or answers[-1]["reason"]["code"] != "paused":
        loop.size += 0.5
        answers.append(loop.part(round(float(chance.normal(0, 0.3)), 2)))
        assert len(answers) < 16
    assert answers[-1]["action"] == "stop", "the part is out"
    (alarm,) = [each for each in shop.alarms() if each["kind"] == "strong_effect"]
    assert (alarm["tool_memory"], alarm["characteristic"]) == (4, None)
    assert alarm["data"]["gain"] == pytest.approx(2, abs=0.15)
    assert f"the gain is +{alarm['data']['gain']:.2f} ± {alarm['data']['error']:.2f}, it should be 1" in alarm["text"]
    out = sum(abs(each["deviation"]) > 0.008 for each in answers)
    assert f"Of the newest {len(answers)} parts {out} are out of tolerance" in alarm["text"]
    assert "radius taken for diameter?" in alarm["text"]
    assert "asked for" in alarm["text"]
    run_jobs(server.database, JOBS)
    assert [each["kind"] for each in shop.alarms() if each["kind"] == "unusual_gain"] == []
    [known] = shop.tool(4)["gains"]
    assert (shop.tool(4)["paused_by"], known["verdict"]) == (alarm["id"], "strong")
    assert shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"] == []
    shop.call("PATCH", f"/characteristics/{loop.key}", parameters={"factor": -0.5}, reason="it is a radius")
    done = shop.acknowledge(alarm["id"], "noted")
    assert [each["code"] for each in done["outcome"]] == ["tool_resumed"]
    assert [loop.part()["action"] for _part in range(2)] == ["correct", "none"]
    assert shop.tool(4)["paused_by"] is None


def test_an_offset_in_inches_is_found_from_two_corrections(shop: Shop, server: Any) -> None:
    """More are never made: the third would be of a millimetre, and is held as that of a worn tool."""
    loop = Loop(shop, 25.4)
    loop.size = 1.5
    shop.call("PATCH", f"/characteristics/{loop.key}", parameters={"factor": -1}, reason="as it is usual")
    for _part in range(3):
        loop.part()
    run_jobs(server.database, JOBS)
    (alarm,) = [each for each in shop.alarms() if each["kind"] == "unusual_gain"]
    assert "gain +25.4" in alarm["text"]
    assert "in inches" in alarm["text"]


def test_a_right_gain_raises_nothing(shop: Shop, server: Any) -> None:
    loop, chance = Loop(shop, -1.0), np.random.default_rng(5)
    shop.call("PATCH", f"/characteristics/{loop.key}", parameters={"factor": -1}, reason="as it is usual")
    loop.effect = 1.0
    assert shop.tool(4)["gains"] == [
        {"characteristic": loop.key, "gain": None, "uncertainty": None, "corrections": None, "verdict": None}
    ]
    for part in range(40):
        loop.size = 0.4 * part
        loop.part(round(float(chance.normal(0, 0.3)), 2))
    run_jobs(server.database, JOBS)
    assert [each["kind"] for each in shop.alarms() if each["kind"] in {"unusual_gain", "opposite_effect"}] == []
    (told,) = shop.tool(4)["gains"]
    assert told["gain"] == pytest.approx(1, abs=0.3)
    assert told["verdict"] is None


def test_a_worn_tool_that_corrections_moved_the_wrong_way_is_no_worn_tool_alone(shop: Shop) -> None:
    """Two characteristics correct one tool in each part: R37 holds the fourth correction before either has seen two of its own."""
    both = [shop.another("wrong", tool_memory=4, average_memory=memory, **SHAFT | WORN) for memory in (6, 7)]
    offset, last, answers = 0.0, 0, list[Any]()
    for key in both * 2:
        answers.append(shop.read(6 + 1000 * offset, key, correction_in_effect=last))
        if answers[-1]["action"] == "correct":
            offset, last = round(offset + answers[-1]["correction"]["amount"], 9), answers[-1]["correction"]["number"]
            shop.correction(last, "applied", offset_after=offset, client=shop.machine_client)
    assert [each["action"] for each in answers] == ["correct", "correct", "correct", "hold"]
    (worn,) = [each for each in shop.alarms() if each["kind"] == "tool_worn"]
    assert worn["data"]["against"]["numbers"] == [2, 3]
    assert (
        "is worn or broken. The size went the wrong way: correction 2+3 of +36.0\u00a0µm asked for −36.0"
        in worn["text"]
    )
    assert "the size changed by +36.0\u00a0µm. Check the sign of the factor" in worn["text"]


def test_a_tool_that_wears_off_beside_small_corrections_is_worn(shop: Shop) -> None:
    key = shop.another("worn", tool_memory=4, average_memory=6, **SHAFT | WORN | {"factor": -1})
    answer = shop.read(5.0, key, correction_in_effect=0)
    shop.correction(answer["correction"]["number"], "applied", offset_after=-0.005, client=shop.machine_client)
    assert shop.read(60.0, key, correction_in_effect=1)["action"] == "hold"
    (worn,) = [each for each in shop.alarms() if each["kind"] == "tool_worn"]
    assert "sign" not in worn["text"]


def test_corrections_that_were_never_applied_prove_nothing(shop: Shop) -> None:
    key = shop.another("rejected", tool_memory=4, average_memory=6, **SHAFT)
    for size in (5.0, 10.3, 20.0, 40.5):
        answer = shop.read(size, key, correction_in_effect=0)
        assert answer["action"] == "correct"
        shop.correction(answer["correction"]["number"], "rejected", reason="not now")


def test_a_batch_that_names_the_corrections_in_effect(shop: Shop) -> None:
    """As a bridge or an import does that confirms by its readings, with quiet parts between: columns and single decisions agree."""
    key = shop.another("batch", tool_memory=4, average_memory=6, **SHAFT)
    quiet = [(i % 3 - 1) * 0.3 for i in range(80)]
    shop.push([*quiet, 4.4, 8.7, 8.8, 17.6, 0.0], key, correction_in_effect=[0] * 81 + [1, 1, 2, 2])
    (alarm,) = [each for each in shop.alarms() if each["kind"] == "opposite_effect"]
    assert [each["numbers"] for each in alarm["data"]["corrections"]] == [[1], [2]]
    assert [each["status"] for each in shop.call("GET", f"/machines/{shop.machine}/corrections")["items"]] == [
        "applied",
        "applied",
    ]
    assert shop.tool(4)["paused_by"] == alarm["id"]
