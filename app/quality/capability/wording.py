"""The words of capability: verdicts, tests, models in time, and which index may be quoted."""

from math import isnan

from app.core.natural_limit import NaturalLimit
from app.core.spc.capability import CAPABLE, VERY_CAPABLE, Caution, Index
from app.core.spc.fitting import Fitted
from app.core.spc.in_time import ALPHA, InTime, Location, Model, Test
from app.core.spc.normality import Normality
from app.core.spc.quoting import Quoting, WhyNot
from app.core.spc.refusal import Reason, Refused
from app.core.spc.spread import Estimator
from app.core.spc.stability import Fired, Stability
from app.language.formatting import beside, grouped, probability, signed, tolerance_um
from app.language.i18n import _, ngettext
from app.loop.summaries import wording as statistics
from app.loop.summaries.wording import context_words
from app.quality.capability import fit_wording as fits
from app.quality.capability.kinds import SigmaBy
from app.quality.capability.queries import Study

MOST_NAMED = 40


def verdict(value: float | None) -> tuple[str, str]:
    """A word for an index, and its tone."""
    if value is None:
        return _("No number"), "steady"
    if value >= VERY_CAPABLE:
        return _("Very capable"), "steady"
    if value >= CAPABLE:
        return _("Capable"), "steady"
    if value >= 1:
        return _("Barely capable"), "waiting"
    return _("Not capable"), "attention"


def index_name(quote: str) -> str:
    """The name of the index that may be quoted."""
    return {"cpk": "Cpk", "fitted": _("Ppk by fit"), "percentile": _("Ppk by percentiles")}.get(quote, "Ppk")


def method(quote: str) -> str:
    """Name the method behind the index that may be quoted."""
    return {
        "cpk": _("normal distribution, scatter from part to part"),
        "ppk": _("normal distribution, spread of all readings"),
        "fitted": _("fitted distribution (ISO 22514-2)"),
        "percentile": _("percentiles (ISO 22514-2)"),
        "none": "",
    }[quote]


def why_not(code: str | None) -> str:
    """The reason why no index may be quoted, in a few words."""
    return {
        WhyNot.FAR_OFF.value: _("a reading lies far from all others"),
        WhyNot.NO_SHAPE.value: _("not normal, and no distribution fits"),
        "not_yet": _("not computed yet; ready in a few minutes"),
        Reason.TOO_FEW_READINGS.value: _("too few readings"),
        Reason.NO_VARIATION.value: _("all readings are the same"),
        Reason.UNRESOLVED.value: _("readings too coarse"),
    }.get(code or "", _("no index can be computed"))


def window(count: int, first: int | None, last: int | None, quote: str = "none", *, preliminary: bool = False) -> str:
    """The window of an index: how many readings, which, by which method.

    >>> window(998, 4003, 5002, "ppk")
    '998 readings, 4003 to 5002; normal distribution, spread of all readings'
    """
    sentence = ngettext("%(num)s reading", "%(num)s readings", count) % {"num": count}
    if first is not None and last is not None:
        sentence += _(", {first} to {last}").format(first=first, last=last)
    if method(quote):
        sentence += f"; {method(quote)}"
    return sentence + (_("; preliminary") if preliminary else "")


def window_of(study: Study) -> str:
    """The window and the method of the number that may be quoted."""
    places = study.sequence
    first, last = (int(places[0]), int(places[-1])) if len(places) else (None, None)
    words = window(len(study.values), first, last, study.quote, preliminary=study.quoting.preliminary)
    of = context_words(study.window.context)
    return _("{window}, only {context}").format(window=words, context=of) if of else words


def one_sided(study: Study) -> str | None:
    """Say why there is neither Cp, Pp nor Cpm, and on which side there is no index; None where both limits are judged."""
    if study.side == "both":
        return None
    if study.natural_limit is NaturalLimit.NONE:
        return _("Judged by one limit only: Cp, Pp and Cpm compare the whole tolerance, so they are not given.")
    edge = f"{study.current.parameters.target:g}"
    which = (
        _("The lower limit {edge} mm is a natural one: no part can be below it.")
        if study.natural_limit is NaturalLimit.LOWER
        else _("The upper limit {edge} mm is a natural one: no part can be above it.")
    )
    rest = _("That side carries no index and no ppm, and Cp, Pp and Cpm do not exist (ISO 22514-2).")
    return f"{which.format(edge=edge)} {rest}"


