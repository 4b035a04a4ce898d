"""The pages of gauge studies: forms sent without scripts, and stories in Chromium."""

import re
from typing import Any

import pytest
from playwright.sync_api import Page, expect

from tests.quality.gauge_studies.test_studies import aiag, send, single
from tests.shop import Person, Shop


def form(shop: Shop, kind: str, **fields: str) -> dict[str, str]:
    begun = {"kind": kind, "machine": shop.machine, "characteristic": shop.characteristic, "gauge": "Probe T8"}
    return begun | {"do": "store", "reference": "40", "tolerance": "0,016"} | fields


def table(decimal: str = ",", between: str = "\t", heading: bool = True) -> str:
    """The published study as a spreadsheet with a Serbian or German setting hands it over."""
    by_part: dict[str, list[str]] = {}
    for row in aiag(0.001, 40.0):
        by_part.setdefault(row["part"], []).extend(f"{value:.5f}".replace(".", decimal) for value in row["values"])
    lines = [between.join([f"Deo {part}", *values]) for part, values in by_part.items()]
    return (
        "\r\n".join([between.join(["Deo", *["A", "A", "A", "B", "B", "B", "C", "C", "C"]])] * heading + lines) + "\r\n"
    )


def cell(page: str, name: str) -> str:
    found = re.search(rf'<input name="{name}" value="([^"]*)"', page)
    assert found, name
    return found[1]


def newest(shop: Shop) -> Any:
    return shop.call("GET", f"/gauge-studies?machine={shop.machine}")["items"][0]


