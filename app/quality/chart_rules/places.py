"""Charts of a baseline that can be watched, by their place, and the rules that make sense on each. No input or output of its own."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.core.spc import quantity, shewhart
from app.core.spc.points import ChartSettings, Piece
from app.core.spc.quantity import Quantity
from app.core.spc.rules import FITTING, RuleName
from app.core.spc.shewhart import Chart
from app.core.spc.spread import Subgroups
from app.quality.baselines.queries import Baseline, Charted, judged_by, main_chart


class Place(StrEnum):
    """The charts of a characteristic; which kind the first two are, its baseline says."""

    MAIN = "main"  # individuals, or subgroup means
    SCATTER = "scatter"  # moving range, or R, or s
    EWMA = "ewma"
    MOVING_AVERAGE = "moving_average"
    CUSUM = "cusum"

    @property
    def remembers(self) -> bool:
        """True if its points are made of all readings before them; such charts take single values, of subgroups too."""
        return self not in {Place.MAIN, Place.SCATTER}


class Do(StrEnum):
    """Action on a signal: keep it, or raise an alarm too."""

    WATCH = "watch"
    ALARM = "alarm"


@dataclass(frozen=True, slots=True)
class Setting:
    """A rule that is switched on.

    It begins after the reading `since` (0: with the baseline), and never before its baseline came into force; unless a person
    has asked for what lies between the period of the baseline `back` and now.
    """

    do: Do
    since: int = 0
    back: int | None = None

    def after(self, baseline: Baseline, begun: int) -> int:
        """The reading after which it judges by this baseline; begun: the last one before that came into force."""
        return baseline.last_sequence if self.back == baseline.version else max(self.since, begun)


Rules = dict[Place, dict[RuleName, Setting]]

DEFAULT: Rules = {Place.MAIN: {RuleName.NELSON_1: Setting(Do.WATCH)}}
"""Until it is set otherwise, points beyond the limits are kept as signals: by chance one in 370. Nothing raises an alarm."""


@dataclass(frozen=True, slots=True)
class Watched:
    """The rules in force. version 0: the default, which is not set."""

    rules: Rules
    version: int = 0
    at: datetime | None = None
    actor: str | None = None
    reason: str | None = None

    def each(self) -> Iterator[tuple[Place, RuleName, Setting]]:
        """Every rule that is on."""
        for place, rules in self.rules.items():
            for name, setting in rules.items():
                yield place, name, setting


def read_rules(stored: Mapping[str, Any]) -> Rules:
    """Rules as they are stored.

    >>> read_rules({"ewma": {"nelson_1": {"do": "alarm", "since": 812}}})[Place.EWMA][RuleName.NELSON_1].since
    812
    """
    return {
        Place(place): {
            RuleName(name): Setting(Do(setting["do"]), setting["since"], setting.get("back"))
            for name, setting in rules.items()
        }
        for place, rules in stored.items()
        if rules
    }


def stored_rules(rules: Rules) -> dict[str, Any]:
    """The same the other way round, in the order of the charts and rules."""
    return {
        place.value: {
            name.value: {"do": setting.do.value, "since": setting.since, "back": setting.back}
            for name in RuleName
            if (setting := rules[place].get(name)) is not None
        }
        for place in Place
        if rules.get(place)
    }


def chart_at(baseline: Baseline | None, place: Place) -> Chart:
    """The chart at this place; of single values while there is no baseline."""
    kind = "individuals" if baseline is None else baseline.chart
    if place is Place.MAIN:
        return Chart.INDIVIDUALS if baseline is None else main_chart(baseline)
    if place is Place.SCATTER:
        return {"individuals": Chart.MOVING_RANGE, "xbar_r": Chart.RANGES, "xbar_s": Chart.DEVIATIONS}[kind]
    return {Place.EWMA: Chart.EWMA, Place.MOVING_AVERAGE: Chart.MOVING_AVERAGE, Place.CUSUM: Chart.CUSUM}[place]


def rules_at(baseline: Baseline | None, place: Place) -> tuple[RuleName, ...]:
    """The rules that have a sense there; none where the chart itself has none."""
    chart = chart_at(baseline, place)
    return FITTING[chart] if baseline is None else quantity.fitting(Quantity(baseline.quantity), chart)


def settings_at(baseline: Baseline, place: Place) -> ChartSettings:
    """The chart at this place as its baseline has frozen it."""
    return ChartSettings(
        chart_at(baseline, place),
        width=baseline.ewma_width if place is Place.EWMA else 3.0,
        weight=baseline.ewma_lambda,
        exact=baseline.ewma_exact,
        span=baseline.average_span,
        reference=baseline.cusum_k,
        limit=baseline.cusum_h,
        headstart=baseline.cusum_headstart,
    )


def size_of(baseline: Baseline) -> int:
    """Readings in a subgroup: as set, or as many as the baseline's own had on average."""
    if baseline.grouping is None:
        return 1
    if baseline.group_size is not None:
        return baseline.group_size
    return max(2, round(baseline.readings / max(1, baseline.groups)))


def piece_at(charted: Charted, place: Place, after: int) -> Piece | None:
    """Points for the chart at this place, as z, whose last reading comes after this one; None where there is none."""
    if place.remembers:
        judge, series = judged_by(charted.baseline), charted.series
        z = (series.values - judge.centre) / judge.sigma.value
        return _after(Piece([z], series.sequence, series.sequence, series.begins), after)
    if charted.chart is None:
        return None
    piece = Piece([charted.chart.z], charted.first, charted.last, charted.begins)
    if place is Place.SCATTER and charted.groups is not None:
        scattering = charted.groups.sizes > 1  # what was excluded may have left one reading, which has no range
        if not scattering.any():
            return None
        piece, groups = piece.only(scattering), _only(charted.groups, scattering)
        factory = shewhart.ranges if chart_at(charted.baseline, place) is Chart.RANGES else shewhart.deviations
        piece = piece._replace(rows=[factory(judged_by(charted.baseline), groups).z])
    return _after(piece, after)


def _after(piece: Piece, reading: int) -> Piece | None:
    later = piece.last > reading
    return piece.only(later) if later.any() else None


def _only(groups: Subgroups, wanted: NDArray[np.bool_]) -> Subgroups:
    return Subgroups(groups.sizes[wanted], groups.means[wanted], groups.ranges[wanted], groups.deviations[wanted])
