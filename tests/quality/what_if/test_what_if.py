"""What-if over HTTP: a loop that ran is replayed as it ran, other settings are told apart, and nothing is asked in vain."""

from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.quality.what_if.tool_history import Delays, _delays
from tests.loop.readings.importing.test_history import run, table
from tests.quality.baselines.rows import frozen
from tests.quality.closed_loop import cut, scatter
from tests.servers import Server
from tests.shop import Person, Shop

PARTS = 160


def nervous(shop: Shop) -> Shop:
    """A loop whose R33 is too small for its scatter: 0.3 µm for 1.4 µm."""
    changed = {"zero_range": 0.0003, "weighting_factor": 1}
    shop.call("PATCH", f"/characteristics/{shop.characteristic}", parameters=changed, reason="As found")
    return shop


@pytest.fixture(scope="module")
def ran(common_shop: Shop) -> Shop:
    """One that ran, which nobody changes."""
    cut(nervous(common_shop), scatter(PARTS))
    return common_shop


def ask(shop: Shop, *, status: int = 200, what: str = "", **asked: Any) -> Any:
    path = f"/characteristics/{shop.characteristic}/what-if{what}"
    return shop.call("POST", path, status, **({"last": 5000} | asked))


APART = {"settings", "quote", "quoted", "why_none"}  # settings, and what the cells of a map have no room for


def alike(a: dict[str, Any], b: dict[str, Any]) -> bool:
    """The same figures; sums over the same readings may be added up in another order."""
    same = a.keys() - APART == b.keys() - APART
    return same and all(a[name] == pytest.approx(b[name], abs=1e-12) for name in a.keys() - APART)


def test_todays_settings_give_what_happened(ran: Shop) -> None:
    found = ask(ran)
    assert found["readings"] == PARTS
    assert found["delay"] == 1
    assert (found["likeness"]["verdict"], found["likeness"]["same"]) == ("well", 1.0)
    assert found["likeness"]["off"] == pytest.approx(0, abs=1e-9)
    assert found["truly"]["corrections"] > PARTS / 2
    assert alike(found["truly"], found["today"])
    assert alike(found["today"], found["other"])


def test_a_wider_zero_range_corrects_less(ran: Shop) -> None:
    found = ask(ran, zero_range=0.0025, weighting_factor=2)
    assert found["other"]["settings"]["zero_range"] == 0.0025
    assert found["today"]["settings"]["zero_range"] == 0.0003
    assert found["other"]["corrections"] < found["today"]["corrections"] / 4
    assert found["other"]["spread"] < found["today"]["spread"]
    assert found["other"]["ppk"] > found["today"]["ppk"]


def test_the_assumption_is_checked_on_the_readings(ran: Shop) -> None:
    effect = ask(ran)["measured_effect"]
    assert effect["low"] < 1 < effect["high"]
    assert effect["is_full"] is True
    assert effect["corrections"] > PARTS / 2
    assert ask(ran, effect=None)["effect"] == pytest.approx(effect["value"])


def test_the_map_is_of_what_ifs(ran: Shop) -> None:
    asked: dict[str, Any] = {"weighting_factors": [1, 2], "zero_ranges": [0.0003, 0.002, 0.006]}
    made = ask(ran, what="/map", **asked)
    cells = made["cells"]
    assert [(each["weighting_factor"], each["zero_range"]) for each in cells] == [
        (k, r33) for k in asked["weighting_factors"] for r33 in asked["zero_ranges"]
    ]
    assert alike(cells[0]["figures"], made["today"])  # today's setting is on it
    assert alike(cells[4]["figures"], ask(ran, zero_range=0.002, weighting_factor=2)["other"])
    # R33 beyond R34 (5 µm) is a setting that cannot be; it says why.
    assert cells[2]["figures"] is None
    assert "R34" in cells[2]["reason"]
    (best,) = [each for each in cells if each["best"]]
    assert best["figures"]["ppk"] == max(each["figures"]["ppk"] for each in cells if each["figures"])
    (calmest,) = [each for each in cells if each["calmest"]]
    assert calmest["inside"]
    assert best["inside"]


