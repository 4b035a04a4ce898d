"""False alarms of a rule: on independent, normally distributed points about the right centre.

Two numbers. *Per window*: the probability that any n points in a row show the pattern, as Nelson tabulates it (Interpreting
Shewhart X-bar control charts, J. Qual. Technol. 17 (1985) 114-116). *Average run length*: after how many points the first
signal comes on average; exact, from a Markov chain over what the rules remember (Champ and Woodall, Exact results for
Shewhart control charts with supplementary runs rules, Technometrics 29 (1987) 393-399), for steps (rules 3 and 4, which
know no limits) from integral equations over the rank of the last point.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from math import comb, factorial

import numpy as np
from scipy.sparse import csc_array, eye_array
from scipy.sparse.linalg import spsolve
from scipy.special import ndtr

from app.core.spc.refusal import Floats, Reason, Refused
from app.core.spc.rules import Rule, RuleKind, RuleName

STEPS = {RuleKind.TREND, RuleKind.ALTERNATING}
MOST_STATES = 60_000


@dataclass(frozen=True, slots=True)
class Chance:
    """Rate at which one rule fires by chance."""

    rule: RuleName
    per_window: float
    average_run_length: float


@cache
def chance(rule: Rule) -> Chance:
    """Rate at which a rule fires on a process that is in control.

    >>> from app.core.spc.rules import RULES
    >>> nelson_2 = chance(RULES[RuleName.NELSON_2])
    >>> round(nelson_2.per_window, 5), round(nelson_2.average_run_length)
    (0.00391, 511)
    """
    length = _steps_length(rule) if rule.kind in STEPS else average_run_length([rule])
    return Chance(rule.name, per_window(rule), length)


def per_window(rule: Rule) -> float:
    """The probability that n independent points in a row show the pattern."""
    n, inside = rule.n, float(1 - 2 * ndtr(-rule.limit))
    match rule.kind:
        case RuleKind.BEYOND:
            p = float(ndtr(-rule.limit))
            above = sum(comb(n, j) * p**j * (1 - p) ** (n - j) for j in range(rule.k, n + 1))
            # Both sides at once: needs 2k <= n.
            both = sum(
                comb(n, i) * comb(n - i, j) * p ** (i + j) * (1 - 2 * p) ** (n - i - j)
                for i in range(rule.k, n + 1)
                for j in range(rule.k, n - i + 1)
            )
            return 2 * above - both
        case RuleKind.SIDE:
            return 2.0 ** (1 - n)
        case RuleKind.TREND:
            return 2 / factorial(n)
        case RuleKind.ALTERNATING:
            return 2 * _zigzag(n) / factorial(n)
        case RuleKind.WITHIN:
            return inside**n
        case RuleKind.OUTSIDE:
            return (1 - inside) ** n


def _zigzag(n: int) -> int:
    """Number of orders of n values that alternate, beginning with a rise (Euler's zigzag numbers), by Seidel's triangle."""
    row = [1]
    for _ in range(n - 1):
        sums = [0]
        for value in reversed(row):
            sums.append(sums[-1] + value)
        row = sums
    return sum(row)


def average_run_length(rules: Iterable[Rule], shift: float = 0.0) -> float:
    """Average number of points until the first of these rules fires; `shift` of the mean in sigma.

    Raises `Refused` with rules that look at steps, or with so many that the chain would not end.

    >>> from app.core.spc.rules import WESTERN_ELECTRIC
    >>> round(average_run_length(WESTERN_ELECTRIC), 2)
    91.75
    """
    watched = tuple(rules)
    if not watched:
        return float("inf")
    if any(rule.kind in STEPS for rule in watched):
        raise Refused(Reason.BEYOND_RANGE)
    edges = sorted({0.0, *(rule.limit for rule in watched), *(-rule.limit for rule in watched)})
    probabilities = np.diff(np.concatenate(([0.0], ndtr(np.array(edges) - shift), [1.0])))
    middles = [edges[0] - 1, *((a + b) / 2 for a, b in pairwise(edges)), edges[-1] + 1]
    start = tuple((0, 0) for _rule in watched)
    number = {start: 0}
    todo = [start]
    rows, columns, shares = [], [], []
    for state in todo:  # grows while it is walked
        for value, share in zip(middles, probabilities, strict=True):
            after = _after(watched, state, value)
            if after is None:
                continue
            if after not in number:
                number[after] = len(todo)
                todo.append(after)
            rows.append(number[state])
            columns.append(number[after])
            shares.append(float(share))
        if len(todo) > MOST_STATES:
            raise Refused(Reason.BEYOND_RANGE)
    count = len(todo)
    if (np.bincount(rows, shares, minlength=count) >= 1.0).all():  # no state ends within what numbers resolve
        return float("inf")
    chain = csc_array((shares, (rows, columns)), shape=(count, count))
    lengths = spsolve(csc_array(eye_array(count)) - chain, np.ones(count))
    return float(np.atleast_1d(lengths)[0])


Memory = tuple[tuple[int, int], ...]


def _after(rules: tuple[Rule, ...], state: Memory, value: float) -> Memory | None:
    """Memory of the rules after a point at `value`; None when one of them fires."""
    result = []
    for rule, (first, second) in zip(rules, state, strict=True):
        if rule.kind is RuleKind.BEYOND:
            mask = (1 << (rule.n - 1)) - 1
            sides = []
            for bits, beyond in ((first, value > rule.limit), (second, value < -rule.limit)):
                window = bits << 1 | beyond
                if beyond and window.bit_count() >= rule.k:
                    return None
                sides.append(window & mask)
            result.append((sides[0], sides[1]))
            continue
        if rule.kind is RuleKind.SIDE:
            code = 1 if value > 0 else -1
        else:
            code = int((abs(value) <= rule.limit) == (rule.kind is RuleKind.WITHIN))
        length = 0 if code == 0 else second + 1 if code == first else 1
        if length >= rule.n:
            return None
        result.append((code if length else 0, length))
    return tuple(result)


def _steps_length(rule: Rule, nodes: int = 24) -> float:
    """Average run length of a rule about steps.

    f_k(u): points still to come after a run of k points whose last step went up to rank u (uniform on 0..1). A rise to v
    > u goes on with the trend, f_k(u) = 1 + integral_u^1 f_(k+1) + integral_0^u f_2(1 - v): a fall turned over is a rise.
    For alternation the two integrals change places. f_n = 0; solved at Gauss-Legendre nodes with polynomials.
    """
    if rule.n == 2:
        return 2.0
    x, weights = np.polynomial.legendre.leggauss(nodes)
    integrals = [
        np.polynomial.legendre.legval(x, np.polynomial.legendre.legint(basis, lbnd=-1)) / 2 for basis in np.eye(nodes)
    ]
    # From values at the nodes to integrals from 0 to each node, from each node to 1, over all; and to f(1 - u).
    below = np.stack(integrals, axis=1) @ np.linalg.inv(np.polynomial.legendre.legvander(x, nodes - 1))
    total: Floats = weights / 2
    above = total - below
    turned = np.eye(nodes)[::-1]
    goes_on, turns = (above, below @ turned) if rule.kind is RuleKind.TREND else (below @ turned, above)
    runs = rule.n - 2  # of 2 .. n - 1 points
    system = np.eye(runs * nodes)
    for k in range(runs):
        here = slice(k * nodes, (k + 1) * nodes)
        system[here, :nodes] -= turns
        if k + 1 < runs:
            system[here, (k + 1) * nodes : (k + 2) * nodes] -= goes_on
    of_two = np.linalg.solve(system, np.ones(runs * nodes))[:nodes]
    # The first point lies at u; the second makes a run of two of it.
    return float(1 + total @ (1 + above @ of_two + below @ turned @ of_two))
