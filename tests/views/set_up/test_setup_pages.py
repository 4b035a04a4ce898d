"""The Set-up pages as plain posts, without any script."""

import re
from html import unescape
from typing import Any, get_type_hints

import httpx
import pytest

from app.bridge.kinds import KINDS, kind_named
from app.loop.characteristics import actions as characteristics
from app.loop.characteristics.schemas import CharacteristicIn
from app.views.set_up.machine_pages import stopping
from tests.servers import Server
from tests.shop import ACTOR, PARAMETERS, Person, Shop, unique

SERBIAN = "Седиште „лежаја” Ø40 <b>h6</b> & 'A'"
FORM = {
    "nominal": "40",
    "upper_deviation": "0",
    "lower_deviation": "−0,016",
    "zero_range": "0,001",
    "wear_limit": "0.3",
    "confidence_limit": "1",
    "weighting_factor": "2",
    "average_memory": "5",
    "tool_memory": "3",
    "factor": "-1",
    "mode": "automatic",
    "wear_policy": "hold",
    "variant": "single",
    "axis": "X",
    "direction": "positive",
    "points": "1",
    "repeats": "1",
    "path_factor": "1",
    "accept_n": "1",
    "accept_m": "1",
}


def values(page: str) -> dict[str, str]:
    """Values of the inputs of a page."""
    found = {}
    for tag in re.findall(r"<input [^>]*>", page):
        name, value = re.search(r'name="([^"]+)"', tag), re.search(r'value="([^"]*)"', tag)
        if name and value and ('type="radio"' not in tag or "checked" in tag):
            found[name[1]] = unescape(value[1])
    for name, options in re.findall(r'<select [^>]*name="([^"]+)"[^>]*>(.*?)</select>', page, re.DOTALL):
        chosen = re.search(r'value="([^"]*)" selected', options)
        found[name] = unescape(chosen[1]) if chosen else ""
    return found


def errors(page: str) -> list[str]:
    found = re.findall(r'class="error".*?<span>(.*?)</span>', page, re.DOTALL)
    return [unescape(sentence) for sentence in found]


class TestMachines:
    def test_from_nothing_to_a_key_that_works(self, engineer: Person, shop: Shop) -> None:
        key = unique("bench")
        made = engineer.post("/setup/machines/new", key=key, name=SERBIAN, control="fanuc")
        assert made.headers["location"] == f"/setup/machines/{key}?done=added"
        page = engineer.open(made.headers["location"])
        assert "Added." in page
        assert SERBIAN in unescape(page)
        assert "<b>h6" not in page
        shown = engineer.post(f"/setup/machines/{key}/keys", 200, name="cell PC").text
        secret = re.search(r"inband_[\w-]{43}", shown)
        assert secret
        assert "curl" in shown
        assert secret[0] not in engineer.open(f"/setup/machines/{key}"), "this once"
        machine = shop.server.client(secret[0])
        assert machine.get(f"/api/v1/machines/{key}").status_code == 200
        number = re.search(rf"/setup/machines/{key}/keys/(\d+)/revoke", shown)
        assert number
        engineer.post(number[0])
        assert machine.get(f"/api/v1/machines/{key}").status_code == 401

    def test_the_curl_line_works_as_it_is_shown(self, engineer: Person, shop: Shop) -> None:
        shown = unescape(engineer.post(f"/setup/machines/{shop.machine}/keys", 200, name="x").text)
        secret = re.search(r"Bearer (inband_[\w-]+)", shown)
        body = re.search(r"-d '(\{.*?\})'", shown)
        assert secret
        assert body
        answer = shop.server.client(secret[1]).post(
            "/api/v1/readings", content=body[1], headers={"Content-Type": "application/json"}
        )
        assert answer.status_code == 201
        assert answer.json()["zone"] == "zero"

    def test_the_forms_say_which_bridges_cannot_stop_a_machine_before_it_is_saved(
        self, engineer: Person, shop: Shop
    ) -> None:
        for form in ("new", shop.machine):
            assert stopping() in unescape(engineer.open(f"/setup/machines/{form}"))
        can, cannot = stopping().split(". A bridge of kind ")
        for kind in KINDS:
            carries = hasattr(get_type_hints(kind_named(kind).link)["return"], "decide")
            assert carries == bool(re.search(rf"\b{kind}\b", can)), kind
            assert (not carries or kind == "folder") == bool(re.search(rf"\b{kind}\b", cannot)), kind

    def test_what_was_typed_is_not_lost(self, engineer: Person) -> None:
        page = engineer.post("/setup/machines/new", 422, key="Bad Key", name=SERBIAN, control="fanuc").text
        assert values(page).items() >= {"key": "Bad Key", "name": SERBIAN, "control": "fanuc"}.items()
        assert errors(page)[0].startswith("Must be a key of 1 to 64 characters")

    def test_change(self, engineer: Person, shop: Shop) -> None:
        engineer.post(f"/setup/machines/{shop.machine}", key=shop.machine, name="Renamed", control="other")
        assert shop.call("GET", f"/machines/{shop.machine}")["name"] == "Renamed"
        page = engineer.post(f"/setup/machines/{shop.machine}", 422, key=shop.machine, name="x" * 201, control="other")
        assert "At most 200" in str(errors(page.text)) or "at most 200" in str(errors(page.text))

    def test_lists(self, viewer: Person, shop: Shop) -> None:
        page = viewer.open("/setup/machines")
        assert shop.machine in page
        assert "Add machine" not in page, "a viewer only looks"