def test_a_map_of_another_averaging_limit(ran: Shop) -> None:
    made = ask(ran, what="/map", averaging_limit=0.007)
    assert made["averaging_limit"] == 0.007
    assert max(each["zero_range"] for each in made["cells"] if each["figures"]) > 0.005
    assert len(made["cells"]) >= 300


def test_fewer_parts_measured_on_the_stored_history(ran: Shop, server: Server) -> None:
    found = ask(ran, what="/sampling", every=[1, 4], after_alarm=2)
    first, fewer = found["rows"]
    today = ask(ran)["today"]
    assert (first["measured"], first["escaped"]) == (PARTS, 0)
    assert alike(first["figures"], today)
    assert PARTS / 4 <= fewer["measured"] < PARTS / 2
    assert fewer["figures"]["readings"] == PARTS
    assert fewer["figures"]["corrections"] < today["corrections"] / 2
    assert (found["after_change"], found["after_alarm"]) == (0, 2), "what is not given is as the plan says"
    said = " ".join(found["cautions"])
    assert "stored reading is taken for a part" in said
    assert "raises, every part is measured for 2 readings. Other alarms" in said
    assert "After a tool change" not in said
    assert "offset set by hand, every part is measured for 1 reading; in" in " ".join(
        ask(ran, what="/sampling", every=[4], after_change=1)["cautions"]
    )
    page = Person(server, "viewer").open(f"/characteristics/{ran.characteristic}/what-if?k=3")
    assert "With fewer parts measured" in page
    assert "No more parts are measured after an alarm" in page


def test_what_was_held_and_what_was_excluded_removed_nothing(shop: Shop) -> None:
    shop.call(
        "PATCH",
        f"/characteristics/{shop.characteristic}",
        parameters={"plausible_jump": 0.006},
        reason="Chips are seen",
    )
    course = scatter(60, 5)
    course[30] += 40
    answers = cut(shop, course, jumps=[30])
    assert answers[30]["correction"]["status"] == "held"
    made = [each for each in answers if each["correction"] and each["correction"]["status"] != "held"]
    sizes = {each["sequence"]: abs(each["correction"]["amount"]) for each in made}
    assert len(sizes) > 5
    gone = next(iter(sizes))
    shop.call("POST", f"/readings/{shop.characteristic}/{gone}/exclude", reason="Chip on the stylus")
    sizes = {sequence: size for sequence, size in sizes.items() if sequence != gone}
    found = ask(shop)
    assert found["truly"]["corrections"] == len(sizes)
    assert found["truly"]["mean_size"] == pytest.approx(sum(sizes.values()) / len(sizes))
    assert alike(found["truly"], found["likeness"]["replayed"])


def test_excluded_readings_and_probe_faults_are_left_out_and_named(shop: Shop) -> None:
    cut(shop, scatter(40))
    before = ask(shop)
    shop.read(1200.0)  # beyond R36: the probe, not the part
    shop.acknowledge(shop.alarms()[0]["id"], "noted")
    shop.call("POST", f"/readings/{shop.characteristic}/7/exclude", reason="Chip on the stylus")
    found = ask(shop)
    for replay in ("truly", "today", "other"):
        assert found[replay]["readings"] == before["readings"]  # one more, one excluded
        assert found[replay]["inner"] == before["readings"] - 1
        assert found[replay]["largest"] < 0.02
        assert found[replay]["faults"] == 1
        assert found[replay]["rejects"] == before[replay]["rejects"]
    said = " ".join(found["cautions"])
    assert "readings 7" in said
    assert "readings 41" in said


@pytest.mark.parametrize("readings", [0, 1])
def test_too_few_readings_are_refused_with_what_to_do(shop: Shop, readings: int) -> None:
    shop.push([1.0] * readings)
    for what in ("", "/map"):
        problem = ask(shop, status=422, what=what)
        assert f"holds {readings} readings" in problem["detail"]
        assert problem["what_to_do"]


