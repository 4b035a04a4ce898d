"""Files of others: import and bridge say the same of each.

The shapes are those of real files. What each means is written down here as sizes and moments; a file that is refused names the
lines.
"""

import re
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest

from app.bridge.configuration import configuration_from
from app.bridge.file_content import read_content
from app.errors import Invalid
from app.files.formats.delimited import BLANKS
from app.loop.readings.importing.cells import Flaw
from app.loop.readings.importing.layout import Wishes, look
from app.loop.readings.importing.lines import Line, lines
from app.loop.readings.importing.wide import Column, layout_of

ZONE = "Europe/Belgrade"
MORNING = "2025-11-18T05:0{}:00"
Readings = list[tuple[float, str | None]]


@dataclass
class Case:
    """A file and its right outcome. good: sizes, mm, and moments, UTC; bad: lines that are refused. how: options of each door."""

    text: str
    good: Readings = field(default_factory=list)
    bad: tuple[int, ...] = ()
    column: str = ""  # of the measured value, where its name does not say so
    cli: dict[str, Any] = field(default_factory=dict)
    bridge: dict[str, Any] = field(default_factory=dict)
    encoding: str = "utf-8"
    words: str = ""  # in the refusal


def morning(*sizes: float) -> Readings:
    """Sizes of 18 November 2025, one a minute from 06:05 on."""
    return [(size, MORNING.format(5 + at)) for at, size in enumerate(sizes)]


