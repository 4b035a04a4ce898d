"""Program text over REST: read, written, made into a characteristic, and back."""

import time
from typing import Any

import pytest

from app.loop.programs.queries import guessed
from tests.shop import Shop

L15 = """L15
N5 R103 R115 R240 R250 R271 R281 R292 R301
N10 R33=0,001 R44=0.0053 R36=1 R37=0.3
N12 R33=R50*2
N13 R33=0.0012
N15 R400 R41-0.016 R4240
N20 L75
N25 L93
N30 M17
"""
BORE = "#505=40. (NOMINAL)\n#506=0.025\n#507=0.\nG65 P9011 A3.\n#510=40.012\n#511=40.013\n#512=40.011"


def read(shop: Shop, text: str, **more: Any) -> Any:
    return shop.call("POST", "/programs/read", 200, text=text, **more)


def written(shop: Shop, key: str, status: int = 200, **query: Any) -> str:
    answer = shop.admin.get(f"/api/v1/characteristics/{key}/program", params=query)
    assert answer.status_code == status, answer.text
    return answer.text


def test_the_control_is_guessed_at_once_however_many_lines_look_like_it() -> None:
    """Nothing else runs while a text is searched: thousands of lines must not each be searched to the end of the text."""
    begun = time.thread_time()
    assert guessed(("#" + " " * 14 + "\n") * 4000) == "sinumerik"
    assert time.thread_time() - begun < 2, "seconds of the processor"
    assert guessed("%\nO9011 (BORE)\nN5 # 505 = 40.\n") == "fanuc"


class TestReading:
    def test_every_line_has_its_verdict(self, shop: Shop) -> None:
        answer = read(shop, L15)
        assert [line["verdict"] for line in answer["lines"]] == [
            "understood",
            "understood",
            "understood",
            "not_understood",
            "understood",
            "understood",
            "understood",
            "understood",
            "ignored",
        ]
        assert answer["not_understood"] == 1
        assert "R50*2" in answer["lines"][3]["notes"][0]["text"]
        assert any("R34" in note["text"] and note["warning"] for note in answer["lines"][2]["notes"])
        assert (answer["control"], answer["program"]["kind"]) == ("sinumerik", "measuring")

    def test_what_is_missing_is_said_with_the_names_of_the_api(self, shop: Shop) -> None:
        answer = read(shop, L15)
        assert [problem["field"] for problem in answer["problems"]] == ["parameters.factor"]
        assert answer["program"]["parameters"]["zero_range"] == 0.0012

    def test_macro_variables_are_recognised_by_their_looks(self, shop: Shop) -> None:
        answer = read(shop, BORE)
        assert answer["control"] == "fanuc"
        assert answer["problems"] == []
        assert answer["program"]["parameters"]["accept"] == {"n": 2, "m": 3}
        assert answer["program"]["touches"] == [[40.012], [40.013], [40.011]]

    @pytest.mark.parametrize("text", ["", "  \n ", "\x01\x02\x03\x04\x05\x06\x07\x08\x0e\x0f\x10", "R33=1\n" * 12_000])
    def test_what_is_no_program_is_refused_in_words(self, shop: Shop, text: str) -> None:
        answer = shop.admin.post("/api/v1/programs/read", json={"text": text})
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["field"] == "text"

    def test_a_machine_may_not_read_programs_for_others(self, shop: Shop) -> None:
        shop.call("POST", "/programs/read", 403, shop.machine_client, text="R33=1")


