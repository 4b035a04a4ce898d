"""The page of a characteristic and of a reading: as plain HTML, and live in a real browser."""

import re
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.loop.readings.importing.test_history import run, table
from tests.pages.looks import drawn, live, until_shown
from tests.shop import PARAMETERS, Person, Shop
from tests.waits import until

pytestmark = pytest.mark.own_server  # begins at the plant page, which shows every alarm of the plant

PLOT = "document.querySelector('plotly-chart.zones .plot')"
PLACE_OF_SECOND = """() => {
    const point = document.querySelectorAll("plotly-chart.zones .scatterlayer .trace .points path")[1];
    point.scrollIntoView({ block: "center", behavior: "instant" });
    const box = point.getBoundingClientRect();
    return [box.x + box.width / 2, box.y + box.height / 2];
}"""
XSS = """<b>"Кључ" d'Ø</b>"""


def eventually(page: Page, condition: str) -> None:
    """Until this is true in the page. Playwright's own way needs eval, which our policy forbids."""
    until(lambda: page.evaluate(condition))


def path(shop: Shop, rest: str = "") -> str:
    return f"/characteristics/{shop.characteristic}{rest}"


class TestWithoutScripts:
    def test_it_waits_for_its_first_reading(self, shop: Shop, viewer: Person) -> None:
        text = viewer.open(path(shop))
        assert "No readings yet" in text
        assert "waits for its first reading" in text

    def test_decisions_newest_first_with_their_reasons(self, shop: Shop, viewer: Person) -> None:
        shop.read(0.4)
        number = shop.read(6.1)["correction"]["number"]
        text = viewer.open(path(shop))
        assert re.findall(r'id="reading-(\d+)"', text) == ["2", "1"]
        assert "Deviation +6.1 µm is beyond the averaging limit 5.0 µm: corrected in full." in text
        assert f"Correction {number}" in text
        assert "−6.1\xa0µm" in text
        assert "version 1" in text

    def test_the_card_speaks_of_one_reading(self, shop: Shop, viewer: Person, tmp_path: Path) -> None:
        shop.read(6.1)
        run(shop.server.database, table(tmp_path / "old.csv", [39.9992]), shop.characteristic)
        first = viewer.open(path(shop)).split('class="card charts"')[0]
        assert "+6.1" in first
        assert "40.0061" in first
        assert "39.9992" not in first
        assert "Why: reading 1." in first

    def test_the_spread_is_said_without_parts_of_a_worn_tool_too(self, shop: Shop, viewer: Person) -> None:
        shop.push([1.0, 2.0, 3.0])
        assert "worn tool" not in viewer.open(path(shop))
        shop.read(390.0)
        text = viewer.open(path(shop))
        assert "without 1 of a worn tool +2.00\xa0µm" in text
        assert "without 1 of a worn tool 1.00\xa0µm" in text

    def test_the_period_goes_along_to_the_other_pages(self, shop: Shop, viewer: Person) -> None:
        shop.read(0.4)
        for page in ("", "/control", "/rules", "/capability", "/what-if", "/report"):
            text = viewer.open(path(shop, f"{page}?last=all&from=&to="))
            links = re.findall(rf'<a href="({path(shop)}[^"]*)"', text)
            for other in ("", "/control", "/capability", "/what-if", "/report"):
                assert path(shop, f"{other}?last=all") in links, (page, other)
            assert '/rules?last=all"' in text

    def test_a_period_can_be_kept_for_the_session(self, shop: Shop, viewer: Person) -> None:
        shop.push([0.4, 0.5, 0.6])
        chosen = f'href="{path(shop, "?last=50")}" aria-current="true"'
        assert chosen not in viewer.open(path(shop))
        assert "Keep for this session" in viewer.open(path(shop, "?last=50"))
        viewer.open(path(shop, "?last=50&keep=yes"))
        text = viewer.open(path(shop))
        assert chosen in text
        assert "Only here, not for the session" in text
        assert "last=50" in viewer.open(path(shop, "/what-if"))
        assert 'last=200" aria-current="true"' in viewer.open(path(shop, "?last=200")), "what is said goes before"
        viewer.open(path(shop, "?keep=no"))
        assert chosen not in viewer.open(path(shop))

    def test_what_to_do_next_and_why_stand_first(self, shop: Shop, viewer: Person) -> None:
        shop.read(0.2)
        first = viewer.open(path(shop)).split('class="card charts"')[0]
        assert "Nothing to do" in first
        assert "Why: reading 1." in first
        shop.read(12.5)
        first = viewer.open(path(shop)).split('class="card charts"')[0]
        assert f'href="/alarms/{shop.alarms()[0]["id"]}">Set the part aside</a>' in first

    def test_the_panel_tells_part_and_context(self, shop: Shop, viewer: Person) -> None:
        shop.read(0.4, part=XSS, context={"order": "A-77", "nest": 2})
        panel = viewer.open(path(shop, "/readings/1/panel"))
        assert "<dd>A-77</dd>" in panel
        assert "<dd>2</dd>" in panel
        of_part = re.search(r'<dt>Part</dt><dd><a href="([^"]+)">', panel)
        assert of_part is not None
        for text in (viewer.open(path(shop, "/readings/1")), viewer.open(path(shop))):
            assert of_part[0] in text
        assert f"{path(shop)}/readings/1" in viewer.open(of_part[1])

    def test_pages_of_decisions(self, shop: Shop, viewer: Person) -> None:
        batch = [{"characteristic": shop.characteristic, "measured": 40.0} for _ in range(30)]
        assert shop.admin.post("/api/v1/readings/batch", json=batch).status_code == 201
        text = viewer.open(path(shop, "?last=50"))
        assert re.findall(r'id="reading-(\d+)"', text) == [str(n) for n in range(30, 5, -1)]
        older = re.search(r'href="([^"]+)#decisions" rel="next"', text)
        assert older is not None
        rest = viewer.open(older[1].replace("&amp;", "&"))
        assert re.findall(r'id="reading-(\d+)"', rest) == ["5", "4", "3", "2", "1"]
        assert "figures/zones?last=50" in rest

    def test_the_numbers_beside_the_chart(self, shop: Shop, viewer: Person) -> None:
        for deviation in (1.0, -1.0, 12.0):
            shop.read(deviation)
        text = viewer.open(path(shop))
        assert "+4.00\u00a0µm" in text
        assert "66.7\u00a0%" in text

    def test_what_was_decided_on_another_value_says_so(self, shop: Shop, viewer: Person) -> None:
        shop.read(20.0)
        shop.read(20.5, correction_in_effect=0)
        assert "+0.5 after pending corrections" in viewer.open(path(shop))
        text = viewer.open(path(shop, "/readings/2"))
        assert "The part was cut before correction" in text
        assert "Decided on" in text

    def test_touches_that_are_missing(self, shop: Shop, viewer: Person) -> None:
        key = shop.another("bore", variant="indexed", repeats=2, index=180, average_memory=0)
        for touches, words in (([[None, 40.001], []], "none"), ([], "The probe touched nothing.")):
            sequence = shop.call("POST", "/readings", 201, characteristic=key, touches=touches)["sequence"]
            assert words in viewer.open(f"/characteristics/{key}/readings/{sequence}")
        assert "is missing" in viewer.open(f"/characteristics/{key}")

    def test_touches_and_parameters_of_the_time(self, shop: Shop, viewer: Person) -> None:
        shop.call("PATCH", path(shop), parameters={"repeats": 2, "variant": "round", "points": 2}, reason="two points")
        touches = [[40.001, 40.003], [39.999, 40.001]]
        answer = shop.admin.post("/api/v1/readings", json={"characteristic": shop.characteristic, "touches": touches})
        assert answer.status_code == 201, answer.text
        shop.call("PATCH", path(shop), parameters={"zero_range": 0.002}, reason="calmer machine")
        text = viewer.open(path(shop, "/readings/1"))
        assert '40.0030<span class="unit">mm' in text
        assert '40.00200<span class="unit">mm' in text
        assert "Judged by version 2" in text
        assert "two points" in text
        assert "0.001 mm" in text
        history = viewer.open(path(shop))
        assert "<del>0.001 mm</del> → <ins>0.002 mm</ins>" in history
        assert "calmer machine" in history

    def test_an_operator_excludes_with_a_reason(self, shop: Shop, operator: Person) -> None:
        shop.read(0.4)
        where = path(shop, "/readings/1")
        assert "Must not be empty" in operator.send(f"{where}/exclude", 422, reason=" ")
        assert "chip on the stylus" in operator.send(f"{where}/exclude", reason="chip on the stylus")
        again = operator.send(f"{where}/exclude", 409, reason="again")
        assert "was excluded by" in again
        assert shop.call("GET", f"/characteristics/{shop.characteristic}/statistics")["count"] == 0

    def test_a_viewer_does_not(self, shop: Shop, viewer: Person) -> None:
        shop.read(0.4)
        assert "/exclude" not in viewer.open(path(shop, "/readings/1"))
        assert "needs the role operator" in viewer.send(path(shop, "/readings/1/exclude"), 403, reason="why not")

    @pytest.mark.parametrize(
        ("rest", "status"),
        [
            ("/readings/1", 404),
            ("/readings/0", 422),
            ("/readings/99999999999999999999", 422),
            ("?last=some", 422),
            ("?scale=log", 422),
            ("?first=5&through=2", 422),
            ("?before=0", 422),
        ],
    )
    def test_a_wrong_address_is_answered_in_words(self, shop: Shop, viewer: Person, rest: str, status: int) -> None:
        text = viewer.open(path(shop, rest), status)
        assert "<h1" in text
        assert "Traceback" not in text

    def test_a_part_of_the_page_is_fetched_alone(self, shop: Shop, viewer: Person) -> None:
        shop.read(0.4)
        part = viewer.browser.get(path(shop), headers={"X-Live-Part": "decisions"}).text
        assert 'id="decisions"' in part
        assert 'id="now"' not in part


