"""Capability as its page judges it: indices with intervals, what may be quoted, or why there is no number."""

from app.capability import queries as capabilities
from app.capability import wording
from app.capability.queries import Study
from app.core.spc.capability import Index
from app.core.spc.refusal import Refused
from app.paper.content import Fact, Section, count, deviation, number, probability, width, words
from app.reports.queries.frame import Frame
from app.statistics import wording as statistics
from app.web.i18n import _

FEW = 100  # of a million: more than these are told without decimals


def capability(frame: Frame) -> Section:
    """Cp, Cpk, Pp, Ppk and Cpm with intervals; of a corrected process also of the tool without corrections."""
    study = capabilities.capability_of(frame.session, frame.standing, frame.window)
    title = _("Capability")
    if isinstance(study.found, Refused):
        why = _("No capability: {why}").format(why=statistics.refusal(study.found))
        return Section("capability", title, warnings=(why,))
    word, _tone = wording.verdict(study.ppk)
    quoted = {"cpk": "Cpk", "ppk": "Ppk", "percentile": _("Ppk by percentiles")}.get(study.quote, "Ppk")
    sentences = [
        _("{verdict}: quote {index} = {value}. Intervals hold with {confidence} confidence.").format(
            verdict=word,
            index=quoted,
            value=wording.index(study.found.cpk.value if study.quote == "cpk" else study.ppk),
            confidence=f"{study.confidence * 100:g}\N{NO-BREAK SPACE}%",
        ),
        wording.stability(study.stability, study.baseline),
    ]
    if not isinstance(study.in_time, Refused):
        model = study.in_time.model
        said = _("Time-dependent model {model} (ISO 22514-2): {words} {means}")
        sentences.append(
            said.format(model=model.value, words=wording.model(study.in_time), means=wording.model_means(study))
        )
    return Section(
        "capability",
        title,
        sentences=tuple(sentences),
        warnings=tuple(wording.cautions(study)),
        facts=(*_indices(study), *_spread(study), *_without(study)),
    )


def _indices(study: Study) -> list[Fact]:
    found = study.found
    assert not isinstance(found, Refused)
    named = (("cp", "Cp", found.cp), ("cpk", "Cpk", found.cpk), ("pp", "Pp", found.pp), ("ppk", "Ppk", found.ppk), ("cpm", "Cpm", found.cpm))  # fmt: skip
    potential, overall = study.quote == "cpk", study.quote != "percentile"
    quotable = {"cp": potential, "cpk": potential, "pp": overall, "ppk": overall}
    facts = [
        _index(key, name, index, quotable=quotable.get(key, True)) for key, name, index in named if index is not None
    ]
    by_percentile = study.by_percentile
    if not isinstance(by_percentile, Refused):
        note = _("not to be quoted here") if overall else ""
        facts.append(Fact("ppk_percentile", _("Ppk by percentiles"), number(by_percentile.ppk), note=note))
    return facts


def _index(key: str, name: str, index: Index, *, quotable: bool = True) -> Fact:
    note = "" if quotable else _("not to be quoted here")
    return Fact(key, name, number(index.value), note=note, low=number(index.low), high=number(index.high))


def _spread(study: Study) -> list[Fact]:
    found = study.found
    assert not isinstance(found, Refused)
    facts = [
        Fact("readings", _("Readings"), count(found.readings)),
        Fact("mean", _("Mean deviation"), deviation(found.mean, 2)),
        Fact("sigma_within", _("Sigma within"), width(found.within.value, 3)),
        Fact("sigma_overall", _("Sigma overall"), width(found.overall.value, 3)),
        Fact("outside", _("Counted out of tolerance"), count(study.outside)),
    ]
    for key, name, fallout, holds in (
        ("ppm_observed", _("Counted, ppm"), study.fallout, True),
        ("ppm_within", _("Expected by sigma within, ppm"), study.within, study.quote == "cpk"),
        ("ppm_overall", _("Expected by sigma overall, ppm"), study.overall, study.normal),
    ):
        if fallout is not None:
            note = "" if holds else _("not to be quoted here")
            facts.append(Fact(key, name, number(fallout.total, 1 if fallout.total < FEW else 0), note=note))
    for test in (study.anderson, study.shapiro):
        if not isinstance(test, Refused):
            facts.append(Fact(test.test, wording.normality_name(test.test), number(test.statistic, 4)))
            facts.append(Fact(f"{test.test}_p", _("p, normal distribution"), probability(test.p_value)))
    for key, name, sequences in (
        ("excluded", _("Left out: excluded"), study.excluded),
        ("faults", _("Left out: probe faults"), study.faults),
    ):
        facts.append(Fact(key, name, count(len(sequences)), note=wording.named(sequences) if sequences else ""))
    return facts


def _without(study: Study) -> list[Fact]:
    """Of the tool that nobody corrects, from the wear curve."""
    found = study.without
    if found is None:
        return []
    if isinstance(found, Refused):
        return [Fact("without_corrections", _("Without corrections"), words(statistics.refusal(found)))]
    facts = [_index("ppk_without", _("Ppk without corrections"), found.ppk)]
    if found.ideal is not None:
        facts.append(Fact("cp_ideal", _("Cp of scatter alone, centred"), number(found.ideal.value)))
    return facts
