"""Suggestion for R33, the zero range, from repeatability: "the largest random deviation of this machine" (domain §2).

A deviation that chance explains must not be corrected: every such correction moves the next part off by as much. So R33
should reach as far as chance does, and no further, because within R33 nothing is corrected. Chance has up to three parts,
added by their squares::

    touching     repeatability of one touch; the mean of R27 touches scatters by 1/sqrt(R27) of it
    signal path  jitter of the signal: between 0 and its greatest error all is as likely, sigma = error/sqrt(12)
    process      what parts differ by though nothing has drifted (moving ranges of neighbouring parts); it
                 contains the other two already, so it replaces them where it is known and larger

The suggestion is 3 sigma (99.73 % of what chance does), not below the error of the signal path itself, rounded up to the
resolution that is asked for.
"""

from dataclasses import dataclass
from enum import StrEnum
from math import ceil, sqrt

from app.core.spc.refusal import Reason, Refused


class Governs(StrEnum):
    """Part of chance that made the suggestion as large as it is."""

    REPEATABILITY = "repeatability"
    SIGNAL_PATH = "signal_path"
    PROCESS = "process"


@dataclass(frozen=True, slots=True)
class Suggestion:
    """R33 in mm, with the sigmas it is made of. `fits`: it leaves room below R34; None where that is not known."""

    zero_range: float
    sigma: float
    touching: float
    signal_path: float
    process: float | None
    floor: float
    governs: Governs
    fits: bool | None


def suggest(
    repeatability: float,
    *,
    repeats: int = 1,
    floor: float = 0.0,
    process: float | None = None,
    averaging_limit: float | None = None,
    coverage: float = 3.0,
    resolution: float = 0.0001,
) -> Suggestion:
    """Suggest R33 from repeatability (sigma of one touch, mm).

    repeats: R27. floor: greatest error of the signal path, mm (`uncertainty.zero_range_floor`). process: sigma of parts
    that follow each other, mm. averaging_limit: R34, mm. coverage: how many sigma count as chance.

    >>> s = suggest(0.0005, repeats=2, floor=0.000625)
    >>> s.zero_range, s.governs.value
    (0.0012, 'repeatability')
    >>> suggest(0.0005, repeats=2, floor=0.000625, process=0.001, averaging_limit=0.005).zero_range
    0.003
    """
    if not (repeatability > 0 and repeats >= 1 and floor >= 0 and coverage > 0 and resolution > 0):
        raise Refused(Reason.NO_VARIATION)
    touching, path = repeatability / sqrt(repeats), floor / sqrt(12)
    measured = sqrt(touching**2 + path**2)
    sigma = max(measured, process or 0.0)
    reach = max(coverage * sigma, floor)
    if process is not None and process > measured:
        governs = Governs.PROCESS
    else:
        governs = Governs.REPEATABILITY if touching >= path else Governs.SIGNAL_PATH
    steps = ceil(round(reach / resolution, 6))
    zero_range = round(steps * resolution, 9)
    return Suggestion(
        zero_range=zero_range,
        sigma=sigma,
        touching=touching,
        signal_path=path,
        process=process,
        floor=floor,
        governs=governs,
        fits=None if averaging_limit is None else zero_range < averaging_limit,
    )
