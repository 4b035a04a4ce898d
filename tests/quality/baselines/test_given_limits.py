"""Limits given by a customer or a standard, and shifts as they were when a baseline was frozen."""

from contextvars import copy_context
from datetime import time
from typing import Any
from zoneinfo import ZoneInfo

import pytest
from sqlalchemy.orm import Session

from app.language.times import PlantTime, keep_time_of
from app.loop.characteristics.queries import characteristic_named
from app.loop.summaries.queries import window_of
from app.quality.baselines.queries import baseline_in_force, charted
from tests.quality.baselines.rows import control
from tests.quality.chart_signals.line import Line
from tests.shop import Person, Shop

# ISO 8258:1991, 12.1 (ISO 7870-2): packages of tea, standard values 100.6 g and 1.4 g, subgroups of 5. Here 1 g above 100 g is
# 1 µm. Printed: means between 98.7 and 102.5 about 100.6, ranges up to 6.9 about 3.3, no lower limit of ranges.
TEA = {"centre": 0.0006, "sigma": 0.0014}
FIVES: dict[str, Any] = {"chart": "xbar_r", "grouping": "consecutive", "group_size": 5}


@pytest.fixture
def line(shop: Shop) -> Line:
    line = Line(shop, baseline=False)
    shop.characteristic = line.key
    return line


def frozen(line: Line, status: int = 201, **more: Any) -> Any:
    body: dict[str, Any] = {
        "quantity": "deviation",
        "first_sequence": 1,
        "last_sequence": 60,
        "reason": "Drawing 4711",
    } | more
    return line.shop.call("POST", f"/characteristics/{line.key}/baselines", status, **body)


def test_standard_values_of_iso_8258(line: Line) -> None:
    made = frozen(line, **FIVES, limits=TEA)
    assert (made["centre"], made["sigma"], made["estimator"]) == (TEA["centre"], TEA["sigma"], "given")
    assert (made["degrees_of_freedom"], made["readings"], made["provisional"]) == (None, 0, False)
    line.push([2.4] * 5 + [2.6] * 5 + [-1.2] * 5 + [-1.4] * 5 + [0, 6.8, 1, 1, 1] + [0, 7, 1, 1, 1])
    means = control(line.shop, first=61)
    printed = [round(1000 * means["points"][name], 1) for name in ("centre", "upper", "lower")]
    assert printed == [0.6, 2.5, -1.3], "100.6, 102.5 and 98.7 g"
    assert [(s["first"], s["last"], s["side"]) for s in means["signals"] if s["rule"] == "nelson_1"] == [
        (76, 80, -1),
        (66, 70, 1),
    ]
    ranges = control(line.shop, first=61, chart="ranges")
    assert [round(1000 * ranges["points"][name], 1) for name in ("centre", "upper", "lower")] == [3.3, 6.9, 0]
    assert [(s["first"], s["last"]) for s in ranges["signals"]] == [(86, 90)]


def test_two_limits_are_as_good_as_centre_and_sigma(line: Line) -> None:
    """Of means of four, ±12 µm are 8 µm of a single value."""
    four = FIVES | {"group_size": 4, "limits": {"lower": -0.011, "upper": 0.013, "centre": 0.001}}
    made = frozen(line, **four, key="of-the-customer")
    assert (made["centre"], made["sigma"]) == pytest.approx((0.001, 0.008))
    assert (control(line.shop)["points"]["lower"], control(line.shop)["points"]["upper"]) == pytest.approx(
        (-0.011, 0.013)
    )
    assert frozen(line, 200, **four, key="of-the-customer") == made
    frozen(line, 409, **four | {"limits": {"lower": -0.011, "upper": 0.014}}, key="of-the-customer")
    frozen(line, 409, **FIVES | {"group_size": 4}, key="of-the-customer")
    single = frozen(line, limits={"lower": -0.011, "upper": 0.013})
    assert single["sigma"] == pytest.approx(0.004)


