"""Gauge studies as JSON answers. Lengths in mm."""

from datetime import datetime
from math import isnan
from typing import Any, Literal

from pydantic import BaseModel, Field

from app.core.spc.gauge.crossed import Study
from app.core.spc.gauge.linearity import Linearity
from app.core.spc.gauge.single import Bias, TypeOne
from app.core.spc.refusal import Refused
from app.loop.warnings.wording import sentence
from app.quality.gauge_studies import wording
from app.quality.gauge_studies.evaluation import Evaluation
from app.quality.gauge_studies.queries import Advice, StudyRow
from app.quality.gauge_studies.schemas import StudyKind
from app.web.fields import answer_from
from app.web.warnings import Warnings, warnings_out


class BiasOut(BaseModel):
    """Mean less reference, with the t-test against 0."""

    readings: int
    mean: float = Field(description="Mean of the values, mm.")
    bias: float = Field(description="Mean less reference, mm.")
    repeatability: float = Field(description="Standard deviation of one value.")
    t: float = Field(description="Of the test against 0.")
    p_value: float
    low: float = Field(description="95 % interval of the bias.")
    high: float = Field(description="High end of that interval.")
    significant: bool = Field(description="The bias differs from 0 (5 %).")


class TypeOneOut(BaseModel):
    """Cg = 0.2 T / 6 s, Cgk = (0.1 T - |bias|) / 3 s."""

    cg: float = Field(description="Repeatability against the tolerance.")
    cgk: float = Field(description="The same with the bias.")
    tolerance: float = Field(description="T: width of the tolerance, mm.")
    resolution: float = Field(description="As it was entered, else the smallest step between the values.")
    resolved: bool = Field(description="It is no coarser than 5 % of the tolerance; without it nothing is capable.")
    few: bool = Field(description="Fewer than 25 values.")


class CoefficientOut(BaseModel):
    """Of the line through the biases, with the test against 0."""

    value: float = Field(description="The coefficient: of a slope mm per mm, of an intercept mm.")
    standard_error: float = Field(description="Its standard error.")
    t: float = Field(description="Of the test against 0.")
    p_value: float


class LinearityOut(BaseModel):
    """bias = intercept + slope x reference."""

    readings: int
    biases: dict[str, float] = Field(description="Mean bias at each reference.")
    average_bias: float = Field(description="Mean of the biases, mm.")
    slope: CoefficientOut
    intercept: CoefficientOut
    r_squared: float = Field(description="Share of the variance that the line explains.")
    s: float = Field(description="Standard deviation about the line, mm.")
    by_size: bool = Field(description="The slope differs from 0, or the biases lie beside the line (5 %).")
    biased_at: list[float] = Field(description="References at which the 95 % band of the line leaves 0 out.")
    holds_zero: bool = Field(description="The zero line lies inside the band at every size between the references.")
    acceptable: bool = Field(description="holds_zero, and neither slope, intercept nor lack of fit is significant.")


class VarianceLineOut(BaseModel):
    """A line of the table of variance; f and p_value are null where nothing is tested."""

    source: str = Field(description="What the variation comes from.")
    freedom: int = Field(description="Degrees of freedom.")
    squares: float = Field(description="Sum of squares, mm².")
    mean_square: float | None = Field(description="Sum of squares by degrees of freedom, mm².")
    f: float | None = Field(description="F; null where nothing is tested.")
    p_value: float | None


class ComponentOut(BaseModel):
    """A standard deviation as a share of the total variation and of the tolerance (6 sigma)."""

    name: Literal["grr", "repeatability", "reproducibility", "interaction", "part", "total"]
    sigma: float = Field(description="Standard deviation, mm.")
    percent: float = Field(description="Of the standard deviation of the total variation.")
    percent_tolerance: float | None = Field(
        description="6 sigma in percent of the tolerance; null without a tolerance."
    )


class CrossedOut(BaseModel):
    """Gauge R&R by one method."""

    method: Literal["anova", "average_range"] = Field(description="How it was computed.")
    parts: int = Field(description="Number of parts.")
    operators: int = Field(description="Number of operators.")
    trials: int = Field(description="Number of values of each operator at each part.")
    components: list[ComponentOut] = Field(description="What the variation consists of.")
    ndc: int = Field(description="Number of distinct categories.")
    pooled: bool = Field(description="The interaction is counted as repeatability (p above 0.25).")
    zeroed: list[str] = Field(description="Components whose estimated variance was negative and counts as 0.")
    table: list[VarianceLineOut] = Field(description="Of the analysis of variance; empty for average and range.")


class GaugeVerdictOut(BaseModel):
    """A number beside its published limit."""

    name: str
    value: str = Field(description="The number, as it is written.")
    verdict: str = Field(description="What it says of the gauge.")
    limit: str = Field(description="The published limit, as it is written.")


