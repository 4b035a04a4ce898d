"""An individuals chart with all eight Nelson rules on a million readings, against a bare ``np.sort`` of the same array.

Chart: centre and sigma from the readings, limits, and every signal of every rule as a run of points. Where the package
NelsonCheck (the fastest with the eight rules that one could install; it needs pandas) can be imported it is measured on the
same readings in the same run, else the time is named that it was measured at when this was written.
``python -m bench.spc [--readings 1000000] [--rounds 7]``
"""

import argparse
import importlib
import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np

WANTED_OF_A_SORT = 3.0
WANTED_FASTER = 200.0
MEASURED_THEN = 19.0  # s for a million readings; others took up to 67 s


def best(task: Callable[[], Any], rounds: int) -> float:
    """The shortest time of some rounds, s: what else runs on the machine only ever adds."""
    times = []
    for _ in range(rounds):
        begun = time.perf_counter()
        task()
        times.append(time.perf_counter() - begun)
    return min(times)


def first_call(count: int) -> float:
    """Seconds from a new process to its first chart, the import and the compiled code off the disk included."""
    script = (
        "import time; begun = time.perf_counter()\n"
        "import numpy as np\n"
        "from app.core.spc.rules import signals_of\n"
        "from app.core.spc.shewhart import individuals, individuals_baseline\n"
        f"x = np.random.default_rng(1).normal(size={count})\n"
        "signals_of(individuals(individuals_baseline(x), x))\n"
        "print(time.perf_counter() - begun)"
    )
    return float(subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True).stdout)


def other_package(readings: Any) -> tuple[float, str]:
    """Seconds that NelsonCheck takes, and where that comes from."""
    try:
        check = importlib.import_module("NelsonCheck.NelsonCheck").NelsonCheck
    except ImportError:
        return MEASURED_THEN * len(readings) / 1e6, "measured when this was written; NelsonCheck is not installed"
    begun = time.perf_counter()
    check(readings)  # it checks all eight rules when it is made
    return time.perf_counter() - begun, "NelsonCheck, measured now"


def main() -> None:
    from app.core.spc.rules import signals_of
    from app.core.spc.shewhart import individuals, individuals_baseline

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--readings", type=int, default=1_000_000)
    parser.add_argument("--rounds", type=int, default=7)
    arguments = parser.parse_args()
    readings = np.random.default_rng(1).normal(40.0, 0.002, size=arguments.readings)

    def chart() -> Any:
        return signals_of(individuals(individuals_baseline(readings), readings))

    signals = chart()
    runs = sum(signals.count(name) for name in signals.runs)
    print(f"{len(readings):,} readings, {runs:,} signals of eight rules; first chart of a new process: ", end="")
    print(f"{first_call(arguments.readings):.1f} s")
    # In turn, so that both meet the same machine.
    charts, sorts = [], []
    for _ in range(arguments.rounds):
        charts.append(best(chart, 1))
        sorts.append(best(lambda: np.sort(readings), 1))
    fastest, sort = min(charts), min(sorts)
    print(f"chart with all rules {fastest * 1000:7.1f} ms   np.sort {sort * 1000:7.1f} ms")
    print(f"ratio {fastest / sort:.2f} of a sort (wanted <= {WANTED_OF_A_SORT:g})")
    other, whence = other_package(readings)
    print(f"{other / fastest:,.0f} times as fast as {other:.1f} s (wanted >= {WANTED_FASTER:g}; {whence})")


if __name__ == "__main__":
    main()
