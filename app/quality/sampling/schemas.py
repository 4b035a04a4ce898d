"""Proposed sampling as JSON. Lengths in mm."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field

from app.core.sampling import saved
from app.quality.sampling.queries import Sampling


class RiskOut(BaseModel):
    """The risk of measuring 1 in N parts."""

    every: Annotated[int, Field(description="1 in N parts is measured.")]
    ppm: Annotated[float, Field(description="Parts per million that would go out of tolerance unmeasured.")]
    seconds_saved: Annotated[
        float | None, Field(description="Seconds of measuring saved in 1,000 parts; null: no `seconds` was named.")
    ]


class SamplingOut(BaseModel):
    """The proposal: 1 in `every` parts is measured."""

    characteristic: str
    every: Annotated[int, Field(description="The largest interval whose risk is allowed; 1: every part.")]
    planned: Annotated[int | None, Field(description="The interval of the control plan in force.")]
    hindrances: Annotated[
        list[Literal["few_readings", "unstable", "open_signal", "not_capable", "wear_unknown"]],
        Field(description="Why every part is to be measured."),
    ]
    most_ppm: Annotated[float, Field(description="The risk that is allowed.")]
    risks: Annotated[list[RiskOut], Field(description="The risk of each choice.")]
    readings: Annotated[int, Field(description="Readings that it rests on.")]
    mean: Annotated[float, Field(description="Mean deviation, mm.")]
    spread: Annotated[float, Field(description="Standard deviation of all of them, mm.")]
    wear: Annotated[float | None, Field(description="Wear per part, at most, mm; null: not known.")]
    jumps: Annotated[int, Field(description="Runs of readings out of tolerance.")]
    stable: Annotated[bool | None, Field(description="In control and constant in time; null: too little is known.")]
    open_signals: Annotated[int, Field(description="Signals of the control chart that are open.")]
    index_low: Annotated[
        float | None, Field(description="Lower end of the interval of the index that is quoted; null: none may be.")
    ]

    @classmethod
    def of(cls, found: Sampling, seconds: float | None) -> Self:
        """A proposal as it is answered. seconds: that one measurement takes."""
        process, proposed = found.process, found.proposal
        return cls(
            characteristic=found.current.characteristic.key,
            every=proposed.every,
            planned=found.every,
            hindrances=[each.value for each in proposed.hindrances],
            most_ppm=found.most_ppm,
            risks=[
                RiskOut(
                    every=each.every,
                    ppm=each.ppm,
                    seconds_saved=None if seconds is None else saved(each.every, seconds),
                )
                for each in proposed.risks
            ],
            readings=process.readings,
            mean=process.mean,
            spread=process.sigma,
            wear=process.wear,
            jumps=process.jumps,
            stable=process.stable,
            open_signals=process.signals,
            index_low=process.index_low,
        )