class TestCharacteristics:
    def new(self, engineer: Person, shop: Shop, key: str, status: int = 303, **form: str) -> httpx.Response:
        named = {"key": key, "name": SERBIAN, "machine": shop.machine, "part": ""}
        return engineer.post("/setup/characteristics/new", status, **(named | FORM | form))

    def test_a_new_one_as_typed_with_commas(self, engineer: Person, shop: Shop) -> None:
        key = unique("typed")
        made = self.new(engineer, shop, key)
        assert made.headers["location"] == f"/setup/characteristics/{key}?done=added"
        api = shop.call("GET", f"/characteristics/{key}")
        assert api["name"] == SERBIAN
        assert api["parameters"].items() >= {"target": 39.992, "lower_deviation": -0.016, "zero_range": 0.001}.items()
        shown = values(engineer.open(f"/setup/characteristics/{key}"))
        assert shown.items() >= {"nominal": "40", "lower_deviation": "-0.016", "target": "", "factor": "-1"}.items()

    def test_a_refused_order_is_reported_at_the_field_and_nothing_typed_is_lost(
        self, engineer: Person, shop: Shop
    ) -> None:
        page = self.new(
            engineer, shop, "refused", 422, averaging_limit="0,009", max_step="ein", wear_limit="0.3x", part="0815"
        ).text
        shown = values(page)
        expected = FORM | {"averaging_limit": "0,009", "max_step": "ein", "wear_limit": "0.3x", "part": "0815"}
        assert {name: shown.get(name) for name in expected} == expected
        assert shown["name"] == SERBIAN
        assert len(errors(page)) == 3, "limits that are known are compared at once"
        page = self.new(engineer, shop, "refused", 422, averaging_limit="0,009").text
        (told,) = errors(page)
        assert told.startswith("R34 averaging limit 0.0090 mm must not be larger than R35/2 = 0.0080 mm; lower it")
        assert re.search(r'id="f-averaging_limit"[^>]*aria-invalid="true"', page)
        shop.call("GET", "/characteristics/refused", 404)

    def test_names_and_parameters_are_reported_at_once(self, engineer: Person, shop: Shop) -> None:
        page = self.new(engineer, shop, "No Key", 422, machine="", zero_range="0.1").text
        assert len(errors(page)) == 3

    def test_all_that_is_wrong_is_marked_the_first_time(self, engineer: Person, shop: Shop) -> None:
        """A tolerance of nothing hides no other error, and a limit that is to be suggested is none."""
        wrong = {"upper_deviation": "-0,016", "tool_memory": "0,5", "zero_range": "-1", "averaging_limit": "abc"}
        rest = {"wear_limit": "", "confidence_limit": "x", "factor": ""}
        page = self.new(engineer, shop, unique("bad"), 422, **wrong, **rest).text
        marked = re.findall(r'id="f-(\w+)"[^>]*aria-invalid="true"', page)
        assert {*marked} >= {*wrong, "confidence_limit"}
        assert len(errors(page)) == 6
        assert "The factor is missing" in page
        assert "\N{MINUS SIGN}1000\N{NO-BREAK SPACE}µm" in page, "the sign is shown"

    def test_what_is_left_empty_is_suggested_and_the_loop_acts(self, engineer: Person, shop: Shop) -> None:
        """Name, drawing, tool and sign are enough; after them the first size that is off leads to a correction."""
        shop.call("PATCH", f"/machines/{shop.machine}", signal_path="plc", probing_feed=600.0)
        left = dict.fromkeys(("zero_range", "wear_limit", "confidence_limit", "average_memory"), "")
        name = unique("Seat Ø40 h6").replace("-", " ")
        made = engineer.post(
            "/setup/characteristics/new",
            **(FORM | left | {"key": "", "name": name, "machine": shop.machine, "part": ""}),
        )
        key = made.headers["location"].removeprefix("/setup/characteristics/").removesuffix("?done=added")
        assert key == name.lower().replace("ø", "d").replace(" ", "-")
        parameters = shop.call("GET", f"/characteristics/{key}")["parameters"]
        expected = {"zero_range": 0.0025, "averaging_limit": 0.005333333, "wear_limit": 0.3, "confidence_limit": 1.0}
        assert parameters.items() >= (expected | {"average_memory": 1, "tool_memory": 3, "mode": "automatic"}).items()
        assert "It measures only" not in engineer.open(f"/setup/characteristics/{key}")
        assert shop.call("POST", "/readings", 201, characteristic=key, measured=39.999)["action"] == "correct"

    def test_a_tool_is_asked_for_or_said_to_be_none(self, engineer: Person, shop: Shop) -> None:
        page = self.new(engineer, shop, unique("asked"), 422, tool_memory="").text
        assert "Enter the tool whose offset is corrected, or 0 to measure only" in errors(page)[0]
        page = self.new(engineer, shop, unique("asked"), 422, tool_memory="", factor="").text
        assert any("The factor is missing" in sentence for sentence in errors(page)), "both at once"
        key = unique("measures")
        self.new(engineer, shop, key, tool_memory="0", average_memory="")
        assert "It measures only: no tool is named (R10 = 0)." in engineer.open(f"/setup/characteristics/{key}")
        assert shop.call("GET", f"/characteristics/{key}")["parameters"]["average_memory"] == 0

    @pytest.mark.parametrize(
        ("parameters", "said"),
        [
            (
                {"mode": "measure_only"},
                "the mode is “Measure only”. Nothing is corrected until another mode is chosen.",
            ),
            ({"mode": "measure_only", "tool_memory": 0}, "the mode is “Measure only”, and no tool is named (R10 = 0)."),
        ],
    )
    def test_what_keeps_it_from_correcting_is_named(
        self, engineer: Person, shop: Shop, parameters: dict[str, Any], said: str
    ) -> None:
        key = unique("kept")
        shop.add(key, **parameters)
        assert f"It measures only: {said}" in engineer.open(f"/setup/characteristics/{key}")

    def test_a_fold_opens_where_something_in_it_is_refused_or_differs(self, engineer: Person, shop: Shop) -> None:
        """What one has to look at is never hidden."""

        def opened(page: str) -> list[str]:
            return re.findall(
                r'<details class="card more printed" open>.*?<div class="card-body[^"]*" id="(\w+)"', page, re.DOTALL
            )

        path = f"/setup/characteristics/{shop.characteristic}"
        page = engineer.open(path)
        assert opened(page) == []
        refused = values(page) | {"max_step": "much", "reason": "to see"}
        assert opened(engineer.post(path, 422, **refused).text) == ["bounds"]
        assert opened(engineer.open(f"{path}?points=3&plausible_jump=0.01")) == ["bounds", "probing"]

    def test_everything_that_is_missing_is_said_at_once(self, engineer: Person, shop: Shop) -> None:
        nothing = dict.fromkeys(("name", "nominal", "upper_deviation", "lower_deviation", "tool_memory", "factor"), "")
        said = errors(self.new(engineer, shop, "", 422, **nothing).text)
        assert [sentence.split(":")[0].split(",")[0] for sentence in said] == [
            "Is missing",
            "The size is missing",
            "Enter the tool whose offset is corrected",
            "The factor is missing",
        ]

    def test_what_comes_next_is_said(self, engineer: Person, shop: Shop) -> None:
        key = unique("bare")
        shop.call("POST", "/machines", 201, key=key, name="Bare", control="other")
        asks, first = "Add the first characteristic", "Measure a part and type its size"
        assert asks in engineer.open(f"/setup/machines/{key}")
        assert asks not in engineer.open(f"/setup/machines/{shop.machine}")
        assert first in engineer.open(f"/setup/characteristics/{shop.characteristic}")
        shop.read(1.0)
        assert first not in engineer.open(f"/setup/characteristics/{shop.characteristic}")

    def test_limits_that_follow_from_the_tolerance_are_not_asked_for(self, engineer: Person, shop: Shop) -> None:
        left = dict.fromkeys(("zero_range", "wear_limit", "confidence_limit"), "")
        page = self.new(engineer, shop, unique("asked"), 422, **left, upper_deviation="", lower_deviation="").text
        assert [sentence.split(" ", 1)[0] for sentence in errors(page)] == ["R40", "R41"]
        page = self.new(engineer, shop, unique("asked"), 422, **left, upper_deviation="0", lower_deviation="0").text
        assert [sentence.split(" ", 1)[0] for sentence in errors(page)] == ["R40"]

    @pytest.mark.long
    def test_a_list_of_very_many_goes_on_on_another_page(self, engineer: Person, server: Server, shop: Shop) -> None:
        keys = [f"{shop.machine}-{number:03}" for number in range(201)]
        with server.database.begin() as session:
            for key in keys:
                added = CharacteristicIn(
                    key=key, name=key, machine=shop.machine, parameters=PARAMETERS | {"tool_memory": 4}
                )
                characteristics.add_characteristic(session, added, "tests")
        first = engineer.open(f"/setup/characteristics?machine={shop.machine}")
        (more,) = re.findall(r'href="([^"]+)" rel="next"', first)
        second = engineer.open(unescape(more))
        shown = [re.findall(r'href="/setup/characteristics/([^"?]+)"><strong>', page) for page in (first, second)]
        assert sorted(shown[0] + shown[1]) == sorted([shop.characteristic, *keys])
        assert (len(shown[0]), len(shown[1])) == (200, 2)
        assert f'href="/setup/characteristics?machine={shop.machine}&amp;sort=key" rel="prev"' in second

    def test_a_factor_of_ones_own(self, engineer: Person, shop: Shop) -> None:
        key = unique("own-factor")
        self.new(engineer, shop, key, factor="other", factor_other="0,25")
        assert shop.call("GET", f"/characteristics/{key}")["parameters"]["factor"] == 0.25
        assert values(engineer.open(f"/setup/characteristics/{key}"))["factor_other"] == "0.25"

    def test_no_factor_is_asked_for(self, engineer: Person, shop: Shop) -> None:
        page = self.new(engineer, shop, "none", 422, factor="").text
        assert "The factor is missing" in errors(page)[0]
        assert re.search(r'name="factor" value="-1" aria-invalid="true"', page), "the browser goes there"

    def test_change_with_reason_and_history(self, engineer: Person, shop: Shop) -> None:
        key = unique("changed")
        self.new(engineer, shop, key)
        path = f"/setup/characteristics/{key}"
        form = {"name": SERBIAN, "part": "", "parameters_version": "1"} | FORM
        page = engineer.post(path, 422, **(form | {"zero_range": "0.002"})).text
        assert "Is required when parameters change" in errors(page)[0]
        assert values(page)["zero_range"] == "0.002"
        engineer.post(path, **(form | {"zero_range": "0.002", "reason": "Нова сонда"}))
        page = unescape(engineer.open(path))
        assert "Нова сонда" in page
        assert re.search(r"Zero range <del>0.001 mm</del> → <ins>0.002 mm</ins>", page)
        assert (
            engineer.post(path, **(form | {"zero_range": "0.002", "parameters_version": "2"}))
            .headers["location"]
            .endswith("done=same")
        )

    def test_two_engineers_at_once(self, engineer: Person, admin: Person, shop: Shop) -> None:
        key = unique("contested")
        self.new(engineer, shop, key)
        path = f"/setup/characteristics/{key}"
        form = {"name": "x", "part": "", "parameters_version": "1", "reason": "because"} | FORM
        admin.post(path, **(form | {"weighting_factor": "3"}))
        page = engineer.post(path, 409, **(form | {"weighting_factor": "4"})).text
        assert f"{admin.name} has changed the parameters meanwhile" in unescape(page)
        assert values(page).items() >= {"weighting_factor": "4", "parameters_version": "2"}.items()
        engineer.post(path, **(values(page) | {"reason": "seen"}))
        assert shop.call("GET", f"/characteristics/{key}")["parameters"]["weighting_factor"] == 4

    def test_one_like_another(self, engineer: Person, shop: Shop) -> None:
        key = unique("model")
        self.new(engineer, shop, key, weighting_factor="4")
        shown = values(engineer.open(f"/setup/characteristics/new?like={key}"))
        assert shown.items() >= {"weighting_factor": "4", "machine": shop.machine, "key": ""}.items()

    def test_a_viewer_looks_but_cannot_change(self, viewer: Person, shop: Shop) -> None:
        page = viewer.open(f"/setup/characteristics/{shop.characteristic}")
        assert '<fieldset class="stack" disabled>' in page
        assert "Reason for the change" not in page
        viewer.post(f"/setup/characteristics/{shop.characteristic}", 403, name="x")
        viewer.open("/setup/characteristics/new", 403)

    def test_lists_by_machine(self, viewer: Person, shop: Shop) -> None:
        other = Shop(shop.server)
        page = viewer.open(f"/setup/characteristics?machine={other.machine}")
        assert f"/setup/characteristics/{other.characteristic}" in page
        assert f"/setup/characteristics/{shop.characteristic}" not in page

    @pytest.mark.parametrize("form", [{}, {"zero_range": "\0"}, {"parameters_version": "9" * 30}])
    def test_nonsense_is_answered_in_words(self, engineer: Person, shop: Shop, form: dict[str, str]) -> None:
        answer = engineer.post(f"/setup/characteristics/{shop.characteristic}", 422, **form)
        assert answer.headers["content-type"].startswith("text/html")


