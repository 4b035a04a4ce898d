"""Gauge studies of stored readings: one part probed again and again, its touches, and the R33 that follows."""

from random import Random
from typing import Any

import pytest

from tests.quality.gauge_studies.test_studies import refused, send, single
from tests.shop import Person, Shop


def take(shop: Shop, first: int, through: int, status: int = 201, **more: Any) -> Any:
    given: dict[str, Any] = {
        "kind": "type_one",
        "characteristic": shop.characteristic,
        "gauge": "Probe T8",
        "reference": 40.0,
    }
    return shop.call(
        "POST", "/gauge-studies/from-readings", status, **(given | {"first": first, "through": through} | more)
    )


def probe(shop: Shop, count: int, sigma: float = 0.2, seed: int = 1) -> list[float]:
    """Readings of one part, µm from the target, none of which corrects anything."""
    rng = Random(seed)
    values = [round(rng.gauss(0, sigma), 3) for _ in range(count)]
    shop.push(values)
    return values


def test_repeated_probing_without_what_was_excluded_and_probe_faults(shop: Shop) -> None:
    values = probe(shop, 29)
    shop.call("POST", f"/readings/{shop.characteristic}/3/exclude", reason="chip")
    shop.read(1500.0)  # beyond R36: no measurement of a part
    study = take(shop, 1, 30)
    assert study["settings"]["source"] == {
        "first": 1,
        "through": 30,
        "take": "readings",
        "empirical_values": [{"from": 1, "value": 0.0}],
        "left_out": [3, 30],
    }
    kept = [round(40 + value / 1000, 6) for place, value in enumerate(values) if place != 2]
    assert study["rows"] == [{"values": pytest.approx(kept)}]
    assert study["type_one"]["tolerance"] == 0.016


def test_a_study_stays_as_it_is_whatever_becomes_of_the_readings(shop: Shop) -> None:
    probe(shop, 12)
    study = take(shop, 1, 12, key="probing")
    shop.call("POST", f"/readings/{shop.characteristic}/3/exclude", reason="chip")
    assert take(shop, 1, 12, 200, key="probing")["rows"] == study["rows"]
    take(shop, 2, 12, 409, key="probing")
    assert shop.call("GET", f"/gauge-studies/{study['id']}")["rows"] == study["rows"]


def test_values_are_those_that_decisions_use(shop: Shop) -> None:
    """With an empirical value of 3 µm a part of 40 mm is read as 40.003, and the measuring system as it is used says 40."""
    shop.call("PUT", f"/machines/{shop.machine}/averages/5", empirical_value=0.003, reason="against the CMM")
    sizes = [3.0, 3.2, 2.8, 3.1, 2.9] * 5
    shop.push(sizes)
    study = take(shop, 1, 25)
    assert study["rows"] == [{"values": pytest.approx([round(40 + (size - 3) / 1000, 6) for size in sizes])}]
    assert study["bias"]["bias"] == pytest.approx(0.0, abs=1e-9)
    assert study["taken_from"] == f"readings 1 to 25 of {shop.characteristic}; less the empirical value +3.0 µm"
    assert study["caution"] is None
    key = f"touched-{shop.machine}"
    shop.add(key, repeats=2)
    shop.call("POST", "/readings", 201, characteristic=key, touches=[[40.0031, 40.0029]])
    touched = take(shop, 1, 1, kind="bias", take="touches", characteristic=key)
    assert touched["rows"] == [{"values": pytest.approx([40.0001, 39.9999])}]


def test_an_empirical_value_that_changed_inside_the_study_is_seen(viewer: Person, shop: Shop) -> None:
    probe(shop, 10)
    shop.call("PUT", f"/machines/{shop.machine}/averages/5", empirical_value=0.002, reason="against the CMM")
    probe(shop, 10, seed=2)
    study = take(shop, 1, 20)
    assert study["settings"]["source"]["empirical_values"] == [{"from": 1, "value": 0.0}, {"from": 11, "value": 0.002}]
    said = "The empirical value changed inside this study (+0.0 µm from reading 1 on, +2.0 µm from reading 11 on)"
    assert study["caution"].startswith(said)
    assert said in viewer.open(f"/gauges/{study['id']}")
    assert take(shop, 11, 20)["caution"] is None


