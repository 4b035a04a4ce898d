"""Wear, forecasts and hunting as JSON. Lengths in mm."""

from datetime import datetime
from math import isfinite
from typing import Any, Literal

from pydantic import BaseModel, Field

from app.core.decision.step import rounded
from app.core.forecast import ENOUGH, Forecast, Record
from app.core.hunting import Hunting
from app.core.wear import Fit, Towards
from app.quality.wear import wording
from app.quality.wear.queries import Wear
from app.web.fields import answer_from


class PerPartOut(BaseModel):
    """The slope of the least-squares line through the newest readings, as far back as they follow one line."""

    value: float = Field(description="mm per part; the sign says which way sizes go.")
    low: float = Field(description="95 % confidence interval.")
    high: float = Field(description="High end of that interval.")
    standard_error: float = Field(description="Of the slope, mm per part.")
    is_wear: bool = Field(description="Whether the interval leaves 0 out: otherwise there is no wear to be seen.")
    first_sequence: int = Field(description="The readings that the line goes through.")
    last_sequence: int
    readings: int
    left_out: int = Field(description="Outliers among them.")
    off: int = Field(description="Newest readings beyond a step, as when an edge breaks; no forecast then.")
    level: float = Field(description="Of the line at the last reading.")
    scatter: float = Field(description="Standard deviation about the line.")
    correlation: float = Field(description="Of neighbours (lag 1); it widens the interval.")


class ForecastOut(BaseModel):
    """Parts until the line reaches a limit; 0 is reached."""

    towards: Literal["wear", "tolerance", "offset"] = Field(
        description="wear: R37, without corrections since the tool change. tolerance: out of tolerance, without "
        "corrections from now on. offset: the sum of corrections reaches max_total."
    )
    limit: float = Field(description="Where the limit lies on the wear curve.")
    parts: float = Field(description="From the newest reading on, as the line runs.")
    low: float = Field(
        description="95 % interval of a single part, with room for run-in, even wear and a steep end: from here on parts may lie beyond."
    )
    high: float | None = Field(description="null: nobody can say how many at most.")


class RecordOut(BaseModel):
    """Accuracy of the forecasts of earlier edges: made at several moments of each life, for the level it came to."""

    lives: int = Field(description="Tool lives that forecasts were tested on; 0: none is over.")
    tested: int = Field(description="Number of forecasts that were tested.")
    held: int = Field(
        description="How many held the true number of parts in their interval, each as wide as the lives before it had taught."
    )
    widening: float = Field(
        description="Exponent of (3 + 3 parts / (parts + parts seen)) at the low end and of (1 + parts / parts seen) at the high end, by "
        "which the interval is moved outwards."
    )
    widened: bool = Field(
        description=f"Whether fewer than {ENOUGH} lives are over, so that it is as wide as public wear series need, or wider."
    )
    text: str = Field(description="The meaning of the interval, and how often it held, in words.")


class RemedyOut(BaseModel):
    """The least change with which scatter alone corrects no more than 1 % of the readings; null: no such value."""

    weighting_factor: float | None = Field(description="k, R33 as it is.")
    zero_range: float | None = Field(description="R33, k as it is; never below the uncertainty of the signal path.")
    averaging_limit: float | None = Field(description="R34, where R33 and k alone do not help; then together with R33.")


class HuntingOut(BaseModel):
    """Over-correction of the loop, by the corrections of the last 200 readings with the settings of now."""

    state: Literal["unknown", "quiet", "hunting", "swinging"] = Field(
        description="hunting: scatter alone explains it. swinging: it does not."
    )
    readings: int
    corrections: int
    reversals: int = Field(description="Corrections that took the one before back.")
    mean_size: float | None = Field(description="Mean size error that a correction removed.")
    scatter: float = Field(description="Standard deviation of the process, from successive differences.")
    probability: float = Field(
        description="Of that many reversals where 1 reading in 10 is tolerable; alarm below 0.001."
    )
    expected_corrections: float | None = Field(description="Per reading, by scatter alone with these settings.")
    expected_reversals: float | None = Field(description="Per reading, by scatter alone with these settings.")
    expected_size: float | None = Field(
        description="Mean size error that a correction would remove, by scatter alone, mm."
    )
    excess: float | None = Field(description="By what share the parts scatter more than with no correction at all.")
    remedy: RemedyOut | None = Field(description="The least change that helps; null: none is needed, or none does.")
    text: str = Field(description="The verdict in words.")
    what_to_do: str


class WearOut(BaseModel):
    """True wear behind the corrections: deviation + corrections in effect / factor, since the tool was changed."""

    characteristic: str
    first_sequence: int | None = Field(description="First reading of this tool that was looked at.")
    last_sequence: int | None
    tool_memory: int = Field(description="R10; 0: nothing is corrected.")
    changed_at: datetime | None = Field(description="When the tool was changed.")
    corrections_total: float = Field(description="Of the tool since then, those on their way included; mm of offset.")
    wear_per_part: PerPartOut | None = Field(description="null for fewer than 12 readings of this tool.")
    forecasts: list[ForecastOut] = Field(description="Empty where no wear is to be seen. Nearest first.")
    first: Literal["wear", "tolerance", "offset"] | None = Field(
        description="What comes first while the loop goes on as it does."
    )
    record: RecordOut = Field(description="How often earlier forecasts held here, and how wide that makes the next.")
    hunting: HuntingOut | None = Field(description="null where nothing is corrected.")

    @classmethod
    def of(cls, wear: Wear) -> "WearOut":
        """As it is answered."""
        current, sequence = wear.current, wear.now.sequence
        return cls(
            characteristic=current.characteristic.key,
            first_sequence=int(sequence[0]) if len(sequence) else None,
            last_sequence=int(sequence[-1]) if len(sequence) else None,
            tool_memory=current.parameters.tool_memory,
            changed_at=wear.changed_at,
            corrections_total=rounded(wear.total),
            wear_per_part=_per_part(wear.fit),
            forecasts=[
                _forecast(name, wear.limits[name], forecast)
                for name, forecast in sorted(wear.forecasts.items(), key=lambda item: item[1].parts)
            ],
            first=wear.first[0].value if wear.first else None,
            record=_record(wear.record),
            hunting=_hunting(wear.hunting, current.version.parameters),
        )


def _per_part(fit: Fit | None) -> PerPartOut | None:
    if fit is None:
        return None
    low, high = fit.slope_interval
    return answer_from(
        PerPartOut,
        fit,
        value=fit.slope,
        low=low,
        high=high,
        standard_error=fit.slope_error,
        first_sequence=fit.first,
        last_sequence=fit.last,
        readings=fit.count,
    )


def _forecast(towards: Towards, limit: float, forecast: Forecast) -> ForecastOut:
    high = forecast.high if isfinite(forecast.high) else None
    return ForecastOut(towards=towards.value, limit=limit, parts=forecast.parts, low=forecast.low, high=high)


def _record(record: Record) -> RecordOut:
    text = wording.about_interval(record)
    return RecordOut(**record._asdict(), widened=not record.is_enough, text=text)


def _hunting(hunting: Hunting | None, settings: dict[str, Any]) -> HuntingOut | None:
    if hunting is None:
        return None
    data = wording.hunting_data(hunting)
    remedy = data.pop("remedy")
    return HuntingOut(
        **data,
        probability=hunting.probability,
        remedy=None if remedy is None else RemedyOut(**{name: remedy[name] for name in RemedyOut.model_fields}),
        text=wording.hunting_sentence(data),
        what_to_do=wording.remedy_sentence(data | {"remedy": remedy}, settings),
    )
