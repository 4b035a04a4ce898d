"""Whatever is asked of a characteristic is answered, however little its window holds: faults alone, one reading, a day that came late.

A week with two probe faults, and between them a reading of another day, once answered 500; so did strata of no reading.
"""

from datetime import UTC, datetime, timedelta
from random import Random
from typing import Any

import pytest

from app.core.context import ContextField
from app.core.spc.shewhart import Chart
from tests import chance
from tests.pages.house import routes
from tests.quality.capability.test_capability import judge
from tests.quality.chart_signals.line import Line
from tests.servers import Server
from tests.shop import Person, Shop

BASELINES: tuple[dict[str, Any], ...] = (
    {"quantity": "deviation"},
    {"quantity": "deviation", "chart": "xbar_r", "grouping": "consecutive", "group_size": 3},
    {"quantity": "differences"},
    {"quantity": "wear_residuals"},
    {"quantity": "without_corrections"},
)
FURTHER = {
    "/control": [f"chart={chart.value}" for chart in Chart],
    "/strata": [f"by={field.value}" for field in ContextField],
    "/capability": ["sigma_by=part", "sigma_by=shift", "side=upper", "context.nest=1"],
}
FAULT, WORN = 1200.0, 350.0  # µm


def addresses() -> list[str]:
    """Every address of a characteristic that takes no other name; the more questions some of them take."""
    found = []
    for path in sorted(routes()):
        if "{characteristic}" in path and path.count("{") == 1:
            more = next((FURTHER[end] for end in FURTHER if path.endswith(end)), [])
            found += [f"{path}?", *(f"{path}?{each}&" for each in more)]
    return found


def late_readings(line: Line, rng: Random, first: Any) -> None:
    """Batches of some readings each, of four days in no order, half of them faults or of a worn tool."""
    for _batch in range(rng.randint(1, 5)):
        count = rng.randint(1, 9)
        values = [rng.choice([FAULT, FAULT, WORN, -WORN, 0.0, rng.gauss(0, 1), rng.gauss(0, 1)]) for _ in range(count)]
        at = [
            f"{first + timedelta(days=rng.randint(0, 3))}T{rng.randint(0, 23):02}:{rng.randint(0, 59):02}:00Z"
            for _ in range(count)
        ]
        nest = [{"nest": rng.randint(1, 2)} if rng.random() < 0.5 else {} for _ in range(count)]
        line.shop.push(values, line.key, measured_at=at, context=nest)
    if rng.random() < 0.5:
        line.exclude(61)


@pytest.mark.parametrize(
    "number", [1, *(pytest.param(each, marks=pytest.mark.long) for each in range(2, 7))], ids="history-{}".format
)
def test_every_window_of_a_characteristic_is_answered(
    server: Server, shop: Shop, engineer: Person, number: int
) -> None:
    rng = Random(chance.seed(number))
    line = Line(shop, baseline=False)
    line.freeze(1, 60, **BASELINES[number % len(BASELINES)])
    first = (datetime.now(UTC) - timedelta(days=9)).date()
    late_readings(line, rng, first)
    windows = [f"from={first + timedelta(days=at)}&to={first + timedelta(days=at)}" for at in range(5)]
    windows += ["last=1", "last=all", "first=61&through=61", f"from={first}T03:00:00Z&to={first}T04:00:00Z"]
    for address in addresses():
        for window in rng.sample(windows, 4 if number > 1 else 2):
            path = f"{address}{window}".format(characteristic=line.key)
            answer = (shop.admin if path.startswith("/api/") else engineer.browser).get(path)
            assert answer.status_code < 500, f"{path}: {answer.text[:500]}"
    judge(server, line.key)
    line.look()
