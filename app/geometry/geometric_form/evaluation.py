"""From what is stored to what is found, by the core. Pure; lengths in mm."""

from collections.abc import Mapping
from math import dist
from typing import Any, NamedTuple

from app.core.geometry.elements import Section
from app.core.geometry.form import Form, FormKind, Method, ProbedFeature, verdict
from app.core.geometry.relations import ENGINE, Task, corrected, evaluate
from app.core.geometry.suspect_points import SuspectPoint
from app.core.plausibility import looks_like_inches
from app.core.warning import CodedWarning

DIGITS = 9  # picometres: what is stored is what is answered


class EvaluatedForm(NamedTuple):
    """A row of `form_evaluation`, without its keys."""

    engine: int
    method: str
    value: float
    uncertainty: float | None
    verdict: str | None
    suspects: int
    result: dict[str, Any]


def task_of(kind: str, inputs: Mapping[str, Any]) -> Task:
    """Task for the core from stored inputs."""
    datum = inputs.get("datum")
    nominal = inputs.get("nominal")
    return Task(
        FormKind(kind),
        _touched(inputs),
        None if datum is None else _touched(datum),
        None if nominal is None else tuple(nominal),
        inputs.get("length"),
    )


def _touched(inputs: Mapping[str, Any]) -> ProbedFeature:
    sections = tuple(
        Section(
            tuple(tuple(touch) for touch in section.get("touches", ())),
            section.get("height"),
            tuple(section["centre"]) if section.get("centre") else None,
        )
        for section in inputs.get("sections", ())
    )
    return ProbedFeature(sections, tuple(tuple(point) for point in inputs.get("points", ())))


def find(
    kind: str, inputs: Mapping[str, Any], method: str | None, tolerance: float | None, repeatability: float | None
) -> EvaluatedForm:
    """Evaluate a measurement. Raises what the core raises: `Degenerate`, `WrongSection`, `DatumRefused`."""
    task = task_of(kind, inputs)
    form = evaluate(task)
    chosen = form.by(None if method is None else Method(method))
    uncertainty = chosen.uncertainty(repeatability)
    judged = None if tolerance is None else verdict(chosen.value, tolerance, uncertainty)
    suspects = len(form.suspicion.suspects) + len(form.datum.suspects)
    result = _rounded(
        {
            "values": [
                {"method": value.method, "value": value.value, "uncertainty": value.uncertainty(repeatability)}
                for value in form.values
            ],
            "suspects": [_suspect(suspect, "feature") for suspect in form.suspicion.suspects]
            + [_suspect(suspect, "datum") for suspect in form.datum.suspects],
            "tested": form.suspicion.tested,
            "corrected": _corrected(task, form, chosen.method),
            "details": _sized(form.details, inputs),
        }
    )
    return EvaluatedForm(
        ENGINE,
        str(chosen.method),
        round(chosen.value, DIGITS),
        None if uncertainty is None else round(uncertainty, DIGITS),
        None if judged is None else str(judged),
        suspects,
        result,
    )


def warnings_of(
    kind: str, inputs: Mapping[str, Any], result: Mapping[str, Any], plausible_shift: float
) -> list[CodedWarning]:
    """Return what may be wrong with a measurement: touches that do not fit, a place far off its nominal one, inches.

    plausible_shift: of the machine, mm.
    """
    warnings = [_misfit(suspect) for suspect in result["suspects"]]
    nominal = inputs.get("nominal")
    if kind == FormKind.POSITION and nominal is not None:
        centres = [section["centre"] for section in result["details"]["sections"]]
        centre = [sum(coordinates) / len(centres) for coordinates in zip(*centres, strict=True)]
        off = dist(centre, nominal)
        both = zip(centre, nominal, strict=True)
        sure = [(here, there) for here, there in both if max(abs(here), abs(there)) > plausible_shift]
        if off > plausible_shift and sure and all(looks_like_inches(*coordinates) for coordinates in sure):
            warnings.append(CodedWarning("looks_like_inches", {"which": "measured"}, "sections"))
        elif off > plausible_shift and sure and all(looks_like_inches(there, here) for here, there in sure):
            warnings.append(CodedWarning("looks_like_inches", {"which": "nominal"}, "nominal"))
        elif off > plausible_shift:
            warnings.append(CodedWarning("shifted_far", {"shift": round(off, 4), "limit": plausible_shift}, "nominal"))
    return warnings


def _misfit(suspect: Mapping[str, Any]) -> CodedWarning:
    at = suspect["touch"] - 1
    field = f"points[{at}]" if suspect["section"] is None else f"sections[{suspect['section'] - 1}].touches[{at}]"
    values = {"touches": (suspect["touch"],), "residual": suspect["off"]}
    return CodedWarning("touch_does_not_fit", values, f"datum.{field}" if suspect["of"] == "datum" else field)


def _corrected(task: Task, form: Form, method: Method) -> float | None:
    """The value if suspected touches were where they would have to be."""
    again = corrected(task, form)
    return None if again is None else again.by(method).value


def _suspect(point: SuspectPoint, of: str) -> dict[str, Any]:
    return {"of": of} | point._asdict()


def _sized(details: dict[str, Any], inputs: Mapping[str, Any]) -> dict[str, Any]:
    """The details with diameters: what was touched is the way of the tip's centre, so the tip is added or taken off."""
    tip = inputs.get("tip_diameter") or 0.0
    add = tip if inputs.get("side") == "inside" else -tip
    for name in ("sections", "datum_sections"):
        for section in details.get(name, ()):
            if section["radius"] is not None:
                section["diameter"] = 2 * section["radius"] + add
    return details


def _rounded(value: Any) -> Any:
    """Plain values, to the picometre."""
    if isinstance(value, float):
        return round(value, DIGITS)
    if isinstance(value, dict):
        return {name: _rounded(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(item) for item in value]
    return str(value) if isinstance(value, Method) else value
