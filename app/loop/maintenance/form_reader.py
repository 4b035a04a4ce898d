"""The forms of maintenance, read."""

from collections.abc import Mapping
from datetime import datetime
from typing import Literal

from app.errors import Invalid
from app.files.formats import cell_values
from app.language.i18n import _
from app.language.times import plant_zone
from app.loop.maintenance.schemas import ExtendIn, MaintenanceIn
from app.web.forms import typed


def as_typed(form: Mapping[str, str]) -> MaintenanceIn:
    """Maintenance as the person typed it, by the plant's clock. Raises `Invalid`.

    Of a time that is there twice it begins at the first, and ends at the second.
    """
    times = {"begins": _time(form, "begins", 0), "ends": _time(form, "ends", 1)}
    return typed(MaintenanceIn, form, stopping_anyway=form.get("stopping_anyway") == "true", **times)


def end_as_typed(form: Mapping[str, str]) -> ExtendIn:
    """A later end as the person typed it, by the plant's clock. Raises `Invalid`."""
    return typed(ExtendIn, form, ends=_time(form, "ends", 1))


def _time(form: Mapping[str, str], name: str, fold: Literal[0, 1]) -> datetime | None:
    text, zone = form.get(name, "").strip(), plant_zone()
    try:
        return cell_values.moment(text, zone, fold=fold) if text else None
    except cell_values.Unreadable as error:
        skipped = _("does not exist in {zone}: the clocks go forward in that hour").format(zone=zone.key)
        raise Invalid.at(name, skipped if str(error) == cell_values.never_was(zone) else str(error)) from None
