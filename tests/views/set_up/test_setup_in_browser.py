"""Set-up in a real browser: the zone diagram draws while one types, by mouse-free hands."""

import io

import pytest
from playwright.sync_api import Page, expect
from pypdf import PdfReader

from tests.shop import Person, Shop, unique

pytestmark = pytest.mark.browser


@pytest.fixture
def signed_in(page: Page, engineer: Person) -> Page:
    engineer.sign_in(page)
    return page


def limit(page: Page, name: str, side: int = 1) -> str:
    words = page.locator(f'[data-limit="{name}"][data-side="{side}"] .deviation').text_content()
    assert words is not None
    return words.replace("\xa0", " ")


def test_the_diagram_follows_the_typing(signed_in: Page) -> None:
    page = signed_in
    page.goto("/setup/characteristics/new")
    page.fill("[name=nominal]", "40")
    page.fill("[name=upper_deviation]", "0")
    page.fill("[name=lower_deviation]", "−0,016")
    assert page.locator('[data-size="target"]').text_content() == "39.9920 mm"
    assert limit(page, "tolerance") == "+8 µm"
    suggested = [limit(page, name) for name in ("zero_range", "wear_limit", "confidence_limit")]
    assert suggested == ["+1 µm", "+300 µm", "+1 mm"]
    assert limit(page, "tolerance", -1) == "−8 µm"
    assert limit(page, "averaging_limit") == "+5.333 µm", "a third of the tolerance while the field is empty"
    page.fill("[name=averaging_limit]", "0.0053")
    page.fill("[name=zero_range]", "0.001")
    assert (limit(page, "averaging_limit"), limit(page, "zero_range", -1)) == ("+5.3 µm", "−1 µm")
    page.fill("[name=wear_limit]", "0.3")
    page.fill("[name=confidence_limit]", "1")
    assert (limit(page, "wear_limit"), limit(page, "confidence_limit")) == ("+300 µm", "+1 mm")
    assert page.locator('[data-um="zero_range"]').text_content() == "1\xa0µm"
    assert page.locator(".limit.wrong").count() == 0


def test_a_tolerance_class_becomes_deviations_when_the_field_is_left(signed_in: Page) -> None:
    page = signed_in
    page.goto("/setup/characteristics/new")
    told = page.locator('.field[data-field="nominal"] .error')
    page.fill("[name=nominal]", "40 h")
    expect(told).to_have_count(0)  # it is still being typed
    page.fill("[name=nominal]", "Ø40 h6")
    page.press("[name=nominal]", "Tab")
    expect(page.locator("[name=lower_deviation]")).to_have_value("-0.016")
    assert (page.input_value("[name=nominal]"), page.input_value("[name=upper_deviation]")) == ("40", "0")
    assert page.locator('[data-size="target"]').text_content() == "39.9920 mm"
    page.fill("[name=nominal]", "40 q6")
    page.press("[name=nominal]", "Tab")
    expect(told).to_have_count(1)
    assert page.input_value("[name=lower_deviation]") == "-0.016"


def test_a_name_of_form_fills_in_its_natural_limit_and_nothing_that_is_typed(signed_in: Page) -> None:
    page = signed_in
    page.goto("/setup/characteristics/new")
    page.fill("[name=name]", "Run-out of the seat")
    page.press("[name=name]", "Tab")
    expect(page.locator("[name=natural_limit]")).to_have_value("lower")
    assert (page.input_value("[name=nominal]"), page.input_value("[name=lower_deviation]")) == ("0", "0")
    page.fill("[name=upper_deviation]", "0.012")
    assert (limit(page, "tolerance"), limit(page, "tolerance", -1)) == ("+12 µm", "–")
    page.goto("/setup/characteristics/new")
    page.fill("[name=nominal]", "40")
    page.fill("[name=name]", "Roundness")
    page.press("[name=name]", "Tab")
    page.fill("[name=lower_deviation]", "-0.016")
    assert (page.input_value("[name=nominal]"), page.input_value("[name=natural_limit]")) == ("40", "")


def test_a_refused_order_is_reported_at_once_in_the_words_of_the_server(
    signed_in: Page, shop: Shop, complaints: list[str]
) -> None:
    page = signed_in
    page.goto(f"/setup/characteristics/{shop.characteristic}")
    page.fill("[name=averaging_limit]", "0.009")
    told = page.locator('.field[data-field="averaging_limit"] .error')
    expect(told).to_have_count(1)
    sentence = told.text_content()
    assert sentence == (
        "R34 averaging limit 0.0090 mm must not be larger than R35/2 = 0.0080 mm; lower it, or leave it empty for a third "
        "of the tolerance"
    )
    assert page.locator("[name=averaging_limit]").get_attribute("aria-invalid") == "true"
    assert page.locator('.limit.wrong[data-limit="averaging_limit"]').count() == 2
    page.fill("[name=reason]", "to see it refused")
    with page.expect_event("load"):
        page.get_by_role("button", name="Save").click()
    expect(told).to_have_count(1)
    assert (told.text_content() or "").strip() == sentence, "the server says the same"
    assert page.input_value("[name=reason]") == "to see it refused"
    complaints[:] = [words for words in complaints if "422" not in words]
    page.fill("[name=averaging_limit]", "0.006")
    expect(told).to_have_count(0)
    page.get_by_role("button", name="Save").click()
    page.wait_for_url("**?done=changed")
    expect(page.locator("#versions")).to_contain_text("to see it refused")
    assert shop.call("GET", f"/characteristics/{shop.characteristic}")["parameters"]["averaging_limit"] == 0.006