def test_one_reading_is_a_period_and_the_next_ones_are_judged(line: Line) -> None:
    path = f"/characteristics/{line.key}/baselines"
    frozen(line, 422, last_sequence=1)
    made = frozen(line, last_sequence=1, limits={"centre": 0.0, "sigma": 0.001})
    assert made["version"] == 1
    line.push([3.1])
    line.look()
    assert ("individuals", "nelson_1", 61, 61) in line.runs()
    again = line.shop.call(
        "POST", f"{path}/preview", quantity="deviation", first_sequence=1, last_sequence=60, limits=TEA
    )
    assert "provisional" not in [each["code"] for each in again["cautions"]]


@pytest.mark.parametrize(
    ("limits", "field"),
    [
        ({}, "limits.centre"),
        ({"centre": 0.0}, "limits.sigma"),
        ({"lower": 0.0}, "limits.upper"),
        ({"lower": 0.0, "upper": 0.01, "sigma": 0.001}, "limits.sigma"),
        ({"lower": 0.01, "upper": 0.01}, "limits.lower"),
        ({"lower": 0.0, "upper": 0.01, "centre": 0.004}, "limits.centre"),
        ({"centre": 0.0, "sigma": 0.0}, "limits.sigma"),
    ],
)
def test_what_does_not_belong_together_is_named(line: Line, limits: dict[str, float], field: str) -> None:
    wrong = frozen(line, 422, limits=limits)
    assert field in [each["field"] for each in wrong["errors"]]


def test_two_limits_do_not_fit_subgroups_of_several_sizes(line: Line) -> None:
    wrong = frozen(line, 422, chart="xbar_s", grouping="part", limits={"lower": -0.01, "upper": 0.01})
    assert "give centre, and the sigma of a single value" in wrong["errors"][0]["message"]


def test_page_and_figure_say_who_gave_the_limits(line: Line, engineer: Person) -> None:
    path = f"/characteristics/{line.key}/control/freeze"
    typed = {"first_sequence": "1", "last_sequence": "60", "limits.centre": "0,0006", "limits.sigma": "0.0014"}
    query = "&".join(f"{name}={value}" for name, value in typed.items())
    text = engineer.open(f"{path}?{query}")
    assert "given by the customer" in text
    assert "centre=0.0006" in text
    wrong = engineer.open(f"{path}?first_sequence=1&last_sequence=60&limits.lower=0.1", 422)
    assert "limits are a lower and an upper one" in wrong
    engineer.post(path, **typed, quantity="deviation", chart="individuals", reason="Drawing 4711")
    shown = engineer.open(f"/characteristics/{line.key}/control")
    assert "degrees of freedom" not in shown
    figure = line.shop.call("GET", f"/characteristics/{line.key}/figures/control")
    assert "limits given by the customer" in str(figure)
    figure = line.shop.call(
        "GET",
        f"/characteristics/{line.key}/figures/baseline?first_sequence=1&last_sequence=60&centre=0.0006&sigma=0.0014",
    )
    assert "limits given by the customer" in str(figure)


def test_a_change_of_shifts_leaves_the_subgroups_of_a_baseline(line: Line) -> None:
    """A reading an hour, frozen with three shifts of eight; then the plant goes over to two of twelve, and to another zone."""
    moments = [f"2026-10-{1 + hour // 24:02d}T{hour % 24:02d}:15:00Z" for hour in range(240)]
    line.shop.push([n % 5 for n in range(240)], line.key, measured_at=moments)
    made = frozen(line, first_sequence=61, last_sequence=290, chart="xbar_s", grouping="shift")
    assert made["shifts"].startswith("06:00,14:00,22:00 ")
    now = PlantTime(ZoneInfo("Asia/Kathmandu"), [time(6), time(18)])
    usual = control(line.shop, first=61)["points"]["size"]

    def changed() -> None:
        keep_time_of(now)
        with Session(line.shop.server.database.engine) as session:
            current = characteristic_named(session, line.key)
            baseline = baseline_in_force(session, current.characteristic)
            assert baseline is not None
            window = window_of(session, current.characteristic, first=61)
            assert charted(session, current, baseline, window).sizes.tolist() == usual
            baseline.shifts = None  # frozen by a program that did not keep them
            assert 12 in charted(session, current, baseline, window).sizes
            session.rollback()

    copy_context().run(changed)
