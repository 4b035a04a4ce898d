"""A compensated process without its compensation, and with an ideal one.

Corrections make two questions of one. What left the machine is the deviations as they are: their spread holds scatter, wear
that was not yet corrected, and whatever the corrections added. What the tool did is the wear curve (`core.wear`): each
deviation with the corrections that were in effect taken out again. Its overall spread is that of a machine which nobody
corrects, wear included; its scatter from part to part is what remains if wear were corrected ideally, which no policy beats::

    sigma_tool   standard deviation of all w
    sigma_ideal  mean range of neighbours within one tool life / d2(2), ranges beyond four times the mean left out
    gain         sigma_tool / sigma_controlled
    price        sigma_controlled / sigma_ideal: 1 is ideal, more is what the corrections leave or add
"""

from dataclasses import dataclass
from math import fsum

import numpy as np
from numpy.typing import NDArray

from app.core.spc.capability import FEWEST_READINGS, Caution, Index, Limits, capability, spread_index
from app.core.spc.constants import d2
from app.core.spc.refusal import Floats, Reason, Refused, checked
from app.core.spc.spread import Estimator, Sigma, freedom_of_moving_ranges, overall, without_steps
from app.core.spc.variation import varies

Flags = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Uncompensated:
    """lives: tool lives that readings were left of. ppk: of the tool that nobody corrects. ideal: Cp of scatter alone, centred.

    price and gain as above; gain below 1 says that the corrections made it worse.
    """

    readings: int
    lives: int
    mean: float
    tool: Sigma
    ideal_sigma: Sigma
    ppk: Index
    ideal: Index | None
    gain: float
    price: float
    cautions: tuple[Caution, ...]


def uncompensated(
    values: Floats, begins: Flags, controlled: Floats, limits: Limits, *, confidence: float = 0.95
) -> Uncompensated:
    """`values`: the wear curve, mm; a tool life begins where `begins`. `controlled`: deviations of the same readings.

    >>> rng = np.sin(np.arange(1, 201) ** 2) / 1000
    >>> wearing = np.arange(200) % 100 / 10000 + rng
    >>> found = uncompensated(wearing, np.arange(200) % 100 == 0, rng, Limits(-0.01, 0.01))
    >>> found.lives, found.gain > 3, found.price < 1.5
    (2, True, True)
    """
    whole = checked(values, at_least=FEWEST_READINGS)
    ideal = scatter(whole, begins)
    now, tool = overall(controlled), overall(whole)
    if not (varies(now.value, controlled) and varies(tool.value, whole)):
        raise Refused(Reason.NO_VARIATION)
    indices = capability(whole, limits, confidence=confidence)
    return Uncompensated(
        readings=len(whole),
        lives=len(_lengths(begins)),
        mean=indices.mean,
        tool=tool,
        ideal_sigma=ideal,
        ppk=indices.ppk,
        ideal=spread_index(limits, ideal, confidence),
        gain=tool.value / now.value,
        price=now.value / ideal.value,
        cautions=indices.cautions,
    )


def scatter(values: Floats, begins: Flags) -> Sigma:
    """Sigma from part to part within each life, steps left out. A life begins where `begins`, and with the first value.

    >>> values = np.array([0.0, 1.128379, 0.0, 50.0, 51.128379])
    >>> scatter(values, np.array([True, False, False, True, False])).value.__round__(3)
    1.0
    """
    ranges = without_steps(np.abs(np.diff(values))[~begins[1:]])
    if not len(ranges) or not varies(float(ranges.mean()), values):
        raise Refused(Reason.NO_VARIATION)
    lengths, lives = np.unique(_lengths(begins), return_counts=True)  # a million readings may be thousands of lives
    freedom = fsum(
        many * freedom_of_moving_ranges(length)
        for length, many in zip(lengths.tolist(), lives.tolist(), strict=True)
        if length > 1
    )
    return Sigma(float(ranges.mean()) / d2(2), Estimator.MOVING_RANGE, len(values), len(ranges), freedom)


def _lengths(begins: Flags) -> NDArray[np.int64]:
    """Readings of each life."""
    starts = np.flatnonzero(begins[1:]) + 1
    return np.diff(np.concatenate(([0], starts, [len(begins)]))) if len(begins) else starts