class TestTyped:
    def test_a_type_1_study_typed_with_decimal_commas(self, shop: Shop, operator: Person) -> None:
        assert "What do you want to know?" in operator.open(f"/gauges/new?characteristic={shop.characteristic}")
        empty = operator.open(f"/gauges/new?kind=type_one&characteristic={shop.characteristic}")
        assert 'value="0.016"' in empty
        cells = {f"c_{n // 10}_{n % 10}": f"40,000{n % 3}" for n in range(30)}
        page = operator.send("/gauges/new", 200, **form(shop, "type_one", **cells))
        assert "The study is stored." in page
        study = newest(shop)
        assert study["rows"][0]["values"][:4] == [40.0, 40.0001, 40.0002, 40.0]
        assert study["type_one"]["tolerance"] == 0.016
        assert "Advice for R33" in page
        limit = "at least 1.33 (VDA 5); 30 values, 20\N{NO-BREAK SPACE}% of the tolerance against 6 s"
        assert [verdict["limit"] for verdict in study["verdicts"][:2]] == [limit, limit]
        assert limit in operator.open(f"/gauges?characteristic={shop.characteristic}")

    def test_the_machine_is_that_of_the_characteristic(self, shop: Shop, operator: Person) -> None:
        other = Shop(shop.server)
        chosen = form(shop, "type_one", machine=other.machine, do="grid", reference="", tolerance="")
        page = operator.send("/gauges/new", 200, **chosen)
        assert f'value="{shop.characteristic}" selected' in page, "it is not lost"
        assert f'value="{shop.machine}" selected' in page
        for name, value in (("tolerance", "0.016"), ("reference", "40")):
            assert re.search(rf'name="{name}" type="text"\s+value="{value}"', page), name
        cells = {f"c_{n // 10}_{n % 10}": f"40,000{n % 3}" for n in range(30)}
        operator.send("/gauges/new", 200, **form(shop, "type_one", machine=other.machine, **cells))
        assert newest(shop)["characteristic"] == shop.characteristic

    def test_what_is_wrong_is_named_and_what_was_typed_stays(self, shop: Shop, operator: Person) -> None:
        cells = {"c_0_0": "40,1", "c_0_1": "forty", "c_0_2": "40,2", "name_0": "Šipka “1”", "c_0_4": "40,3"}
        page = operator.send("/gauges/new", 422, **form(shop, "grr", **cells))
        assert "“forty” is not a number" in page
        assert "column B 1 is empty" in page or "row Šipka “1”, column B 1 is empty" in page
        assert (cell(page, "c_0_1"), cell(page, "c_0_2"), cell(page, "name_0")) == ("forty", "40,2", "Šipka “1”")
        assert shop.call("GET", f"/gauge-studies?machine={shop.machine}")["items"] == []
        page = operator.send("/gauges/new", 422, **form(shop, "type_one", gauge=" ", c_0_0="40", c_0_1="41"))
        assert cell(page, "c_0_1") == "41"

    def test_unequal_cells_are_named_and_cut_where_that_is_chosen(self, shop: Shop, operator: Person) -> None:
        rows = aiag(0.001, 40.0)
        cells = {
            f"c_{int(row['part']) - 1}_{'ABC'.index(row['operator']) * 3 + trial}": f"{value:.5f}"
            for row in rows
            for trial, value in enumerate(row["values"])
        }
        cells.pop("c_4_5")
        page = operator.send("/gauges/new", 422, **form(shop, "grr", **cells))
        assert "art 5 by B has 2 values, others have 3" in page
        page = operator.send("/gauges/new", 200, **form(shop, "grr", unbalanced="fewest", **cells))
        assert "29 values beyond the fewest of a cell are left out" in page
        cells |= {"c_4_3": "", "c_4_4": ""}
        page = operator.send("/gauges/new", 422, **form(shop, "grr", **cells))
        assert "art 5 was not measured by B" in page

    def test_nothing_typed_and_too_much_asked_for(self, shop: Shop, operator: Person) -> None:
        assert "ype the values" in operator.send("/gauges/new", 422, **form(shop, "grr"))
        for wrong in (
            {"lines": "1000000"}, {"lines": "-1"}, {"lines": "x"}, {"trials": "0"}, {"operators": "A, A"}, {"operators": ","},
        ):  # fmt: skip
            operator.send("/gauges/new", 422, **form(shop, "grr", do="grid", **wrong))
        operator.send("/gauges/new", 404, **form(shop, "type_two"))
        nowhere = {"machine": "nowhere", "characteristic": ""}
        operator.send("/gauges/new", 404, **form(shop, "grr", **nowhere, operators="A", c_0_0="1", c_0_1="2"))

    def test_equal_values_and_one_operator(self, shop: Shop, operator: Person) -> None:
        cells = {f"c_{part}_{trial}": f"{40 + part}" for part in range(3) for trial in range(2)}
        page = operator.send("/gauges/new", 200, **form(shop, "grr", operators="A", trials="2", lines="3", **cells))
        assert "All values are the same" not in page.partition("verdicts")[0] or newest(shop)["refused"]
        cells["c_0_0"] = "40,001"
        page = operator.send("/gauges/new", 200, **form(shop, "grr", operators="A", trials="2", lines="3", **cells))
        assert "reproducibility cannot be determined" in page


