"""Baselines as JSON. Lengths in mm; k, h and headstart in sigma."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import ConfigDict, Field

from app.core.spc.quantity import Quantity
from app.web.fields import LARGEST_ID, LARGEST_SERIAL, Body, Reason

ChartName = Literal["individuals", "xbar_r", "xbar_s"]
Grouping = Literal["consecutive", "pause", "part", "shift", "nest"]
LARGEST_LIMIT = 1000.0
Limit = Annotated[float, Field(strict=True, ge=-LARGEST_LIMIT, le=LARGEST_LIMIT)]
Place = Annotated[int, Field(strict=True, ge=1, le=LARGEST_ID)]
MOST_EXCLUDED = 100


class ExcludedIn(Body):
    """A run of readings that is left out of the baseline, and why."""

    first: Annotated[Place, Field(description="Sequence of the first reading that is left out.")]
    last: Annotated[Place, Field(description="Sequence of the last one.")]
    reason: Reason


class LimitsIn(Body):
    """Limits that are given, by a customer or a standard, and not estimated: centre and sigma, or lower and upper. mm."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    centre: Limit | None = Field(None, description="Of what is charted: a deviation from the target, not a size.")
    sigma: Annotated[float, Field(strict=True, gt=0, le=LARGEST_LIMIT)] | None = Field(
        None, description="Of a single value, also for charts of subgroups."
    )
    lower: Limit | None = Field(
        None,
        description="Limits at 3 sigma, as they are drawn on the individuals or X̄ chart. For subgroups only `consecutive`: "
        "those of one size have one limit. With a `centre` it lies in the middle.",
    )
    upper: Limit | None = Field(None, description="The other one of the two.")


class PeriodIn(Body):
    """A period, and what a baseline of it is to be: its chart, its quantity, and the settings of the charts that remember."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    chart: ChartName = Field("individuals", description="Single values, or subgroups by their ranges or by s.")
    quantity: Quantity = Field(description="What is charted; see the how-to about control charts.")
    first_sequence: Place = Field(description="The first reading of the period.")
    last_sequence: Place = Field(description="The last reading of the period.")
    grouping: Grouping | None = Field(
        None,
        description="For subgroups: a fixed number of readings one after the other, a pause that ends one, or neighbours of the same part, "
        "shift (as the plant's shifts are set now; the baseline keeps them) or nest (spindle, cavity: the `nest` of their context).",
    )
    pooled: bool = Field(
        False,
        strict=True,
        description="For subgroups: sigma from the pooled variance inside them, instead of their ranges or s. The surest where "
        "they differ in size.",
    )
    group_size: int | None = Field(
        None, strict=True, ge=2, le=1000, description="Readings in a subgroup, for `consecutive`."
    )
    group_pause: float | None = Field(
        None, strict=True, gt=0, le=100_000, description="Minutes without a reading that end a subgroup, for `pause`."
    )
    ewma_lambda: float = Field(0.2, strict=True, ge=0.001, le=1, description="Weight of the newest reading.")
    ewma_width: float = Field(
        3.0, strict=True, gt=0, le=10, description="L: limits in standard deviations of the average."
    )
    ewma_exact: bool = Field(
        True, strict=True, description="Exact limits, which widen from the first point on; else asymptotic ones."
    )
    cusum_k: float = Field(0.5, strict=True, ge=0, le=10, description="Half the shift that is to be found.")
    cusum_h: float = Field(5.0, strict=True, gt=0, le=100, description="A sum beyond it is a signal.")
    cusum_headstart: float = Field(0.0, strict=True, ge=0, lt=100, description="What both sums begin with: 0, or h/2.")
    settle: int | None = Field(
        None,
        strict=True,
        ge=20,
        le=10_000,
        description="For wear_residuals: readings in which an edge runs in; the last 20 of them set its level. Left out: as "
        "many as the edges of the period take.",
    )
    average_span: int = Field(5, strict=True, ge=2, le=1000, description="Readings in a moving average.")
    excluded: list[ExcludedIn] = Field([], max_length=MOST_EXCLUDED, description="Left out, each run with a reason.")
    limits: LimitsIn | None = Field(
        None,
        description="Limits given by the customer. Nothing is estimated then: one reading makes a period, which says from "
        "where on readings are judged. `wear_residuals` still takes its slope from the period.",
    )


class BaselineIn(PeriodIn):
    """A baseline to be frozen. Sent again with the same `key`, it is answered again and nothing new is frozen."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    reason: Reason
    key: str | None = Field(None, min_length=1, max_length=128, description="Your own, so that it is frozen once.")
    seen_version: Annotated[int, Field(strict=True, ge=0, le=LARGEST_SERIAL)] | None = Field(
        None, description="The newest version you have seen, 0 for none: 409 if there is a newer one meanwhile."
    )


