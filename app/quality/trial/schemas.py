"""A shadow trial as JSON. Lengths in mm."""

from typing import Annotated, Literal, Self

from pydantic import BaseModel, Field

from app.core.replay import Figures
from app.loop.characteristics.queries import CurrentCharacteristic
from app.quality.trial.queries import Trial
from app.web.fields import Body, Length, Reason

K = Annotated[float, Field(strict=True, ge=1, le=1_000_000, description="Weighting factor k (R29).")]
R33 = Annotated[Length, Field(ge=0, description="Zero range (R33), mm.")]


class SideOut(BaseModel):
    """One side of a trial."""

    readings: Annotated[int, Field(description="Readings that count.")]
    rejects: Annotated[int, Field(description="Parts out of tolerance.")]
    corrections: Annotated[int, Field(description="Corrections that were, or would have been, issued.")]
    ppk: Annotated[float | None, Field(description="Ppk as if normal; null: too few readings, or too coarse ones.")]
    spread: Annotated[float | None, Field(description="Standard deviation, mm.")]
    mean: Annotated[float | None, Field(description="Mean deviation from the target, mm.")]

    @classmethod
    def of(cls, figures: Figures) -> Self:
        """Figures as they are answered."""
        return cls(**{name: getattr(figures, name) for name in cls.model_fields})


class SettingsOut(BaseModel):
    """Settings of a loop."""

    weighting_factor: Annotated[float, Field(description="Weighting factor k (R29).")]
    zero_range: Annotated[float, Field(description="Zero range (R33), mm.")]


class TrialOut(BaseModel):
    """A characteristic as it was measured, and as a loop would have corrected it."""

    characteristic: str
    measures_only: Annotated[bool, Field(description="False: it corrects already, and the trial is over.")]
    parameters_version: Annotated[int, Field(description="Version in force.")]
    delay: Annotated[int, Field(description="Parts cut with the old offset after a correction, as assumed.")]
    without: Annotated[SideOut, Field(description="As it was measured.")]
    today: Annotated[SideOut, Field(description="Corrected by the settings in force.")]
    proposed: Annotated[
        SideOut | None, Field(description="Corrected by the proposed settings; null: fewer than 100 readings.")
    ]
    settings: Annotated[SettingsOut | None, Field(description="The proposed settings.")]

    @classmethod
    def of(cls, trial: Trial) -> Self:
        """A trial as it is answered."""
        current = trial.past.current
        return cls(
            characteristic=current.characteristic.key,
            measures_only=current.parameters.measures_only,
            parameters_version=current.version.version,
            delay=trial.delay,
            without=SideOut.of(trial.without),
            today=SideOut.of(trial.today),
            proposed=SideOut.of(trial.proposed) if trial.proposed else None,
            settings=SettingsOut(**trial.settings._asdict()) if trial.settings else None,
        )


class StartedOut(BaseModel):
    """A characteristic that corrects from now on."""

    characteristic: str
    mode: Annotated[Literal["automatic"], Field(description="Of its parameters.")]
    parameters_version: Annotated[int, Field(description="The new version.")]
    settings: Annotated[SettingsOut, Field(description="In force.")]

    @classmethod
    def of(cls, current: CurrentCharacteristic) -> Self:
        """As it is answered."""
        parameters = current.parameters
        return cls(
            characteristic=current.characteristic.key,
            mode="automatic",
            parameters_version=current.version.version,
            settings=SettingsOut(weighting_factor=parameters.weighting_factor, zero_range=parameters.zero_range),
        )


class StartIn(Body):
    """The trial ends: the characteristic corrects from now on."""

    weighting_factor: K | None = None
    zero_range: R33 | None = None
    parameters_version: Annotated[
        int | None,
        Field(strict=True, ge=1, description="Version that the trial was made with: 409 if another is in force."),
    ] = None
    reason: Reason
