"""Warnings of parameters that are accepted, because they may be meant, but that the sources would not take."""

from collections.abc import Iterator, Mapping
from typing import Any

from app.core.decision.limits import nanometres
from app.core.parameter_table import FIELDS, Axis, Feature, MachineType, Mode, Problem, Variant

INDEX_ANGLES = (0.0, 359.5)  # degrees, R26 of the variants that index the part
CALIBRATION_RANGES = {"path_factor": (1, 10)}  # where L92 has another range than L93


SAME_PLACE = 0.05  # degrees between two places that are one
COARSEST, COARSEST_SHARE = 1.0, 0.05  # mm, and share of the nominal: larger deviations are questioned
NEAR, VERY_NEAR = (0.5, 1.5), (0.9, 1.1)  # deviation / nominal, where both may be limits of size, or one alone
FACTORS = (0.1, 5.0)  # size of a factor: ½, 1, 2 and what slopes make of them; 25.4 and 1000 are units


def unusual(values: Mapping[str, Any]) -> Iterator[Problem]:
    """Values that the measuring cycles of the sources would not take: ranges, and variants that do not fit together."""
    for field in FIELDS:
        if field.source_range and values.get(field.name) is not None:
            yield from _outside(field.name, values[field.name], field.source_range)
    variant, points = values["variant"], values["points"]
    if variant in (Variant.INDEXED, Variant.ROUND) and values.get("index") is not None:
        yield from _outside("index", values["index"], INDEX_ANGLES)
    if variant in (Variant.INDEXED, Variant.ROUND, Variant.ALONG) and values["axis"] != Axis.X:
        data = {"variant": str(variant), "axis": str(values["axis"])}
        yield Problem("axis", "variant_axis", data, warning=True)
    yield from _places(values)
    yield from _limits_as_sizes(values)
    yield from _averages_never(values)
    yield from _factor_of_tool(values)
    yield from _factor_of_a_unit(values)
    yield from _out_of_reach(values)
    if variant in (Variant.ROUND, Variant.ALONG) and max(points, values["accept_m"]) < 2:
        yield Problem("points", "points_missing", {"variant": str(variant)}, warning=True)


def _places(values: Mapping[str, Any]) -> Iterator[Problem]:
    """Warn of points whose places (R26) are not known, or are the same."""
    variant, index = values["variant"], values.get("index")
    points = max(values["points"], values["accept_m"], 2 if variant == Variant.INDEXED else 1)
    if variant == Variant.ALONG and points > 1 and not index:
        yield Problem("index", "spacing_missing", {}, warning=True)
    if variant in (Variant.INDEXED, Variant.ROUND) and index is not None:
        turned = next((n for n in range(1, points) if abs((n * index + 180) % 360 - 180) < SAME_PLACE), None)
        if turned is not None:
            yield Problem("index", "places_coincide", {"value": index, "point": turned + 1}, warning=True)


def _out_of_reach(values: Mapping[str, Any]) -> Iterator[Problem]:
    """Warn of an R36 that touches do not reach: beyond ±a, or at ±a itself where a mean of several would have to lie there."""
    window, confidence = values["path_factor"], values.get("confidence_limit")
    if confidence is None:
        return
    several = values["repeats"] > 1 or max(values["points"], values["accept_m"]) > 1
    several = several or values["variant"] in (Variant.INDEXED, Variant.ROUND, Variant.ALONG)
    if nanometres(confidence) >= nanometres(window) + (0 if several else 1):
        data = {"value": confidence, "window": window}
        yield Problem("confidence_limit", "out_of_reach", data, warning=True)


def as_deviations(nominal: float, upper: float, lower: float) -> tuple[float, float] | None:
    """Return the deviations that were meant where both of them, or one, are limits of size; None where they are not.

    >>> as_deviations(40, 40.01, 39.99), as_deviations(40, 0.01, 39.99), as_deviations(40, 40.01, -0.01), as_deviations(40, 5, -5)
    ((0.01, -0.01), (0.01, -0.01), (0.01, -0.01), None)
    """
    if nominal == 0:
        return None
    given = (upper, lower)
    both = all(NEAR[0] <= deviation / nominal <= NEAR[1] for deviation in given)
    sizes = [both or VERY_NEAR[0] <= deviation / nominal <= VERY_NEAR[1] for deviation in given]
    up, low = (round(each - nominal, 9) if size else each for each, size in zip(given, sizes, strict=True))
    return (up, low) if any(sizes) and up > low else None