THREE = "Time;D40\n18.11.2025 06:05;40,001\n18.11.2025 06:06;40,002\n18.11.2025 06:07;40,003\n"
MARKS = "".join(f"18.11.2025 06:0{6 + at};{mark}\n" for at, mark in enumerate(("---", "n.i.O.", "NaN", "#N/A")))
MARKED = f"Time;D40\n18.11.2025 06:05;40,001\n{MARKS}18.11.2025 06:10;40,002\n"
PRINTED = """Plate: T-7
Date: 2025-03-15

   Meas X    Meas Y  Meas D   Nom D
  -80.754  -215.282   2.176   2.167
  -40.120  -115.205   2.171   2.167
   10.001   -15.202   2.169   2.167
"""
UNIT = "Time;Run-out [{}]\n18.11.2025 06:05;0,10\n18.11.2025 06:06;0,12\n18.11.2025 06:07;0,08\n"
US = "Date,Time,Measured\n11/18/2025,6:05:10 AM,40.001\n11/18/2025,6:06:10 PM,40.002\n"
GERMAN = "Nr.;Datum;Uhrzeit;Sollmaß;Istmaß\n1;18.11.25;06:05:11;40,000;40,001\n2;18.11.25;06:06:12;40,000;39,998\n"
TABLES = {
    "three": Case(THREE, morning(40.001, 40.002, 40.003)),
    "blank rows": Case(
        "Zeit;Wert\r\n18.11.2025 06:05;40,001\r\n18.11.2025 06:06;40,002\r\n;\r\n;\r\n\r\n", morning(40.001, 40.002)
    ),
    "separators left over": Case(
        "Zeit;Wert\r\n18.11.2025 06:05;40,001;\r\n18.11.2025 06:06;40,002;;\r\n", morning(40.001, 40.002)
    ),
    "cells missing": Case(
        "Time;D40;Remark;By\n18.11.2025 06:05;40,001\n18.11.2025 06:06;40,002;chip\n", morning(40.001, 40.002)
    ),
    "cut off": Case("Time;D40;By\n18.11.2025 06:05;40,001;A\n18.11.2025 06:06;40,002", bad=(3,), words="cut off"),
    "marks": Case(MARKED, bad=(3, 4, 5, 6)),
    "marks that are named": Case(
        MARKED,
        [(40.001, MORNING.format(5)), (40.002, "2025-11-18T05:10:00")],
        cli={"missing": "---,n.i.O.,NaN,#N/A"},
        bridge={"missing": ["---", "n.i.O.", "NaN", "#N/A"]},
    ),
    "unit in the cells": Case(THREE.replace("\n1", " mm\n1").replace("D40 mm", "D40"), bad=(2, 3)),
    "heading again": Case(
        "Time;D40\n18.11.2025 06:05;40,001\nTime;D40\n18.11.2025 06:06;40,002\n", morning(40.001, 40.002)
    ),
    "footer": Case(THREE + "\nMean;40,002\nCpk;1,45\n", bad=(6, 7)),
    "blanks": Case(
        PRINTED,
        [(2.176, None), (2.171, None), (2.169, None)],
        column="Meas D",
        cli={"delimiter": "blanks"},
        bridge={"delimiter": "blanks"},
    ),
    "comma for both": Case(
        "Time,Value\n2025-11-18 06:05:00,40,001\n2025-11-18 06:06:00,40,002\n", bad=(2, 3), words="quotation marks"
    ),
    "comma in quotes": Case(
        '"Time","Value"\n"2025-11-18 06:05:00","40,001"\n"2025-11-18 06:06:00","40,002"\n', morning(40.001, 40.002)
    ),
    "thousands": Case("Time;Value\n18.11.2025 06:05;1.040,001\n", bad=(2,), words="thousands"),
    "minus sign": Case(
        "Time;Deviation\n18.11.2025 06:05;\N{MINUS SIGN}0,003\n18.11.2025 06:06;+0,002\n",
        morning(-0.003, 0.002),
        column="Deviation",
    ),
    "inches": Case(
        "Time,D40 (in)\n2025-11-18 06:05,1.57480\n2025-11-18 06:06,1.57484\n",
        morning(39.99992, 40.000936),
        column="D40 (in)",
    ),
    "mil": Case(UNIT.format("mil"), morning(0.00254, 0.003048, 0.002032), column="Run-out [mil]"),
    "µin": Case(UNIT.format("µin"), morning(2.54e-6, 3.048e-6, 2.032e-6), column="Run-out [µin]"),
    "like rows": Case(
        "Time,D40\n2025-11-18 06:05,40.001\n2025-11-18 06:05,40.001\n2025-11-18 06:05,40.003\n",
        [(size, MORNING.format(5)) for size in (40.001, 40.001, 40.003)],
    ),
    "sep line": Case("sep=;\r\nTime;D40\r\n18.11.2025 06:05;40,001\r\n", morning(40.001)),
    "sep line and mark": Case("\ufeffsep=,\r\nTime,D40\r\n2025-11-18 06:05,40.001\r\n", morning(40.001)),
    "utf-16": Case("Zeit\tWert\r\n18.11.2025 06:05:00\t40,001\r\n", morning(40.001), encoding="utf-16"),
    "month first": Case(
        US,
        [(40.001, "2025-11-18T05:05:10"), (40.002, "2025-11-18T17:06:10")],
        cli={"time_format": "%m/%d/%Y %I:%M:%S %p"},
        bridge={"times": "%m/%d/%Y %I:%M:%S %p"},
    ),
    "two digits of a year": Case(
        GERMAN,
        [(40.001, "2025-11-18T05:05:11"), (39.998, "2025-11-18T05:06:12")],
        cli={"time_format": "%d.%m.%y %H:%M:%S"},
        bridge={"times": "%d.%m.%y %H:%M:%S"},
        encoding="cp1252",
    ),
    "an hour that never was": Case("Zeit;Wert\n30.03.2025 02:30;40,001\n", bad=(2,), words="does not exist"),
    "an hour that was twice": Case(
        "Zeit;Wert\n26.10.2025 02:15;40,001\n26.10.2025 02:45;40,002\n", bad=(2, 3), words="+01:00"
    ),
    "seconds": Case("Time,D40\n1763442300,40.001\n", bad=(2,), words="seconds since 1970-01-01"),
    "seconds that are named": Case(
        "Time,D40\n1763442300,40.001\n",
        morning(40.001),
        cli={"time_format": "seconds since 1970-01-01"},
        bridge={"times": "seconds since 1970-01-01"},
    ),
    "a zone by its letters": Case("Time,D40\n2025-11-18T06:05:00 CET,40.001\n", bad=(2,)),
    "zones": Case(
        "Time,D40\n2025-11-18T06:05:00.123456789Z,40.001\n2025-11-18T06:06:00+0100,40.002\n",
        [(40.001, "2025-11-18T06:05:00.123456"), (40.002, "2025-11-18T05:06:00")],
    ),
}
"""By their names; `Time` or what stands for it is the column of times."""
TIMES = ("Date+Time", "Datum+Uhrzeit", "Time", "Zeit")


def bridged(path: Path, names: dict[str, str], **settings: Any) -> tuple[Readings, list[int | None], str]:
    """Sizes and moments that the bridge would send, the lines of its faults, and their words."""
    table = {"kind": "folder", "unit": "mm", "secret": "x", "corrections": "none", "characteristics": names}
    folder = {"path": str(path.parent), "format": "csv", "zone": ZONE} | settings
    content = {"server": {"url": "http://127.0.0.1:1"}, "machine": {"cmm-1": table | {"folder": folder}}}
    found = read_content(configuration_from(content, path.parent).machines[0], (path,), path.name)
    readings = [(each.body["measured"], in_utc(each.body.get("measured_at"))) for each in found.entries]
    return readings, [fault.line for fault in found.faults], " ".join(map(str, found.faults))


def in_utc(moment: str | None) -> str | None:
    return moment and datetime.fromisoformat(moment).astimezone(UTC).replace(tzinfo=None).isoformat()


