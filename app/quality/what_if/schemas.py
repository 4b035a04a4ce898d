"""What-if, map and proposals as JSON. Lengths in mm."""

from datetime import datetime
from typing import Annotated, Any, Literal

from pydantic import BaseModel, Field

from app.core.context import ContextField
from app.core.policy_map import Criterion
from app.core.replay import LONGEST_DELAY
from app.core.sampling import CHOICES
from app.quality.what_if.evidence import cell_of, evidence_of, period_of, sampling_of
from app.quality.what_if.proposals import ProposalRow
from app.quality.what_if.queries import USUAL, Map, Sampling, Simulation
from app.quality.what_if.strata import ReplayedStratum
from app.web.choice import PeriodBody
from app.web.fields import LARGEST_ID, Body, Reason, answer_from

LARGEST_LENGTH = 100_000.0
Length = Annotated[float, Field(ge=0, le=LARGEST_LENGTH, strict=True)]


class ReplayPeriodIn(PeriodBody):
    """Readings to replay: of the last N those measured from … to; the last 1000 unless chosen otherwise."""

    last: Annotated[int | None, Field(ge=1, le=LARGEST_ID, strict=True, description="The last N readings.")] = None

    @property
    def newest(self) -> int | None:
        """Largest number of readings."""
        return USUAL if self.last is None and self.start is None and self.end is None else self.last


class SettingsIn(ReplayPeriodIn):
    """Settings in place of today's; what is left out is as today."""

    averaging_limit: Annotated[Length | None, Field(description="R34.")] = None
    factor: Annotated[
        float | None,
        Field(
            ge=-1000,
            le=1000,
            strict=True,
            description="The factor that the loop believes in; the machine keeps its own.",
        ),
    ] = None
    delay: Annotated[
        int | None,
        Field(
            ge=0,
            le=LONGEST_DELAY,
            strict=True,
            description="Parts that come out with the old offset after a correction was issued; null: as it was most often.",
        ),
    ] = None
    effect: Annotated[
        float | None,
        Field(
            ge=0.05,
            le=5,
            strict=True,
            description="The share of a correction that acts: 1 is in full; null: as measured on these readings.",
        ),
    ] = 1.0


class WhatIfIn(SettingsIn):
    """Readings to replay, and the selected settings."""

    weighting_factor: Annotated[float | None, Field(ge=1, le=1_000_000, strict=True, description="k (R29).")] = None
    zero_range: Annotated[Length | None, Field(description="R33.")] = None


Every = Annotated[int, Field(strict=True, ge=1, le=1000)]
Few = Annotated[int, Field(strict=True, ge=0, le=1000)]
_AFTER_CHANGE = "Every part is measured for N readings after a tool change; the beginning of the period and an offset set by hand count as one."
_AFTER_ALARM = "The same after an alarm that a reading of this characteristic raises."


class SampledIn(WhatIfIn):
    """Readings to replay with 1 in N parts measured, and the selected settings."""

    every: Annotated[
        list[Every],
        Field(
            default_factory=lambda: list(CHOICES), min_length=1, max_length=50, description="Values of N, a row each."
        ),
    ]
    after_change: Annotated[Few | None, Field(description=f"{_AFTER_CHANGE} null: as the control plan says.")] = None
    after_alarm: Annotated[Few | None, Field(description=f"{_AFTER_ALARM} null: as the control plan says.")] = None


class WhatIfByIn(WhatIfIn):
    """The same, with the results apart by a field of the readings' context."""

    by: Annotated[ContextField | None, Field(description="The field by which results are split.")] = None


class MapIn(SettingsIn):
    """A grid of k and R33 to replay; left out it is made of round values about today's."""

    weighting_factors: Annotated[
        list[Annotated[float, Field(ge=1, le=1_000_000, strict=True)]] | None,
        Field(min_length=1, max_length=200, description="Values of k, a row each."),
    ] = None
    zero_ranges: Annotated[
        list[Length] | None, Field(min_length=1, max_length=200, description="Values of R33, a column each.")
    ] = None
    criterion: Annotated[Criterion, Field(description="By what the best region is found.")] = Criterion.PPK


class ProposalIn(WhatIfIn):
    """The settings to propose; the evidence is worked out again."""

    reason: Reason


class ProposalDecisionIn(Body):
    """Reason why it is approved, rejected or withdrawn."""

    reason: Reason


