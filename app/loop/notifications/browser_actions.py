"""Notifications in a person's browsers: an open page fetches its messages, shows them, and says so."""

from sqlalchemy.orm import Session

from app.access.callers import Caller
from app.errors import NotFound
from app.language.i18n import _
from app.loop.notifications import actions, queries
from app.loop.notifications.means import Answer
from app.loop.notifications.schemas import OwnBrowserIn, PageIn, ReceiverChange
from app.loop.notifications.sending import end, job_of
from app.loop.notifications.tables import Delivery, Receiver
from app.settings import Settings


def own_browser(session: Session, caller: Caller) -> Receiver:
    """The caller's browsers. Raises `NotFound` where they show no notifications."""
    row = queries.own(session, caller.person_id, "browser")
    if row is None:
        raise NotFound(
            _("Your browsers show no notifications."),
            _("PUT /api/v1/notifications/me/browser lets them, if it permits."),
        )
    return row


def set_browser(session: Session, caller: Caller, settings: Settings, given: OwnBrowserIn | None = None) -> Receiver:
    """Let the caller's browsers show notifications, but for the quiet hours that are given.

    Raises `NotFound` for a key, which is no person.
    """
    given = given or OwnBrowserIn()
    if caller.person_id is None:
        raise NotFound(_("A key is no person and has no browser."), _("Sign in as a person."))
    queries.hold_own(session, {"caller": caller})  # of two at once, one comes second
    row = queries.own(session, caller.person_id, "browser")
    if row is not None:
        change = ReceiverChange(quiet=given.quiet, away_until=given.away_until)
        return actions.change_receiver(session, row.id, change, caller, settings)
    name, person = _("{name} (browser)").format(name=caller.name), caller.person_id
    address = f"person/{person}"  # each one's own: receivers with one address are one
    made = Receiver(name=name, means="browser", address=address, person_id=person, **given.model_dump())
    return actions.added(session, caller, made)


def delete_browser(session: Session, caller: Caller) -> None:
    """Show the caller no notifications any more. Raises `NotFound`, and `Conflict` as `delete_receiver`."""
    actions.delete_receiver(session, own_browser(session, caller).id, caller)


def take(session: Session, given: PageIn, caller: Caller) -> list[Delivery]:
    """Messages of the last minute; what an open page has shown is delivered. A pause after failures ends: now a page is open."""
    row = queries.own(session, caller.person_id, "browser")
    if row is None:
        return []
    for number in sorted(set(given.shown)):
        delivery = session.get(Delivery, number)
        if delivery is not None and delivery.receiver_id == row.id and delivery.words is not None:
            end(session, job_of(delivery), Answer(delivered=True, text=_("A page of Inband has shown it.")))
    if row.retry_at is not None:
        row.retry_at = None
    return list(queries.messages(session, row.id))
