"""Six pictures of a characteristic, on one screen and one sheet."""

import io
import re

import pypdf
import pytest
from playwright.sync_api import Page, expect

from tests.shop import Person, Shop

CONTROLS = ["Zone chart", "Rules", "Sign out", "Search", "5000", "Period", "Proof"]


@pytest.fixture(scope="module")
def measured(common_shop: Shop) -> Shop:
    common_shop.push([3.0 * ((at * 7) % 11 - 5) / 5 for at in range(40)])
    return common_shop


def test_the_six_pictures_say_what_capability_says(measured: Shop, viewer: Person) -> None:
    path = f"/characteristics/{measured.characteristic}"
    opened = viewer.open(f"{path}/six-pack")
    assert opened.count('class="drawing"') == 5
    assert opened.count('class="six-indices"') == 1
    ppk = measured.call("GET", f"{path}/capability")["ppk"]["value"]
    assert f"Ppk <b>{ppk:.2f}</b>" in opened
    assert "40 readings, 1 to 40" in opened
    assert "No index" not in opened
    few = viewer.open(f"{path}/six-pack?last=30")
    assert "30 readings, 11 to 40" in few


def test_without_readings_each_picture_says_so(measured: Shop, viewer: Person) -> None:
    measured.add(f"{measured.machine}-new")
    opened = viewer.open(f"/characteristics/{measured.machine}-new/six-pack")
    assert len(re.findall("No readings here|No points in this period", opened)) == 5
    assert "too few readings" in opened


def test_one_broken_insert_does_not_press_the_limits_into_a_line(measured: Shop, viewer: Person) -> None:
    key = measured.another("broken")
    measured.push([0.5, -0.5] * 12 + [392.6], key)
    opened = viewer.open(f"/characteristics/{key}/six-pack")
    last = opened[opened.index("Last 25 readings") :]
    drawing = last[: last.index("</figure>")]
    assert "+393 µm" in drawing
    apart = [float(re.search(rf'y="([\d.]+)"[^>]*>{name} limit', drawing)[1]) for name in ("lower", "upper")]  # type: ignore[index]
    assert apart[0] - apart[1] > 120, "pixels"


@pytest.mark.browser
def test_it_fits_one_screen_and_one_sheet(measured: Shop, viewer: Person, page: Page) -> None:
    viewer.sign_in(page)
    page.set_viewport_size({"width": 1280, "height": 800})
    page.goto(f"/characteristics/{measured.characteristic}/six-pack")
    expect(page.locator(".six-pack figure")).to_have_count(5)
    assert page.evaluate("document.querySelector('.six-pack').getBoundingClientRect().bottom") <= 800
    for across in (False, True):
        printed = pypdf.PdfReader(io.BytesIO(page.pdf(format="A4", landscape=across)))
        words = printed.pages[0].extract_text()
        assert len(printed.pages) == 1
        assert "Ppk" in words
        assert [word for word in CONTROLS if word in words] == []
