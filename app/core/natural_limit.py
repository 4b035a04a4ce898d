"""Natural limits: a limit that no part can pass (roundness, run-out, straightness, roughness: nothing is below 0).

One place says what follows; every other asks it. The target is the natural limit itself, for there is nothing better. The
tolerance lies on one side of it, so R35 as a whole takes the place of R35/2, and a value beyond the natural limit by more than
the zero range R33 is no measurement. That side carries no index and no ppm, and neither Cp nor Cpm exists (ISO 22514-2; AQDEF
K2120 and K2121 = 2). No offset corrects such a size: it has no sign.
"""

import re
from collections.abc import Mapping
from enum import StrEnum
from typing import Any, NamedTuple


class NaturalLimit(StrEnum):
    """The limit that is a natural one."""

    NONE = "none"
    LOWER = "lower"
    UPPER = "upper"

    @property
    def side(self) -> int:
        """Sign of the deviations that do not exist: -1 below, 1 above; 0 where both sides do."""
        return {NaturalLimit.NONE: 0, NaturalLimit.LOWER: -1, NaturalLimit.UPPER: 1}[self]


class Tolerance(NamedTuple):
    """Limits as deviations from the target, mm; None for the natural one, beyond which there is nothing to judge."""

    lower: float | None
    upper: float | None

    @property
    def judged(self) -> list[float]:
        """The limits that are there, the lower one first."""
        return [limit for limit in self if limit is not None]

    def room(self, mean: float) -> float:
        """Distance of a mean from the nearer limit, mm; negative beyond it.

        >>> Tolerance(-0.008, 0.008).room(0.001), Tolerance(None, 0.0127).room(0.0127)
        (0.007, 0.0)
        """
        return min(abs(limit) - (mean if limit > 0 else -mean) for limit in self.judged)


def half_width(tolerance_width: float, natural: str | None) -> float:
    """Distance from the target to each limit that is judged, mm: R35/2, or R35 where the target is a natural limit.

    >>> half_width(0.016, "none"), half_width(0.0127, "lower")
    (0.008, 0.0127)
    """
    return tolerance_width / 2 if natural in (None, NaturalLimit.NONE) else tolerance_width


def natural_of(limits: Any) -> NaturalLimit:
    """The natural limit of a parameter set, or of anything with its limits."""
    return NaturalLimit(getattr(limits, "natural_limit", None) or NaturalLimit.NONE)


def half_of(limits: Any) -> float:
    """`half_width` of a parameter set, or of anything with its limits."""
    return half_width(limits.tolerance_width, natural_of(limits))


def tolerance_about_target(half: float, natural: str | None) -> Tolerance:
    """The limits that are judged. half: of `half_width`.

    >>> tolerance_about_target(0.008, "none"), tolerance_about_target(0.0127, "lower")
    (Tolerance(lower=-0.008, upper=0.008), Tolerance(lower=None, upper=0.0127))
    """
    return Tolerance(
        None if natural == NaturalLimit.LOWER else -half,
        None if natural == NaturalLimit.UPPER else half,
    )


def target_of(nominal: float, upper: float, lower: float, natural: str | None) -> float:
    """R32 of nominal size and deviations, mm: the middle of the tolerance (L75), or the natural limit.

    >>> target_of(10, 0, -0.004, "none"), target_of(0, 0.0127, 0, "lower")
    (9.998, 0)
    """
    if natural == NaturalLimit.LOWER:
        return round(nominal + lower, 9)
    if natural == NaturalLimit.UPPER:
        return round(nominal + upper, 9)
    return round(nominal + (upper + lower) / 2, 9)


def assumed(values: Mapping[str, Any]) -> NaturalLimit:
    """The natural limit of a set that does not say: the lower one of a size that is only measured, is 0 at best and has no minus.

    values: parameters by name, with `measures_only` decided by R10 and mode.

    >>> runout = {"nominal": 0, "upper_deviation": 0.02, "lower_deviation": 0, "tool_memory": 0}
    >>> assumed(runout).value, assumed(runout | {"tool_memory": 3}).value, assumed(runout | {"nominal": 10}).value
    ('lower', 'none', 'none')
    """
    nominal, upper, lower = (values.get(name) for name in ("nominal", "upper_deviation", "lower_deviation"))
    only_measured = not values.get("tool_memory") or values.get("mode") == "measure_only"
    at_zero = nominal == 0 and lower == 0 and isinstance(upper, int | float) and upper > 0
    return NaturalLimit.LOWER if at_zero and only_measured else NaturalLimit.NONE


_FORM = re.compile(
    r"""(?<![a-z])(
        (out.of.)?round(ness)?(?!\s*(bar|off)) | rundheit | circularity | run.?out | rundlauf | planlauf
        | cylindricity | zylinderform | zylindrizit[aä]t | straightness | geradheit | flatness | ebenheit
        | parallelism | parallelit[aä]t | perpendicularity | squareness | rechtwinkligkeit | angularity | neigung
        | concentricity | konzentrizit[aä]t | coaxiality | koaxialit[aä]t | symmetry | symmetrie
        | (line|surface)\s*profile | profilform | true\s*position | position\s*tolerance
        | roughness | rauheit | rautiefe | waviness | welligkeit
        | r[aztq](?=$|[\s\d_-])
    )(?![a-z])""",
    re.IGNORECASE | re.VERBOSE,
)


def looks_natural(name: str) -> bool:
    """Tell if the name of a characteristic is that of a form, position or roughness deviation, which is never below 0.

    >>> [looks_natural(name) for name in ("Run-out A", "Rundlauf", "Rz 6.3", "Roundness Ø40", "Diameter 40", "Round bar")]
    [True, True, True, True, False, False]
    """
    return _FORM.search(name) is not None
