"""JSON routes: readings as an AQDEF file."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

from fastapi import Query, Response

from app.access.deps import AnyCaller
from app.errors import Invalid
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.readings.aqdef_export import write_aqdef
from app.web.api import api_router, problems
from app.web.deps import SessionDep
from app.web.downloads import download
from app.web.fields import Moment

router = api_router("readings")
AQDEF = "text/plain"
MOST = 200_000  # readings of one answer; longer files are written by the command
FILE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "The file, written to AQDEF",
        "content": {
            AQDEF: {
                "schema": {"type": "string"},
                "example": "K0100 1\r\nK1001/1 shaft-0815\r\nK2001/1 shaft-d40\r\nK2002/1 Bearing seat\r\n",
            }
        },
    }
}


@router.get("/readings.dfq", responses=problems(404) | FILE, response_model=None, response_class=Response)
def get_aqdef(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: Annotated[
        str,
        Query(max_length=2000, description="Keys of the characteristics, parted by commas.", examples=["shaft-d40"]),
    ],
    since: Annotated[
        Moment | None, Query(alias="from", description="Measured at this moment or later.", examples=[None])
    ] = None,
    until: Annotated[Moment | None, Query(alias="to", description="Measured before.", examples=[None])] = None,
    last: Annotated[
        int, Query(ge=1, le=MOST, description="Of each characteristic only so many, the last ones.")
    ] = 10_000,
) -> Response:
    """Readings of several characteristics as an AQDEF file (Q-DAS, `.dfq`): values, validity, events, limits, catalogues."""
    keys = list(dict.fromkeys(key.strip() for key in characteristic.split(",") if key.strip()))
    for key in keys:
        characteristics.characteristic_for(session, caller, key, "viewer")
    if len(keys) * last > MOST:
        raise Invalid.at("last", _("at most {most} readings come in one answer; ask for fewer").format(most=MOST))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "readings.dfq"
        write_aqdef(session, keys, path, since=since, until=until, last=last)
        content = path.read_bytes()
    name = keys[0] if len(keys) == 1 else "readings"
    return download(content, f"{name}.dfq", AQDEF)
