"""The words of capability: verdicts, tests, models in time, and which index may be quoted."""

from app.capability.queries import Study
from app.core.spc.capability import Caution, Index
from app.core.spc.in_time import ALPHA, InTime, Location, Model, Test
from app.core.spc.normality import Normality
from app.core.spc.refusal import Reason, Refused
from app.core.spc.stability import Fired, Stability
from app.statistics import wording as statistics
from app.web.i18n import _, ngettext
from app.web.numbers import signed

CAPABLE, VERY_CAPABLE = 4 / 3, 5 / 3
"""What is usually asked for: four sigma to each limit, five for what matters to safety."""
MOST_NAMED = 40


def verdict(value: float | None) -> tuple[str, str]:
    """A word for an index, and its tone."""
    if value is None:
        return _("No number"), "steady"
    if value >= VERY_CAPABLE:
        return _("Very capable"), "steady"
    if value >= CAPABLE - 0.005:
        return _("Capable"), "steady"
    if value >= 1:
        return _("Barely capable"), "waiting"
    return _("Not capable"), "attention"


def index(value: float | None) -> str:
    """An index with the digits it deserves."""
    return "–" if value is None else f"{value:.2f}".replace("-", "\N{MINUS SIGN}")


def between(found: Index | None) -> str:
    """Its interval."""
    if found is None or found.low is None or found.high is None:
        return "–"
    return _("{low} to {high}").format(low=index(found.low), high=index(found.high))


def ppm(value: float | None) -> str:
    """Parts per million, with no more digits than can be meant."""
    if value is None:
        return "–"
    if value >= 99.5:
        return f"{round(value):,}".replace(",", "\N{NARROW NO-BREAK SPACE}")
    return f"{value:.1f}" if value >= 0.05 else "<\N{NARROW NO-BREAK SPACE}0.1" if value > 0 else "0"


def p_value(p: float) -> str:
    """A probability as one reads it."""
    return _("p < 0.001") if p < 0.001 else f"p = {p:.3f}"


def normality(test: Normality | Refused) -> str:
    """What a test of normality says."""
    if isinstance(test, Refused):
        return statistics.refusal(test)
    if test.p_value < 0.005:
        return _("Not normal: readings as far from it come by chance in less than one case of 200.")
    if test.p_value < 0.05:
        return _("Doubtful: readings as far from normal come by chance in {share} % of cases.").format(
            share=f"{test.p_value * 100:.1f}"
        )
    return _("Nothing speaks against a normal distribution.")


def normality_name(test: str) -> str:
    """What the test is called."""
    return {"anderson_darling": "Anderson-Darling A²", "shapiro_wilk": "Shapiro-Wilk W"}.get(test, test)


def stability(found: Stability | Refused, baseline: int | None) -> str:
    """Whether the process is stable, and judged by what."""
    if isinstance(found, Refused):
        return _("Cannot be judged: {why}").format(why=statistics.refusal(found))
    by = (
        _("judged by baseline {n}").format(n=baseline)
        if baseline is not None
        else _("judged by limits of the same readings; a baseline frozen of the deviations themselves would say more")
    )
    if found.stable:
        return _("Stable: no rule fires more often than chance explains ({by}).").format(by=by)
    names = ", ".join(statistics.rule_name(each.rule) for each in found.beyond_chance)
    return _("Not stable: more signals than chance explains by {names} ({by}).").format(names=names, by=by)


def unsteady(study: Study) -> str | None:
    """Why the process does not count as stable though the rules are quiet."""
    if study.stable is not False or isinstance(study.stability, Refused) or not study.stability.stable:
        return None
    assert not isinstance(study.in_time, Refused)
    return _("Yet by its behaviour in time (model {model}) it is not steady: that counts as well.").format(
        model=study.in_time.model.value
    )


def lives(count: int) -> str:
    """How many stretches the wear curve is put together from."""
    return ngettext(
        "wear included, over %(num)d tool life or stretch.",
        "wear included, over %(num)d tool lives and stretches.",
        count,
    ) % {"num": count}


def fired(each: Fired) -> str:
    """How often against how often by chance."""
    return ngettext(
        "%(num)d signal, by chance %(expected)s", "%(num)d signals, by chance %(expected)s", each.signals
    ) % {"num": each.signals, "expected": f"{each.expected:.1f}"}


def location(found: InTime) -> str:
    """What the mean does."""
    return {
        Location.CONSTANT: _("the mean stays"),
        Location.RANDOM: _("the mean wanders at random"),
        Location.SYSTEMATIC: _("the mean is driven: it follows a line or a course"),
        Location.BOTH: _("the mean is driven, and wanders beside it"),
    }[found.location]


def model(found: InTime) -> str:
    """The model in words."""
    scatter = _("the scatter changes") if found.scatter_changes else _("the scatter stays")
    shape = _("all readings together are normal") if found.normal_overall else _("all readings together are not normal")
    return _("{mean}, {scatter}, {shape}.").format(mean=location(found), scatter=scatter, shape=shape).capitalize()


