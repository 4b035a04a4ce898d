"""Sections on the record of the period: alarms, notes, parameters, excluded readings, decisions."""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import func, or_, select, true

from app.core.context import ContextField
from app.core.parameters import BY_NAME
from app.db.period import in_period
from app.files.documents.content import Column, Fact, Section, Table, count, deviation, moment, size, table_of, words
from app.language.i18n import _
from app.loop.alarm_response import wording as alarm_wording
from app.loop.alarm_response.photo_queries import photo_counts
from app.loop.characteristics import wording
from app.loop.control_plan import queries as control_plan
from app.loop.notes.queries import on_charts_of
from app.loop.quarantine import wording as quarantine_wording
from app.loop.quarantine.tables import QuarantinedPart
from app.loop.reactions import queries as reactions
from app.loop.reactions import wording as reaction_wording
from app.loop.readings import queries as readings
from app.loop.tables.alarms import Alarm
from app.loop.tables.notes import Note
from app.loop.tables.readings import Exclusion, Reading
from app.loop.tools.wording import status_word
from app.views.reports.queries.frame import Frame
from app.web.theme import zone_name

MOST_ROWS = 100
MOST_DECISIONS = 50


def alarms(frame: Frame) -> Section:
    """Alarms of the readings of the period, and of their tool in that time, with what was said to them; newest first."""
    tools = {int(version.parameters.get("tool_memory") or 0) for version in frame.versions_used} - {0}
    own = (Alarm.characteristic_id == frame.current.characteristic.id) & frame.holds(Alarm.sequence)
    which = [own]
    if frame.span is not None:
        in_time = in_period(Alarm.raised_at, frame.span)
        which.append((Alarm.characteristic_id == frame.current.characteristic.id) & Alarm.sequence.is_(None) & in_time)
        which.append(Alarm.characteristic_id.is_(None) & Alarm.tool_memory.in_(tools) & in_time)
    here = (Alarm.machine_id == frame.current.machine.id, or_(*which))
    total = frame.session.scalar(select(func.count()).select_from(Alarm).where(*here)) or 0
    waiting = frame.session.scalar(
        select(func.count()).select_from(Alarm).where(*here, Alarm.acknowledged_at.is_(None))
    )
    rows = frame.session.scalars(select(Alarm).where(*here).order_by(Alarm.id.desc()).limit(MOST_ROWS)).all()
    photos = photo_counts(frame.session, rows)
    table = table_of(
        rows,
        (Column("number", _("Number"), 0.9, "right"), lambda row: count(row.id)),
        (Column("raised_at", _("Raised at"), 1.6), lambda row: moment(row.raised_at)),
        (Column("kind", _("Kind"), 1.1), lambda row: words(alarm_wording.kind_word(row.kind))),
        (Column("reading", _("Reading"), 0.8, "right"), lambda row: count(row.sequence)),
        (Column("times", _("Times"), 0.5, "right"), lambda row: count(row.count)),
        (Column("what", _("What was wrong"), 2.8), lambda row: words(alarm_wording.sentence(row))),
        (Column("acknowledged_at", _("Acknowledged at"), 1.6), lambda row: moment(row.acknowledged_at)),
        (Column("by", _("By whom"), 1.0), lambda row: words(row.acknowledged_by)),
        (
            Column("action", _("What was done"), 1.1),
            lambda row: words(alarm_wording.action_word(row.action) if row.action else ""),
        ),
        (Column("comment", _("Comment"), 1.5), lambda row: words(row.comment)),
        (Column("photos", _("Photos"), 0.7, "right"), lambda row: count(photos.get(row.id))),
        more=total - len(rows),
    )
    facts = (
        Fact("raised", _("Alarms"), count(total)),
        Fact("active", _("Not acknowledged yet"), count(waiting)),
        *_missed(frame),
    )
    return Section("alarms", _("Alarms"), facts=facts, table=table if rows else None)


def _missed(frame: Frame) -> list[Fact]:
    """Deviations from the control plan; none where there was no plan."""
    if frame.span is None or control_plan.plan_of(frame.session, frame.current) is None:
        return []
    number, parts = control_plan.count_missed(frame.session, frame.current.characteristic, frame.span)
    facts = [Fact("measurements_missed", _("Measurements missed"), count(number))]
    if parts:
        facts.append(Fact("parts_not_measured", _("Parts cut without them, at least"), count(parts)))
    return facts


