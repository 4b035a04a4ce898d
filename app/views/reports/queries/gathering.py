"""A whole report: the head, and every section that was asked for."""

from collections.abc import Callable
from datetime import datetime
from zoneinfo import ZoneInfo

from sqlalchemy.orm import Session

from app.core.decision.step import rounded
from app.core.natural_limit import NaturalLimit
from app.errors import InbandError
from app.files.documents.content import Fact, Report, Section, count, deviation, moment, size, width, words
from app.language.i18n import _
from app.language.times import in_zone
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.characteristics.wording import choice
from app.loop.readings.wording import field_word
from app.loop.summaries.wording import context_words
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.views.reports.queries import capability, charts, control, loop, numbers, record, summary
from app.views.reports.queries.frame import Frame
from app.views.reports.request import ReportRequest, SectionName

GATHERED: dict[SectionName, Callable[[Frame], Section | None]] = {
    SectionName.SUMMARY: summary.summary,
    SectionName.NUMBERS: numbers.numbers,
    SectionName.CAPABILITY: capability.capability,
    SectionName.CHART: charts.chart,
    SectionName.CONTROL: control.control,
    SectionName.WEAR: loop.wear,
    SectionName.CORRECTIONS: loop.corrections,
    SectionName.ALARMS: record.alarms,
    SectionName.CAUSES: record.causes,
    SectionName.QUARANTINE: record.quarantined,
    SectionName.NOTES: record.notes,
    SectionName.TOOLS: loop.tools,
    SectionName.PARAMETERS: record.parameters,
    SectionName.EXCLUDED: record.excluded,
    SectionName.DECISIONS: record.decisions,
}


def report_of(
    session: Session, current: CurrentCharacteristic, request: ReportRequest, now: datetime, by: str = ""
) -> Report:
    """Report on a characteristic and a period. `now`, `by`: the time of creation printed on it, and who asked for it.

    A section that cannot be made – too many readings at once – says so in words; the others stand.
    """
    frame = Frame(session, current, request, now)
    with in_zone(ZoneInfo(request.zone)):
        sections = [_section(frame, name) for name in request.sections]
    return Report(
        key=current.characteristic.key,
        name=current.characteristic.name,
        machine=current.machine.name,
        part=current.characteristic.part or "",
        period=_period(frame),
        zone=request.zone,
        made_at=moment(now),
        head=tuple(_head(frame)),
        sections=tuple(section for section in sections if section is not None),
        warnings=_proof(),
        made_by=by,
    )


def _proof() -> tuple[str, ...]:
    """Warnings above everything else when the engine does not compute what was published. Never waits."""
    failing = proof.failing()
    return (proof_wording.warning(len(failing)),) if failing else ()


def title_of(name: SectionName) -> str:
    """Title of a section."""
    return {
        SectionName.SUMMARY: _("Summary"),
        SectionName.NUMBERS: _("Numbers"),
        SectionName.CAPABILITY: _("Capability"),
        SectionName.CHART: _("Zone chart"),
        SectionName.CONTROL: _("Control chart and signals"),
        SectionName.WEAR: _("Wear"),
        SectionName.CORRECTIONS: _("Corrections"),
        SectionName.ALARMS: _("Alarms"),
        SectionName.CAUSES: _("Causes of alarms"),
        SectionName.QUARANTINE: _("Parts set aside"),
        SectionName.NOTES: _("Notes"),
        SectionName.TOOLS: _("Tool changes and edits"),
        SectionName.PARAMETERS: _("Parameters"),
        SectionName.EXCLUDED: _("Excluded readings"),
        SectionName.DECISIONS: _("Decisions"),
    }[name]


def _section(frame: Frame, name: SectionName) -> Section | None:
    try:
        section = GATHERED[name](frame)
    except InbandError as error:
        return Section(name, title_of(name), warnings=(f"{error.detail} {error.what_to_do or ''}".strip(),))
    return section


def _period(frame: Frame) -> str:
    """The period and the context in words, as they are on every page."""
    request, ends, zone = frame.request, frame.ends, ZoneInfo(frame.request.zone)
    period = " – ".join(
        moment(at).words(zone) if at is not None else unbounded
        for at, unbounded in zip(request.period, (_("the first"), _("now")), strict=True)
    )
    period = ", ".join(filter(None, (context_words(request.context), period if request.period.bounded else "")))
    if ends is None:
        return _("{period}, no readings").format(period=period) if period else _("no readings")
    measured = " – ".join(moment(end.measured_at).words(zone) for end in ends)
    span = period if request.period.bounded else ", ".join(filter(None, (period, measured)))
    return _("{span}, readings {first} to {last}").format(span=span, first=ends[0].sequence, last=ends[1].sequence)


def _head(frame: Frame) -> list[Fact]:
    characteristic, machine, parameters = frame.current.characteristic, frame.current.machine, frame.parameters
    facts = [
        Fact("characteristic", _("Characteristic"), words(characteristic.key)),
        Fact("machine", _("Machine"), words(f"{machine.name} ({machine.key})")),
        Fact("part", _("Part"), words(characteristic.part or "–")),
        *(Fact(f"context.{field.value}", field_word(field), words(value)) for field, value in frame.request.context),
    ]
    if parameters.nominal is not None:
        facts += [
            Fact("nominal", _("Nominal"), size(parameters.nominal), "R42"),
            Fact("upper_deviation", _("Upper deviation"), deviation(parameters.upper_deviation), "R40"),
            Fact("lower_deviation", _("Lower deviation"), deviation(parameters.lower_deviation), "R41"),
        ]
    facts += [
        Fact("target", _("Target"), size(parameters.target), "R32"),
        Fact("upper_limit", _("Upper limit"), size(rounded(parameters.sizes[1]))),
        Fact("lower_limit", _("Lower limit"), size(rounded(parameters.sizes[0]))),
        Fact("tolerance_width", _("Tolerance width"), width(parameters.tolerance_width, 1), "R35"),
    ]
    if parameters.natural_limit is not NaturalLimit.NONE:
        facts.append(
            Fact("natural_limit", _("Natural limit"), words(choice("natural_limit", parameters.natural_limit.value)))
        )
    if frame.ends is not None:
        first, last = frame.ends
        facts += [
            Fact("first_reading", _("First reading"), count(first.sequence)),
            Fact("first_at", _("Measured at"), moment(first.measured_at)),
            Fact("last_reading", _("Last reading"), count(last.sequence)),
            Fact("last_at", _("Measured at"), moment(last.measured_at)),
        ]
    used = sorted(version.version for version in frame.versions_used)
    named = str(used[0]) if len(used) == 1 else f"{used[0]}–{used[-1]}" if used else "–"
    return [*facts, Fact("versions", _("Parameters, version"), words(named))]