class TestInTheBrowser:
    def test_a_push_moves_chart_and_decisions_without_a_reload(self, shop: Shop, viewer: Person, page: Page) -> None:
        shop.read(0.4)
        viewer.sign_in(page)
        page.goto(path(shop))
        expect(page.locator("plotly-chart.zones .main-svg").first).to_be_visible()
        eventually(page, f"{PLOT}.data?.length > 0")
        live(page)
        page.evaluate("window.untouched = true")
        shop.read(6.1)
        eventually(page, f"{PLOT}.data.find(t => t.meta === 'readings').x.length === 2")
        expect(page.locator("#reading-2")).to_contain_text("+6.1")
        expect(page.locator("#now")).to_contain_text("Correcting")
        expect(page.locator("#numbers dd").first).to_have_text("2")
        assert page.evaluate("window.untouched")

    def test_the_whole_plot_is_on_the_screen_in_every_state(self, shop: Shop, viewer: Person, page: Page) -> None:
        shop.push([0.4, 6.1, 12.5])  # a correction and an alarm
        viewer.sign_in(page)
        page.set_viewport_size({"width": 1280, "height": 800})
        page.goto(path(shop))
        expect(page.locator("plotly-chart.zones")).to_have_attribute("tabindex", "0")
        box = f"{PLOT}.getBoundingClientRect()"
        eventually(page, f"{box}.bottom <= innerHeight && {box}.width > 1200")
        shop.read(1500.0)  # a probe fault: compensation is paused
        expect(page.locator("#now")).to_contain_text("Compensation is paused")
        eventually(page, f"{box}.bottom <= innerHeight")

    def test_a_correction_that_comes_moves_nothing(self, shop: Shop, viewer: Person, page: Page) -> None:
        """The chart is as high with it as without, and all of it stays on the screen."""
        shop.push([0.4, 0.2])
        viewer.sign_in(page)
        page.set_viewport_size({"width": 1280, "height": 800})
        page.goto(path(shop))
        drawn(page)
        live(page)
        box = f"(({{ top, bottom }}) => [top, bottom])({PLOT}.getBoundingClientRect())"
        before = page.evaluate(box)
        shop.read(6.1)
        expect(page.locator("#now .pending")).to_contain_text("−6.1 µm")
        drawn(page)
        assert page.evaluate(box) == before
        assert before[1] <= 800

    @pytest.mark.long
    def test_a_click_on_a_point_shows_its_reading_and_the_link_opens_it(
        self, shop: Shop, viewer: Person, page: Page
    ) -> None:
        shop.read(0.4, part="SN-17")
        number = shop.read(6.1, part="SN-18")["correction"]["number"]
        viewer.sign_in(page)
        page.goto(path(shop))
        drawn(page)
        panel = page.locator("plotly-chart.zones .chart-panel")
        until_shown(panel, lambda: page.mouse.click(*page.evaluate(PLACE_OF_SECOND)))
        expect(panel).to_contain_text("beyond the averaging limit 5.0 µm: corrected in full.")
        expect(panel).to_contain_text(f"Correction {number}")
        expect(panel).to_contain_text("SN-18")
        panel.get_by_role("link", name="Reading before").click()
        expect(panel).to_contain_text("SN-17")
        expect(panel).to_contain_text("version 1")
        panel.get_by_role("link", name="Open reading 1").click()
        page.wait_for_url("**/readings/1")

    def test_an_opened_decision_stays_open_when_a_new_one_arrives(self, shop: Shop, viewer: Person, page: Page) -> None:
        shop.read(6.1)
        viewer.sign_in(page)
        page.goto(path(shop) + "#decisions")
        page.locator("#reading-1 summary").click()
        expect(page.locator("#reading-1 .reason")).to_be_visible()
        live(page)
        shop.read(0.2)
        expect(page.locator("#reading-2")).to_be_visible()
        expect(page.locator("#reading-1 .reason")).to_be_visible()

    def test_excluding_by_hand(self, shop: Shop, operator: Person, page: Page) -> None:
        shop.read(6.1)
        operator.sign_in(page)
        page.goto(path(shop, "/readings/1"))
        page.get_by_role("button", name="Exclude from the statistics").click()
        page.get_by_label("Reason").fill("chip on the stylus")
        page.get_by_role("button", name="Exclude", exact=True).click()
        expect(page.locator("#reading")).to_contain_text("chip on the stylus")

    @pytest.mark.long
    def test_scale_and_number_are_in_the_address(self, shop: Shop, viewer: Person, page: Page) -> None:
        shop.read(6.1)
        viewer.sign_in(page)
        page.goto(path(shop))
        page.get_by_role("link", name="True scale").click()
        page.wait_for_url("**scale=true**")
        page.get_by_role("link", name="50", exact=True).click()
        page.wait_for_url(lambda url: "last=50" in url and "scale=true" in url)
        page.get_by_role("link", name="Over time").click()
        eventually(page, f"{PLOT}?.data?.some(t => t.meta === 'run')")

    def test_names_are_text_everywhere(self, shop: Shop, operator: Person, page: Page) -> None:
        key = f"{shop.characteristic}-x"
        body: dict[str, Any] = {"key": key, "machine": shop.machine, "name": XSS, "part": XSS, "parameters": PARAMETERS}
        shop.call("POST", "/characteristics", 201, **body)
        shop.read(6.1, key, part=XSS, key=XSS)
        shop.call("POST", f"/readings/{key}/1/exclude", reason=XSS)
        shop.read(350.0, key)  # the front page names what needs somebody
        operator.sign_in(page)
        for where in ("/", f"/characteristics/{key}", f"/characteristics/{key}/readings/1"):
            page.goto(where)
            expect(page.locator("main")).to_contain_text(XSS)
            assert page.locator("main b", has_text="Кључ").count() == 0


