"""A line of a program text may have a thousand characters, and none of them makes a reader think for long."""

import time
from collections.abc import Callable

import pytest

from app.core.programs import fanuc, heidenhain, sinumerik
from app.core.programs.lines import LONGEST_LINE, ProgramText

MOST = 0.5  # s of a processor for a line, twenty times what is needed; two of these lines took a second and more
BEGINNINGS = (
    "", "N10 ", "R33=", "R33", "#505=", "#505=1", "G65P9011A", "G70 P", "IF ", "R1=2*SQRT(", "#1=2*SQRT[", "_TZL[", "Q401=1",
    'QS144="', "TCH PROBE 451 ", "CYCL DEF 10.1 ROT ", "(INBAND FACTOR=",
)  # fmt: skip
REPEATED = (
    " ", "\t", "1", "1.", "1 ", "a", "A1", "_A", "(", "()", "[", "=", "+-", "R1=", "R10 ", "#1=", "GOTO 1 ", "IF A ", "Q1=1 ",
    "Q1 ", "~ ", '"',
)  # fmt: skip
READERS: dict[str, Callable[[str], ProgramText]] = {
    "fanuc": fanuc.read,
    "heidenhain": heidenhain.read,
    "sinumerik": sinumerik.read,
}


@pytest.mark.parametrize("control", READERS)
def test_no_line_takes_long(control: str) -> None:
    found = {}
    for beginning in BEGINNINGS:
        for repeated in REPEATED:
            times = (LONGEST_LINE - len(beginning) - 1) // len(repeated)
            took = shortest(READERS[control], f"{beginning}{repeated * times}$")
            if took > MOST:
                found[beginning, repeated] = took
    assert not found


def shortest(reader: Callable[[str], ProgramText], line: str) -> float:
    """Seconds of a processor; of several where it takes long, for the collector of garbage may have come between."""
    times: list[float] = []
    while not times or (min(times) > MOST and len(times) < 3):
        begun = time.thread_time()
        reader(line)
        times.append(time.thread_time() - begun)
    return min(times)