def test_a_period_without_readings_is_refused(ran: Shop) -> None:
    old: dict[str, Any] = {"from": "2020-01-01T00:00:00Z", "to": "2020-02-01T00:00:00Z", "last": None}
    assert "0 readings" in ask(ran, status=422, **old)["detail"]
    turned: dict[str, Any] = {"from": "2020-02-01T00:00:00Z", "to": "2020-01-01T00:00:00Z"}
    assert [each["field"] for each in ask(ran, status=422, **turned)["errors"]] == ["from"]
    days = ask(ran, status=422, **{"from": "2026-11-27", "to": "2026-11-26"})
    assert "2026-11-27 is later than `to` 2026-11-26; exchange the two" in days["detail"]


def test_equal_readings_tell_nothing_and_say_so(shop: Shop) -> None:
    shop.push([0.5] * 120)
    found = ask(shop)
    assert found["truly"]["spread"] == 0.0
    assert found["truly"]["ppk"] is None
    assert found["measured_effect"]["value"] is None
    assert "0 corrections took effect in this period; it takes 10" in found["measured_effect"]["text"]
    assert ask(shop, what="/map")["today"]["ppk"] is None
    assert "effect" in [each["field"] for each in ask(shop, status=422, effect=None)["errors"]]


def test_the_truth_is_quoted_as_on_the_page_of_capability_and_replays_by_the_same_rules(
    server: Server, ran: Shop
) -> None:
    found = ask(ran)
    page = ran.call("GET", f"/characteristics/{ran.characteristic}/capability")
    assert found["truly"]["readings"] == page["readings"], "none of them lies in the wear zone"
    assert (found["truly"]["quote"], found["truly"]["quoted"]) == (
        page["quote"],
        pytest.approx(page["quoted"]["value"]),
    )
    assert (found["today"]["quote"], found["today"]["quoted"]) == (
        page["quote"],
        pytest.approx(page["quoted"]["value"]),
    )
    text = Person(server, "viewer").open(f"/characteristics/{ran.characteristic}/what-if")
    assert "Index to report" in text
    assert f"pk {page['quoted']['value']:.2f}" in text