def test_decisions_and_versions_are_folded_until_an_address_names_them(page: Page, shop: Shop, viewer: Person) -> None:
    shop.read(0.2)
    viewer.sign_in(page)
    page.goto(path(shop))
    decision, versions = page.locator("#reading-1"), page.locator("#versions")
    expect(page.locator("#now")).to_contain_text("Why: reading 1.")
    expect(decision).to_be_hidden()
    expect(versions).to_be_hidden()
    page.get_by_role("heading", name="Decisions").click()
    expect(decision).to_be_visible()
    for name, shown in (("versions", versions), ("reading-1", decision)):
        page.goto("about:blank")
        page.goto(f"{path(shop)}#{name}")
        expect(shown).to_be_visible()


@pytest.mark.browser
def test_words_in_the_bands_give_way_where_the_chart_is_too_low(shop: Shop, viewer: Person, page: Page) -> None:
    shop.read(0.4)
    viewer.sign_in(page)
    shown = {}
    for height in (600, 1100):
        page.set_viewport_size({"width": 1280, "height": height})
        page.goto(path(shop))
        expect(page.locator("plotly-chart.zones .annotation").first).to_be_attached()
        until(lambda: page.locator("plotly-chart.zones").evaluate("chart => chart.drawn === true"))
        words = page.locator("plotly-chart.zones .annotation")
        shown[height] = [
            sum(each.is_visible() for each in words.filter(has_text=text).all())
            for text in ("corrected in full", "averaging limit")
        ]
    assert shown == {600: [0, 2], 1100: [4, 2]}