class TestPasted:
    @pytest.mark.parametrize(("decimal", "between"), [(",", "\t"), (".", "\t"), (",", ";"), (".", ",")])
    def test_a_table_goes_into_the_grid_and_is_stored(
        self, shop: Shop, operator: Person, decimal: str, between: str
    ) -> None:
        page = operator.send("/gauges/new", 200, **form(shop, "grr", do="paste", table=table(decimal, between)))
        grid = {name: cell(page, name) for name in re.findall(r'<input name="((?:c|name)_[0-9_]+)"', page)}
        assert (grid["name_0"], grid["c_0_0"], grid["c_9_8"]) == ("Deo 1", "40.00029", "39.99784")
        operator.send("/gauges/new", 200, **form(shop, "grr", **grid))
        (anova,) = [each for each in newest(shop)["grr"] if each["method"] == "anova"]
        assert anova["components"][0]["percent"] == pytest.approx(27.86, abs=0.005)

    @pytest.mark.parametrize("wide", [False, True])
    def test_a_table_with_one_row_a_reading_becomes_the_grid(self, shop: Shop, operator: Person, *, wide: bool) -> None:
        sizes = {(p, o): (f"40.0{p}{at}1", f"40.0{p}{at}2") for p in (1, 2, 3) for at, o in enumerate("AB")}
        lines = ["Operator,Part,M1,M2"] if wide else ["RunOrder,Part,Operator,Measurement"]
        for (part, who), pair in sizes.items():
            lines += (
                [f"{who},{part},{','.join(pair)}"]
                if wide
                else [f"{n},{part},{who},{one}" for n, one in enumerate(pair)]
            )
        page = operator.send("/gauges/new", 200, **form(shop, "grr", do="paste", table="\n".join(lines)))
        found = [[cell(page, f"c_{row}_{column}") for column in range(4)] for row in range(3)]
        assert found == [[*sizes[p, "A"], *sizes[p, "B"]] for p in (1, 2, 3)]
        assert cell(page, "name_2") == "3"

    def test_a_table_is_stored_as_it_was_pasted_while_nothing_stands_in_the_grid(
        self, shop: Shop, operator: Person
    ) -> None:
        column = "\n".join(f"40,00{n % 4}" for n in range(27)) + "\n40,0012"
        page = operator.send("/gauges/new", 200, **form(shop, "type_one", table=column))
        assert re.search(r"40\.0030</td>", page), "as many decimals in every cell of the values"
        assert "40.003</td>" not in page
        page = operator.send("/gauges/new", 422, **form(shop, "type_one", table="40,00x"))
        assert re.search(r"<details open><summary>Paste a table", page), "what is wrong is not folded away"

    def test_a_column_of_values_and_a_table_of_sizes(self, shop: Shop, operator: Person) -> None:
        column = "Meßwert\n" + "\n".join(f"40,000{n % 4}" for n in range(27))
        page = operator.send("/gauges/new", 200, **form(shop, "type_one", do="paste", table=column))
        assert (cell(page, "c_2_6"), cell(page, "c_2_7")) == ("40.0002", "")
        sizes = "10,5\t10,51\t10,49\n20,5\t20,52\t20,5\n"
        page = operator.send("/gauges/new", 200, **form(shop, "linearity", do="paste", table=sizes))
        assert (cell(page, "name_1"), cell(page, "c_1_0")) == ("20,5", "20.52")

    def test_what_cannot_be_read_is_named_and_stays(self, shop: Shop, operator: Person) -> None:
        wrong = table().replace("40,00064", "dirty")
        page = operator.send("/gauges/new", 422, **form(shop, "grr", do="paste", table=wrong))
        assert "“dirty” is not a number" in page
        assert "ow 2, column 4" in page
        assert "Deo 10" in page, "the table that was pasted is still there"
        for empty in ("", "   \n\t\n", "Part\tA\tB"):
            assert "olds no numbers" in operator.send("/gauges/new", 422, **form(shop, "grr", do="paste", table=empty))
        five = "1,1\t1,2\t1,3\t1,4\t1,5\n2,1\t2,2\t2,3\t2,4\t2,5\n"
        assert "do not divide" in operator.send("/gauges/new", 422, **form(shop, "grr", do="paste", table=five))


