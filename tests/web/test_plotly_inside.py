"""What plotly.js does not document is used in one module, and is what that module takes it for."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page

from app import HOUSE

SCRIPTS = HOUSE / "frontend" / "static" / "js"
INSIDE = "plotly-inside.js"
PRIVATE = re.compile(r"_fullLayout|_fullData|\b(?:plot|axis)\._\w+|\.(?:[lrdpc]2[lrdpc])\(|[{,] _\w+ [,}]")
FIGURE = {
    "data": [{"x": [0, 10], "y": [1.0, 2.0]}, {"x": [0, 10], "y": [5.0, 6.0], "yaxis": "y2"}],
    "layout": {
        "width": 600, "showlegend": False, "height": 400, "margin": {"l": 50, "r": 30, "t": 20, "b": 40}, "xaxis": {"range": [0, 10], "automargin": False},
        "yaxis": {"range": [0, 4], "domain": [0.5, 1]}, "yaxis2": {"range": [0, 10], "domain": [0, 0.5]},
        "annotations": [{"x": 5, "y": 2, "yref": "y", "text": "here", "name": "detail"}],
    },
}  # fmt: skip
LOOK = """async (figure) => {
  const plot = document.body.appendChild(document.createElement("div"));
  await Plotly.newPlot(plot, figure.data, figure.layout);
  const [x, y, y2] = ["x", "y", "y2"].map((name) => inside.axisOf(plot, name));
  const { t, b, l, r } = inside.margins(plot);
  return {
    value: inside.valueOn(x, "5"), none: inside.axisOf(plot, "y3") ?? null, within: inside.pixelOn(x, 5), place: inside.place(x, 5),
    down: inside.place(y, 2), lower: inside.place(y2, 5), edge: inside.edge(x), extent: inside.extent(x), margins: [t, b, l, r],
    notes: inside.notes(plot).map((each) => [each.name, each.yref, each.x]), height: inside.heightDrawn(plot), box: inside.boxIsDrawn(plot),
  };
}"""


def test_no_other_script_reaches_into_it() -> None:
    found = {
        f"{path.name}:{number}"
        for path in SCRIPTS.glob("*.js")
        for number, line in enumerate(path.read_text("utf-8").splitlines(), 1)
        if PRIVATE.search(line.partition("//")[0])
    }
    assert {place.partition(":")[0] for place in found} == {INSIDE}, found


@pytest.fixture
def screen() -> dict[str, Any]:
    """The library sets styles that the pages' own loading (plotly-library.js) makes needless."""
    return {"viewport": {"width": 1280, "height": 800}, "bypass_csp": True}


@pytest.mark.browser
def test_it_is_as_it_is_taken_for(page: Page) -> None:
    page.goto("/sign-in")
    page.add_script_tag(url=page.locator('meta[name="plotly"]').get_attribute("content"))
    source = (SCRIPTS / INSIDE).read_text("utf-8")
    names = ", ".join(re.findall(r"^export const (\w+)", source, re.MULTILINE))
    inside = f"const inside = (() => {{ {source.replace('export const', 'const')}\nreturn {{ {names} }}; }})();"
    seen = page.evaluate(LOOK.replace("{\n", f"{{\n{inside}\n", 1), FIGURE)
    assert seen == {
        "value": 5, "none": None, "within": 260, "place": 310, "down": 105, "lower": 275, "edge": 50, "extent": 520,
        "margins": [20, 40, 50, 30], "notes": [["detail", "y", 5]], "height": 400, "box": False,
    }  # fmt: skip
