"""Capability as its page judges it: indices with intervals, what may be quoted, or why there is no number."""

from app.core.spc.capability import Index
from app.core.spc.fitting import Fitted
from app.core.spc.refusal import Refused
from app.files.documents.content import Fact, Section, count, deviation, number, probability, width, words
from app.language.i18n import _
from app.loop.summaries import wording as statistics
from app.quality.capability import fit_wording as fits
from app.quality.capability import machine_wording, wording
from app.quality.capability.machine_queries import newest_run
from app.quality.capability.queries import Study
from app.views.reports.queries.frame import Frame

FEW = 100  # of a million: more than these are reported without decimals


def capability(frame: Frame) -> Section:
    """Cp, Cpk, Pp, Ppk and Cpm with intervals; of a corrected process also of the tool without corrections."""
    study = frame.study
    title = _("Capability")
    if isinstance(study.indices, Refused):
        why = _("No capability: {why}").format(why=statistics.refusal(study.indices))
        return Section("capability", title, warnings=(why,))
    sentences = [
        verdict(study),
        _("Of {window}.").format(window=wording.window_of(study)),
        machine_wording.tolerance(study.tolerance),
        wording.stability(study.stability, study.baseline),
    ]
    if not isinstance(study.in_time, Refused):
        model = study.in_time.model
        sentence = _("Time-dependent model {model} (ISO 22514-2): {words} {means}")
        sentences.append(
            sentence.format(model=model.value, words=wording.model(study.in_time), means=wording.model_means(study))
        )
    return Section(
        "capability",
        title,
        sentences=tuple(sentences),
        warnings=tuple(wording.cautions(study)),
        facts=(*_indices(study), *_machine(frame, study), *_spread(study), *_without(study)),
    )


def verdict(study: Study) -> str:
    """The index to report, with the word for it; or why none is."""
    if study.quote == "none":
        return _("Do not report an index: {why}.").format(why=wording.why_not(study.quoting.why))
    word, _tone = wording.verdict(study.quoted)
    return _("{verdict}: report {index} = {value}. Intervals hold with {confidence} confidence.").format(
        verdict=word,
        index=wording.index_name(study.quote),
        value=wording.index(study.quoted),
        confidence=f"{study.confidence * 100:g}\N{NO-BREAK SPACE}%",
    )


def _indices(study: Study) -> list[Fact]:
    indices = study.indices
    assert not isinstance(indices, Refused)
    named = (("cp", "Cp", indices.cp), ("cpk", "Cpk", indices.cpk), ("pp", "Pp", indices.pp), ("ppk", "Ppk", indices.ppk), ("cpm", "Cpm", indices.cpm))  # fmt: skip
    potential, overall = study.quote == "cpk", study.quote in {"cpk", "ppk"}
    quotable = {"cp": potential, "cpk": potential, "pp": overall, "ppk": overall}
    facts = [
        _index(key, name, index, quotable=quotable.get(key, True)) for key, name, index in named if index is not None
    ]
    if isinstance(study.by_fit, Fitted):
        fit = study.by_fit.fit
        facts += [
            _index("ppk_fitted", _("Ppk by fit"), study.by_fit.ppk, quotable=study.quote == "fitted"),
            Fact("distribution", _("Fitted distribution"), words(fits.name(fit.family)), note=fits.parameters(fit)),
            Fact("distribution_fit", _("Anderson-Darling A² of the fit"), number(fit.statistic, 3)),
            Fact("distribution_fit_p", _("p of the fit"), probability(fit.p_value)),
        ]
    by_percentile = study.by_percentile
    if not isinstance(by_percentile, Refused):
        index, name = by_percentile.ppk, _("Ppk by percentiles")
        facts.append(_index("ppk_percentile", name, index, quotable=study.quote == "percentile"))
    return facts


def _machine(frame: Frame, study: Study) -> list[Fact]:
    """Pm and Pmk of the newest run of parts in which nothing was changed, whatever the period of the report."""
    run = newest_run(frame.session, study)
    if isinstance(run, Refused) or machine_wording.why_none(run) is not None:
        return []
    assert not isinstance(run.result, Refused)
    note = machine_wording.run_of(run)
    return [
        Fact(key, name, number(index.value), note=note, low=number(index.low), high=number(index.high))
        for key, name, index in (("pm", "Pm", run.result.pm), ("pmk", "Pmk", run.result.pmk))
        if index is not None
    ]


def _index(key: str, name: str, index: Index, *, quotable: bool = True) -> Fact:
    note = "" if quotable else _("do not report")
    return Fact(key, name, number(index.value), note=note, low=number(index.low), high=number(index.high))


def _spread(study: Study) -> list[Fact]:
    indices = study.indices
    assert not isinstance(indices, Refused)
    facts = [
        Fact("readings", _("Readings"), count(indices.readings)),
        Fact("mean", _("Mean deviation"), deviation(indices.mean, 2)),
        Fact(
            "sigma_within", _("Sigma within"), width(indices.within.value, 3), note=wording.sigma_within(study.sigma_by)
        ),
        Fact("sigma_overall", _("Sigma overall"), width(indices.overall.value, 3)),
        Fact("outside", _("Counted out of tolerance"), count(study.outside)),
    ]
    for key, name, fallout, holds in (
        ("ppm_observed", _("Counted, ppm"), study.fallout, True),
        ("ppm_within", _("Expected by sigma within, ppm"), study.within, study.quote == "cpk"),
        (
            "ppm_overall",
            _("Expected by sigma overall, ppm"),
            study.overall,
            study.quote not in {"fitted", "percentile"} and study.normal,
        ),
        (
            "ppm_fitted",
            _("Expected by the fitted distribution, ppm"),
            study.by_fit.ppm if isinstance(study.by_fit, Fitted) else None,
            True,
        ),
    ):
        if fallout is not None:
            note = "" if holds else _("do not report")
            facts.append(Fact(key, name, number(fallout.total, 1 if fallout.total < FEW else 0), note=note))
    for test in (study.anderson, study.shapiro):
        if not isinstance(test, Refused):
            name = wording.normality_name(test.test)
            facts.append(Fact(test.test, name, number(test.statistic, 4)))
            facts.append(
                Fact(
                    f"{test.test}_p", _("p of {test}, normal distribution").format(test=name), probability(test.p_value)
                )
            )
    for key, name, sequences in (
        ("excluded", _("Left out: excluded"), study.excluded),
        ("faults", _("Left out: probe faults"), study.faults),
    ):
        facts.append(Fact(key, name, count(len(sequences)), note=wording.named(sequences) if sequences else ""))
    return facts


def _without(study: Study) -> list[Fact]:
    """Of the tool that nobody corrects, from the wear curve."""
    uncorrected = study.without
    if uncorrected is None:
        return []
    if isinstance(uncorrected, Refused):
        return [Fact("without_corrections", _("Without corrections"), words(statistics.refusal(uncorrected)))]
    facts = [_index("ppk_without", _("Ppk without corrections"), uncorrected.ppk)]
    if uncorrected.ideal is not None:
        facts.append(Fact("cp_ideal", _("Cp of scatter alone, centred"), number(uncorrected.ideal.value)))
    return facts
