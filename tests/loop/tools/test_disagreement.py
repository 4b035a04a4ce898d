"""Two characteristics of one tool that one offset cannot serve: what becomes of the parts, and the alarm that says so."""

from typing import Any

import pytest

from app.jobs.actions import run_jobs
from app.loop.tools.jobs import JOBS
from tests.shop import Shop


class Two:
    """A tool that cuts two seats, the second `apart` µm larger than its drawing says when the first is right."""

    def __init__(self, shop: Shop, apart: float) -> None:
        self.shop, self.apart, self.offset, self.last = shop, apart, 0.0, 0
        self.keys = [shop.another("seat", tool_memory=4, average_memory=0) for _ in range(2)]

    def cut(self, parts: int) -> None:
        """Measure both on each part, and apply what is pending before the next one."""
        shop = self.shop
        for _part in range(parts):
            for key, more in zip(self.keys, (0.0, self.apart), strict=True):
                shop.read(self.offset * 1000 + more, key, correction_in_effect=self.last)
            for each in shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"]:
                self.offset, self.last = round(self.offset + each["amount"], 9), each["number"]
                shop.correction(self.last, "applied", offset_after=self.offset, client=shop.machine_client)
        run_jobs(shop.server.database, JOBS)

    def alarms(self) -> list[dict[str, Any]]:
        return [each for each in self.shop.alarms() if each["kind"] == "characteristics_disagree"]


def test_it_is_said_which_two_take_each_others_corrections_back(shop: Shop) -> None:
    """Within the tolerance: where one stays out of it, the tool is paused before (`test_still_out`)."""
    two = Two(shop, apart=7.0)
    two.cut(8)
    (alarm,) = two.alarms()
    first, second = two.keys
    assert (alarm["tool_memory"], alarm["characteristic"]) == (4, None)
    assert f"{second} and {first} take each other's corrections of tool 4 back" in alarm["text"]
    assert "one asked for −7.0\u00a0µm, the other for +7.0\u00a0µm, 7 times in turn" in alarm["text"]
    assert shop.tool(4)["paused_by"] is None, "correcting goes on"
    two.cut(2)
    assert len(two.alarms()) == 1, "it is said once"
    shop.call("PATCH", f"/characteristics/{second}", parameters={"target": 40.007}, reason="as the drawing says")
    shop.acknowledge(alarm["id"], "noted")
    two.cut(8)
    assert two.alarms() == [], "what was before the answer no longer counts, and both are right now"
    assert abs(two.offset) < 0.001


def test_corrections_with_an_earlier_factor_do_not_count(shop: Shop) -> None:
    two = Two(shop, apart=14.0)
    for factor in (-0.98, -0.99):
        two.cut(4)
        shop.call("PATCH", f"/characteristics/{two.keys[1]}", parameters={"factor": factor}, reason="tried")
    assert two.alarms() == []


@pytest.mark.parametrize("apart", [1.5])
def test_two_that_agree_within_their_limits_raise_none(shop: Shop, apart: float) -> None:
    two = Two(shop, apart)
    for _wear in range(4):
        two.offset += 0.006
        two.cut(3)
    assert two.alarms() == []
