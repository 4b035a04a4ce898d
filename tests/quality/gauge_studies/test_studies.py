"""Gauge studies through the API: published ones, halves of them, put right, taken from readings, and what R33 follows."""

import json
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from random import Random
from typing import Any

import pytest

from app.quality.proof.cases import FOLDER
from tests.servers import Server
from tests.shop import Person, Shop, unique

CASES = json.loads((FOLDER / "gauge.json").read_text())
Rows = list[dict[str, Any]]


def aiag(scale: float = 1.0, offset: float = 0.0) -> Rows:
    """Ten parts, three appraisers, three trials, as the manual prints them."""
    lines = CASES[0]["given"]["readings"]
    return [
        {
            "part": str(part + 1),
            "operator": "ABC"[operator],
            "values": [round(offset + scale * lines[operator * 3 + trial][part], 6) for trial in range(3)],
        }
        for operator in range(3)
        for part in range(10)
    ]


def send(shop: Shop, kind: str, rows: Rows, status: int = 201, **more: Any) -> Any:
    given = {"kind": kind, "machine": shop.machine, "gauge": "Probe T8", "rows": rows} | more
    return shop.call("POST", "/gauge-studies", status, **given)


def single(count: int = 30, sigma: float = 0.0002, mean: float = 40.0003, seed: int = 1) -> Rows:
    rng = Random(seed)
    return [{"values": [round(rng.gauss(mean, sigma), 6) for _ in range(count)]}]


def components(study: Any, method: str) -> dict[str, Any]:
    (found,) = [each for each in study["grr"] if each["method"] == method]
    return {each["name"]: each for each in found["components"]} | {"all": found}


def refused(answer: Any) -> str:
    return " ".join(f"{each['field']}: {each['message']}" for each in answer["errors"])


class TestInches:
    """A size in inches is named, at its field."""

    def test_of_a_reference_and_of_one_value(self, shop: Shop) -> None:
        assert send(shop, "bias", single(), reference=40.0)["warnings"] == []
        (warning,) = send(shop, "bias", single(), reference=1.5748)["warnings"]
        assert (warning["code"], warning["field"]) == ("looks_like_inches", "reference")
        rows = aiag(0.001, 40.0)
        rows[3]["values"][1] = 1.5748
        (warning,) = send(shop, "grr", rows)["warnings"]
        assert warning["field"] == "rows[3].values[1]"

    def test_of_a_study_that_is_all_in_inches_for_a_characteristic_in_mm(self, shop: Shop) -> None:
        """A scatter in inches would look 25 times as small as it is, against the tolerance in mm."""
        rows = single(mean=1.5748, sigma=0.00001)
        (warning,) = send(shop, "bias", rows, reference=1.5748, characteristic=shop.characteristic)["warnings"]
        assert warning["field"] == "rows[0].values"


class TestPublished:
    def test_the_study_of_the_manual_by_both_methods(self, shop: Shop) -> None:
        study = send(shop, "grr", aiag(), tolerance=8.0)
        anova, ranges = components(study, "anova"), components(study, "average_range")
        assert anova["grr"]["percent"] == pytest.approx(27.86, abs=0.005)
        assert anova["grr"]["percent_tolerance"] == pytest.approx(22.68, abs=0.005)
        assert anova["part"]["percent_tolerance"] == pytest.approx(78.17, abs=0.005)
        assert (anova["all"]["ndc"], anova["all"]["pooled"], anova["all"]["zeroed"]) == (4, True, [])
        assert "interaction" not in anova
        assert ranges["grr"]["percent"] == pytest.approx(26.68, abs=0.02)
        assert ranges["all"]["ndc"] == 5
        verdicts = {each["name"]: each["verdict"] for each in study["verdicts"]}
        assert verdicts["ndc"] == "too few"
        assert verdicts["GRR of the variation"] == "usable with care"
        assert study["zero_range"] is None, "it serves no characteristic"

    def test_an_interaction_that_counts_stands_by_itself(self, shop: Shop) -> None:
        (case,) = [each for each in CASES if each["name"] == "R&R with an interaction that counts"]
        lines = case["given"]["readings"]
        rows = [
            {"part": str(p), "operator": str(o), "values": [lines[o * 3 + t][p] for t in range(3)]}
            for p in range(10)
            for o in range(3)
        ]
        found = components(send(shop, "grr", rows), "anova")
        assert found["all"]["pooled"] is False
        assert found["interaction"]["sigma"] == pytest.approx(0.73**0.5, abs=0.004)
        assert [line["source"] for line in found["all"]["table"]][2] == "interaction"

    def test_a_linearity_study(self, shop: Shop) -> None:
        (given,) = [each["given"] for each in CASES if each["kind"] == "linearity"]
        rows = [
            {"reference": r, "values": values} for r, values in zip(given["references"], given["readings"], strict=True)
        ]
        found = send(shop, "linearity", rows)["linearity"]
        assert found["slope"]["value"] == pytest.approx(-0.131667, abs=1e-6)
        assert found["slope"]["p_value"] < 1e-9
        assert found["biases"]["4"] == pytest.approx(0.125)

    def test_type_one_by_hand(self, shop: Shop) -> None:
        """s = 1 µm, bias 1 µm, T = 60 µm: Cg = 12/6 = 2, Cgk = (6 - 1)/3."""
        spread = 0.001 * (49 / 32) ** 0.5  # of 16 values each side, so that s is 1 µm
        values = [25.001 - spread, 25.001 + spread] * 16 + [25.001] * 18
        study = send(shop, "type_one", [{"values": values}], reference=25.0, tolerance=0.06)
        assert (study["type_one"]["cg"], study["type_one"]["cgk"]) == pytest.approx((2.0, 5 / 3))
        assert [each["verdict"] for each in study["verdicts"]] == [
            "capable",
            "capable",
            "significant",
            "fine enough",
        ]


