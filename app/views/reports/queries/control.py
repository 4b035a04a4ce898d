"""The control charts as their page shows them – by the frozen baseline, never by the readings of the report – and their signals."""

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

import numpy as np

from app.core.spc.quantity import Quantity
from app.core.spc.refusal import Floats
from app.core.spc.rules import RuleName
from app.core.spc.shewhart import Chart
from app.core.spc.spread import Estimator
from app.files.documents.content import (
    Column,
    Fact,
    Picture,
    Section,
    Table,
    Value,
    count,
    deviation,
    moment,
    width,
    words,
)
from app.language.i18n import _
from app.loop.summaries.wording import estimator
from app.loop.timeline import queries as timeline
from app.quality.baselines import queries as controls
from app.quality.baselines import wording
from app.quality.baselines.tables import Baseline
from app.quality.chart_signals import queries as signals_queries
from app.quality.chart_signals import wording as signals
from app.quality.chart_signals.queries import SignalRow
from app.quality.control_charts import charts
from app.quality.control_charts.charts import View, only
from app.quality.control_charts.figures import control_figure
from app.views.reports.queries.frame import Frame

MOST_ROWS = 100
MOST_POINTS = 10_000  # of a chart, in numbers
NOWHERE = 9  # no side of any signal
MOST_SIGNALS = 1_000  # kept ones that are looked through for what was said of a run
WIDE = (940, 330)
SPREAD = (Chart.MOVING_RANGE, Chart.RANGES, Chart.DEVIATIONS)


def control(frame: Frame) -> Section | None:
    """The charts by the frozen baseline, and their signals; nothing where there are no readings."""
    if not frame.window.count:
        return None
    title, session, current = _("Control chart and signals"), frame.session, frame.current
    baseline = controls.baseline_in_force(session, current.characteristic)
    if baseline is None:
        why = _(
            "No baseline is in force, so there are no limits and no signals: nothing is judged by its own readings."
        )
        return Section("control", title, warnings=(why,))
    kinds = [kind for kind in charts.kinds(baseline) if kind not in charts.REMEMBERING]
    views = [charts.view(session, current, baseline, frame.window, kind) for kind in kinds]
    on_record = signals_queries.signals(
        session,
        characteristic=current.characteristic,
        first=frame.window.first,
        through=frame.window.last,
        limit=MOST_SIGNALS,
    )
    rows, of_all = _rows(views, on_record)
    return Section(
        "control",
        title,
        sentences=(_judged_by(baseline), *_among(frame), *_left_out(views[0])),
        warnings=_warnings(frame, baseline),
        facts=(
            *_of_baseline(baseline),
            *(fact for view in views for fact in _of_view(view)),
            *_facts_on_record(on_record),
        ),
        table=_table(rows, of_all) if rows else None,
        pictures=tuple(_picture(frame, baseline, view) for view in views if len(view.points)),
    )


def _judged_by(baseline: Baseline) -> str:
    return _("Judged by baseline {version}, frozen by {who}: {reason}").format(
        version=baseline.version, who=baseline.actor, reason=baseline.reason
    )


def _among(frame: Frame) -> tuple[str, ...]:
    if not frame.request.context:
        return ()
    first, last = frame.window.first, frame.window.last
    text = _("Each reading is judged among its neighbours: signals are of all readings from {first} to {last}.")
    return (text.format(first=first, last=last),)


def _left_out(main: View) -> tuple[str, ...]:
    sentences = [f"{sentence[0].upper()}{sentence[1:]}." for sentence in wording.left_out(main.left_out)]
    if main.settling:
        sentences.append(_("{n} readings set the level of their edge and are not judged.").format(n=main.settling))
    if main.waiting:
        sentences.append(_("{n} readings belong to a subgroup that is not complete yet.").format(n=main.waiting))
    return tuple(sentences)


def _warnings(frame: Frame, baseline: Baseline) -> tuple[str, ...]:
    sentences = []
    if baseline.provisional:
        sentences.append(
            _("The baseline is provisional: it was computed from only {n} readings.").format(n=baseline.readings)
        )
    if frame.window.first <= baseline.last_sequence:
        sentences.append(_("The baseline was computed from some of these readings: they cannot contradict it much."))
    return tuple(sentences)


