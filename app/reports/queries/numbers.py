"""The numbers of the readings, and how they are spread."""

from functools import partial
from typing import Any

import numpy as np

from app.characteristics.figures import histogram_edges, histogram_figure
from app.core.zones import HasLimits, Zone
from app.paper.content import Column, Fact, Picture, Section, Table, count, deviation, share, width
from app.reports.queries.frame import Frame
from app.statistics import queries as statistics
from app.web.i18n import _, ngettext
from app.web.theme import zone_name

HISTOGRAM = (380, 400)
FAULT = list(Zone).index(Zone.PROBE_FAULT)


def numbers(frame: Frame) -> Section:
    """Count, mean, standard deviation, extremes, zones, with the histogram."""
    found = frame.numbers
    facts = [
        Fact("count", _("Readings"), count(found.count)),
        Fact("excluded", _("Excluded"), count(found.excluded)),
        Fact("probe_faults", _("Probe faults"), count(found.probe_faults)),
        Fact("mean", _("Mean deviation"), deviation(found.mean, 2)),
        Fact("standard_deviation", _("Standard deviation"), width(found.standard_deviation)),
        Fact("minimum", _("Smallest deviation"), deviation(found.minimum)),
        Fact("maximum", _("Largest deviation"), deviation(found.maximum)),
        Fact("in_tolerance", _("In tolerance"), count(found.in_tolerance)),
        Fact("share_in_tolerance", _("Share in tolerance"), share(found.share_in_tolerance)),
        Fact("outside", _("Out of tolerance"), count(found.outside)),
        Fact("corrections", _("Readings that led to a correction"), count(found.corrections)),
    ]
    if frame.parameters.accept_m > 1:
        rejects = statistics.rejects_of(frame.session, frame.standing.characteristic, frame.window)
        facts += [
            Fact("rejected", _("Parts rejected"), count(rejects.parts)),
            Fact("sections_outside", _("Sections outside"), count(rejects.sections), "#513"),
        ]
    facts += [
        Fact(
            f"zone_{zone.value}",
            _("Decided in zone {zone}").format(zone=zone_name(zone.value)),
            count(found.zones[zone.value]),
        )
        for zone in Zone
    ]
    warnings = []
    if not found.count:
        warnings.append(
            _("No readings were measured in this period: choose a longer one, or the last so many readings.")
        )
    elif found.measured == 1:
        warnings.append(_("One reading has no spread: a standard deviation takes two."))
    if faults := found.probe_faults:
        warnings.append(
            ngettext(
                "%(num)d of these readings is a probe fault, which measures no part: it is left out of mean, spread, extremes and share.",
                "%(num)d of these readings are probe faults, which measure no part: they are left out of mean, spread, extremes and share.",
                faults,
            )
            % {"num": faults}
        )
    tolerances = {version.parameters["tolerance_width"] for version in frame.versions_used}
    if len(tolerances) > 1:
        warnings.append(
            _(
                "The tolerance was changed within the period: each part is judged by the one in force when it was measured."
            )
        )
    pictures: tuple[Picture, ...] = ()
    if found.count:
        counts = counts_of(frame)
        figure = histogram_figure(counts, frame.parameters)
        says = _("Histogram of {n} deviations, with tolerance, R34 and R33.").format(n=sum(counts))
        data = partial(_bars, figure["data"][0])
        pictures = (Picture("histogram", _("Histogram"), says, figure, *HISTOGRAM, data),)
    return Section("numbers", _("Numbers"), warnings=tuple(warnings), facts=tuple(facts), pictures=pictures)


def _bars(drawn: dict[str, Any]) -> Table:
    """The bars as they are drawn: deviation in the middle of each, and how many."""
    columns = (Column("deviation", _("Deviation")), Column("readings", _("Readings")))
    rows = zip(drawn["y"], drawn["x"], strict=True)
    return Table(columns, tuple((deviation(centre / 1000, 2), count(many)) for centre, many in rows))


def counts_of(frame: Frame) -> list[int]:
    """How many deviations of the period fall into each bar of the histogram, counted as the page counts them."""
    limits: HasLimits = frame.parameters
    half = limits.tolerance_width / 2
    values = frame.history["deviation"][frame.history["zone"] != FAULT]
    values = np.where(np.abs(values - half) < 5e-7, values - 1e-9, values)
    edges = np.array(histogram_edges(limits))
    bars = np.bincount(np.searchsorted(edges, values, side="right"), minlength=len(edges) + 1)
    return [int(bar) for bar in bars]
