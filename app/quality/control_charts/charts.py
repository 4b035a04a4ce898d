"""The charts of a baseline: every kind of them over a window, with their signals. Never writes.

Charts that remember (EWMA, moving average, CUSUM) begin with the first reading of the baseline's period, and again with the
first one after it; so a point is the same whichever window shows it, as long as its beginning is not further back than
`queries.LOOK_BACK` readings. They take single values, of baselines of subgroups too.
"""

from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import inspect
from sqlalchemy.orm import Session

from app.core.spc import cusum, ewma, rules, shewhart
from app.core.spc.quantity import Quantity, Series
from app.core.spc.refusal import Floats
from app.core.spc.rules import RULES, RuleName
from app.core.spc.shewhart import Chart, ControlChart
from app.core.spc.spread import Subgroups
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.summaries import queries as statistics
from app.loop.summaries.queries import Window
from app.quality.baselines import queries
from app.quality.baselines.queries import LOOK_BACK, Baseline, Charted, charted, judged_by, restarts
from app.quality.baselines.series_queries import read
from app.quality.chart_rules.places import Place
from app.quality.chart_rules.queries import rules_in_force
from app.quality.control_charts.view import Marks, View, only, since

__all__ = ["Marks", "View", "kinds", "marked_by", "only", "unjudged", "unjudged_ranges", "view"]
NEIGHBOURS = (
    100  # points before the window that are looked at too: runs of points go on, and the one before may be excluded
)
REMEMBERING = (Chart.EWMA, Chart.MOVING_AVERAGE, Chart.CUSUM)


def kinds(baseline: Baseline) -> list[Chart]:
    """The charts that this baseline has limits for."""
    if baseline.quantity == Quantity.DIFFERENCES:
        return [Chart.INDIVIDUALS]
    second = {"individuals": Chart.MOVING_RANGE, "xbar_r": Chart.RANGES, "xbar_s": Chart.DEVIATIONS}
    return [queries.main_chart(baseline), second[baseline.chart], *REMEMBERING]


def view(
    session: Session,
    current: CurrentCharacteristic,
    baseline: Baseline,
    window: Window,
    kind: Chart | None = None,
    watched: Iterable[RuleName] | None = None,
) -> View:
    """This chart over the window; the main one if none is named. watched: rules; those that are switched on if left out.

    Raises `Invalid` for a chart that this baseline has no limits for.
    """
    kind = kind or queries.main_chart(baseline)
    if kind not in kinds(baseline):
        wrong = _("this baseline is judged by {charts}").format(charts=", ".join(kinds(baseline)))
        raise Invalid(
            _("The baseline in force has no limits for the chart {chart}.").format(chart=kind.value),
            _("Choose one of its charts, or freeze a baseline for this one."),
            errors=[FieldError("chart", wrong)],
        )
    view = _drawn(session, current, baseline, window, kind, watched)
    left_out = view.left_out and view.left_out.within(window.first, window.last)
    view = replace(view, left_out=left_out, given=baseline.given)
    if not window.narrowed:
        return view
    # What a point is depends neither on the period nor on the context; whether it is shown does.
    measured = statistics.history_of(session, current.characteristic, window, ())["sequence"]
    view = only(view, np.isin(view.last, measured))
    return replace(view, left_out=view.left_out and view.left_out.among(measured))


def _drawn(
    session: Session,
    current: CurrentCharacteristic,
    baseline: Baseline,
    window: Window,
    kind: Chart,
    watched: Iterable[RuleName] | None,
) -> View:
    if kind in REMEMBERING:
        return _remembering(session, current, baseline, window, kind)
    if kind is Chart.MOVING_RANGE:
        points = charted(session, current, baseline, replace(window, first=max(1, window.first - NEIGHBOURS)))
        return _moving_ranges(points, window)
    before = replace(window, first=max(1, window.first - NEIGHBOURS * (baseline.group_size or 1)))
    points = charted(session, current, baseline, before)
    if kind in (Chart.RANGES, Chart.DEVIATIONS):
        return since(replace(_within(points, kind), settling=_settling(points, window)), window.first)
    main = _view(points, kind, points.chart, np.ones(len(points), np.bool_))
    if points.chart is None:
        return main
    on = _switched_on(session, current) if watched is None else set(watched)
    chosen = [RULES[name] for name in queries.rules_of(baseline) if name in on]
    main = replace(
        main,
        settling=_settling(points, window),
        signals=rules.signals_of(points.chart, chosen, restarts(baseline, points.first)),
    )
    return since(main, window.first)


