"""The charts of the pages, for the period of the report."""

from functools import partial

from app.characteristics.chart import Chart, chart_of
from app.characteristics.figures import zone_chart
from app.paper.content import Column, Picture, Section, Table, count, deviation, moment, words
from app.reports.queries.frame import Frame
from app.web.i18n import _
from app.web.theme import zone_name

WIDE = (940, 560)


def chart(frame: Frame) -> Section | None:
    """The zone chart; nothing where there are no readings."""
    if not frame.window.count:
        return None
    found = chart_of(frame.session, frame.standing, frame.window)
    figure = zone_chart(
        found.points,
        frame.parameters,
        blocks=found.blocks,
        steps=found.steps,
        marks=found.marks,
        hands=found.hands,
        centre=found.centre,
        total_before=found.total_before,
        width=WIDE[0],
        ringed=None,
    )
    says = _("Zone chart of readings {first} to {last}: running average, corrections, tool changes, alarms.").format(
        first=frame.window.first, last=frame.window.last
    )
    sentences = [_("Judged by the limits in force now; every band is equally tall, linear inside.")]
    if found.blocks:
        sentences.append(_("Of so many readings blocks are drawn with their extremes; none is thinned away."))
    picture = Picture("zones", _("Zone chart"), says, figure, *WIDE, partial(_data, found))
    return Section("chart", _("Zone chart"), sentences=tuple(sentences), pictures=(picture,))


def _data(found: Chart) -> Table:
    """What is drawn, in numbers: readings one by one, and blocks of them by their middle."""
    columns = (
        Column("reading", _("Reading")),
        Column("deviation", _("Deviation")),
        Column("average", _("Average M")),
        Column("smallest", _("Smallest in the block")),
        Column("largest", _("Largest in the block")),
        Column("measured_at", _("Measured at")),
        Column("zone", _("Zone")),
        Column("excluded", _("Excluded")),
    )
    blocks = [
        (
            count(round(block.middle)),
            deviation(block.mean, 2),
            deviation(block.average, 2),
            deviation(block.minimum, 2),
            deviation(block.maximum, 2),
            moment(None),
            words(""),
            words(""),
        )
        for block in found.blocks
    ]
    points = [
        (
            count(point.sequence),
            deviation(point.deviation, 2),
            deviation(point.average, 2),
            deviation(None),
            deviation(None),
            moment(point.at),
            words(zone_name(point.zone)),
            words(_("yes") if point.excluded else ""),
        )
        for point in found.points
    ]
    return Table(columns, (*blocks, *points))
