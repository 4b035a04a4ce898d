"""Short words for walking through the pages of rotary axes."""

import re
from typing import Any

from tests.geometry.rotary_axes.bench import protocol
from tests.shop import Person, Shop

QS = "0.01234567 -0.0123456 0.00123456 -0.0012345"
LAST_MONTH = "0.00410000 -0.0075000 0.00190000 -0.0012000"


def take(shop: Shop, **run: Any) -> int:
    number: int = shop.call("POST", "/kinematics/runs", 201, machine=shop.machine, **run)["run"]
    return number


def runs(shop: Shop) -> list[Any]:
    items: list[Any] = shop.call("GET", f"/kinematics/runs?machine={shop.machine}")["items"]
    return items


def machine(shop: Shop) -> str:
    return f"/kinematics/machines/{shop.machine}"


def in_list(person: Person, shop: Shop) -> str:
    """The row of the machine in the list of all, which has pages; empty if there is none."""
    page = person.open(f"/kinematics?after={shop.machine[:-1]}")
    return page.partition(f'id="machine-{shop.machine}"')[2].partition("</tr>")[0]


def words(page: str) -> str:
    """Text that people read: no markup, single blanks."""
    body = re.sub(r"<script.*?</script>", " ", page.partition("<main")[2], flags=re.DOTALL)
    return " ".join(re.sub(r"<[^>]+>", " ", body).replace("\N{NO-BREAK SPACE}", " ").split())


def grid(run: dict[str, Any]) -> dict[str, str]:
    """Ball centres of an axis as they are typed into the grid."""
    sign = {"positive": "+", "negative": "-", None: ""}
    typed = {"axis_0": run["axis"], "ball": "180 0 40"}
    for row, each in enumerate(run["positions"]):
        typed |= {f"angle_{row}": f"{each['angle']:g}".replace(".", ","), f"from_{row}": sign[each["approach"]]}
        typed |= {f"{name}_{row}": f"{v:.6f}" for name, v in zip("xyz", each["centre"], strict=True)}
    return typed


def last_month() -> str:
    """The protocol of today as it was a month ago: the axis stood 8.2 µm less far off in X."""
    text = protocol("de")
    for now, then in (
        ("21.11.2026", "20.10.2026"),
        ("+0,0123", "+0,0041"),
        ("&minus;0,0081", "&minus;0,0075"),
        ("250,0123 Y -0,0081", "250,0041 Y -0,0075"),
        ("0.01230000 -0.0081000 0.00210000 -0.0013000", LAST_MONTH),
    ):
        assert now in text
        text = text.replace(now, then)
    return text
