"""JSON routes: alarms and their acknowledgement."""

from typing import Annotated

from fastapi import Path, Query, Request, Response

from app.access.deps import AnyCaller, Engineer, Operator
from app.errors import NotFound
from app.language.i18n import _
from app.loop.alarm_response import photo_actions, photo_queries, queries
from app.loop.alarm_response.queries import AlarmRow, AlarmState
from app.loop.alarm_response.reaction_queries import Reactions
from app.loop.alarm_response.schemas import AlarmOut, AlarmPhotoOut, alarm_out
from app.loop.alarm_response.verbs import ACKNOWLEDGE, OfAlarm
from app.loop.characteristics.queries import characteristic_named
from app.loop.machines.queries import only_machine
from app.web.api import After, Limit, api_router, problems
from app.web.deps import SessionDep
from app.web.fields import LARGEST_ID, Page, ReasonIn, Slug, Text200, answer_from, page_of
from app.web.limits import takes
from app.web.pictures import AS_JSON, FILE, PictureIn, decoded, picture_of, served
from app.web.verb import add_json_route

router = api_router("alarms")
Number = Annotated[int, Path(description="Number of the alarm.", examples=[41])]
PhotoNumber = Annotated[int, Path(ge=1, le=LARGEST_ID, description="Number of the photo.", examples=[3])]


@router.get("/alarms", responses=problems(404))
def list_alarms(
    session: SessionDep,
    caller: AnyCaller,
    state: Annotated[AlarmState, Query(description="`active`, `acknowledged`, or all of them.")] = "all",
    machine: Annotated[Slug | None, Query(description="Only those of this machine.", examples=["lathe-1"])] = None,
    characteristic: Annotated[Slug | None, Query(description="Only those of this characteristic.")] = None,
    kind: Annotated[Text200 | None, Query(description="Only this kind.", examples=["tool_worn"])] = None,
    after: After = 0,
    limit: Limit = 100,
) -> Page[AlarmOut]:
    """Alarms, oldest first. The key of a machine sees those of that machine."""
    machine_id = only_machine(session, caller, machine)
    if characteristic is not None:
        characteristic_named(session, characteristic)
    rows = queries.alarms(
        session,
        state=state,
        machine_id=machine_id,
        characteristic=characteristic,
        kind=kind,
        after=after,
        limit=limit + 1,
    )
    reactions = Reactions(session)
    return page_of([alarm_out(row, reactions) for row in rows], limit, lambda alarm: alarm.id)


@router.get("/alarms/{alarm}", responses=problems(404))
def get_alarm(session: SessionDep, caller: AnyCaller, alarm: Number) -> AlarmOut:
    """One alarm, and what followed if it is acknowledged."""
    row = queries.alarm(session, alarm)
    caller.must_at(row.alarm.machine_id, "viewer")
    return alarm_out(row, Reactions(session))


def _alarm(session: SessionDep, caller: Operator, alarm: Number) -> OfAlarm:
    return OfAlarm(session, alarm, caller)


def _answer(on: OfAlarm, row: AlarmRow) -> AlarmOut:
    return alarm_out(row, Reactions(on.session))


add_json_route(router, "/alarms/{alarm}/acknowledge", ACKNOWLEDGE, _alarm, _answer, AlarmOut)


@router.get("/alarms/{alarm}/photos", responses=problems(404))
def list_photos_of_alarm(
    session: SessionDep, caller: AnyCaller, alarm: Number, after: After = 0, limit: Limit = 100
) -> Page[AlarmPhotoOut]:
    """Photos of what was found at an alarm, in the order in which they came; removed ones without what they show."""
    row = queries.alarm(session, alarm)
    caller.must_at(row.alarm.machine_id, "viewer")
    found = photo_queries.photos(session, row.alarm, after=after, limit=limit + 1)
    return page_of([answer_from(AlarmPhotoOut, each) for each in found], limit, lambda photo: photo.id)


@router.post("/alarms/{alarm}/photos", status_code=201, responses=problems(404, 409, 413))
@takes(AS_JSON, by="operator", pictures=True)
def add_photo_of_alarm(
    session: SessionDep, caller: Operator, alarm: Number, given: PictureIn, response: Response
) -> AlarmPhotoOut:
    """Add a photo to an alarm, active or acknowledged; the same one sent twice is one.

    409 where it has twelve. Acknowledging waits for no photo: a photo that is refused changes nothing of the alarm.
    """
    queries.alarm(session, alarm)
    session.commit()  # nothing is kept open while the picture is read
    row = photo_actions.add_photo(session, alarm, picture_of(decoded(given.content)), caller)
    response.headers["Location"] = f"/api/v1/alarms/{alarm}/photos/{row.id}"
    return answer_from(AlarmPhotoOut, row)


@router.get(
    "/alarms/{alarm}/photos/{photo}", responses=problems(404) | FILE, response_model=None, response_class=Response
)
def get_photo_of_alarm(
    request: Request, session: SessionDep, caller: AnyCaller, alarm: Number, photo: PhotoNumber
) -> Response:
    """The photo itself, with its digest as `ETag`. 404 once it was removed."""
    row, found = photo_queries.photo(session, alarm, photo)
    caller.must_at(row.alarm.machine_id, "viewer")
    if found.removed_at is not None:
        raise NotFound(
            _("{who} has removed this photo: {why}").format(who=found.removed_by, why=found.removed_why),
            _("What it showed was deleted."),
        )
    return served(request, found, "no-cache")


@router.post("/alarms/{alarm}/photos/{photo}/remove", responses=problems(404, 409))
def remove_photo_of_alarm(
    session: SessionDep, caller: Engineer, alarm: Number, photo: PhotoNumber, given: ReasonIn
) -> AlarmPhotoOut:
    """Remove what a photo shows – a person, another firm's drawing –, for ever; that it was there, and why it went, stays."""
    return answer_from(AlarmPhotoOut, photo_actions.remove_photo(session, alarm, photo, given.reason, caller))