class TestHalfStudies:
    LONG = (
        (1, "A 40.0123 40.0093 B 40.0104 40.0101 C 40.0108 40.0086"),
        (2, "A 40.0196 40.0192 B 40.0189 40.0192 C 40.0195 40.0197"),
        (3, "A 40.0291 40.0304 B 40.0295 40.0268 C 40.0312 40.0296"),
    )

    def test_one_row_a_reading_is_the_same_study(self, shop: Shop) -> None:
        cells = [
            {"part": str(part), "operator": operator, "values": [float(one), float(two)]}
            for part, text in self.LONG
            for operator, one, two in zip(*[iter(text.split())] * 3, strict=True)
        ]
        long = [cell | {"values": [value]} for cell in cells for value in cell["values"]]
        of_cells = send(shop, "grr", cells, characteristic=shop.characteristic)
        body: dict[str, Any] = {"kind": "grr", "gauge": "Probe", "characteristic": shop.characteristic, "rows": long}
        study = shop.call("POST", "/gauge-studies", 201, **body)  # the machine is that of the characteristic
        assert study["grr"] == of_cells["grr"]
        assert "machine" in refused(shop.call("POST", "/gauge-studies", 422, kind="grr", gauge="P", rows=long))

    def test_unequal_trials_are_refused_by_name_or_cut_if_that_is_wanted(self, shop: Shop) -> None:
        rows = aiag()
        rows[12]["values"].pop()
        answer = send(shop, "grr", rows, 422)
        assert "part 3 by B has 2 values, others have 3" in refused(answer)
        study = send(shop, "grr", rows, unbalanced="fewest")
        assert study["values_left_out"] == 29
        assert components(study, "anova")["all"]["trials"] == 2

    def test_what_is_missing_is_named(self, shop: Shop) -> None:
        rows = aiag()
        rows.pop(12)
        assert "part 3 was not measured by B" in refused(send(shop, "grr", rows, 422))
        twice = [*aiag(), aiag()[0]]
        assert "part 1 by A is there twice" in refused(send(shop, "grr", twice, 422))
        assert "one part does not show" in refused(send(shop, "grr", aiag()[:1], 422))
        one_trial = [row | {"values": row["values"][:1]} for row in aiag()]
        assert "at least two values" in refused(send(shop, "grr", one_trial, 422))
        assert "rows[0].operator" in refused(send(shop, "grr", [{"part": "1", "values": [1.0, 2.0]}] * 2, 422))

    @pytest.mark.parametrize("value", ["40,1", "forty", None, True, 1e9, "nan", [1.0]])
    def test_what_is_no_length_is_no_value(self, shop: Shop, value: Any) -> None:
        rows: Rows = [{"part": "1", "operator": "A", "values": [40.0, value]}]
        assert "rows[0].values[1]" in refused(send(shop, "grr", rows, 422)).replace(".1", "[1]")
        assert shop.call("GET", f"/gauge-studies?machine={shop.machine}")["items"] == []

    def test_one_operator_says_nothing_of_reproducibility(self, shop: Shop) -> None:
        study = send(shop, "grr", [row for row in aiag() if row["operator"] == "A"])
        found = components(study, "anova")
        assert found["reproducibility"]["sigma"] == 0.0
        assert [line["source"] for line in found["all"]["table"]] == ["part", "repeatability", "total"]
        assert found["grr"]["sigma"] == found["repeatability"]["sigma"]

    def test_negative_components_are_said_to_count_as_nothing(self, shop: Shop) -> None:
        rng = Random(4)
        rows: Rows = [
            {"part": str(part), "operator": operator, "values": [round(40 + rng.gauss(0, 0.01), 4) for _ in range(3)]}
            for part in range(8)
            for operator in "AB"
        ]
        found = components(send(shop, "grr", rows), "anova")
        assert found["all"]["zeroed"]
        for name in found["all"]["zeroed"]:
            assert found[name]["sigma"] == 0.0

    def test_equal_values_are_kept_and_say_why_they_say_nothing(self, shop: Shop) -> None:
        equal = send(shop, "type_one", [{"values": [40.0] * 30}], reference=40.0, tolerance=0.016)
        assert "All values are the same" in equal["refused"]
        assert equal["type_one"] is None
        rows: Rows = [{"part": part, "operator": "A", "values": [1.0, 1.0]} for part in "12"]
        assert "same" in send(shop, "grr", rows)["refused"]
        apart = [row | {"values": [float(row["part"]), float(row["part"])]} for row in aiag()]
        found = send(shop, "grr", apart)
        assert (found["grr"], found["verdicts"]) == ([], []), "cells of equal values know no repeatability"
        few = send(shop, "type_one", [{"values": [40.0, 40.1]}], reference=40.0, tolerance=0.016)
        assert "8 are missing" in few["refused"]
        assert few["bias"] is not None

    def test_the_tolerance_is_that_of_the_characteristic_unless_it_is_said(self, shop: Shop) -> None:
        assert "tolerance" in refused(send(shop, "type_one", single(), 422, reference=40.0))
        served = send(shop, "type_one", single(), reference=40.0, characteristic=shop.characteristic)
        assert served["type_one"]["tolerance"] == 0.016
        said = send(shop, "type_one", single(), reference=40.0, characteristic=shop.characteristic, tolerance=0.032)
        assert said["type_one"]["cg"] == pytest.approx(2 * served["type_one"]["cg"])
        without = components(send(shop, "grr", aiag()), "anova")
        assert without["grr"]["percent_tolerance"] is None
        assert "reference" in refused(send(shop, "bias", single(), 422))

    def test_other_refusals(self, shop: Shop) -> None:
        other = Shop(shop.server)
        assert "belongs to machine" in refused(send(shop, "grr", aiag(), 422, characteristic=other.characteristic))
        send(shop, "grr", aiag(), 404, characteristic="nobody")
        assert "is there twice" in refused(send(shop, "linearity", [{"reference": 1.0, "values": [1.0]}] * 2, 422))
        assert "two references" in refused(send(shop, "linearity", [{"reference": 1.0, "values": [1.0, 1.1]}], 422))
        send(shop, "type_two", single(), 422)
        send(shop, "bias", [], 422, reference=40.0)
        shop.call("GET", "/gauge-studies/999999", 404)
        shop.call("GET", "/gauge-studies/0", 404)
        shop.call("GET", "/gauge-studies/99999999999999999999999", 404)


