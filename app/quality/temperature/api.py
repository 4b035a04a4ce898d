"""JSON routes: drift of a characteristic by temperature, and its chart."""

from typing import Annotated, Literal

from fastapi import Query, Response

from app.access.deps import AnyCaller
from app.core.drift import WARM_UP
from app.core.spc.refusal import Refused
from app.errors import Invalid
from app.loop.characteristics.queries import characteristic_for
from app.quality.temperature import queries
from app.quality.temperature.chart import chart_of
from app.quality.temperature.figures import temperature_figure
from app.quality.temperature.schemas import TemperatureOut
from app.quality.temperature.wording import too_few
from app.web.api import FIGURE, CharacteristicKey, Theme, api_router, chart_answer, problems
from app.web.deps import FROM_REPLICA, SessionDep

router = api_router("statistics", FROM_REPLICA)
Last = Annotated[int, Query(ge=2, le=queries.MOST, description="The newest readings.")]
Of = Annotated[
    Literal["part", "machine"] | None,
    Query(description="Whose temperature; left out: the part's, or the machine's where that is known more often."),
]
Pause = Annotated[
    float | None,
    Query(
        gt=0,
        le=100_000,
        description="Minutes without a reading that are a pause; left out: three times as long as readings are apart, 10 at least.",
    ),
]
WarmUp = Annotated[int, Query(ge=1, le=1000, description="Parts after a pause that count as warming up.")]


@router.get("/characteristics/{characteristic}/temperature", responses=problems(404))
def get_temperature(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    last: Last = queries.USUAL,
    of: Of = None,
    pause: Pause = None,
    warm_up: WarmUp = WARM_UP,
) -> TemperatureOut:
    """Regress sizes on temperature, on parts since the last pause, and on wear: each effect beside the others, with its interval.

    Sizes are those without corrections, so that a loop that follows the drift does not hide it. Nothing is corrected by it, and no
    decision rests on a temperature.
    """
    current = characteristic_for(session, caller, characteristic, "viewer")
    study = queries.study_of(session, current, last=last, of=of, pause=pause, warm_up=warm_up)
    if isinstance(study.drift, Refused):
        raise Invalid.at("characteristic", too_few(study.drift))
    return TemperatureOut.of_study(study, study.drift)


@router.get(
    "/characteristics/{characteristic}/figures/temperature", responses=problems(404) | FIGURE, response_model=None
)
def get_temperature_figure(
    session: SessionDep,
    caller: AnyCaller,
    characteristic: CharacteristicKey,
    last: Last = queries.USUAL,
    of: Of = None,
    pause: Pause = None,
    warm_up: WarmUp = WARM_UP,
    theme: Theme = "light",
) -> Response:
    """Each reading by its temperature, without level, warming up and wear, with the line and its interval."""
    current = characteristic_for(session, caller, characteristic, "viewer")
    study = queries.study_of(session, current, last=last, of=of, pause=pause, warm_up=warm_up)
    return chart_answer(temperature_figure(chart_of(study)), theme)
