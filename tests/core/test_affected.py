"""Affected parts: exact in random histories against a plain re-computation, and the rules of what is certainly good."""

import random

import pytest

from app.core.affected import MOST_NAMED, Cut, names_between, stretches, verdict_of
from app.core.natural_limit import Tolerance

LIMITS = Tolerance(-0.008, 0.008)


def history(chance: random.Random) -> list[Cut]:
    """Readings of parts, as they arrive: tool changes, sister tools, doubled and late readings, parts without a number,
    sampling, false readings, an alarm with readings or only a moment."""
    cuts: list[Cut] = []
    edge, number, sampling, names = 0, 0, chance.choice([1, 1, 3, 10]), chance.random() < 0.7
    late: list[Cut] = []
    for made in range(chance.randint(5, 120)):
        if chance.random() < 0.04:
            edge += 1
        if made % sampling:
            continue
        name = f"SN-{made % chance.choice([40, 1000]):04}" if names and chance.random() < 0.95 else None
        for _again in range(chance.choice([1, 1, 1, 2])):
            number += 1
            good = chance.choice([True, True, True, False, None])
            behind = good is not True and chance.random() < 0.2
            order = chance.choice([None, "A"]) if chance.random() < 0.1 else None
            cut = Cut(number, float(made), (3 + edge % 2, edge), good, behind, name, order)
            (late if chance.random() < 0.1 else cuts).append(cut)
    if chance.random() < 0.3 and cuts:
        at = chance.choice(cuts)
        cuts.append(Cut(0, at.at - 0.5, at.life, None, True))
    places = [chance.randint(0, len(cuts)) for _each in late]
    for place, cut in zip(places, late, strict=True):
        cuts.insert(place, cut)
    return cuts


def plainly(cuts: list[Cut]) -> set[int]:
    """The same, by asking of every part, for every reading behind the alarm, every part between the two."""
    found: set[int] = set()
    for life in {cut.life for cut in cuts}:
        own = sorted((cut for cut in cuts if cut.life == life), key=lambda cut: (cut.at, cut.number))
        parts: list[list[Cut]] = []
        for cut in own:
            last = parts[-1][0] if parts else None
            if last and cut.part is not None and (cut.order, cut.part) == (last.order, last.part):
                parts[-1].append(cut)
            else:
                parts.append([cut])
        good = [False not in [c.good for c in part] and True in [c.good for c in part] for part in parts]

        def shields(at: int, parts: list[list[Cut]] = parts, good: list[bool] = good) -> bool:
            name = (parts[at][0].order, parts[at][0].part)
            before = [(part[0].order, part[0].part) for part in parts[:at]]
            return good[at] and not (name[1] is not None and name in before)

        for alarm, part in enumerate(parts):
            if good[alarm] or not any(cut.behind for cut in part):
                continue
            for at, other in enumerate(parts):
                between = range(min(at, alarm) + 1, max(at, alarm))
                if not good[at] and not any(shields(place) for place in between):
                    found |= {cut.number for cut in other if cut.number}
    return found


def check(seed: int) -> int:
    cuts = history(random.Random(seed))
    listed = [number for each in stretches(cuts) for part in each.parts for number in part.numbers]
    assert len(listed) == len(set(listed))
    assert set(listed) == plainly(cuts), seed
    by_number = {cut.number: cut for cut in cuts}
    for each in stretches(cuts):  # in the order of cutting, and between two good ones
        times = [by_number[part.numbers[0]].at for part in each.parts]
        assert times == sorted(times)
        for end in (each.since, each.until):
            assert end is None or by_number[end].life == each.life
    return len(listed)


def test_affected_parts_are_those_of_a_plain_recomputation() -> None:
    assert sum(check(seed) for seed in range(100)) > 300


@pytest.mark.long
def test_affected_parts_in_a_thousand_histories() -> None:
    assert sum(check(seed) for seed in range(100, 1100)) > 3000


def test_late_reading_of_a_part_between_counts_where_it_was_cut() -> None:
    """A part cut before the alarm and measured after it is certainly good where it was cut, and nowhere else."""
    cuts = [Cut(1, 1, "e", True), Cut(2, 4, "e", False, True), Cut(3, 3, "e", True), Cut(4, 2, "e", None)]
    (only,) = stretches(cuts)
    assert (only.since, [part.numbers for part in only.parts], only.until) == (3, [(2,)], None)


def test_part_measured_again_vouches_for_no_neighbour() -> None:
    cuts = [
        Cut(1, 1, "e", True, part="P1"),
        Cut(2, 2, "e", False, True, part="P2"),
        Cut(3, 3, "e", True, part="P1"),  # the old part on the machine again
        Cut(4, 4, "e", None, part="P4"),
        Cut(5, 5, "e", True, part="P2"),
    ]
    (only,) = stretches(cuts)
    assert [(part.numbers, part.again) for part in only.parts] == [((2,), 5), ((4,), None)]
    assert only.until is None


def test_tool_change_bounds_the_list() -> None:
    cuts = [Cut(1, 1, 1, None), Cut(2, 2, 2, None), Cut(3, 3, 2, False, True), Cut(4, 4, 3, None)]
    assert [(each.life, [part.numbers for part in each.parts]) for each in stretches(cuts)] == [(2, [(2,), (3,)])]


def test_hand_decides_before_the_probe_and_a_guard_narrows() -> None:
    assert verdict_of(0.02, LIMITS, by_hand=True) is True
    assert verdict_of(0.0075, LIMITS, 0.0005) is True
    assert verdict_of(0.0076, LIMITS, 0.0005) is False
    assert verdict_of(-0.02, Tolerance(None, 0.008)) is True  # beyond a natural limit nothing is judged
    assert verdict_of(0.0, LIMITS, rejected=True) is False


def test_names_between_keep_their_zeros() -> None:
    assert names_between("0812/9", "0812/11") == ("0812/10",)
    assert names_between("same", "same") is None


def test_names_between_are_said_one_by_one_up_to_their_most() -> None:
    named = names_between("P1", f"P{MOST_NAMED + 2}")
    assert isinstance(named, tuple)
    assert (len(named), named[-1]) == (MOST_NAMED, f"P{MOST_NAMED + 1}")
    assert names_between("P1", f"P{MOST_NAMED + 3}") == MOST_NAMED + 1
