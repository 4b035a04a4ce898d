"""Sections on the loop: corrections, the tools they went into, and the wear behind them."""

from functools import partial

from sqlalchemy import func, select

from app.db.period import in_period
from app.files.documents.content import (
    Column,
    Fact,
    Picture,
    Section,
    Table,
    count,
    deviation,
    moment,
    size,
    table_of,
    words,
)
from app.language.i18n import _
from app.loop.tables.tools import Correction, ToolEvent
from app.loop.timeline import queries as timeline
from app.loop.tools import wording as tool_wording
from app.quality.wear import queries as wears
from app.quality.wear.chart import chart_of
from app.quality.wear.figures import WearChart, wear_figure
from app.quality.wear.wording import WearWords
from app.views.reports.queries.frame import Frame

MOST_ROWS = 100
WIDE = (940, 420)


def corrections(frame: Frame) -> Section:
    """The corrections that readings of the period asked for, newest first."""
    here = (
        Correction.machine_id == frame.current.machine.id,
        Correction.characteristic_id == frame.current.characteristic.id,
        frame.holds(Correction.sequence),
    )
    grouped = frame.session.execute(select(Correction.status, func.count()).where(*here).group_by(Correction.status))
    counted = {status: number for status, number in grouped}  # noqa: C416 - rows are no pairs to mypy
    total = frame.session.scalar(select(func.sum(Correction.amount)).where(*here, Correction.status == "applied"))
    rows = frame.session.scalars(
        select(Correction).where(*here).order_by(Correction.number.desc()).limit(MOST_ROWS)
    ).all()
    facts = [Fact("issued", _("Corrections"), count(sum(counted.values())))]
    facts += [
        Fact(f"status_{status}", _("of these {status}").format(status=tool_wording.status_word(status)), count(number))
        for status, number in sorted(counted.items())
    ]
    facts.append(Fact("sum_applied", _("Sum of those applied"), deviation(total or 0.0)))
    table = table_of(
        rows,
        (Column("number", _("Number"), 0.9, "right"), lambda row: count(row.number)),
        (Column("reading", _("Reading"), 0.8, "right"), lambda row: count(row.sequence)),
        (Column("issued_at", _("Issued at"), 1.7), lambda row: moment(row.created_at)),
        (Column("tool", _("Tool"), 0.5, "right"), lambda row: count(row.tool_memory)),
        (Column("amount", _("Amount"), 1.0, "right"), lambda row: deviation(row.amount)),
        (Column("status", _("Status"), 1.0), lambda row: words(tool_wording.status_word(row.status))),
        (Column("applied_at", _("Applied at"), 1.7), lambda row: moment(row.applied_at)),
        (Column("offset_after", _("Offset after"), 1.1, "right"), lambda row: size(row.offset_after)),
        (Column("by", _("By whom"), 2.0), lambda row: words(row.applied_by or row.decided_by)),
        (Column("why", _("Why"), 2.0), lambda row: words(tool_wording.why(row))),
        more=sum(counted.values()) - len(rows),
    )
    return Section("corrections", _("Corrections"), facts=tuple(facts), table=table if rows else None)