class FiguresOut(BaseModel):
    """Result of a replay. Mean, spread, Ppk and largest deviation are of the readings within R37."""

    readings: int = Field(description="Readings that count; excluded ones do not.")
    rejects: int = Field(description="Parts out of tolerance by their raw deviation; probe faults apart.")
    oversize: Annotated[int, Field(description="Parts above the tolerance.")]
    undersize: Annotated[int, Field(description="Parts below the tolerance.")]
    worn: int = Field(description="Readings in the wear zone.")
    faults: int = Field(description="Probe faults.")
    offset_limit: int = Field(description="Corrections not made because of max_total.")
    corrections: int
    of_tool: int = Field(description="Corrections of its tool in all, those of other characteristics included.")
    held: int = Field(description="Corrections that were held.")
    mean_size: float | None = Field(description="Mean size error that a correction removed.")
    inner: int = Field(description="Readings within R37.")
    mean: float | None
    spread: float | None = Field(description="Standard deviation of the sample.")
    ppk: float | None = Field(
        description="As if the readings were normal, to compare settings by; `quoted` is what may be quoted. null of fewer than 20 readings, and of readings that are too coarse."
    )
    largest: float | None = Field(description="Largest deviation, without its sign.")
    alarms: int = Field(description="Readings that raise an alarm by their size.")
    quote: Literal["cpk", "ppk", "fitted", "percentile", "none"] | None = Field(
        None, description="The index that may be quoted, as on the page of capability; null in the cells of a map."
    )
    quoted: float | None = Field(None, description="Its value.")
    why_none: str | None = Field(None, description="Code of the reason why none may be.")


class ReplayOut(FiguresOut):
    """A replay with its settings."""

    settings: dict[str, float] = Field(description="k, R33, R34 and factor by name.")


class LikenessOut(BaseModel):
    """The replay as it was set then, held against what truly happened."""

    verdict: Annotated[
        Literal["well", "roughly", "badly", "unknown"],
        Field(description="How well the replay does what truly happened."),
    ]
    off: float | None = Field(description="Root mean square of the difference between parts.")
    same: float | None = Field(description="Share of parts that are the same to 0.1 µm.")
    text: str
    replayed: FiguresOut


class EffectOut(BaseModel):
    """Measured share of a correction that acts: the slope with its 95 % interval; null where the readings do not show it."""

    value: Annotated[float | None, Field(description="The share: 1 is in full.")]
    low: Annotated[float | None, Field(description="Low end of its interval.")]
    high: Annotated[float | None, Field(description="High end of its interval.")]
    corrections: int | None
    readings: int | None
    typical: float | None = Field(description="Median change of size that was commanded.")
    scatter: Annotated[float | None, Field(description="Standard deviation of the changes about it, mm.")]
    is_full: bool | None = Field(description="Whether the interval holds 1.")
    text: str


class PeriodOut(BaseModel):
    """The readings that were replayed."""

    characteristic: str
    first_sequence: int
    last_sequence: int
    start: datetime = Field(description="When the first reading was measured.")
    end: datetime = Field(description="When the last reading was measured.")
    readings: int
    left_out: int = Field(description="Readings of which nobody knows with which corrections they were cut.")


class ResultOut(BaseModel):
    """Result of one stratum: mean and spread of its readings within R37, mm, and its parts outside today's tolerance."""

    mean: float | None
    spread: float | None = Field(description="Standard deviation of the sample.")
    outside: int = Field(description="Parts outside today's tolerance, without probe faults.")


class ReplayedStratumOut(BaseModel):
    """One order, nest, operator …: as it was, and as it would have been. The loop is replayed with all readings."""

    name: str
    readings: int
    truly: ResultOut
    today: ResultOut
    other: ResultOut


class WhatIfOut(PeriodOut):
    """Side by side: what was, today's settings and the others, both replayed."""

    parameters_version: int = Field(description="Today's.")
    delay: int = Field(description="Parts between a correction and its effect in the replay.")
    effect: float = Field(description="The share of a correction that acts in the replay.")
    truly: FiguresOut
    likeness: LikenessOut
    today: ReplayOut
    other: ReplayOut
    measured_effect: EffectOut
    cautions: list[str]
    strata: list[ReplayedStratumOut] | None = Field(None, description="With `by`: its newest values, at most 12.")

    @classmethod
    def of(cls, answer: Simulation, strata: list[ReplayedStratum] | None = None) -> "WhatIfOut":
        """As it is answered."""
        return cls.model_validate(evidence_of(answer) | {"strata": strata}, from_attributes=True)


