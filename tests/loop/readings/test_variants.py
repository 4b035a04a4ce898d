"""Results of the measuring variants beside the value: answered, kept, found again, in single readings, batches and imports."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.loop.readings.record import must_hold, rows
from tests.servers import Server
from tests.shop import Shop

pytestmark = pytest.mark.own_server  # the whole record of its database is held against the rules

NOTHING = dict.fromkeys(
    [
        *("run_out", "out_of_roundness", "taper", "slope", "repeat_range", "repeat_deviation"),
        *("sections_outside", "rejected", "straightness"),
    ]
)


@pytest.fixture
def checked(shop: Shop) -> Iterator[Shop]:
    """Whatever is done there, the record holds afterwards."""
    yield shop
    must_hold(shop.server.database.dsn)


def touched(checked: Shop, name: str, touches: list[Any], status: int = 201) -> Any:
    return checked.call("POST", "/readings", status, characteristic=name, touches=touches)


@pytest.mark.parametrize(
    ("parameters", "touches", "results"),
    [
        ({"variant": "indexed", "index": 180}, [[40.004], [39.998]], {"run_out": 0.003}),
        ({"variant": "round", "points": 3}, [[40.004], [39.998], [40.0]], {"out_of_roundness": 0.006}),
        (
            {"variant": "along", "points": 3, "index": -10},
            [[39.998], [40.0], [40.002]],
            {"taper": 0.004, "slope": -0.0002, "straightness": 0.0},
        ),
        ({"repeats": 2}, [[40.0, 40.002]], {"repeat_range": 0.002, "repeat_deviation": 0.001414214}),
        (
            {"points": 3, "accept": {"n": 2, "m": 3}},
            [[40.008], [39.99], [39.992]],
            {"sections_outside": 1, "rejected": False},
        ),
        (
            {"points": 3, "accept": {"n": 2, "m": 3}},
            [[40.0081], [39.99], [39.992]],
            {"sections_outside": 2, "rejected": True},
        ),
    ],
)
def test_a_reading_is_answered_with_the_results_of_its_variant(
    checked: Shop, parameters: dict[str, Any], touches: list[Any], results: dict[str, Any]
) -> None:
    name = f"{checked.characteristic}-v"
    checked.add(name, average_memory=0, **parameters)
    answer = touched(checked, name, touches)
    assert answer["results"] == NOTHING | results
    stored = checked.call("GET", f"/readings/{name}/1")
    assert (stored["results"], stored["touches"]) == (NOTHING | results, touches)
    (listed,) = checked.call("GET", f"/readings?characteristic={name}")["items"]
    assert listed["results"] == NOTHING | results


def test_a_reading_without_results_has_none_and_no_row(checked: Shop, server: Server) -> None:
    name = f"{checked.characteristic}-v"
    checked.add(name, variant="two_point", average_memory=0)
    assert touched(checked, name, [[-20.0], [20.001]])["results"] is None
    assert checked.read(1.0)["results"] is None
    found = rows(
        server.database.dsn,
        "SELECT count(*) FROM reading_results r JOIN characteristic c ON c.id = r.characteristic_id WHERE c.key IN (%s, %s)",
        name,
        checked.characteristic,
    )
    assert found == [(0,)]


def test_sent_again_the_first_results_come_again(checked: Shop) -> None:
    name = f"{checked.characteristic}-v"
    checked.add(name, variant="round", points=2, average_memory=0)
    body: dict[str, Any] = {"characteristic": name, "touches": [[40.0], [40.002]], "key": "k"}
    first = checked.call("POST", "/readings", 201, **body)
    assert first["results"]["out_of_roundness"] == 0.002
    assert checked.call("POST", "/readings", 200, **body) == first


def test_a_batch_keeps_results_however_large(checked: Shop, server: Server) -> None:
    """Small ones go as JSON, large ones by COPY."""
    name = f"{checked.characteristic}-v"
    checked.add(name, variant="round", points=2, average_memory=0)
    for count in (3, 600):
        batch = [
            {"characteristic": name, "touches": [[40.0], [round(40.0 + at / 1e6, 6)]], "key": f"{count}:{at}"}
            for at in range(count)
        ]
        answer = checked.admin.post("/api/v1/readings/batch?decisions=true", json=batch)
        assert answer.status_code == 201
        found = [item["results"]["out_of_roundness"] for item in answer.json()["items"]]
        assert found == [round(at / 1e6, 9) for at in range(count)]
    stored = rows(
        server.database.dsn,
        "SELECT count(*), max(out_of_roundness) FROM reading_results r JOIN characteristic c ON c.id = r.characteristic_id "
        "WHERE c.key = %s",
        name,
    )
    assert stored == [(603, 0.000599)]


def test_a_batch_brings_form_too_however_large(checked: Shop) -> None:
    """Small ones, those that could be decided in columns, and those that are copied; the next readings go on from them."""
    name = f"{checked.characteristic}-v"
    checked.add(name, variant="along", points=3, index=10, average_memory=0)
    for result in ("taper", "straightness"):
        of = {"characteristic": name, "result": result}
        body: dict[str, Any] = {"key": f"{name}-{result}", "name": result, "machine": checked.machine, "form_of": of}
        checked.call("POST", "/characteristics", 201, **body, parameters={"R40": 0.02})
    for count in (2, 80, 600):
        batch = [
            {
                "characteristic": name,
                "touches": [[40.0], [40.001], [round(39.999 - at * 1e-5, 6)]],
                "key": f"{count}:{at}",
            }
            for at in range(count)
        ]
        assert checked.admin.post("/api/v1/readings/batch", json=batch).status_code == 201
    touched(checked, name, [[40.0], [40.001], [39.999]])
    for result, newest in (("taper", 0.001), ("straightness", 0.0015)):
        assert checked.call("GET", f"/characteristics/{name}-{result}/statistics")["count"] == 683
        assert checked.call("GET", f"/readings/{name}-{result}/683")["measured"] == newest
    # points 0, 1, -1.79 µm: the line falls by 1.79; one lies 1.263 above it, two 0.632 below
    assert checked.call("GET", f"/readings/{name}-taper/82")["measured"] == 0.00179
    assert checked.call("GET", f"/readings/{name}-straightness/82")["measured"] == 0.001895


@pytest.mark.parametrize(
    ("touches", "says"),
    [
        ([[40.0, 40.0], [40.0] * 3], "Point 2: touches received 3, expected 2 (R27). Repeat 3 is one too many."),
        ([[40.0, 40.0]] * 3, "Points received: 3, expected: 2. Point 3 is one too many."),
        ([[40.0, "40"], [40.0, 40.0]], "Point 1, repeat 2: This must be a number in mm"),
        ([[40.0, 40.0], 7], "Touches are one list per point"),
    ],
)
def test_touches_that_cannot_be_of_this_characteristic_are_refused_by_point_and_repeat(
    checked: Shop, touches: list[Any], says: str
) -> None:
    name = f"{checked.characteristic}-v"
    checked.add(name, variant="indexed", index=180, repeats=2, average_memory=0)
    problem = touched(checked, name, touches, 422)
    assert says in problem["detail"]
    assert [error["field"] for error in problem["errors"]] == ["touches"]
    assert checked.call("GET", f"/readings?characteristic={name}")["items"] == []


def test_a_machine_that_touches_too_often_is_told_to_stop_and_people_see_it(shop: Shop) -> None:
    """The program of an unattended lathe: each reading is refused, and it would cut on with nothing decided."""
    name = f"{shop.characteristic}-v"
    shop.add(name, variant="along", points=3, index=-8, average_memory=0)
    body: dict[str, Any] = {"characteristic": name, "touches": [[40.0]] * 4, "key": "k"}

    def refused(path: str, sent: Any, client: Any) -> Any:
        answer = client.post(f"/api/v1{path}", json=sent)
        assert answer.status_code == 422
        return answer.json()

    for path, sent in (("/readings", body), ("/readings/batch", [body | {"touches": [[40.0]] * 3, "key": "j"}, body])):
        problem = refused(path, sent, shop.machine_client)
        assert (problem["action"], "Point 4 is one too many" in problem["detail"]) == ("stop", True)
    assert shop.call("GET", f"/readings?characteristic={name}")["items"] == []
    [alarm] = shop.alarms()
    assert (alarm["kind"], alarm["characteristic"], alarm["count"]) == ("touch_count", name, 2)
    assert alarm["text"].startswith("Points received: 4, expected: 3. Point 4 is one too many. The reading was refused")
    shop.acknowledge(alarm["id"], "noted", comment="Program corrected")
    refused("/readings", body, shop.admin)
    assert shop.alarms() == [], "a person reads the answer"


@pytest.mark.parametrize(
    ("touches", "measured", "says"),
    [
        (
            [[40.0, None], [40.002, 40.0]],
            40.0005,
            "Point 1, repeat 2: the touch is missing, the probe did not trigger.",
        ),
        ([[40.0, 40.0], None], 40.0, "Point 2: touches received 0, expected 2 (R27). Repeat 1 is missing."),
        ([[40.0, 40.0], []], 40.0, "Point 2: touches received 0, expected 2 (R27). Repeat 1 is missing."),
        ([[40.0, 40.0], [40.0]], 40.0, "Point 2: touches received 1, expected 2 (R27). Repeat 2 is missing."),
        ([[40.0, 40.0]], 40.0, "Points received: 1, expected: 2. Point 2 is missing."),
        ([], 39.0, "Points received: 0, expected: 2. Point 1 is missing."),
        ([None, None], 39.0, "Point 1: touches received 0"),
        ([[40.0, 40.0], [40.0, 41.0001]], 40.250025, "Point 2, repeat 2: the touch at 41.0001 mm lies more than 1"),
    ],
)
def test_touches_that_cannot_be_believed_stop_the_machine(
    checked: Shop, touches: list[Any], measured: float, says: str
) -> None:
    """Stored as they are, with the alarm that names point and repeat; what comes after corrects nothing."""
    name = f"{checked.characteristic}-v"
    checked.add(name, variant="indexed", index=180, repeats=2, average_memory=0)
    body: dict[str, Any] = {"characteristic": name, "touches": touches, "key": "k"}
    answer = checked.call("POST", "/readings", 201, **body)
    assert (answer["zone"], answer["action"], answer["correction"]) == ("probe_fault", "stop", None)
    assert (answer["measured"], answer["results"], answer["reason"]["code"]) == (measured, None, "touch_fault")
    assert says in answer["reason"]["text"]
    (alarm,) = checked.alarms()
    assert alarm["kind"] == "probe_fault"
    assert says in alarm["text"]
    assert checked.call("POST", "/readings", 200, **body) == answer
    stored = checked.call("GET", f"/readings/{name}/1")
    assert (stored["touches"], stored["reason"]) == (touches, answer["reason"])
    (listed,) = checked.call("GET", f"/readings?characteristic={name}")["items"]
    assert listed["reason"] == answer["reason"]
    assert touched(checked, name, [[40.0, 40.0], [40.0, 40.0]])["reason"]["code"] == "paused"
    statistics = checked.call("GET", f"/characteristics/{name}/statistics")
    assert (statistics["count"], statistics["probe_faults"]) == (2, 1)


def test_the_unattended_line_stops_at_a_bore_that_is_not_there(checked: Shop) -> None:
    """The table of S1: deeper than the window, no bore at all, one section without a signal, the first move triggered."""
    bore: dict[str, Any] = {
        "R42": 25.0,
        "R40": 0.021,
        "R41": 0.0,
        "R33": 0,
        "R29": 1,
        "R36": 1.0,
        "R37": 0.3,
        "R10": 7,
        "factor": -1,
    }
    bore |= {"feature": "inside", "variant": "along", "R23": 3, "R26": -8, "accept": {"n": 2, "m": 3}}
    sent_by_turns: list[dict[str, Any]] = [
        {"touches": [[26.0105]] * 3},
        {"touches": [[26.0106]] * 3},
        {"touches": [[24.0]] * 3},
        {"touches": [None, [25.01], [25.01]]},
        {"touches": []},
        {"first_move_triggered": True},
        {"first_move_triggered": True, "measured": 3.0},
        {"first_move_triggered": True, "touches": [[24.5], None]},
    ]
    for number, sent in enumerate(sent_by_turns):
        name = f"{checked.characteristic}-bore-{number}"
        body: dict[str, Any] = {"key": name, "name": "Bore", "machine": checked.machine, "parameters": bore}
        checked.call("POST", "/characteristics", 201, **body)
        answer = checked.call("POST", "/readings", 201, characteristic=name, **sent)
        assert (answer["zone"], answer["action"], answer["correction"]) == ("probe_fault", "stop", None), sent
    assert [alarm["kind"] for alarm in checked.alarms()].count("probe_fault") == 8


def test_a_batch_with_a_missing_touch_is_decided_in_its_order(checked: Shop) -> None:
    name = f"{checked.characteristic}-v"
    checked.add(name, average_memory=0)
    batch = [{"characteristic": name, "touches": [[touch]]} for touch in (40.0, None, 40.0)]
    answer = checked.admin.post("/api/v1/readings/batch?decisions=true", json=batch)
    codes = [item["reason"]["code"] for item in answer.json()["items"]]
    assert codes == ["within_zero_range", "touch_fault", "paused"]


def test_points_that_do_not_fit_the_sections_are_refused(checked: Shop) -> None:
    problem = checked.call(
        *("POST", "/characteristics", 422),
        key=f"{checked.characteristic}-v",
        name="Bore",
        machine=checked.machine,
        parameters={"R32": 40.0, "R35": 0.016, "R33": 0, "R36": 1, "R37": 0.3, "R23": 4, "accept": {"n": 2, "m": 3}},
    )
    assert problem["errors"] == [
        {
            "field": "parameters.points",
            "message": "R23 measuring points 4 do not fit acceptance by 3 sections; say 3, or leave it out",
        }
    ]
