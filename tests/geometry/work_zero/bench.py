"""A pocket as it is touched, and the same one that has moved."""

from typing import Any

from tests.shop import Shop

POCKET: dict[str, Any] = {
    "kind": "pocket",
    "tip": 6.0,
    "touches": [
        {"x": -353.012, "approach": "-X"},
        {"x": -259.008, "approach": "+X"},
        {"y": -181.254, "approach": "-Y"},
        {"y": -127.246, "approach": "+Y"},
    ],
}


def post(shop: Shop, status: int = 201, **more: Any) -> Any:
    return shop.call("POST", "/work-zeros", status, machine=shop.machine, **(POCKET | more))


def moved(dx: float, dy: float = 0.0) -> list[dict[str, Any]]:
    touches: list[dict[str, Any]] = []
    for touch in POCKET["touches"]:
        name, by = ("x", dx) if "x" in touch else ("y", dy)
        touches.append(touch | {name: round(touch[name] + by, 6)})
    return touches


def moved_along(figure: Any, axis: str) -> list[float]:
    (trace,) = [each for each in figure["data"] if each["meta"] == axis]
    found: list[float] = trace["y"]
    return found