def tools(frame: Frame) -> Section | None:
    """Tool changes and edits by hand in the period; nothing for a characteristic that corrects no tool."""
    numbers = {int(version.parameters.get("tool_memory") or 0) for version in frame.versions_used} - {0}
    if not numbers or frame.span is None:
        return None
    rows = frame.session.scalars(
        select(ToolEvent)
        .where(
            ToolEvent.machine_id == frame.current.machine.id,
            ToolEvent.number.in_(numbers),
            ToolEvent.kind != "correction",
            in_period(ToolEvent.at, frame.span),
        )
        .order_by(ToolEvent.id.desc())
        .limit(MOST_ROWS + 1)
    ).all()
    table = table_of(
        rows[:MOST_ROWS],
        (Column("at", _("At"), 1.7), lambda row: moment(row.at)),
        (Column("tool", _("Tool"), 0.5, "right"), lambda row: count(row.number)),
        (Column("what", _("What"), 1.2), lambda row: words(tool_wording.event_word(row.kind))),
        (Column("offset_before", _("Offset before"), 1.1, "right"), lambda row: size(row.offset_before)),
        (Column("offset_after", _("Offset after"), 1.1, "right"), lambda row: size(row.offset_after)),
        (Column("parts", _("Parts cut"), 0.9, "right"), lambda row: count(row.parts)),
        (Column("total", _("Sum of its corrections"), 1.2, "right"), lambda row: deviation(row.total)),
        (Column("by", _("By whom"), 2.0), lambda row: words(row.actor)),
        (Column("why", _("Why"), 2.0), lambda row: words(row.reason)),
        more=max(0, len(rows) - MOST_ROWS),
    )
    sentences = () if rows else (_("No tool was changed and no offset was edited by hand."),)
    return Section("tools", _("Tool changes and edits"), sentences=sentences, table=table if rows else None)


def wear(frame: Frame) -> Section | None:
    """Wear per part, what it predicts, and whether the loop hunts; nothing where there are no readings."""
    if not frame.window.count:
        return None
    study = wears.wear_of(frame.session, frame.current, frame.window)
    text = WearWords(study.fit, study.forecasts, study.first, study.hunting, frame.parameters, study.record)
    facts = []
    if study.fit is not None and study.fit.is_wear:
        low, high = study.fit.slope_interval
        slope = deviation(study.fit.slope, 3)
        facts.append(Fact("slope", _("Wear per part"), slope, low=deviation(low, 3), high=deviation(high, 3)))
    facts += [
        Fact(f"forecast_{at}", _("Parts to: {what}").format(what=name), words(parts), note=means)
        for at, (name, parts, means, _first) in enumerate(text.forecasts, start=1)
    ]
    if text.forecasts:
        facts.append(Fact("forecasts_held", _("Earlier forecasts"), words(text.held), note=text.about_interval))
    facts.append(Fact("corrected", _("Sum of the corrections of this tool"), deviation(study.total)))
    sentences = [text.wear, *([text.note] if text.note else [])]
    if frame.request.context:
        sentences.insert(
            0,
            _("The tool wears with every part: this is of all readings from {first} to {last}.").format(
                first=frame.window.first, last=frame.window.last
            ),
        )
    if text.hunting:
        sentences.append(f"{text.hunting_word}: {text.hunting}")
    pictures: tuple[Picture, ...] = ()
    if len(study.now.sequence) or any(len(life.sequence) for life in study.lives):
        says = _("Wear curve: tool wear without the corrections, with the line through the newest readings.")
        chart = chart_of(study)
        drawn = wear_figure(chart, width=WIDE[0])
        figure = timeline.with_events(frame.session, frame.current, drawn, WIDE[0], lines=False)
        pictures = (Picture("wear", _("Wear curve"), says, figure, *WIDE, partial(_data, chart)),)
    return Section(
        "wear",
        _("Wear"),
        sentences=tuple(sentences),
        warnings=(text.remedy,) if text.remedy else (),
        facts=tuple(facts),
        pictures=pictures,
    )


def _data(chart: WearChart) -> Table:
    """The wear curve in numbers, one edge after the other."""
    columns = (
        Column("reading", _("Reading")),
        Column("worn", _("Wear")),
        Column("taken", _("Taken out by corrections")),
        Column("readings", _("Readings per mean")),
    )
    return Table(
        columns,
        tuple(
            (count(int(sequence)), deviation(worn, 2), deviation(correction, 2), words(str(many)))
            for life in (*chart.lives, chart.now)
            for sequence, worn, correction, many in zip(
                life.sequence, life.worn, life.removed, life.counts, strict=True
            )
        ),
    )
