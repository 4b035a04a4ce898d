"""Queries of the days off of the plant. Never writes."""

import re
from collections.abc import Collection, Iterable, Mapping
from datetime import date, timedelta
from functools import cache, lru_cache
from typing import Any

from sqlalchemy import text
from sqlalchemy.orm import Session

from app.loop.notifications.calendar_schemas import CalendarOut, ComingOut, DayOffOut
from app.loop.notifications.tables import PlantCalendar
from app.settings import Settings
from app.web.fields import answer_from

YEAR = timedelta(days=366)
_HOLD = text("SELECT pg_advisory_xact_lock(7291, 'plant_calendar'::regclass::oid::int4)")


@cache
def countries() -> Mapping[str, Collection[str]]:
    """Countries whose public holidays are known, by their two letters, and the parts of each that have others."""
    import holidays

    known = holidays.list_supported_countries(include_aliases=False)
    return {code: parts for code, parts in sorted(known.items()) if len(code) == 2}


@cache
def country_name(code: str) -> str:
    """The code of a country and its name, such as DE Germany."""
    from holidays.registry import COUNTRIES

    name = next((names[0] for names in COUNTRIES.values() if code in names), "")
    return f"{code} {re.sub(r'(?<=[a-z])(?=[A-Z])', ' ', name)}"


@lru_cache(1000)
def public_holidays(country: str, subdivision: str | None, year: int) -> Mapping[date, str]:
    """Public holidays of a country, or of a part of it, by day."""
    import holidays

    return dict(holidays.country_holidays(country, subdiv=subdivision, years=year))


def of_settings(settings: Settings) -> frozenset[date]:
    """Days off that the settings of the server name."""
    return frozenset(date.fromisoformat(day) for day in settings.days_off.split(",") if day)


def calendar(session: Session) -> PlantCalendar:
    """Days off as an administrator has entered them; without any an empty row, which is not stored."""
    found = session.get(PlantCalendar, 1, populate_existing=True)
    return found or PlantCalendar(id=1, days=[])


def hold_calendar(session: Session, _given: Mapping[str, Any]) -> None:
    """Hold the days off until the transaction ends."""
    session.execute(_HOLD)


def days_off(session: Session, years: Iterable[int], named: Collection[date] = ()) -> dict[date, str]:
    """Days off of these years, and those of the plant itself, with the names of public holidays. named: of the settings."""
    row = calendar(session)
    found = dict.fromkeys((*named, *map(date.fromisoformat, row.days)), "")
    if row.country is not None and row.country in countries():
        for year in years:
            found |= public_holidays(row.country, row.subdivision, year)
    return found


def as_answer(session: Session) -> CalendarOut:
    """The days off as they are set."""
    return answer_from(CalendarOut, calendar(session))


def coming(session: Session, today: date, settings: Settings) -> ComingOut:
    """Days off of the next year."""
    found = days_off(session, (today.year, today.year + 1), of_settings(settings))
    return ComingOut(
        days=[DayOffOut(day=day, name=name) for day, name in sorted(found.items()) if today <= day < today + YEAR]
    )
