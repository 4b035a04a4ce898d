"""Parameters in words: what each is called, what it does, and what is wrong with one, in the words of the shop floor."""

from collections.abc import Iterable, Mapping, Sequence
from math import isfinite
from typing import Any, NamedTuple, Protocol, TypeVar

from app.core.decision.limits import nanometres
from app.core.parameters import BY_NAME, TWO_POINT_SWITCH, Field, FieldKind, Problem, Variant, mean_nominal
from app.errors import FieldError
from app.language.formatting import typed_length
from app.language.i18n import _, ngettext
from app.web.warnings import WarningOut


def label(name: str) -> str:
    """Name of a parameter."""
    return {
        "tool_memory": _("Tool memory"),
        "average_memory": _("Average memory"),
        "variant": _("Measuring variant"),
        "points": _("Measuring points"),
        "repeats": _("Repeats"),
        "index": _("Index or spacing"),
        "wait": _("Wait"),
        "axis": _("Measuring axis"),
        "direction": _("Probing direction"),
        "feature": _("What is touched"),
        "nominal": _("Nominal"),
        "upper_deviation": _("Upper deviation"),
        "lower_deviation": _("Lower deviation"),
        "target": _("Target"),
        "tolerance_width": _("Tolerance width"),
        "natural_limit": _("Natural limit"),
        "zero_range": _("Zero range"),
        "averaging_limit": _("Averaging limit"),
        "wear_limit": _("Wear limit"),
        "confidence_limit": _("Confidence limit"),
        "weighting_factor": _("Weighting factor k"),
        "path_factor": _("Path factor"),
        "factor": _("Factor from size error to offset"),
        "accept": _("Acceptance"),
        "rejected_may_correct": _("Correct from rejected parts"),
        "mode": _("Mode"),
        "wear_policy": _("Correction beyond the wear limit"),
        "max_step": _("Largest step"),
        "max_total": _("Largest sum"),
        "plausible_jump": _("Largest plausible jump"),
        TWO_POINT_SWITCH: _("Two-point measurement (R24)"),
    }.get(name, name)


def explanation(name: str) -> str | None:
    """Effect of a parameter, in one or two short sentences; None where the name says it."""
    return {
        "tool_memory": _("Whose offset is corrected; usual: 1 to 32. 0 measures only."),
        "average_memory": _("Where the running average is kept; usual: 1 to 20; may be shared. 0 keeps none."),
        "points": _("For the variants with several points."),
        "repeats": _("At the same point; the mean counts. Usual: 1 to 10."),
        "index": _("Degrees between points, or mm along Z."),
        "wait": _("Seconds before measuring goes on after indexing."),
        "direction": _(
            "Where it is not given, the probe comes from the free side in the positive half: negative on an outside surface, "
            "positive on an inside one."
        ),
        "feature": _(
            "The part from outside or inside (with the direction it says where the probe starts), or the tool itself: its length "
            "or radius tells its wear and, unless it is only measured, corrects its offset."
        ),
        "nominal": _("As on the drawing; 40 h6 (ISO 286) fills in the deviations."),
        "target": _("Aimed at: the middle of the tolerance, or the natural limit."),
        "tolerance_width": _("Upper minus lower limit."),
        "natural_limit": _(
            "The limit that no part can pass: the lower one of roundness, run-out, straightness, roughness. It is the target, and "
            "carries no index and no ppm. Not given: lower where nominal and lower deviation are 0 and nothing is corrected."
        ),
        "zero_range": _("Up to here a deviation is scatter: nothing is corrected."),
        "averaging_limit": _("Up to here the average decides. Empty: a third of the tolerance."),
        "wear_limit": _("From here on the tool is worn: an operator decides."),
        "confidence_limit": _("From here on probe or program is wrong: the decision is to stop."),
        "weighting_factor": _(
            "1 takes the last reading whole; larger follows slower and scatters less. Usual: 1 to 4."
        ),
        "path_factor": _("The surface is expected within ± this many mm of the target. Usual: 1 to 5."),
        "mode": _("Automatic: the machine fetches each correction. Approval: a person releases it first."),
        "wear_policy": _("What becomes of a correction computed for a worn tool."),
        "max_step": _("A larger correction is cut to this. Empty: no limit."),
        "max_total": _(
            "Sum of corrections per tool: beyond it nothing is corrected and an alarm is raised. Empty: no limit."
        ),
        "plausible_jump": _(
            "A reading further than this from the level of those before is marked, and its correction held. Empty: off."
        ),
        "rejected_may_correct": _("A part outside n of m also corrects the tool."),
    }.get(name)


