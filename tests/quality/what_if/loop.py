"""A machine in closed loop with a running server: what it cuts is what it would cut without corrections, and those in effect."""

import random
from typing import Any

from tests.shop import Shop


def scatter(count: int, seed: int = 1) -> list[float]:
    """A course in µm without corrections: an edge that recedes, and parts that scatter by 1.4 µm."""
    chance = random.Random(seed)
    return [round(0.02 * part + chance.gauss(0, 1.4), 3) for part in range(count)]


def cut(shop: Shop, course: list[float], characteristic: str | None = None, *, delay: int = 1) -> list[dict[str, Any]]:
    """Cut and measure these parts one by one, each with the corrections issued more than ``delay`` parts before it."""
    key = characteristic or shop.characteristic
    issued: list[tuple[int, float]] = [(0, 0.0)]  # after each part: number of the last correction, and their sum in µm
    answers = []
    for at, free in enumerate(course):
        number, offset = issued[max(0, at - delay)]
        answer = shop.read(free + offset, key, correction_in_effect=number)
        correction = answer["correction"]
        last, total = issued[-1]
        if correction is not None:
            last, total = correction["number"], round(total + correction["amount"] * 1000, 6)
        issued.append((last, total))
        answers.append(answer)
    return answers
