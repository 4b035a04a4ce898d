"""Size that the name of a characteristic tells, as a proposal to a person: a nominal with its tolerance class, or the nominal alone."""

import re

from app.core.fits import fit_of
from app.core.number_text import number_or_none

_FIT = re.compile(r"(?<![\w.,/-])([ØøΦφ⌀]?\s?[0-9.,]{1,20}\s?([A-Z]{1,2}|[a-z]{1,2})([1-9][0-9]?))(?!\w|[.,]\d|\s?/)")
_NOMINAL = re.compile(
    r"""(?: ([ØøΦφ⌀])
        | (?<!\w)(?:diameter|dia\.?|durchmesser|premer|prečnik|bore|bohrung|shaft|welle|seat|sitz|izvrtina|otvor) )
        \s?([0-9]{1,4}(?:[.,][0-9]{1,6})?)(?![\w.,/]|-\w|\s?\d|\s?in\b)""",
    re.IGNORECASE | re.VERBOSE,
)
_COUNTED = re.compile(
    r"(?<!\w)(?:nest|pos|position|station|cavity|spindle|spindel|pallet|palette|op|no|nr|line|part|rev|run)\.?\s?$",
    re.IGNORECASE,
)
_NOT_A_DIAMETER = re.compile(
    "depth|tiefe|distance|abstand|length|länge|angle|winkel|chamfer|fase|position of|position [ø⌀]"
    "|coaxial|koaxial|concentric|run-?out|rundlauf|round|rund|cylindric|straight|flat|parallel|perpendic|rechtwinklig",
    re.IGNORECASE,
)
_NOT_MM = re.compile(r"inch|zoll|[0-9]\s?(?:[\"″”]|(?:in(?!\s\w)|mil|thou|µm|μm|um|cm)\b)", re.IGNORECASE)
_FINEST = {"A": 9, "B": 8, "C": 8, "Z": 6}
"""Grade from which drawings have this letter; others from 6 on for holes, from 5 on for shafts. What is finer names a place: nest 3 B2."""
_LEAST_UNSAID = 10
"""mm; a smaller whole number behind *bore* may count bores as well as measure one."""
_THOUSANDS = re.compile(r"[1-9][.,][0-9]{3}")
"""1.000 and 2,500 are thousands to some, and not to others."""


def size_in_name(name: str) -> dict[str, float]:
    """Nominal and deviations, mm, or the nominal alone; nothing where the name is of several sizes, of another unit, or of no diameter.

    >>> size_in_name("Bore 30 H7"), size_in_name("Seat Ø4"), size_in_name("Bore 30")
    ({'nominal': 30.0, 'upper_deviation': 0.021, 'lower_deviation': 0.0}, {'nominal': 4.0}, {'nominal': 30.0})
    >>> size_in_name("Bore 2"), size_in_name("Seat 40 h6 to 30 h6"), size_in_name("Nest 3 B2"), size_in_name("Bore Ø1.5 inch")
    ({}, {}, {}, {})
    """
    if _NOT_A_DIAMETER.search(name) or _NOT_MM.search(name):
        return {}
    fits = [
        fit
        for found in _FIT.finditer(name)
        if int(found[3]) >= _finest(found[2])
        and not _COUNTED.search(name[max(0, found.start() - 12) : found.start()])
        and (fit := fit_of(found[1])) is not None
    ]
    if fits:
        return fits[0]._asdict() if len(fits) == 1 else {}
    sizes = [
        nominal
        for sign, text in _NOMINAL.findall(name)
        if not _THOUSANDS.fullmatch(text)
        and (nominal := number_or_none(text))
        and (sign or nominal >= _LEAST_UNSAID or not text.isdecimal())
    ]
    return {"nominal": sizes[0]} if len(sizes) == 1 else {}


def _finest(letter: str) -> int:
    return _FINEST.get(letter.upper(), 6 if letter.isupper() else 5)
