"""Rotary axes in Chromium: the stories that people come with."""

import re
from pathlib import Path

import pytest
from playwright.sync_api import Page, expect

from tests.geometry.rotary_axes.bench import RADIUS, axis, protocol
from tests.geometry.rotary_axes.walking import grid, last_month, machine, runs, take
from tests.pages.looks import drawn, live
from tests.shop import Person, Shop

pytestmark = pytest.mark.usefixtures("signed_in")
SIZES = {"desk": (1280, 800), "large": (1920, 1080), "panel": (800, 1280)}


@pytest.fixture
def signed_in(engineer: Person, page: Page) -> None:
    engineer.sign_in(page)


def chart(page: Page, source: str) -> list[str]:
    """Text in a chart, once it is drawn."""
    found = page.locator(f'plotly-chart[src*="{source}"]')
    expect(found.locator("text").first).to_be_attached()
    drawn(page, f'plotly-chart[src*="{source}"]')
    texts: list[str] = found.evaluate("chart => [...chart.querySelectorAll('text')].map((text) => text.textContent)")
    return [text.replace("\N{NO-BREAK SPACE}", " ") for text in texts]


def test_a_protocol_of_last_month_and_of_today(shop: Shop, page: Page, tmp_path: Path) -> None:
    """Two files, one picture: what moved, and what to enter on the control."""
    for name, text in (("october.html", last_month()), ("november.html", protocol("de"))):
        file = tmp_path / name
        file.write_text(text, encoding="utf-8")
        page.goto(f"/kinematics/new?machine={shop.machine}")
        page.get_by_label("File", exact=True).set_input_files(file)
        page.get_by_role("button", name="Preview").click()
        expect(page.locator("#seen")).to_contain_text("Bediener der Nachtschicht")
        assert len(runs(shop)) == (name == "november.html")
        page.get_by_role("button", name="Evaluate and save").last.click()
        expect(page.get_by_text("is stored")).to_be_visible()
    page.get_by_role("link", name=re.compile("Compare with run")).click()
    expect(page.get_by_role("heading", name="1 value has moved")).to_be_visible()
    written = chart(page, "comparison-figure")
    assert "moved +8.2 µm · enter +0.0123 mm" in written
    assert "within scatter · enter −0.0081 mm" in written
    assert {"then", "now"} <= set(written)
    page.get_by_role("link", name="Mark as entered").click()
    dialog = page.get_by_role("dialog")
    expect(dialog).to_contain_text("EX0C +0.0123 mm, EY0C −0.0081 mm, EA0C +0.0021 °, EB0C −0.0013 °")
    dialog.get_by_label("Drift").check()
    dialog.get_by_role("button", name="Record entry").click()
    expect(page.get_by_text("before and after is backed up")).to_be_visible()
    [*_, run] = runs(shop)
    assert run["entered"]["reason"] == "Drift"
    page.goto(machine(shop))
    backups = page.locator("#backup-list tbody tr")
    expect(backups).to_have_count(2)
    expect(backups.first).to_contain_text("in effect")
    backups.last.get_by_role("link", name="Put back").click()
    dialog.get_by_role("radio", name="Worse than before").check()
    dialog.get_by_role("button", name="Put back").click()
    expect(page.get_by_text("it is version 3 now")).to_be_visible()


@pytest.mark.long
def test_every_diagram_is_red_and_green_and_tells_them_apart_without_colour(shop: Shop, page: Page) -> None:
    run = take(shop, axes=[axis(both=True, backlash=0.002)])
    page.goto(f"/kinematics/runs/{run}")
    for letter in "XYZ":
        source = f"axis=C&letter={letter}"
        written = chart(page, source)
        assert {"measured ↑", "measured ↓", "optimised ↑", "optimised ↓"} <= set(written)
        assert f"E{letter}C, µm" in written
        lines = page.locator(f'plotly-chart[src*="{source}"] g.scatterlayer path.js-line')
        strokes = lines.evaluate_all(
            "lines => lines.map((line) => [getComputedStyle(line).stroke, getComputedStyle(line).strokeDasharray])"
        )
        assert {colour for colour, dash in strokes if dash == "none"} == {"rgb(192, 15, 30)"}
        assert {colour for colour, dash in strokes if dash != "none"} == {"rgb(26, 122, 60)"}
        assert len(strokes) == 4


