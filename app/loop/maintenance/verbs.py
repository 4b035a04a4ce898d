"""Acts on maintenance: declared once, drawn on its page and as JSON."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.language.i18n import _
from app.loop.maintenance import actions, queries
from app.loop.maintenance.queries import MaintenanceRow
from app.loop.maintenance.schemas import EndIn, ExtendIn
from app.web.verb import Act, Verb


@dataclass(frozen=True)
class OfMaintenance:
    """Maintenance by its number, and who acts on it."""

    session: Session
    number: int
    caller: Caller

    @property
    def row(self) -> MaintenanceRow:
        """It as it is now. Raises `NotFound`."""
        return queries.maintenance(self.session, self.number)

    @property
    def values(self) -> Mapping[str, Any]:
        """Its number, and what is under maintenance."""
        return {"number": self.number, "name": self.row.name}


def end_maintenance(on: OfMaintenance, given: EndIn) -> MaintenanceRow:
    """End it now, or cancel it before it begins. Alarms that are still active are then announced."""
    return actions.end(on.session, on.number, given.reason, on.caller)


def extend_maintenance(on: OfMaintenance, given: ExtendIn) -> MaintenanceRow:
    """Move its end to a later time. An operator: of one machine, over within 24 hours, with `stopping_anyway`."""
    return actions.extend(on.session, on.number, given, on.caller)


EXTEND: Act[OfMaintenance, ExtendIn] = Act(name="extend", body=ExtendIn, act=extend_maintenance)
END: Verb[OfMaintenance, EndIn] = Verb(
    name="end",
    body=EndIn,
    act=end_maintenance,
    needs_body=False,
    own=lambda on: on.row.maintenance.ended_by == on.caller.name,
    word=lambda: _("End maintenance"),
    title=lambda _on: _("End the maintenance of {name}?"),
    follows=lambda _on: [
        _("People are notified again, also of alarms that were raised meanwhile and are still active.")
    ],
    said=lambda: _("Maintenance {n} is ended. People are notified again."),
)
