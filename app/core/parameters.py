"""The parameters of a characteristic: one complete set, its order, and L75 (domain §2).

`read` turns what a person or a program sent into `Parameters`, or into the complete list of `Problem`; the table of the
fields is in `parameter_table`. Lengths are mm.
"""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, fields
from enum import StrEnum
from functools import cached_property
from itertools import pairwise
from math import inf, isfinite
from typing import Any

from app.core.decision.limits import Limits, nanometres
from app.core.decision.step import Rules
from app.core.fits import with_fit
from app.core.natural_limit import (
    NaturalLimit,
    Tolerance,
    assumed,
    half_of,
    half_width,
    looks_natural,
    target_of,
    tolerance_about_target,
)
from app.core.parameter_table import (
    AVERAGE_LOCATIONS,
    BY_NAME,
    BY_R,
    ENUMS,
    FIELDS,
    LARGEST_LENGTH,
    MOST_LOCATIONS,
    TOOL_LOCATIONS,
    TWO_POINT_SWITCH,
    Axis,
    Direction,
    Feature,
    Field,
    FieldKind,
    MachineType,
    Mode,
    Problem,
    Variant,
    WearPolicy,
)
from app.core.unusual import as_deviations, unusual, unusual_calibration, unusual_on

__all__ = [
    "AVERAGE_LOCATIONS",
    "BY_NAME",
    "BY_R",
    "ENUMS",
    "FIELDS",
    "LARGEST_LENGTH",
    "MOST_LOCATIONS",
    "TOOL_LOCATIONS",
    "TWO_POINT_SWITCH",
    "Axis",
    "Direction",
    "Feature",
    "Field",
    "FieldKind",
    "MachineType",
    "Mode",
    "NaturalLimit",
    "ParameterError",
    "Parameters",
    "Problem",
    "Variant",
    "WearPolicy",
    "default_averaging_limit",
    "mean_nominal",
    "read",
    "unusual_calibration",
    "unusual_natural",
    "unusual_on",
    "unusual_partly",
    "unusual_switch",
    "without_location",
]


