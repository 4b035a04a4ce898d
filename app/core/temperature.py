"""Size at the reference temperature of 20 °C (ISO 1:2022), from the measured size and the temperatures at that moment.

A part of temperature t is longer than at 20 °C by its coefficient of linear expansion, and so is the scale that it is measured
with. With the coefficients a and the temperatures t of both (JCGM 100:2008, H.1.1, eq. H.2)::

    length at 20 °C = measured length x (1 + a_scale (t_scale - 20)) / (1 + a_part (t_part - 20))

The length that expands is the measured one, as in that equation, not the nominal one; of a size the two differ by less than a
nanometre. Of a step or a position that is not measured from where the part is fixed it is another one, and is stated (`length`).
Without a coefficient of the scale the scale is taken for one that shows true lengths, as where the control compensates it.

The uncertainty is that of temperatures and coefficients alone, taken as independent. The product of two independent
estimates x, y has the variance x² u(y)² + y² u(x)² + u(x)² u(y)²; the last term, of higher order (JCGM 100:2008, 5.1.2, note),
is what remains near 20 °C. Temperatures are °C, lengths mm, coefficients µm/(m K), which is 1e-6/K.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import sqrt
from typing import NamedTuple

from app.core.decision.step import rounded

REFERENCE = 20.0  # °C (ISO 1)
LOWEST, HIGHEST = -30.0, 150.0
"""Temperatures that are believed, °C: a sensor that is broken or not connected shows one that lies far outside."""
PER_KELVIN = 1e-6  # of a coefficient in µm/(m K)
SMALLEST = 1e-3
"""A coefficient nearer to 0, µm/(m K), is one in 1/K: the glass ceramics that expand least have ten times as much."""


class Missing(StrEnum):
    """Reason why a reading has no size at 20 °C."""

    COEFFICIENT = "coefficient"
    PART_TEMPERATURE = "part_temperature"
    MACHINE_TEMPERATURE = "machine_temperature"
    NOT_BELIEVED = "not_believed"


@dataclass(frozen=True, slots=True)
class Expansion:
    """Expansion of a characteristic. Coefficients of the part and of the scale, µm/(m K); length: that expands, mm, None: the size.

    Standard uncertainties: coefficient_uncertainty of both coefficients, µm/(m K); temperature_uncertainty of both
    temperatures, K.
    """

    coefficient: float | None = None
    coefficient_uncertainty: float | None = None
    scale_coefficient: float | None = None
    temperature_uncertainty: float | None = None
    length: float | None = None


class AtReference(NamedTuple):
    """Size at 20 °C, the correction that it was made by, and its standard uncertainty (None: none is stated); mm."""

    size: float
    correction: float
    uncertainty: float | None


def believed(temperature: float) -> bool:
    """Tell if a part or a machine can have this temperature, °C.

    >>> [believed(each) for each in (21.5, -300.0, 900.0, float("nan"))]
    [True, False, False, False]
    """
    return LOWEST <= temperature <= HIGHEST


def at_reference(size: float, part: float | None, machine: float | None, expansion: Expansion) -> AtReference | Missing:
    """The size at 20 °C, or why there is none. part, machine: their temperatures, °C; None: not stated.

    With a coefficient of the scale the machine's temperature is needed too: left out of single readings, their sizes would
    jump by what the scale expands.

    >>> steel = Expansion(11.5, temperature_uncertainty=0.5)
    >>> at_reference(100.0, 30.0, None, steel)
    AtReference(size=99.988501322, correction=-0.011498678, uncertainty=0.000575)
    >>> at_reference(100.0, -300.0, None, steel).value
    'not_believed'
    """
    if expansion.coefficient is None:
        return Missing.COEFFICIENT
    if part is None:
        return Missing.PART_TEMPERATURE
    scale = expansion.scale_coefficient
    if scale is not None and machine is None:
        return Missing.MACHINE_TEMPERATURE
    if not believed(part) or (scale is not None and machine is not None and not believed(machine)):
        return Missing.NOT_BELIEVED
    bodies = [(expansion.coefficient, part - REFERENCE)]
    bodies.append((scale, machine - REFERENCE) if scale is not None and machine is not None else (0.0, 0.0))
    (of_part, of_scale) = (coefficient * PER_KELVIN * warmer for coefficient, warmer in bodies)
    length = size if expansion.length is None else expansion.length
    correction = rounded(length * (of_scale - of_part) / (1 + of_part))
    named = bodies if scale is not None else bodies[:1]
    return AtReference(rounded(size + correction), correction, _uncertainty(length, named, expansion))


def _uncertainty(length: float, bodies: list[tuple[float, float]], expansion: Expansion) -> float | None:
    """Standard uncertainty of the correction, mm. bodies: coefficient, and how much warmer than 20 °C, of part and scale."""
    if expansion.coefficient_uncertainty is None and expansion.temperature_uncertainty is None:
        return None
    of_coefficient, of_temperature = expansion.coefficient_uncertainty or 0.0, expansion.temperature_uncertainty or 0.0
    variance = sum(
        (coefficient * of_temperature) ** 2 + (warmer * of_coefficient) ** 2 + (of_coefficient * of_temperature) ** 2
        for coefficient, warmer in bodies
    )
    return rounded(abs(length) * PER_KELVIN * sqrt(variance))
