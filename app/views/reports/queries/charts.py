"""The charts of the pages, for the period of the report."""

from functools import partial

from app.files.documents.content import Column, Picture, Section, Table, count, deviation, moment, words
from app.language.i18n import _
from app.views.characteristic.chart import Chart, chart_of
from app.views.characteristic.figures import zone_chart
from app.views.reports.queries.frame import Frame
from app.web.theme import zone_name

WIDE = (940, 560)


def chart(frame: Frame) -> Section | None:
    """The zone chart; nothing where there are no readings."""
    if not frame.window.count:
        return None
    content, picture = zones(frame, *WIDE)
    sentences = [_("Judged by the limits in force now; every band is equally tall, linear inside.")]
    if content.blocks:
        sentences.append(_("This many readings are drawn as blocks with their extremes; no extreme is left out."))
    return Section("chart", _("Zone chart"), sentences=tuple(sentences), pictures=(picture,))


def zones(frame: Frame, width: int, height: int) -> tuple[Chart, Picture]:
    """The zone chart of the readings, N pixels wide and high."""
    content = chart_of(frame.session, frame.current, frame.window)
    figure = zone_chart(
        content.points,
        frame.parameters,
        blocks=content.blocks,
        steps=content.steps,
        events=content.events,
        hands=content.hands,
        sizes=content.sizes,
        total_before=content.total_before,
        width=width,
        ringed=None,
        left_out=content.left_out,
    )
    says = _("Zone chart of readings {first} to {last}: running average, corrections, tool changes, alarms.").format(
        first=frame.window.first, last=frame.window.last
    )
    return content, Picture("zones", _("Zone chart"), says, figure, width, height, partial(_data, content))


def _data(content: Chart) -> Table:
    """Data of a chart in numbers: readings one by one, and blocks of them by their middle."""
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
        for block in content.blocks
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
        for point in content.points
    ]
    return Table(columns, (*blocks, *points))