def result_label(name: str) -> str:
    """Name of a variant's result."""
    return {
        "run_out": _("Run-out"),
        "out_of_roundness": _("Out-of-roundness"),
        "taper": _("Taper over the length"),
        "slope": _("Taper per mm"),
        "straightness": _("Straightness along"),
        "repeat_range": _("Range of the repeats"),
        "repeat_deviation": _("Standard deviation of the repeats"),
        "sections_outside": _("Sections outside"),
        "rejected": _("Rejected"),
    }.get(name, name)


def choice(name: str, value: str) -> str:
    """One of the choices of a parameter."""
    return {
        "variant": {
            "single": _("One point"),
            "indexed": _("One point, part indexed"),
            "round": _("Several points round the part"),
            "along": _("Several points along the part"),
            "two_point": _("Two points (width, bore)"),
        },
        "axis": {"X": "X", "Y": "Y", "Z": "Z"},
        "direction": {"positive": _("Positive (+)"), "negative": _("Negative (−)")},
        "feature": {
            "outside": _("Outside (shaft, web)"),
            "inside": _("Inside (bore, pocket)"),
            "tool": _("The tool itself (length, radius)"),
        },
        "mode": {
            "automatic": _("Automatic"),
            "approval": _("Approval by a person"),
            "measure_only": _("Measure only"),
        },
        "natural_limit": {
            "none": _("None: parts can lie on both sides"),
            "lower": _("Lower limit: nothing is below"),
            "upper": _("Upper limit: nothing is above"),
        },
        "wear_policy": {
            "hold": _("Hold for the operator"),
            "release": _("Release at once"),
        },
    }.get(name, {}).get(value, value)


def millimetres(value: float) -> str:
    """A limit as it is written in sentences: at least four decimals, none hidden.

    >>> millimetres(0.009), millimetres(0.0053333)
    ('0.0090 mm', '0.0053333 mm')
    """
    return f"{typed_length(value)} mm"


def named(name: str) -> str:
    """A parameter as sentences name it: `R34 averaging limit`."""
    field = BY_NAME.get(name)
    words = label(name)
    words = words[:1].lower() + words[1:]
    return f"{field.r} {words}" if field is not None and field.r else words


def in_order(parameters: Mapping[str, Any]) -> dict[str, Any]:
    """The set in the order of the table, which PostgreSQL does not keep."""
    return {name: parameters[name] for name in (*BY_NAME, "accept") if name in parameters}


def field_errors(problems: Iterable[Problem]) -> list[FieldError]:
    """Everything that is wrong, each at the field where one can change it."""
    return [FieldError(f"parameters.{_where(problem)}", sentence(problem)) for problem in problems]


def warnings(problems: Iterable[Problem]) -> list[WarningOut]:
    """Warnings of values that were accepted but may be wrong, each at its field."""
    return [
        WarningOut(code=problem.code, text=sentence(problem), field=f"parameters.{problem.field}")
        for problem in problems
    ]