def _of_baseline(baseline: Baseline) -> list[Fact]:
    facts = [
        Fact("baseline", _("Baseline, version"), count(baseline.version)),
        Fact("baseline_at", _("Frozen at"), moment(baseline.at)),
        Fact("baseline_period", _("Its period"), words(wording.period(baseline))),
        Fact("quantity", _("What is charted"), words(wording.quantity(Quantity(baseline.quantity)))),
        Fact("charts", _("Charts"), words(wording.baseline_chart(baseline.chart))),
        Fact("baseline_readings", _("Readings it was made of"), count(None if baseline.given else baseline.readings)),
        Fact("baseline_centre", _("Centre of single values"), deviation(baseline.centre, 3)),
        Fact("baseline_sigma", _("Sigma of a single value"), width(baseline.sigma, 3)),
        Fact("baseline_estimator", _("Sigma from"), words(estimator(Estimator(baseline.estimator)))),
    ]
    if baseline.grouping is not None:
        facts.insert(5, Fact("grouping", _("Subgroups"), words(wording.grouping(baseline))))
    return facts


def _of_view(view: View) -> list[Fact]:
    """Points, limits and signals of one chart."""
    name, key = wording.chart_name(view.kind), view.kind.value
    as_value = width if view.kind in SPREAD else deviation

    def limit(values: float | Floats | None) -> tuple[Value, str]:
        if values is None or not np.size(values):
            return as_value(None), ""
        several = np.ptp(values) > 0
        note = _("of the newest point: limits follow the size of the subgroups") if several else ""
        return as_value(float(np.ravel(values)[-1]), 3), note

    signal_count = sum(len(runs) for runs in view.signals.runs.values()) if view.signals else 0
    facts = [Fact(f"{key}_points", _("{chart}: points").format(chart=name), count(len(view)))]
    for end, title, values in (
        ("upper", _("{chart}: upper control limit"), view.upper),
        ("centre", _("{chart}: centre"), view.centre),
        ("lower", _("{chart}: lower control limit"), view.lower),
    ):
        value, note = limit(values)
        facts.append(Fact(f"{key}_{end}", title.format(chart=name), value, note=note))
    return [*facts, Fact(f"{key}_signals", _("{chart}: signals").format(chart=name), count(signal_count))]


def _facts_on_record(on_record: list[SignalRow]) -> list[Fact]:
    """Signals on record of these readings, from any chart and in any state."""
    states = [row.state for row in on_record]
    note = _("and older ones") if len(states) == MOST_SIGNALS else ""
    return [
        Fact("kept", _("Signals on record"), count(len(states)), note=note),
        Fact("kept_open", _("of these not explained yet"), count(states.count("open"))),
        Fact("kept_withdrawn", _("of these withdrawn"), count(states.count("withdrawn"))),
    ]


class _Row(NamedTuple):
    """One signal: its run of points, and its record if there is one."""

    chart: Chart
    run: Mapping[str, object]
    record: SignalRow | None


def _rows(views: list[View], on_record: list[SignalRow]) -> tuple[list[_Row], int]:
    """Newest first the signals of the charts, each with the one on record that it is, and those on record of charts that are not shown.

    Of very many the newest; the number is of all.
    """
    used: set[int] = set()
    rows: list[_Row] = []
    total = 0
    for view in views:
        for name, runs in (view.signals.runs if view.signals else {}).items():
            first, last = view.first[runs[:, 1]], view.last[runs[:, 2]]
            same = np.full(len(runs), -1)
            for at, row in enumerate(on_record):
                signal = row.signal
                if (signal.chart, signal.rule) == (view.kind, name):
                    over = (
                        (signal.first_sequence <= last) & (signal.last_sequence >= first) & (runs[:, 0] == signal.side)
                    )
                    same[over & (same < 0)] = at
            used.update(on_record[at].signal.id for at in np.unique(same[same >= 0]).tolist())
            total += len(runs)
            for at in np.lexsort((-first, -last))[:MOST_ROWS].tolist():
                run = {
                    "chart": view.kind.value,
                    "rule": name.value,
                    "side": int(runs[at, 0]),
                    "first": int(first[at]),
                    "last": int(last[at]),
                    "points": int(runs[at, 3]),
                }
                rows.append(_Row(view.kind, run, on_record[same[at]] if same[at] >= 0 else None))
    apart = [row for row in on_record if row.signal.id not in used]
    rows += [_Row(Chart(row.signal.chart), signals.data_of(row.signal), row) for row in apart]
    rows.sort(key=lambda row: (row.run["last"], row.run["first"]), reverse=True)
    return rows[:MOST_ROWS], total + len(apart)