def test_readings_that_are_not_there(shop: Shop) -> None:
    assert "no reading yet" in refused(take(shop, 1, 10, 422))
    probe(shop, 3)
    assert "there are readings 1 to 3" in refused(take(shop, 4, 10, 422))
    assert "exchange the two" in refused(take(shop, 3, 1, 422))
    assert take(shop, 1, 10)["refused"], "three values say too little, and that is said"
    assert "none of these readings came as touches" in refused(take(shop, 1, 3, 422, take="touches"))
    assert "take the touches" not in refused(take(shop, 1, 3, 422, kind="grr")).lower()
    for wrong in ({"first": 0}, {"through": -1}, {"take": "everything"}, {"kind": "linearity"}):
        take(shop, **({"first": 1, "through": 3, "status": 422} | wrong))
    take(shop, 1, 3, 404, characteristic="nobody")
    shop.call("POST", f"/readings/{shop.characteristic}/2/exclude", reason="chip")
    assert "excluded" in refused(take(shop, 2, 2, 422))


def test_touches_are_repeats_and_each_reading_a_part(shop: Shop) -> None:
    key, rng = f"touched-{shop.machine}", Random(7)
    shop.add(key, repeats=3)
    sent = []
    for part in range(6):
        touches = [round(40 + part * 0.0004 + rng.gauss(0, 0.0001), 6) for _ in range(3)]
        shop.call("POST", "/readings", 201, characteristic=key, touches=[touches])
        sent.append(touches)
    study = take(shop, 1, 6, kind="grr", take="touches", characteristic=key, reference=None)
    assert [row["values"] for row in study["rows"]] == sent
    assert [row["part"] for row in study["rows"]] == ["1", "2", "3", "4", "5", "6"]
    assert (study["settings"]["each"], study["settings"]["source"]["take"]) == ("touch", "touches")
    bias = take(shop, 1, 6, kind="bias", take="touches", characteristic=key)
    assert bias["bias"]["readings"] == 18


class TestZeroRange:
    def test_by_hand_from_repeatability_alone(self, shop: Shop) -> None:
        """s of one reading 0.2 µm: three of them, rounded up to a tenth of a µm."""
        values = [40.0 - 0.0002, 40.0 + 0.0002] * 25
        s = 0.0002 * (50 / 49) ** 0.5
        study = send(shop, "type_one", [{"values": values}], reference=40.0, characteristic=shop.characteristic)
        assert study["bias"]["repeatability"] == pytest.approx(s)
        assert study["zero_range"]["zero_range"] == pytest.approx(0.0007)  # 3 × 0.20203 µm = 0.606 µm
        assert study["zero_range"]["fits"] is True
        assert any("Too few readings" in each for each in study["zero_range"]["reasoning"])

    def test_touches_count_by_the_root_of_their_number(self, shop: Shop) -> None:
        key = f"four-{shop.machine}"
        shop.add(key, repeats=4)
        rows = [{"values": [40.0 - 0.0004, 40.0 + 0.0004] * 25}]
        study = send(shop, "type_one", rows, reference=40.0, characteristic=key, each="touch")
        assert study["zero_range"]["zero_range"] == pytest.approx(0.0007)  # 3 × 0.404/2 µm
        assert "R27 = 4" in study["zero_range"]["reasoning"][0]

    def test_parts_that_scatter_more_decide_and_may_leave_no_room_below_r34(self, shop: Shop) -> None:
        rng = Random(5)
        shop.push([round(rng.gauss(0, 2.0), 3) for _ in range(60)])
        study = send(shop, "type_one", single(), reference=40.0, characteristic=shop.characteristic)
        assert study["zero_range"]["zero_range"] > 0.004
        assert any("from part to part" in each for each in study["zero_range"]["reasoning"])

    def test_a_signal_path_is_a_floor(self, shop: Shop) -> None:
        shop.call(
            "PATCH",
            f"/machines/{shop.machine}",
            signal_path="plc",
            probing_feed=600,
            signal_delay=0.25,
        )
        study = send(shop, "type_one", single(sigma=0.00001), reference=40.0, characteristic=shop.characteristic)
        assert study["zero_range"]["zero_range"] >= 600 / 60 * 0.25 / 1000

    def test_a_handful_of_values_suggests_nothing(self, shop: Shop) -> None:
        few = [{"values": [40.0, 40.001, 40.0, 40.001]}]
        study = send(shop, "bias", few, reference=40.0, characteristic=shop.characteristic)
        assert study["bias"] is not None
        assert study["zero_range"] is None