def test_from_a_name_to_the_first_correction_in_three_forms(engineer: Person, shop: Shop) -> None:
    """The newcomer's path, in the browser alone: a machine, a characteristic, a size typed by hand, a correction to enter."""
    name = unique("First lathe").replace("-", " ")
    machine = name.lower().replace(" ", "-")
    counts = {"tool_locations": "32", "average_locations": "20"}
    engineer.post("/setup/machines/new", name=name, key="", control="sinumerik", type="lathe", **counts)
    typed = {"nominal": "25 h6", "tool_memory": "1", "factor": "-1", "mode": "automatic"}
    defaults = dict.fromkeys(("zero_range", "wear_limit", "confidence_limit", "average_memory", "key", "part"), "")
    new = FORM | dict.fromkeys(("upper_deviation", "lower_deviation"), "") | defaults | typed
    made = engineer.post("/setup/characteristics/new", **(new | {"name": f"{name} Ø25", "machine": machine}))
    assert "sizes?characteristic=" in engineer.open(made.headers["location"])
    sheet = engineer.open(f"/station/{machine}/sizes?characteristic={machine}-d25")
    assert f'name="size:{machine}-d25"' in sheet
    (key,) = re.findall(r'name="key" value="([0-9a-f]{16})"', sheet)
    said = engineer.send(f"/station/{machine}/sizes", **{"key": key, f"size:{machine}-d25": "24,9995"})
    assert "Mark applied" in said
    begins = re.compile(r'name="size:[^>]* autofocus')
    assert begins.search(sheet)
    assert not begins.search(said), "what was stored is not scrolled away"
    correction = shop.call("GET", f"/machines/{machine}/corrections?status=pending")["items"][0]
    assert correction["amount"] == -0.006


