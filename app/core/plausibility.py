"""A jump that neither wear nor scatter explains: a wrong part, a wrong tool, a chip on the stylus.

Readings of a closed loop jump with every correction, so they are looked at with the corrections taken out again: what
remains is the course that wear and heat would have taken, and that has no jumps. The level is where this course is expected
to go on: an exponentially weighted average with lambda = 1/2 (Roberts 1959), because it must follow wear and heat at once
and need not filter, with one reading weighed against a limit of several standard deviations.
"""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from math import sqrt
from statistics import fmean, median

from app.core.decision.limits import nanometres
from app.core.decision.step import rounded
from app.core.warning import CodedWarning, Value

INCH = 25.4
PAIR_APART = 1.0  # mm; the same part measured twice differs by micrometres
UNIT_SLACK = 0.05  # by which a ratio may differ from 25.4
OFFSET_STEP = 10.0  # mm; by hand an offset is set by less, unless the tool is another one
EMPIRICAL_VALUE = 1.0  # mm; what is taken off every measurement is micrometres
WEIGHT = 0.5  # lambda: of the newest reading in the level
SIGMAS = 6.0  # of the scatter that a plausible jump may have
D4 = 0.954  # median moving range of two readings over their standard deviation (Shewhart's d4 for n = 2)
FEWEST = 10  # readings from which a jump may be suggested


def uncorrected(deviation: float, compensated: float, factor: float) -> float:
    """Deviation without the corrections in effect when the part was cut, mm: D + compensated / factor.

    An offset correction of `a` changes the size by -a / factor, so taking it out adds a / factor.

    >>> uncorrected(0.002, -0.006, factor=-1)
    0.008
    >>> uncorrected(0.002, 0.003, factor=0.5)
    0.008
    """
    return rounded(deviation + compensated / factor)


def looks_like_inches(value: float, expected: float) -> bool:
    """Return whether a value is the expected one in inches, both taken for mm.

    >>> looks_like_inches(1.5748, 40.0), looks_like_inches(39.9, 40.0), looks_like_inches(0.0, 0.0)
    (True, False, False)
    """
    return value * expected > 0 and abs(value * INCH / expected - 1) < UNIT_SLACK


def looks_like_micrometres(value: float, expected: float) -> bool:
    """Return whether a value is the expected one in micrometres, both taken for mm.

    >>> looks_like_micrometres(39998.1, 40.0), looks_like_micrometres(40.0, 40.0)
    (True, False)
    """
    return value * expected > 0 and abs(value / expected / 1000 - 1) < UNIT_SLACK


def inch_warnings(sizes: Iterable[tuple[str, float, float]]) -> list[CodedWarning]:
    """Return a warning for each field whose size is the expected one in inches, at most one a field.

    sizes: the field, its size and the size expected there, mm.

    >>> [each.field for each in inch_warnings([("gauge_size", 1.5748, 40.001), ("touches", 40.001, 1.5748)])]
    ['gauge_size']
    """
    warnings: dict[str, CodedWarning] = {}
    for field, size, expected in sizes:
        if field not in warnings and looks_like_inches(size, expected):
            values: dict[str, Value] = {"which": "size", "size": size, "expected": expected}
            warnings[field] = CodedWarning("looks_like_inches", values, field)
    return list(warnings.values())


def pair_warnings(machine_value: float, external_value: float, sizes: Iterable[float] = ()) -> list[CodedWarning]:
    """Return what may be wrong with one part measured on the machine and on an external gauge, mm.

    sizes: of the characteristics that the pair serves.

    >>> [each.code for each in pair_warnings(40.001, 1.5748)], [each.code for each in pair_warnings(40.001, 30.002)]
    (['looks_like_inches'], ['pair_apart'])
    """
    values = {"machine_value": machine_value, "external_value": external_value}
    against = [*values.values(), *sizes]
    inches = inch_warnings((field, value, expected) for field, value in values.items() for expected in against)
    if inches or abs(machine_value - external_value) <= PAIR_APART:
        return inches
    apart = {"off": round(abs(machine_value - external_value), 9), "limit": PAIR_APART}
    return [CodedWarning("pair_apart", apart, "external_value")]


