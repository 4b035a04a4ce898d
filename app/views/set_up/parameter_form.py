"""The parameter form: the core's table of fields as inputs, what was typed as parameters, and the zone diagram beside it.

What people type stays text until the core has looked at it, so that nothing typed is lost when something is refused.
"""

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

from app.core.fits import fit_of
from app.core.natural_limit import NaturalLimit, assumed, half_width
from app.core.number_text import number_or_none, plain
from app.core.parameters import BY_NAME, FIELDS, Field, FieldKind, default_averaging_limit, mean_nominal
from app.core.programs.lines import written
from app.core.suggested import suggested_limits
from app.language.formatting import short, um_limit
from app.language.i18n import _
from app.loop.characteristics.wording import choice, explanation, label, order_sentence

__all__ = ["choice", "diagram", "parameters_from", "sentences", "typed_defaults", "typed_from", "typed_partly"]

FACTORS = ("-1", "-0.5", "0.5")
OTHER = "other"
DRAWING = ("nominal", "upper_deviation", "lower_deviation")
DIRECT = ("target", "tolerance_width")


class Input(NamedTuple):
    """One field as the template draws it."""

    name: str
    r: str | None
    label: str
    help: str | None
    unit: str | None
    optional: bool
    choices: list[tuple[str, str]]


def inputs() -> dict[str, Input]:
    """Every field by name."""
    return {field.name: _input(field) for field in FIELDS}


def _input(field: Field) -> Input:
    units = {"index": None, "wait": "s", "path_factor": "mm"}
    return Input(
        field.name,
        field.r,
        label(field.name),
        explanation(field.name),
        "mm" if field.kind is FieldKind.LENGTH else units.get(field.name),
        not field.required and field.default is None and field.name not in {*DRAWING, *DIRECT, "factor"},
        [
            *([("", _("Not given"))] if field.default is None else []),
            *((value, choice(field.name, value)) for value in field.choices),
        ],
    )


def factor_choices() -> list[tuple[str, str, str]]:
    """The signs of domain §3, found by what is set up."""
    return [
        ("-1", _("−1"), _("Lathe, offset kept in diameter, outside or inside. Length or face.")),
        ("-0.5", _("−1/2"), _("Lathe, offset kept as radius (L1). Milling radius, outside.")),
        ("0.5", _("+1/2"), _("Milling radius, inside: hole or pocket.")),
        (OTHER, _("Other"), _("Other factor, in the next field.")),
    ]


ORDER = (
    # inner, outer, the field where one is named
    ("R33", "R34", "averaging_limit"),
    ("R34", "R35/2", "averaging_limit"),
    ("R35/2", "R37", "wear_limit"),
    ("R37", "R36", "confidence_limit"),
)


def sentences(*, natural: bool = False) -> list[dict[str, str]]:
    """Sentences that the page shows at once about a broken order; the server answers the same when the form is sent.

    natural: from a natural limit, where R35 takes the place of R35/2.
    """
    order = [[name.replace("/2", "") if natural else name for name in names] for names in ORDER]
    return [
        {"field": field, "text": order_sentence(inner, outer, "{smaller}", "{larger}")} for inner, outer, field in order
    ]


def typed_defaults() -> dict[str, str]:
    """A new, empty form."""
    return {field.name: _text(field.default) for field in FIELDS} | {
        "factor": "",
        "factor_other": "",
        "accept_n": "1",
        "accept_m": "1",
    }


def typed_from(parameters: Mapping[str, Any]) -> dict[str, str]:
    """The form as it would have been typed for these parameters."""
    typed = {name: _text(parameters.get(name)) for name in BY_NAME}
    usual = default_averaging_limit(parameters["tolerance_width"], parameters.get("natural_limit"))
    if parameters["averaging_limit"] == usual:  # left to follow the tolerance
        typed["averaging_limit"] = ""
    if parameters.get("nominal") is not None:  # the drawing is what was said; target and width follow from it
        typed["target"] = typed["tolerance_width"] = ""
    factor = _text(parameters.get("factor"))
    known = factor in FACTORS
    return typed | {
        "factor": factor if known else OTHER,
        "factor_other": "" if known else factor,
        "accept_n": _text(parameters["accept"]["n"]),
        "accept_m": _text(parameters["accept"]["m"]),
    }


def typed_partly(given: Mapping[str, Any]) -> dict[str, str]:
    """The form as it would have been typed for some parameters, every digit of them; the others are at their defaults."""
    typed = typed_defaults() | {name: _exactly(given[name]) for name in BY_NAME if given.get(name) is not None}
    if typed["nominal"]:  # target and width follow from the drawing
        typed["target"] = typed["tolerance_width"] = ""
    if typed["factor"]:
        known = next((factor for factor in FACTORS if float(factor) == given["factor"]), OTHER)
        typed |= {"factor": known, "factor_other": typed["factor"] if known == OTHER else ""}
    accept = given.get("accept") or {"n": 1, "m": 1}
    return typed | {"accept_n": str(accept["n"]), "accept_m": str(accept["m"])}