def test_positions_are_typed_into_the_grid(shop: Shop, page: Page, complaints: list[str]) -> None:
    """A block from a spreadsheet falls into its cells; what is wrong is marked where it stands."""
    page.goto(f"/kinematics/new?machine={shop.machine}")
    expect(page.get_by_label("line 1, angle")).to_be_hidden()
    page.get_by_text("Sphere centres or probed points").click()
    typed = grid(axis())
    page.get_by_label("Calibration sphere at 0°").fill(typed["ball"])
    block = "\n".join(
        "\t".join([typed[f"angle_{row}"], "", *(typed[f"{name}_{row}"] for name in "xyz")]) for row in range(6)
    )
    cell = page.get_by_label("line 1, angle")
    cell.focus()
    page.evaluate(
        """([text]) => {
          const data = new DataTransfer();
          data.setData("text/plain", text);
          document.activeElement.dispatchEvent(new ClipboardEvent("paste", { clipboardData: data, bubbles: true, cancelable: true }));
        }""",
        [block],
    )
    expect(page.get_by_label("line 6, Z")).to_have_value(typed["z_5"])
    page.get_by_label("line 3, Y").fill("12;3;4")
    page.get_by_role("button", name="Evaluate and save").last.click()
    expect(page.get_by_label("line 3, Y")).to_have_attribute("aria-invalid", "true")
    expect(page.get_by_label("line 3, Y")).to_have_value("12;3;4")
    complaints.clear()  # the browser tells the console of every 422
    page.get_by_label("line 3, Y").fill(typed["y_2"])
    page.get_by_label("line 3, Y").press("Enter")  # to the cell below, and nothing is sent
    expect(page.get_by_label("line 4, Y")).to_be_focused()
    page.get_by_role("button", name="Evaluate and save").last.click()
    expect(page.get_by_text("is stored")).to_be_visible()
    assert runs(shop)[0]["axes"][0]["points"] == 6


@pytest.mark.long
def test_the_drift_is_followed_and_a_value_chosen(shop: Shop, page: Page) -> None:
    for day in (1, 2, 3):
        take(shop, axes=[axis(seed=day)], measured_at=f"2026-11-{day:02}T06:00:00Z")
    page.goto(machine(shop))
    page.get_by_label("Limits of the drift").fill("EX0C 0.01")
    page.get_by_label("Why").fill("As accepted")
    page.get_by_role("button", name="Save limits").click()
    expect(page.get_by_text("The limits are saved")).to_be_visible()
    expect(page.locator("#drifts")).to_contain_text("beyond its limit")
    assert "EX0C, µm" in chart(page, "drift-figure")
    page.get_by_role("link", name="backlash of C").or_(page.get_by_role("link", name="EY0C")).first.click()
    expect(page.locator("plotly-chart.drift")).to_have_attribute("src", re.compile("value=EY0C"))
    live(page)
    take(shop, axes=[axis((0.001, 0, 0, 0), seed=9)], ball_radius=RADIUS)
    expect(page.locator("#run-list tbody tr")).to_have_count(4)  # without loading the page again


@pytest.mark.parametrize("size", ["panel", *(pytest.param(size, marks=pytest.mark.long) for size in ("desk", "large"))])
def test_nothing_overlaps_what_is_to_be_entered(shop: Shop, page: Page, size: str) -> None:
    """In the picture of two runs the words at the right lie beside the points, in every size."""
    page.set_viewport_size({"width": SIZES[size][0], "height": SIZES[size][1]})
    then = take(shop, axes=[axis()])
    now = take(shop, axes=[axis((0.0423, -0.0381, 0.0121, -0.0013), seed=2)])
    page.goto(f"/kinematics/compare?run={then}&with={now}")
    chart(page, "comparison-figure")
    over = page.evaluate(
        """() => {
          const boxes = (selector) => [...document.querySelectorAll(`plotly-chart ${selector}`)].map((e) => e.getBoundingClientRect());
          const words = boxes(".annotation-text");
          return boxes(".scatterlayer .point").filter((p) => words.some((w) =>
            p.right > w.left && p.left < w.right && p.bottom > w.top && p.top < w.bottom)).length;
        }"""
    )
    assert page.locator("plotly-chart .annotation-text").count() == 4
    assert over == 0
