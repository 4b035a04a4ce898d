"""Arbitrary parameter sets that `core.parameters.read` takes, made from its table of fields, so that new ones are tried too."""

from typing import Any

from hypothesis import strategies as st

from app.core.natural_limit import NaturalLimit, assumed, half_width
from app.core.parameters import FIELDS, Feature, Field, FieldKind, Mode, Parameters, read

ORDERED = ("zero_range", "averaging_limit", "wear_limit", "confidence_limit")
SIZE = ("nominal", "upper_deviation", "lower_deviation", "target", "tolerance_width")


def _length(lowest: float = 0.0, highest: float = 1000.0) -> st.SearchStrategy[float]:
    rounded = st.floats(lowest, highest).map(lambda value: round(value, 6))
    return st.one_of(rounded, st.floats(lowest, highest)).filter(lambda value: lowest <= value <= highest)


def _value(field: Field) -> st.SearchStrategy[Any]:
    if field.kind is FieldKind.CHOICE:
        return st.sampled_from(field.choices)
    if field.kind is FieldKind.YES_NO:
        return st.booleans()
    lowest = -1000.0 if field.lowest is None else max(field.lowest, -1000.0)
    highest = 1000.0 if field.highest is None else min(field.highest, 1000.0)
    if field.kind is FieldKind.WHOLE:
        return st.integers(int(lowest), int(highest))
    return _length(lowest, highest)


def _ordered(draw: st.DrawFn, half: float) -> dict[str, float]:
    """Limits in their order. half: distance of the limits of size from the target, mm."""
    inner = draw(st.tuples(st.floats(0, 0.49), st.floats(0.5, 1.0)))
    beyond = _length(max(1.0, half + 2e-6), 5.0)
    wear, confidence = sorted(draw(st.tuples(beyond, beyond)))
    return {
        "zero_range": round(inner[0] * half, 9),
        "averaging_limit": round(inner[1] * half - 2e-6, 9),
        "wear_limit": wear,
        "confidence_limit": confidence,
    }


@st.composite
def parameter_sets(draw: st.DrawFn) -> Parameters:
    width = draw(_length(0.001, 2.0))
    given: dict[str, Any] = {}
    if draw(st.booleans()):
        # From 0 up, a set that does not say its natural limit has one.
        sizes = st.one_of(st.just((0.0, 0.0)), st.tuples(_length(-500.0), _length(-5.0, 5.0)))
        nominal, lower = draw(sizes)
        given |= {"nominal": nominal, "lower_deviation": lower, "upper_deviation": lower + width}
    else:
        given |= {"target": draw(_length(-500.0)), "tolerance_width": width}
    for field in FIELDS:
        if field.name not in (*ORDERED, *SIZE) and (field.name == "factor" or draw(st.booleans())):
            given[field.name] = draw(_value(field))
    if draw(st.booleans()):
        m = draw(st.integers(1, 100))
        given["accept"] = {"n": draw(st.integers(1, m)), "m": m}
        given["points"] = draw(st.sampled_from([1, m]))
    if given.get("feature") == Feature.TOOL:  # no measuring program of a part measures a tool
        given["feature"] = "outside"
    if given["factor"] == 0:
        given["factor"] = -0.5
    if given.get("natural_limit", NaturalLimit.NONE) != NaturalLimit.NONE and given.get("tool_memory"):
        given["mode"] = Mode.MEASURE_ONLY.value
    half = half_width(width, given.get("natural_limit") or assumed(given))
    return read(given | _ordered(draw, half))[0]  # a refusal here: a rule is younger than this strategy