def model_means(study: Study) -> str:
    """Which index the model in time allows: the one that `Study.quote` names, for what else is known counts as well.

    A steady model does not outweigh signals of the run rules. Empty where there is no model.
    """
    if isinstance(study.in_time, Refused):
        return ""
    which = study.in_time.model
    index = _("Ppk by percentiles") if study.quote == "percentile" else _("Pp and Ppk")
    if which.steady and study.stable is not True:
        why = (
            _("the run rules find more signals than chance explains")
            if study.stable is False
            else _("too little is known to call it stable")
        )
        return _("The mean and the scatter hold, yet {why}: quote {index}, not Cp and Cpk.").format(
            why=why, index=index
        )
    match which:
        case Model.A1 | Model.A2 if study.quote == "cpk":
            return _("Cp and Cpk may be quoted, and what was is what will be: 6 sigma hold 99.73 % of the parts.")
        case Model.A1 | Model.A2:
            return _(
                "Quote {index}: the process is steady, but not normal, so no sigma says what its tails hold."
            ).format(index=index)
        case Model.B:
            said = _("Quote {index}: the scatter changes, so no one sigma describes the process.")
        case Model.C1 | Model.C2:
            said = _("Quote {index} of all readings: sigma within subgroups leaves out how the mean wanders.")
        case Model.C3:
            said = _("Quote {index} over whole courses of the drift, from tool change to tool change.")
        case Model.C4:
            said = _("Quote {index} over long enough a time: drift and jumps both belong to it.")
        case Model.D:
            said = _("Quote {index}, and look for the causes first: mean and scatter both move.")
    return said.format(index=index)


def model_tests(found: InTime) -> list[tuple[str, str, str, str]]:
    """Question, test, its numbers, answer."""

    def answer(said: bool) -> str:
        return _("yes") if said else _("no")

    def f(test: Test) -> str:
        return f"F({test.freedom}, {test.freedom_error}) = {test.statistic:.2f}, {p_value(test.p_value)}"

    return [
        (
            _("Does the mean move?"),
            _("analysis of variance between subgroups"),
            f(found.between),
            answer(found.between.significant),
        ),
        (_("Along a line?"), _("regression of the subgroup means"), f(found.line), answer(found.line.significant)),
        (
            _("Do the means follow each other?"),
            _("von Neumann's ratio"),
            f"C = {index(found.successive.statistic)}, {p_value(found.successive.p_value)}",
            answer(found.successive.significant),
        ),
        (
            _("Beside the line as well?"),
            _("lack of fit of the line"),
            f(found.beside_line),
            answer(found.beside_line.significant),
        ),
        (
            _("Does the scatter change?"),
            _("Brown-Forsythe over differences"),
            f(found.scatter),
            answer(found.scatter.significant),
        ),
    ]


def model_note(found: InTime) -> str:
    """Of what, and at which level."""
    said = _("{n} subgroups of {size} neighbours; tests at {level} %.").format(
        n=found.subgroups, size=found.size, level=f"{ALPHA * 100:g}"
    )
    if found.spread:
        said += " " + _("Evenly spread over the readings.")
    if found.few:
        said += " " + _("ISO 22514-2 asks for 125 readings and more: a slow change may not be seen yet.")
    return said


def cautions(study: Study) -> list[str]:
    """What the numbers should not be read without."""
    if isinstance(study.found, Refused):
        return [statistics.refusal(study.found)]
    said = [
        _not_normal(study) if each is Caution.NOT_NORMAL else statistics.caution(each)
        for each in study.found.cautions
        if each is not Caution.NOT_IN_CONTROL or study.stable is not False
    ]
    if study.quote == "percentile" and not isinstance(study.by_percentile, Refused):
        said += [statistics.caution(each) for each in study.by_percentile.cautions]
    if study.stable is False:
        said.insert(
            0, _("Cp and Cpk are not to be quoted: the process is not stable. Ppk says what was, not what will be.")
        )
    if study.far and study.furthest is not None:
        said.append(
            ngettext(
                "Reading %(which)s lies far from all others (%(furthest)s µm), and makes the numbers. Look at it: if the part was not so, exclude it with a reason.",
                "Readings %(which)s lie far from all others (up to %(furthest)s µm), and make the numbers. Look at them: if a part was not so, exclude it with a reason.",
                len(study.far),
            )
            % {"which": named(study.far), "furthest": signed(study.furthest * 1000, 1)}
        )
    if study.limits_differ:
        said.append(
            _(
                "The tolerance changed in this time: indices take ±{half} µm of version {version}, parts outside are counted by the tolerance each was judged by."
            ).format(half=f"{study.versions[-1].half * 1000:g}", version=study.versions[-1].version)
        )
    elif study.targets_differ:
        said.append(_("The target changed in this time: every deviation is one from the target in force."))
    return said


def _not_normal(study: Study) -> str:
    """That no normal distribution carries the numbers, and what does, if anything."""
    if not isinstance(study.by_percentile, Refused):
        return statistics.caution(Caution.NOT_NORMAL)
    if study.by_percentile.reason is Reason.TOO_FEW_READINGS:
        return _(
            "The readings are not normally distributed, and too few for percentiles ({have} of {needed}): no index here says what the tails hold, and the expected ppm do not hold."
        ).format(have=study.by_percentile.have, needed=study.by_percentile.needed)
    return _(
        "The readings are not normally distributed, and take too few values for percentiles: no index here says what the tails hold, and the expected ppm do not hold."
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
    said = ", ".join(f"{a}" if a == b else f"{a}–{b}" for a, b in runs[:MOST_NAMED])
    return said + (" …" if len(runs) > MOST_NAMED else "")


def gain(value: float) -> str:
    """What the corrections did to the spread."""
    if value >= 1.05:
        return _("Without corrections the parts would scatter {times} times as much.").format(times=f"{value:.1f}")
    if value > 0.95:
        return _("Without corrections the parts would scatter as much: nothing was gained in this time.")
    return _("The corrections made it worse: without them the parts would scatter {share} % less.").format(
        share=f"{(1 - value) * 100:.0f}"
    )


def price(value: float) -> str:
    """How far from an ideal correction."""
    return _("An ideal correction would leave {share} % of the spread there is.").format(
        share=f"{min(100.0, 100 / value):.0f}"
    )