def as_expected(found: Readings, case: Case) -> bool:
    sizes = [size for size, _at in found] == [pytest.approx(size, abs=1e-12) for size, _at in case.good]
    return sizes and all(at == wanted for (_size, at), (_good, wanted) in zip(found, case.good, strict=True) if wanted)


def imported(path: Path, **wishes: Any) -> tuple[Readings, list[int], str]:
    """The same of the import."""
    found = list(lines(path, look(path, Wishes(timezone=ZONE, **wishes)), "x"))
    flaws = [each for each in found if isinstance(each, Flaw)]
    readings = [
        (
            each.reading.measured or 0.0,
            in_utc(each.reading.measured_at.isoformat() if each.reading.measured_at else None),
        )
        for each in found
        if isinstance(each, Line)
    ]
    return readings, [flaw.line for flaw in flaws], " ".join(map(str, flaws))


@pytest.mark.parametrize("name", TABLES)
def test_a_table_means_the_same_to_import_and_bridge(tmp_path: Path, name: str) -> None:
    case, path = TABLES[name], tmp_path / "a.csv"
    path.write_bytes(case.text.encode(case.encoding))
    rows = [line for line in case.text.splitlines() if line and "sep=" not in line]
    head = next(line for line in rows if not line.startswith(("Plate", "Date:")))
    cells = [cell.strip().strip('"\ufeff') for cell in re.split(r"[;,\t]| {2,}", head.strip())]
    column = case.column or next(each for each in cells if each in {"D40", "Wert", "Value", "Measured", "Istmaß"})
    wishes = dict(case.cli)
    if "missing" in wishes:
        wishes["missing"] = frozenset(wishes["missing"].split(","))
    if "delimiter" in wishes:
        wishes["delimiter"] = BLANKS
    readings, faults, words = imported(path, mapping={"measured": column}, **wishes)
    assert sorted(set(faults)) == list(case.bad), words
    assert case.bad or as_expected(readings, case)
    assert case.words in words
    time = next((each for each in TIMES if all(part in cells for part in each.split("+"))), None)
    if time is not None and "+" in time:
        return  # the bridge's columns are single ones
    columns = {"measured": column} | ({"measured_at": time} if time else {})
    decimal = "." if re.search(r"[;,\t ]-?\d+\.\d{3,}\b", case.text) else ","
    sent, at, said = bridged(path, {"*": "x"}, columns=columns, decimal=decimal, **case.bridge)
    assert sorted(set(at)) == list(case.bad), said  # type: ignore[type-var]
    assert case.bad or as_expected(sent, case)
    assert case.words in said


LONG = (
    "partnb\tid\tactual\tnominal\tuppertol\tlowertol\tcomment\tgroup1\tgroup2\n"
    + "".join(
        f"{part}\t{name}\t{size:.7f}\t{nominal}\t0.005\t-0.005\n"
        for part, last in ((815, 16.003), (816, 16.004), (817, 16.005))
        for name, size, nominal in (("Seal_1_X", 0.001, 0), ("Seal_1_Y", 0.0, 0), ("Seal_1_D", last, 16))
    )
)  # fmt: skip
PARTS = {"Seal_1_X": [0.001] * 3, "Seal_1_Y": [0.0] * 3, "Seal_1_D": [16.003, 16.004, 16.005]}


def test_a_table_with_one_row_a_characteristic_is_sorted_by_its_names(tmp_path: Path) -> None:
    path = tmp_path / "chr.txt"
    path.write_text(LONG)
    layout = look(path, Wishes())
    assert layout.names == tuple(PARTS)
    for place, name in enumerate(layout.names):
        own = layout_of(layout, Column(place, "x"), None)
        found = [each.reading for each in lines(path, own, "x") if isinstance(each, Line)]
        assert [(each.measured, each.part) for each in found] == list(
            zip(PARTS[name], ("815", "816", "817"), strict=True)
        )
    assert layout.of_one("d16", "Seal_1_D").only == "Seal_1_D"
    with pytest.raises(Invalid, match="none is called 'd16'"):
        layout.of_one("d16", "Bore")
    columns = {"characteristic": "id", "measured": "actual", "part": "partnb"}
    readings, faults, _words = bridged(path, {name: name.lower() for name in PARTS}, columns=columns)
    assert (len(readings), faults) == (9, [])


def test_a_row_of_such_a_table_may_name_its_unit(tmp_path: Path) -> None:
    path = tmp_path / "chr.txt"
    path.write_text("id,actual,nominal,unit\nA,1.5,1,inch\nB,20,20,deg\n")
    layout = look(path, Wishes())
    a, b = (list(lines(path, layout_of(layout, Column(place, "x"), None), "x")) for place in (0, 1))
    assert [each.reading.measured for each in a if isinstance(each, Line)] == [38.1]
    assert [each.line for each in b if isinstance(each, Flaw)] == [3]