def test_replays_of_coarse_readings_carry_no_index(shop: Shop) -> None:
    cut(shop, [0.0 if at % 4 else 2.0 * (-1) ** (at // 4) for at in range(40)])  # a gauge that shows whole 2 µm
    found = ask(shop)
    for name in ("truly", "today", "other"):
        assert (found[name]["ppk"], found[name]["quoted"], found[name]["why_none"]) == (None, None, "unresolved"), name
    assert {cell["figures"]["ppk"] for cell in ask(shop, what="/map")["cells"] if cell["figures"]} == {None}
    assert "none: readings too coarse" in Person(shop.server, "viewer").open(
        f"/characteristics/{shop.characteristic}/what-if"
    )


@pytest.mark.parametrize(
    ("asked", "field"),
    [
        ({"zero_range": 0.006}, "zero_range"),  # beyond R34
        ({"zero_range": 0.005}, "zero_range"),  # on it
        ({"averaging_limit": 0.009}, "averaging_limit"),  # beyond R35/2
        ({"factor": 0}, "factor"),
        ({"weighting_factor": 0.5}, "weighting_factor"),
        ({"delay": 201}, "delay"),
        ({"last": 0}, "last"),
        ({"effect": 0}, "effect"),
    ],
)
def test_settings_out_of_order_are_named(ran: Shop, asked: dict[str, Any], field: str) -> None:
    problem = ask(ran, status=422, **asked)
    assert [each["field"] for each in problem["errors"]] == [field]
    assert "parameters." not in problem["detail"]


def test_more_than_can_be_had_is_refused_with_what_can(ran: Shop) -> None:
    many: dict[str, Any] = {
        "weighting_factors": [1 + at / 10 for at in range(200)],
        "zero_ranges": [at / 1e5 for at in range(200)],
    }
    problem = ask(ran, status=422, what="/map", **many)
    assert "40000 settings" in problem["detail"]
    assert "2500" in problem["detail"]
    assert ask(ran, last=1_000_000_000)["readings"] == PARTS  # there are no more


def test_many_at_once_take_turns(ran: Shop) -> None:
    path = f"/api/v1/characteristics/{ran.characteristic}/what-if/map"
    with ThreadPoolExecutor(8) as pool:
        answers = list(pool.map(lambda _one: ran.admin.post(path, json={"last": 5000}), range(8)))
    statuses = [answer.status_code for answer in answers]
    assert set(statuses) <= {200, 429}
    assert 200 in statuses
    assert all(answer.headers["retry-after"] for answer in answers if answer.status_code == 429)


def test_a_tool_that_two_characteristics_correct_is_replayed_with_both(shop: Shop) -> None:
    other = f"{shop.characteristic}-too"
    shop.add(other, average_memory=6)
    number, offset = 0, 0.0
    for free in scatter(40, 3):
        for key, more in ((shop.characteristic, 0.0), (other, 0.4)):
            answer = shop.read(round(free + more + offset, 4), key, correction_in_effect=number)
            if answer["correction"]:
                number, offset = answer["correction"]["number"], offset + answer["correction"]["amount"] * 1000
    found = ask(shop)
    assert other in " ".join(found["cautions"])
    assert found["today"]["of_tool"] > found["today"]["corrections"]
    assert found["likeness"]["verdict"] in {"well", "roughly"}


@pytest.mark.parametrize("serials", [True, False])
def test_a_cutter_that_serves_outside_and_inside_is_replayed_as_it_went(shop: Shop, serials: bool) -> None:
    """Each feature turns the offset into size in its own way, and either may be asked about, whichever is measured first."""
    outside, inside = f"outside-{shop.machine}", f"inside-{shop.machine}"
    factors = {outside: -0.5, inside: 0.5}
    for memory, key in enumerate(factors, 6):
        shop.add(key, factor=factors[key], average_memory=memory, max_step=0.002)
    issued: list[tuple[int, int, float]] = []  # part, number, mm of offset
    for part, free in enumerate(scatter(40, seed=7)):
        effective = [each for each in issued if part > each[0] + 1]
        offset = sum(amount for _part, _number, amount in effective) * 1000
        for later, (key, factor) in enumerate(factors.items()):
            more: dict[str, Any] = {"part": f"P{part:03d}"} if serials else {}
            answer = shop.read(
                round(free * (1 - 2 * later) - offset / factor, 3),
                key,
                correction_in_effect=effective[-1][1] if effective else 0,
                measured_at=f"2026-09-01T06:{part:02d}:{5 + later * 9:02d}Z",
                **more,
            )
            if answer["correction"]:
                issued.append((part, answer["correction"]["number"], answer["correction"]["amount"]))
    for key in factors:
        path = f"/characteristics/{key}/what-if"
        found = shop.call("POST", path, last=5000)
        assert found["delay"] == 1
        assert (found["likeness"]["verdict"], found["likeness"]["same"]) == ("well", 1.0), key
        assert (
            found["truly"]["of_tool"] >= len(issued) - 2
        )  # of the second all but what the first of the first part asked for
        assert alike(found["truly"], found["likeness"]["replayed"])


def test_a_machine_that_tells_by_time_has_its_pipeline_too(shop: Shop) -> None:
    """Three parts lie between cutting and measuring; which corrections they were cut with is told by the time alone."""
    changed = {"zero_range": 0.0003, "weighting_factor": 1}
    shop.call("PATCH", f"/characteristics/{shop.characteristic}", parameters=changed, reason="As found")
    offset, cut_parts = 0.0, []
    for free in scatter(30, 11):
        for pending in shop.call("GET", f"/machines/{shop.machine}/corrections?status=pending")["items"]:
            shop.correction(pending["number"], "applied")
            offset += pending["amount"] * 1000
        cut_parts.append((round(free + offset, 3), datetime.now(UTC).isoformat()))
        if len(cut_parts) > 3:
            size, at = cut_parts.pop(0)
            shop.read(size, machined_at=at)
    found = ask(shop)
    assert found["delay"] == 3
    assert (found["likeness"]["verdict"], found["likeness"]["same"]) == ("well", 1.0)


def test_a_machine_that_begins_to_tell_by_number_has_the_pipeline_that_it_has() -> None:
    """Corrections issued long before it began count as in effect, not only when they were reported."""
    part, delay = np.arange(60), 1
    number = np.where(part % 2 == 0, part // 2 + 1, -1)
    in_effect = (part - delay + 1) // 2  # the last correction with which a part was cut
    joined = {
        "correction": number,
        "correction_in_effect": np.where(part < 40, -1, in_effect),
        "compensated": -0.001 * in_effect,
        "deviation": np.zeros(60),
        "decided": -0.001 * ((part + 1) // 2 - in_effect),
        "factor": np.full(60, -1.0),
    }
    assert _delays(joined, part) == Delays(delay, delay, delay)
    assert _delays(joined | {"correction_in_effect": np.full(60, -1)}, part) == Delays(delay, delay, delay)


def test_corrections_that_waited_unequally_long_are_reported(shop: Shop, ran: Shop) -> None:
    """Somebody lets what has gathered take effect every ten parts; the record says so, and why the replay differs."""
    nervous(shop)
    course, number, offset = scatter(120, 5), 0, 0.0
    for at in range(0, len(course), 10):
        told = [round(free + offset, 3) for free in course[at : at + 10]]
        for answer in shop.push(told, answers=True, correction_in_effect=[number] * 10):
            if answer["correction"] is not None:
                number, offset = answer["correction"]["number"], offset + answer["correction"]["amount"] * 1000
    found = ask(shop)
    (said,) = [each for each in found["cautions"] if "delay of corrections varied" in each]
    assert "nine of ten after 0 to 9 more parts" in said
    assert found["likeness"]["same"] < 0.95
    assert not [
        each for each in ask(ran)["cautions"] if "delay of corrections varied" in each
    ]  # there all waited for one part


def test_why_another_index_may_be_quoted_than_on_the_page_of_capability_is_reported(shop: Shop) -> None:
    """There control is judged by the frozen baseline, here by limits of the readings themselves."""
    cut(shop, scatter(60))
    assert "frozen baseline" not in " ".join(ask(shop)["cautions"])
    frozen(shop, 1, 60)
    (caution,) = [text for text in ask(shop)["cautions"] if "frozen baseline" in text]
    assert "judges by the frozen baseline 1" in caution


def test_the_figure_draws_both_courses(ran: Shop) -> None:
    path = f"/characteristics/{ran.characteristic}/figures/what-if?zero_range=0.0025&weighting_factor=2"
    figure = ran.call("GET", path)
    courses = [each for each in figure["data"] if each["meta"] == "course"]
    assert [len(each["y"]) for each in courses] == [PARTS, PARTS]
    truth = ran.call("GET", f"/readings?characteristic={ran.characteristic}&limit=1000")["items"]
    assert courses[0]["y"] == pytest.approx([each["deviation"] * 1000 for each in truth], abs=0.001)
    as_today = ran.call("GET", f"/characteristics/{ran.characteristic}/figures/what-if")
    assert [each["name"] for each in as_today["data"] if each["meta"] == "course"] == ["Current settings"]


def test_an_imported_history_is_replayed_as_a_process_without_corrections(
    shop: Shop, viewer: Person, tmp_path: Path
) -> None:
    sizes = [round(40 + deviation / 1000, 6) for deviation in scatter(120, wear=0.1)]
    newer = table(tmp_path / "newer.csv", sizes[60:], begin="2026-03-02T07:00:00+01:00")
    run(shop.server.database, newer, shop.characteristic)
    run(shop.server.database, table(tmp_path / "older.csv", sizes[:60]), shop.characteristic)
    found = ask(shop)
    assert found["readings"] == 120
    assert found["truly"]["corrections"] == 0
    assert found["truly"]["mean"] == pytest.approx(0.006, abs=0.0005), "the edge recedes by 12 µm"
    assert found["today"]["corrections"] > 0
    assert abs(found["today"]["mean"]) < 0.002, "the loop follows it, in the order in which the parts were cut"
    assert found["likeness"]["verdict"] == "unknown"
    assert "process without corrections" in viewer.open(f"/characteristics/{shop.characteristic}/what-if?last=all")
