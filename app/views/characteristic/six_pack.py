"""Page: six pictures of one characteristic on one screen and one sheet of paper, as a capability study is handed over."""

from dataclasses import replace
from datetime import UTC, datetime
from typing import Any, Literal, NamedTuple

import numpy as np
from fastapi import APIRouter, Request, Response
from markupsafe import Markup
from sqlalchemy.orm import Session

from app.access.deps import require
from app.charts import (
    Axis,
    Chart,
    Dots,
    Mark,
    Note,
    Panel,
    Pen,
    Room,
    Rule,
    Series,
    Share,
    nothing,
    reading_axis,
    svg,
    to_drawing,
)
from app.core.spc.quantity import Quantity
from app.core.spc.refusal import Refused
from app.language.formatting import signed
from app.language.i18n import _
from app.loop.characteristics import queries as characteristics
from app.loop.characteristics.queries import CurrentCharacteristic
from app.quality.baselines import queries as controls
from app.quality.baselines import wording as control_wording
from app.quality.capability import figures, wording
from app.quality.capability.chart import drawn
from app.quality.capability.pictures import interval
from app.quality.capability.queries import USUAL, Study
from app.quality.capability.request import StudyRequest, study_of
from app.quality.control_charts import charts
from app.quality.control_charts.figures import control_figure
from app.quality.proof import queries as proof
from app.quality.proof import wording as proof_wording
from app.web.choice import ChosenOnPage
from app.web.deps import FROM_REPLICA, SessionDep
from app.web.paging import address
from app.web.templates import page

router = APIRouter(include_in_schema=False, dependencies=[FROM_REPLICA, require("viewer")])

NEWEST = 25  # readings drawn one by one
TOO_FAR = 3.0  # times as far as the limits: drawn at the edge
WIDE, HIGH = 430, 262  # pixels of one picture; the page makes it as large as there is room
RUNS = ("125", "500", "1000", "5000", "all")


class Sixth(NamedTuple):
    """One of the pictures. says: it in words; href: the page that it is from."""

    title: str
    says: str
    href: str
    chart: Chart

    def picture(self, number: int) -> Markup:
        """The chart as it is printed; number: its own on the page."""
        return Markup(svg(to_drawing(self.chart, WIDE, HIGH), self.says, f"six-{number}"))  # noqa: S704 - svg() escapes


@router.get("/characteristics/{characteristic}/six-pack")
def six_pack_page(request: Request, session: SessionDep, characteristic: str, choice: ChosenOnPage) -> Response:
    """Control chart, moving range, last readings, histogram, probability plot, and the indices with their verdict."""
    current = characteristics.characteristic_named(session, characteristic)
    path = f"/characteristics/{current.characteristic.key}"
    asked = choice.query if request.query_params.keys() & {"last", "from", "to"} else {"last": str(USUAL)}
    last = None if choice.period.bounded else str(asked.get("last", "all"))
    study = study_of(session, current, StudyRequest(last, choice.period, "both", 0.95, context=choice.context))
    baseline = controls.baseline_in_force(session, current.characteristic)
    failing = proof.failing()

    def link(**changes: Any) -> str:
        return address(f"{path}/six-pack", **changes)

    return page(
        request,
        "characteristics/six_pack.html",
        characteristic=current.characteristic,
        machine=current.machine,
        parameters=current.parameters,
        study=study,
        baseline=baseline,
        sixths=sixths(session, current, study),
        rows=rows_of(study),
        interval=interval,
        wording=wording,
        choice=choice,
        link=link,
        runs=[(_("All") if run == "all" else run, link(last=run), run == last) for run in RUNS],
        now=datetime.now(UTC),
        proof_failing=failing,
        proof_warning=proof_wording.warning(len(failing)),
    )


def sixths(session: Session, current: CurrentCharacteristic, study: Study) -> list[Sixth]:
    """The five pictures that are charts, in the order in which they are read; the sixth is the table of indices."""
    key = current.characteristic.key
    control, capability = f"/characteristics/{key}/control", f"/characteristics/{key}/capability"
    made = [
        Sixth(
            name,
            name,
            control,
            replace(chart, room=Room(62, 78 if has_limits else 14, 40, 14)),
        )
        for name, chart, has_limits in _control(session, current, study)
    ]
    shape = drawn(study)
    spread, line = figures.histogram(shape), figures.probability(shape)
    return [
        *made,
        Sixth(
            _("Last %(n)s readings") % {"n": min(NEWEST, len(study.values))},
            _("The last readings between the limits of the tolerance"),
            f"/characteristics/{key}",
            last_readings(study),
        ),
        Sixth(_("Histogram"), _("Histogram of the deviations with limits"), capability, figures.small(spread)),
        Sixth(_("Normal probability plot"), _("Normal readings lie on the line"), capability, figures.small(line)),
    ]


