"""Calibrations, pairs and plans as JSON. Lengths in mm."""

from collections.abc import Callable
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError

from app.core.calibration import SECTIONS
from app.core.parameters import LARGEST_LENGTH, MOST_LOCATIONS
from app.language.i18n import _
from app.web.fields import LARGEST_ID, Body, LatelyOrNow, Length, Reason, RecordKey, Slug, Text200

Positive = Annotated[float, Field(strict=True, ge=0, le=LARGEST_LENGTH, allow_inf_nan=False)]
MOST_TOUCHES = 100

R_NAMES = {
    "R11": "average_memory",
    "R22": "probe_type",
    "R27": "repeats",
    "R28": "path_factor",
    "R29": "weighting_factor",
    "R30": "axis",
    "R31": "direction",
    "R32": "gauge_size",
    "R33": "zero_range",
    "R34": "averaging_limit",
    "R36": "confidence_limit",
    "R47": "tool_memory",
}
R_CODES: dict[str, dict[int, str]] = {
    "R22": {1: "axial", 2: "radial"},
    "R30": {1: "X", 2: "Z"},
    "R31": {0: "positive", 1: "negative"},
}
MACRO_NAMES = {"#502": "radius_term", "#505": "nominal", "#506": "upper_deviation", "#507": "lower_deviation"}


def _by_number(value: Any, names: dict[str, str]) -> Any:
    """R numbers and macro variables in place of names. What is said twice is refused."""
    if not isinstance(value, dict):
        return value
    fields = dict(value)
    for number, name in names.items():
        if number not in fields:
            continue
        if name in fields:
            raise PydanticCustomError(
                "twice", _("{number} and {name} mean the same: give one").format(number=number, name=name), {"at": name}
            )
        entry = fields.pop(number)
        codes = R_CODES.get(number, {})
        fields[name] = codes.get(entry, entry) if isinstance(entry, int) and not isinstance(entry, bool) else entry
    return fields


def _schema_with(numbers: dict[str, str], more: dict[str, str]) -> Callable[[dict[str, Any]], None]:
    """Return what adds the numbers that may be in place of names to a schema; either of the two is needed then.

    more: numbers without a name of their own, and their meaning.
    """

    def add(schema: dict[str, Any]) -> None:
        properties = schema["properties"]
        for number, name in numbers.items():
            codes = R_CODES.get(number)
            types = [{"type": "integer"}, {"type": "string"}, {"type": "null"}]
            kind = {"anyOf": types} if codes else dict(properties[name])
            kind.pop("default", None)  # is at the name
            words = ": " + ", ".join(f"{code} is {choice}" for code, choice in codes.items()) if codes else ""
            properties[number] = kind | {"description": f"The same as `{name}`{words}."}
        for number, words in more.items():
            properties[number] = {"anyOf": [{"type": "integer"}, {"type": "null"}], "description": words}
        schema["required"] = [name for name in schema["required"] if name not in numbers.values()]

    return add


class GaugeIn(Body):
    """A calibration against a gauge of known size, as L92 makes it. R numbers may be in place of names (`"R33": 0.001`).

    Needed, by name or number, are R11, R32, R33, R34, R36.
    """

    model_config = ConfigDict(
        json_schema_extra=_schema_with(
            R_NAMES, {"R21": "1: a free surface, with R23 = 0; 0: a reference groove.", "R23": "0: a free surface."}
        )
    )

    average_memory: Annotated[
        int, Field(strict=True, ge=1, le=MOST_LOCATIONS, description="R11: whose empirical value is found (R46).")
    ]
    gauge_size: Annotated[Length, Field(description="R32: size of the gauge, or where the surface or flank lies.")]
    touches: Annotated[
        list[Length | None],
        Field(
            max_length=MOST_TOUCHES,
            description="One per repeat; their mean is R43. null where the probe did not trigger: the calibration is refused, "
            "which is kept and answered, with an alarm.",
        ),
    ]
    repeats: Annotated[
        int | None,
        Field(strict=True, ge=1, le=MOST_TOUCHES, description="R27; fewer touches are missing ones, more are 422."),
    ] = None
    surface: Annotated[
        Literal["free", "groove"], Field(description="On a free surface (R21 = 1, R23 = 0) or in a reference groove.")
    ] = "free"
    probe_type: Annotated[Literal["axial", "radial"] | None, Field(description="R22: 1 axial, 2 radial.")] = None
    axis: Annotated[Literal["X", "Z"], Field(description="R30: 1 X, 2 Z.")] = "X"
    direction: Annotated[Literal["positive", "negative"] | None, Field(description="R31: 0 positive, 1 negative.")] = (
        None
    )
    zero_range: Annotated[Positive, Field(description="R33: up to here nothing is to be changed.")]
    averaging_limit: Annotated[Positive, Field(description="R34: up to here the average decides.")]
    confidence_limit: Annotated[Positive, Field(description="R36: from here on the probe or the program is wrong.")]
    weighting_factor: Annotated[float, Field(strict=True, ge=1, le=1000, description="R29: k of the average.")] = 1.0
    path_factor: Annotated[
        float, Field(strict=True, gt=0, le=1000, description="R28: touches are expected within ±1 mm × R28.")
    ] = 1.0
    tool_memory: Annotated[
        int | None, Field(strict=True, ge=1, le=MOST_LOCATIONS, description="R47: the offset that the probe has.")
    ] = None
    calibrated_at: Annotated[LatelyOrNow | None, Field(description="When; if left out, now.")] = None
    key: RecordKey | None = None

    @model_validator(mode="before")
    @classmethod
    def _r_numbers(cls, value: Any) -> Any:
        fields = _by_number(value, R_NAMES)
        if isinstance(fields, dict) and ("R21" in fields or "R23" in fields):
            r21, r23 = fields.pop("R21", None), fields.pop("R23", None)
            for number, code in (("R21", r21), ("R23", r23)):
                if code is not None and (not isinstance(code, int) or isinstance(code, bool)):
                    raise PydanticCustomError(
                        "no_code", _("{number} must be a whole number").format(number=number), {"at": number}
                    )
            groove = r23 not in {0, None} or r21 == 0
            if (r21 == 1 and groove) or "surface" in fields:
                raise PydanticCustomError(
                    "r21", _("R21 = 1 with R23 = 0 is a free surface, R21 = 0 a groove: say one"), {"at": "surface"}
                )
            fields["surface"] = "groove" if groove else "free"
        return fields


