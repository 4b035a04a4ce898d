"""The pages of program text: with and without scripts, in the real browser."""

import re
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.shop import Person, Shop

L15 = """L15
N5 R103 R115 R240 R250 R271 R281 R292 R301
N10 R33=0,0012345678901 R44=0.0053 R36=1 R37=0.3
N12 R33=R50*2
N13 R33=0.0012345678901
N15 R400 R41-0.016 R4240
N20 L75
N25 L93
N30 M17
"""


class TestReading:
    def test_pasted_text_becomes_a_characteristic(self, shop: Shop, engineer: Person, page: Page) -> None:
        engineer.sign_in(page)
        page.goto("/setup/programs")
        page.get_by_label("Program text").fill(L15)
        page.get_by_role("button", name="Read it").click()
        expect(page.locator("#lines tr[data-verdict=not_understood]")).to_have_count(1)
        expect(page.locator("#lines tr[data-verdict=not_understood]")).to_contain_text("R50*2")
        expect(page.locator("#lines tbody tr")).to_have_count(9)
        expect(page.locator("zone-diagram")).to_contain_text("39.9920")
        expect(page.get_by_text("The factor is missing")).to_be_visible()
        page.get_by_role("button", name="Make a characteristic of it").click()
        key = f"{shop.characteristic}-pasted"
        page.get_by_label("Name").fill("Pasted")
        page.get_by_label("Key").fill(key)
        page.get_by_label("Machine").select_option(shop.machine)
        page.locator("input[name=factor][value='-1']").check()
        page.get_by_role("button", name="Add characteristic").click()
        page.wait_for_url(f"**/setup/characteristics/{key}?done=added")
        made = shop.call("GET", f"/characteristics/{key}")["parameters"]
        assert (made["zero_range"], made["averaging_limit"], made["tool_memory"]) == (0.0012345678901, 0.0053, 3)

    @pytest.mark.long
    def test_a_file_gives_its_parameters_to_one_that_stands(
        self, shop: Shop, engineer: Person, page: Page, tmp_path: Path
    ) -> None:
        before = shop.call("GET", f"/characteristics/{shop.characteristic}")
        file = tmp_path / "L15.spf"
        file.write_bytes("(Sitz Ø40 außen)\r\nR33=0.0015 R29=3\r\n".encode("latin-1"))
        engineer.sign_in(page)
        page.goto("/setup/programs")
        page.get_by_label("or a file").set_input_files(file)
        page.get_by_role("button", name="Read it").click()
        page.get_by_label("or give its parameters to").select_option(shop.characteristic)
        page.get_by_role("button", name="Change it").click()
        expect(page.get_by_label("Zero range")).to_have_value("0.0015")
        assert shop.call("GET", f"/characteristics/{shop.characteristic}") == before
        page.get_by_role("button", name="Save").click()
        page.wait_for_url(f"**/setup/characteristics/{shop.characteristic}?done=changed")
        after = shop.call("GET", f"/characteristics/{shop.characteristic}")
        assert after["parameters_version"] == 2
        assert after["parameters"] == before["parameters"] | {"zero_range": 0.0015, "weighting_factor": 3.0}

    def test_without_scripts_it_is_a_plain_form(self, engineer: Person) -> None:
        text = engineer.send("/setup/programs", text=L15, do="read")
        assert text.count('<tr data-verdict="') == 9
        assert 'data-verdict="not_understood"' in text
        assert "Not understood" in text

    def test_results_are_shown_as_touches(self, engineer: Person) -> None:
        text = engineer.send("/setup/programs", text="#510=40.012\n#511=40.013\n#512=40.011", do="read")
        assert "[[40.012], [40.013], [40.011]]" in text
        assert "Make a characteristic" not in text

    def test_a_calibration_makes_no_characteristic(self, engineer: Person) -> None:
        text = engineer.send("/setup/programs", text="R115 R211 R230 R32199.852\nL92\nM17", do="create")
        assert "199.852 mm" in text
        assert "Make a characteristic" not in text

    @pytest.mark.parametrize(
        ("fields", "status"),
        [
            ({"text": ""}, 422),
            ({"text": "x" * 70_000}, 422),
            ({"text": "R33=1", "control": "nonsense"}, 200),
            ({"text": "R33=1", "do": "change", "characteristic": "nowhere"}, 404),
            ({"text": "R33=1", "do": "change", "characteristic": ""}, 404),
            ({}, 422),
        ],
    )
    def test_bad_input_is_a_page_in_words(self, engineer: Person, fields: dict[str, str], status: int) -> None:
        assert "Traceback" not in engineer.send("/setup/programs", status, **fields)

    def test_a_viewer_reads_but_makes_nothing(self, server: Any) -> None:
        viewer = Person(server, "viewer")
        assert "Make a characteristic" not in viewer.send("/setup/programs", text=L15, do="read")
        viewer.send("/setup/programs", 403, text=L15, do="create")