@dataclass(frozen=True, kw_only=True)
class Parameters:
    """One complete, consistent set. Made by `read`; made directly, the caller vouches for it."""

    target: float
    tolerance_width: float
    zero_range: float
    averaging_limit: float
    wear_limit: float
    confidence_limit: float
    weighting_factor: float = 1.0
    factor: float = -1.0
    tool_memory: int = 0
    average_memory: int = 0
    variant: Variant = Variant.SINGLE
    points: int = 1
    repeats: int = 1
    index: float | None = None
    wait: float | None = None
    axis: Axis = Axis.X
    direction: Direction | None = None
    feature: Feature = Feature.OUTSIDE
    path_factor: float = 1.0
    nominal: float | None = None
    upper_deviation: float | None = None
    lower_deviation: float | None = None
    accept_n: int = 1
    accept_m: int = 1
    rejected_may_correct: bool = False
    mode: Mode = Mode.AUTOMATIC
    wear_policy: WearPolicy = WearPolicy.HOLD
    max_step: float | None = None
    max_total: float | None = None
    plausible_jump: float | None = None
    natural_limit: NaturalLimit = NaturalLimit.NONE

    @cached_property
    def limits(self) -> Limits:
        """The zone limits in whole nanometres."""
        return Limits.of(self)

    @cached_property
    def rules(self) -> Rules:
        """The numbers that the arithmetic of a decision uses."""
        return Rules(
            *self.limits,
            weighting_factor=self.weighting_factor,
            factor=self.factor,
            max_step=inf if self.max_step is None else self.max_step,
            max_total=inf if self.max_total is None else self.max_total,
            averages=self.average_memory != 0,
            measures_only=self.measures_only,
            holds_wear=self.wear_policy is WearPolicy.HOLD,
            rejected_may_correct=self.rejected_may_correct,
            of_tool=self.feature is Feature.TOOL and not self.measures_only,
            natural=self.natural_limit.side,
        )

    @property
    def half(self) -> float:
        """Distance from the target to each limit that is judged, mm: R35/2, or R35 from a natural limit."""
        return half_of(self)

    @property
    def tolerance(self) -> Tolerance:
        """The limits that are judged, as deviations from the target; the natural one is None."""
        return tolerance_about_target(self.half, self.natural_limit)

    @property
    def sizes(self) -> tuple[float, float]:
        """Lower and upper limit of size, mm, a natural one included."""
        below = 0.0 if self.natural_limit is NaturalLimit.LOWER else self.half
        above = 0.0 if self.natural_limit is NaturalLimit.UPPER else self.half
        return round(self.target - below, 9), round(self.target + above, 9)

    @property
    def measures_only(self) -> bool:
        """No correction is ever computed: by mode, or because no tool memory is named (R10 = 0)."""
        return self.mode is Mode.MEASURE_ONLY or self.tool_memory == 0

    @property
    def window(self) -> float:
        """a, mm: the trigger is expected within ±a of the programmed dimension (1 mm x R28)."""
        return 1.0 * self.path_factor

    def as_dict(self) -> dict[str, Any]:
        """The JSON form of the contract, both ways of saying the target included."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        values["accept"] = {"n": values.pop("accept_n"), "m": values.pop("accept_m")}
        return {name: value.value if isinstance(value, StrEnum) else value for name, value in values.items()}

    @classmethod
    def from_dict(cls, stored: Mapping[str, Any]) -> "Parameters":
        """Parameters from a dict of `as_dict`. It was checked before, so old sets stay readable when rules change."""
        values = dict(stored)
        accept = values.pop("accept")
        for name, enum in ENUMS.items():
            if values.get(name) is not None:
                values[name] = enum(values[name])
        return cls(**values, accept_n=accept["n"], accept_m=accept["m"])


class ParameterError(ValueError):
    """A parameter set that cannot be used; `problems` lists everything that is wrong with it."""

    def __init__(self, problems: list[Problem]) -> None:
        super().__init__("; ".join(f"{problem.field}: {problem.code}" for problem in problems))
        self.problems = problems


def mean_nominal(
    nominal: float, upper_deviation: float, lower_deviation: float, natural_limit: str | None = None
) -> tuple[float, float]:
    """L75: target R32 = R42 + (R40 + R41)/2 and tolerance width R35 = R40 - R41, mm; the target is a natural limit if there is one.

    >>> mean_nominal(10, 0, -0.004)
    (9.998, 0.004)
    """
    return (
        target_of(nominal, upper_deviation, lower_deviation, natural_limit),
        round(upper_deviation - lower_deviation, 9),
    )


def default_averaging_limit(tolerance_width: float, natural_limit: str | None = None) -> float:
    """R34 "2/3 of the tolerance", mm: two thirds of R35/2, or of R35 from a natural limit."""
    return round(half_width(tolerance_width, natural_limit) * 2 / 3, 9)


def cautious(tolerance_width: float, natural_limit: str | None = None) -> dict[str, Any]:
    """Zones of a characteristic that corrects nothing and of which the drawing alone is known, mm.

    >>> cautious(0.012, "lower")
    {'zero_range': 0.002, 'wear_limit': 0.3, 'confidence_limit': 1.0, 'mode': 'measure_only'}
    """
    wear = max(0.3, tolerance_width)
    return {
        "zero_range": round(default_averaging_limit(tolerance_width, natural_limit) / 4, 9),
        "wear_limit": wear,
        "confidence_limit": max(1.0, 2 * wear),
        "mode": "measure_only",
    }


def read(given: Mapping[str, Any]) -> tuple[Parameters, list[Problem]]:
    """Make parameters of what was sent, under names or R numbers; R42 may be a fit, `40 h6`. Return them with the warnings.

    ``accept`` is ``{"n": 2, "m": 3}``. Raises `ParameterError` with everything that is wrong.
    """
    problems: list[Problem] = []
    values = dict(_named(with_fit(given), problems))
    accept, switch = values.pop("accept", None), values.pop(TWO_POINT_SWITCH, None)
    values = {name: value for name, value in values.items() if value is not None}
    for field in FIELDS:
        if field.name in values:
            values[field.name] = _checked(field, values[field.name], problems)
        elif field.required:
            problems.append(Problem(field.name, "required", {}))
        elif field.default is not None:
            values[field.name] = field.default
    if _two_points(switch, problems):
        values["variant"] = Variant.TWO_POINT.value
    values["accept_n"], values["accept_m"] = _accept(accept, problems)
    values.setdefault("natural_limit", assumed(values).value)
    _target(values, problems)
    problems.extend(_together(values, {problem.field for problem in problems}))
    if problems:
        raise ParameterError(problems)
    for name, enum in ENUMS.items():
        if name in values:
            values[name] = enum(values[name])
    return Parameters(**values), list(unusual(values))


def _named(given: Mapping[str, Any], problems: list[Problem]) -> Iterator[tuple[str, Any]]:
    """Translate R numbers to names; refuse unknown and doubled ones. R24 has no name and stays as it is."""
    seen: dict[str, str] = {}
    for raw, value in given.items():
        key = raw.upper()
        name = TWO_POINT_SWITCH if key == TWO_POINT_SWITCH else BY_R.get(key, raw)
        if name not in BY_NAME and name not in {"accept", TWO_POINT_SWITCH}:
            problems.append(Problem(raw, "unknown", {}))
        elif name in seen:
            problems.append(Problem(raw, "twice", {"other": seen[name]}))
        else:
            seen[name] = raw
            yield name, value


def _two_points(switch: Any, problems: list[Problem]) -> bool:
    """Tell if R24 asks for two points: any number but 0 does, whatever R25 says."""
    number = isinstance(switch, int | float) and not isinstance(switch, bool) and abs(switch) <= LARGEST_LENGTH
    if switch is None or number:
        return bool(switch)
    problems.append(Problem(TWO_POINT_SWITCH, "not_a_number", {}))
    return False


def unusual_switch(given: Mapping[str, Any]) -> list[Problem]:
    """Warn of an R24 that the cycles do not know, and of one that contradicts the variant given beside it (R25).

    >>> [problem.code for problem in unusual_switch({"R24": 2, "R25": 1})], unusual_switch({"R25": 0, "R24": 1})
    (['switch_value', 'switch_wins'], [])
    """
    ignored: list[Problem] = []
    values = dict(_named(given, ignored))
    switch, given_variant = values.get(TWO_POINT_SWITCH), values.get("variant")
    variant = None if given_variant is None else _checked(BY_NAME["variant"], given_variant, ignored)
    if switch is None or ignored:
        return []
    problems = []
    if switch not in (0, 1):
        problems.append(Problem(TWO_POINT_SWITCH, "switch_value", {"value": switch}, warning=True))
    if switch and variant not in (None, Variant.SINGLE, Variant.TWO_POINT):
        problems.append(Problem("variant", "switch_wins", {"variant": variant}, warning=True))
    if not switch and variant == Variant.TWO_POINT:
        problems.append(Problem("variant", "switch_loses", {}, warning=True))
    return problems


def _checked(field: Field, value: Any, problems: list[Problem]) -> Any:
    """One value as its kind, or a problem noted (and something harmless returned)."""
    if field.kind is FieldKind.YES_NO:
        if isinstance(value, bool):
            return value
        problems.append(Problem(field.name, "not_yes_no", {}))
        return False
    if field.kind is FieldKind.CHOICE:
        if isinstance(value, str) and value in field.choices:
            return value
        if isinstance(value, int | float) and not isinstance(value, bool) and value in field.codes:
            return field.choices[field.codes.index(int(value))]
        problems.append(Problem(field.name, "not_a_choice", {"choices": field.choices}))
        return field.choices[0]
    # int(…) of something as large as 1e400 written out would not become a float.
    if isinstance(value, bool) or not isinstance(value, int | float) or abs(value) > 1e300 or not isfinite(value):
        problems.append(Problem(field.name, "not_a_number", {}))
        return 1
    if field.kind is FieldKind.WHOLE:
        if value != int(value):
            problems.append(Problem(field.name, "not_whole", {"value": value}))
            return 1
        value = int(value)
    else:
        value = float(value)
    lowest = -LARGEST_LENGTH if field.lowest is None else field.lowest
    highest = LARGEST_LENGTH if field.highest is None else field.highest
    if not lowest <= value <= highest:
        problems.append(Problem(field.name, "range", {"value": value, "lowest": lowest, "highest": highest}))
    return value


def _accept(accept: Any, problems: list[Problem]) -> tuple[int, int]:
    if accept is None:
        return 1, 1
    n, m = (accept.get("n"), accept.get("m")) if isinstance(accept, Mapping) else (None, None)
    whole = all(isinstance(value, int) and not isinstance(value, bool) for value in (n, m))
    if not whole or set(accept) != {"n", "m"} or not 1 <= n <= m <= 100:  # type: ignore[operator]
        problems.append(Problem("accept", "accept", {}))
        return 1, 1
    return n, m  # type: ignore[return-value]


def _sections(values: Mapping[str, Any]) -> Iterator[Problem]:
    """Acceptance n of m needs m sections: R23 says that many points (twice as many for two points each), or nothing."""
    sections, points = values["accept_m"], values["points"]
    two_point = values["variant"] == Variant.TWO_POINT
    if sections > 1 and points not in ({1, 2, sections, 2 * sections} if two_point else {1, sections}):
        yield Problem("points", "sections", {"points": points, "sections": sections})


def _together(values: dict[str, Any], wrong: Collection[str]) -> list[Problem]:
    """Say what does not go together, and fill in the averaging limit and the factor that follow from the rest.

    wrong: the fields that were refused already: what depends on them is not judged, the rest is, so that all is said at once.
    """
    known = {name: value for name, value in values.items() if name not in wrong}
    if "averaging_limit" not in wrong and {"tolerance_width", "natural_limit"} <= known.keys():
        usual = default_averaging_limit(known["tolerance_width"], known["natural_limit"])
        known["averaging_limit"] = values.setdefault("averaging_limit", usual)
    problems = [
        *_sign(known, values.keys()),
        *_order(known),
        *(_sections(known) if {"accept", "points", "variant"}.isdisjoint(wrong) else ()),
        *(_tool_measured(known) if {"feature", "tool_memory", "mode"}.isdisjoint(wrong) else ()),
        *(_natural(known) if {"natural_limit", "tool_memory", "mode"}.isdisjoint(wrong) else ()),
    ]
    values.setdefault("factor", -1.0)
    return problems


def _sign(known: Mapping[str, Any], given: Collection[str]) -> Iterator[Problem]:
    """The factor is never guessed where something is corrected, and never 0. A tool that was mistyped is a tool."""
    if "factor" in given:
        if known.get("factor") == 0:
            yield Problem("factor", "factor_zero", {})
    elif known.get("tool_memory", 1) != 0 and known.get("mode", Mode.MEASURE_ONLY) != Mode.MEASURE_ONLY:
        yield Problem("factor", "sign_missing", {})


def _target(values: dict[str, Any], problems: list[Problem]) -> None:
    """Bring nominal with deviations (L75) and target with width into one; refuse both that disagree."""
    wrong = {problem.field for problem in problems}
    drawing = [values.get(name) for name in ("nominal", "upper_deviation", "lower_deviation")]
    if any(value is not None for value in drawing):
        missing = [name for name in ("nominal", "upper_deviation", "lower_deviation") if values.get(name) is None]
        problems.extend(Problem(name, "required", {}) for name in missing)
        if missing or wrong & {"nominal", "upper_deviation", "lower_deviation", "natural_limit"}:
            return
        target, width = mean_nominal(
            values["nominal"], values["upper_deviation"], values["lower_deviation"], values["natural_limit"]
        )
        if width <= 0:
            typed = {
                "nominal": values["nominal"],
                "upper": values["upper_deviation"],
                "lower": values["lower_deviation"],
            }
            problems.append(Problem("upper_deviation", "tolerance_sign", typed | {"meant": as_deviations(**typed)}))
            return
        for name, computed in (("target", target), ("tolerance_width", width)):
            if name in values and nanometres(values[name]) != nanometres(computed):
                problems.append(Problem(name, "target_twice", {"value": values[name], "computed": computed}))
            values[name] = computed
    elif "target" not in values and "tolerance_width" not in values:
        problems.append(Problem("nominal", "target_missing", {}))
    else:
        problems.extend(Problem(name, "required", {}) for name in ("target", "tolerance_width") if name not in values)


def _order(values: Mapping[str, Any]) -> Iterator[Problem]:
    """R33 < R34 <= R35/2 <= R37 <= R36; every broken pair of which both are known is named at its outer member.

    From a natural limit R35 counts whole.
    """
    width, natural = values.get("tolerance_width"), values.get("natural_limit")
    half = None if width is None or natural is None else half_width(width, natural)
    chain = (
        ("zero_range", "R33", values.get("zero_range")),
        ("averaging_limit", "R34", values.get("averaging_limit")),
        ("tolerance_width", "R35/2" if natural == NaturalLimit.NONE else "R35", half),
        ("wear_limit", "R37", values.get("wear_limit")),
        ("confidence_limit", "R36", values.get("confidence_limit")),
    )
    for (_, inner, smaller), (name, outer, larger) in pairwise(chain):
        if smaller is None or larger is None:
            continue
        strictly = inner == "R33"
        broken = nanometres(smaller) >= nanometres(larger) if strictly else nanometres(smaller) > nanometres(larger)
        if broken:
            yield Problem(
                name,
                "order",
                {"inner": inner, "outer": outer, "smaller": smaller, "larger": larger, "strict": strictly},
            )


def _tool_measured(values: Mapping[str, Any]) -> Iterator[Problem]:
    """A tool that is measured itself belongs to a location, and no size after it would show that its correction has the wrong sign."""
    if values["feature"] != Feature.TOOL:
        return
    if values["tool_memory"] == 0:
        yield Problem("tool_memory", "tool_measured", {})
    if values["mode"] == Mode.AUTOMATIC and (values.get("factor") or 0) < 0:
        yield Problem("factor", "factor_of_tool", {"value": values["factor"]})


def _natural(values: Mapping[str, Any]) -> Iterator[Problem]:
    """A size with a natural limit has no sign: no offset corrects it."""
    if values["natural_limit"] != NaturalLimit.NONE and values["tool_memory"] and values["mode"] != Mode.MEASURE_ONLY:
        yield Problem("mode", "natural_corrected", {})


def unusual_natural(given: Mapping[str, Any], parameters: Parameters, name: str) -> list[Problem]:
    """Warn of a natural limit that was not said but assumed, and propose one that the name says.

    given: what was sent, by name or R number. name: of the characteristic.
    """
    if parameters.natural_limit is NaturalLimit.NONE:
        at_zero = nanometres(abs(parameters.target)) <= nanometres(parameters.tolerance_width)
        likely = looks_natural(name) and at_zero
        return [Problem("natural_limit", "natural_likely", {"name": name}, warning=True)] if likely else []
    said = any(raw == "natural_limit" and value is not None for raw, value in given.items())
    sizes = {"R42", "R40", "R41", "NOMINAL", "UPPER_DEVIATION", "LOWER_DEVIATION"} & {raw.upper() for raw in given}
    if said or not sizes:
        return []
    return [Problem("natural_limit", "natural_assumed", {"limit": parameters.target}, warning=True)]


def unusual_partly(given: Mapping[str, Any]) -> list[Problem]:
    """Warn of what is unusual in a set that is not complete: what is known of it counts, defaults stand for the rest."""
    values = {field.name: field.default for field in FIELDS} | {"accept_m": 1}
    ignored: list[Problem] = []
    named = dict(_named(given, ignored))
    if _two_points(named.pop(TWO_POINT_SWITCH, None), ignored):
        named["variant"] = Variant.TWO_POINT.value
    for name, value in named.items():
        field = BY_NAME.get(name)
        if field is not None and value is not None:
            wrong: list[Problem] = []
            checked = _checked(field, value, wrong)
            if not wrong:
                values[name] = checked
        elif name == "accept" and value is not None:
            values["accept_m"] = _accept(value, ignored)[1]
    return list(unusual(values))


def without_location(values: Mapping[str, Any], tool_locations: int, average_locations: int) -> list[Problem]:
    """Refuse locations (R10, R11) that a machine does not have; values: by name or R number, as `read` takes them."""
    problems = []
    for name, last in (("tool_memory", tool_locations), ("average_memory", average_locations)):
        r = BY_NAME[name].r
        value = next((value for raw, value in values.items() if raw in (name, r) or raw.upper() == r), None)
        if isinstance(value, int | float) and last < value <= MOST_LOCATIONS:
            problems.append(Problem(name, "no_location", {"value": int(value), "last": last}))
    return problems
