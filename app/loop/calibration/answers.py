"""Calibrations, pairs and plans as they are answered. Lengths in mm."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from app.loop.calibration import wording
from app.loop.calibration.figures import Mark
from app.loop.calibration.places import PlaceRow
from app.loop.calibration.queries import CalibrationRow, Pair, Suggestion
from app.loop.tables.calibration import CalibrationPlan
from app.loop.warnings.wording import sentence
from app.web.fields import answer_from
from app.web.warnings import WarningOut, Warnings, warnings_out

Status = Literal["refused", "unchanged", "proposed", "accepted", "overtaken"]
State = Literal["overdue", "refused", "proposed", "due_soon", "calibrated", "never"]
ACTIONS = {"refused": "stop", "proposed": "accept"}


class OutcomeReason(BaseModel):
    """The outcome of a calibration."""

    code: Annotated[
        str,
        Field(
            description="within_zero_range, average_kept, averaged_difference, full_difference, centred, paired; refused: "
            "window, probe_fault, no_touch, not_a_bore, wrong_gauge."
        ),
    ]
    text: Annotated[str, Field(description="For people.")]


class Accepted(BaseModel):
    """Person, time and reason of the acceptance; automatic: applied without a person, as planned."""

    at: datetime
    by: str
    reason: str
    automatic: Annotated[bool, Field(description="true: without a person, as planned.")]


class CalibrationOut(BaseModel):
    """A calibration as it came out. Lengths in mm."""

    machine: str
    number: Annotated[int, Field(description="Counts per machine.")]
    kind: Annotated[
        Literal["gauge", "ring", "pairs"], Field(description="Gauge (L92), ring on the spindle, or external gauge.")
    ]
    average_memory: Annotated[int | None, Field(description="R11 (R46): whose empirical value it is about.")]
    tool_memory: Annotated[int | None, Field(description="R47: the location that holds the probe's offset.")]
    status: Annotated[
        Status,
        Field(
            description="refused: it counts for nothing; unchanged: it confirms what is in effect; proposed: somebody may "
            "accept it; accepted; overtaken by a newer one."
        ),
    ]
    action: Annotated[str, Field(description="stop: refused, stop the machine; accept: a person decides; else none.")]
    reason: OutcomeReason
    gauge_size: Annotated[float | None, Field(description="R42; of a ring its nominal.")]
    measured: Annotated[float | None, Field(description="R43; of a ring the mean of its diameters.")]
    difference: Annotated[
        float | None, Field(description="R44; of a ring, distance of the probe from the spindle axis.")
    ]
    average: Annotated[float | None, Field(description="R49: the running average of the difference.")]
    value_before: Annotated[float, Field(description="Empirical value, or offset of the probe, that was in effect.")]
    proposed: Annotated[float | None, Field(description="What it is to become; none: it stays.")]
    results: Annotated[dict[str, float | None], Field(description="The same under the numbers in which L92 leaves it.")]
    touches: Annotated[list[Any], Field(description="As they came; of pairs, machine and external value.")]
    settings: Annotated[dict[str, Any], Field(description="Settings of the calibration, and further computed values.")]
    calibrated_at: Annotated[datetime, Field(description="When it was made.")]
    received_at: datetime
    by: str
    key: Annotated[str | None, Field(description="The key that it was sent with; null: none.")]
    accepted: Annotated[Accepted | None, Field(description="By whom and when; null: it was not.")]
    warnings: Annotated[
        list[WarningOut],
        Field(
            description="What may be wrong: inches sent as mm, values outside the ranges of the control's own cycle. With "
            "inches, or a value that no probe has, nothing is applied automatically."
        ),
    ]


def calibration_out(row: CalibrationRow, machine: str) -> CalibrationOut:
    """A calibration as it is answered."""
    record, acceptance = row.record, row.acceptance
    average = record.memory == "average"
    tool = record.settings.get("tool_memory") if average else record.location
    results = {
        "R42": record.size,
        "R43": record.measured,
        "R44": record.difference,
        "R46": record.location if average else None,
        "R47": tool,
        "R49": record.average,
    }
    return answer_from(
        CalibrationOut,
        record,
        machine=machine,
        average_memory=record.location if average else None,
        tool_memory=tool,
        status=row.status,
        action=ACTIONS.get(row.status, "none"),
        reason=OutcomeReason(code=record.outcome, text=wording.sentence(record)),
        gauge_size=record.size,
        results=results,
        settings={name: value for name, value in record.settings.items() if name != "warnings"},
        by=record.actor,
        accepted=None
        if acceptance is None
        else Accepted(at=acceptance.at, by=acceptance.actor, reason=acceptance.reason, automatic=acceptance.automatic),
        warnings=warnings_out(wording.warnings(record), wording.warning_sentence),
    )


def mark_of(row: CalibrationRow) -> Mark:
    """A calibration as it is drawn."""
    record, settings = row.record, row.record.settings
    nominal = record.size or 0.0
    ring = record.kind == "ring"
    return Mark(
        record.calibrated_at,
        record.number,
        row.status,
        wording.status_word(row.status),
        record.difference,
        record.value_before,
        zero=settings.get("zero_range"),
        averaging=settings.get("averaging_limit"),
        low=settings.get("low"),
        high=settings.get("high"),
        diameters=[diameter - nominal for diameter in settings.get("diameters", ())],
        smallest=settings["smallest"] - nominal if ring else None,
        largest=settings["largest"] - nominal if ring else None,
        text=wording.sentence(record),
    )


class ExcludedPair(BaseModel):
    """Person, time and reason of the exclusion of a pair."""

    at: datetime
    by: str
    reason: str


class PairOut(BaseModel):
    """The same part on the machine and on an external gauge."""

    id: int
    machine_value: Annotated[float, Field(description="Of the machine, mm.")]
    external_value: Annotated[float, Field(description="Of the external gauge, mm.")]
    difference: Annotated[float, Field(description="Machine minus external: measuring error of the machine.")]
    instrument: Annotated[str, Field(description="The external gauge.")]
    characteristic: str | None
    sequence: Annotated[
        int | None, Field(description="The reading that the machine's value is of; null: it was typed in.")
    ]
    at: datetime
    by: str
    counts: Annotated[bool, Field(description="It belongs to the series of now; a series begins with each new value.")]
    excluded: Annotated[ExcludedPair | None, Field(description="Why it does not count; null: it may.")]
    warnings: Warnings


def pair_out(pair: Pair) -> PairOut:
    """A pair as it is answered."""
    row = pair.row
    excluded = None
    if row.excluded_at is not None:
        excluded = ExcludedPair(at=row.excluded_at, by=row.excluded_by or "", reason=row.excluded_why or "")
    return answer_from(
        PairOut,
        row,
        external_value=row.true_value,
        difference=pair.difference,
        characteristic=pair.characteristic,
        by=row.actor,
        counts=pair.counts,
        excluded=excluded,
        warnings=warnings_out(pair.warnings, sentence),
    )


class SuggestionOut(BaseModel):
    """The comparison of the pairs of a location."""

    machine: str
    average_memory: Annotated[int, Field(description="R11.")]
    empirical_value: Annotated[float, Field(description="The one in effect.")]
    suggested: Annotated[
        float | None,
        Field(description="null while pairs are missing, when they agree with the one in effect, or are all the same."),
    ]
    pairs: Annotated[int, Field(description="Pairs that count.")]
    missing: Annotated[int, Field(description="How many more a suggestion needs.")]
    mean: Annotated[float | None, Field(description="Mean difference.")]
    deviation: Annotated[float | None, Field(description="Standard deviation of the differences.")]
    low: Annotated[float | None, Field(description="Lower end of the mean's confidence interval (Student t).")]
    high: Annotated[float | None, Field(description="Upper end.")]
    confidence: Annotated[float, Field(description="Of the interval, such as 0.95.")]
    equal: Annotated[bool, Field(description="All differences are the same: there is no interval, and no suggestion.")]
    step: Annotated[
        float | None,
        Field(
            description="Smallest distance of two differences, where the interval is half of it to each side; else null."
        ),
    ]
    outlier: Annotated[int | None, Field(description="The pair that stands out by Grubbs' test; only a hint.")]
    since: Annotated[datetime | None, Field(description="When the value in effect was set; the series began then.")]
    text: Annotated[str, Field(description="For people.")]


def suggestion_out(found: Suggestion, machine: str, location: int) -> SuggestionOut:
    """A suggestion as it is answered."""
    compared = found.comparison
    return SuggestionOut(
        machine=machine,
        average_memory=location,
        empirical_value=found.empirical_value,
        outlier=found.outlier,
        since=found.since,
        text=wording.what_pairs_say(compared, found.empirical_value),
        **{name: getattr(compared, name) for name in ("suggested", "pairs", "missing", "mean", "deviation")},
        **{name: getattr(compared, name) for name in ("low", "high", "confidence", "equal", "step")},
    )


class CalibrationPlanOut(BaseModel):
    """Interval of calibration, and automatic or approved application of its results."""

    acceptance: Annotated[str, Field(description="accept or automatic.")]
    due_parts: Annotated[int | None, Field(description="Due after N parts; null: not by parts.")]
    due_days: Annotated[float | None, Field(description="Due after N days; null: not by days.")]


class PlaceOut(CalibrationPlanOut):
    """A place that is calibrated, and when that is due."""

    machine: str
    average_memory: Annotated[int | None, Field(description="R11, whose empirical value is calibrated.")]
    tool_memory: Annotated[int | None, Field(description="R10, the probe whose offset is calibrated in the ring.")]
    state: Annotated[State, Field(description="Whether a calibration is due.")]
    characteristics: Annotated[list[str], Field(description="Which characteristics use it.")]
    value: Annotated[float, Field(description="Empirical value or offset in effect.")]
    parts: Annotated[int, Field(description="Parts since the last calibration, or since the plan was made.")]
    since: Annotated[datetime | None, Field(description="From when parts and days count.")]
    due_at: Annotated[datetime | None, Field(description="When it is due by days.")]
    last: Annotated[int | None, Field(description="Number of the last calibration.")]


def plan_out(plan: CalibrationPlan | None) -> CalibrationPlanOut:
    """A plan as it is answered; None: nothing is planned."""
    return CalibrationPlanOut(
        acceptance="accept" if plan is None else plan.acceptance,
        due_parts=None if plan is None else plan.due_parts,
        due_days=None if plan is None else plan.due_days,
    )


def place_out(row: PlaceRow) -> PlaceOut:
    """A place as it is answered."""
    plan, average = row.plan, row.place.memory == "average"
    return answer_from(
        PlaceOut,
        row,
        machine=row.machine.key,
        average_memory=row.place.location if average else None,
        tool_memory=None if average else row.place.location,
        **dict(plan_out(plan)),
        since=None if plan is None else plan.since,
        last=None if row.last is None else row.last.record.number,
    )
