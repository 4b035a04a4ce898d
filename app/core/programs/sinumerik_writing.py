"""Sinumerik: the subprograms `L05` and `L15` written out. `sinumerik.read` makes the same parameters of them."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import NamedTuple

from app.core.decision.step import DECIMALS
from app.core.natural_limit import NaturalLimit
from app.core.parameters import BY_R, FIELDS, TWO_POINT_SWITCH, Direction, FieldKind, Parameters, Variant
from app.core.probing import direction_of
from app.core.programs import unit_check
from app.core.programs.lines import describing, settings, written

FIRST_BLOCK = ("R04", "R10", "R11", "R23", "R24", "R25", "R26", "R27", "R28", "R29", "R30", "R31")
SECOND_BLOCK = ("R32", "R33", "R34", "R35", "R36", "R37", "R40", "R41", "R42")


def write_measuring(parameters: Parameters, about: Mapping[str, str]) -> str:
    """The measuring subprogram L15 of a characteristic; `read` makes the same parameters of it, as they are `drawn`."""
    parameters = drawn(parameters)
    values = _r_values(parameters)
    written = {BY_R.get(r, r) for r in values} | ({"variant"} if TWO_POINT_SWITCH in values else set())
    extra = sorted(values.keys() - {*FIRST_BLOCK, *SECOND_BLOCK})
    blocks = [
        _assignments(values, (*FIRST_BLOCK, *extra)),
        _assignments(values, SECOND_BLOCK),
        *(["L75"] if parameters.nominal is not None else []),
        "L93",
        "M17",
    ]
    return _text("L15", "MEASURING SUBPROGRAM", [*describing(about), *settings(parameters, written)], blocks)


def drawn(parameters: Parameters) -> Parameters:
    """A natural limit said by nominal size and deviations: of R32 and R35 alone L93 would judge both sides, by R35/2."""
    natural, width = parameters.natural_limit, round(parameters.tolerance_width, DECIMALS)
    if natural is NaturalLimit.NONE or parameters.nominal is not None:
        return parameters
    upper, lower = (width, 0.0) if natural is NaturalLimit.LOWER else (0.0, -width)
    target = round(parameters.target, DECIMALS)
    return replace(
        parameters, target=target, tolerance_width=width, nominal=target, upper_deviation=upper, lower_deviation=lower
    )


def _r_values(parameters: Parameters) -> dict[str, float]:
    """Values of the parameters that have an R number. R32 and R35 follow from the drawing (L75) where there is one."""
    values: dict[str, float] = {}
    for field in FIELDS:
        value = getattr(parameters, field.name)
        if field.r is None or value is None:
            continue
        if field.name in {"target", "tolerance_width"} and parameters.nominal is not None:
            continue
        if field.kind is FieldKind.CHOICE:
            place = field.choices.index(value)
            if place < len(field.codes):
                values[field.r] = field.codes[place]
        elif field.kind is not FieldKind.YES_NO:
            values[field.r] = value
    values[TWO_POINT_SWITCH] = 1 if parameters.variant is Variant.TWO_POINT else 0
    if values.get("R23") == 1:
        del values["R23"]  # only the variants with several points have it
    return values


class Calibration(NamedTuple):
    """Content of the calibration subprogram L05. gauge: R32, mm; free: on a free surface, else in the reference groove."""

    parameters: Parameters
    gauge: float
    free: bool = True
    radial: bool = False


def write_calibration(calibration: Calibration, about: Mapping[str, str]) -> str:
    """The calibration subprogram L05 for the axis, direction and memory location of a characteristic."""
    values = _r_values(calibration.parameters) | {
        "R21": 1 if calibration.free else 0,
        "R22": 2 if calibration.radial else 1,
        "R23": 0 if calibration.free else 1,
        "R31": list(Direction).index(direction_of(calibration.parameters)),  # the control keeps the last one there
        "R32": calibration.gauge,
    }
    comments = [*describing(about)]
    if "R30" not in values:
        comments.append(f"INBAND AXIS={calibration.parameters.axis.value}")
    blocks = [
        "M73 (PROBE RECEIVER ON)",
        "G4 X5",
        _assignments(values, ("R11", "R21", "R22", "R23", "R27", "R28", "R29", "R30", "R31")),
        _assignments(values, ("R32", "R33", "R34", "R36")),
        "L92",
        "M17",
    ]
    return _text("L05", "CALIBRATION SUBPROGRAM", comments, blocks)


def _assignments(values: Mapping[str, float], names: tuple[str, ...]) -> str:
    return " ".join(f"{r}={written(values[r])}" for r in names if r in values)


def _text(head: str, title: str, comments: list[str], blocks: list[str]) -> str:
    def lines() -> Iterator[str]:
        yield f"{head} ({title})"
        yield f"({unit_check.said('G71')})"
        for comment in comments:
            yield f"({comment})"
        for place, block in enumerate(blocks, start=1):
            yield f"N{place * 5} {block}"

    return "\n".join(lines()) + "\n"
