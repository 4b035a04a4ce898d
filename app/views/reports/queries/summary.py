"""The first page: verdict, index with its interval, zone chart, histogram, and places for signatures."""

from functools import partial

from app.core.spc.refusal import Refused
from app.files.documents.content import Column, Fact, Picture, Section, Table, count, deviation, number, width, words
from app.language.i18n import _
from app.quality.baselines import queries as controls
from app.quality.capability import wording
from app.quality.capability.chart import drawn
from app.quality.capability.figures import histogram, small
from app.quality.capability.queries import Study
from app.views.reports.queries.capability import verdict
from app.views.reports.queries.charts import zones
from app.views.reports.queries.frame import Frame

ZONES, HISTOGRAM = (940, 440), (400, 270)


def summary(frame: Frame) -> Section:
    """The page that is handed over and signed; everything else is an appendix to it."""
    signatures = (_("Made by, date"), _("Checked by, date"), _("Released by, date"))
    title = _("Summary")
    if not frame.window.count:
        return Section(
            "summary", title, warnings=(_("No readings were measured in this period."),), signatures=signatures
        )
    study = frame.study
    _content, chart = zones(frame, *ZONES)
    spread = Picture(
        "spread",
        _("Histogram"),
        _("Histogram of the deviations with limits and fitted distribution."),
        small(histogram(drawn(study))),
        *HISTOGRAM,
        partial(_values, study),
    )
    return Section(
        "summary",
        title,
        sentences=(verdict(study), _("Of {window}.").format(window=wording.window_of(study))),
        facts=tuple(_facts(frame, study)),
        pictures=(spread, chart),
        signatures=signatures,
    )


def _facts(frame: Frame, study: Study) -> list[Fact]:
    quoting = study.quoting
    low, high = (
        None if quoting.low is None else number(quoting.low),
        None if quoting.high is None else number(quoting.high),
    )
    word, _tone = wording.verdict(study.quoted)
    control = {True: _("yes"), False: _("no"), None: _("not judged")}[study.in_control]
    baseline = controls.baseline_in_force(frame.session, frame.current.characteristic)
    facts = [
        Fact("verdict", _("Verdict"), words(word)),
        Fact("index", wording.index_name(study.quote), number(study.quoted), low=low, high=high),
        Fact("readings", _("Readings"), count(len(study.values))),
        Fact("outside", _("Out of tolerance"), count(study.outside)),
    ]
    if not isinstance(study.indices, Refused):
        facts += [
            Fact("mean", _("Mean deviation"), deviation(study.indices.mean, 2)),
            Fact("sigma_overall", _("Sigma overall"), width(study.indices.overall.value, 3)),
        ]
    return [
        *facts,
        Fact("in_control", _("In control, by run rules"), words(control)),
        Fact("baseline", _("Baseline, version"), count(None if baseline is None else baseline.version)),
    ]


def _values(study: Study) -> Table:
    """The readings that the histogram is of."""
    columns = (Column("reading", _("Reading")), Column("deviation", _("Deviation")))
    rows = zip(study.sequence.tolist(), study.values.tolist(), strict=True)
    return Table(columns, tuple((count(sequence), deviation(value, 2)) for sequence, value in rows))
