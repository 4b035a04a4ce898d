"""Form measurements as they are answered. Lengths in mm."""

from datetime import datetime
from typing import Annotated, Any

from pydantic import BaseModel, Field

from app.geometry.geometric_form import wording
from app.geometry.geometric_form.evaluation import warnings_of
from app.geometry.geometric_form.queries import FormRow
from app.loop.readings.queries import PushedResult
from app.loop.warnings.wording import sentence
from app.web.fields import answer_from
from app.web.warnings import Warnings, warnings_out


class FormVerdictOut(BaseModel):
    """Verdict on the tolerance. sure: the limit lies outside the uncertainty, which is known."""

    code: Annotated[str, Field(description="good, good_unsure, bad_unsure or bad.")]
    good: Annotated[bool, Field(description="The deviation is within the tolerance.")]
    sure: Annotated[bool, Field(description="The limit lies outside the uncertainty, which is known.")]
    text: Annotated[str, Field(description="For people.")]


class FormDeviationOut(BaseModel):
    """A deviation by one method; uncertainty: expanded, k = 2, where it can be found."""

    method: Annotated[
        str, Field(description="minimum_zone, least_squares, printed, inscribed (MIC), circumscribed (MCC).")
    ]
    value: Annotated[float, Field(description="The deviation, mm.")]
    uncertainty: Annotated[float | None, Field(description="Expanded, k = 2, mm; null where it cannot be found.")]


class SuspectOut(BaseModel):
    """A touch that does not belong to what the others agree on."""

    of: Annotated[str, Field(description="feature or datum.")]
    section: Annotated[int | None, Field(description="Counted from 1; none where there are no sections.")]
    touch: Annotated[int, Field(description="Counted from 1.")]
    off: Annotated[float, Field(description="How far off, positive outside or above.")]
    t: Annotated[float, Field(description="Its studentized residual, which is beyond `limit`.")]
    limit: Annotated[float, Field(description="Largest studentized residual that chance explains.")]
    given: Annotated[list[float], Field(description="The touch as it was sent, mm.")]
    nearest: Annotated[list[float], Field(description="The next point that would fit.")]
    alone: Annotated[
        list[float | None],
        Field(
            description="Per coordinate what it would have to be if the others are right; none where that will not do."
        ),
    ]
    text: Annotated[str, Field(description="For people.")]


class FormReadingOut(BaseModel):
    """The reading that the result becomes; without a number it is on its way."""

    characteristic: str
    sequence: Annotated[int | None, Field(description="Number of the reading; null: it is on its way.")]
    refused: Annotated[str | None, Field(description="Why it became no reading.")]


class FormOut(BaseModel):
    """A form measurement with what was found. Lengths in mm."""

    id: int
    machine: str
    feature: Annotated[str, Field(description="Name of the feature.")]
    kind: Annotated[str, Field(description="What was evaluated, such as `roundness`.")]
    method: Annotated[str, Field(description="By which the verdict goes.")]
    value: Annotated[float, Field(description="The deviation by that method.")]
    uncertainty: Annotated[float | None, Field(description="Expanded, k = 2; from the probe's repeatability.")]
    tolerance: Annotated[float | None, Field(description="It is held against, mm; null: nothing was.")]
    verdict: Annotated[FormVerdictOut | None, Field(description="null without a tolerance.")]
    values: Annotated[list[FormDeviationOut], Field(description="The deviation by each method.")]
    suspects: Annotated[list[SuspectOut], Field(description="Touches that do not belong to what the others agree on.")]
    warnings: Warnings
    tested: Annotated[bool, Field(description="There were touches enough to tell a bad one.")]
    corrected: Annotated[
        float | None, Field(description="The deviation if suspected touches were where they would have to be.")
    ]
    details: Annotated[dict[str, Any], Field(description="Centres, diameters, axes, residuals.")]
    given: Annotated[dict[str, Any], Field(description="Touches and datum as they came.")]
    repeatability: Annotated[float | None, Field(description="Standard deviation of one touch, mm; null: not known.")]
    part: str | None
    measured_at: datetime
    received_at: datetime
    by: str
    key: str | None
    engine: Annotated[int, Field(description="Version of the evaluation.")]
    evaluation: Annotated[int, Field(description="How often it was evaluated; the newest counts.")]
    evaluated_at: Annotated[datetime, Field(description="When it was evaluated last.")]
    reading: Annotated[
        FormReadingOut | None, Field(description="The reading that it becomes; null: it serves no characteristic.")
    ]


def form_out(row: FormRow, reading: PushedResult | None = None) -> FormOut:
    """A measurement as it is answered."""
    measurement, evaluation = row.measurement, row.evaluation
    result = evaluation.result
    verdict = None
    if evaluation.verdict is not None:
        verdict = FormVerdictOut(
            code=evaluation.verdict,
            good=evaluation.verdict.startswith("good"),
            sure=evaluation.uncertainty is not None and not evaluation.verdict.endswith("unsure"),
            text=wording.sentence(evaluation.value, measurement.tolerance, evaluation.uncertainty, evaluation.verdict),
        )
    return answer_from(
        FormOut,
        measurement,
        machine=row.machine,
        method=evaluation.method,
        value=evaluation.value,
        uncertainty=evaluation.uncertainty,
        verdict=verdict,
        values=[FormDeviationOut(**value) for value in result["values"]],
        suspects=[SuspectOut(**suspect, text=wording.suspicion(suspect)) for suspect in result["suspects"]],
        warnings=warnings_out(warnings_of(measurement.kind, measurement.given, result, row.plausible_shift), sentence),
        tested=result["tested"],
        corrected=result["corrected"],
        details=result["details"],
        by=measurement.actor,
        engine=evaluation.engine,
        evaluation=evaluation.number,
        evaluated_at=evaluation.at,
        reading=None if reading is None else answer_from(FormReadingOut, reading),
    )
