"""The numbers of the readings, and how they are spread."""

from collections.abc import Sequence
from functools import partial

from app.core.decision.limits import FAULT, Zone
from app.files.documents.content import Column, Fact, Picture, Section, Table, count, deviation
from app.language.i18n import _, ngettext
from app.loop.summaries import queries as statistics
from app.loop.summaries import wording as statistics_wording
from app.views.characteristic.figures import histogram_centres, histogram_counts, histogram_figure
from app.views.reports.queries.frame import Frame
from app.web.theme import zone_name

HISTOGRAM = (380, 400)


def numbers(frame: Frame) -> Section:
    """Count, mean, standard deviation, extremes, zones, with the histogram."""
    figures = frame.numbers
    rejects = None
    if frame.parameters.accept_m > 1:
        rejects = statistics.rejects_of(frame.session, frame.current.characteristic, frame.window)
    facts = statistics_wording.facts(figures, rejects)
    facts += [
        Fact(
            f"zone_{zone.value}",
            _("Decided in zone {zone}").format(zone=zone_name(zone.value)),
            count(figures.zones[zone.value]),
        )
        for zone in Zone
    ]
    warnings = []
    if not figures.count:
        warnings.append(
            _("No readings were measured in this period: choose a longer one, or a number of last readings.")
        )
    elif figures.measured == 1:
        warnings.append(_("A standard deviation needs at least two readings."))
    if faults := figures.probe_faults:
        warnings.append(
            ngettext(
                "%(num)d of these readings is a probe fault, which measures no part: it is left out of mean, spread, extremes and share.",
                "%(num)d of these readings are probe faults, which measure no part: they are left out of mean, spread, extremes and share.",
                faults,
            )
            % {"num": faults}
        )
    tolerances = {
        (version.parameters["tolerance_width"], version.parameters.get("natural_limit", "none"))
        for version in frame.versions_used
    }
    if len(tolerances) > 1:
        warnings.append(
            _(
                "The tolerance was changed within the period: each part is judged by the one in force when it was measured."
            )
        )
    pictures: tuple[Picture, ...] = ()
    if figures.count:
        deviations = frame.history["deviation"][frame.history["zone"] != FAULT]
        counts = histogram_counts(deviations, frame.parameters)
        figure = histogram_figure(counts, frame.parameters)
        says = _("Histogram of {n} deviations, with tolerance, R34 and R33.").format(n=sum(counts))
        data = partial(_bars, histogram_centres(frame.parameters), counts)
        pictures = (Picture("histogram", _("Histogram"), says, figure, *HISTOGRAM, data),)
    return Section("numbers", _("Numbers"), warnings=tuple(warnings), facts=tuple(facts), pictures=pictures)


def _bars(centres: Sequence[float], counts: Sequence[int]) -> Table:
    """The bars as they are drawn: deviation in the middle of each, and how many."""
    columns = (Column("deviation", _("Deviation")), Column("readings", _("Readings")))
    rows = zip(centres, counts, strict=True)
    return Table(columns, tuple((deviation(centre / 1000, 2), count(many)) for centre, many in rows))