class TestWriting:
    def test_text_becomes_a_characteristic_and_the_same_text_again(self, shop: Shop) -> None:
        parameters = read(shop, L15)["program"]["parameters"] | {"factor": -1}
        key = f"{shop.characteristic}-text"
        made = shop.call(
            "POST", "/characteristics", 201, key=key, name="Sitz Ø40", machine=shop.machine, parameters=parameters
        )
        text = written(shop, key)
        again = read(shop, text)
        assert again["not_understood"] == 0
        assert again["program"]["about"] == {"characteristic": key, "name": "Sitz Ø40"}
        other = shop.call(
            "POST",
            "/characteristics",
            201,
            key=f"{key}-2",
            name="Sitz Ø40",
            machine=shop.machine,
            parameters=again["program"]["parameters"],
        )
        assert other["parameters"] == made["parameters"]
        assert written(shop, f"{key}-2").replace(f"{key}-2", key) == text

    def test_both_systems_in_both_directions(self, shop: Shop) -> None:
        before = shop.call("GET", f"/characteristics/{shop.characteristic}")["parameters"]
        for control in ("sinumerik", "fanuc"):
            answer = read(shop, written(shop, shop.characteristic, control=control), control=control)
            changed = shop.call(
                "PATCH",
                f"/characteristics/{shop.characteristic}",
                parameters=answer["program"]["parameters"],
                reason="read back",
            )
            assert changed["parameters"] == before
            assert changed["parameters_version"] == 1

    def test_it_is_a_file_of_its_own_name(self, shop: Shop) -> None:
        answer = shop.admin.get(f"/api/v1/characteristics/{shop.characteristic}/program")
        assert answer.headers["content-type"] == "text/plain; charset=utf-8"
        assert answer.headers["content-disposition"] == f'attachment; filename="{shop.characteristic}-L15.spf"'

    def test_the_calibration_has_the_gauge_or_says_that_it_has_not(self, shop: Shop) -> None:
        with_it = written(
            shop, shop.characteristic, kind="calibration", gauge=199.852, surface="groove", probe="radial"
        )
        assert "R32=199.852" in with_it
        assert "R21=0 R22=2 R23=1" in with_it
        without = written(shop, shop.characteristic, kind="calibration")
        assert "(R32 IS THE TARGET: WRITE THE SIZE OF YOUR GAUGE THERE)" in without.splitlines()
        ring = written(shop, shop.characteristic, kind="calibration", control="fanuc", gauge=40.002)
        assert "#505=40.002 (SIZE OF THE RING)" in ring

    @pytest.mark.parametrize(
        "query", [{"control": "heidenhain"}, {"kind": "x"}, {"gauge": "-1"}, {"gauge": "NaN"}, {"gauge": "1e99"}]
    )
    def test_bad_wishes_are_refused(self, shop: Shop, query: dict[str, str]) -> None:
        written(shop, shop.characteristic, 422, **query)

    def test_a_control_without_measuring_programs_is_asked_for_another(self, shop: Shop) -> None:
        shop.call("PATCH", f"/machines/{shop.machine}", control="heidenhain")
        answer = shop.admin.get(f"/api/v1/characteristics/{shop.characteristic}/program")
        assert answer.status_code == 422
        assert answer.json()["errors"][0]["field"] == "control"
        assert written(shop, shop.characteristic, control="fanuc")

    def test_a_machine_sees_its_own_only(self, shop: Shop, server: Any) -> None:
        other = Shop(server)
        shop.call("GET", f"/characteristics/{other.characteristic}/program", 403, shop.machine_client)
        assert shop.machine_client.get(f"/api/v1/characteristics/{shop.characteristic}/program").status_code == 200


def test_what_does_not_fit_is_warned_of_while_reading(shop: Shop) -> None:
    shop.call("PATCH", f"/machines/{shop.machine}", type="lathe")
    text = "R10=33 R24=1 R28=7 R30=2\nR33=0.001 R36=1 R37=0.3 R40=0 R41=-0.016 R42=40\n(INBAND FACTOR=-1)\nL75\nL93"
    answer = read(shop, text, machine=shop.machine)
    assert [problem["field"] for problem in answer["problems"]] == ["parameters.tool_memory"]
    assert [(each["code"], each["field"].partition(".")[2]) for each in answer["warnings"]] == [
        ("source_range", "tool_memory"),
        ("source_range", "path_factor"),
        ("not_on_lathe", "variant"),
    ]
    unfinished = read(shop, "R25=3 R30=2\nL93")
    assert [each["code"] for each in unfinished["warnings"]] == ["variant_axis", "points_missing"]
    assert read(shop, "R28=7\nL92")["warnings"] == []
    assert [each["field"] for each in read(shop, "R27=11\nL92")["warnings"]] == ["parameters.repeats"]
    shop.call("POST", "/programs/read", 404, text=text, machine="nowhere")


def test_inches_are_answered_as_mm_line_by_line(shop: Shop) -> None:
    answer = read(shop, "G20\n#505=1.5748\n#506=0. 001\n#507=0.\nG65 P9011 A3.")
    assert answer["program"]["parameters"]["nominal"] == 39.99992
    assert "upper_deviation" not in answer["program"]["parameters"]
    notes = [[note["code"] for note in line["notes"]] for line in answer["lines"]]
    assert notes[0] == ["unit_inch"]
    assert notes[2] == ["blank_in_number"]
    assert answer["lines"][1]["notes"][0]["text"] == "#505 = 1.5748 inch = 39.99992 mm nominal"


class TestRing:
    """The programs for the bridge, over REST."""

    def test_each_control_has_its_own(self, shop: Shop) -> None:
        for control, words in (("sinumerik", "PROC INBAND_READING("), ("fanuc", "O9821 ("), ("haas", "O09821 (")):
            text = written(shop, shop.characteristic, ring="reading", control=control, time_out=4)
            assert words in text
            assert words in written(shop, shop.characteristic, ring="all", control=control)
        call = written(shop, shop.characteristic, ring="call", control="haas", number=7, measured="#10188")
        assert "C7. V#10188" in call
        assert shop.characteristic.upper() in call

    def test_what_cannot_be_is_refused_in_words(self, shop: Shop) -> None:
        refused = written(shop, shop.characteristic, 422, ring="all", control="haas", first_register=500)
        assert "must leave 550 to 603 free" in refused
        assert "must be one of" in written(shop, shop.characteristic, 422, ring="definition", control="fanuc")
        assert "haas" in written(shop, shop.characteristic, 422, control="haas")
        written(shop, shop.characteristic, 422, ring="call", control="fanuc", measured="#1) M30")