class TestReadings:
    def test_repeated_probing_fills_the_grid(self, shop: Shop, operator: Person) -> None:
        shop.push([0.1, -0.2, 0.3, 0.0, -0.1] * 6)
        asked = form(shop, "type_one", do="readings", first="1", through="30", take="readings")
        page = operator.send("/gauges/new", 200, **asked)
        grid = {name: cell(page, name) for name in re.findall(r'<input name="(c_[0-9_]+)"', page)}
        hidden = re.search(r'name="from" value="([^"]*)"', page)
        assert (grid["c_0_1"], hidden and hidden[1]) == ("39.9998", "1-30-readings")
        stored = form(shop, "type_one", **{"from": "1-30-readings"}, **grid)
        assert f"readings 1 to 30 of {shop.characteristic}" in operator.send("/gauges/new", 200, **stored)
        grid["c_0_1"] = "39.9"
        operator.send("/gauges/new", 200, **(stored | grid))
        assert "source" not in newest(shop)["settings"], "typed over, they are no longer those readings"

    def test_readings_that_are_not_there(self, shop: Shop, operator: Person) -> None:
        for wrong in ({"first": "x"}, {"first": "5", "through": "9"}, {"first": "", "through": ""}):
            asked = form(shop, "type_one", do="readings", take="readings", **({"first": "1", "through": "2"} | wrong))
            assert "Nothing was stored yet" in operator.send("/gauges/new", 422, **asked)


def test_a_way_from_capability_and_set_up_to_the_studies_and_back(shop: Shop, engineer: Person) -> None:
    key = shop.characteristic
    assert f"/gauges/new?characteristic={key}" in engineer.open(f"/characteristics/{key}/capability")
    assert "No gauge study yet" in engineer.open(f"/characteristics/{key}/capability")
    study = send(shop, "type_one", single(sigma=0.0006), reference=40.0, characteristic=key)
    assert f"/gauges/{study['id']}" in engineer.open(f"/characteristics/{key}/capability")
    assert f"/gauges?characteristic={key}" in engineer.open(f"/setup/characteristics/{key}")
    listed = engineer.open(f"/gauges?characteristic={key}")
    assert "R33 is too small" in listed
    one, averaged = (
        float(found[1])
        for found in map(
            re.compile(r"([0-9.]+)\W+µm").search,
            (listed.partition("Three of")[2], listed.partition("With k = 2 chance moves the running average by")[2]),
        )
        if found
    )
    assert averaged == pytest.approx(one / 3**0.5, abs=0.001), "an EWMA with k = 2 scatters by 1/√3 of one value"
    assert f"/characteristics/{key}/capability" in listed
    assert "R33 is too small" not in engineer.open("/gauges")
    engineer.open("/gauges?characteristic=nobody", 404)
    engineer.open("/gauges?machine=nobody", 200)


def test_who_sees_and_who_enters(shop: Shop, viewer: Person, operator: Person) -> None:
    study = send(shop, "bias", single(), reference=40.0)
    assert f"/gauges/{study['id']}/correct" not in viewer.open(f"/gauges/{study['id']}")
    viewer.open("/gauges/new", 403)
    operator.open(f"/gauges/{study['id']}/correct", 403)
    for number in ("0", "999999", "99999999999999999999"):
        viewer.open(f"/gauges/{number}", 404)
    viewer.open(f"/gauges/{study['id']}?revision=9", 404)