def test_the_record_of_changes(engineer: Person, viewer: Person, shop: Shop) -> None:
    for number in range(3):
        shop.call("PATCH", f"/machines/{shop.machine}", name=f"<i>{number}</i>")
    page = engineer.open(f"/setup/audit?subject=machine/{shop.machine}")
    assert page.count("machine changed") >= 3
    assert "&lt;i&gt;2&lt;/i&gt;" in page
    assert "Nothing recorded here" in engineer.open("/setup/audit?subject=machine/nowhere&before=x")
    viewer.open("/setup/audit", 403)


def test_the_record_of_changes_has_words(engineer: Person, shop: Shop) -> None:
    """Names of parameters, units, times by the plant's clock, yes and no: no JSON."""
    shop.call(
        "PATCH",
        f"/characteristics/{shop.characteristic}",
        parameters=PARAMETERS | {"zero_range": 0.002},
        reason="Calmer",
    )
    shop.call("POST", "/maintenance", 201, machine=shop.machine, reason="Oil")
    page = engineer.open(f"/setup/audit?subject=characteristic/{shop.characteristic}")
    assert re.search(r"Zero range \(R33\).*<del>0.001 mm</del> → <ins>0.002 mm</ins>", page)
    kept = engineer.open(f"/setup/audit?actor={ACTOR}&q=maintenance")
    assert re.search(r"stopping anyway</span>\s*<ins>yes", kept)
    assert not re.search(r"<ins>\d{4}-\d\d-\d\dT", kept)
    of_what = dict(
        re.findall(
            r'<a href="(/[^"]+)">([^<]+)</a>\s+·\s+<a class="quiet nowrap"',
            engineer.open("/setup/audit").replace("<wbr>", ""),
        )
    )
    assert of_what[f"/setup/characteristics/{shop.characteristic}"] == f"Characteristic {shop.characteristic}"
    assert "Nothing recorded here" not in engineer.open(f"/setup/audit?subject=machine/{shop.machine}")
    engineer.open(f"/setup/characteristics/{shop.characteristic}")


def test_every_page_of_setup_opens(admin: Person, shop: Shop) -> None:
    for path in (
        "/setup/characteristics",
        f"/setup/characteristics/{shop.characteristic}",
        "/setup/characteristics/new",
        "/setup/machines",
        "/setup/machines/new",
        f"/setup/machines/{shop.machine}",
        "/setup/people",
        "/setup/audit",
        "/account",
    ):
        assert "<h1" in admin.open(path)
    assert admin.browser.get("/setup", follow_redirects=False).headers["location"] == "/setup/characteristics"
    for path in (
        "/setup/machines/nowhere",
        "/setup/characteristics/nowhere",
        "/setup/characteristics/new?like=nowhere",
    ):
        assert "There is no" in admin.open(path, 404)
    assert "Sign out" in admin.open("/setup/nothing-here", 404), "who is signed in stays so on a wrong address"
