"""The sentences of the what-if: what is assumed, how far it can be believed, what a map shows. Lengths in mm."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any

from app.capability.wording import named
from app.characteristics.wording import label
from app.core.parameters import BY_NAME
from app.core.policy_map import Criterion, room, value_of
from app.core.replay import Figures
from app.core.spc.refusal import Reason, Refused
from app.web.i18n import _, ngettext
from app.web.numbers import NO_BREAK_SPACE, NOTHING, signed, um

if TYPE_CHECKING:
    from app.core.effect import Effect
    from app.whatif.past import Past
    from app.whatif.proposals import Row
    from app.whatif.queries import Likeness


def plain_um(length: float | None, decimals: int = 1) -> str:
    r"""A length without sign in µm.

    >>> plain_um(0.0011), plain_um(None)
    ('1.1\xa0µm', '–')
    """
    return NOTHING if length is None else f"{length * 1000:.{decimals}f}{NO_BREAK_SPACE}µm"


def short_um(length: float) -> str:
    """A limit in µm with no more decimals than it needs, without its unit.

    >>> short_um(0.0053), short_um(0.004)
    ('5.3', '4')
    """
    return f"{length * 1000:.6g}"


def likeness(found: Likeness) -> str:
    """How well the rebuilt loop follows what truly happened."""
    if found.off is None:
        return _("There is nothing to hold the replay against.")
    said = {
        "well": _("The rebuilt loop does what the real one did."),
        "roughly": _("The rebuilt loop does roughly what the real one did: trust differences, not the last digit."),
        "badly": _(
            "The rebuilt loop does not do what the real one did: something is at work that it knows nothing of. "
            "Do not decide by this replay."
        ),
        "unknown": _("There are too few readings to say how well the rebuilt loop does what the real one did."),
    }[found.verdict]
    return (
        said
        + " "
        + _(
            "Set as it was then, its parts lie {off} (root mean square) from the true ones; {same} of them are the same."
        ).format(off=plain_um(found.off, 2), same=percent(found.same))
    )


def percent(share: float | None) -> str:
    r"""A share of 1 in whole per cent.

    >>> percent(0.956)
    '96\xa0%'
    """
    return NOTHING if share is None else f"{100 * share:.0f}{NO_BREAK_SPACE}%"


def assumed(share: float, delay: int) -> str:
    """What the replay assumes of corrections."""
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


def effect(found: Effect) -> str:
    """What corrections do on this machine."""
    said = _(
        "On this machine a correction of 10 µm moves the part by {value} µm ({low}…{high}), by {count} corrections."
    ).format(
        value=f"{10 * found.value:.1f}",
        low=f"{10 * found.low:.1f}",
        high=f"{10 * found.high:.1f}",
        count=found.corrections,
    )
    if found.is_full:
        return said + " " + _("That they act in full, as is assumed here, agrees with it.")
    return (
        said
        + " "
        + (
            _(
                "They act by less than in full: replay with the measured effect, and look for play, a soft set-up or a wrong factor."
            )
            if found.value < 1
            else _("They act by more than in full: replay with the measured effect, and look at the factor.")
        )
    )


def effect_unknown(refused: Refused, sentence: str) -> str:
    """Why nobody can say whether corrections act in full."""
    if refused.reason is Reason.INCOMPLETE_STUDY:
        sentence = ngettext(
            "%(num)d correction took effect in this period; it takes %(needed)d.",
            "%(num)d corrections took effect in this period; it takes %(needed)d.",
            refused.have,
        ) % {"num": refused.have, "needed": refused.needed}
    return _("Whether corrections act in full, as is assumed here, these readings do not tell.") + " " + sentence


def cautions(past: Past) -> list[str]:
    """What the replay does not know, as far as it matters here."""
    parameters = past.standing.parameters
    found: list[str] = []
    if parameters.measures_only:
        found.append(_("This characteristic only measures: no settings make a difference."))
    if past.unknown:
        found.append(
            ngettext(
                "%(num)d reading is left out: nobody knows with which corrections its part was cut.",
                "%(num)d readings are left out: nobody knows with which corrections their parts were cut.",
                past.unknown,
            )
            % {"num": past.unknown}
        )
    found += left_out(past)
    if past.others:
        found.append(
            _("The tool is corrected by {others} as well; they are replayed with it, set as they were.").format(
                others=", ".join(past.others[:5])
            )
        )
    if len(past.versions) > 1:
        found.append(
            _(
                "The parameters changed in this period (versions {first} to {last}): “today” is today's set throughout."
            ).format(first=past.versions[0], last=past.versions[-1])
        )
    if parameters.accept_m > 1:
        found.append(
            _("Which parts were accepted by {n} of {m} sections is taken from then.").format(
                n=parameters.accept_n, m=parameters.accept_m
            )
        )
    if parameters.mode.value == "approval":
        found.append(_("Corrections wait for a person here; in the replay all of them wait equally long."))
    if past.delays and (past.delays.high > past.delays.usual + 1 or past.delays.low < past.delays.usual - 1):
        found.append(
            _(
                "Corrections did not take effect equally soon: nine of ten after {low} to {high} more parts with the old "
                "offset. The replay takes one delay for all of them, so not every part is as it was."
            ).format(low=past.delays.low, high=past.delays.high)
        )
    return found


def left_out(past: Past) -> list[str]:
    """Readings that count for nothing, or for less than the others, by their numbers."""
    said = {
        "excluded": _("Left out, as somebody has excluded them: readings {which}."),
        "faults": _("Left out, as probe faults: readings {which}."),
        "worn": _(
            "In the wear zone, where a person decides: readings {which}. They count as rejects; mean, spread and Ppk are without them."
        ),
    }
    return [said[name].format(which=named(numbers)) for name, numbers in past.named().items() if numbers]


def out_of_order(zero_range: float, averaging_limit: float) -> str:
    """Why a cell of the map is blank."""
    return _("R33 {r33} must be smaller than R34 {r34}").format(
        r33=plain_um(zero_range, 2), r34=plain_um(averaging_limit, 2)
    )


def criterion(which: Criterion) -> str:
    """What is looked for."""
    return {
        Criterion.PPK: _("Ppk"),
        Criterion.REJECTS: _("Rejects"),
        Criterion.SPREAD: _("Spread s"),
        Criterion.CORRECTIONS: _("Corrections"),
    }[which]


def criterion_explained(which: Criterion) -> str:
    """What counts as best."""
    return {
        Criterion.PPK: _("The larger Ppk the better."),
        Criterion.REJECTS: _("The fewer parts out of tolerance the better."),
        Criterion.SPREAD: _("The smaller the standard deviation of the parts the better."),
        Criterion.CORRECTIONS: _(
            "The fewer corrections the better, among settings that reject no more than today's and have no worse Ppk."
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
        return f"±{short_um(value)}{NO_BREAK_SPACE}µm"
    return f"{value:+.6g}".replace("-", "−") if name == "factor" else f"{value:.6g}"


def changed(before: Mapping[str, Any], after: Mapping[str, Any]) -> list[tuple[str | None, str, str, str]]:
    """R number, name, before and after of each parameter that changes."""
    return [
        (BY_NAME[name].r, label(name), setting(name, before[name]), setting(name, value))
        for name, value in after.items()
    ]


def proposed(row: Row) -> list[tuple[str | None, str, str, str]]:
    """What a proposal changes."""
    return changed(row.proposal.evidence["today"]["settings"], row.proposal.changes)


def stored(kept: Mapping[str, Any]) -> Figures:
    """Figures that were kept as evidence."""
    return Figures(**{name: kept.get(name, 0) for name in Figures._fields})


def rows(answer_figures: Sequence[Figures]) -> list[tuple[str, list[str]]]:
    """The table side by side: a line a number, a column a replay."""

    def line(name: str, word: Callable[[Figures], object]) -> tuple[str, list[str]]:
        return name, [str(word(each)) for each in answer_figures]

    def number(value: float | None, decimals: int = 2) -> str:
        return NOTHING if value is None else f"{value:.{decimals}f}"

    return [
        line(_("Corrections"), lambda f: f.corrections),
        line(_("Mean size of one"), lambda f: plain_um(f.mean_size)),
        line(_("Rejects"), lambda f: f.rejects),
        line(_("Ppk"), lambda f: number(f.ppk)),
        line(_("Spread s"), lambda f: plain_um(f.spread, 2)),
        line(_("Mean deviation"), lambda f: um(f.mean, 2)),
        line(_("Largest deviation"), lambda f: plain_um(f.largest)),
        line(_("Alarms"), lambda f: f.alarms),
        line(_("oversize, undersize"), lambda f: f"{f.oversize}, {f.undersize}"),
        line(_("tool worn, probe fault"), lambda f: f"{f.worn}, {f.faults}"),
        line(_("Corrections held"), lambda f: f.held),
    ]


def gained(today: Figures, other: Figures) -> list[tuple[str, bool | None]]:
    """For each line of `rows` what the other settings change, and whether that is better; None where it cannot be told."""

    def told(which: Criterion, text: Callable[[float, float], str]) -> tuple[str, bool | None]:
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
        told(Criterion.CORRECTIONS, share),
        nothing,
        told(Criterion.REJECTS, lambda a, b: signed(b - a, 0)),
        told(Criterion.PPK, lambda a, b: signed(b - a, 2)),
        told(Criterion.SPREAD, share),
        nothing,
        nothing,
        (signed(alarms, 0) if alarms else "=", None),
        nothing,
        nothing,
        nothing,
    ]


def done(what: str) -> str | None:
    """What has just been done."""
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
