"""The pages of rotary axes by links and posts, as a browser without scripts uses them."""

import re

import pytest

from app.geometry.rotary_axes.form_reader import decoded
from tests.geometry.rotary_axes.bench import NAMES, RADIUS, TRUE, axis, protocol, touched
from tests.geometry.rotary_axes.walking import QS, grid, in_list, machine, runs, take, words
from tests.shop import Person, Shop


class TestEntering:
    def test_result_parameters(self, shop: Shop, operator: Person) -> None:
        text = operator.send(
            "/kinematics/new",
            200,
            machine=shop.machine,
            **{"as": "pasted"},
            pasted=f'Q143 = 0,0134\nhello\nQS146 = "{QS}"',
        )
        assert "is stored" in text
        shown = words(text)
        assert "EX0C C is offset in X +0.0123 mm" in shown
        assert "EB0C C is tilted about Y −0.0012 °" in shown
        assert "1 line was not understood" in shown
        assert "not understood: “hello”" in shown
        assert QS in shown
        [run] = runs(shop)
        assert run["by"] == operator.name
        assert shop.call("GET", f"/audit?subject=kinematics-run/{run['run']}")["items"][0]["actor"] == operator.name

    def test_a_protocol_pasted(self, shop: Shop, operator: Person) -> None:
        text = words(
            operator.send("/kinematics/new", 200, machine=shop.machine, **{"as": "protocol"}, protocol=protocol("de"))
        )
        assert "Bediener der Nachtschicht" in text
        assert "21 Nov 2026" in text
        assert "+0.0123 mm ± 0.9 µm" in text  # from the scatter, angles and circle that it states
        assert "250.0123" in text

    def test_a_protocol_sent_as_a_file(self, shop: Shop, operator: Person) -> None:
        csrf = re.search(r'<meta name="csrf" content="([^"]+)"', operator.open("/kinematics/new"))
        assert csrf is not None
        fields = {"csrf": csrf[1], "machine": shop.machine, "as": "pasted", "do": "look"}
        file = {"file": ("TCHPRAUTO.html", _as_old_controls_write(protocol("sl")), "text/html")}
        answer = operator.browser.post("/kinematics/new", data=fields, files=file)
        assert answer.status_code == 200
        assert "Preview, not stored yet" in answer.text
        assert "TCHPRAUTO.html was read" in answer.text
        assert runs(shop) == []
        answer = operator.browser.post("/kinematics/new", data=fields | {"do": "keep"}, files=file)
        assert "is stored" in answer.text
        [run] = runs(shop)
        assert run["form"] == "protocol"
        assert run["axes"][0]["errors"]["EX0C"]["value"] == 0.0123

    def test_an_old_slovene_file_that_does_not_say_how_it_is_written(self) -> None:
        text = protocol("sl").replace("\N{MINUS SIGN}", "-")
        assert decoded(text.encode("cp1250")) == text
        assert decoded("Prüfen".encode("cp1252")) == "Prüfen"

    def test_ball_centres_in_the_grid(self, shop: Shop, operator: Person) -> None:
        typed = grid(axis(both=True, backlash=0.002))
        operator.send("/kinematics/new", 200, machine=shop.machine, **{"as": "positions", "lines": "12"}, **typed)
        [run] = runs(shop)
        assert (run["form"], run["axes"][0]["points"], len(run["axes"][0]["positions"])) == ("centres", 6, 12)
        found = [run["axes"][0]["errors"][name]["value"] for name in NAMES]
        assert found == pytest.approx(TRUE, abs=0.002)

    def test_touches_pasted_from_a_spreadsheet(self, shop: Shop, operator: Person) -> None:
        """Of one angle four lines or more are touches; an angle that is left out is that of the line above."""
        lines = []
        for each in touched()["positions"]:
            for number, touch in enumerate(each["touches"]):
                lines.append("\t".join([*([] if number else [f"{each['angle']:g}"]), *(f"{v:.7f}" for v in touch)]))
        fields = {"as": "positions", "positions": "\n".join(lines), "ball": "180;0 40", "ball_radius": "12,5"}
        text = operator.send("/kinematics/new", 422, machine=shop.machine, **fields)
        assert "X, Y and Z are needed" in text
        assert "12,5" in text
        operator.send("/kinematics/new", 200, machine=shop.machine, **fields | {"ball": "C 180 0 40"})
        [run] = runs(shop)
        assert run["form"] == "touches"
        assert [ball["radius"] for ball in run["balls"]] == pytest.approx([RADIUS] * 6, abs=1e-5)

    def test_the_ball_alone(self, shop: Shop, operator: Person) -> None:
        fields = {"as": "shift", "nominal": "0 0 0", "found": "0,012 -0.003 0.001"}
        shown = words(operator.send("/kinematics/new", 200, machine=shop.machine, **fields))
        assert "Q147 offset of the machine in X, for its machine parameter +0.0120 mm" in shown

    @pytest.mark.parametrize(
        ("fields", "said", "kept"),
        [
            ({"as": "pasted", "pasted": "nothing <of> that"}, "no result parameter can be read", "nothing &lt;of&gt; that"),
            ({"as": "pasted"}, "Paste the result parameters", 'value="pasted" checked'),
            ({"as": "protocol", "protocol": "<h1>Rechnung</h1>"}, "nothing of a rotary axis", "Rechnung"),
            ({"as": "positions", "angle_0": "0", "x_0": 'ž’"', "y_3": "7"}, "Line 1:", 'value="ž’&#34;"'),
            ({"as": "positions", "angle_0": "0", "x_0": "nan", "y_0": "1", "z_0": "2"}, "", 'value="nan"'),
            ({"as": "positions", "positions": "C 0 1 2 3\nC 90 1"}, "Line 2:", "C 90 1"),
            ({"as": "positions", "positions": "C 0 1 2 3\nC 90 3 2 1\nC 400 1 2 3"}, "Position 3: must be at most 360", "C 400"),
            ({"as": "positions"}, "enter the positions", 'value="positions" checked'),
            ({"as": "shift", "nominal": "0 0", "found": "1 2 3"}, "X, Y and Z are needed", "1 2 3"),
            ({"as": "shift", "nominal": "0 0 0", "found": "1 2 3\n4 5 6"}, "a sphere needs at least 4", "4 5 6"),
            ({"as": "pasted", "pasted": f'QS146="{QS}"', "measured_at": "yesterday"}, "is not a time", "yesterday"),
            ({"as": "pasted", "pasted": f'QS146="{QS}"', "measured_at": "1999-01-01 00:00"}, "2000", "1999"),
            ({"as": "pasted", "pasted": f'QS146="{QS}"', "touches_per_ball": "99"}, "8", "99"),
            ({"as": "nonsense", "do": "nonsense"}, "Choose the file", ""),
        ],
    )  # fmt: skip
    def test_what_is_wrong_is_said_and_nothing_typed_is_lost(
        self, shop: Shop, operator: Person, fields: dict[str, str], said: str, kept: str
    ) -> None:
        text = operator.send("/kinematics/new", 422, machine=shop.machine, **fields)
        assert "Nothing was stored yet" in text
        assert said.lower() in text.lower()
        assert kept in text
        assert runs(shop) == []

    def test_a_machine_that_is_not_there(self, operator: Person) -> None:
        assert "There is no machine" in operator.send(
            "/kinematics/new", 404, machine="nowhere", **{"as": "pasted"}, pasted=f'QS146="{QS}"'
        )
        assert "Choose the machine" in operator.send("/kinematics/new", 422, **{"as": "pasted"}, pasted="Q143=1")

    def test_a_larger_grid_keeps_what_is_typed(self, shop: Shop, operator: Person) -> None:
        text = operator.send(
            "/kinematics/new", 200, machine=shop.machine, lines="30", do="grid", x_3="1.5", **{"as": "positions"}
        )
        assert 'name="x_29"' in text
        assert 'name="x_3" value="1.5"' in text
        assert 'name="x_119"' in operator.send("/kinematics/new", 200, lines="99999", do="grid")
        assert runs(shop) == []

    def test_viewers_look_and_enter_nothing(self, shop: Shop, viewer: Person) -> None:
        take(shop, results={"QS146": QS})
        assert in_list(viewer, shop)
        assert "/enter" not in viewer.open(machine(shop))
        viewer.open("/kinematics/new", 403)
        viewer.send("/kinematics/new", 403, machine=shop.machine, pasted=f'QS146="{QS}"')


