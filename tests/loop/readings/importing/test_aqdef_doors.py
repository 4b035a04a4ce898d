"""AQDEF of others at every door: the command, the page, REST and the bridge's preview say the same of each."""

import html
from pathlib import Path

import pytest

from app.files.aqdef.values import OF_CHARACTERISTIC as C
from app.files.aqdef.values import OF_FIELD as F
from tests.loop.readings.importing.doors import MORNING, Plant, Readings, bridged, morning


def described(*lines: str) -> list[str]:
    head = ["K0100 1", "K1001 {part}", "K1002 Ring", "K2001/1 D20", "K2002/1 Bore 20"]
    return [*head, "K2101/1 20", "K2110/1 19.9", "K2111/1 20.1", "K2142/1 mm", *lines]


def row(size: float, time: str, rest: str = "") -> str:
    return f"{size}{F}0{F}{time}{rest}"


SIX = "18.11.2025/06:05:00"
Q_DAS = f"{F}{F}#{F}0{F}0{F}0{F}{F}0{F}{F}"
AQDEF: dict[str, tuple[list[str], Readings]] = {
    "12 fields": (
        described(*(row(20 + at / 1000, f"18.11.2025/06:0{5 + at}:00", Q_DAS) for at in range(3))),
        morning(20.0, 20.001, 20.002),
    ),
    "11 fields": (
        described(*(row(20 + at / 1000, f"18.11.2025/06:0{5 + at}:00", Q_DAS.removesuffix(F)) for at in range(3))),
        morning(20.0, 20.001, 20.002),
    ),
    "12 fields and K2004": (described("K2004/1 0", row(20.001, SIX, Q_DAS)), morning(20.001)),
    "1992": (described(row(20.001, "07.05.1992/13:43:21")), [(20.001, "1992-05-07T11:43:21")]),
    "bytes of graphics": (described("K5003/1 \0", "K5007/1 \xff\0\xff\xff", row(20.001, SIX)), morning(20.001)),
    "like values": (
        described(*(row(20.001, SIX, f"{F}{F}#{F}{nest}") for nest in (1, 1, 2)), row(20.001, SIX, f"{F}{F}#{F}1")),
        [(20.001, MORNING.format(5))] * 4,
    ),
    "a torque": (
        [
            *("K0100 2", "K1001 {part}", "K2001/1 M8", "K2101/1 25", "K2110/1 20", "K2111/1 30", "K2142/1 Nm"),
            *("K2001/2 D20", "K2101/2 20", "K2110/2 19.9", "K2111/2 20.1", "K2142/2 mm"),
            row(25.1, SIX) + C + row(20.004, SIX),
        ],
        morning(20.004),
    ),
    "grades": (
        [
            *(
                "K0100 2",
                "K1001 {part}",
                "K2001/1 15",
                "K2002/1 Surface quality",
                "K2004/1 4",
                "K2110/1 1",
                "K2111/1 9",
            ),
            *("K2001/2 D20", "K2101/2 20", "K2110/2 19.9", "K2111/2 20.1", "K2142/2 mm"),
            row(2, SIX) + C + row(20.004, SIX),
        ],
        morning(20.004),
    ),
}


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.long if name in {"11 fields", "12 fields and K2004", "1992"} else ())
        for name in AQDEF
    ],
)
def test_aqdef_means_the_same_at_every_door(plant: Plant, tmp_path: Path, name: str) -> None:
    lines, good = AQDEF[name]
    machine, doors = plant.shop.machine, {}
    for door in ("cli", "page", "rest", "bridge"):
        part = plant.shop.another("part").replace("-", "")
        path = tmp_path / f"{door}.dfq"
        path.write_bytes("\r\n".join([*lines, ""]).replace("{part}", part).encode("latin-1"))
        doors[door] = path, f"{part}-d20"
    path, key = doors["cli"]
    assert plant.command(path, create_missing=True, machine=machine) == ""
    assert plant.stored(key) == good
    assert plant.command(path, create_missing=True, machine=machine) == "", "twice is harmless"
    assert plant.stored(key) == good
    path, key = doors["page"]
    assert plant.page(path, all="new", machine=machine) == ""
    assert plant.stored(key) == good
    path, key = doors["rest"]
    text = path.read_bytes().decode("latin-1").replace("\0", "")
    answer = plant.shop.call(
        "POST", "/readings/aqdef", name="a.dfq", content=text, create_missing=True, machine=machine
    )
    assert (answer["stored"], answer["notes"]) == (len(good), [])
    assert plant.stored(key) == good
    path, _key = doors["bridge"]
    readings, faults, words = bridged(path, {"D20": "d20"}, format="aqdef", others="skip")
    assert (readings, faults) == (good, []), words


def test_an_hour_of_aqdef_that_never_was_is_refused_by_line_at_every_door(plant: Plant, tmp_path: Path) -> None:
    path, part = tmp_path / "a.dfq", plant.shop.another("part").replace("-", "")
    text = "\r\n".join([*described(row(20.001, "30.03.2025/02:30:00"), row(20.002, "30.03.2025/03:15:00")), ""])
    path.write_bytes(text.replace("{part}", part).encode("latin-1"))
    machine, said = plant.shop.machine, {"create_missing": True, "machine": plant.shop.machine}
    refused = plant.shop.admin.post(
        "/api/v1/readings/aqdef", json={"name": "a.dfq", "content": path.read_text(), **said}
    )
    _readings, faults, words = bridged(path, {"D20": "d20"}, format="aqdef")
    assert faults == [10]
    by_page = html.unescape(plant.page(path, all="new", machine=machine))
    assert plant.command(path, create_missing=True, machine=machine) != ""
    for answer in (by_page, refused.text, words):
        assert "does not exist in Europe/Belgrade" in answer
    assert "line 10" in refused.text
    plant.shop.call("GET", f"/characteristics/{part}-d20", 404)