def sigma_by(by: SigmaBy) -> str:
    """The readings whose differences give sigma within."""
    return {
        SigmaBy.NEIGHBOURS: _("Neighbours"),
        SigmaBy.PART: _("Parts"),
        SigmaBy.SHIFT: _("Shifts"),
        SigmaBy.NEST: _("Nests, spindles"),
    }[by]


def sigma_within(by: SigmaBy) -> str:
    """The method of sigma within."""
    return {
        SigmaBy.NEIGHBOURS: statistics.estimator(Estimator.MOVING_RANGE),
        SigmaBy.PART: _("pooled variance inside the readings of one part"),
        SigmaBy.SHIFT: _("pooled variance inside the readings of one shift"),
        SigmaBy.NEST: _("pooled variance inside neighbours of one nest or spindle"),
    }[by]


def index(value: float | None) -> str:
    """An index with the digits it deserves, never rounded across what is usually asked for."""
    return beside(value, 2, 1.0, CAPABLE, VERY_CAPABLE)


def between(found: Index | Quoting | None) -> str:
    """Its interval."""
    if found is None or found.high is None:
        return "–"
    if found.low is None:
        return _("up to {high}").format(high=index(found.high))
    return _("{low} to {high}").format(low=index(found.low), high=index(found.high))


def ppm(value: float | None) -> str:
    """Parts per million, with no more digits than can be meant."""
    if value is None:
        return "–"
    if value >= 99.5:
        return grouped(round(value))
    return f"{value:.1f}" if value >= 0.05 else "<\N{NARROW NO-BREAK SPACE}0.1" if value > 0 else "0"


def p_value(p: float) -> str:
    """A probability as one reads it."""
    return f"p {probability(p, '= ')}"


def normality(test: Normality | Refused) -> str:
    """Word the result of a test of normality."""
    if isinstance(test, Refused):
        return statistics.refusal(test)
    if test.p_value < 0.005:
        return _("Not normal: readings as far from it come by chance in less than one case of 200.")
    if test.p_value < 0.05:
        return _("Doubtful: readings as far from normal come by chance in {share} % of cases.").format(
            share=f"{test.p_value * 100:.1f}"
        )
    return _("The readings agree with a normal distribution.")


def normality_name(test: str) -> str:
    """Name the test of normality."""
    return {"anderson_darling": "Anderson-Darling A²", "shapiro_wilk": "Shapiro-Wilk W"}.get(test, test)


def stability(verdict: Stability | Refused, baseline: int | None) -> str:
    """Statistical control by the run rules, and by what it was judged."""
    if isinstance(verdict, Refused):
        return _("Cannot be judged: {why}").format(why=statistics.refusal(verdict))
    by = (
        _("judged by baseline {n}").format(n=baseline)
        if baseline is not None
        else _("judged by limits of the same readings; a frozen baseline of the deviations is a better judge")
    )
    if verdict.in_control:
        return _("In control: no run rule fires more often than chance explains ({by}).").format(by=by)
    why = []
    if verdict.beyond_chance:
        names = ", ".join(statistics.rule_name(fired.rule) for fired in verdict.beyond_chance)
        why.append(_("more signals than chance explains by {names}").format(names=names))
    if verdict.gross:
        why.append(
            ngettext(
                "%(num)d point lies far beyond the limits, %(size)s sigma from the centre",
                "%(num)d points lie far beyond the limits, up to %(size)s sigma from the centre",
                verdict.gross,
            )
            % {"num": verdict.gross, "size": f"{verdict.farthest:.0f}"}
        )
    return _("Not in control: {why} ({by}).").format(why="; ".join(why), by=by)


def unsteady(study: Study) -> str | None:
    """The answer to the other question, where it differs: in control by the run rules, yet not constant in time."""
    if not study.in_control or study.constant_in_time is not False:
        return None
    assert not isinstance(study.in_time, Refused)
    return _(
        "The model in time answers another question: by ISO 22514 (model {model}) mean or scatter are not constant, so Cp and Cpk are not reported."
    ).format(model=study.in_time.model.value)


def why_not_quoted(study: Study) -> str:
    """Give the reason why Cp and Cpk are not quoted: one of the two questions, or both."""
    why = []
    if study.in_control is False:
        why.append(_("the process is not in control (run rules)"))
    if not isinstance(study.in_time, Refused) and study.constant_in_time is False:
        why.append(
            _("the process is not constant in time (ISO 22514, model {model})").format(model=study.in_time.model.value)
        )
    return _(" and ").join(why)


def lives(count: int) -> str:
    """Number of stretches that make up the wear curve."""
    return ngettext(
        "wear included, over %(num)d tool life or stretch.",
        "wear included, over %(num)d tool lives and stretches.",
        count,
    ) % {"num": count}