class AdviceOut(BaseModel):
    """R33 as the repeatability suggests it. Nothing is changed by it."""

    zero_range: float = Field(description="R33 that the repeatability suggests, mm.")
    fits: bool | None = Field(description="Whether it is below R34.")
    reasoning: list[str] = Field(description="How it comes to that, in sentences.")


class StudyOut(BaseModel):
    """A gauge study with what it says; computed from its values whenever it is asked for."""

    id: int
    kind: StudyKind = Field(description="Kind of study.")
    machine: str
    characteristic: str | None
    gauge: str = Field(description="Name of the gauge.")
    revision: int = Field(description="Counts up from 1 with each time it was put right.")
    newest_revision: int = Field(description="The newest of them.")
    at: datetime
    by: str
    reason: str | None = Field(description="Why it was put right; null of the first revision.")
    settings: dict[str, Any] = Field(description="As it was sent: gauge, tolerance, resolution, reference.")
    rows: list[dict[str, Any]] = Field(description="The values, as they were sent.")
    refused: str | None = Field(description="Why the values say nothing.")
    bias: BiasOut | None = Field(description="null where the kind has none.")
    type_one: TypeOneOut | None = Field(description="Cg and Cgk; null where the kind has none.")
    linearity: LinearityOut | None = Field(description="null where the kind has none.")
    grr: list[CrossedOut] = Field(description="By analysis of variance, and by average and range.")
    values_left_out: int = Field(description="Of cells longer than the shortest, with `unbalanced` = `fewest`.")
    verdicts: list[GaugeVerdictOut] = Field(description="Its numbers beside their published limits.")
    zero_range: AdviceOut | None = Field(description="null where it serves no characteristic.")
    taken_from: str | None = Field(description="Readings that it was taken from, and the empirical value taken off.")
    caution: str | None = Field(description="Where the empirical value changed inside the study.")
    warnings: Warnings


def study_out(row: StudyRow, advice: Advice | Refused | None) -> StudyOut:
    """The study as JSON."""
    evaluation = row.evaluation
    return StudyOut(
        id=row.study.id,
        kind=row.study.kind,  # type: ignore[arg-type]  # a CHECK holds it
        machine=row.machine.key,
        characteristic=row.characteristic,
        gauge=row.settings["gauge"],
        revision=row.revision.revision,
        newest_revision=row.newest,
        at=row.revision.at,
        by=row.revision.actor,
        reason=row.revision.reason,
        settings=row.settings,
        rows=row.revision.rows,
        refused=wording.refusal(evaluation.refused) if evaluation.refused else None,
        bias=answer_from(BiasOut, evaluation.bias) if isinstance(evaluation.bias, Bias) else None,
        type_one=answer_from(TypeOneOut, evaluation.type_one) if isinstance(evaluation.type_one, TypeOne) else None,
        linearity=_linearity(evaluation.linearity) if isinstance(evaluation.linearity, Linearity) else None,
        grr=_crossed(evaluation, row.tolerance),
        values_left_out=evaluation.cut,
        verdicts=[
            GaugeVerdictOut(name=verdict.name, value=verdict.value, verdict=verdict.word, limit=verdict.limit)
            for verdict in wording.verdicts(evaluation, row.tolerance)
        ],
        zero_range=answer_from(AdviceOut, advice.suggestion, reasoning=wording.advice(advice))
        if isinstance(advice, Advice)
        else None,
        taken_from=wording.taken_from(row.settings["source"], row.characteristic) if "source" in row.settings else None,
        caution=wording.empirical_value_changed(row.settings),
        warnings=warnings_out(row.warnings, sentence),
    )


def _linearity(found: Linearity) -> LinearityOut:
    return answer_from(
        LinearityOut, found, biases={f"{reference:g}": value for reference, value in found.biases.items()}
    )


def _crossed(found: Evaluation, tolerance: float | None) -> list[CrossedOut]:
    return [
        answer_from(
            CrossedOut,
            study,
            method=study.method.value,
            components=[
                ComponentOut(
                    name=name,  # type: ignore[arg-type]
                    sigma=sigma,
                    percent=study.percent(sigma),
                    percent_tolerance=study.percent_tolerance(sigma, tolerance) if tolerance else None,
                )
                for name, sigma in _sigmas(study)
            ],
            zeroed=["reproducibility" if name == "appraiser" else name for name in study.zeroed],
            table=[
                answer_from(
                    VarianceLineOut,
                    line,
                    **{name: _number(getattr(line, name)) for name in ("mean_square", "f", "p_value")},
                )
                for line in study.table
            ],
        )
        for study in (found.anova, found.ranges)
        if isinstance(study, Study)
    ]


def _sigmas(found: Study) -> list[tuple[str, float]]:
    sigmas = [("grr", found.grr), ("repeatability", found.equipment), ("reproducibility", found.appraiser)]
    if found.interaction is not None:
        sigmas.append(("interaction", found.interaction))
    return [*sigmas, ("part", found.part), ("total", found.total)]


def _number(value: float) -> float | None:
    return None if isnan(value) else value
