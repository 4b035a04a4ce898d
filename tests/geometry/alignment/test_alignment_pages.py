"""Aligning in a real browser: six touches typed in give the frame; the touch that does not fit is named and left out."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.shop import Person, Shop

PLACES = [
    ("10", "10", "0", "+Z"),
    ("180", "15", "0", "+Z"),
    ("90", "120", "0", "+Z"),
    ("20", "0", "-15", "-Y"),
    ("170", "0", "-15", "-Y"),
    ("0", "60", "-15", "-X"),
    ("30", "125", "0", "+Z"),
    ("150", "110", "0", "+Z"),
]
FOUND = ("0.012", "0.046", "0.021", "0.104", "-0.205", "0.051")


def six(machine: str, **more: str) -> dict[str, Any]:
    """The form with the six points typed in."""
    typed: dict[str, Any] = {"machine": machine, "kind": "points", "rows": "6", "found": "deviation"}
    for at, ((x, y, z, face), off) in enumerate(zip(PLACES, FOUND, strict=False)):
        typed |= {f"x{at}": x, f"y{at}": y, f"z{at}": z, f"n{at}": face, f"d{at}": off}
    return typed | more


def number_of(page: str) -> str:
    found = re.search(r"/api/v1/alignments/(\d+)/figure", page)
    assert found is not None
    return found[1]


class TestInABrowser:
    def test_someone_with_six_touches_has_the_frame(self, shop: Shop, operator: Person, page: Page) -> None:
        operator.sign_in(page)
        page.goto("/alignments")
        page.get_by_role("link", name="Align a part").first.click()
        page.wait_for_url("**/alignments/new**")  # and for its scripts
        page.get_by_label("Machine").select_option(shop.machine)
        page.get_by_label("Name of the set-up").fill("pallet 4")
        page.get_by_label("Repeatability").fill("2")
        first = page.get_by_label("Point 1, X")
        first.focus()
        block = "\n".join("\t".join([*place, off]) for place, off in zip(PLACES, FOUND, strict=False))
        page.evaluate(
            """text => { const data = new DataTransfer(); data.setData("text/plain", text);
            document.activeElement.dispatchEvent(new ClipboardEvent("paste", {clipboardData: data, bubbles: true, cancelable: true})) }""",
            block,
        )
        expect(page.get_by_label("Point 6, deviation")).to_have_value("0.051")
        page.get_by_role("button", name="Align and save").click()
        expect(page.get_by_role("heading", level=1)).to_contain_text("pallet 4")
        readouts = page.locator(".readouts")
        expect(readouts).to_contain_text("+0.1180")  # the turn about Z: (0.205 + 0.104)/150
        expect(page.locator("main")).to_contain_text("The points locate the part well")
        expect(page.locator("main")).to_contain_text("One more point near")
        expect(page.get_by_label("Text for Sinumerik")).to_have_value(re.compile(r"CTRANS\(X,.*:CROT\("))
        expect(page.locator("plotly-chart .main-svg").first).to_be_visible()
        expect(page.locator("table.touches tbody tr")).to_have_count(6)

        # The same pallet again, a little elsewhere: its history has both.
        page.get_by_role("link", name="Align again").click()
        expect(page.get_by_label("Point 6, X")).to_have_value("0")
        for at, off in enumerate(FOUND, 1):
            page.get_by_label(f"Point {at}, deviation").fill(str(round(float(off) + 0.01, 3)))
        page.get_by_role("button", name="Align and save").click()
        page.get_by_role("link", name="History of pallet 4").click()
        expect(page.locator("tbody tr")).to_have_count(2)
        expect(page.locator("plotly-chart .main-svg").first).to_be_visible()

    @pytest.mark.long
    def test_the_touch_that_does_not_fit_is_named_and_left_out(self, shop: Shop, operator: Person, page: Page) -> None:
        operator.sign_in(page)
        page.goto(f"/alignments/new?machine={shop.machine}")
        page.get_by_label("Repeatability").fill("1")
        page.get_by_text("Paste points").click()
        offs = ("0.1", "0.1", "0.1", "0", "0.3", "0.02", "0.15", "0.1")
        page.get_by_label("Lines").fill(
            "\n".join(" ".join([*place, off]) for place, off in zip(PLACES, offs, strict=True))
        )
        page.get_by_role("button", name="Align and save").click()
        expect(page.get_by_role("alert")).to_contain_text("Touch 7 does not fit the others")
        expect(page.locator("table.touches tr[data-tone=attention]")).to_have_count(1)
        expect(page.get_by_label("Points to leave out")).to_have_value("7")
        page.get_by_label("Reason").fill("burr")
        page.get_by_role("button", name="Compute again").click()
        expect(page.locator("table.touches tbody tr")).to_have_count(7)
        expect(page.get_by_text("Computed again from the points of")).to_be_visible()


class TestWithoutScripts:
    def test_a_warning_is_acknowledged_and_the_text_runs(self, shop: Shop, operator: Person) -> None:
        page = operator.send("/alignments/new", **six(shop.machine, d2="500"))
        number = number_of(page)
        assert "is it a typing error?" in page.lower()
        assert "GOTOB INBAND_STOP" in page
        page = operator.send(f"/alignments/{number}/acknowledge", 422, reason=" ")
        assert "GOTOB INBAND_STOP" in page
        page = operator.send(f"/alignments/{number}/acknowledge", reason="stands so on purpose")
        assert "stands so on purpose" in page
        assert operator.name in page
        assert "INBAND_STOP" not in page
        operator.send(f"/alignments/{number}/acknowledge", 409, reason="again")

    def test_the_touched_point_in_place_of_its_deviation(self, shop: Shop, operator: Person) -> None:
        typed = six(shop.machine, found="measured", tip="0")
        for at, (off, (x, y, z, face)) in enumerate(zip(FOUND, PLACES, strict=False)):
            place = dict(zip("XYZ", map(float, (x, y, z)), strict=True))
            place[face[1]] += float(off) * (1 if face[0] == "+" else -1)
            typed |= {f"m{axis.lower()}{at}": f"{value:.6f}".replace(".", ",") for axis, value in place.items()}
        by_point = shop.call("GET", f"/alignments/{number_of(operator.send('/alignments/new', **typed))}")
        by_deviation = shop.call(
            "GET", f"/alignments/{number_of(operator.send('/alignments/new', **six(shop.machine)))}"
        )
        assert by_point["angles"] == pytest.approx(by_deviation["angles"], abs=1e-7)
        assert by_point["shift"] == pytest.approx(by_deviation["shift"], abs=1e-7)

    def test_two_points_and_the_table_takes_the_turn(self, shop: Shop, operator: Person) -> None:
        page = operator.send(
            "/alignments/new",
            machine=shop.machine,
            kind="two_points",
            s1_x="0",
            s1_y="0",
            s1_mx="0",
            s1_my="0,1",
            s2_x="100",
            s2_y="0",
            s2_mx="100",
            s2_my="0,3",
            table="true",
            table_axis="C",
            table_position="90",
        )
        assert "C 90.1146°" in page
        assert "G0 C=DC(90.1145" in page

    def test_two_holes_one_by_touches(self, shop: Shop, operator: Person) -> None:
        page = operator.send(
            "/alignments/new",
            machine=shop.machine,
            kind="two_holes",
            tip="2",
            h1_x="0",
            h1_y="0",
            h1_touches="5 0,01\n0 5,01\n-5 0,01\n0 -4,99",
            h2_x="100",
            h2_y="0",
            h2_mx="100.02",
            h2_my="0.01",
        )
        assert "deviates by +20.0 µm" in page
        assert "12.0000" in page  # the first hole's diameter: 10 and the tip

    def test_a_part_on_a_pallet(self, shop: Shop, operator: Person) -> None:
        pallet, part = (number_of(operator.send("/alignments/new", **six(shop.machine, name=name))) for name in "ab")
        page = operator.send("/alignments/pallets/new", pallet=pallet, part=part, name="both")
        made = shop.call("GET", f"/alignments/{number_of(page)}")
        single = shop.call("GET", f"/alignments/{pallet}")
        assert made["angles"]["z"] == pytest.approx(2 * single["angles"]["z"], abs=1e-5)
        assert "Composed of" in page
        assert "itself" in operator.send("/alignments/pallets/new", 422, pallet=pallet, part=pallet)
        assert "no alignment 999999" in operator.send("/alignments/pallets/new", 404, pallet="999999", part=part)

    @pytest.mark.parametrize(
        ("more", "words"),
        [
            ({f"y{at}": f"{at * 10}" for at in range(3)} | {f"x{at}": f"{at * 10}" for at in range(3)}, "one line"),
            ({"n0": "up"}, "no direction"),
            ({"d2": "abc"}, "deviation"),
            ({"d2": ""}, "ay deviation or measured"),
            ({"x1": "nan"}, "number"),
            ({"lines": "1 2 3 +Z"}, "line 1 is not a valid point"),
            ({"work_offset": "G54"}, "base"),
            ({"machine": "nowhere"}, "no machine"),
            ({"repeatability": "-1"}, "greater than 0"),
        ],
    )
    def test_what_is_wrong_is_reported_and_nothing_typed_is_lost(
        self, shop: Shop, operator: Person, more: dict[str, str], words: str
    ) -> None:
        before = len(shop.call("GET", f"/alignments?machine={shop.machine}&limit=1000")["items"])
        page = operator.send("/alignments/new", 422 if "machine" not in more else 404, **(six(shop.machine) | more))
        assert words in page
        for name, value in more.items():
            assert f'name="{name}"' in page
            assert value in page
        assert 'value="-0.205"' in page
        assert len(shop.call("GET", f"/alignments?machine={shop.machine}&limit=1000")["items"]) == before

    def test_the_cell_that_is_wrong_is_marked_and_no_other(self, shop: Shop, operator: Person) -> None:
        page = operator.send("/alignments/new", 422, **(six(shop.machine) | {"z0": "zehn", "d2": "-"}))
        assert re.findall(r'<input name="(\w+)"[^>]* aria-invalid', page) == ["z0", "d2"]

    def test_more_lines_keep_what_stands_there(self, shop: Shop, operator: Person) -> None:
        page = operator.send("/alignments/new", **six(shop.machine, do="grid"))
        assert 'name="x11"' in page
        assert 'value="-0.205"' in page

    def test_names_with_quotes_and_slashes_have_a_history(self, shop: Shop, operator: Person) -> None:
        name = "Шасија “5/8” & č"
        operator.send("/alignments/new", **six(shop.machine, name=name))
        assert "Шасија" in operator.open(
            f"/alignments/history?machine={shop.machine}&name=%D0%A8%D0%B0%D1%81%D0%B8%D1%98%D0%B0%20%E2%80%9C5%2F8%E2%80%9D%20%26%20%C4%8D"
        )
        operator.open(f"/alignments/history?machine={shop.machine}&name=nothing", 404)
        viewer = Person(shop.server, "viewer")
        assert "Шасија" in viewer.open("/alignments")
        viewer.open("/alignments/new", 403)

    def test_shifts_become_readings_at_once(self, shop: Shop, operator: Person) -> None:
        pallet = f"{shop.characteristic}-z"
        shop.add(pallet, target=0.0, tool_memory=0, average_memory=0, mode="measure_only")
        page = operator.send("/alignments/new", **six(shop.machine, as_c=pallet))
        assert f"/characteristics/{pallet}/readings/1" in page
        assert shop.alarms()  # 10 µm and more: beyond the tolerance of 8


class TestPictures:
    def test_every_kind_is_drawn_in_both_themes_and_as_text(self, shop: Shop, operator: Person) -> None:
        number = number_of(operator.send("/alignments/new", **six(shop.machine, name="drawn")))
        for theme in ("light", "dark"):
            drawn = shop.call("GET", f"/alignments/{number}/figure?theme={theme}")
            names = {trace.get("name") for trace in drawn["data"]}
            assert {"Nominal position", "Probed points"} <= names
            assert any(name and name.startswith("Measured position, ") for name in names)
            assert len(drawn["layout"]["annotations"]) == 6
            trend = shop.call("GET", f"/machines/{shop.machine}/alignments/figure?name=drawn&theme={theme}")
            assert {trace["name"] for trace in trend["data"] if trace["showlegend"]} == {"X", "Y", "Z"}
        shop.call("GET", f"/machines/{shop.machine}/alignments/figure?name=nothing", 404)
        for control, word in ((None, "$P_PFRAME"), ("fanuc", "G68"), ("sinumerik", "CTRANS")):
            text = shop.admin.get(f"/api/v1/alignments/{number}/program" + (f"?control={control}" if control else ""))
            assert (text.status_code, word in text.text) == (200, True)
