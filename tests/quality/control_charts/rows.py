"""Readings in bulk, for what is charted."""

from collections.abc import Sequence
from typing import Any

from tests.shop import Shop

MEASURED = {"mode": "measure_only"}


def pushed(shop: Shop, micrometres: Sequence[float], characteristic: str | None = None, **more: Sequence[Any]) -> None:
    """Readings that deviate by so much, in one batch; more: a column for each further field."""
    rows = [
        {"characteristic": characteristic or shop.characteristic, "measured": round(40 + value / 1000, 9)}
        | {name: column[at] for name, column in more.items()}
        for at, value in enumerate(micrometres)
    ]
    answer = shop.machine_client.post("/api/v1/readings/batch", json=rows)
    assert answer.status_code in (200, 201), answer.text


def frozen(shop: Shop, first: int, last: int, status: int = 201, quantity: str = "deviation", **more: Any) -> Any:
    """Freeze a baseline of these readings."""
    path = f"/characteristics/{shop.characteristic}/baselines"
    body: dict[str, Any] = {"quantity": quantity, "first_sequence": first, "last_sequence": last, "reason": "Stable"}
    return shop.call("POST", path, status, **body | more)


def control(shop: Shop, **query: Any) -> Any:
    """The chart in numbers."""
    asked = "&".join(f"{name}={value}" for name, value in query.items())
    return shop.call("GET", f"/characteristics/{shop.characteristic}/control?{asked}")