def fired(rule: Fired) -> str:
    """Number of signals against the number that chance explains."""
    return ngettext(
        "%(num)d signal, by chance %(expected)s", "%(num)d signals, by chance %(expected)s", rule.signals
    ) % {"num": rule.signals, "expected": f"{rule.expected:.1f}"}


def location(in_time: InTime) -> str:
    """Describe the behaviour of the mean."""
    return {
        Location.CONSTANT: _("the mean stays"),
        Location.RANDOM: _("the mean wanders at random"),
        Location.SYSTEMATIC: _("the mean is driven: it follows a line or a course"),
        Location.BOTH: _("the mean is driven and also wanders at random"),
    }[in_time.location]


def model(in_time: InTime) -> str:
    """The model in words."""
    scatter = _("the scatter changes") if in_time.scatter_changes else _("the scatter stays")
    shape = (
        _("all readings together are normal") if in_time.normal_overall else _("all readings together are not normal")
    )
    return _("{mean}, {scatter}, {shape}.").format(mean=location(in_time), scatter=scatter, shape=shape).capitalize()


def model_means(study: Study) -> str:
    """Name the index that the process model allows: the one that `Study.quote` names, for what else is known counts as well.

    A steady model does not outweigh signals of the run rules. Empty where there is no model.
    """
    if isinstance(study.in_time, Refused):
        return ""
    if study.quote == "none":
        return _("Do not report an index: {why}.").format(why=why_not(study.quoting.why))
    which = study.in_time.model
    index = index_name(study.quote) if study.quote in {"fitted", "percentile"} else _("Pp and Ppk")
    if which.steady and study.stable is not True:
        why = (
            _("the process is not in control (run rules)")
            if study.stable is False
            else _("too little is known to call it in control")
        )
        return _("The mean and the scatter hold, yet {why}: report {index}, not Cp and Cpk.").format(
            why=why, index=index
        )
    match which:
        case Model.A1 | Model.A2 if study.quote == "cpk":
            return _("Cp and Cpk may be reported, and describe future parts too: 6 sigma hold 99.73 % of the parts.")
        case Model.A1 | Model.A2 if study.quote == "ppk":
            return _(
                "Report {index}: the process is steady, yet its scatter from part to part is not known well enough."
            ).format(index=index)
        case Model.A1 | Model.A2:
            return _(
                "Report {index}: the process is steady, but not normal, so sigma does not describe its tails."
            ).format(index=index)
        case Model.B:
            sentence = _("Report {index}: the scatter changes, so one sigma does not describe the process.")
        case Model.C1 | Model.C2:
            sentence = _(
                "Report {index} of all readings: sigma within subgroups does not include the movement of the mean."
            )
        case Model.C3:
            sentence = _("Report {index} over complete drifts, from tool change to tool change.")
        case Model.C4:
            sentence = _("Report {index} over a long enough time: it must include drift and jumps.")
        case Model.D:
            sentence = _("Find the causes first, then report {index}: mean and scatter both change.")
    return sentence.format(index=index)


def model_tests(in_time: InTime) -> list[tuple[str, str, str, str]]:
    """Question, test, its numbers, answer."""

    def answer(said: bool) -> str:
        return _("yes") if said else _("no")

    def f(test: Test) -> str:
        if isnan(test.statistic):
            return _("no scatter to compare")
        return f"F({test.freedom}, {test.freedom_error}) = {test.statistic:.2f}, {p_value(test.p_value)}"

    return [
        (
            _("Does the mean move?"),
            _("analysis of variance between subgroups"),
            f(in_time.between),
            answer(in_time.between.significant),
        ),
        (_("Linear drift?"), _("regression of the subgroup means"), f(in_time.line), answer(in_time.line.significant)),
        (
            _("Do the means follow each other?"),
            _("von Neumann's ratio"),
            f"C = {index(in_time.successive.statistic)}, {p_value(in_time.successive.p_value)}"
            if not isnan(in_time.successive.statistic)
            else _("no scatter to compare"),
            answer(in_time.successive.significant),
        ),
        (
            _("Deviates from linear drift?"),
            _("lack of fit of the line"),
            f(in_time.beside_line),
            answer(in_time.beside_line.significant),
        ),
        (
            _("Does the scatter change?"),
            _("Brown-Forsythe over differences"),
            f(in_time.scatter),
            answer(in_time.scatter.significant),
        ),
    ]


