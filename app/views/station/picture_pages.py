"""Pages: pictures of reaction plans at a station, and photos that are taken there."""

from fastapi import APIRouter, Request, Response

from app.access.deps import Station
from app.loop.alarm_response import photo_actions
from app.loop.reactions import queries as reactions
from app.views.station.queries import alarm_of_machine
from app.views.station.who import who
from app.web.deps import FormDep, SessionDep
from app.web.limits import takes
from app.web.pictures import AS_FORM, DigestPath, FilesDep, pictures_of, sent, served

router = APIRouter(prefix="/station", include_in_schema=False)


@router.get("/{machine}/pictures/{picture}")
def step_picture(request: Request, session: SessionDep, _at: Station, machine: str, picture: DigestPath) -> Response:  # noqa: ARG001
    """A picture of a step, for the device that is bound to the machine."""
    return served(request, reactions.picture(session, picture), "max-age=31536000, immutable")


@router.post("/{machine}/alarms/{number}/photos")
@takes(AS_FORM, by="operator", pictures=True)
def add_photos(
    request: Request, session: SessionDep, at: Station, machine: str, number: int, form: FormDep, files: FilesDep
) -> Response:
    """Add photos of what was found at an alarm, by the person who acknowledges it: sent by the script, each by itself."""
    alarm_of_machine(session, machine, number)
    caller = who(request, session, at, form)
    session.commit()  # nothing is kept open while pictures are read
    for _field, picture in pictures_of(files, photo_actions.MOST_PHOTOS, "photo"):
        photo_actions.add_photo(session, number, picture, caller)
    return sent(request, f"/station/{machine}")
