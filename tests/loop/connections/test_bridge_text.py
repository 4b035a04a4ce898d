"""The configuration that the page of a machine without a bridge offers: a bridge reads each of them as it is copied."""

import re
import tomllib
from html import unescape
from pathlib import Path

import pytest

from app.bridge.certificates import write_pair
from app.bridge.configuration import configuration_from
from app.loop.connections.bridge_text import KINDS, Known, configuration, kinds
from tests.shop import Person, Shop


@pytest.mark.parametrize("kind", KINDS)
def test_a_bridge_reads_what_is_copied(kind: str, tmp_path: Path) -> None:
    for name in ("lathe-1.key", "lathe-1.password"):
        (tmp_path / name).write_text(f"inband_{name}")
    if kind == "opcua":
        write_pair(tmp_path, "cell-pc")
    known = Known("lathe-1", "https://inband.plant.example", ["seat", "bore"], [3, 4], "Europe/Belgrade")
    read = configuration_from(tomllib.loads(configuration(kind, known)), tmp_path)
    (machine,) = read.machines
    assert (read.server.url, machine.kind) == ("https://inband.plant.example", kind)
    assert set(machine.characteristics.values()) == {"seat", "bore"}
    assert [each.tool_memory for each in machine.location] in ([3, 4], [])


def test_every_kind_has_a_word() -> None:
    assert {name for name, _words in kinds()} == set(KINDS)


def test_the_page_fills_in_what_it_knows(shop: Shop, engineer: Person) -> None:
    page = unescape(engineer.open(f"/machines/{shop.machine}/connection?kind=haas"))
    found = re.search(r'<code id="bridge-configuration">(.*?)</code>', page, re.DOTALL)
    assert found is not None
    written = tomllib.loads(found[1])
    machine = written["machine"][shop.machine]
    assert (machine["kind"], machine["characteristics"]) == ("haas", {"1": shop.characteristic})
    assert [each["tool_memory"] for each in machine["location"]] == [3]
    assert written["server"]["url"].startswith("http")