def model_note(in_time: InTime) -> str:
    """Of what, and at which level."""
    sentence = _("{n} subgroups of {size} neighbours; tests at {level} %.").format(
        n=in_time.subgroups, size=in_time.size, level=f"{ALPHA * 100:g}"
    )
    if in_time.spread:
        sentence += " " + _("Evenly spread over the readings.")
    if in_time.few:
        sentence += " " + _("ISO 22514-2 asks for 125 readings and more: a slow change may not be seen yet.")
    return sentence


def cautions(study: Study) -> list[str]:
    """Cautions that belong to the numbers."""
    if isinstance(study.indices, Refused):
        return [statistics.refusal(study.indices)]
    sentences = [
        _not_normal(study) if caution is Caution.NOT_NORMAL else statistics.caution(caution)
        for caution in study.indices.cautions
        if caution is not Caution.NOT_IN_CONTROL or (study.stable is not False and study.normal)
    ]
    if study.quote == "percentile" and not isinstance(study.by_percentile, Refused):
        sentences += [statistics.caution(caution) for caution in study.by_percentile.cautions]
    if study.quote == "none":
        sentences.insert(0, _("Do not report an index: {why}.").format(why=why_not(study.quoting.why)))
    elif study.stable is False:
        sentences.insert(
            0,
            _("Do not report Cp and Cpk: {why}. Ppk describes past parts only; do not use it to predict.").format(
                why=why_not_quoted(study)
            ),
        )
    if study.far and study.furthest is not None:
        sentences.append(
            ngettext(
                "Reading %(which)s lies far from all others (%(furthest)s µm), and decides these figures. Check it: if it is not a size of the part, exclude it with a reason.",
                "Readings %(which)s lie far from all others (up to %(furthest)s µm), and decide these figures. Check them: if they are no sizes of the parts, exclude them with a reason.",
                len(study.far),
            )
            % {"which": named(study.far), "furthest": signed(study.furthest * 1000, 1)}
        )
    if study.limits_differ:
        sentences.append(
            _(
                "The tolerance changed in this time: indices take {half} of version {version}, parts outside are counted by the tolerance each was judged by."
            ).format(half=tolerance_um(study.half, study.natural_limit), version=study.versions[-1].version)
        )
    elif study.targets_differ:
        sentences.append(_("The target changed in this time: every deviation is one from the target in force."))
    return sentences


def _not_normal(study: Study) -> str:
    """Warn that no normal distribution carries the numbers, and name the method that does, if an index may be quoted by it."""
    carried = isinstance(study.by_fit, Fitted) or not isinstance(study.by_percentile, Refused)
    if study.quote == "none" and carried:
        return _("The readings are not normally distributed: the expected ppm do not hold.")
    if isinstance(study.by_fit, Fitted):
        return fits.caution(study.by_fit)
    if not isinstance(study.by_percentile, Refused):
        return statistics.caution(Caution.NOT_NORMAL)
    if study.by_percentile.reason is Reason.TOO_FEW_READINGS:
        return _(
            "The readings are not normally distributed, and too few for percentiles ({have} of {needed}): no index here describes the tails, and the expected ppm are not valid."
        ).format(have=study.by_percentile.have, needed=study.by_percentile.needed)
    return _(
        "The readings are not normally distributed, and take too few values for percentiles: no index here describes the tails, and the expected ppm are not valid."
    )


def named(sequences: list[int]) -> str:
    """Readings by their numbers, in runs.

    >>> named([3, 4, 5, 9])
    '3–5, 9'
    """
    runs: list[list[int]] = []
    for sequence in sequences:
        if runs and runs[-1][1] + 1 == sequence:
            runs[-1][1] = sequence
        else:
            runs.append([sequence, sequence])
    numbers = ", ".join(f"{a}" if a == b else f"{a}–{b}" for a, b in runs[:MOST_NAMED])
    return numbers + (" …" if len(runs) > MOST_NAMED else "")


def gain(value: float) -> str:
    """Effect of the corrections on the standard deviation."""
    if value >= 1.05:
        return _("Without corrections the parts would scatter {times} times as much.").format(times=f"{value:.1f}")
    if value > 0.95:
        return _("Without corrections the parts would scatter as much: nothing was gained in this time.")
    return _("The corrections made it worse: without them the parts would scatter {share} % less.").format(
        share=f"{(1 - value) * 100:.0f}"
    )


def price(value: float) -> str:
    """Distance from an ideal correction."""
    return _("An ideal correction would leave {share} % of the spread there is.").format(
        share=f"{min(100.0, 100 / value):.0f}"
    )
