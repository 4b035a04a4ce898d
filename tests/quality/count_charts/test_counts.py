"""Charts of counts by REST, figure and page: the same numbers, and refusals that name the field."""

from typing import Any
from urllib.parse import quote

from tests.shop import Person, Shop

DEFECTS = [
    8,
    7,
    11,
    3,
    6,
    11,
    4,
    4,
    5,
    8,
    8,
    6,
    7,
    6,
    10,
    7,
    9,
    5,
    6,
    8,
    8,
    10,
    4,
    11,
    4,
    11,
    6,
    6,
    9,
    5,
    4,
    7,
    5,
    7,
    8,
    30,
]


def test_one_chart_at_every_door(viewer: Person, shop: Shop) -> None:
    found: Any = shop.call("POST", "/count-charts", 200, chart="p", counts=DEFECTS, inspected=200)
    assert found["outside"] == [36]
    assert found["points"][0] == 0.04
    assert len(set(found["upper"])) == 1
    assert found["advice"] == ["1 sample lies beyond a limit."]
    listed = ",".join(map(str, DEFECTS))
    figure = shop.call("GET", f"/figures/count-chart?chart=p&counts={listed}&inspected=200")
    marks = {each["meta"]: each for each in figure["data"]}
    assert marks["points"]["y"] == found["points"]
    assert marks["upper"]["y"] == found["upper"]
    assert marks["outside"]["x"] == [36]
    page = viewer.open("/count-charts?chart=p&size=200&data=" + quote("\n".join(map(str, DEFECTS))))
    assert "1 sample lies beyond a limit." in page
    assert f"{found['centre'][0] * 100:.2f} %" in page
    assert "/api/v1/figures/count-chart?chart=p" in page


def test_wrong_counts_are_refused_by_field(shop: Shop) -> None:
    for body, field in (
        ({"chart": "p", "counts": [1, 2]}, "inspected"),
        ({"chart": "p", "counts": [1, 2], "inspected": [50]}, "inspected"),
        ({"chart": "np", "counts": [1, 2], "inspected": [50, 60]}, "inspected"),
        ({"chart": "p", "counts": [60, 2], "inspected": 50}, "counts"),
        ({"chart": "c", "counts": [0, 0]}, "counts"),
    ):
        problem: Any = shop.call("POST", "/count-charts", 422, **body)
        assert [each["field"] for each in problem["errors"]] == [field], body
    shop.call("GET", "/figures/count-chart?chart=c&counts=1,x", 422)
    wrong = shop.admin.get("/count-charts?chart=p&size=50&data=" + quote("4\nnone"))
    assert wrong.status_code == 422
    assert "line 2 is no count" in wrong.text