class SampledRowOut(BaseModel):
    """The same parts with 1 in `every` of them measured."""

    every: Annotated[int, Field(description="1 in N parts is measured.")]
    measured: Annotated[int, Field(description="Parts that are measured.")]
    escaped: Annotated[int, Field(description="Parts out of tolerance that are not measured.")]
    figures: Annotated[
        FiguresOut,
        Field(
            description="Readings, rejects, mean, spread, Ppk and largest are of all parts, measured or not; corrections and alarms of "
            "those that are measured."
        ),
    ]


class SampledOut(PeriodOut):
    """The same readings with fewer parts measured, a row each N."""

    delay: int = Field(description="Parts between a correction and its effect in the replay.")
    settings: dict[str, float] = Field(description="k, R33, R34 and factor by name.")
    after_change: Annotated[int, Field(description=_AFTER_CHANGE)]
    after_alarm: Annotated[int, Field(description=_AFTER_ALARM)]
    rows: Annotated[list[SampledRowOut], Field(description="In the order in which they were asked for.")]
    cautions: Annotated[list[str], Field(description="Limits of these numbers.")]

    @classmethod
    def of(cls, sampling: Sampling) -> "SampledOut":
        """As it is answered."""
        return cls.model_validate(sampling_of(sampling))


class CellOut(BaseModel):
    """One setting of the map."""

    weighting_factor: Annotated[float, Field(description="k (R29) of this cell.")]
    zero_range: Annotated[float, Field(description="R33 of this cell, mm.")]
    figures: FiguresOut | None = Field(description="null where R33 < R34 does not hold.")
    inside: bool = Field(description="As good as the best: within two standard errors of it, or 5 %.")
    best: Annotated[bool, Field(description="The best by the criterion.")]
    calmest: bool = Field(description="Of those as good as the best the one that corrects least.")
    reason: str | None = Field(description="Why there are no figures.")


class MapOut(PeriodOut):
    """A grid of settings, row by row of k."""

    criterion: Criterion
    averaging_limit: Annotated[float, Field(description="R34 of every cell, mm.")]
    delay: Annotated[int, Field(description="Parts between a correction and its effect in the replay.")]
    today: FiguresOut = Field(description="Today's settings, replayed.")
    cells: Annotated[list[CellOut], Field(description="Every cell, row by row of k.")]

    @classmethod
    def of(cls, settings_map: Map) -> "MapOut":
        """As it is answered."""
        return cls.model_validate(
            period_of(settings_map.past)
            | {
                "criterion": settings_map.criterion,
                "averaging_limit": settings_map.averaging_limit,
                "delay": settings_map.delay,
                "today": settings_map.today._asdict() | {"alarms": settings_map.today.alarms},
                "cells": [cell_of(settings_map, at, cell) for at, cell in enumerate(settings_map.cells)],
            }
        )


class ProposalOut(BaseModel):
    """A change of parameters that somebody proposed, with its evidence."""

    id: int
    characteristic: str
    machine: str
    status: Literal["open", "outdated", "approved", "rejected", "withdrawn"] = Field(
        description="outdated: open, but the parameters have changed since."
    )
    from_version: int = Field(description="The version it changes.")
    changes: dict[str, float] = Field(description="Parameters by name.")
    reason: str
    proposed_by: Annotated[str, Field(description="Who proposed it.")]
    proposed_at: Annotated[datetime, Field(description="When it was proposed.")]
    decided_by: Annotated[str | None, Field(description="Who decided; null: nobody has.")]
    decided_at: Annotated[datetime | None, Field(description="When it was decided.")]
    decided_why: Annotated[str | None, Field(description="Why, in words.")]
    made_version: int | None = Field(description="The version that approving it made.")
    evidence: dict[str, Any] = Field(description="What the what-if answered when it was proposed.")

    @classmethod
    def of(cls, row: ProposalRow) -> "ProposalOut":
        """As it is answered."""
        proposal = row.proposal
        return answer_from(
            cls,
            proposal,
            characteristic=row.characteristic.key,
            machine=row.machine.key,
            status=row.status,
        )