def superseded_warnings(numbers: Sequence[int]) -> list[WarningOut]:
    """The warning of corrections that fell because parameters changed; none without such."""
    if not numbers:
        return []
    text = ngettext(
        "Correction {numbers} was computed with the parameters before and is superseded: it must not be in the offset.",
        "Corrections {numbers} were computed with the parameters before and are superseded: they must not be in the offset.",
        len(numbers),
    )
    named = ", ".join(map(str, numbers))
    return [WarningOut(code="corrections_superseded", text=text.format(numbers=named), field="parameters")]


def _where(problem: Problem) -> str:
    # The tolerance is given by the drawing: if R34 does not fit into it, R34 is what gives way.
    return "averaging_limit" if (problem.field, problem.code) == ("tolerance_width", "order") else problem.field


def sentence(problem: Problem) -> str:
    """The sentence of a problem: the error and what to do."""
    data, name = problem.data, named(problem.field)
    if problem.code == "order":
        if data["smaller"] != data["larger"] and nanometres(data["smaller"]) == nanometres(data["larger"]):
            return _(
                "{inner} and {outer} are the same to a nanometre (0.000001 mm), finer than which nothing is compared; lower the "
                "one or raise the other"
            ).format(inner=data["inner"], outer=data["outer"])
        return order_sentence(data["inner"], data["outer"], millimetres(data["smaller"]), millimetres(data["larger"]))
    if problem.code in {"range", "source_range"}:
        return _range(problem, name)
    known = _of_values(problem, name) | _of_points(problem, name) | _of_tools(problem)
    return known.get(problem.code) or _natural(problem)


def _of_values(problem: Problem, name: str) -> dict[str, str]:
    """Sentences about a single value, or one that is missing, by the code of the problem."""
    data = problem.data
    return {
        "required": _("{name} is missing; enter it").format(name=name),
        "unknown": _("There is no parameter {name}; check the spelling or the R number").format(
            name=problem.field[:64]
        ),
        "twice": _("{name} is given twice, also as {other}; give it once").format(
            name=problem.field[:64], other=data.get("other")
        ),
        "not_a_number": _not_a_number(problem, name),
        "not_whole": _("{name} must be a whole number").format(name=name),
        "not_a_choice": _("{name} must be one of {choices}").format(
            name=name, choices=", ".join(data.get("choices", ()))
        ),
        "not_yes_no": _("{name} must be true or false").format(name=name),
        "target_missing": _(
            "The size is missing: say R42 nominal with R40 and R41 deviations, or R32 target with R35 tolerance width"
        ),
        "target_twice": _target_twice(problem, name),
        "tolerance_sign": _limits_as_sizes(problem),
        "signal_path": _signal_path(problem, name),
        "no_location": _(
            "{name} {value} is not on this machine: it has {last}; the number is set with the machine"
        ).format(name=name, value=data.get("value"), last=data.get("last")),
    }


def _of_points(problem: Problem, name: str) -> dict[str, str]:
    """Sentences about points, variants and sections, by the code of the problem."""
    data = problem.data
    return {
        "variant_axis": _("{name} is {axis}, but “{variant}” is measured in X only; check R25 and R30").format(
            name=name, axis=data.get("axis"), variant=choice("variant", data.get("variant", ""))
        ),
        "points_missing": _("“{variant}” needs several points, but R23 does not say how many").format(
            variant=choice("variant", data.get("variant", ""))
        ),
        "out_of_reach": _out_of_reach(problem, name),
        "spacing_missing": _(
            "R26 is missing: along the part it is the distance between two points in mm, without which there is no taper per mm"
        ),
        "places_coincide": _(
            "With R26 = {value}° point {point} lies where the first one does: one place is touched twice and says nothing "
            "about roundness"
        ).format(value=data.get("value"), point=data.get("point")),
        "limits_as_sizes": _limits_as_sizes(problem),
        "averages_never": _averages_never(problem),
        "switch_value": _(
            "R24 = {value} is taken as two-point measurement; the cycles know 0 (off) and 1 (on). Check the number"
        ).format(value=data.get("value")),
        "switch_wins": _("R24 asks for two points, so R25 “{variant}” does not count; give only one of them").format(
            variant=choice("variant", data.get("variant", ""))
        ),
        "switch_loses": _("R24 = 0 asks for no two points, but the variant does; the variant counts"),
        "sections": _(
            "{name} {points} do not fit acceptance by {sections} sections; say {sections}, or leave it out"
        ).format(name=name, points=data.get("points"), sections=data.get("sections")),
        "accept": _('Acceptance must be {"n": n, "m": m} with whole numbers, 1 ≤ n ≤ m ≤ 100, for example 2 of 3'),
    }