class TestKeeping:
    def test_sent_again_nothing_happens_twice(self, shop: Shop) -> None:
        key = unique("study")
        first = send(shop, "grr", aiag(), key=key)
        assert send(shop, "grr", aiag(), 200, key=key) == first
        send(shop, "grr", aiag(scale=2), 409, key=key)

    def test_two_at_once_with_one_key_make_one_study(self, shop: Shop) -> None:
        with ThreadPoolExecutor(4) as pool:
            given = {"kind": "grr", "machine": shop.machine, "gauge": "Probe", "rows": aiag(), "key": unique("twice")}
            answers = list(
                pool.map(lambda _n: shop.admin.post("/api/v1/gauge-studies", json=given).status_code, range(4))
            )
        assert sorted(answers) == [200, 200, 200, 201]
        assert len(shop.call("GET", f"/gauge-studies?machine={shop.machine}")["items"]) == 1

    def test_parts_that_differ_and_repeats_that_do_not_are_distinguished(self, shop: Shop) -> None:
        def rows(step: float) -> list[dict[str, Any]]:
            return [
                {"part": str(part), "operator": who, "values": [40 + step * part] * 3}
                for part in range(5)
                for who in "AB"
            ]

        assert send(shop, "grr", rows(0.001))["refused"].startswith("The repeats of every part are the same.")
        assert send(shop, "grr", rows(0.0))["refused"].startswith("All values are the same.")

    def test_put_right_with_a_reason_and_nothing_lost(self, shop: Shop) -> None:
        study = send(shop, "grr", aiag())
        path, rows = f"/gauge-studies/{study['id']}", aiag()
        shop.call("PUT", path, 422, gauge="Probe T8", rows=rows)
        same = shop.call("PUT", path, 422, gauge="Probe T8", rows=rows, reason="typo")
        assert "nothing differs" in refused(same)
        rows[0]["values"][0] = 0.3
        changed = shop.call("PUT", path, 200, gauge="Probe T8", rows=rows, reason="typed 0.29 for 0.30")
        assert (changed["revision"], changed["reason"]) == (2, "typed 0.29 for 0.30")
        old = shop.call("GET", f"{path}?revision=1")
        assert (old["rows"], old["newest_revision"]) == (aiag(), 2)
        shop.call("GET", f"{path}?revision=3", 404)
        (change, *_rest) = shop.call("GET", f"/audit?subject=gauge-study/{study['id']}")["items"]
        assert change["after"]["rows"][0]["values"][0] == 0.3

    def test_of_two_who_put_the_same_revision_right_the_second_is_informed(self, engineer: Person, shop: Shop) -> None:
        study = send(shop, "bias", single(), reference=40.0)
        path, given = f"/gauge-studies/{study['id']}", {"gauge": "P", "reference": 40.0, "reason": "typed wrongly"}
        with ThreadPoolExecutor(2) as pool:
            bodies = [given | {"rows": single(seed=seed), "seen_revision": 1} for seed in (5, 6)]
            answers = list(pool.map(lambda body: shop.admin.put(f"/api/v1{path}", json=body), bodies))
        assert sorted(answer.status_code for answer in answers) == [200, 409]
        told = next(answer.json() for answer in answers if answer.status_code == 409)
        assert "has made revision 2 meanwhile" in told["detail"]
        # On the page: what was typed stays, and whoever was told may store it all the same.
        form: dict[str, Any] = {
            "gauge": "P",
            "reference": "40.0",
            "lines": "1",
            "reason": "read wrongly",
            "do": "store",
        }
        form |= {f"c_0_{at}": f"40.00{at}" for at in range(9)}
        page = engineer.send(f"/gauges/{study['id']}/correct", 409, seen_revision="1", **form)
        assert "has made revision 2 meanwhile" in page
        assert 'value="40.007"' in page
        assert 'name="seen_revision" value="2"' in page
        engineer.send(f"/gauges/{study['id']}/correct", seen_revision="2", **form)
        assert shop.call("GET", path)["revision"] == 3

    def test_who_may(self, server: Server, shop: Shop) -> None:
        study = send(shop, "bias", single(), reference=40.0)
        roles = {role: server.client(server.key(role)) for role in ("viewer", "operator", "engineer")}
        body: dict[str, Any] = {
            "kind": "bias", "machine": shop.machine, "gauge": "P", "reference": 40.0, "rows": single(seed=2)
        }  # fmt: skip
        shop.call("POST", "/gauge-studies", 403, roles["viewer"], **body)
        shop.call("POST", "/gauge-studies", 201, roles["operator"], **body)
        path, right = f"/gauge-studies/{study['id']}", {"gauge": "P", "reference": 40.0, "rows": single(seed=3)}
        shop.call("PUT", path, 403, roles["operator"], reason="x", **right)
        shop.call("PUT", path, 200, roles["engineer"], reason="x", **right)
        shop.call("GET", path, 200, roles["viewer"])
        shop.call("GET", path, 403, Shop(server).machine_client)

    def test_pages_of_the_list(self, shop: Shop) -> None:
        made = [send(shop, "bias", single(seed=seed), reference=40.0)["id"] for seed in range(3)]
        first = shop.call("GET", f"/gauge-studies?machine={shop.machine}&limit=2")
        rest = shop.call("GET", f"/gauge-studies?machine={shop.machine}&limit=2&before={first['next']}")
        assert [each["id"] for each in first["items"] + rest["items"]] == made[::-1]
        assert rest["next"] is None
        assert shop.call("GET", f"/gauge-studies?characteristic={shop.characteristic}")["items"] == []


@pytest.mark.parametrize(
    ("kind", "rows", "picture"),
    [
        ("type_one", single, "values"),
        ("grr", aiag, "components"),
        ("grr", aiag, "parts"),
        ("grr", aiag, "operators"),
        ("linearity", lambda: [{"reference": r, "values": [r + 0.1, r - 0.1, r]} for r in (1.0, 2.0)], "values"),
    ],
)
def test_figures_are_drawn(shop: Shop, kind: str, rows: Callable[[], Rows], picture: str) -> None:
    study = send(shop, kind, rows(), reference=40.0, tolerance=0.016)
    for theme in ("light", "dark"):
        figure = shop.call("GET", f"/gauge-studies/{study['id']}/figure?picture={picture}&theme={theme}")
        assert figure["data"]
