"""JSON routes: notifications. For administrators; everybody says where they get mail themselves."""

from datetime import UTC, datetime
from typing import Annotated

from fastapi import Path, Query, Response

from app.access.deps import Admin, Viewer, require
from app.errors import NotFound
from app.language.i18n import _
from app.language.times import local
from app.loop.notifications import actions, browser_actions, calendar_actions, calendar_queries, group_actions, queries
from app.loop.notifications.calendar_schemas import CalendarIn, CalendarOut, ComingOut
from app.loop.notifications.group_schemas import DutyOut, GroupIn, GroupOut
from app.loop.notifications.schemas import (
    DeliveryOut,
    MessageOut,
    MessagesOut,
    NewReceiverOut,
    OwnAddressIn,
    OwnBrowserIn,
    PageIn,
    ReceiverChange,
    ReceiverIn,
    ReceiverOut,
    RouteIn,
    RouteOut,
)
from app.web.api import After, Before, Limit, api_router, problems
from app.web.deps import SessionDep, SettingsDep
from app.web.etags import TAGGED, guarded, held, tagged
from app.web.fields import LARGEST_ID, Page, page_of

router = api_router("notifications")
RouteId = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the route.", examples=[1])]
ReceiverId = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the receiver.", examples=[1])]
GroupId = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the group.", examples=[1])]
DeliveryId = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the delivery.", examples=[1])]
ADMIN = [require("admin")]


@router.get("/notifications/routes", dependencies=ADMIN)
def list_notification_routes(session: SessionDep, after: After = 0, limit: Limit = 100) -> Page[RouteOut]:
    """Routes from alarms to receivers."""
    return page_of([RouteOut.of(row) for row in queries.routes(session, after, limit + 1)], limit, lambda row: row.id)


@router.post("/notifications/routes", status_code=201, responses=problems(404, 409))
def add_notification_route(session: SessionDep, caller: Admin, route: RouteIn, response: Response) -> RouteOut:
    """Add a route: from now on its receivers are notified of the alarms that it is for, those that are active already too."""
    row = actions.add_route(session, route, caller)
    session.refresh(row)
    response.headers["Location"] = f"/api/v1/notifications/routes/{row.id}"
    return RouteOut.of(row)


@router.get("/notifications/routes/{route}", dependencies=ADMIN, responses=problems(404) | TAGGED)
@tagged
def get_notification_route(session: SessionDep, route: RouteId) -> RouteOut:
    """One route."""
    return RouteOut.of(queries.route(session, route))


@router.put("/notifications/routes/{route}", responses=problems(404, 412))
@guarded(get_notification_route, held(queries.route, "route"))
def change_notification_route(session: SessionDep, caller: Admin, route: RouteId, given: RouteIn) -> RouteOut:
    """Replace a route. What was announced already stays announced."""
    return RouteOut.of(actions.change_route(session, route, given, caller))


@router.delete("/notifications/routes/{route}", status_code=204, responses=problems(404))
def delete_notification_route(session: SessionDep, caller: Admin, route: RouteId) -> Response:
    """Delete a route."""
    actions.delete_route(session, route, caller)
    return Response(status_code=204)


@router.get("/notifications/receivers", dependencies=ADMIN)
def list_receivers(session: SessionDep, after: After = 0, limit: Limit = 100) -> Page[ReceiverOut]:
    """Receivers: mail addresses, webhooks, addresses of apprise, people's own addresses and browsers. Never with a secret."""
    rows = [ReceiverOut.of(row) for row in queries.receivers(session, after, limit + 1)]
    return page_of(rows, limit, lambda row: row.id)


@router.post("/notifications/receivers", status_code=201, responses=problems(409))
def add_receiver(
    session: SessionDep, caller: Admin, settings: SettingsDep, receiver: ReceiverIn, response: Response
) -> NewReceiverOut:
    """Add a receiver. Nothing is sent to it before a route names it, but for the changes that a webhook asks for."""
    row = actions.add_receiver(session, receiver, caller, settings)
    response.headers["Location"] = f"/api/v1/notifications/receivers/{row.id}"
    return NewReceiverOut.of(row)


