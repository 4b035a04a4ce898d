"""Setting up groups of receivers and their rotas."""

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.errors import Conflict, Invalid
from app.language.i18n import _
from app.language.times import plant_shifts
from app.loop.notifications import queries
from app.loop.notifications.actions import note_change
from app.loop.notifications.group_schemas import GroupIn
from app.loop.notifications.tables import ReceiverGroup

MOST_GROUPS = 100


def add_group(session: Session, given: GroupIn, caller: Caller) -> ReceiverGroup:
    """Add a group. Raises `NotFound` for a receiver, `Invalid` for a shift that is not there; `Conflict` over `MOST_GROUPS`."""
    _check(session, given)
    if len(queries.groups(session)) >= MOST_GROUPS:
        raise Conflict(_("There are {n} groups already.").format(n=MOST_GROUPS), _("Delete one first."))
    row = ReceiverGroup(**given.model_dump(mode="json"), created_by=caller.name)
    session.add(row)
    session.flush()
    session.refresh(row)
    note_change(session, caller, "group added", f"receiver-group/{row.id}", None, given.model_dump(mode="json"))
    return row


def change_group(session: Session, number: int, given: GroupIn, caller: Caller) -> ReceiverGroup:
    """Replace a group. Raises as `add_group`."""
    row = queries.group(session, number, hold=True)
    _check(session, given)
    before, after = _facts(row), given.model_dump(mode="json")
    row.name, row.members, row.rota = after["name"], after["members"], after["rota"]
    if before != after:
        note_change(session, caller, "group changed", f"receiver-group/{number}", before, after)
    return row


def delete_group(session: Session, number: int, caller: Caller) -> None:
    """Delete a group. Raises `NotFound`; `Conflict` while a route names it."""
    row = queries.group(session, number, hold=True)
    used = queries.routes_to_group(session, number)
    if used:
        raise Conflict(
            _("The route “{name}” names this group.").format(name=used[0].name),
            _("Take it out of the route first, or delete the route."),
        )
    before = _facts(row)
    session.delete(row)
    note_change(session, caller, "group deleted", f"receiver-group/{number}", before, None)


def _facts(row: ReceiverGroup) -> dict[str, object]:
    return GroupIn(name=row.name, members=row.members, rota=row.rota).model_dump(mode="json")


def _check(session: Session, given: GroupIn) -> None:
    queries.check_receivers(session, given.members)
    begins = [f"{each:%H:%M}" for each in plant_shifts()]
    for turn in given.rota:
        if turn.shift is not None and turn.shift not in begins:
            raise Invalid.at(
                "rota",
                _("no shift of the plant begins at {time}; they begin at {shifts}").format(
                    time=turn.shift, shifts=", ".join(begins)
                ),
            )