def _limits_as_sizes(values: Mapping[str, Any]) -> Iterator[Problem]:
    """Warn of deviations (R40, R41) as large as sizes: the source calls them limits, and drawings have limits, too."""
    nominal, upper, lower = (values.get(name) for name in ("nominal", "upper_deviation", "lower_deviation"))
    if nominal is None or upper is None or lower is None:
        return
    largest = max(COARSEST_SHARE * abs(nominal), COARSEST)
    near = nominal != 0 and all(NEAR[0] <= deviation / nominal <= NEAR[1] for deviation in (upper, lower))
    if near or max(abs(upper), abs(lower)) > largest:
        data = {"nominal": nominal, "upper": upper, "lower": lower, "meant": as_deviations(nominal, upper, lower)}
        yield Problem("upper_deviation", "limits_as_sizes", data, warning=True)


def _averages_never(values: Mapping[str, Any]) -> Iterator[Problem]:
    """Warn of k with no memory (R11 = 0): M is D/k then, and has to pass R33 before D has passed R34."""
    zero, averaging, k = (values.get(name) for name in ("zero_range", "averaging_limit", "weighting_factor"))
    if not zero or averaging is None or values["average_memory"] != 0 or k == 1:
        return
    corrects = values["tool_memory"] != 0 and values["mode"] != Mode.MEASURE_ONLY
    if corrects and nanometres(k * zero) >= nanometres(averaging):
        data = {"k": k, "reach": k * zero, "averaging": averaging}
        yield Problem("average_memory", "averages_never", data, warning=True)


def _factor_of_tool(values: Mapping[str, Any]) -> Iterator[Problem]:
    """Warn of a factor below 0 with which the offset of a tool that is longer, or larger, becomes smaller: a person approves it."""
    factor = values.get("factor")
    if values["feature"] == Feature.TOOL and values["mode"] == Mode.APPROVAL and factor is not None and factor < 0:
        yield Problem("factor", "factor_of_tool", {"value": factor}, warning=True)


def _factor_of_a_unit(values: Mapping[str, Any]) -> Iterator[Problem]:
    """Warn of a factor that turns mm into inches, or into steps: Inband's amounts are mm, and the bridge converts them."""
    factor, (low, high) = values.get("factor"), FACTORS
    corrects = values["tool_memory"] != 0 and values["mode"] != Mode.MEASURE_ONLY
    if corrects and factor and not low <= abs(factor) <= high:
        yield Problem("factor", "factor_of_a_unit", {"value": factor}, warning=True)


def _outside(name: str, value: float, usual: tuple[float, float]) -> Iterator[Problem]:
    low, high = usual
    if not low <= value <= high:
        yield Problem(name, "source_range", {"value": value, "lowest": low, "highest": high}, warning=True)


def unusual_calibration(values: Mapping[str, Any]) -> list[Problem]:
    """Warn of values of a calibration (L92) outside the ranges of the sources. values: parameters by name, as far as said."""
    problems: list[Problem] = []
    for field in FIELDS:
        usual = CALIBRATION_RANGES.get(field.name, field.source_range)
        value = values.get(field.name)
        if usual and isinstance(value, int | float) and not isinstance(value, bool):
            problems.extend(_outside(field.name, value, usual))
    return problems


def unusual_on(values: Mapping[str, Any], machine: MachineType) -> list[Problem]:
    """Warn of what does not fit the type of a machine. values: parameters by name, as far as they are known.

    Two-point measurement is for machining centres (R24, domain §2). On a lathe the offset acts against the size, and so does a
    milling radius outside; inside, a larger radius makes a larger hole or pocket: there alone is the factor positive (domain §3).

    >>> given = {"factor": 0.5, "tool_memory": 3}
    >>> [problem.code for problem in unusual_on(given, MachineType.LATHE)]
    ['factor_on_lathe']
    >>> [problem.code for problem in unusual_on(given, MachineType.MILL)], unusual_on({**given, "feature": "inside"}, MachineType.MILL)
    (['factor_outside'], [])
    >>> [problem.code for problem in unusual_on({**given, "factor": -0.5, "feature": "inside"}, MachineType.MILL)]
    ['factor_inside']
    """
    problems = []
    if machine is MachineType.LATHE and values.get("variant") == Variant.TWO_POINT:
        problems.append(Problem("variant", "not_on_lathe", {}, warning=True))
    factor, feature = values.get("factor"), values.get("feature", Feature.OUTSIDE)
    corrects = values.get("tool_memory") and values.get("mode") != Mode.MEASURE_ONLY and feature != Feature.TOOL
    if not corrects or isinstance(factor, bool) or not isinstance(factor, int | float):
        return problems
    code = ""
    if factor > 0 and machine is MachineType.LATHE:
        code = "factor_on_lathe"
    elif factor > 0 and feature == Feature.OUTSIDE:
        code = "factor_outside"
    elif factor < 0 and feature == Feature.INSIDE and machine is MachineType.MILL and values.get("axis") != Axis.Z:
        code = "factor_inside"
    return [*problems, Problem("factor", code, {"value": factor}, warning=True)] if code else problems