def offset_warnings(before: float, after: float) -> list[CodedWarning]:
    """Return the warning of an offset set by hand that is far from the one before, mm: 400 for 0.4, or 4.7244 for 120.

    >>> [each.code for each in offset_warnings(0.38, 400.0)], offset_warnings(0.38, 0.4)
    (['offset_step'], [])
    >>> [each.code for each in offset_warnings(120.0, 4.7244)]
    ['looks_like_inches']
    """
    step = abs(after - before)
    if step > OFFSET_STEP and (inches := inch_warnings([("offset", after, before)])):
        return inches
    values = {"before": before, "after": after, "limit": OFFSET_STEP}
    return [CodedWarning("offset_step", values, "offset")] if step > OFFSET_STEP else []


def empirical_value_warnings(value: float, before: float = 0.0, half: float | None = None) -> list[CodedWarning]:
    """Return the warning of an empirical value that no probe has, or that moves every size out of its tolerance, mm.

    before: the value until now; half: distance from the target to the limits of the tightest characteristic at this place.

    >>> [each.code for each in empirical_value_warnings(2.6)], empirical_value_warnings(0.4)
    (['empirical_value_large'], [])
    >>> [each.code for each in empirical_value_warnings(0.4, 0.002, half=0.02)], empirical_value_warnings(0.41, 0.4, half=0.02)
    (['empirical_value_step'], [])
    """
    if abs(value) > EMPIRICAL_VALUE:
        return [CodedWarning("empirical_value_large", {"value": value, "limit": EMPIRICAL_VALUE}, "empirical_value")]
    if half is None or nanometres(abs(value - before)) <= nanometres(half):
        return []
    return [CodedWarning("empirical_value_step", {"before": before, "after": value, "limit": half}, "empirical_value")]


def is_jump(now: float, level: float | None, allowed: float) -> bool:
    """Tell if a reading lies further than ``allowed`` from the level. Without a level nothing is a jump.

    >>> is_jump(0.021, 0.001, allowed=0.02), is_jump(0.0211, 0.001, allowed=0.02), is_jump(5.0, None, allowed=0.02)
    (False, True, False)
    """
    return level is not None and abs(nanometres(now - level)) > nanometres(allowed)


def is_doubtful(deviation: float, half: float, wear_limit: float, natural_side: int = 0) -> bool:
    """Tell if a size that a person typed is asked about before it is taken: it is more likely a slip of the finger.

    It lies off by more than the whole tolerance, or as far as a worn tool, or beyond a natural limit. half: distance from the
    target to the limits, mm; natural_side: of the natural limit, -1 below, 1 above.

    >>> is_doubtful(0.012, 0.008, 0.3), is_doubtful(-0.0161, 0.008, 0.3), is_doubtful(-0.001, 0.01, 0.3, -1)
    (False, True, True)
    """
    off = nanometres(abs(deviation))
    return off > nanometres(2 * half) or off >= nanometres(wear_limit) or nanometres(deviation) * natural_side > 0


def moved(level: float | None, now: float) -> float:
    """The level after a plausible reading: level + (reading - level) / 2, from the first reading on.

    >>> moved(None, 0.004), moved(0.004, 0.006)
    (0.004, 0.005)
    """
    return now if level is None else level + WEIGHT * (now - level)


def suggested_jump(readings: Sequence[float]) -> float | None:
    """A setting that scatter and wear as they were do not reach, mm; None for fewer than ten readings, or without any.

    readings: the course without corrections (`uncorrected`), oldest first, mm.

    6 sigma sqrt(1 + lambda / (2 - lambda)) + \\|w\\| / lambda with lambda = 1/2. sigma: the median moving range over d4 = 0.954,
    which one chip among the readings does not move; the root: the level scatters, too; the rest: how far the level lags behind
    a wear of w per part, the step between the means of the first and the second half. Rounded up to a tenth of a micrometre.

    >>> suggested_jump([0.0, 0.001] * 8)
    0.0073
    """
    if len(readings) < FEWEST:
        return None
    sigma = median(abs(later - earlier) for earlier, later in pairwise(readings)) / D4
    half = len(readings) // 2
    wear = (fmean(readings[-half:]) - fmean(readings[:half])) / (len(readings) - half)
    allowed = SIGMAS * sigma * sqrt(1 + WEIGHT / (2 - WEIGHT)) + abs(wear) / WEIGHT
    return -(-nanometres(allowed) // 100) / 10_000 or None