def _of_tools(problem: Problem) -> dict[str, str]:
    """Sentences about factor and tool, by the code of the problem."""
    data = problem.data
    return {
        "not_on_lathe": _(
            "Two-point measurement (R24) is not for lathes: the cycles know it on machining centres only"
        ),
        "factor_on_lathe": _(
            "The factor {value} is positive, but this machine is a lathe: −1 in diameter, −0.5 in radius, −1 in length. "
            "With the wrong sign every correction makes the part worse"
        ).format(value=f"{data.get('value', 0):+.10g}"),
        "factor_outside": _(
            "The factor {value} is positive, but what is touched is outside: −1 in diameter or length, −0.5 in radius. Only inside, "
            "with a milling radius, is it positive. With the wrong sign every correction makes the part worse"
        ).format(value=f"{data.get('value', 0):+.10g}"),
        "factor_inside": _(
            "The factor {value} is negative, but what is touched is inside and the machine mills: a larger radius makes a larger hole, "
            "so +0.5. With the wrong sign every correction makes the part worse"
        ).format(value=f"{data.get('value', 0):+.10g}"),
        "sign_missing": _(
            "The factor is missing: it says which way the offset acts. Lathe diameter −1, radius −0.5, length −1; "
            "milling radius −0.5 outside, +0.5 inside"
        ),
        "tool_measured": _(
            "A tool that is measured itself (feature: tool) needs its location R10: its size tells its wear, and corrects that "
            "offset unless the mode is measure_only"
        ),
        "contested": _(
            "Tool {tool} is corrected by {other} already. The size of a tool and the parts that it cuts would undo each other's "
            "corrections: set one of the two to measure_only first, or give it another location"
        ).format(tool=data.get("tool"), other=data.get("other")),
        "factor_of_tool": _(
            "The factor {value} is negative: a longer tool would get a smaller offset, and no size would show it. As a rule it is "
            "+1, or +2 for a radius at an offset in diameter; if the control counts the other way, use the mode approval"
        ).format(value=f"{data.get('value', 0):+.10g}"),
        "factor_of_a_unit": _(
            "The factor {value} corrects {times} times as much as the part is off. Usual are −1, −0.5 and +0.5; amounts are mm, and "
            "what a control holds in inches or steps is converted on its way"
        ).format(value=f"{data.get('value', 0):+.10g}", times=f"{abs(data.get('value', 0)):.10g}"),
        "factor_zero": _("The factor must not be 0: nothing would ever be corrected. To only measure, set R10 to 0"),
    }


def _natural(problem: Problem) -> str:
    if problem.code not in {"natural_corrected", "natural_assumed", "natural_likely"}:
        return problem.code
    if problem.code == "natural_likely":
        return _(
            "The name {name} is that of a form, position or roughness deviation, of which nothing is below 0. If so, set "
            "natural_limit to lower: then only the upper limit is judged, and the target is the lower one"
        ).format(name=problem.data["name"])
    if problem.code == "natural_corrected":
        return _(
            "A size with a natural limit (roundness, run-out) has no sign, so no offset corrects it: set R10 to 0 or the mode to "
            "measure_only, or natural_limit to none"
        )
    return _(
        "The limit {limit} was taken as a natural one, so it is the target and only the other limit is judged (nominal and "
        "lower deviation are 0 and nothing is corrected). If sizes below it can exist, set natural_limit to none"
    ).format(limit=millimetres(problem.data["limit"]))