class TestWriting:
    @pytest.mark.long
    def test_copy_and_download(self, shop: Shop, engineer: Person, page: Page) -> None:
        engineer.sign_in(page)
        page.context.grant_permissions(["clipboard-read", "clipboard-write"])
        page.goto(f"/setup/characteristics/{shop.characteristic}")
        page.get_by_role("link", name="Program text", exact=True).last.click()  # which opens what is folded
        area = page.get_by_label("Measuring program of this characteristic")
        page.get_by_role("button", name="Copy").click()
        expect(page.get_by_role("button", name="Copied")).to_be_visible()
        assert page.evaluate("navigator.clipboard.readText()") == area.input_value()
        assert "L93" in area.input_value()
        with page.expect_download() as download:
            page.get_by_role("link", name="Download").click()
        assert download.value.suggested_filename == f"{shop.characteristic}-L15.spf"
        assert Path(download.value.path()).read_text() == area.input_value()

    def test_calibration_for_a_gauge(self, shop: Shop, engineer: Person, page: Page) -> None:
        engineer.sign_in(page)
        page.goto(f"/setup/characteristics/{shop.characteristic}/program")
        page.get_by_role("link", name="Calibration L05").click()
        page.get_by_label("Size of the gauge").fill("199,852")
        page.get_by_label("Surface").select_option("groove")
        page.get_by_role("button", name="Write it").click()
        expect(page.locator("#program-text")).to_have_value(re.compile(r"R21=0 R22=1 R23=1.*R32=199\.852", re.DOTALL))
        page.get_by_role("link", name="Fanuc").click()
        expect(page.locator("#program-text")).to_have_value(re.compile("G65 P9010"))

    def test_programs_for_the_bridge(self, shop: Shop, engineer: Person, page: Page) -> None:
        engineer.sign_in(page)
        page.goto(f"/setup/characteristics/{shop.characteristic}/program")
        page.get_by_role("link", name="For the bridge").click()
        page.get_by_role("link", name="Haas").click()
        page.get_by_label("Number in the ring").fill("7")
        page.get_by_label("Variable with the size").fill("#10188")
        page.get_by_role("button", name="Write it").click()
        expect(page.locator("#program-call")).to_have_value(re.compile(r"C7\. V#10188"))
        with page.expect_download() as arriving:
            page.get_by_role("link", name="Download").last.click()
        assert "V#10188" in Path(arriving.value.path()).read_text()

    def test_what_is_no_number_for_the_ring_is_said(self, shop: Shop, engineer: Person) -> None:
        address = f"/setup/characteristics/{shop.characteristic}/program?kind=ring&control=haas"
        refused = engineer.open(f"{address}&number=0.5")
        assert "Must be a number from 1 to 9999" in refused
        assert 'id="program-call"' not in refused, "nobody loads a program with a number that he did not give"
        assert "Must leave 550 to 603 free" in engineer.open(f"{address}&first_register=500")
        assert "Must be a variable of the control" in engineer.open(f"{address}&measured=1;M30")
        engineer.open(f"{address}&number=NaN&time_out=1e99&largest_step=x&go_on=q&control=heidenhain")

    def test_what_is_no_size_is_said(self, shop: Shop, engineer: Person) -> None:
        for gauge in ("large", "-1", "1e9", "NaN"):
            text = engineer.open(f"/setup/characteristics/{shop.characteristic}/program?kind=calibration&gauge={gauge}")
            assert "Must be a size in mm" in text
        engineer.open("/setup/characteristics/nowhere/program", 404)
        engineer.open(f"/setup/characteristics/{shop.characteristic}/program?control=x&kind=y&surface=z&probe=q")

    def test_a_control_without_measuring_programs_offers_the_others(self, shop: Shop, engineer: Person) -> None:
        shop.call("PATCH", f"/machines/{shop.machine}", control="heidenhain")
        assert 'id="program-text"' not in engineer.open(f"/setup/characteristics/{shop.characteristic}")
        assert "L93" in engineer.open(f"/setup/characteristics/{shop.characteristic}/program")


def test_an_edge_finders_macro_fills_in_the_form_of_a_work_zero(operator: Person) -> None:
    """Work offset, tip and feeler go on to where they are needed; a feeler that the macro would refuse is warned of."""
    macro = "#2=0.1\n#501=#5021\n#502=#5021\n#503=[#501+#502]/2\n#5241=#503\n#511=ABS[#502-#501]-6"
    page = operator.send("/setup/programs", text=macro, control="fanuc")
    address = re.search(r'href="(/work-zeros/new[^"]*)"', page)
    assert address is not None
    form = operator.open(address[1].replace("&amp;", "&"))
    for name, value in (("work_offset", "G55"), ("tip", "6"), ("feeler", "0.1")):
        assert re.search(rf'<input[^>]*name="{name}"[^>]*value="{value}"', form), name
    warned = operator.send("/setup/programs", text=macro.replace("0.1", "5."), control="fanuc")
    assert "raises an alarm outside 0 to 1 mm" in warned
