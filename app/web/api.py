"""Common parts of all JSON routes: strict bodies, and every error described in the OpenAPI document."""

from typing import Annotated, Any

import msgspec
from fastapi import APIRouter, Depends, Path, Query, Response, params
from fastapi.routing import APIRoute
from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from app.charts import Chart, ThemeName, to_plotly
from app.errors import (
    PROBLEM_JSON,
    ChangedMeanwhile,
    Conflict,
    DatabaseAway,
    FieldError,
    InbandError,
    Invalid,
    NotAllowed,
    NotFound,
    NotSignedIn,
    TooLarge,
    TooManyRequests,
)
from app.web.fields import LARGEST_ID, LARGEST_SERIAL, Slug, one_line
from app.web.json_bodies import JsonRoute

BASE = "/api/v1"
MachineKey = Annotated[str, Path(description="The key of the machine.", examples=["lathe-1"])]
CharacteristicKey = Annotated[str, Path(description="The key of the characteristic.", examples=["shaft-d40"])]
MachineFilter = Annotated[Slug | None, Query(description="Only of this machine.", examples=["mill-1"])]
_CURSOR = "Cursor: the `next` of the page before."
After = Annotated[int, Query(ge=0, le=LARGEST_ID, description=_CURSOR)]
"""Number of the last item seen."""
SerialAfter = Annotated[int, Query(ge=0, le=LARGEST_SERIAL, description=_CURSOR)]
"""The same, where items are counted with 32 bits."""
KeyAfter = Annotated[str, Query(max_length=64, description=_CURSOR), AfterValidator(one_line)]
"""Key of the last item seen."""
Before = Annotated[int | None, Query(ge=1, le=LARGEST_ID, description=_CURSOR)]
SerialBefore = Annotated[int | None, Query(ge=1, le=LARGEST_SERIAL, description=_CURSOR)]
Limit = Annotated[int, Query(ge=1, le=1000, description="How many items at most.")]
Width = Annotated[int, Query(ge=200, le=10_000, description="Of the chart in pixels, about.")]


def theme_of(
    theme: Annotated[ThemeName, Query(description="For a light or a dark page.")] = "light",
    width: Width = 1240,  # noqa: ARG001 - every chart is asked with its width
) -> ThemeName:
    """The theme of a chart."""
    return theme


Theme = Annotated[ThemeName, Depends(theme_of)]
FIGURE: dict[int | str, dict[str, Any]] = {
    200: {
        "description": "A Plotly figure: `data` and `layout`",
        "content": {
            "application/json": {
                "schema": {
                    "type": "object",
                    "properties": {
                        "data": {"type": "array", "items": {"type": "object"}, "description": "Traces."},
                        "layout": {"type": "object", "description": "Axes, shapes, annotations."},
                    },
                    "required": ["data", "layout"],
                },
                "example": {"data": [], "layout": {}},
            }
        },
    }
}


def chart_answer(chart: Chart, theme: ThemeName) -> Response:
    """A chart for the browser; thousands of numbers: written at once, not walked through by a validator first."""
    body = msgspec.json.encode(to_plotly(chart, theme))
    return Response(body, media_type="application/json", headers={"Cache-Control": "no-store"})


class WrongField(BaseModel):
    """Error of one field."""

    field: Annotated[str, Field(description="Where: the field, with dots and indices.")]
    message: Annotated[str, Field(description="What is wrong with it.")]


class Problem(BaseModel):
    """RFC 9457: what went wrong, where, and what to do about it."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(examples=["urn:inband:problem:invalid"], description="The kind of problem, for programs.")
    title: str = Field(description="The kind of problem, for people.")
    status: int = Field(description="The status of the answer.")
    detail: str = Field(description="What went wrong here.")
    errors: list[WrongField] = Field([], description="Which fields are wrong, and why.")
    what_to_do: str | None = None
    request_id: str | None = Field(None, description="Names the request in the server's log.")


def _error(error: InbandError) -> dict[str, Any]:
    return {
        "model": Problem,
        "description": error.title,
        "content": {PROBLEM_JSON: {"example": error.as_problem()}},
    }


EVERY_ERROR: dict[int | str, dict[str, Any]] = {
    error.status: _error(error)
    for error in (
        NotSignedIn("This key is not known, or was revoked.", "Ask an administrator for a new key."),
        NotAllowed("This needs the role engineer; ana has the role operator.", "Ask an administrator for the role."),
        NotFound("There is no machine 'lathe-9'.", "Check the key; GET /api/v1/machines lists them."),
        Conflict("There is a machine 'lathe-1' already.", "Choose another key."),
        ChangedMeanwhile("It has changed since you looked.", "Get it again and repeat your change with the new ETag."),
        TooLarge("The request is larger than the 1 MB that are taken here.", "Send it in several smaller requests."),
        Invalid(
            "parameters.averaging_limit: R34 averaging limit 0.0090 mm must not be larger than R35/2 = 0.0080 mm.",
            "Correct the named fields and send it again.",
            errors=[
                FieldError(
                    "parameters.averaging_limit",
                    "R34 averaging limit 0.0090 mm must not be larger than R35/2 = 0.0080 mm.",
                )
            ],
        ),
        TooManyRequests("Too many sign-ins have failed.", "Wait for 30 seconds.", retry_after=30),
        DatabaseAway(),
    )
}


def problems(*statuses: int) -> dict[int | str, dict[str, Any]]:
    """For a route's ``responses=``: these errors, and those that any route may answer (401, 403, 422, 503)."""
    return {status: EVERY_ERROR[status] for status in sorted({401, 403, 422, 503, *statuses})}


def plain(example: str) -> dict[int | str, dict[str, object]]:
    """Description of an answer in plain text."""
    return {200: {"description": "The text", "content": {"text/plain": {"example": example}}}}


def sent_again(model: type[BaseModel]) -> dict[int | str, dict[str, Any]]:
    """Description of the answer to a key that was sent before."""
    return {200: {"model": model, "description": "It was sent before with the same key; nothing happened now."}}


def _operation_id(route: APIRoute) -> str:
    return route.name


def api_router(tag: str, *dependencies: params.Depends) -> APIRouter:
    """A router for JSON routes below the base path. The name of a route's function is its operation id."""
    return APIRouter(
        prefix=BASE,
        tags=[tag],
        dependencies=dependencies,
        route_class=JsonRoute,
        generate_unique_id_function=_operation_id,
        responses=problems(),
    )
