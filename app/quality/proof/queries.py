"""Running the proof, and what it said: once per process, in a thread of its own.

The engine is loaded, and its loops are compiled, by that thread: no request waits for it unless it asks for the proof
itself. Pages that show statistics ask `failing()`, which never waits.
"""

import logging
import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from app.memory import reading_modules
from app.quality.proof.cases import Case, Value, cases

log = logging.getLogger(__name__)
SETTLED_AFTER = 30.0  # s


@dataclass(frozen=True, slots=True)
class Check:
    """One number of an example: what was published, what the engine says, how far apart they are and may be.

    For lists `difference` is that of the entry which is furthest off, measured by its tolerance.
    """

    name: str
    expected: Value
    got: Value | None
    tolerance: float
    difference: float | None
    passed: bool


@dataclass(frozen=True, slots=True)
class Result:
    """Result of one example; `error` when the engine could not compute it at all."""

    case: Case
    checks: tuple[Check, ...]
    error: str | None = None

    @property
    def passed(self) -> bool:
        """True if every number is as near as it must be."""
        return self.error is None and all(check.passed for check in self.checks)


@dataclass(frozen=True, slots=True)
class Proof:
    """All results."""

    results: tuple[Result, ...]

    @property
    def failing(self) -> tuple[Result, ...]:
        """Those that are not as published."""
        return tuple(result for result in self.results if not result.passed)

    @property
    def passed(self) -> bool:
        """True if everything is as published, and there was something to prove."""
        return bool(self.results) and not self.failing

    @property
    def numbers(self) -> int:
        """Count of compared numbers."""
        return sum(_size(check.expected) for result in self.results for check in result.checks)


def run(given: Iterable[Case]) -> Proof:
    """Run examples through the live engine."""
    return Proof(tuple(map(_result, given)))


def _result(case: Case) -> Result:
    from app.quality.proof.engine import ENGINE  # late: it brings Numba and SciPy, which take a second to load

    try:
        got = ENGINE[case.kind](case.given)
        checks = tuple(_check(case, name, expected, got[name]) for name, expected in case.expected.items())
    except Exception as error:  # noqa: BLE001 - whatever goes wrong in there is what the proof is to show
        return Result(case, (), f"{type(error).__name__}: {error}")
    return Result(case, checks)


def _size(value: Value) -> int:
    return len(value) if isinstance(value, list) else 1


def _check(case: Case, name: str, expected: Value, got: Any) -> Check:
    expected_values: list[Any] = expected if isinstance(expected, list) else [expected]
    computed_values: list[Any] = got if isinstance(got, list) else [got]
    allowed = case.tolerance[name]
    limits = allowed if isinstance(allowed, list) else [allowed] * len(expected_values)
    if len(computed_values) != len(expected_values):
        return Check(name, expected, got, max(limits), None, False)
    # How far off, and how far it may be; the entry furthest off speaks for a list. NaN is never near enough.
    gaps = [
        (abs(float(b) - float(a)), limit * abs(float(a)) if case.relative else limit)
        for a, b, limit in zip(expected_values, computed_values, limits, strict=True)
    ]
    passed = all(gap <= limit for gap, limit in gaps)
    gap, limit = max(gaps, key=lambda pair: (not pair[0] <= pair[1], pair[0] - pair[1]))
    return Check(name, expected, got, limit, gap, passed)


_lock = threading.Lock()
_begun: threading.Thread | None = None
_proof: Proof | None = None


def _prove() -> None:
    global _proof  # noqa: PLW0603 - one per process, as the engine is
    with reading_modules():  # most of it is loading the engine
        proof = run(cases())
    for result in proof.failing:
        log.error("not as published: %s (%s)", result.case.name, result.error or result.case.source)
    _proof = proof


def begin() -> threading.Thread:
    """Start the proof of this process, unless it was started."""
    global _begun  # noqa: PLW0603 - one per process, as the engine is
    with _lock:
        if _begun is None:
            _begun = threading.Thread(target=_prove, name="proof", daemon=True)
            _begun.start()
        return _begun


def begin_later(then: Callable[[], object] = lambda: None) -> threading.Timer:
    """Start the proof once the server has settled, so that its first requests are not slowed down; to be cancelled at its end.

    then: what follows upon the proof, which has called everything that computes.
    """

    def prove() -> None:
        begin().join()
        then()

    timer = threading.Timer(SETTLED_AFTER, prove)
    timer.daemon = True
    timer.start()
    return timer


def passed() -> bool:
    """True once it is known that everything is as published. Never waits."""
    return _proof is not None and _proof.passed


def passed_elsewhere() -> None:
    """Take it for proved: the process that began this one has found everything as published, with the same program."""
    global _proof  # noqa: PLW0603 - one per process, as the engine is
    _proof = Proof(())


def proof() -> Proof:
    """Result of all examples; waits for it."""
    if _proof is None:
        begin().join()
    assert _proof is not None
    return _proof


def failing() -> tuple[Result, ...]:
    """Examples that are not as published, for the top of every page that shows statistics. Nothing while it is not known yet."""
    if _proof is None:
        begin()
    return _proof.failing if _proof is not None else ()
