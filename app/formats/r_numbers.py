"""R parameters as program text writes them: one per line or several in a block, with comments."""

import re

from app.formats.values import Unreadable, number
from app.web.i18n import _

_COMMENT = re.compile(r";.*|\([^)]*\)")
_R = re.compile(r"\bR0*(\d{1,3})\s*=\s*([^\s;(]+)", re.IGNORECASE)


def read(text: str) -> dict[str, float]:
    """The R parameters of a text; the last assignment counts, as in a program.

    Raises `Unreadable` naming the line of a value that is not a number, or when there is none at all.

    >>> read("N10 R33=0.001 R34=0,0053 ; scatter\\nL93")
    {'R33': 0.001, 'R34': 0.0053}
    """
    found: dict[str, float] = {}
    for line_number, line in enumerate(text.splitlines(), start=1):
        for name, value in _R.findall(_COMMENT.sub(" ", line)):
            try:
                found[f"R{int(name):02}"] = number(value, "," if "," in value else ".")
            except Unreadable as error:
                raise Unreadable(
                    _("line {line}: R{name}={value} {reason}").format(
                        line=line_number, name=name, value=value, reason=error
                    )
                ) from None
    if not found:
        raise Unreadable(_("There are no R parameters such as R33=0.001 in it."))
    return found