def _switched_on(session: Session, current: CurrentCharacteristic) -> set[RuleName]:
    """The rules that watch the main chart."""
    return set(rules_in_force(session, current.characteristic).rules.get(Place.MAIN, {}))


def _settling(points: Charted, window: Window) -> int:
    """Readings of the window that set the level of an edge."""
    if points.baseline.quantity != Quantity.WEAR_RESIDUALS:
        return 0
    read, judged = (
        int(((series.sequence >= window.first) & window.period.among(at)).sum())
        for series, at in ((points.read.series, points.read.measured_at), (points.series, points.series_at))
    )
    return read - judged


def marked_by(baseline: Baseline) -> Marks:
    """The period of the baseline with its name."""
    excluded = [(run["first"], run["last"]) for run in baseline.excluded]
    name = _("Baseline {version}").format(version=baseline.version)
    return Marks(baseline.first_sequence, baseline.last_sequence, name, excluded)


def unjudged(session: Session, current: CurrentCharacteristic, window: Window) -> View:
    """Deviations as they are, for a characteristic without a baseline."""
    plain = Baseline(quantity=Quantity.DEVIATION.value, excluded=[], first_sequence=1, last_sequence=0, factor=-1.0)
    readings = read(session, current, plain, window)
    return replace(of_series(readings.series, Quantity.DEVIATION), left_out=readings.left_out)


def unjudged_ranges(plain: View) -> View:
    """Moving ranges of readings as they are, without limits; none over a change of tool or of the reference."""
    neighbours = ~plain.begins[1:]
    ranges = shewhart.moving_ranges(shewhart.given(0.0, 1.0), plain.points).points if len(plain) > 1 else np.zeros(0)
    last, begins = plain.last[1:][neighbours], plain.begins[1:][neighbours]
    sizes = np.full(len(last), 2)
    return View(
        Chart.MOVING_RANGE, plain.quantity, last, last, sizes, ranges[neighbours], begins, left_out=plain.left_out
    )


def of_series(series: Series, which: Quantity) -> View:
    """A series as it is, without limits."""
    sizes = np.ones(len(series), np.int64)
    return View(Chart.INDIVIDUALS, which, series.sequence, series.sequence, sizes, series.values, series.begins)


def _view(points: Charted, kind: Chart, chart: ControlChart | None, kept: NDArray[np.bool_]) -> View:
    view = View(
        kind,
        Quantity(points.baseline.quantity),
        points.first[kept],
        points.last[kept],
        points.sizes[kept],
        np.zeros(0),
        points.begins[kept],
        waiting=points.waiting,
        settling=points.settling,
        left_out=points.read.left_out,
    )
    return view if chart is None else _judged(view, chart, points.baseline)


def _judged(view: View, chart: ControlChart, baseline: Baseline) -> View:
    """The view with the points and limits of its chart, and signals of the limits alone."""
    return replace(
        view,
        points=chart.points,
        centre=chart.centre,
        lower=chart.lower,
        upper=chart.upper,
        signals=rules.signals_of(chart, [RULES[RuleName.NELSON_1]], restarts(baseline, view.first)),
    )


def _neighbours(
    kind: Chart, points: Charted, series: Series, shown: NDArray[np.bool_], window: Window, readings: int = 1
) -> View:
    """Points that end at these readings of a series, before they are judged. readings: of each."""
    return View(
        kind,
        Quantity(points.baseline.quantity),
        *(series.sequence[shown],) * 2,
        np.full(int(shown.sum()), readings),
        np.zeros(0),
        series.begins[shown],
        settling=_settling(points, window),
        left_out=points.read.left_out,
    )