def _table(rows: list[_Row], of_all: int) -> Table:
    return Table(
        (
            Column("chart", _("Chart"), 1.2),
            Column("rule", _("Rule"), 1.9),
            Column("first", _("From reading"), 0.8, "right"),
            Column("last", _("To reading"), 0.8, "right"),
            Column("points", _("Points"), 0.6, "right"),
            Column("what", _("What they do"), 2.4),
            Column("number", _("On record as"), 0.8, "right"),
            Column("state", _("State"), 0.9),
            Column("cause", _("What it was"), 1.6),
            Column("comment", _("Comment"), 1.6),
            Column("by", _("By whom"), 1.0),
        ),
        tuple(
            (
                words(wording.chart_name(row.chart)),
                words(signals.rule(row.chart, RuleName(str(row.run["rule"])))),
                count(int(str(row.run["first"]))),
                count(int(str(row.run["last"]))),
                count(int(str(row.run["points"]))),
                words(signals.what(row.run)),
                *_record_cells(row.record),
            )
            for row in rows
        ),
        more=of_all - len(rows),
    )


def _record_cells(on_record: SignalRow | None) -> tuple[Value, Value, Value, Value, Value]:
    """Record of a signal as cells; empty for signals from before the rules were monitored."""
    if on_record is None:
        return count(None), words(""), words(""), words(""), words("")
    signal, alarm = on_record.signal, on_record.alarm
    answered = alarm is not None and alarm.acknowledged_at is not None and signal.explained_at is None
    comment = alarm.comment if answered and alarm else signal.comment
    who = alarm.acknowledged_by if answered and alarm else signal.explained_by
    cause = signals.cause(signal.cause) if signal.cause else ""
    return count(signal.id), words(signals.state(on_record.state)), words(cause), words(comment), words(who)


def _picture(frame: Frame, baseline: Baseline, view: View) -> Picture:
    name = wording.chart_name(view.kind)
    figure = control_figure(
        view, key=frame.current.characteristic.key, marked=charts.marked_by(baseline), width=WIDE[0]
    )
    figure = timeline.with_events(frame.session, frame.current, figure, WIDE[0], lines=False)
    says = _("{chart} of readings {first} to {last}, with centre and limits of baseline {version}.").format(
        chart=name, first=int(view.first[0]), last=int(view.last[-1]), version=baseline.version
    )
    cut = max(0, len(view) - MOST_POINTS)
    newest = only(view, np.arange(len(view)) >= cut)  # a million points are not kept for them
    return Picture(f"control-{view.kind.value}", name, says, figure, *WIDE, partial(_data, newest, cut))


def _data(view: View, cut: int) -> Table:
    """The points in numbers with the limits of each, without the older ones that are cut."""
    as_value = width if view.kind in SPREAD else deviation

    def column(values: float | Floats | None) -> list[Value]:
        if values is None or np.ndim(values) == 0:
            return [as_value(values if values is None else float(values), 3)] * len(view)
        return [as_value(value, 3) for value in np.asarray(values).tolist()]

    columns = (
        Column("reading", _("Reading")),
        Column("value", wording.chart_name(view.kind)),
        Column("lower", _("Lower control limit")),
        Column("centre", _("Centre")),
        Column("upper", _("Upper control limit")),
        Column("signal", _("Signal")),
    )
    signalled = np.zeros(len(view), np.bool_) if view.signals is None else view.signals.sides(NOWHERE) != NOWHERE
    yes, no = words(_("yes")), words("")
    rows = zip(
        map(count, view.last.tolist()),
        column(view.points),
        column(view.lower),
        column(view.centre),
        column(view.upper),
        [yes if signal else no for signal in signalled.tolist()],
        strict=True,
    )
    return Table(
        columns,
        tuple(rows),
        more=cut,
    )
