"""Drift by temperature as JSON. Lengths in mm."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field

from app.core.drift import Column, Drift
from app.core.regression import Effect, LeftOut
from app.quality.temperature import wording
from app.quality.temperature.queries import Study


class PartialEffect(BaseModel):
    """Change by one unit while the other effects stay: least squares, 95 % interval."""

    value: Annotated[float, Field(description="mm per K, or mm per part.")]
    low: Annotated[
        float, Field(description="Lower end of the 95 % confidence interval; neighbours that are alike count less.")
    ]
    high: Annotated[float, Field(description="Its upper end.")]
    standard_error: Annotated[float, Field(description="Standard error of the value.")]
    p_value: Annotated[float, Field(description="Probability of as much by chance alone.")]
    inflation: Annotated[
        float,
        Field(description="Variance inflation by the other effects: 1 alone; above 10 it is hard to tell from them."),
    ]
    collinear: Annotated[bool, Field(description="The inflation is above 10.")]
    share: Annotated[float, Field(description="Share of the variation that it explains beyond the others, 0 to 1.")]

    @classmethod
    def of(cls, effect: Effect) -> Self:
        """As it is answered."""
        own = {name: getattr(effect, name) for name in cls.model_fields if name != "collinear"}
        return cls(**own, collinear=effect.inflated)


class NoEffect(BaseModel):
    """An effect that cannot be separated."""

    column: Annotated[Column, Field(description="Which.")]
    reason: Annotated[
        LeftOut, Field(description="`constant`: it does not vary; `determined`: it follows from the others.")
    ]


class TemperatureOut(BaseModel):
    """Sizes without their corrections, regressed on temperature, parts since the last pause, and wear. Nothing is corrected by it."""

    characteristic: str
    of: Annotated[Literal["part", "machine"], Field(description="Whose temperature.")]
    readings: Annotated[int, Field(description="Readings that it was made of: those with a temperature.")]
    without: Annotated[int, Field(description="Readings of the window without a temperature.")]
    unbelieved: Annotated[
        int, Field(description="Readings whose temperature cannot be true (below −30 or above 150 °C), left out.")
    ]
    worn: Annotated[int, Field(description="Readings of worn or broken tools (beyond R37), left out.")]
    rebuilt: Annotated[
        bool,
        Field(description="The corrections are taken out; false: nobody knows them, sizes are as they came out."),
    ]
    lowest: Annotated[float, Field(description="Lowest temperature, °C.")]
    highest: Annotated[float, Field(description="Highest temperature, °C.")]
    levels: Annotated[int, Field(description="Stretches with a level of their own: tools, and steps of the reference.")]
    pause: Annotated[float, Field(description="Minutes without a reading that are a pause.")]
    pauses: Annotated[int, Field(description="Pauses in these readings.")]
    warm_up: Annotated[int, Field(description="Parts after a pause that count as warming up.")]
    temperature: Annotated[PartialEffect | None, Field(description="mm per K; null: see `left_out`.")]
    since_pause: Annotated[
        PartialEffect | None, Field(description="mm per part while the machine warms up; null: see `left_out`.")
    ]
    wear: Annotated[PartialEffect | None, Field(description="mm per part; null: see `left_out`.")]
    left_out: Annotated[list[NoEffect], Field(description="Effects that cannot be separated, with the reason.")]
    explained: Annotated[float, Field(description="Share of the variation that all of them explain (R²), 0 to 1.")]
    scatter: Annotated[float, Field(description="Standard deviation that remains, mm.")]
    correlation: Annotated[float, Field(description="Lag-1 autocorrelation of what remains.")]
    effective: Annotated[float, Field(description="How many independent readings these are worth.")]
    expected: Annotated[
        float | None,
        Field(
            description="mm per K of the measured size, if nothing but the part (of `machine`: the scale) expands; null: no coefficient."
        ),
    ]
    text: Annotated[list[str], Field(description="The same in sentences.")]

    @classmethod
    def of_study(cls, study: Study, drift: Drift) -> Self:
        """A study as it is answered."""
        found = drift.regression
        effects = {name: PartialEffect.of(effect) for name, effect in found.effects.items()}
        return cls(
            characteristic=study.current.characteristic.key,
            of=study.of,
            readings=found.readings,
            without=study.readings - study.stated,
            unbelieved=drift.unbelieved,
            worn=study.worn,
            rebuilt=study.rebuilt,
            lowest=float(drift.temperature.min()),
            highest=float(drift.temperature.max()),
            levels=found.levels,
            pause=drift.pause,
            pauses=drift.pauses,
            warm_up=study.warm_up,
            temperature=effects.get(Column.TEMPERATURE),
            since_pause=effects.get(Column.SINCE_PAUSE),
            wear=effects.get(Column.WEAR),
            left_out=[NoEffect(column=Column(name), reason=why) for name, why in found.left_out.items()],
            explained=found.r_squared,
            scatter=found.scatter,
            correlation=found.correlation,
            effective=found.effective,
            expected=study.expected,
            text=wording.sentences(study, drift),
        )
