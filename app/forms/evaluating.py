"""From what is stored to what is found, by the core. Pure; lengths in mm."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from app.core.geometry.elements import Section
from app.core.geometry.form import Form, Kind, Method, Touched, verdict
from app.core.geometry.relations import ENGINE, Task, corrected, evaluate
from app.core.geometry.suspicion import Suspect

DIGITS = 9  # picometres: what is stored is what is answered


class Found(NamedTuple):
    """A row of `form_evaluation`, without its keys."""

    engine: int
    method: str
    value: float
    uncertainty: float | None
    verdict: str | None
    suspects: int
    result: dict[str, Any]


def task_of(kind: str, given: Mapping[str, Any]) -> Task:
    """What is asked of the core, from what is stored."""
    datum = given.get("datum")
    nominal = given.get("nominal")
    return Task(
        Kind(kind),
        _touched(given),
        None if datum is None else _touched(datum),
        None if nominal is None else tuple(nominal),
        given.get("length"),
    )


def _touched(given: Mapping[str, Any]) -> Touched:
    sections = tuple(
        Section(
            tuple(tuple(touch) for touch in section.get("touches", ())),
            section.get("height"),
            tuple(section["centre"]) if section.get("centre") else None,
        )
        for section in given.get("sections", ())
    )
    return Touched(sections, tuple(tuple(point) for point in given.get("points", ())))


def find(
    kind: str, given: Mapping[str, Any], method: str | None, tolerance: float | None, repeatability: float | None
) -> Found:
    """Evaluate a measurement. Raises what the core raises: `Degenerate`, `WrongSection`, `DatumRefused`."""
    task = task_of(kind, given)
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
            "suspects": [_suspect(each, "feature") for each in form.suspicion.suspects]
            + [_suspect(each, "datum") for each in form.datum.suspects],
            "tested": form.suspicion.tested,
            "corrected": _corrected(task, form, chosen.method),
            "details": _sized(form.details, given),
        }
    )
    return Found(
        ENGINE,
        str(chosen.method),
        round(chosen.value, DIGITS),
        None if uncertainty is None else round(uncertainty, DIGITS),
        None if judged is None else str(judged),
        suspects,
        result,
    )


def _corrected(task: Task, form: Form, method: Method) -> float | None:
    """The value if suspected touches were where they would have to be."""
    again = corrected(task, form)
    return None if again is None else again.by(method).value


def _suspect(each: Suspect, of: str) -> dict[str, Any]:
    return {"of": of} | each._asdict()


def _sized(details: dict[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """The details with diameters: what was touched is the way of the tip's centre, so the tip is added or taken off."""
    tip = given.get("tip_diameter") or 0.0
    add = tip if given.get("side") == "inside" else -tip
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
        return {name: _rounded(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(each) for each in value]
    return str(value) if isinstance(value, Method) else value