def causes(frame: Frame) -> Section | None:
    """Causes of acknowledged alarms of the readings of the period; nothing where there are none."""
    found = reactions.causes_of_alarms(
        frame.session,
        machine_id=frame.current.machine.id,
        characteristic_id=frame.current.characteristic.id,
        which=[frame.holds(Alarm.sequence)],
    )
    if not found.shares:
        return None
    table = Table(
        (
            Column("cause", _("Cause"), 3.0),
            Column("alarms", _("Alarms"), 0.8, "right"),
            Column("share", _("Share"), 0.8, "right"),
            Column("sum", _("Sum"), 0.8, "right"),
            Column("acknowledged", _("Time to acknowledge"), 1.4, "right"),
            Column("recovered", _("Time to recover"), 1.4, "right"),
        ),
        tuple(
            (
                words(_("no cause given") if each.cause is None else found.names[each.cause]),
                count(each.alarms),
                words(f"{each.share:.0%}"),
                words(f"{each.sum:.0%}"),
                words(reaction_wording.duration(each.acknowledged)),
                words(reaction_wording.duration(each.recovered)),
            )
            for each in found.shares
        ),
    )
    sentence = _("Acknowledged alarms by the cause that was chosen. Times are medians from when the alarm was raised.")
    return Section("causes", _("Causes of alarms"), sentences=(sentence,), table=table)


def notes(frame: Frame) -> Section | None:
    """Notes on the charts of the period, the last moment first; nothing where nobody has written one."""
    here = [Note.sequence.is_not(None) & frame.holds(Note.sequence)]
    if frame.span is not None:
        here.append(Note.sequence.is_(None) & in_period(Note.at, frame.span))
    chosen = (
        Note.machine_id == frame.current.machine.id,
        on_charts_of(frame.current.characteristic.id),
        Note.withdrawn_at.is_(None),
        or_(*here),
    )
    rows = frame.session.scalars(select(Note).where(*chosen).order_by(Note.at.desc(), Note.id).limit(MOST_ROWS)).all()
    if not rows:
        return None
    total = frame.session.scalar(select(func.count()).select_from(Note).where(*chosen)) or 0
    table = table_of(
        rows,
        (Column("at", _("At"), 1.4), lambda row: moment(row.at)),
        (Column("reading", _("Reading"), 0.8, "right"), lambda row: count(row.sequence)),
        (Column("note", _("Note"), 5.0), lambda row: words(row.text)),
        (Column("by", _("By whom"), 1.2), lambda row: words(row.written_by)),
        more=total - len(rows),
    )
    return Section("notes", _("Notes"), table=table)


def quarantined(frame: Frame) -> Section | None:
    """Parts of the readings of the period that were set aside, those known by name alone among them; nothing where none was."""
    here = (
        QuarantinedPart.machine_id == frame.current.machine.id,
        QuarantinedPart.characteristic_id == frame.current.characteristic.id,
    )
    lists = select(QuarantinedPart.quarantine_id).where(*here, frame.holds(QuarantinedPart.sequence))
    order = dict(frame.request.context).get(ContextField.ORDER)
    of_order = true() if order is None else func.coalesce(QuarantinedPart.order, order) == order
    of_period = (QuarantinedPart.sequence.is_(None) & of_order) | frame.holds(QuarantinedPart.sequence)
    inside = (*here, QuarantinedPart.quarantine_id.in_(lists), of_period)
    total = frame.session.scalar(select(func.count()).select_from(QuarantinedPart).where(*inside)) or 0
    newest = (QuarantinedPart.quarantine_id.desc(), QuarantinedPart.number.desc())
    rows = frame.session.scalars(select(QuarantinedPart).where(*inside).order_by(*newest).limit(MOST_ROWS)).all()
    if not rows:
        return None
    table = table_of(
        rows,
        (Column("quarantine", _("Quarantine"), 0.8, "right"), lambda row: count(row.quarantine_id)),
        (
            Column("part", _("Part"), 1.4),
            lambda row: words(quarantine_wording.part_name(row.part, row.part_to) if row.part else None),
        ),
        (Column("order", _("Order"), 1.0), lambda row: words(row.order)),
        (Column("reading", _("Reading"), 0.7, "right"), lambda row: count(row.sequence)),
        (Column("deviation", _("Deviation"), 0.9, "right"), lambda row: deviation(row.deviation)),
        (Column("offset", _("Cut with offset"), 1.1, "right"), lambda row: size(row.offset)),
        (Column("status", _("Status"), 0.9), lambda row: words(quarantine_wording.status_word(row.status))),
        (Column("remeasured", _("Measured again"), 1.1, "right"), lambda row: size(row.remeasured)),
        (Column("decided", _("By whom, when, why"), 2.4), lambda row: words(quarantine_wording.decided(row))),
        more=total - len(rows),
    )
    return Section("quarantine", _("Parts set aside"), table=table)


