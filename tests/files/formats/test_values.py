import re
from datetime import UTC, date, datetime
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.files.formats.cell_values import Unreadable, folded, moment, number, zone_named
from app.files.formats.units import unit_in

BELGRADE = ZoneInfo("Europe/Belgrade")


@pytest.mark.parametrize(
    ("text", "decimal", "value"),
    [
        ("39.9981", ".", 39.9981),
        ("39,9981", ",", 39.9981),
        (" +0.5 ", ".", 0.5),
        ("\N{MINUS SIGN}0,004", ",", -0.004),
        ("\N{NO-BREAK SPACE}40", ",", 40.0),
        ("1e-3", ".", 0.001),
        (".5", ".", 0.5),
        ("40.", ".", 40.0),
    ],
)
def test_numbers_as_people_write_them(text: str, decimal: str, value: float) -> None:
    assert number(text, decimal) == value


@pytest.mark.parametrize(
    ("text", "decimal", "why"),
    [
        ("", ".", "is empty"),
        ("1.234,5", ",", "separator of thousands"),
        ("39.998", ",", "has a point, but decimals are read with a comma"),
        ("39,998", ".", "has a comma"),
        ("39.998 mm", ".", "without a unit"),
        ("NaN", ".", "is not a number"),
        ("inf", ".", "is not a number"),
        ("1e999", ".", "too large"),
        ("0x10", ".", "is not a number"),
        ("1_000", ".", "is not a number"),
        ("٣٩", ".", "is not a number"),
    ],
)
def test_what_is_not_a_number_is_refused_with_its_reason(text: str, decimal: str, why: str) -> None:
    with pytest.raises(Unreadable, match=why):
        number(text, decimal)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_every_finite_number_is_read_back_exactly(value: float) -> None:
    assert number(repr(value), ".") == value
    assert number(repr(value).replace(".", ","), ",") == value


@pytest.mark.parametrize(
    "text",
    [
        "2026-11-21T08:15:02+01:00",
        "2026-11-21T07:15:02Z",
        "2026-11-21 08:15:02",
        "2026-11-21 08:15:02 +0100",
        "21.11.2026 08:15:02",
        "21.11.2026. 08:15:02",
        "21. 11. 2026 8:15:02",
        "20261121081502",
        "20261121 081502",
    ],
)
def test_times_as_people_write_them(text: str) -> None:
    assert moment(text, BELGRADE) == datetime(2026, 11, 21, 7, 15, 2, tzinfo=UTC)


def test_a_form_is_named_that_reads_the_time() -> None:
    for text, form in (("11/18/25 6:05 AM", "%m/%d/%y %I:%M %p"), ("18.11.25 06:05:11", "%d.%m.%y %H:%M:%S")):
        with pytest.raises(Unreadable, match=re.escape(form)):
            moment(text, UTC_ZONE)
        assert moment(text, UTC_ZONE, form).date() == date(2025, 11, 18)


def test_parts_of_a_second_and_of_a_day() -> None:
    assert moment("21.11.2026 08:15:02,120", UTC_ZONE).microsecond == 120_000
    assert moment("21.11.2026", UTC_ZONE) == datetime(2026, 11, 21, tzinfo=UTC)
    assert moment("11/21/2026 08:15", UTC_ZONE, "%m/%d/%Y %H:%M") == datetime(2026, 11, 21, 8, 15, tzinfo=UTC)


UTC_ZONE = ZoneInfo("UTC")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "is empty"),
        ("1763712902", "count of days or seconds"),
        ("46000,5", "count of days or seconds"),
        ("11/12/2026 08:15", "day/month or month/day"),
        ("31.02.2026", "is not a time"),
        ("2026-13-01", "is not a time"),
        ("yesterday", "is not a time"),
        ("2026-W47-6", "is not a time"),
    ],
)
def test_what_is_not_a_time_is_refused_with_its_reason(text: str, why: str) -> None:
    with pytest.raises(Unreadable, match=why):
        moment(text, UTC_ZONE)


def test_a_time_without_a_zone_is_refused_until_the_zone_is_named() -> None:
    with pytest.raises(Unreadable, match="name the time zone"):
        moment("2026-11-21 08:15", None)
    with pytest.raises(Unreadable, match="There is no time zone 'Belgrade'"):
        zone_named("Belgrade")


def test_a_time_that_is_there_twice_is_refused_unless_it_begins_or_ends_a_period() -> None:
    with pytest.raises(Unreadable, match=r"2026-10-25T02:30:00\+02:00 or 2026-10-25T02:30:00\+01:00"):
        moment("2026-10-25 02:30", BELGRADE)
    begins, ends = (moment("2026-10-25 02:30", BELGRADE, fold=fold) for fold in (0, 1))
    assert (begins.isoformat(), ends.isoformat()) == ("2026-10-25T02:30:00+02:00", "2026-10-25T02:30:00+01:00")
    assert moment("2026-10-25T02:30:00+01:00", BELGRADE) == ends


def test_an_hour_that_the_clocks_skipped_does_not_exist() -> None:
    with pytest.raises(Unreadable, match="does not exist in Europe/Belgrade"):
        moment("2026-03-29 02:30", BELGRADE)


def test_names_are_compared_without_accents_case_and_unit() -> None:
    assert folded("ČAS_meritve") == "cas meritve"
    assert folded("Istmaß (mm)") == "istmass"
    assert folded("Обрађено") == folded("обрађено")
    assert [unit_in(name) for name in ("Wert [µm]", "Wert_um", "diameter (in)", "Ø [mm]", "minimum")] == [
        "um", "um", "inch", "mm", None,
    ]  # fmt: skip