class BaselineWhyIn(Body):
    """Reason, in words."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    reason: Reason


class CautionOut(Body):
    """Caution that belongs to the numbers."""

    code: str
    text: str


class LeftOutOut(Body):
    """Readings that count for nothing, by their sequences: the newest 1000 of each kind."""

    excluded: list[int] = Field(description="Excluded from all statistics.")
    by_baseline: list[int] = Field(description="Left out of its own period by the baseline.")
    faults: list[int] = Field(description="Faults of the probe: R36 was reached.")
    unknown: list[int] = Field(description="Nobody knows with which corrections their part was cut.")
    count: int = Field(description="All of them.")


class DraftOut(Body):
    """Preview of the baseline of this period; nothing is stored."""

    characteristic: str
    chart: ChartName = Field(description="Single values, or subgroups by their ranges or by s.")
    quantity: Quantity
    first_sequence: int
    last_sequence: int
    excluded: list[ExcludedIn] = Field(description="Left out of the period, each run with its reason.")
    grouping: Grouping | None = Field(description="How readings form subgroups; null for single values.")
    group_size: int | None = Field(description="Readings in a subgroup, of `consecutive`.")
    group_pause: float | None = Field(description="Minutes without a reading that end a subgroup, of `pause`.")
    shifts: str | None = Field(
        description="For `shift`: when shifts began, and by the clock of which zone, as it was frozen. Null in baselines "
        "frozen before 26 November 2026: they follow the plant's setting of today."
    )
    ewma_lambda: float = Field(description="Weight of the newest reading.")
    ewma_width: float = Field(description="L: limits in standard deviations of the average.")
    ewma_exact: bool = Field(description="Limits that widen from the first point on; else asymptotic ones.")
    cusum_k: float = Field(description="Half the shift that is to be found, in sigma.")
    cusum_h: float = Field(description="A sum beyond it is a signal, in sigma.")
    cusum_headstart: float = Field(description="What both sums begin with, in sigma.")
    average_span: int = Field(description="Readings in a moving average.")
    centre: float = Field(description="Mean of what is charted, or as it was given.")
    sigma: float = Field(description="Of a single value.")
    lower: float = Field(description="Centre - 3 sigma: limits of single values; of subgroups the chart says its own.")
    upper: float = Field(description="Centre + 3 sigma.")
    estimator: str = Field(description="How sigma was come by; `given`: with the limits, by the customer.")
    degrees_of_freedom: float | None = Field(description="What sigma is worth; null where the limits were given.")
    readings: int = Field(description="That sigma was made of; 0 where the limits were given.")
    groups: int = Field(description="Ranges or subgroups that sigma was made of.")
    provisional: bool = Field(description="Estimated from fewer than 100 readings.")
    factor: float = Field(description="What the corrections were taken out with: mm of offset per mm of size error.")
    wear_per_reading: float | None = Field(description="For wear_residuals: the slope of the wear line, frozen.")
    wear_error: float | None = Field(description="Its standard error.")
    settle: int | None = Field(
        description="First readings of each edge, which are judged by nothing; the last 20 of them set its level."
    )
    signals: int = Field(description="Points of its own period beyond its limits; ranges or s are counted too.")
    normal_p: float | None = Field(description="Anderson-Darling; small speaks against a normal distribution.")


class DraftAnswer(DraftOut):
    """The draft with what is to be known before it is frozen."""

    left_out: LeftOutOut = Field(description="Readings of the period that count for nothing.")
    cautions: list[CautionOut]


class BaselineOut(DraftOut):
    """A frozen baseline. The newest version is in force unless it is retired."""

    version: Annotated[int, Field(description="Counts up from 1.")]
    in_force: Annotated[bool, Field(description="Readings are judged by it.")]
    repeats: int | None = Field(description="The version whose numbers these are, where it was put in force again.")
    parameters_version: Annotated[int, Field(description="Version of the parameters at its last reading.")]
    at: datetime
    actor: str
    reason: str
    retired_at: Annotated[datetime | None, Field(description="Since when it judges nothing; null: it was not retired.")]
    retired_by: Annotated[str | None, Field(description="Who retired it.")]
    retired_why: Annotated[str | None, Field(description="Why, in words.")]