def _moving_ranges(points: Charted, window: Window) -> View:
    """Ranges of neighbours; none over a change of tool or of the reference, nor into the baseline's period, before which the
    process was another one. Lies where the second does.
    """
    before = points.series.sequence < window.first
    start = max(0, int(before.sum()) - 1)
    series = points.series.only(np.arange(len(points.series)) >= start)
    neighbours = ~series.begins
    for at in (0, np.searchsorted(series.sequence, points.baseline.first_sequence)):
        neighbours[at : at + 1] = False
    empty = _neighbours(Chart.MOVING_RANGE, points, series, neighbours, window, 2)
    if not neighbours.any():
        return empty
    whole = shewhart.moving_ranges(judged_by(points.baseline), series.values)
    chart = replace(whole, points=whole.points[neighbours[1:]], z=whole.z[neighbours[1:]])
    return _judged(empty, chart, points.baseline)


def _within(points: Charted, kind: Chart) -> View:
    """Ranges or standard deviations of the subgroups that have any: those of one reading have none."""
    if points.groups is None or not (points.sizes > 1).any():
        return _view(points, kind, None, np.zeros(len(points), np.bool_))
    some, all_ = points.sizes > 1, points.groups
    groups = Subgroups(all_.sizes[some], all_.means[some], all_.ranges[some], all_.deviations[some])
    judge = shewhart.ranges if kind is Chart.RANGES else shewhart.deviations
    return _view(points, kind, judge(judged_by(points.baseline), groups), some)


def _remembering(
    session: Session, current: CurrentCharacteristic, baseline: Baseline, window: Window, kind: Chart
) -> View:
    singly = _singly(baseline)
    begin = max(1, window.first - LOOK_BACK, min(window.first, _beginning(baseline, window.first)))
    points = charted(session, current, singly, replace(window, first=begin))
    series = points.series.only(points.series.sequence >= begin)  # what was read before set levels
    sequence, values = series.sequence, series.values
    pieces = [part for part in np.split(values, restarts(baseline, sequence)) if len(part)]
    inside = sequence >= window.first
    view = _neighbours(kind, points, series, inside, window)
    if not inside.any():
        return view
    if kind is Chart.CUSUM:
        return _sums(view, baseline, pieces, inside)
    charts = [_averaged(baseline, kind, part) for part in pieces]
    count = [len(part) for part in pieces]
    together: dict[str, Any] = {
        name: np.concatenate([np.broadcast_to(getattr(part, name), n) for part, n in zip(charts, count, strict=True)])[
            inside
        ]
        for name in ("points", "lower", "upper", "z")
    }
    return _judged(view, replace(charts[0], **together), baseline)


def _singly(baseline: Baseline) -> Baseline:
    """The same baseline for single values."""
    if baseline.grouping is None:
        return baseline
    names = {column.key for column in inspect(Baseline).column_attrs} - {"grouping", "chart"}
    return Baseline(**{name: getattr(baseline, name) for name in names}, grouping=None, chart="individuals")


def _beginning(baseline: Baseline, first: int) -> int:
    """First point that a chart with memory needs, for a window that begins there."""
    if first > baseline.last_sequence:
        return baseline.last_sequence + 1
    return min(baseline.first_sequence, first)


def _averaged(baseline: Baseline, kind: Chart, values: Floats) -> ControlChart:
    if kind is Chart.EWMA:
        judge = judged_by(baseline, baseline.ewma_width)
        return ewma.ewma(judge, values, baseline.ewma_lambda, exact=baseline.ewma_exact)
    return ewma.moving_average(judged_by(baseline), values, baseline.average_span)


def _sums(view: View, baseline: Baseline, pieces: list[Floats], shown: NDArray[np.bool_]) -> View:
    charts = [
        cusum.cusum(judged_by(baseline), part, baseline.cusum_k, baseline.cusum_h, headstart=baseline.cusum_headstart)
        for part in pieces
    ]
    above, below, since_above, since_below = (
        np.concatenate([getattr(part, name) for part in charts])[shown]
        for name in ("above", "below", "since_above", "since_below")
    )
    together = replace(charts[0], above=above, below=below, since_above=since_above, since_below=since_below)
    return replace(
        view,
        points=together.above,
        below=-together.below,
        centre=0.0,
        lower=-together.limit,
        upper=together.limit,
        signals=rules.signals_of_cusum(together, restarts(baseline, view.first)),
    )
