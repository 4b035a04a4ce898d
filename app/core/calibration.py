"""Calibration of the probe (domain §5): against a gauge of known size (L92), and in a ring on the spindle.

The empirical value of a memory location R11 is what the machine reads too much: EV = machine reading - true value. It is
taken off every measurement, so a calibration looks at what it does not explain yet, D = R43 - R42 - EV, and treats it
like the deviation of a part (domain §3). The source lists R33, R34 and R36 for L92 without saying what they do there:

=======================  ============================================================================
``|D| <= R33``           nothing is to be changed; the average A is updated and kept
``|D| <= R34``           EV changes by A_new if ``|A_new| > R33``, else A_new is kept
``|D| < R36``            EV changes by D in full
``|D| >= R36``           refused: the probe or the program is wrong; nothing changes
=======================  ============================================================================

with A_new = A - A/k + D/k (R29), which is R49. A begins at 0 with every change of EV.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from math import fsum
from typing import NamedTuple

from app.core.decision.limits import nanometres, reaches, within
from app.core.decision.step import average_of, rounded
from app.core.plausibility import inch_warnings
from app.core.probing import TouchError
from app.core.warning import CodedWarning

SECTIONS = 3  # that the ring calibration of the lathe line touches


class Outcome(StrEnum):
    """Outcome of a calibration. The room `loop.calibration` words the sentence of each."""

    WITHIN_ZERO_RANGE = "within_zero_range"
    AVERAGE_KEPT = "average_kept"
    AVERAGED_DIFFERENCE = "averaged_difference"
    FULL_DIFFERENCE = "full_difference"
    CENTRED = "centred"
    PAIRED = "paired"
    WINDOW = "window"
    PROBE_FAULT = "probe_fault"
    NO_TOUCH = "no_touch"
    NOT_A_BORE = "not_a_bore"
    WRONG_GAUGE = "wrong_gauge"

    @property
    def refused(self) -> bool:
        """Tell if the calibration was refused and changes nothing."""
        return self in {
            Outcome.WINDOW,
            Outcome.PROBE_FAULT,
            Outcome.NO_TOUCH,
            Outcome.NOT_A_BORE,
            Outcome.WRONG_GAUGE,
        }


@dataclass(frozen=True)
class Gauge:
    """Inputs of L92: the gauge and the limits to judge it by; lengths in mm.

    size: R32. path_factor: R28, a probed point is expected within ±1 mm x R28 of the size. weighting_factor: R29.
    zero_range, averaging_limit, confidence_limit: R33, R34, R36.
    """

    size: float
    zero_range: float
    averaging_limit: float
    confidence_limit: float
    weighting_factor: float = 1.0
    path_factor: float = 1.0

    @property
    def window(self) -> float:
        """a, mm: how far from the size a touch may lie."""
        return self.path_factor


class Calibration(NamedTuple):
    """The results of L92, mm.

    size R42, measured R43 (mean of the touches), difference R44 = R43 - R42, average R49.
    deviation: D, what the empirical value in effect does not explain. spread: largest minus smallest touch.
    proposed: the empirical value that follows; None when nothing is to be changed. repeat: the touch outside ±a, from 1.
    """

    outcome: Outcome
    size: float
    measured: float
    difference: float
    deviation: float
    average_before: float
    average: float
    spread: float
    proposed: float | None
    repeat: int | None = None


def calibrate(gauge: Gauge, touches: Sequence[float], *, empirical_value: float, average: float = 0.0) -> Calibration:
    """Calibrate against a gauge of known size (L92), on a free surface or in a groove alike.

    touches: one per repeat (R27), mm. empirical_value: EV in effect. average: A after the calibration before.
    Raises `TouchError` without a touch.

    >>> c = calibrate(Gauge(199.852, 0.001, 0.01, 1.0), [199.8552, 199.8548], empirical_value=0.0)
    >>> c.measured, c.difference, c.outcome.value, c.proposed
    (199.855, 0.003, 'averaged_difference', 0.003)
    """
    if not touches:
        raise TouchError("repeats", point=1, expected=1, got=0)
    measured = rounded(fsum(touches) / len(touches))
    difference = rounded(measured - gauge.size)
    deviation = rounded(difference - empirical_value)
    size, zero = nanometres(deviation), nanometres(gauge.zero_range)

    def result(
        outcome: Outcome, after: float = average, change: float | None = None, repeat: int | None = None
    ) -> Calibration:
        proposed = None if change is None else rounded(empirical_value + change)
        spread = rounded(max(touches) - min(touches))
        return Calibration(
            outcome, gauge.size, measured, difference, deviation, average, rounded(after), spread, proposed, repeat
        )

    for repeat, touch in enumerate(touches, start=1):
        if nanometres(abs(touch - gauge.size)) > nanometres(gauge.window):
            return result(Outcome.WINDOW, repeat=repeat)
    if reaches(size, nanometres(gauge.confidence_limit)):
        return result(Outcome.PROBE_FAULT)
    updated = average_of(average, deviation, gauge.weighting_factor)
    if within(size, zero):
        return result(Outcome.WITHIN_ZERO_RANGE, updated)
    if not within(size, nanometres(gauge.averaging_limit)):
        return result(Outcome.FULL_DIFFERENCE, updated, deviation)
    if within(nanometres(updated), zero):
        return result(Outcome.AVERAGE_KEPT, updated)
    return result(Outcome.AVERAGED_DIFFERENCE, updated, updated)


def untouched(touches: Sequence[float | None], repeats: int | None = None) -> int | None:
    """Return the first repeat at which the probe did not trigger, from 1; None where each one did.

    repeats: R27; fewer touches than that are missing at the end.

    >>> untouched([40.001, None, 40.0]), untouched([40.001], 3), untouched([]), untouched([40.001, 40.0])
    (2, 2, 1, None)
    """
    for repeat, touch in enumerate(touches, start=1):
        if touch is None:
            return repeat
    return len(touches) + 1 if len(touches) < (repeats or 1) else None


def gauge_in_inches(size: float, touches: Sequence[float], known: Sequence[float] = ()) -> list[CodedWarning]:
    """Return a warning where the gauge or its touches look like inches, mm.

    known: sizes that are expected at this place: of its characteristics, and of the gauge before.

    >>> [each.field for each in gauge_in_inches(1.5748, [40.001])], [each.field for each in gauge_in_inches(40.0, [1.5748])]
    (['gauge_size'], ['touches'])
    >>> [each.field for each in gauge_in_inches(1.5748, [1.5749], [40.0])]
    ['gauge_size', 'touches']
    """
    measured = rounded(fsum(touches) / len(touches))
    return inch_warnings(
        [("gauge_size", size, expected) for expected in (measured, *known)]
        + [("touches", measured, expected) for expected in (size, *known)]
    )


@dataclass(frozen=True)
class Ring:
    """The ring on the spindle; mm. smallest, largest: its limits; a diameter on a limit is good.

    radius_term: #502 of the macro, what the tip adds to a position in X (X counts in diameters, so for a tip touching
    with its edge that is the tip's diameter).
    """

    smallest: float
    largest: float
    radius_term: float


class Section(NamedTuple):
    """Positions of X (#5041) at the trigger in +X and in -X, mm."""

    plus: float
    minus: float


class Centring(NamedTuple):
    """Result of a calibration in a ring, mm. diameters: per section, as far as they were measured.

    correction: what the X offset of the probe (#2732) changes by; None when refused. section: the first that lies outside
    the ring's limits, from 1.
    """

    outcome: Outcome
    diameters: tuple[float, ...]
    correction: float | None
    section: int | None = None


def diameter(ring: Ring, section: Section) -> float:
    """(|X+ - X-| + 2 #502)/2, mm: the bore at one section, as the macro computes it.

    >>> diameter(Ring(29.99, 30.01, 6.0), Section(24.012, -23.988))
    30.0
    """
    return rounded((abs(section.plus - section.minus) + 2 * ring.radius_term) / 2)


def centre(ring: Ring, sections: Sequence[Section], *, blocked: bool = False) -> Centring:
    """Calibrate the X offset of the probe in a ring on the spindle.

    blocked: the first move along Z triggered, so it is not a bore. The macro stops at the first section that lies outside
    the limits, so fewer than three sections are complete only then. Raises `TouchError` when sections are missing.

    The macro's ``#140 = #2732-#505+[[#111+#113+#115]/3+#502]``, ``#141 = #2732-#505-[[#112+#114+#116]/3-#502]`` and
    ``#2732 = #2732+[[#140-#141]/2]`` come to half the sum of the two means:

    >>> centre(Ring(29.99, 30.01, 6.0), [Section(24.012, -23.988)] * 3).correction
    0.012
    """
    diameters = tuple(diameter(ring, section) for section in sections)
    if blocked:
        return Centring(Outcome.NOT_A_BORE, diameters, None)
    for number, size in enumerate(diameters, start=1):
        if not nanometres(ring.smallest) <= nanometres(size) <= nanometres(ring.largest):
            return Centring(Outcome.WRONG_GAUGE, diameters, None, number)
    if len(sections) != SECTIONS:
        raise TouchError("points", point=min(len(sections), SECTIONS) + 1, expected=SECTIONS, got=len(sections))
    plus = fsum(section.plus for section in sections) / SECTIONS
    minus = fsum(section.minus for section in sections) / SECTIONS
    return Centring(Outcome.CENTRED, diameters, rounded((plus + minus) / 2))


def ring_in_inches(
    nominal: float, radius_term: float, sections: Sequence[Section], known: Sequence[float] = ()
) -> list[CodedWarning]:
    """Return a warning where the ring, the tip or the touches look like inches, mm.

    known: sizes of the rings before.

    >>> touched = [Section(24.012, -23.988)]
    >>> [[each.field for each in ring_in_inches(*sizes, touched)] for sizes in ((1.1811, 6.0), (30.0, 0.23622))]
    [['nominal'], ['radius_term']]
    >>> [each.field for each in ring_in_inches(30.0, 6.0, [Section(0.94535, -0.94441)])]
    ['sections']
    """
    sizes = [("nominal", nominal, known_size) for known_size in known]
    if sections:
        travel = rounded(fsum(abs(section.plus - section.minus) for section in sections) / (2 * len(sections)))
        sizes += [
            ("nominal", nominal, travel + radius_term),
            ("radius_term", radius_term, nominal - travel),
            ("sections", travel, nominal - radius_term),
        ]
    return inch_warnings((field, size, rounded(expected)) for field, size, expected in sizes)
