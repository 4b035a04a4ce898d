"""The rotary table of the demonstration: last month's run is entered, today's says what to enter."""

from dataclasses import replace

import pytest

from app.simulators.demo import plant, turning
from app.simulators.demo.installing import set_up
from inband_client import Client
from tests.servers import Server


def test_a_month_of_runs_is_there_once(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    admin = Client(server.url, server.key("admin"))
    features = tuple(replace(feature, key=f"{feature.key}-turning") for feature in plant.MILL_1.features)
    set_up(admin, replace(plant.MILL_1, key="mill-turning", name="Turning", features=features))
    monkeypatch.setattr(turning, "MACHINE", "mill-turning")
    for _again in range(2):
        turning.behind(admin, "mill-turning", 1)
    runs = list(admin.items("/kinematics/runs", machine="mill-turning"))
    assert [run["status"] for run in runs] == ["entered", "measured", "measured", "measured", "measured"]
    for run, stand in zip(runs, turning.WEEKS, strict=True):
        errors = [each["value"] for each in run["axes"][0]["errors"].values()]
        assert errors[:2] == pytest.approx(stand[:2], abs=0.001)
        assert errors[2:] == pytest.approx(stand[2:], abs=0.0005)
        assert run["axes"][0]["backlash"]["value"] == pytest.approx(turning.BACKLASH, abs=0.0004)
    changes = admin.get(f"/kinematics/runs/{runs[-1]['run']}/comparison", **{"with": runs[0]["run"]})["changes"]
    x = next(each for each in changes if each["name"] == "EX0C")
    assert (x["difference"], x["enter"]) == (pytest.approx(0.0058, abs=0.001), pytest.approx(0.0058, abs=0.001))
    drift = next(each for each in admin.get("/machines/mill-turning/kinematics")["drift"] if each["name"] == "EX0C")
    assert drift["slope_low"] > 0, "the drift of the table is seen"
    assert list(admin.items("/alarms", state="active", machine="mill-turning")) == []
    turning.behind(admin, "lathe-1", 1)  # which has no rotary table
    admin.close()
