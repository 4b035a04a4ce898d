"""Thermal expansion as JSON."""

from datetime import datetime
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, Field
from pydantic_core import PydanticCustomError

from app.core.parameters import LARGEST_LENGTH
from app.core.temperature import PER_KELVIN, SMALLEST, Expansion
from app.language.i18n import _
from app.loop.expansion.tables import ThermalExpansion
from app.web.fields import Body, Reason

_COEFFICIENT = (
    "Coefficient of linear expansion of the part, µm/(m K): steel about 11.5, aluminium 23.8; null: not stated."
)
_OF_COEFFICIENT = "Standard uncertainty of the coefficients, µm/(m K); null: not stated."
_SCALE = (
    "Coefficient of the scale that the machine measures with, µm/(m K): glass about 8, steel 10.5. Sizes at 20 °C then need "
    "`machine_temperature` too; null: the scale shows true lengths, as where the control compensates it."
)
_OF_TEMPERATURE = "Standard uncertainty of the temperatures, K; null: not stated."
_LENGTH = "Length that expands, mm; null: the size itself. For a step or a position that is measured from elsewhere."


def _per_metre(value: float) -> float:
    if 0 < abs(value) < SMALLEST:
        looks = _("looks like a coefficient in 1/K; in µm/(m K) it is {value}").format(value=f"{value / PER_KELVIN:g}")
        raise PydanticCustomError("coefficient", looks)
    return value


Coefficient = Annotated[float, Field(strict=True, ge=-100, le=500, allow_inf_nan=False), AfterValidator(_per_metre)]


class ExpansionIn(Body):
    """The thermal expansion of a characteristic. Without a coefficient there is no size at 20 °C."""

    coefficient: Annotated[Coefficient | None, Field(description=_COEFFICIENT)] = None
    coefficient_uncertainty: Annotated[float | None, Field(strict=True, ge=0, le=500, description=_OF_COEFFICIENT)] = (
        None
    )
    scale_coefficient: Annotated[Coefficient | None, Field(description=_SCALE)] = None
    temperature_uncertainty: Annotated[float | None, Field(strict=True, ge=0, le=50, description=_OF_TEMPERATURE)] = (
        None
    )
    length: Annotated[float | None, Field(strict=True, ge=0, le=LARGEST_LENGTH, description=_LENGTH)] = None
    reason: Reason

    @property
    def expansion(self) -> Expansion:
        """As the core has it."""
        return Expansion(**self.model_dump(exclude={"reason"}))


class ExpansionOut(BaseModel):
    """The thermal expansion of a characteristic. No decision and no correction rests on it."""

    characteristic: str
    coefficient: Annotated[float | None, Field(description=_COEFFICIENT)]
    coefficient_uncertainty: Annotated[float | None, Field(description=_OF_COEFFICIENT)]
    scale_coefficient: Annotated[float | None, Field(description=_SCALE)]
    temperature_uncertainty: Annotated[float | None, Field(description=_OF_TEMPERATURE)]
    length: Annotated[float | None, Field(description=_LENGTH)]
    changed_at: Annotated[datetime | None, Field(description="When it was set; null: it never was.")]
    changed_by: Annotated[str | None, Field(description="Who set it.")]
    reason: Annotated[str | None, Field(description="Why it is so.")]

    @classmethod
    def of(cls, characteristic: str, row: ThermalExpansion | None) -> Self:
        """As it is in force."""
        fields: dict[str, Any] = {
            name: getattr(row, name, None) for name in cls.model_fields if name != "characteristic"
        }
        return cls(characteristic=characteristic, **fields)
