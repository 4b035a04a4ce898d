"""The configuration: every mistake with its place, all of them at once."""

import tomllib
from datetime import UTC, datetime, timedelta
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.bridge import kinds
from app.bridge.configuration import Configuration, ConfigurationError, Location, configuration_from, read_configuration
from app.bridge.guards import Known, against
from app.bridge.links import Order
from app.simulators.controls.model import Model
from tests.bridge.plant import machine

GOOD = """
[server]
url = "https://inband.example"

[machine.lathe-1]
kind = "tried"
unit = "mm"
secret = "one"
tried = { port = 7 }

[machine.lathe-1.characteristics]
1 = "shaft-d40"

[[machine.lathe-1.location]]
tool_memory = 3
tool = 3
register = "wear_length_1"
holds = "diameter"
"""


class Settings(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Of a kind for these tests."""

    port: int


@pytest.fixture(autouse=True)
def _kind(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(kinds.KINDS, "tried", "tests.bridge.tried")
    module: Any = SimpleNamespace(Settings=Settings, NUMBERED=True, MEANING=("port",))
    monkeypatch.setattr(
        kinds, "import_module", lambda name: module if name == "tests.bridge.tried" else import_module(name)
    )


def read(text: str) -> Configuration:
    return configuration_from(tomllib.loads(text), Path("/plant"))


def test_a_good_one() -> None:
    found = read(GOOD)
    [one] = found.machines
    assert (one.key, one.settings, one.location[0].tool) == ("lathe-1", Settings(7), 3)
    assert found.store.file == "/plant/inband-bridge.sqlite3"


@pytest.mark.parametrize(
    ("before", "after", "words"),
    [
        ('kind = "tried"', 'kind = "tride"', "kind = 'tride' is not known; known are"),
        ('kind = "tried"', "", "machine.lathe-1.kind is missing"),
        ("port = 7", 'port = "7"', "machine.lathe-1.tried.port: Expected `int`, got `str`."),
        ('example"\n', 'example"\nheartbeat = 0\n', "server.heartbeat: Expected `float` > 0.0."),
        ("port = 7", "prot = 7", "machine.lathe-1.tried.prot is not known: look for a typing error."),
        ('unit = "mm"', "", 'machine.lathe-1.unit is missing: "mm" or "inch", what'),
        (
            'unit = "mm"',
            'unit = "cm"',
            'machine.lathe-1.unit = \'cm\' is not possible: "mm" or "inch", what the control works in.',
        ),
        ('secret = "one"', "", "needs one of secret, secret_file and secret_env"),
        ('secret = "one"', 'secret = "two words"', "machine.lathe-1.secret holds no key"),
        ('secret = "one"', 'secret_env = "INBAND_NOT_SET"', "the variable INBAND_NOT_SET is not set"),
        ('secret = "one"', 'secret_file = "nowhere"', "/plant/nowhere cannot be read"),
        ('url = "https://inband.example"', "", "server.url is missing: the address"),
        ('"https://inband.example"', '"inband.example"', "is not an address such as"),
        ("[machine.lathe-1]", "[machine.Lathe_1]", "'Lathe_1' is not the key of a machine"),
        ("tool = 3", "tool = 0", "machine.lathe-1.location[0].tool: Expected `int` >= 1."),
        ('1 = "shaft-d40"', 'one = "shaft-d40"', "'one' is not a number as the NC program writes it"),
        ('1 = "shaft-d40"', '1 = "Shaft Ø40"', "'Shaft Ø40' is not the key of a characteristic"),
        ('unit = "mm"', 'unit = "mm"\nlargest_step = 2.0', "largest_step 2 is more than largest_distance 0.5"),
        ("[server]", "[sever]\n[server]", "[sever] is not known; known are [server]"),
    ],
)
def test_each_mistake_is_said_where_it_is(before: str, after: str, words: str) -> None:
    assert before in GOOD
    text = GOOD.replace(before, after)
    if "Lathe_1" in after:
        text = text.replace("machine.lathe-1", "machine.Lathe_1")
    with pytest.raises(ConfigurationError) as error:
        read(text)
    assert any(words in problem for problem in error.value.problems), error.value.problems


def test_all_mistakes_are_said_at_once() -> None:
    text = GOOD.replace('unit = "mm"', "").replace("port = 7", "prot = 7").replace('url = "https://inband.example"', "")
    with pytest.raises(ConfigurationError) as error:
        read(text)
    assert len(error.value.problems) == 3


def test_one_register_stands_for_one_tool_memory_and_one_key_for_one_machine() -> None:
    place = GOOD[GOOD.index("[[machine") :]
    with pytest.raises(ConfigurationError, match="tool memory 3 has several locations"):
        read(GOOD + place)
    with pytest.raises(ConfigurationError, match="covers several tool memories"):
        read(GOOD + place.replace("tool_memory = 3", "tool_memory = 4"))
    with pytest.raises(ConfigurationError, match="have the same key for the server"):
        read(GOOD + GOOD[GOOD.index("[machine") :].replace("lathe-1", "lathe-2"))
    with pytest.raises(ConfigurationError, match=r"takes corrections .* but has no location"):
        read(GOOD[: GOOD.index("[[machine")])


@pytest.mark.parametrize(
    ("kind", "settings", "register", "other"),
    [
        ("heidenhain", '{ address = "192.0.2.23" }', "QR31", "tool = 4"),  # the offset of both tools
        ("haas", '{ address = "192.0.2.17" }', "wear_diameter", "tool = 3\nedge = 2"),  # it has no edges
    ],
)
def test_a_register_is_one_whatever_tool_or_edge_is_named(kind: str, settings: str, register: str, other: str) -> None:
    text = GOOD.replace('kind = "tried"', f'kind = "{kind}"').replace("tried = { port = 7 }", f"{kind} = {settings}")
    text = text.replace("wear_length_1", register)
    second = text[text.index("[[machine") :].replace("tool_memory = 3", "tool_memory = 4").replace("tool = 3", other)
    with pytest.raises(ConfigurationError, match=f"{register}.* covers several tool memories"):
        read(text + second)
    another = "QR32" if kind == "heidenhain" else "wear_length"
    assert len(read(text + second.replace(register, another)).machines[0].location) == 2


def test_a_file_that_cannot_be_read_is_said(tmp_path: Path) -> None:
    for content, words in ((None, "cannot be read"), (b"\xff", "not UTF-8"), (b"[server", "is not TOML")):
        file = tmp_path / "plant.toml"
        if content is not None:
            file.write_bytes(content)
        with pytest.raises(ConfigurationError, match=words):
            read_configuration(file)


@given(
    st.floats(-2, 2),
    st.sampled_from(["mm", "inch"]),
    st.sampled_from(["diameter", "radius", "length"]),
    st.sampled_from([1, -1]),
    st.sampled_from([1.0, 0.5, 2.0]),
)
def test_a_mapping_leads_there_and_back(offset: float, unit: str, holds: Any, sign: Any, factor: float) -> None:
    place = Location(tool_memory=1, tool=1, register="r", holds=holds, sign=sign, factor=factor)
    there = place.to_control(offset, unit)
    assert place.from_control(there, unit) == pytest.approx(offset, abs=1e-12)
    expected = offset * sign * factor * (0.5 if holds == "radius" else 1) / (25.4 if unit == "inch" else 1)
    assert there == pytest.approx(expected, abs=1e-12)


def test_the_hash_changes_with_whatever_a_number_means() -> None:
    model = Model()
    first = machine(model)
    hashes = {first.mapping_hash()}
    for other in ({"unit": "inch"}, {"identity": "SN-1"}, {"characteristics": {"1": "other"}}):
        hashes.add(machine(model, **other).mapping_hash())
    place = first.location[0]
    for name, value in {"sign": -1, "holds": "radius", "tool": 9, "edge": 2, "register": "x", "factor": 2.0}.items():
        hashes.add(machine(model, location=(msgspec.structs.replace(place, **{name: value}),)).mapping_hash())
    hashes.add(machine(model, kind="tried", settings=Settings(1)).mapping_hash())
    hashes.add(machine(model, kind="tried", settings=Settings(2)).mapping_hash())
    assert len(hashes) == 12
    looser = msgspec.structs.replace(place, largest_step=0.01)
    assert machine(model, location=(looser,)).mapping_hash() == first.mapping_hash(), "a limit changes no meaning"


NOW = datetime(2026, 11, 23, 12, tzinfo=UTC)


@pytest.mark.parametrize(
    ("order", "age", "known", "held", "fields", "words"),
    [
        (Order(1, 3, 0.0, 0.1), 0, {}, False, {}, None),
        (Order(1, 9, 0.0, 0.1), 0, {}, False, {}, "tool memory 9, which has no"),
        (Order(1, 3, 0.0, 0.1001), 0, {}, False, {}, "larger than 0.1 mm"),
        (Order(1, 3, 0.45, 0.54), 0, {3: Known(0.0)}, False, {}, "more than 0.5 mm from the offset"),
        (Order(1, 3, 0.0, 0.1), 8 * 3600 + 1, {}, False, {}, "8.0 h old"),
        (Order(1, 3, 0.0, 0.1), 0, {}, True, {}, "on hold"),
        (Order(1, 3, 0.0, 0.1), 0, {3: Known(0.0, "old")}, False, {"proof_needed": True}, "has not been proved"),
    ],
)
def test_the_guards(
    order: Order, age: float, known: dict[int, Known], fields: dict[str, Any], words: str | None, *, held: bool
) -> None:
    found = against(order, NOW - timedelta(seconds=age), NOW, machine(Model(), **fields), known, held)
    assert found is None if words is None else words in (found.reason if found else "")
