"""Sentences about the strata of a capability study."""

from app.core.spc.strata import Difference, NoAnswer
from app.language.formatting import plain_um
from app.language.i18n import _, ngettext
from app.quality.capability.strata_queries import StrataStudy
from app.quality.capability.wording import p_value


def answer_words(found: StrataStudy) -> str:
    """The answer to whether they differ, in a sentence or two."""
    answer = found.answer
    match answer:
        case NoAnswer.ONE:
            return _("There are no two of them to compare.")
        case NoAnswer.APART:
            return _(
                "They were made one after the other: it cannot be determined what differs between them from what drifted meanwhile. It takes "
                "readings of several of them side by side, in five places and more."
            )
        case NoAnswer.NO_VARIATION:
            return _("The readings do not vary enough to say whether they differ.")
    assert isinstance(answer, Difference)
    numbers = f"F({answer.test.freedom}, {answer.test.freedom_error}) = {answer.test.statistic:.2f}, {p_value(answer.test.p_value)}"
    if not answer.test.significant:
        return _("Nothing says that they differ ({numbers}).").format(numbers=numbers)
    if answer.apart is None:
        return _("They differ ({numbers}).").format(numbers=numbers)
    return _("They differ: side by side, the furthest two lie {apart} apart ({numbers}).").format(
        apart=plain_um(answer.apart, 2), numbers=numbers
    )


def left_out_words(found: StrataStudy) -> list[str]:
    """Sentences about the readings that are in no line of the table."""
    words = []
    if found.without:
        words.append(
            ngettext("{n} reading names none.", "{n} readings name none.", found.without).format(n=found.without)
        )
    if found.older:
        words.append(
            ngettext(
                "{n} reading belongs to older ones, which are not listed.",
                "{n} readings belong to older ones, which are not listed.",
                found.older,
            ).format(n=found.older)
        )
    return words
