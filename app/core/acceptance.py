"""Acceptance "n of m": a part is good when at least n of its m sections lie in tolerance (domain §6).

The unmanned lathe line touches a bore at three sections and passes the part with two of three
inside; a value on the limit is good. With m = 1 the single value decides, and nothing more is asked.
"""

from collections.abc import Sequence

from app.core.decision.limits import within_tolerance
from app.core.decision.step import deviation_of
from app.core.parameters import Parameters


def accepted(parameters: Parameters, sections: Sequence[float], empirical_value: float = 0.0) -> bool:
    """Tell if enough section values (mm, one per point) lie within the tolerance.

    With ``accept.m`` = 1 the rule is off: zones alone judge, and this is always True.
    """
    if parameters.accept_m == 1:
        return True
    return len(sections) - sections_outside(parameters, sections, empirical_value) >= parameters.accept_n


def sections_outside(parameters: Parameters, sections: Sequence[float], empirical_value: float = 0.0) -> int:
    """Number of sections (values in mm) out of tolerance; the lathe line adds them up in its variable #513."""
    return sum(
        not within_tolerance(deviation_of(value, parameters.target, empirical_value), parameters.limits)
        for value in sections
    )