def test_what_saves_is_in_sight_and_what_few_need_is_folded_but_printed(signed_in: Page, shop: Shop) -> None:
    page = signed_in
    page.set_viewport_size({"width": 1280, "height": 800})
    page.goto(f"/setup/characteristics/{shop.characteristic}")
    save = page.get_by_role("button", name="Save")
    expect(save).not_to_be_in_viewport()  # of a new one the first size comes next
    shop.read(1.0)
    page.reload()
    expect(save).to_be_in_viewport(ratio=1)
    assert page.evaluate("document.documentElement.scrollHeight") <= 2250, "three screens at most, where it was five"
    folded = [page.locator(f"[name={name}]") for name in ("variant", "max_step", "part")] + [
        page.locator("#program-text")
    ]
    for field in folded:
        expect(field).to_be_hidden()
    page.emulate_media(media="print")
    for field in folded:
        expect(field).to_be_visible()
    expect(save).to_be_hidden()
    page.emulate_media(media="screen")
    page.get_by_label("On this page").get_by_role("link", name="Probing").click()
    expect(folded[0]).to_be_in_viewport()
    page.locator("[name=path_factor]").focus()
    tops = [
        page.evaluate("which => document.querySelector(which).getBoundingClientRect().top", which)
        for which in ("[name=path_factor]", ".save-bar")
    ]
    assert tops[0] + 44 <= tops[1], "what has the focus is not behind the key"


def test_a_machine_and_its_key_by_keyboard_alone(signed_in: Page) -> None:
    page = signed_in
    page.goto("/setup/machines/new")
    expect(page.locator("[name=name]")).to_be_focused()
    key = unique("by-keyboard")
    page.keyboard.type(key.replace("-", " ").capitalize())  # the key follows from the name
    page.keyboard.press("Enter")
    page.wait_for_url(f"**/setup/machines/{key}?done=added")
    page.locator("#f-key-name").focus()
    page.keyboard.type("cell PC")
    page.keyboard.press("Enter")
    expect(page.locator(".secret")).to_contain_text("inband_")


@pytest.mark.parametrize(
    ("width", "height"),
    [pytest.param(1280, 800, marks=pytest.mark.long), (800, 1280), pytest.param(1920, 1080, marks=pytest.mark.long)],
)
def test_nothing_hangs_over_the_edge(signed_in: Page, shop: Shop, width: int, height: int) -> None:
    page = signed_in
    page.set_viewport_size({"width": width, "height": height})
    for path in (
        "/setup/characteristics",
        "/setup/characteristics/new",
        f"/setup/characteristics/{shop.characteristic}",
        "/setup/machines",
        f"/setup/machines/{shop.machine}",
        "/setup/audit",
        "/account",
    ):
        page.goto(path)
        assert page.evaluate("document.documentElement.scrollWidth") <= width, path


def test_an_address_has_no_field_that_was_left_empty(signed_in: Page) -> None:
    page = signed_in
    page.goto("/setup/audit")
    page.fill("[name=actor]", "engineer")
    page.press("[name=actor]", "Enter")
    page.wait_for_url("**/setup/audit?*")
    assert page.url.partition("?")[2] == "actor=engineer"


def test_a_name_with_a_size_proposes_it_and_says_so_until_a_person_types(signed_in: Page) -> None:
    page = signed_in
    sizes = ("nominal", "upper_deviation", "lower_deviation")

    def name_is(name: str, *values: str) -> None:
        page.fill("[name=name]", name)
        page.locator("[name=name]").blur()
        for field, value in zip(sizes, values, strict=True):
            expect(page.locator(f"[name={field}]")).to_have_value(value)

    page.goto("/setup/characteristics/new")
    proposed = page.locator("[data-proposed]")
    expect(proposed).to_be_hidden()
    name_is("Bore 30 H7", "30", "0.021", "0")
    expect(proposed).to_be_visible()
    name_is("Bore Ø32", "32", "", "")
    name_is("Nest 3 B2", "", "", "")
    expect(proposed).to_be_hidden()
    name_is("Bohrung 30", "30", "", "")
    expect(proposed).to_be_visible()
    name_is("Bore 2", "", "", "")
    expect(proposed).to_be_hidden()
    name_is("Bore 30 H7", "30", "0.021", "0")
    page.fill("[name=upper_deviation]", "0.03")
    expect(proposed).to_be_hidden()
    name_is("Bore 40 H7", "30", "0.03", "0")


@pytest.mark.parametrize("across", [False, True], ids=["upright", "across"])
def test_on_paper_no_heading_is_left_at_the_foot_of_a_sheet(signed_in: Page, shop: Shop, across: bool) -> None:
    page = signed_in
    for address in ("/setup/characteristics/new", f"/setup/characteristics/{shop.characteristic}"):
        page.goto(address)
        headings = {text.strip() for text in page.locator("h1, h2, h3, legend").all_text_contents()}
        assert "What happens where" in headings
        for sheet in PdfReader(io.BytesIO(page.pdf(format="A4", landscape=across))).pages:
            lines = [line.strip() for line in sheet.extract_text().splitlines() if line.strip()]
            assert not lines or lines[-1] not in headings, (address, lines[-2:])
