"""The vice of the demonstration: it creeps until it warns, and a casting is aligned."""

from dataclasses import replace

import pytest

from app.simulators.demo import plant, touching
from app.simulators.demo.installing import set_up
from inband_client import Client
from tests.servers import Server


def test_a_creeping_vice_and_an_aligned_casting_are_there_once(server: Server, monkeypatch: pytest.MonkeyPatch) -> None:
    admin = Client(server.url, server.key("admin"))
    features = tuple(replace(feature, key=f"{feature.key}-touching") for feature in plant.MILL_1.features)
    set_up(admin, replace(plant.MILL_1, key="mill-touching", name="Touching", features=features))
    monkeypatch.setattr(touching, "MACHINE", "mill-touching")
    for _again in range(2):
        touching.behind(admin, "mill-touching", 1)
    zeros = list(admin.items("/work-zeros", machine="mill-touching"))
    assert len(zeros) == touching.ZEROS
    assert [each["shift"]["state"] for each in zeros[1 : touching.STEADY]] == ["steady"] * (touching.STEADY - 1)
    assert zeros[-1]["shift"]["state"] == "warning"
    assert zeros[-1]["shift"]["shifts"]["x"] == pytest.approx(10 * touching.CREEP[0], abs=0.004)
    (aligned,) = admin.items("/alignments", machine="mill-touching")
    assert aligned["misfits"] == []
    assert aligned["angles"]["z"] == pytest.approx(0.118, abs=0.002)
    assert list(admin.items("/alarms", state="active", machine="mill-touching")) == []
    touching.behind(admin, "lathe-1", 1)  # which has no vice
    admin.close()