class TestDeciding:
    def test_a_large_change_is_confirmed_then_entered_then_taken_back(
        self, shop: Shop, operator: Person, engineer: Person
    ) -> None:
        shop.call("PUT", f"/machines/{shop.machine}/kinematics", max_modification=0.01, reason="acceptance")
        run = take(shop, results={"QS146": QS})
        here = f"/kinematics/runs/{run}"
        assert "is a larger change than the permitted ±10 µm" in words(operator.open(here))
        assert f"Confirm run {run}?" in operator.open(f"{here}/confirm")
        operator.open(f"{here}/enter", 409)
        assert "may be entered" in operator.send(f"{here}/confirm", reason="New head", more="Kopf 2 Žarko")
        assert "New head: Kopf 2 Žarko" in operator.open(here)
        assert "was confirmed by" in operator.send(f"{here}/confirm", 409, reason="Seen")
        asked = words(operator.open(f"{here}/enter"))
        assert "EX0C +0.0123 mm, EY0C −0.0123 mm" in asked
        assert "Choose" not in operator.send(f"{here}/enter", 422, reason="")
        assert "ahead" in operator.send(f"{here}/enter", 422, reason="x", at="2099-01-01 10:00")
        assert "before and after is backed up" in operator.send(f"{here}/enter", reason="Monthly check")
        in_effect = shop.call("GET", f"/machines/{shop.machine}/kinematics")["in_effect"]
        assert in_effect["EX0C"] == pytest.approx(0.01234567)
        assert "nothing left to do" in operator.send(f"{here}/enter", 409, reason="x")
        operator.send(f"{here}/undo", 403, reason="x")
        assert "is undone" in engineer.send(f"{here}/undo", reason="Worse than before")
        assert "These values were entered, and the entry was undone" in engineer.open(here)
        for shown in (engineer.open(here), engineer.open(machine(shop)), in_list(engineer, shop)):
            assert 'data-state="undone"' in shown
        assert shop.call("GET", f"/machines/{shop.machine}/kinematics")["in_effect"].get("EX0C", 0.0) == 0.0

    def test_a_kinematics_is_put_back(self, shop: Shop, operator: Person, engineer: Person) -> None:
        run = take(shop, results={"QS146": QS})
        operator.send(f"/kinematics/runs/{run}/enter", reason="Monthly check")
        text = engineer.open(machine(shop))
        assert f"As it was before run {run}" in text
        place = f"{machine(shop)}/backups/1"
        assert "EX0C: +0.0123 mm becomes +0.0000 mm" in words(engineer.open(place))
        operator.open(place, 403)
        late = engineer.send(place, 409, reason="x", instead_of="1")
        assert "in effect" in late
        assert "it is version 3 now" in engineer.send(place, reason="Worse than before", instead_of="2")
        assert "version 1 put back" in engineer.open(machine(shop))
        assert "is in effect" in engineer.send(f"{machine(shop)}/backups/3", 409, reason="x")
        engineer.open(f"{machine(shop)}/backups/99", 404)

    def test_values_to_enter_are_cards_on_a_phone(self, shop: Shop, operator: Person) -> None:
        """Each says its column: nothing that is entered at the control lies beyond the edge of the screen."""
        run = take(shop, results={"QS146": QS})
        shown = operator.open(f"/kinematics/runs/{run}")
        table = shown[shown.index('<table class="table enter as-cards"') :]
        assert re.search(r'<td class="num enter-value" data-label="To enter">', table)

    def test_a_refused_run_says_why_and_asks_for_nothing(self, shop: Shop, operator: Person) -> None:
        shop.call("PUT", f"/machines/{shop.machine}/kinematics", ball_radius=RADIUS, max_dev_cal_ball=0.01, reason="x")
        run = take(shop, axes=[touched(radius=RADIUS + 0.02)])
        shown = words(operator.open(f"/kinematics/runs/{run}"))
        assert (
            "The measured sphere radius is 12.5200 mm, the calibrated radius 12.5000 mm: the difference exceeds ±10 µm"
            in shown
        )
        assert "Mark as entered" not in shown
        assert 'data-state="refused"' in in_list(operator, shop)
        assert "Values to enter" not in shown
        operator.open(f"/kinematics/runs/{run}/protocol")

    def test_addresses_that_are_not_there(self, shop: Shop, operator: Person) -> None:
        run = take(shop, results={"QS146": QS})
        operator.open("/kinematics/runs/999999", 404)
        operator.open(f"/kinematics/runs/{run}/nonsense", 404)
        operator.send(f"/kinematics/runs/{run}/nonsense", 404, reason="x")
        operator.open("/kinematics/machines/nowhere", 404)
        operator.open("/kinematics/compare?run=999999", 404)
        operator.open("/kinematics/compare?run=x", 422)


def _as_old_controls_write(text: str) -> bytes:
    head = '<head><meta http-equiv="Content-Type" content="text/html; charset=windows-1250">'
    return text.replace("\N{MINUS SIGN}", "-").replace("<head>", head).encode("cp1250")
