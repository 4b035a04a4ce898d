"""Sentences about proposed sampling."""

from app.core.sampling import CAPABLE, FEWEST, Hindrance
from app.language.i18n import _


def hindrance(which: Hindrance) -> str:
    """The reason why every part is to be measured."""
    return {
        Hindrance.FEW_READINGS: _("There are fewer than {n} readings.").format(n=FEWEST),
        Hindrance.UNSTABLE: _("The process is not stable, or too little is known to say so."),
        Hindrance.OPEN_SIGNAL: _("A signal of the control chart is open."),
        Hindrance.NOT_CAPABLE: _("The lower end of the capability index is below {n}.").format(n=CAPABLE),
        Hindrance.WEAR_UNKNOWN: _("The wear of the tool is not known yet."),
    }[which]


def too_few() -> str:
    """Refusal of a characteristic whose readings carry no index."""
    return _("has too few readings, or too coarse ones, for a proposal")
