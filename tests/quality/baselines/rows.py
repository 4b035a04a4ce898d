"""Baselines and charts, over REST."""

from typing import Any

from tests.shop import Shop


def frozen(shop: Shop, first: int, last: int, status: int = 201, quantity: str = "deviation", **more: Any) -> Any:
    """Freeze a baseline of these readings."""
    path = f"/characteristics/{shop.characteristic}/baselines"
    body: dict[str, Any] = {"quantity": quantity, "first_sequence": first, "last_sequence": last, "reason": "Stable"}
    return shop.call("POST", path, status, **body | more)


def control(shop: Shop, **query: Any) -> Any:
    """The chart in numbers."""
    asked = "&".join(f"{name}={value}" for name, value in query.items())
    return shop.call("GET", f"/characteristics/{shop.characteristic}/control?{asked}")