def _control(session: Session, current: CurrentCharacteristic, study: Study) -> list[tuple[str, Chart, bool]]:
    """The pair of charts by the frozen baseline, and whether each has limits; without one the readings as they are."""
    baseline = controls.baseline_in_force(session, current.characteristic)
    if baseline is None:
        plain = charts.unjudged(session, current, study.window)
        named = [(_("Deviations, no baseline"), plain), (_("Moving range, no baseline"), charts.unjudged_ranges(plain))]
    else:
        kinds = [kind for kind in charts.kinds(baseline) if kind not in charts.REMEMBERING]
        views = [charts.view(session, current, baseline, study.window, kind) for kind in kinds]
        if baseline.quantity == Quantity.DIFFERENCES:
            views.append(charts.unjudged_ranges(views[0]))
        named = [(control_wording.chart_name(view.kind), view) for view in views]
    key = current.characteristic.key
    return [
        (name, control_figure(view, key=key, width=620, inner=WIDE - 140), view.centre is not None)
        for name, view in named
    ]


def last_readings(study: Study) -> Chart:
    """The newest readings one by one, those out of tolerance marked, between the limits that are judged."""
    values, numbers = study.values[-NEWEST:] * 1000, study.sequence[-NEWEST:]
    if not len(values):
        return nothing(_("No readings here"))
    limits = [limit * 1000 for limit in (study.limits.lower, study.limits.upper) if limit is not None]
    inside = [all((value >= limit) if limit < 0 else (value <= limit) for limit in limits) for value in values]
    near, furthest = TOO_FAR * max(map(abs, limits)), max(values, key=abs)
    low, high = (pick(*limits, 0.0, *(value for value in values if abs(value) <= near)) for pick in (min, max))
    edge = 0.06 * (high - low) or 1.0
    shown = np.clip(values, low - edge / 2, high + edge / 2)
    marks: list[Mark] = [
        Rule(Pen("quiet", 1, "4px,4px"), y=0.0, words=_("target")),
        *(Rule(Pen("ink", 2), y=limit, words=_("lower limit") if limit < 0 else _("upper limit")) for limit in limits),
        Series(
            numbers.tolist(),
            shown.round(4).tolist(),
            Pen("faint", 1.2),
            Dots(
                size=7,
                colour=["steady" if held else "attention" for held in inside],
                symbol=["circle" if held else "square" for held in inside],
            ),
        ),
    ]
    if abs(furthest) > near:  # it would press the limits into one line; its dot is at the edge, with its value
        at = int(numbers[np.abs(values).argmax()])
        over = furthest > 0
        place = Share(1 if over else 0)
        side: Literal["top", "bottom"] = "bottom" if over else "top"
        marks.append(Note(f"{signed(furthest, 0)} µm", at, place, "right", side, (-8, 0), colour="attention"))
    height = Axis(_("Deviation, µm"), reach=(low - edge, high + edge), format="+.4~g", ticks=7)
    ends = (float(numbers[0]) - 0.5, float(numbers[-1]) + 0.5)
    return Chart([Panel(marks, height)], reading_axis(ends, 400), Room(62, 78, 40, 14))


class IndexRow(NamedTuple):
    """An index of the table. allowed: it may be reported."""

    name: str
    index: Any
    allowed: bool


def rows_of(study: Study) -> list[IndexRow]:
    """The indices there are, with the one that may be reported first among those that may not."""
    found = study.indices
    if isinstance(found, Refused):
        return []
    potential, overall = study.quote == "cpk", study.quote in {"cpk", "ppk"}
    rows = [
        IndexRow("Cp", found.cp, potential),
        IndexRow("Cpk", found.cpk, potential),
        IndexRow("Pp", found.pp, overall),
        IndexRow("Ppk", found.ppk, overall),
    ]
    if study.by_fit is not None and not isinstance(study.by_fit, Refused):
        rows.append(IndexRow(wording.index_name("fitted"), study.by_fit.ppk, study.quote == "fitted"))
    if not isinstance(study.by_percentile, Refused):
        rows.append(IndexRow(wording.index_name("percentile"), study.by_percentile.ppk, study.quote == "percentile"))
    return [row for row in rows if row.index is not None]
