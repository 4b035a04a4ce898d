"""A rotary table whose errors are known, as a machine sends its runs."""

from collections.abc import Sequence
from math import cos, pi, sin
from pathlib import Path
from typing import Any

from tests.core.rotary.simulated import positions
from tests.shop import Shop

ANGLES = (-90.0, -30.0, 30.0, 90.0, 135.0, 180.0)
BALL = (180.0, 0.0, 40.0)
TRUE = (0.0123, -0.0081, 0.0021, -0.0013)
NAMES = ("EX0C", "EY0C", "EA0C", "EB0C")
RADIUS = 12.5
PROTOCOLS = Path(__file__).parents[2] / "files" / "formats" / "protocols"


def axis(errors: Sequence[float] = TRUE, *, noise: float = 0.0005, seed: int = 1, **more: Any) -> dict[str, Any]:
    """C as it is sent, with ball centres."""
    both = more.pop("both", False)
    backlash = more.pop("backlash", 0.0)
    seen = positions("C", BALL, ANGLES, errors=errors, noise=noise, seed=seed, both=both, backlash=backlash)
    words = {1: "positive", -1: "negative", 0: None}
    return {
        "axis": "C",
        "ball": list(BALL),
        "positions": [
            {"angle": each.angle, "approach": words[each.approach], "centre": [round(v, 6) for v in each.centre]}
            for each in seen
        ],
    } | more


def touches(centre: Sequence[float], radius: float = RADIUS) -> list[list[float]]:
    """Six touches round the equator, one on top."""
    around = [(cos(n * pi / 3), sin(n * pi / 3), 0.0) for n in range(6)]
    return [[c + radius * d for c, d in zip(centre, direction, strict=True)] for direction in [*around, (0, 0, 1)]]


def touched(errors: Sequence[float] = TRUE, radius: float = RADIUS) -> dict[str, Any]:
    """The same with touches in place of centres."""
    made = axis(errors, noise=0.0)
    for each in made["positions"]:
        each["touches"] = touches(each.pop("centre"), radius)
    return made


def protocol(language: str) -> str:
    return (PROTOCOLS / f"{language}.html").read_text(encoding="utf-8")


RUNS = "/kinematics/runs"


def take(shop: Shop, status: int = 201, **run: Any) -> Any:
    """Send a run of the shop's machine."""
    return shop.call("POST", RUNS, status, machine=shop.machine, **run)


def plan(shop: Shop, **wanted: Any) -> Any:
    """Set what its runs are held against."""
    return shop.call("PUT", f"/machines/{shop.machine}/kinematics", **({"reason": "acceptance"} | wanted))


def enter(shop: Shop, run: Any, status: int = 200, **more: Any) -> Any:
    """Its values have been entered on the control."""
    return shop.call("POST", f"{RUNS}/{run['run']}/enter", status, **({"reason": "Monthly check"} | more))