class TestInTheBrowser:
    def test_typing_into_the_grid_and_following_r33_into_the_parameters(
        self, page: Page, shop: Shop, engineer: Person
    ) -> None:
        engineer.sign_in(page)
        page.goto(f"/characteristics/{shop.characteristic}/capability")
        page.get_by_role("link", name="New study").click()
        page.get_by_role("link", name="Does the probe repeat").click()
        page.wait_for_url("**kind=type_one**")  # and for its scripts, before the first key
        page.get_by_label("Gauge or probe").fill("Probe T8")
        first = page.locator("[name=c_0_0]")
        first.focus()
        for text in ("39,9994", "40,0006", "40,0000"):
            page.keyboard.type(text)
            page.keyboard.press("ArrowRight")
        expect(page.locator("[name=c_0_3]")).to_be_focused()
        page.keyboard.press("ArrowLeft")
        page.keyboard.press("Enter")
        expect(page.locator("[name=c_1_2]")).to_be_focused()
        block = "\n".join("\t".join(["39,9994", "40,0006"] * 5) for _ in range(4))
        paste(page, "c_1_0", block)
        expect(page.locator("[name=c_4_9]")).to_have_value("40,0006")
        page.get_by_role("button", name="Store the study").last.click()
        expect(page.get_by_text("The study is stored.")).to_be_visible()
        expect(page.locator("plotly-chart .main-svg").first).to_be_visible()
        expect(page.get_by_text("R33 is too small")).to_be_visible()
        assert "suggests R33 = 1.8 µm" in engineer.open(f"/setup/characteristics/{shop.characteristic}")
        page.get_by_role("link", name="Open the parameters with R33 = 1.8 µm").click()
        expect(page.locator("[name=zero_range]")).to_have_value("0.0018")
        expect(page.locator("[name=reason]")).to_have_value(re.compile("Gauge study .* repeatability 0.6"))
        assert shop.call("GET", f"/characteristics/{shop.characteristic}")["parameters"]["zero_range"] == 0.001
        page.get_by_role("button", name="Save").click()
        page.wait_for_url("**/setup/characteristics/**done=**")
        assert shop.call("GET", f"/characteristics/{shop.characteristic}")["parameters"]["zero_range"] == 0.0018

    def test_machine_and_characteristic_never_contradict_each_other(
        self, page: Page, shop: Shop, operator: Person
    ) -> None:
        other = Shop(shop.server)
        operator.sign_in(page)
        page.goto(f"/gauges/new?kind=type_one&machine={other.machine}")
        machine, characteristic = page.locator("[name=machine]"), page.locator("[name=characteristic]")
        characteristic.select_option(shop.characteristic)
        expect(machine).to_have_value(shop.machine)
        machine.select_option(other.machine)
        expect(characteristic).to_have_value("")

    @pytest.mark.long
    def test_a_block_from_a_spreadsheet_is_pasted_into_the_first_cell(
        self, page: Page, shop: Shop, engineer: Person, complaints: list[str]
    ) -> None:
        engineer.sign_in(page)
        page.goto(f"/gauges/new?kind=grr&machine={shop.machine}")
        page.get_by_label("Gauge or probe").fill("Mikrometar „25–50“")
        paste(page, "name_0", table(heading=False))
        expect(page.locator("[name=name_9]")).to_have_value("Deo 10")
        expect(page.locator(".too-much")).to_be_hidden()
        paste(page, "c_9_8", "1\t2\n3\t4")
        expect(page.locator(".too-much")).to_contain_text("larger than the grid")
        page.locator("[name=c_9_8]").fill("39,99784")
        page.get_by_role("button", name="Store the study").last.click()
        expect(page.get_by_role("heading", name="Gauge R&R: Mikrometar")).to_be_visible()
        expect(page.locator("#components")).to_contain_text("27.9")
        expect(page.locator("#anova")).to_contain_text("pooled with repeatability")
        page.get_by_role("link", name="Correct").click()
        page.locator("[name=c_0_0]").fill("40,003")
        page.get_by_role("button", name="Store the corrected study").last.click()
        expect(page.get_by_text("Nothing was stored yet")).to_be_visible()
        expect(page.locator("[name=c_0_0]")).to_have_value("40,003")
        complaints.clear()  # the browser's own words for the 422
        page.get_by_label("Reason for the correction").fill("read from the wrong line")
        page.get_by_role("button", name="Store the corrected study").last.click()
        expect(page.get_by_text("the previous revision is kept")).to_be_visible()
        expect(page.locator("#revisions")).to_contain_text("read from the wrong line")


def paste(page: Page, name: str, text: str) -> None:
    """As a browser hands over what was copied in a spreadsheet."""
    page.locator(f"[name={name}]").focus()
    page.evaluate(
        """text => {
            const data = new DataTransfer();
            data.setData("text/plain", text);
            document.activeElement.dispatchEvent(
                new ClipboardEvent("paste", {clipboardData: data, bubbles: true, cancelable: true}));
        }""",
        text,
    )