def _out_of_reach(problem: Problem, name: str) -> str:
    if problem.code != "out_of_reach":
        return ""
    return _(
        "{name} {value} does not lie inside ±a = {window} (R28), so touches do not reach it: one outside ±a is a probe fault "
        "already. Raise R28, or lower R36"
    ).format(name=name, value=millimetres(problem.data["value"]), window=millimetres(problem.data["window"]))


def _limits_as_sizes(problem: Problem) -> str:
    if problem.code not in {"limits_as_sizes", "tolerance_sign"}:
        return ""
    nominal, upper, lower = (problem.data[name] for name in ("nominal", "upper", "lower"))
    values = {
        "nominal": millimetres(nominal),
        "upper": millimetres(upper),
        "lower": millimetres(lower),
        "target": millimetres(mean_nominal(nominal, upper, lower)[0]),
    }
    if problem.data["meant"] is not None:
        up, low = map(millimetres, problem.data["meant"])
        return _(
            "R40 {upper} and R41 {lower} can hardly both be deviations from R42 {nominal}: the target would be {target}. Is one a limit "
            "of size, or are both? As deviations they are {up} and {low}"
        ).format(up=up, low=low, **values)
    if problem.code == "tolerance_sign":
        return _("R40 upper deviation must be greater than R41 lower deviation; check the signs (h6 is 0 and −0.016)")
    return _(
        "R40 {upper} and R41 {lower} are large for deviations from R42 {nominal}: the target would be {target}. Check their decimal "
        "point, sign and unit"
    ).format(**values)


def _averages_never(problem: Problem) -> str:
    if problem.code != "averages_never":
        return ""
    data = problem.data
    return _(
        "Without an average memory (R11 = 0) k = {k} only damps: a deviation must pass k × R33 = {reach} to be corrected, and "
        "the averaging zone ends at R34 = {averaging}. Give it a memory, or k = 1"
    ).format(k=f"{data['k']:.10g}", reach=millimetres(data["reach"]), averaging=millimetres(data["averaging"]))


def _not_a_number(problem: Problem, name: str) -> str:
    if problem.field == "nominal":
        return _(
            "{name} must be a number in mm, or a size with a tolerance class of ISO 286 such as 40 h6 (up to 500 mm); "
            "R40 and R41 stay empty then"
        ).format(name=name)
    if problem.field in BY_NAME and BY_NAME[problem.field].kind is FieldKind.WHOLE:
        return _("{name} must be a whole number, in JSON without quotation marks").format(name=name)
    if problem.field in BY_NAME and BY_NAME[problem.field].kind is FieldKind.LENGTH:
        return _("{name} must be a number, in mm with a decimal point").format(name=name)
    return _("{name} must be a number, with a decimal point").format(name=name)


def order_sentence(inner: str, outer: str, smaller: str, larger: str) -> str:
    """Refusal of a pair in the wrong order: ``smaller`` is the value of R number ``inner``, ``larger`` that of ``outer``."""
    names = {
        "R33": _("R33 zero range"),
        "R34": _("R34 averaging limit"),
        "R35/2": "R35/2",
        "R35": "R35",
        "R37": _("R37 wear limit"),
        "R36": _("R36 confidence limit"),
    }
    if outer == "R35":
        sentence = _(
            "{inner} {smaller} must not be larger than R35 = {larger}; lower it, or leave it empty for two thirds of the tolerance"
        )
    elif outer == "R35/2":
        sentence = _(
            "{inner} {smaller} must not be larger than R35/2 = {larger}; lower it, or leave it empty for a third of the "
            "tolerance"
        )
    elif inner in {"R35/2", "R35"}:
        sentence = _("{outer} {larger} must not be smaller than {inner} = {smaller}; raise it")
    elif inner == "R33":
        sentence = _("{inner} {smaller} must be smaller than {outer} {larger}; lower the one or raise the other")
    else:
        sentence = _("{inner} {smaller} must not be larger than {outer} {larger}; lower the one or raise the other")
    return sentence.format(inner=names[inner], outer=names[outer], smaller=smaller, larger=larger)


