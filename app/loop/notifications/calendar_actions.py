"""Setting the days off of the plant."""

from datetime import UTC, datetime

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.errors import Invalid
from app.language.i18n import _
from app.loop.notifications.actions import note_change
from app.loop.notifications.calendar_queries import calendar, countries, hold_calendar
from app.loop.notifications.calendar_schemas import CalendarIn


def set_calendar(session: Session, given: CalendarIn, caller: Caller) -> None:
    """Set the days on which the plant does not work. Raises `Invalid` for a country, or a part of it, whose holidays are not known."""
    hold_calendar(session, {})
    _check(given)
    row = calendar(session)
    after = given.model_dump(mode="json") | {"days": [str(day) for day in sorted(set(given.days))]}
    before = {"country": row.country, "subdivision": row.subdivision, "days": row.days}
    if before == after:
        return
    row.country, row.subdivision, row.days = given.country, given.subdivision, after["days"]
    row.changed_at, row.changed_by = datetime.now(UTC), caller.name
    session.add(row)
    note_change(session, caller, "days off changed", "days-off", before, after)


def _check(given: CalendarIn) -> None:
    if given.country is None:
        if given.subdivision is not None:
            raise Invalid.at("subdivision", _("is a part of a country; name the country"))
        return
    if given.country not in countries():
        raise Invalid.at("country", _("has no known public holidays; two letters such as DE are needed"))
    parts = countries()[given.country]
    if given.subdivision is not None and given.subdivision not in parts:
        known = _("it has none") if not parts else ", ".join(sorted(parts))
        raise Invalid.at(
            "subdivision", _("is no known part of {country}: {known}").format(country=given.country, known=known)
        )