@router.get("/notifications/receivers/{receiver}", dependencies=ADMIN, responses=problems(404) | TAGGED)
@tagged
def get_receiver(session: SessionDep, receiver: ReceiverId) -> ReceiverOut:
    """One receiver, without its secret."""
    return ReceiverOut.of(queries.receiver(session, receiver))


@router.patch("/notifications/receivers/{receiver}", responses=problems(404, 412))
@guarded(get_receiver, held(queries.receiver, "receiver"))
def change_receiver(
    session: SessionDep, caller: Admin, settings: SettingsDep, receiver: ReceiverId, change: ReceiverChange
) -> ReceiverOut:
    """Change what is named. Another address ends the pause after failures."""
    return ReceiverOut.of(actions.change_receiver(session, receiver, change, caller, settings))


@router.delete("/notifications/receivers/{receiver}", status_code=204, responses=problems(404, 409))
def delete_receiver(session: SessionDep, caller: Admin, receiver: ReceiverId) -> Response:
    """Delete a receiver; 409 while a route, a group or a reaction plan names it. Its deliveries stay on record."""
    actions.delete_receiver(session, receiver, caller)
    return Response(status_code=204)


@router.post("/notifications/receivers/{receiver}/test", status_code=202, responses=problems(404))
def send_test(session: SessionDep, caller: Admin, receiver: ReceiverId) -> DeliveryOut:
    """Send a test within seconds, whether the receiver is quiet, away or failing; the delivery says how it ended."""
    return DeliveryOut.of(actions.ask_for_test(session, receiver, caller))


@router.get("/notifications/groups", dependencies=ADMIN)
def list_receiver_groups(session: SessionDep, after: After = 0, limit: Limit = 100) -> Page[GroupOut]:
    """Groups of receivers, and their rotas."""
    rows = [GroupOut.of(row) for row in queries.groups(session, after, limit + 1)]
    return page_of(rows, limit, lambda row: row.id)


@router.post("/notifications/groups", status_code=201, responses=problems(404, 409))
def add_receiver_group(session: SessionDep, caller: Admin, group: GroupIn, response: Response) -> GroupOut:
    """Add a group. Nobody is notified before a route names it."""
    row = group_actions.add_group(session, group, caller)
    response.headers["Location"] = f"/api/v1/notifications/groups/{row.id}"
    return GroupOut.of(row)


@router.get("/notifications/groups/{group}", dependencies=ADMIN, responses=problems(404) | TAGGED)
@tagged
def get_receiver_group(session: SessionDep, group: GroupId) -> GroupOut:
    """One group, and its rota."""
    return GroupOut.of(queries.group(session, group))


@router.get("/notifications/groups/{group}/on-duty", dependencies=ADMIN, responses=problems(404))
def get_who_is_on_duty(session: SessionDep, group: GroupId) -> DutyOut:
    """The receivers of the group that are on duty now, by the plant's clock."""
    return DutyOut.of(queries.group(session, group), datetime.now(UTC))


@router.put("/notifications/groups/{group}", responses=problems(404, 412))
@guarded(get_receiver_group, held(queries.group, "group"))
def change_receiver_group(session: SessionDep, caller: Admin, group: GroupId, given: GroupIn) -> GroupOut:
    """Replace a group and its rota."""
    return GroupOut.of(group_actions.change_group(session, group, given, caller))


@router.delete("/notifications/groups/{group}", status_code=204, responses=problems(404, 409))
def delete_receiver_group(session: SessionDep, caller: Admin, group: GroupId) -> Response:
    """Delete a group; 409 while a route names it."""
    group_actions.delete_group(session, group, caller)
    return Response(status_code=204)


@router.get("/notifications/calendar", dependencies=ADMIN, responses=TAGGED)
@tagged
def get_days_off(session: SessionDep) -> CalendarOut:
    """Days on which the plant does not work: public holidays and its own."""
    return calendar_queries.as_answer(session)


@router.put("/notifications/calendar", responses=problems(412))
@guarded(get_days_off, calendar_queries.hold_calendar)
def set_days_off(session: SessionDep, caller: Admin, given: CalendarIn) -> CalendarOut:
    """Set the days on which the plant does not work. Routes that are not open on days off are closed on them."""
    calendar_actions.set_calendar(session, given, caller)
    return calendar_queries.as_answer(session)