def parameters(frame: Frame) -> Section:
    """The set in force, and what was changed while the period lasted, by whom and why."""
    in_force = wording.in_order(frame.current.version.parameters)
    facts = [
        Fact(
            name,
            wording.label(name),
            words(wording.worded(name, in_force)),
            (BY_NAME[name].r or "") if name in BY_NAME else "",
        )
        for name, value in in_force.items()
        if value is not None
    ]
    span = frame.span
    changed = [
        (version, differences)
        for version, differences in wording.history(frame.versions)
        if version.version > 1 and span is not None and span.covers(version.created_at, version.created_at)
    ]
    table = Table(
        (
            Column("version", _("Version"), 0.6, "right"),
            Column("at", _("At"), 1.4),
            Column("by", _("By whom"), 1.0),
            Column("changes", _("What changed"), 3.0),
            Column("why", _("Why"), 2.2),
        ),
        tuple(
            (
                count(version.version),
                moment(version.created_at),
                words(version.created_by),
                words(
                    "; ".join(
                        f"{answer.r or ''} {answer.name}: {answer.before} → {answer.after}".strip()
                        for answer in differences
                    )
                    or "–"
                ),
                words(version.reason),
            )
            for version, differences in changed
        ),
    )
    sentences = [_("In force now: version {version}.").format(version=frame.current.version.version)]
    if not changed:
        sentences.append(_("Nothing was changed in this period."))
    return Section(
        "parameters", _("Parameters"), sentences=tuple(sentences), facts=tuple(facts), table=table if changed else None
    )


def excluded(frame: Frame) -> Section | None:
    """Readings of the period that were taken out of the statistics, and why; nothing where none was."""
    query = (
        select(
            Exclusion.sequence, Reading.measured_at, Reading.deviation, Exclusion.at, Exclusion.actor, Exclusion.reason
        )
        .join(
            Reading,
            (Reading.machine_id == Exclusion.machine_id)
            & (Reading.characteristic_id == Exclusion.characteristic_id)
            & (Reading.sequence == Exclusion.sequence),
        )
        .where(
            Exclusion.machine_id == frame.current.machine.id,
            Exclusion.characteristic_id == frame.current.characteristic.id,
            frame.holds(Exclusion.sequence),
        )
    )
    rows = frame.session.execute(query.order_by(Exclusion.sequence.desc()).limit(MOST_ROWS)).all()
    if not rows:
        return None
    table = table_of(
        rows,
        (Column("reading", _("Reading"), 0.7, "right"), lambda row: count(row.sequence)),
        (Column("measured_at", _("Measured at"), 1.5), lambda row: moment(row.measured_at)),
        (Column("deviation", _("Deviation"), 0.9, "right"), lambda row: deviation(row.deviation)),
        (Column("at", _("Excluded at"), 1.5), lambda row: moment(row.at)),
        (Column("by", _("By whom"), 1.0), lambda row: words(row.actor)),
        (Column("why", _("Why"), 2.5), lambda row: words(row.reason)),
        more=frame.numbers.excluded - len(rows),
    )
    sentence = _("Excluded from all numbers above; they stay on record.")
    return Section("excluded", _("Excluded readings"), sentences=(sentence,), table=table)


def decisions(frame: Frame) -> Section | None:
    """The newest decisions of the period; nothing where there are no readings."""
    if not frame.window.count:
        return None
    entry = readings.entry_of(frame.session, frame.current.characteristic.key)
    assert entry is not None
    records = readings.latest(
        frame.session, entry, frame.window.last + 1, MOST_DECISIONS,
        Reading.sequence >= frame.window.first, frame.window.meant,
    )  # fmt: skip
    answers = readings.with_at_20(frame.session, entry, readings.answers(frame.session, entry, records))
    at_20 = (Column("size_at_20", _("Size at 20 °C"), 1.2, "right"), lambda answer: size(_at_20(answer)))
    table = table_of(
        answers,
        (Column("reading", _("Reading"), 0.8, "right"), lambda answer: count(answer["sequence"])),
        (Column("measured_at", _("Measured at"), 1.2), lambda answer: moment(answer["measured_at"])),
        (Column("part", _("Part"), 1.3), lambda answer: words(answer["part"])),
        (Column("size", _("Size"), 1.2, "right"), lambda answer: size(answer["size"])),
        *([at_20] if any(_at_20(answer) is not None for answer in answers) else []),
        (Column("measured", _("Machine reading"), 1.2, "right"), lambda answer: size(answer["measured"])),
        (Column("deviation", _("Deviation"), 0.8, "right"), lambda answer: deviation(answer["deviation"])),
        (Column("zone", _("Zone"), 0.8), lambda answer: words(zone_name(answer["zone"]))),
        (
            Column("correction", _("Correction"), 0.9, "right"),
            lambda answer: deviation(answer["correction"]["amount"] if answer["correction"] else None),
        ),
        (
            Column("status", _("Issued as"), 0.9),
            lambda answer: words(status_word(answer["correction"]["status"]) if answer["correction"] else ""),
        ),
        (Column("reason", _("Reason"), 4.8), lambda answer: words(answer["reason"]["as_read"])),
        more=frame.numbers.count + frame.numbers.excluded - len(records),
    )
    sentence = _("Newest first; the export of readings holds all of them.")
    return Section("decisions", _("Decisions"), sentences=(sentence,), table=table)


def _at_20(answer: Mapping[str, Any]) -> float | None:
    return answer["at_20"].size if answer["at_20"] else None
