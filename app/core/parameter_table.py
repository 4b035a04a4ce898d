"""The table of the parameters: names, R numbers, what each holds, and the ranges that the sources print (domain §2).

The API, the form and the documents are made from `FIELDS`. Lengths are mm.
"""

from enum import StrEnum
from functools import partial
from typing import Any, NamedTuple

from app.core.natural_limit import NaturalLimit

LARGEST_LENGTH = 100_000.0  # mm; no machine tool is a hundred metres long


class Variant(StrEnum):
    """Measuring variant of a dimension (R25, and R24 for two points)."""

    SINGLE = "single"
    INDEXED = "indexed"
    ROUND = "round"
    ALONG = "along"
    TWO_POINT = "two_point"


class Axis(StrEnum):
    """Measuring axis (R30)."""

    X = "X"
    Z = "Z"
    Y = "Y"


class Direction(StrEnum):
    """Direction of probing (R31)."""

    POSITIVE = "positive"
    NEGATIVE = "negative"


class MachineType(StrEnum):
    """Kinds of machine tool, as far as measuring cycles differ between them."""

    LATHE = "lathe"
    MILL = "mill"
    MILL_TURN = "mill_turn"
    GRINDER = "grinder"
    OTHER = "other"


TOOL_LOCATIONS, AVERAGE_LOCATIONS = 32, 20  # of the control in the sources (R10, R11); a machine has its own
MOST_LOCATIONS = 999


class Feature(StrEnum):
    """The probed feature: a part from outside (shaft, spigot, web) or inside (bore, slot, pocket), or the tool R10 itself.

    The length or radius of a tool tells its wear directly: no correction of an offset changes it, and all of them together
    are to be what it differs by.
    """

    OUTSIDE = "outside"
    INSIDE = "inside"
    TOOL = "tool"


class Mode(StrEnum):
    """Use of a computed correction."""

    AUTOMATIC = "automatic"
    APPROVAL = "approval"
    MEASURE_ONLY = "measure_only"


class WearPolicy(StrEnum):
    """Policy for a correction computed in the wear zone: hold it for the operator, or release it."""

    HOLD = "hold"
    RELEASE = "release"


ENUMS: dict[str, type[StrEnum]] = {
    "variant": Variant,
    "axis": Axis,
    "direction": Direction,
    "feature": Feature,
    "mode": Mode,
    "wear_policy": WearPolicy,
    "natural_limit": NaturalLimit,
}


class FieldKind(StrEnum):
    """Type of a parameter's value."""

    LENGTH = "length"
    NUMBER = "number"
    WHOLE = "whole"
    CHOICE = "choice"
    YES_NO = "yes_no"


class Field(NamedTuple):
    """One parameter: its name, R number (or None), what it holds and the range printed in the source.

    required: must be said; `default` stands where it is not. codes: the control's numbers for choices.
    lowest, highest: outside it has no meaning and is refused; source_range: outside it is unusual, a warning.
    """

    name: str
    r: str | None
    kind: FieldKind
    required: bool = False
    default: Any = None
    lowest: float | None = None
    highest: float | None = None
    source_range: tuple[float, float] | None = None
    choices: tuple[str, ...] = ()
    codes: tuple[int, ...] = ()


def _choices(enum: type[StrEnum]) -> tuple[str, ...]:
    return tuple(member.value for member in enum)


_location = partial(Field, kind=FieldKind.WHOLE, default=0, lowest=0, highest=MOST_LOCATIONS)

FIELDS: tuple[Field, ...] = (
    _location("tool_memory", "R10", source_range=(0, TOOL_LOCATIONS)),
    _location("average_memory", "R11", source_range=(0, AVERAGE_LOCATIONS)),
    Field("variant", "R25", FieldKind.CHOICE, default="single", choices=_choices(Variant), codes=(0, 1, 2, 3)),
    Field("points", "R23", FieldKind.WHOLE, default=1, lowest=1, highest=100),
    Field("repeats", "R27", FieldKind.WHOLE, default=1, lowest=1, highest=100, source_range=(1, 10)),
    Field("index", "R26", FieldKind.NUMBER, lowest=-100_000, highest=100_000),
    Field("wait", "R04", FieldKind.NUMBER, lowest=0, highest=3600),
    Field("axis", "R30", FieldKind.CHOICE, default="X", choices=_choices(Axis), codes=(1, 2)),
    Field("direction", "R31", FieldKind.CHOICE, choices=_choices(Direction), codes=(0, 1)),
    Field("feature", None, FieldKind.CHOICE, default="outside", choices=_choices(Feature)),
    Field("nominal", "R42", FieldKind.LENGTH),
    Field("upper_deviation", "R40", FieldKind.LENGTH),
    Field("lower_deviation", "R41", FieldKind.LENGTH),
    Field("target", "R32", FieldKind.LENGTH),
    Field("tolerance_width", "R35", FieldKind.LENGTH, lowest=0.000001),
    Field("natural_limit", None, FieldKind.CHOICE, choices=_choices(NaturalLimit)),
    Field("zero_range", "R33", FieldKind.LENGTH, required=True, lowest=0, source_range=(0, 0.1)),
    Field("averaging_limit", "R34", FieldKind.LENGTH, lowest=0, source_range=(0, 0.1)),
    Field("wear_limit", "R37", FieldKind.LENGTH, required=True, lowest=0, source_range=(0.3, 3)),
    Field("confidence_limit", "R36", FieldKind.LENGTH, required=True, lowest=0, source_range=(1, 3)),
    Field("weighting_factor", "R29", FieldKind.NUMBER, default=1.0, lowest=1, highest=1_000_000, source_range=(1, 4)),
    Field("path_factor", "R28", FieldKind.NUMBER, default=1.0, lowest=0.001, highest=1000, source_range=(1, 5)),
    Field("factor", None, FieldKind.NUMBER, lowest=-1000, highest=1000),
    Field("rejected_may_correct", None, FieldKind.YES_NO, default=False),
    Field("mode", None, FieldKind.CHOICE, default="automatic", choices=_choices(Mode)),
    Field("wear_policy", None, FieldKind.CHOICE, default="hold", choices=_choices(WearPolicy)),
    Field("max_step", None, FieldKind.LENGTH, lowest=0.000001),
    Field("max_total", None, FieldKind.LENGTH, lowest=0),
    Field("plausible_jump", None, FieldKind.LENGTH, lowest=0.000001),
)
BY_NAME: dict[str, Field] = {field.name: field for field in FIELDS}
BY_R: dict[str, str] = {field.r: field.name for field in FIELDS if field.r}
# R24 is the control's switch for two-point measurement; here that is a variant of its own.
TWO_POINT_SWITCH = "R24"


class Problem(NamedTuple):
    """Something wrong with a parameter set: where, what (a code with values), and how bad.

    Codes: required, unknown, twice, not_a_number, not_whole, not_a_choice, not_yes_no, range, order, target_missing,
    target_twice, tolerance_sign, sign_missing, factor_zero, accept, sections, tool_measured, contested, no_location, natural_corrected, and the warnings source_range,
    variant_axis, points_missing, not_on_lathe, factor_on_lathe, factor_outside, factor_inside, switch_value, switch_wins, switch_loses,
    out_of_reach, spacing_missing, places_coincide, limits_as_sizes, averages_never, factor_of_tool, factor_of_a_unit, natural_assumed,
    natural_likely.
    """

    field: str
    code: str
    data: dict[str, Any]
    warning: bool = False
