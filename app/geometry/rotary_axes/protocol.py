"""The protocol of a run: everything that the control's own has, as page, PDF, XLSX and CSV. Lengths in mm, angles in degrees."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from app.core.rotary.results import OFFSETS, STRINGS
from app.files.documents.content import (
    Column,
    Fact,
    Picture,
    Report,
    Section,
    Table,
    Value,
    count,
    deviation,
    moment,
    number,
    size,
    width,
    words,
)
from app.geometry.rotary_axes import wording
from app.geometry.rotary_axes.answers import parameters_of, said_of
from app.geometry.rotary_axes.figures import LETTERS, diagram, greatest
from app.geometry.rotary_axes.queries import RunRow
from app.geometry.rotary_axes.run_history import in_order, surer
from app.language.formatting import as_read, short
from app.language.i18n import _, ngettext
from app.language.times import plant_zone

SETTINGS = {
    "Q407": "ball_radius",
    "Q320": "clearance",
    "Q408": "retract_height",
    "Q253": "feed",
    "Q380": "reference_angle",
    "Q423": "touches_per_ball",
    "Q432": "backlash_angle",
}
WIDE, TALL = 1040, 250
MOST_NOTES = 40


def protocol_of(row: RunRow, made_at: datetime) -> Report:
    """The protocol, with its diagrams as they are on the page."""
    run, results, settings = row.run, surer(row.run.results), _settings(row)
    return Report(
        key=f"kinematics-{run.id}",
        name=_("Rotary axes, run {n}").format(n=run.id),
        machine=row.machine.name,
        part="",
        period=f"{row.machine.name}, {as_read(run.measured_at, 'minutes')}, {wording.status_word(row.shown)}",
        zone=plant_zone().key,
        made_at=moment(made_at),
        head=_head(row),
        sections=(
            _outcome(row),
            *(section for axis in results["axes"] for section in _axis(axis, confirmed=row.status != "to_confirm")),
            *((_balls(results["balls"]),) if results["balls"] else ()),
            *((settings,) if settings.facts else ()),
            *((_not_understood(results["notes"]),) if results["notes"] else ()),
        ),
    )


def _head(row: RunRow) -> tuple[Fact, ...]:
    run = row.run
    texts = said_of(run)
    return (
        Fact("measured", _("Measured"), moment(run.measured_at)),
        Fact("program", _("NC program"), words(texts.get("program"))),
        Fact("tool", _("Tool"), words(texts.get("tool"))),
        Fact("kinematics", _("Active kinematics"), words(texts.get("kinematics"))),
        Fact("mode", _("Mode"), words(texts.get("mode"))),
        Fact("came", _("Came as"), words(wording.form_word(run.form))),
        *((Fact("head", _("Head"), words(run.head)),) if run.head else ()),
        Fact("by", _("Sent by"), words(run.actor)),
    )


def _outcome(row: RunRow) -> Section:
    run = row.run
    warned = [wording.sentence(run)] if run.outcome != "measured" else []
    notes = len(run.results["notes"])
    unread = ngettext("%(num)s line was not understood", "%(num)s lines were not understood", notes)
    warned += [unread % {"num": notes}] if notes else []
    warned += [wording.warning(item) for item in row.warnings]
    decided = tuple(
        _("{what} by {who} on {at}: {reason}").format(
            what=wording.status_word(what), who=item.actor, at=as_read(item.at, "minutes"), reason=item.reason
        )
        for what, item in row.decisions.items()
    )
    parameters = parameters_of(row)
    facts = [
        Fact(name, _named(name), deviation(value) if name in OFFSETS else width(value), code=name)
        for name, value in parameters.items()
        if isinstance(value, float)
    ]
    strings = [
        Fact(name, _("Position errors of {axis}").format(axis=STRINGS[name]), words(text), code=name)
        for name, text in parameters.items()
        if isinstance(text, str)
    ]
    sentences = [wording.sentence(run)] if run.outcome == "measured" else []
    sentences += [wording.not_confirmed()] if row.status == "to_confirm" else []
    return Section("outcome", _("Result"), (*sentences, *decided), tuple(warned), tuple(facts + strings))


def _named(name: str) -> str:
    words_of_name = wording.name_words(name)
    return words_of_name[:1].upper() + words_of_name[1:]


def _axis(axis: Mapping[str, Any], *, confirmed: bool) -> tuple[Section, ...]:
    """Return the sections of an axis. confirmed: where it has to go may be said; before that only where it stands."""
    letter = axis["axis"]
    backlash = axis["backlash"] or {"value": None, "deviation": None}
    facts = (
        Fact("start", _("Start angle"), _degrees(axis["start_angle"])),
        Fact("end", _("End angle"), _degrees(axis["end_angle"])),
        Fact("incidence", _("Incidence angle"), _degrees(axis["incidence"])),
        Fact("points", _("Measuring points"), count(axis["points"])),
        Fact("radius", _("Measuring circle radius"), size(axis["radius"])),
        Fact("backlash", _("Backlash"), _degrees(backlash["value"]), note=_plus_minus(backlash["deviation"], "°")),
        Fact(
            "angles",
            _("Axis positions"),
            words(", ".join(f"{short(angle)}°" for angle in axis["angles"])),
        ),
        Fact("scatter_before", _("Standard deviation, measured"), width(axis["scatter_before"])),
        Fact("scatter_after", _("Standard deviation, optimised"), width(axis["scatter_after"])),
        Fact("greatest_before", _("Greatest deviation, measured"), width(axis["greatest_before"])),
        Fact("greatest_after", _("Greatest deviation, optimised"), width(axis["greatest_after"])),
        Fact("angle_error", _("Angle error"), _degrees(axis["angle_error"])),
        Fact("mean_error", _("Mean positioning error"), width(axis["mean_error"])),
        *(
            Fact(
                name,
                _named(name),
                _degrees(item["value"]) if name[1] in "ABC" else deviation(item["value"]),
                code=name,
                note=_plus_minus(item["deviation"], "°" if name[1] in "ABC" else "µm"),
            )
            for name, item in in_order(axis["errors"]).items()
        ),
    )
    place = Table(
        (
            Column("what", _("Position of the axis"), 2.0),
            *(Column(item, f"{item}, mm", 1.0, "right") for item in LETTERS),
        ),
        tuple(
            (words(name), *(number(value, 4) for value in values))
            for name, values, title in (
                (_("before"), axis["position_before"], True),
                (_("correction in all axes"), axis["correction"], confirmed),
                (_("after"), axis["position_after"], confirmed),
            )
            if title and values is not None
        ),
    )
    about = Section(f"axis-{letter}", _("Axis {axis}").format(axis=letter), facts=facts, table=place)
    if not axis["positions"]:
        return (about,)
    return (about, _diagrams(axis))


def _diagrams(axis: Mapping[str, Any]) -> Section:
    letter, tall = axis["axis"], greatest(axis)
    names = [f"E{item}{letter}" for item in LETTERS]
    rows = tuple(
        (
            number(item["angle"], 3),
            words(wording.approach_word(item["approach"])),
            *(deviation(v) for v in item["measured"]),
            *(deviation(v) for v in item["optimised"]),
        )
        for item in axis["positions"]
    )
    columns = (
        Column("angle", f"{letter}, °", 1.0, "right"),
        Column("approach", _("from"), 1.0),
        *(Column(f"{name}-measured", name, 1.0, "right") for name in names),
        *(Column(f"{name}-optimised", _("{name} optimised").format(name=name), 1.2, "right") for name in names),
    )
    table = Table(columns, rows)
    pictures = tuple(
        Picture(
            name,
            name,
            _("{name}: deviation in {letter} against {axis}, measured and optimised").format(
                name=name, letter=direction, axis=letter
            ),
            diagram(axis, direction, height=tall),
            WIDE,
            TALL,
            lambda: table,
        )
        for name, direction in zip(names, LETTERS, strict=True)
    )
    return Section(f"diagrams-{letter}", _("Deviations of {axis}").format(axis=letter), table=table, pictures=pictures)


def _balls(balls: Sequence[Mapping[str, Any]]) -> Section:
    columns = (
        Column("number", _("Calibration sphere"), 1.0, "right"),
        Column("radius", _("Radius, mm"), 1.0, "right"),
        Column("deviation", _("Standard deviation of a point"), 1.0, "right"),
        Column("form", _("Form deviation"), 1.0, "right"),
    )
    rows = tuple(
        (count(at), number(ball["radius"], 4), width(ball["deviation"]), width(ball["form"]))
        for at, ball in enumerate(balls, start=1)
    )
    return Section("balls", _("Calibration spheres from probed points"), table=Table(columns, rows))


def _settings(row: RunRow) -> Section:
    run = row.run
    facts = [
        Fact(field, _setting(field), words(f"{value:g}"), code=name)
        for name, field in SETTINGS.items()
        if isinstance(value := run.given.get(field) or run.limits.get(field), int | float)
    ]
    limits = {
        "max_modification": ("maxModification", "mm"),
        "max_modification_angle": ("maxModification", "°"),
        "max_dev_cal_ball": ("maxDevCalBall", "mm"),
    }
    facts += [
        Fact(field, name, words(f"{run.limits[field]:g} {unit}"))
        for field, (name, unit) in limits.items()
        if run.limits.get(field) is not None
    ]
    return Section("settings", _("Settings"), facts=tuple(facts))


def _not_understood(notes: Sequence[str]) -> Section:
    more = _("and {n} more").format(n=len(notes) - MOST_NOTES) if len(notes) > MOST_NOTES else None
    return Section("notes", _("Not understood"), (*notes[:MOST_NOTES], *((more,) if more else ())))


def _setting(field: str) -> str:
    return {
        "ball_radius": _("Radius of the calibration sphere, mm"),
        "clearance": _("Clearance, mm"),
        "retract_height": _("Retract height, mm"),
        "feed": _("Feed, mm/min"),
        "reference_angle": _("Reference angle, °"),
        "touches_per_ball": _("Points per sphere"),
        "backlash_angle": _("Backlash angle, °"),
    }[field]


def _degrees(value: float | None) -> Value:
    return number(None) if value is None else words(wording.angle(value))


def _plus_minus(spread: float | None, unit: str) -> str:
    if spread is None:
        return ""
    text = f"{spread:.5f} °" if unit == "°" else f"{spread * 1000:.2f} µm"
    return _("standard deviation {s}").format(s=text)