class RingSectionIn(Body):
    """Position of X (#5041) at the trigger, on both sides of one section of the ring."""

    plus: Annotated[Length | None, Field(description="Touched in +X; null where the probe did not trigger.")]
    minus: Annotated[Length | None, Field(description="Touched in −X; null where the probe did not trigger.")]


class RingIn(Body):
    """A calibration in a ring on the spindle, as the macro of the lathe line makes it.

    The macro's variables may be in place of names (`"#502": 6.0`); nominal, both deviations and the tip are needed.
    """

    model_config = ConfigDict(json_schema_extra=_schema_with(MACRO_NAMES, {}))

    tool_memory: Annotated[
        int, Field(strict=True, ge=1, le=MOST_LOCATIONS, description="The location that holds the probe's offset.")
    ]
    nominal: Annotated[Positive, Field(description="#505: nominal diameter of the ring.")]
    upper_deviation: Annotated[Length, Field(description="#506: ES of the ring.")]
    lower_deviation: Annotated[Length, Field(description="#507: EI of the ring.")]
    radius_term: Annotated[
        Length,
        Field(description="#502: what the tip adds to a position in X; its diameter where X counts in diameters."),
    ]
    sections: Annotated[
        list[RingSectionIn],
        Field(
            max_length=SECTIONS,
            description="Three along Z; fewer if the last one lies outside the limits, else one was not touched.",
        ),
    ] = Field(default=[])
    first_move_triggered: Annotated[
        bool, Field(strict=True, description="The first move along Z triggered: it is not a bore.")
    ] = False
    calibrated_at: Annotated[LatelyOrNow | None, Field(description="When; if left out, now.")] = None
    key: RecordKey | None = None

    @model_validator(mode="before")
    @classmethod
    def _macro_variables(cls, value: Any) -> Any:
        return _by_number(value, MACRO_NAMES)


class PairIn(Body):
    """The same part on the machine and on an external gauge.

    The machine's reading is named by characteristic and sequence, or typed as `machine_value`.
    """

    characteristic: Annotated[Slug | None, Field(description="Whose reading it is.")] = None
    sequence: Annotated[int | None, Field(strict=True, ge=1, le=LARGEST_ID, description="Which reading.")] = None
    machine_value: Annotated[
        Length | None, Field(description="What the machine measured, empirical value not taken off.")
    ] = None
    external_value: Annotated[Length, Field(description="What the external gauge says, taken for true.")]
    instrument: Annotated[Text200, Field(description="Which gauge: micrometer, measuring machine.")]
    key: RecordKey | None = None


class SuggestionAcceptIn(Body):
    """Acceptance of the suggested empirical value, with a reason."""

    empirical_value: Annotated[
        Length | None,
        Field(description="The suggestion as you have seen it; if it is another by now, nothing happens."),
    ] = None
    reason: Reason


class CalibrationPlanIn(Body):
    """Interval of calibration, and automatic or approved application of its results."""

    due_parts: Annotated[
        int | None,
        Field(strict=True, ge=1, le=100_000_000, description="Due after this number of parts; none: not by parts."),
    ] = None
    due_days: Annotated[
        float | None,
        Field(strict=True, gt=0, le=36_500, allow_inf_nan=False, description="Due after this number of days."),
    ] = None
    acceptance: Annotated[
        Literal["accept", "automatic"],
        Field(
            description="accept: somebody accepts what was found; automatic: it comes into effect at once, as on L92, "
            "unless it looks like inches or is a value that no probe has."
        ),
    ] = "accept"