def _range(problem: Problem, name: str) -> str:
    field = BY_NAME[problem.field]
    value, lowest, highest = (problem.data[key] for key in ("value", "lowest", "highest"))
    unit = " mm" if field.kind is FieldKind.LENGTH else ""
    values = {
        "name": name,
        "value": f"{value:.10g}{unit}" if isfinite(value) else str(value),
        "lowest": f"{lowest:.10g}",
        "highest": f"{highest:.10g}{unit}",
    }
    if problem.warning:
        if problem.field == "index":
            values["value"], values["highest"] = f"{value:.10g}°", f"{highest:.10g}°"
        unusual = _("{name} {value} is unusual: the control's range is {lowest} to {highest}").format(**values)
        return unusual + (_("; check that it is in mm") if unit else "")
    return _("{name} must lie between {lowest} and {highest}, not {value}").format(**values)


def _target_twice(problem: Problem, name: str) -> str:
    if problem.code != "target_twice":
        return ""
    return _(
        "{name} {value} does not agree with nominal and deviations, which give {computed}; say only one of the two"
    ).format(name=name, value=millimetres(problem.data["value"]), computed=millimetres(problem.data["computed"]))


def _signal_path(problem: Problem, name: str) -> str:
    if problem.code != "signal_path":
        return ""
    return _(
        "{name} {value} is finer than the probe tells: through the PLC a touch is uncertain by {floor}, the probing feed "
        "times the delay of the signal"
    ).format(name=name, value=millimetres(problem.data["value"]), floor=millimetres(problem.data["floor"]))


class HasParameters(Protocol):
    """A stored version of the parameters."""

    @property
    def parameters(self) -> Mapping[str, Any]: ...


Version = TypeVar("Version", bound=HasParameters)


class Difference(NamedTuple):
    """Change of one parameter between two versions."""

    name: str
    r: str | None
    before: str
    after: str


def differences(old: Mapping[str, Any], new: Mapping[str, Any]) -> Iterable[Difference]:
    """Changes between two versions, worded."""
    for name in (*BY_NAME, "accept"):
        if old.get(name) != new.get(name):
            field = BY_NAME.get(name)
            yield Difference(label(name), field.r if field else None, worded(name, old), worded(name, new))


def worded(name: str, parameters: Mapping[str, Any]) -> str:
    """One parameter as people read it."""
    value = parameters.get(name)
    field = BY_NAME.get(name)
    if value is None:
        return _("not given") if name == "direction" else "–"
    if name == "accept":
        return _("{n} of {m}").format(n=value["n"], m=value["m"])
    if isinstance(value, bool):
        return _("yes") if value else _("no")
    if field is not None and field.choices:
        return choice(name, str(value))
    text = f"{value:.10g}" if isinstance(value, float) else str(value)
    return text.replace("-", "\N{MINUS SIGN}") + _unit(name, field, parameters)


def _unit(name: str, field: Field | None, parameters: Mapping[str, Any]) -> str:
    if name == "index":  # R26 is an angle, or along the part a distance
        return " mm" if parameters.get("variant") == Variant.ALONG else "°"
    if name == "wait":
        return " s"
    return " mm" if field is not None and field.kind is FieldKind.LENGTH else ""


def history(versions: Sequence[Version]) -> list[tuple[Version, list[Difference]]]:
    """Each version, newest first, with what it changed; the oldest of them changed nothing."""
    older = [*versions[1:], None]
    return [
        (version, list(differences(before.parameters, version.parameters)) if before else [])
        for version, before in zip(versions, older, strict=True)
    ]
