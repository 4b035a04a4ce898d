"""Warnings of parameters that are accepted, because they may be meant, but that the sources would not take."""

from collections.abc import Iterator, Mapping
from typing import Any

from app.core.decision.limits import nanometres
from app.core.parameter_table import FIELDS, Axis, MachineType, Mode, Problem, Variant

INDEX_ANGLES = (0.0, 359.5)  # degrees, R26 of the variants that index the part
CALIBRATION_RANGES = {"path_factor": (1, 10)}  # where L92 has another range than L93


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
    window, confidence = values["path_factor"], values.get("confidence_limit")
    if confidence is not None and nanometres(confidence) > nanometres(window):
        data = {"value": confidence, "window": window}
        yield Problem("confidence_limit", "out_of_reach", data, warning=True)
    if variant in (Variant.ROUND, Variant.ALONG) and max(points, values["accept_m"]) < 2:
        yield Problem("points", "points_missing", {"variant": str(variant)}, warning=True)


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

    Two-point measurement is for machining centres (R24, domain §2); on a lathe the offset acts against the size, so that no
    factor is positive (domain §3).

    >>> given = {"factor": 0.5, "tool_memory": 3}
    >>> [problem.code for problem in unusual_on(given, MachineType.LATHE)], unusual_on(given, MachineType.MILL)
    (['factor_on_lathe'], [])
    """
    if machine is not MachineType.LATHE:
        return []
    problems = []
    if values.get("variant") == Variant.TWO_POINT:
        problems.append(Problem("variant", "not_on_lathe", {}, warning=True))
    factor = values.get("factor")
    corrects = values.get("tool_memory") and values.get("mode") != Mode.MEASURE_ONLY
    if isinstance(factor, int | float) and factor > 0 and corrects:
        problems.append(Problem("factor", "factor_on_lathe", {"value": factor}, warning=True))
    return problems