def _exactly(value: Any) -> str:
    return written(value) if isinstance(value, float) else _text(value)


def parameters_from(form: Mapping[str, str]) -> dict[str, Any]:
    """Parameters as typed, in the form of the API: every field is present, an empty one as null."""
    parameters: dict[str, Any] = {}
    for field in FIELDS:
        text = form.get(field.name, "").strip()
        if field.kind is FieldKind.YES_NO:
            parameters[field.name] = text == "true"
        elif field.kind is FieldKind.CHOICE:
            parameters[field.name] = text or None
        else:
            parameters[field.name] = number(text)
    if form.get("factor") == OTHER:
        parameters["factor"] = number(form.get("factor_other", ""))
    parameters["accept"] = {"n": number(form.get("accept_n", "")), "m": number(form.get("accept_m", ""))}
    return parameters


def with_suggestions(
    form: Mapping[str, str], floor: float, averages_used: Collection[int], average_locations: int
) -> dict[str, str]:
    """A new form with what was left empty filled in: R33, R36, R37 from the tolerance, R11 the first free location.

    floor: uncertainty of the machine's signal path, mm. A tool that was not named is not suggested: it is asked for.
    """
    given = dict(form)
    half = diagram(form).limits["tolerance"]
    if half is not None and half > 0:
        for name, value in suggested_limits(half, floor)._asdict().items():
            given[name] = form.get(name, "").strip() or f"{value:.10g}"
    if not form.get("average_memory", "").strip():
        free = (n for n in range(1, average_locations + 1) if n not in averages_used)
        measures_only = form.get("tool_memory", "").strip() in ("", "0") or form.get("mode") == "measure_only"
        given["average_memory"] = "0" if measures_only else str(next(free, 0))
    return given


def number(text: str) -> float | int | str | None:
    """A number as people type it: with a comma or a point, a minus sign of any kind. Else what was typed, for the core.

    >>> number("0,0053"), number("−0.016"), number("3"), number(""), number("3 mm")
    (0.0053, -0.016, 3, None, '3 mm')
    """
    if not text.strip():
        return None
    value = number_or_none(text) if len(text) <= 40 else None
    if value is None:
        return text
    return int(value) if plain(text).lstrip("+- ").isdecimal() else value


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else ""
    return f"{value:.10g}" if isinstance(value, float) else str(value)


class Diagram(NamedTuple):
    """The zone diagram's words as they are, so that it is right before and without any script."""

    target: float | None
    width: float | None
    limits: dict[str, float | None]
    natural: int = 0
    """Side of the natural limit, which has no limits: -1 below, 1 above."""


def diagram(typed: Mapping[str, str]) -> Diagram:
    """The limits that were typed, as far as they are numbers. mm."""
    fit = fit_of(typed.get("nominal", ""))
    values = {name: _length(typed.get(name, "")) for name in BY_NAME} | (fit._asdict() if fit else {})
    target, width = values["target"], values["tolerance_width"]
    said = typed.get("natural_limit")
    natural = NaturalLimit(said) if said in set(NaturalLimit) else assumed(values | {"mode": typed.get("mode")})
    drawing = [values[name] for name in DRAWING]
    if all(value is not None for value in drawing):
        nominal, upper, lower = (value or 0.0 for value in drawing)
        target, width = mean_nominal(nominal, upper, lower, natural)
    averaging = values["averaging_limit"]
    if averaging is None and width is not None:
        averaging = default_averaging_limit(width, natural)
    return Diagram(
        target,
        width,
        {
            "zero_range": values["zero_range"],
            "averaging_limit": averaging,
            "tolerance": None if width is None else half_width(width, natural),
            "wear_limit": values["wear_limit"],
            "confidence_limit": values["confidence_limit"],
        },
        natural.side,
    )


def _length(text: str) -> float | None:
    value = number(text)
    return float(value) if isinstance(value, int | float) and abs(value) < 1e9 else None


def micrometres(name: str, text: str) -> str:
    """A typed length in µm, as the page says it beside the field while one types."""
    value = _length(text)
    if value is None:
        return ""
    sign = "\N{MINUS SIGN}" if value < 0 else "+" if name in DRAWING else ""
    return f"{sign}{short(abs(value) * 1000)}\N{NO-BREAK SPACE}µm"


def short_limit(limit: float) -> str:
    """A limit as the diagram says it: four digits, in mm from 1 mm on."""
    return um_limit(abs(limit), "", 4)
