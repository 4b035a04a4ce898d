"""The sentences of the what-if: what is assumed, how far it can be believed, what a map shows. Lengths in mm."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any

from app.core.parameters import BY_NAME
from app.core.policy_map import Criterion, room, value_of
from app.core.replay import Figures
from app.core.spc.refusal import Reason, Refused
from app.language.formatting import NO_BREAK_SPACE, NOTHING, fixed, percent, plain_um, short, signed, um
from app.language.i18n import _, ngettext
from app.loop.characteristics.wording import label
from app.quality.capability import wording as capability
from app.quality.capability.wording import named

if TYPE_CHECKING:
    from app.core.measured_gain import Effect
    from app.quality.what_if.proposals import ProposalRow
    from app.quality.what_if.queries import Likeness, Sampling
    from app.quality.what_if.tool_history import ToolHistory


def likeness(found: Likeness) -> str:
    """Accuracy of the simulated loop."""
    if found.off is None:
        return _("There is nothing to compare the simulation with.")
    sentences = {
        "well": _("The simulated loop does what the real one did."),
        "roughly": _("The simulated loop does roughly what the real one did: trust differences, not the last digit."),
        "badly": _(
            "The simulated loop does not do what the real one did: something is at work that the simulation does not include. "
            "Do not decide by this simulation."
        ),
        "unknown": _("Too few readings to check the simulation."),
    }[found.verdict]
    return (
        sentences
        + " "
        + _("With the settings of that time: RMS error {off}; {same} of the parts identical.").format(
            off=plain_um(found.off, 2), same=percent(found.same)
        )
    )


def assumed(share: float, delay: int) -> str:
    """Assumptions of the replay about corrections."""
    acts = (
        _("Assumed here: a correction acts in full")
        if share == 1
        else _("Assumed here: of a correction {share} act").format(share=percent(share))
    )
    after = ngettext(
        "after %(num)d more part with the old offset.", "after %(num)d more parts with the old offset.", delay
    ) % {"num": delay}
    return f"{acts}, {after}" if delay else _("{acts}, from the next part on.").format(acts=acts)


def moment(text: str) -> datetime:
    """A moment of `evidence.period_of`.

    >>> moment("2026-11-21T08:15:02.120000Z").isoformat()
    '2026-11-21T08:15:02+00:00'
    """
    return datetime.fromisoformat(text[:19] + "+00:00")


def effect(effect_size: Effect) -> str:
    """Effect of corrections on this machine."""
    sentence = _(
        "On this machine a correction of 10 µm moves the part by {value} µm (95 % interval {low} to {high} µm), by {count} corrections."
    ).format(
        value=fixed(10 * effect_size.value, 1),
        low=fixed(10 * effect_size.low, 1),
        high=fixed(10 * effect_size.high, 1),
        count=effect_size.corrections,
    )
    if effect_size.is_full:
        return sentence + " " + _("This agrees with the assumption that they act in full.")
    return (
        sentence
        + " "
        + (
            _(
                "They act by less than in full: replay with the measured effect, and look for play, a soft set-up or a wrong factor."
            )
            if effect_size.value < 1
            else _("They act by more than in full: replay with the measured effect, and look at the factor.")
        )
    )


def effect_unknown(refused: Refused, sentence: str) -> str:
    """Reason why the readings do not show if corrections act in full."""
    if refused.reason is Reason.INCOMPLETE_STUDY:
        sentence = ngettext(
            "%(num)d correction took effect in this period; it takes %(needed)d.",
            "%(num)d corrections took effect in this period; it takes %(needed)d.",
            refused.have,
        ) % {"num": refused.have, "needed": refused.needed}
    return _("These readings do not show whether corrections act in full, as assumed here.") + " " + sentence


def cautions(past: ToolHistory) -> list[str]:
    """Limits of the replay, as far as they matter here."""
    parameters = past.current.parameters
    cautions: list[str] = []
    if parameters.measures_only:
        cautions.append(_("This characteristic only measures: no settings make a difference."))
    if past.imported:
        cautions.append(
            _(
                "These readings were imported. They are replayed as parts of a process without corrections: what was corrected by hand then is not known."
            )
        )
    if past.unknown:
        cautions.append(
            ngettext(
                "%(num)d reading is left out: the corrections of its part are not known.",
                "%(num)d readings are left out: the corrections of their parts are not known.",
                past.unknown,
            )
            % {"num": past.unknown}
        )
    cautions += left_out(past)
    if past.others:
        cautions.append(
            _(
                "The tool is corrected by {others} as well; they are replayed with it, set as they were. Their alarms are not counted here."
            ).format(others=", ".join(past.others[:5]))
        )
    if len(past.versions) > 1:
        cautions.append(
            _(
                "The parameters changed in this period (versions {first} to {last}): “today” is today's set throughout."
            ).format(first=past.versions[0], last=past.versions[-1])
        )
    if parameters.accept_m > 1:
        cautions.append(
            _("Acceptance by {n} of {m} sections is not simulated: it is as it was then.").format(
                n=parameters.accept_n, m=parameters.accept_m
            )
        )
    if parameters.mode.value == "approval":
        cautions.append(_("Corrections wait for a person here; in the replay all of them wait equally long."))
    if past.delays and (past.delays.high > past.delays.usual + 1 or past.delays.low < past.delays.usual - 1):
        cautions.append(
            _(
                "The delay of corrections varied: nine of ten after {low} to {high} more parts with the old "
                "offset. The simulation uses one delay for all of them, so some parts differ."
            ).format(low=past.delays.low, high=past.delays.high)
        )
    if past.baseline is not None:
        cautions.append(
            _(
                "Two pages, two questions: here each column is judged by control limits of its own readings; the capability page judges by "
                "the frozen baseline {version}. So Cpk may be reported there and Ppk here, or the other way round."
            ).format(version=past.baseline)
        )
    return cautions


def sampled(sampling: Sampling) -> list[str]:
    """Limits of a replay with fewer parts measured."""
    plan = sampling.plan
    sentences = [_("Each stored reading is taken for a part; a part that was not measured then is not known.")]
    if plan.after_alarm:
        sentences += [
            ngettext(
                "After an alarm that a reading of this characteristic raises, every part is measured for {n} reading.",
                "After an alarm that a reading of this characteristic raises, every part is measured for {n} readings.",
                plan.after_alarm,
            ).format(n=plan.after_alarm),
            _(
                "Other alarms of the characteristic and of its tool ask for more measurements in the control plan, but not here."
            ),
        ]
    if plan.after_change:
        sentences.append(
            ngettext(
                "At the beginning, after a tool change and after an offset set by hand, every part is measured for {n} reading; "
                "in the control plan after a tool change only.",
                "At the beginning, after a tool change and after an offset set by hand, every part is measured for {n} readings; "
                "in the control plan after a tool change only.",
                plan.after_change,
            ).format(n=plan.after_change)
        )
    if not plan.after_alarm and not plan.after_change:
        sentences.append(
            _("No more parts are measured after an alarm or a tool change; after a probe fault, the next one is.")
        )
    if plan.minutes or plan.per_shift:
        sentences.append(_("What the control plan asks for by minutes or by shift is not replayed."))
    sentences.append(_("Sudden events fall where they fell: of few of them in the period, these counts show little."))
    if sampling.has_gaps:
        sentences.insert(
            1,
            _("The control plan measures 1 in {n} parts: of the time since, parts in between are missing here.").format(
                n=sampling.plan.every
            ),
        )
    return sentences


def left_out(past: ToolHistory) -> list[str]:
    """Readings that count for nothing, or for less than the others, by their numbers."""
    sentence = {
        "excluded": _("Left out because excluded: readings {which}."),
        "faults": _("Left out, as probe faults: readings {which}."),
        "worn": _(
            "In the wear zone, where a person decides: readings {which}. They count as rejects; mean, spread and Ppk are without them."
        ),
    }
    return [sentence[name].format(which=named(numbers)) for name, numbers in past.named().items() if numbers]


def out_of_order(zero_range: float, averaging_limit: float) -> str:
    """Reason why a cell of the map is blank."""
    return _("R33 {r33} must be smaller than R34 {r34}").format(
        r33=plain_um(zero_range, 2), r34=plain_um(averaging_limit, 2)
    )


def criterion(which: Criterion) -> str:
    """Name of the criterion."""
    return {
        Criterion.PPK: _("Ppk"),
        Criterion.REJECTS: _("Rejects"),
        Criterion.SPREAD: _("Spread s"),
        Criterion.CORRECTIONS: _("Corrections"),
    }[which]


def criterion_explained(which: Criterion) -> str:
    """Definition of the best cell."""
    return {
        Criterion.PPK: _("The larger Ppk the better, computed as if the readings were normal."),
        Criterion.REJECTS: _("The fewer parts out of tolerance the better."),
        Criterion.SPREAD: _("The smaller the standard deviation of the parts the better."),
        Criterion.CORRECTIONS: _(
            "The fewer corrections the better, among settings with no more rejects and no worse Ppk than now."
        ),
    }[which]


def cell(figures: Figures, which: Criterion) -> str:
    """The number in a cell of the map."""
    match which:
        case Criterion.PPK:
            return NOTHING if figures.ppk is None else f"{figures.ppk:.2f}"
        case Criterion.SPREAD:
            return NOTHING if figures.spread is None else f"{figures.spread * 1000:.2f}"
        case Criterion.REJECTS:
            return counted(figures.rejects)
        case Criterion.CORRECTIONS:
            return counted(figures.corrections)


def counted(count: int) -> str:
    """A count in four signs at most, so that it fits a cell.

    >>> counted(9999), counted(12_600), counted(1_250_000)
    ('9999', '13k', '1.2M')
    """
    if count < 10_000:
        return str(count)
    return f"{count / 1000:.0f}k" if count < 999_500 else f"{count / 1_000_000:.1f}M"


def setting(name: str, value: float) -> str:
    r"""One of the settings as people read it.

    >>> setting("zero_range", 0.0024), setting("weighting_factor", 2.5)
    ('±2.4\xa0µm', '2.5')
    """
    if name in {"zero_range", "averaging_limit"}:
        return f"±{short(value * 1000)}{NO_BREAK_SPACE}µm"
    return f"{value:+.6g}".replace("-", "−") if name == "factor" else f"{value:.6g}"


def changed(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[tuple[str | None, str, str, str]]:
    """R number, name, before and after of each parameter that changes."""
    return [
        (BY_NAME[name].r, label(name), setting(name, before[name]), setting(name, value))
        for name, value in after.items()
    ]


def proposed(row: ProposalRow) -> list[tuple[str | None, str, str, str]]:
    """Changes of a proposal."""
    return changed(row.proposal.evidence["today"]["settings"], row.proposal.changes)


def stored(kept: Mapping[str, Any]) -> Figures:
    """Figures that were kept as evidence."""
    return Figures(**{name: kept.get(name, 0) for name in Figures._fields})


def quoted(kept: Mapping[str, Any]) -> str:
    """The index that may be quoted, or why there is none; of evidence that was kept before there was one, nothing."""
    if kept.get("quote") is None:
        return NOTHING
    if kept["quoted"] is None:
        return _("none: {why}").format(why=capability.why_not(kept["why_none"]))
    return f"{capability.index_name(kept['quote'])} {capability.index(kept['quoted'])}"


def rows(answer_figures: Sequence[Figures], quotes: Sequence[Mapping[str, Any]] = ()) -> list[tuple[str, list[str]]]:
    """The table side by side: a line a number, a column a replay. quotes: `evidence.quote_of` of each."""

    def line(name: str, word: Callable[[Figures], object]) -> tuple[str, list[str]]:
        return name, [str(word(figures)) for figures in answer_figures]

    def number(value: float | None, decimals: int = 2) -> str:
        return NOTHING if value is None else f"{value:.{decimals}f}"

    return [
        line(_("Corrections"), lambda f: f.corrections),
        line(_("Mean size of one"), lambda f: plain_um(f.mean_size)),
        line(_("Rejects"), lambda f: f.rejects),
        line(_("Ppk (as if normal)"), lambda f: number(f.ppk)),
        (_("Index to report"), [quoted(quote) for quote in quotes]),
        line(_("Spread s"), lambda f: plain_um(f.spread, 2)),
        line(_("Mean deviation"), lambda f: um(f.mean, 2)),
        line(_("Largest deviation"), lambda f: plain_um(f.largest)),
        line(_("Alarms"), lambda f: f.alarms),
        line(_("oversize, undersize"), lambda f: f"{f.oversize}, {f.undersize}"),
        line(_("tool worn, probe fault"), lambda f: f"{f.worn}, {f.faults}"),
        line(_("Corrections held"), lambda f: f.held),
    ]


def gained(today: Figures, other: Figures) -> list[tuple[str, bool | None]]:
    """For each line of `rows` what the other settings change, and whether that is better; None where the readings do not show it."""

    def change(which: Criterion, text: Callable[[float, float], str]) -> tuple[str, bool | None]:
        a, b = value_of(today, which), value_of(other, which)
        if a is None or b is None:
            return "", None
        certain = a != b if which is Criterion.CORRECTIONS else abs(b - a) > room(today, which, a)
        return ("=" if a == b else text(a, b)), ((b > a) == (which is Criterion.PPK) if certain else None)

    def share(a: float, b: float) -> str:
        return f"{signed(100 * (b - a) / a, 0)}{NO_BREAK_SPACE}%" if a else signed(b - a, 0)

    nothing: tuple[str, bool | None] = ("", None)
    alarms = other.alarms - today.alarms
    return [
        change(Criterion.CORRECTIONS, share),
        nothing,
        change(Criterion.REJECTS, lambda a, b: signed(b - a, 0)),
        change(Criterion.PPK, lambda a, b: signed(b - a, 2)),
        nothing,
        change(Criterion.SPREAD, share),
        nothing,
        nothing,
        (signed(alarms, 0) if alarms else "=", None),
        nothing,
        nothing,
        nothing,
    ]


def done(what: str) -> str | None:
    """Confirmation of the last action."""
    return {
        "proposed": _("The change is proposed. An engineer can approve it here."),
        "approved": _("The change is in force as a new version of the parameters."),
        "rejected": _("The proposal is rejected."),
        "withdrawn": _("The proposal is withdrawn."),
    }.get(what)


def status(which: str) -> str:
    """The status of a proposal."""
    return {
        "open": _("Awaits approval"),
        "approved": _("Approved"),
        "rejected": _("Rejected"),
        "withdrawn": _("Withdrawn"),
        "outdated": _("Outdated"),
    }.get(which, which)
