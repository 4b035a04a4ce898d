"""Parts that stay out of tolerance although each was corrected for: the tool is paused, and the part asks the machine to stop."""

from typing import Any

import pytest

from tests.shop import Person, Shop

SEAT = {"tolerance_width": 0.016, "averaging_limit": 0.005, "weighting_factor": 1, "factor": -1}


class Twins:
    """Two characteristics of tool 4, measured one behind the other; what one asks for is in the offset before the next is cut."""

    def __init__(self, shop: Shop, apart: float = 0.0, effect: float = 1.0) -> None:
        self.shop, self.effect, self.apart = shop, effect, apart
        self.keys = [shop.another(f"twin-{n}", tool_memory=4, average_memory=5 + n, **SEAT) for n in (1, 2)]
        self.offset, self.last, self.first = 0.0, 0, 0.0

    def part(self, scatter: float = 0.0) -> list[Any]:
        """The answers of one part; sizes in µm."""
        answers = []
        for key, own in zip(self.keys, (0.0, self.apart), strict=True):
            size = round(self.first + own + scatter + self.effect * self.offset * 1000, 3)
            answers.append(self.shop.read(size, key, correction_in_effect=self.last))
            if (correction := answers[-1]["correction"]) and answers[-1]["action"] == "correct":
                self.offset, self.last = round(self.offset + correction["amount"], 9), correction["number"]
                self.shop.correction(self.last, "applied", offset_after=self.offset, client=self.shop.machine_client)
        return answers


@pytest.mark.parametrize(("apart", "effect", "first"), [(20.0, 1.0, 10.0), (0.0, 2.0, 10.0)])
def test_two_characteristics_that_take_each_other_back_are_stopped(
    shop: Shop, apart: float, effect: float, first: float
) -> None:
    """Targets that no offset meets; a radius taken for a diameter."""
    twins = Twins(shop, apart, effect)
    twins.first = first
    parts = [twins.part(scatter) for scatter in (0.0, 0.2, -0.1, 0.1, 0.0)]
    assert [each["action"] for part in parts[:4] for each in part] == ["correct"] * 8
    assert parts[4][0]["action"] == "stop"
    assert (parts[4][1]["action"], parts[4][1]["reason"]["code"]) == ("none" if apart else "stop", "paused")
    (alarm,) = [each for each in shop.alarms() if each["kind"] == "still_out"]
    assert (alarm["tool_memory"], alarm["characteristic"]) == (4, None)
    assert "in a row are out of tolerance" in alarm["text"]
    assert "although corrections in full were issued for 4 of them" in alarm["text"]
    assert shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"] == []
    page = Person(shop.server, "operator").open(f"/alarms/{alarm['id']}")
    assert "Still out of tolerance" in page
    done = shop.acknowledge(alarm["id"], "noted")
    assert [each["code"] for each in done["outcome"]] == ["tool_resumed"]
    assert twins.part()[0]["action"] == "correct", "what was before the answer no longer counts"


def test_what_was_only_measured_does_not_count(shop: Shop) -> None:
    """Four parts out while nothing corrects; then the loop corrects, and brings it back."""
    key = shop.another("seat", tool_memory=4, average_memory=6, mode="measure_only", **SEAT)
    for _part in range(6):
        shop.read(12.0, key)
    shop.call("PATCH", f"/characteristics/{key}", parameters={"mode": "automatic"}, reason="released")
    assert shop.read(12.0, key)["action"] == "correct"


def test_small_steps_take_more_parts(shop: Shop) -> None:
    """The largest step is 1 µm, so each part is out by 1 µm less; then an engineer allows more."""
    key, offset, last = shop.another("seat", tool_memory=4, average_memory=6, max_step=0.001, **SEAT), 0.0, 0
    for part in range(8):
        answer = shop.read(round(18 + offset * 1000, 3), key, correction_in_effect=last)
        assert answer["action"] == "correct", part
        offset, last = round(offset + answer["correction"]["amount"], 9), answer["correction"]["number"]
        shop.correction(last, "applied", offset_after=offset, client=shop.machine_client)
    shop.call("PATCH", f"/characteristics/{key}", parameters={"max_step": 0.02}, reason="too slow")
    assert shop.read(9.0, key, correction_in_effect=last)["action"] == "correct"


def test_an_offset_that_the_control_does_not_use_ends_after_five(shop: Shop) -> None:
    """Single readings, and the last ones in one batch with quiet ones of another characteristic."""
    key = shop.another("seat", tool_memory=4, average_memory=6, **SEAT)
    last, offset = 0, 0.0
    for part in range(1, 6):
        answer = shop.read(9.0 + part / 100, key, correction_in_effect=last)
        if part < 5:
            offset, last = round(offset + answer["correction"]["amount"], 9), answer["correction"]["number"]
            shop.correction(last, "applied", offset_after=offset, client=shop.machine_client)
    assert (answer["action"], answer["reason"]["code"]) == ("stop", "paused")
