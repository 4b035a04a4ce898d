"""The page of one calibration: the results that L92 leaves, the touches, and what it was made with."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from app.language.formatting import NOTHING, mm, short, um
from app.language.i18n import _
from app.loop.characteristics.wording import label
from app.loop.tables.calibration import CalibrationRecord


class Fact(NamedTuple):
    """A line: R number or macro variable, its name, its value in words."""

    r: str
    name: str
    shown: str


def results(record: CalibrationRecord, numbers: Mapping[str, float | None]) -> list[Fact]:
    """R42 to R49 with their meaning, and the value before and after. numbers: as the API answers them."""
    size = mm if record.memory == "tool" else um
    locations = {name: NOTHING if number is None else f"{number:g}" for name, number in numbers.items()}
    ring = record.kind == "ring"
    return [
        Fact("R42", _("nominal size of the ring") if ring else _("size of the gauge"), mm(record.size)),
        Fact("R43", _("measured, mean"), mm(record.measured)),
        Fact("R44", _("probe beside the spindle axis") if ring else _("difference"), um(record.difference)),
        Fact("R46", _("average memory location"), locations["R46"]),
        Fact("R47", _("location of the probe's offset"), locations["R47"]),
        Fact("R49", _("average of the difference"), um(record.average)),
        Fact("", _("in effect before"), size(record.value_before)),
        Fact("", _("proposed"), size(record.proposed)),
    ]


def touch_heads(record: CalibrationRecord) -> list[str]:
    """Heads of the columns of `touch_rows`."""
    return {
        "gauge": [_("Touch, mm"), _("Difference, µm")],
        "ring": [_("X at +X, mm"), _("X at −X, mm"), _("Diameter, mm")],
        "pairs": [_("Machine, mm"), _("Gauge, mm")],
    }[record.kind]


def touch_rows(record: CalibrationRecord) -> Iterator[list[str]]:
    """Each touch, section or pair; one that is missing says so."""
    diameters = record.settings.get("diameters") or []
    for at, touched in enumerate(record.touches):
        if record.kind == "gauge":
            apart = None if touched is None or record.size is None else touched - record.size
            yield [_touch(touched), um(apart)]
        elif record.kind == "ring":
            yield [*map(_touch, touched), mm(diameters[at]) if at < len(diameters) else NOTHING]
        else:
            yield [*map(mm, touched)]


def _touch(size: float | None) -> str:
    return _("no touch") if size is None else mm(size)


def settings(record: CalibrationRecord) -> Iterator[Fact]:
    """Settings of the calibration, as far as it has them."""
    said = record.settings
    for r, name in (
        *(("R27", "repeats"), ("R28", "path_factor"), ("R29", "weighting_factor")),
        *(("R33", "zero_range"), ("R34", "averaging_limit"), ("R36", "confidence_limit")),
    ):
        if said.get(name) is not None:
            in_mm = r in {"R33", "R34", "R36"}
            yield Fact(r, label(name), mm(said[name]) if in_mm else short(said[name]))
    for r, name, words in (
        (
            "R21, R23",
            _("Where"),
            {"free": _("free surface"), "groove": _("reference groove")}.get(said.get("surface", "")),
        ),
        ("R22", _("Probe"), {"axial": _("axial"), "radial": _("radial")}.get(said.get("probe_type", ""))),
        ("R30", _("Axis"), said.get("axis")),
        ("R31", _("Direction"), {"positive": _("positive"), "negative": _("negative")}.get(said.get("direction", ""))),
    ):
        if words:
            yield Fact(r, name, words)
    yield from _of_ring(said)
    if said.get("instruments"):
        yield Fact("", _("External gauge"), ", ".join(said["instruments"]))


def _of_ring(said: Mapping[str, Any]) -> Iterator[Fact]:
    for r, name, key in (
        ("#505", _("Ring"), "nominal"),
        ("#506", _("Upper deviation ES"), "upper_deviation"),
        ("#507", _("Lower deviation EI"), "lower_deviation"),
        ("#502", _("Tip, as added to X"), "radius_term"),
    ):
        if said.get(key) is not None:
            yield Fact(r, name, mm(said[key]))
    if said.get("first_move_triggered"):
        yield Fact("", _("First move along Z"), _("triggered"))
