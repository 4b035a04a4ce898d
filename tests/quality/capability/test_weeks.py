"""The index week by week, as the periodic job keeps it."""

from datetime import UTC, datetime, time, timedelta
from typing import Any

import pytest

from tests.quality.capability.test_capability import judge, of, quiet
from tests.servers import Server
from tests.shop import Person, Shop


def test_each_week_has_its_index_and_late_readings_have_theirs_judged_again(
    server: Server, shop: Shop, viewer: Person
) -> None:
    key = shop.another("weekly", mode="measure_only", tool_memory=0)
    today = datetime.now(UTC).date()
    this_monday = today - timedelta(days=today.weekday())
    mondays = [this_monday - timedelta(weeks=ago) for ago in (20, 3, 2, 1)]

    def push(monday: Any, sigma: float, seed: int, hour: int = 12) -> None:
        noon = datetime.combine(monday + timedelta(days=2), time(hour), UTC)
        moments = [(noon + timedelta(seconds=at)).isoformat() for at in range(60)]
        shop.push(quiet(60, seed=seed, sigma=sigma), key, measured_at=moments)

    def weeks() -> list[dict[str, Any]]:
        items = shop.call("GET", f"/overview?machine={shop.machine}&by=trend")["items"]
        found: list[dict[str, Any]] = next(item for item in items if item["characteristic"] == key)["weeks"]
        return found

    for seed, (monday, sigma) in enumerate(zip(mondays, (0.5, 3.0, 1.5, 0.7), strict=True)):
        push(monday, sigma, seed)
    judge(server, key)
    first = weeks()
    assert [week["begins"] for week in first] == [str(monday) for monday in mondays[1:]], "the oldest is too old"
    assert [week["readings"] for week in first] == [60, 60, 60]
    values = [week["value"] for week in first]
    assert values == sorted(values)
    study = of(shop, f"from={mondays[1]}&to={mondays[1] + timedelta(days=6)}", key)
    assert study[study["quote"]]["value"] == pytest.approx(values[0])
    assert (study[study["quote"]]["low"], study[study["quote"]]["high"]) == pytest.approx(
        (first[0]["low"], first[0]["high"])
    )

    push(mondays[2], 1.5, 9, hour=13)  # a bridge that was offline
    judge(server, key)
    second = weeks()
    assert [week["readings"] for week in second] == [60, 120, 60]
    assert (second[0], second[2]) == (first[0], first[2])

    figure = shop.call("GET", f"/characteristics/{key}/figures/weeks")
    drawn = next(trace for trace in figure["data"] if trace.get("meta") == "index")
    assert len(drawn["x"]) == 3
    line = viewer.open(f"/overview?machine={shop.machine}")
    assert 'class="index-trend"' in line
    assert "Index over 3 weeks" in line


def test_without_a_week_the_figure_says_so(shop: Shop) -> None:
    figure = shop.call("GET", f"/characteristics/{shop.characteristic}/figures/weeks")
    assert "No week has an index yet" in str(figure["layout"])