@router.get("/notifications/calendar/coming", dependencies=ADMIN)
def list_coming_days_off(session: SessionDep, settings: SettingsDep) -> ComingOut:
    """Days off of the next year, public holidays with their names."""
    return calendar_queries.coming(session, local(datetime.now(UTC)).date(), settings)


@router.get("/notifications/deliveries", dependencies=ADMIN)
def list_deliveries(
    session: SessionDep,
    receiver: Annotated[int | None, Query(ge=1, le=LARGEST_ID, description="Only to this receiver.")] = None,
    before: Before = None,
    limit: Limit = 100,
) -> Page[DeliveryOut]:
    """Deliveries of the last month, the newest first, with what was answered."""
    rows = queries.deliveries(session, receiver_id=receiver, before=before, limit=limit + 1)
    return page_of([DeliveryOut.of(row.delivery) for row in rows], limit, lambda row: row.id)


@router.get("/notifications/deliveries/{delivery}", dependencies=ADMIN, responses=problems(404))
def get_delivery(session: SessionDep, delivery: DeliveryId) -> DeliveryOut:
    """One delivery."""
    return DeliveryOut.of(queries.delivery(session, delivery))


@router.get("/notifications/me", responses=problems(404) | TAGGED)
@tagged
def get_own_address(session: SessionDep, caller: Viewer) -> ReceiverOut:
    """Your own mail address for notifications; 404 if you have given none."""
    row = queries.own(session, caller.person_id)
    if row is None:
        raise NotFound(_("You have given no mail address."), _("PUT /api/v1/notifications/me says one."))
    return ReceiverOut.of(row)


@router.put("/notifications/me", responses=problems(404, 412))
@guarded(get_own_address, queries.hold_own)
def set_own_address(session: SessionDep, caller: Viewer, settings: SettingsDep, given: OwnAddressIn) -> ReceiverOut:
    """Say where you get mail yourself, and when not. An administrator puts you into routes."""
    return ReceiverOut.of(actions.set_own(session, given, caller, settings))


@router.delete("/notifications/me", status_code=204, responses=problems(404, 409))
def delete_own_address(session: SessionDep, caller: Viewer) -> Response:
    """Delete your mail address; 409 while a route names it."""
    actions.delete_own(session, caller)
    return Response(status_code=204)


@router.get("/notifications/me/browser", responses=problems(404) | TAGGED)
@tagged
def get_own_browser(session: SessionDep, caller: Viewer) -> ReceiverOut:
    """Your own browsers as a receiver; 404 where they show no notifications."""
    return ReceiverOut.of(browser_actions.own_browser(session, caller))


@router.put("/notifications/me/browser", responses=problems(404, 412))
@guarded(get_own_browser, queries.hold_own)
def set_own_browser(session: SessionDep, caller: Viewer, settings: SettingsDep, given: OwnBrowserIn) -> ReceiverOut:
    """Let your browsers show notifications while a page of Inband is open in one. An administrator puts you into routes."""
    return ReceiverOut.of(browser_actions.set_browser(session, caller, settings, given))


@router.delete("/notifications/me/browser", status_code=204, responses=problems(404, 409))
def delete_own_browser(session: SessionDep, caller: Viewer) -> Response:
    """Show notifications in none of your browsers any more; 409 while a route names them."""
    browser_actions.delete_browser(session, caller)
    return Response(status_code=204)


@router.post("/notifications/me/browser/test", status_code=202, responses=problems(404))
def send_test_to_own_browser(session: SessionDep, caller: Viewer) -> DeliveryOut:
    """Send a test to your own browsers; a page that is open shows it within seconds."""
    row = browser_actions.own_browser(session, caller)
    return DeliveryOut.of(actions.ask_for_test(session, row.id, caller))


@router.post("/notifications/me/browser/messages")
def take_messages(session: SessionDep, caller: Viewer, page: PageIn) -> MessagesOut:
    """As an open page asks: its messages of the last minute, and what it has shown, which is delivered then. None without a receiver."""
    return MessagesOut(items=[MessageOut.of(row) for row in browser_actions.take(session, page, caller)])
