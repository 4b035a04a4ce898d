"""The words of charts of counts."""

from app.core.spc.counts import CountChart, Counts
from app.core.spc.refusal import Reason, Refused
from app.language.i18n import _, ngettext
from app.loop.summaries import wording as statistics


def name(chart: CountChart) -> str:
    """The name of a chart."""
    return {
        CountChart.P: _("p: share of rejected parts"),
        CountChart.NP: _("np: rejected parts"),
        CountChart.C: _("c: nonconformities"),
        CountChart.U: _("u: nonconformities per unit"),
        CountChart.P_PRIME: _("p′: share of rejected parts (Laney)"),
        CountChart.U_PRIME: _("u′: nonconformities per unit (Laney)"),
    }[chart]


def refusal(refused: Refused, chart: CountChart) -> tuple[str, str, str]:
    """The field that is wrong, what is wrong, and what to do."""
    match refused.reason:
        case Reason.BEYOND_RANGE:
            wrong = _("More parts were rejected than were inspected, or a number is not above 0.")
            return "counts", wrong, _("Correct the sample, or choose u: a part may have several nonconformities.")
        case Reason.INCOMPLETE_STUDY:
            other = "p" if chart is CountChart.NP else "u"
            wrong = _("The samples are not of one size.")
            return "inspected", wrong, _("Choose {chart}, which takes samples of any size.").format(chart=other)
        case Reason.NO_VARIATION:
            wrong = _("Nothing was counted, or everything, or every sample is like the one before: no limits follow.")
            return "counts", wrong, _("Send more samples, or give the centre.")
        case _:
            return "counts", statistics.refusal(refused), _("Send more samples.")


def advice(found: Counts) -> list[str]:
    """Advice to be known before the chart is read."""
    sentences = []
    outside = int(found.outside.sum())
    if outside:
        text = ngettext("%(num)d sample lies beyond a limit.", "%(num)d samples lie beyond a limit.", outside)
        sentences.append(text % {"num": outside})
    if found.provisional:
        sentences.append(_("Fewer than 20 samples: the limits are provisional."))
    if found.overdispersed and found.chart in {CountChart.P, CountChart.U, CountChart.NP, CountChart.C}:
        other = "p′" if found.chart.parts else "u′"
        sentences.append(
            _("The points scatter {times} times as much as chance explains: take Laney's chart {chart}.").format(
                times=f"{found.sigma_z:.1f}", chart=other
            )
        )
    return sentences


def numbers(found: Counts) -> str:
    """Centre and limits of the newest sample, and sigma z."""
    parts = found.chart in {CountChart.P, CountChart.P_PRIME}

    def written(value: float) -> str:
        return f"{value * 100:.2f} %" if parts else f"{value:.3g}" if value < 100 else f"{value:.1f}"

    return _("Centre {centre}, limits of the newest sample {lower} to {upper}; sigma z {sigma_z}.").format(
        centre=written(float(found.centre[-1])),
        lower=written(float(found.lower[-1])),
        upper=written(float(found.upper[-1])),
        sigma_z=f"{found.sigma_z:.2f}",
    )
