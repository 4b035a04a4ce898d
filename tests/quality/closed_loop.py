"""A machine in closed loop with a running server: what it cuts is what it would cut without corrections, and those in effect."""

import random
from collections.abc import Sequence
from typing import Any

from app.core.decision.decide import LoopState, decide, outstanding_effect
from app.core.decision.step import Action, deviation_of
from app.core.parameters import read
from tests.shop import Shop


def scatter(count: int, seed: int = 1, sigma: float = 1.4, *, wear: float = 0.02, begin: float = 0.0) -> list[float]:
    """A course in µm without corrections: an edge that recedes, and parts that scatter."""
    chance = random.Random(seed)
    return [round(begin + wear * part + chance.gauss(0, sigma), 3) for part in range(count)]


def cut(
    shop: Shop,
    course: Sequence[float],
    characteristic: str | None = None,
    *,
    delay: int = 1,
    tool: int = 3,
    jumps: Sequence[int] = (),
    **more: Sequence[Any],
) -> list[dict[str, Any]]:
    """Cut and measure these parts, each with the corrections issued more than ``delay`` parts before it.

    The decisions are foretold, so that all the readings go in one batch: the answers must be those foretold. jumps: parts
    whose size is implausible. more: what is sent with each.
    """
    key = characteristic or shop.characteristic
    parameters = read(shop.call("GET", f"/characteristics/{key}")["parameters"])[0]
    location = shop.tool(tool)
    begin = location["last_correction"]["number"] if location["last_correction"] else 0
    made = shop.call("GET", f"/machines/{shop.machine}/corrections?limit=1000")["items"]
    newest = made[-1]["number"] if made else 0
    memory = shop.call("GET", f"/machines/{shop.machine}/averages/{parameters.average_memory}")
    average, offsets = memory["average"], [(begin, location["offset"])]  # the newest correction after each part, and mm
    amounts: dict[int, float] = {}
    sizes, numbers, foretold = [], [], []
    for at, free in enumerate(course):
        in_effect, offset = offsets[max(0, at - delay)]
        sizes.append(round(free - 1000 * offset / parameters.factor, 3))
        numbers.append(in_effect)
        outstanding = outstanding_effect(
            [amount for number, amount in amounts.items() if number > in_effect], parameters.factor
        )
        deviation = deviation_of(round(40 + sizes[-1] / 1000, 9), parameters.target, memory["empirical_value"])
        decision = decide(parameters, LoopState(average), deviation, outstanding=outstanding, jump=at in jumps)
        average = decision.average_after
        number, offset = offsets[-1]
        if decision.amount is not None:
            newest += 1
            if decision.action is Action.CORRECT:
                number, offset = newest, round(offset + decision.amount, 9)
                amounts[number] = decision.amount
        offsets.append((number, offset))
        foretold.append(None if decision.amount is None else (newest, decision.amount))
    answers = shop.push(sizes, key, answers=True, correction_in_effect=numbers, **more)
    told = [each["correction"] and (each["correction"]["number"], each["correction"]["amount"]) for each in answers]
    assert told == foretold
    return answers
