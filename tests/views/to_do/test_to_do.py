"""What waits for a person: one list, one count, wherever it stands."""

import re

import pytest

from tests.conftest import Server
from tests.shop import Person, Shop


@pytest.fixture(scope="module")
def shop(server: Server) -> Shop:
    """An alarm that holds a correction, a correction that awaits approval, and a proposal."""
    shop = Shop(server)
    for deviation in (0.4, 0.0, 0.2, 350.0):
        shop.read(deviation)
    shop.add(f"{shop.characteristic}-a", tool_memory=5, average_memory=6, mode="approval")
    shop.read(6.0, f"{shop.characteristic}-a")
    shop.call(
        "POST", f"/characteristics/{shop.characteristic}/proposals", 201, zero_range=0.002, reason="Fewer corrections"
    )
    return shop


def counted(text: str) -> int:
    found = re.search(r'data-to-do="(\d+)"', text)
    assert found is not None
    return int(found[1])


def kinds(text: str) -> list[str]:
    return re.findall(r'<tr data-kind="(\w+)"', text)


def test_the_count_is_the_length_of_the_list_wherever_it_stands(shop: Shop, operator: Person) -> None:
    page = operator.open("/todo")
    assert kinds(page) == ["alarm", "correction", "proposal"], "a held correction belongs to its alarm"
    assert counted(page) == counted(operator.open("/todo/count")) == counted(operator.open("/alarms")) == 3
    assert "<strong>3</strong> to do" in operator.open("/")


def test_by_machine_and_by_role(shop: Shop, server: Server, operator: Person, engineer: Person, viewer: Person) -> None:
    other = Shop(server)
    assert kinds(operator.open(f"/todo?machine={other.machine}")) == []
    assert len(kinds(operator.open(f"/todo?machine={shop.machine}"))) == 3
    assert kinds(operator.open("/todo?mine=true")) == ["alarm", "correction"]
    assert len(kinds(engineer.open("/todo?mine=true"))) == 3
    assert kinds(viewer.open("/todo?mine=true")) == []
    operator.open("/todo?machine=nowhere", 404)


def test_each_leads_to_its_next_action(shop: Shop, engineer: Person) -> None:
    for path in re.findall(
        r'<a class="button " href="(/(?:alarms|corrections|proposals)[^"]+)"', engineer.open("/todo")
    ):
        engineer.open(path)


def test_old_addresses_lead_on(shop: Shop, operator: Person) -> None:
    assert "Machines" in operator.open("/tools")
    for path in ("/alarms", "/corrections", "/proposals", "/alarms/history"):
        text = operator.open(path)
        assert "<h1>" in text
        assert re.search(r'<a href="/todo" aria-current="true">', text)
