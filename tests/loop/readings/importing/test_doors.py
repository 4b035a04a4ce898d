"""Files of others at every door: the command, the page, REST and the bridge's preview say the same of each.

The shapes are those of real files. What each means is written down here as sizes and moments; a file that is refused names the
lines. All doors are called in this process, on one plant.
"""

import html
import io
import re
from base64 import b64encode
from dataclasses import dataclass, field
from datetime import datetime, time
from pathlib import Path
from typing import Any

import pytest
from openpyxl import Workbook
from openpyxl.utils.datetime import MAC_EPOCH, WINDOWS_EPOCH

from app.bridge.file_entries import Entry
from app.bridge.plausible import Target, far_off
from app.cli import data
from app.loop.readings import exporting, queries
from tests.loop.readings.importing.doors import D40, LENGTHS, MORNING, ZONE, Plant, Readings, bridged, morning


@dataclass
class Case:
    """A file and its right outcome. good: sizes, mm, and moments, UTC; bad: lines that are refused. how: options of each door."""

    text: str = ""
    good: Readings = field(default_factory=list)
    cells: list[list[Any]] = field(default_factory=list)  # of a workbook, in place of a text
    bad: tuple[int, ...] = ()
    size: str = "40"
    column: str = ""  # of the measured value, where its name does not say so
    cli: dict[str, Any] = field(default_factory=dict)
    page: dict[str, str] = field(default_factory=dict)
    bridge: dict[str, Any] = field(default_factory=dict)
    encoding: str = "utf-8"
    words: str = ""  # in the refusal
    whole: bool = False  # refused as a whole, without a line
    far: bool = False  # refused because no size is near the target, which the bridge's preview says
    epoch: datetime = WINDOWS_EPOCH  # of a workbook
    formats: dict[str, str] = field(default_factory=dict)  # of its cells

    @property
    def content(self) -> bytes:
        """The file."""
        if not self.cells:
            return self.text.encode(self.encoding)
        book, held = Workbook(), io.BytesIO()
        book.epoch = self.epoch
        sheet = book.active
        assert sheet is not None
        for row in self.cells:
            sheet.append(row)
        for place, shown in self.formats.items():
            sheet[place].number_format = shown
        notes = book.create_sheet("Notes", 0)
        notes.append(["version", 3])
        notes.sheet_state = "hidden"
        book.save(held)
        return held.getvalue()


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
THOUSANDS = "Time;D40 [µm]\n18.11.2025 06:05;1.250\n18.11.2025 06:06;1.251\n"
US = "Date,Time,Measured\n11/18/2025,6:05:10 AM,40.001\n11/18/2025,6:06:10 PM,40.002\n11/18/2025,12:06:10 AM,40.003\n"
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
        page={"missing": "true"},
        bridge={"missing": ["---", "n.i.O.", "NaN", "#N/A"]},
    ),
    "unit in the cells": Case(
        "Time;D40\n18.11.2025 06:05;40,001 mm\n18.11.2025 06:06;1,57484 in\n18.11.2025 06:07;40,003\n",
        morning(40.001, 40.000936, 40.003),
    ),
    "unit beside the size": Case(
        "Time;D40;Unit\n18.11.2025 06:05;1,57484;inch\n18.11.2025 06:06;40,002;mm\n", morning(40.000936, 40.002)
    ),
    "no length beside the size": Case("Time;D40;Unit\n18.11.2025 06:05;40,001;Nm\n", bad=(2,), words="no length"),
    "a torque in the header": Case(UNIT.format("Nm"), size="0", column="Run-out [Nm]", words="Nm", whole=True),
    "an hour too many": Case(
        "Time;D40\n18.11.2025 24:00:00;40,001\n19.11.2025 00:00:10;40,002\n",
        [(40.001, "2025-11-18T23:00:00"), (40.002, "2025-11-18T23:00:10")],
    ),
    "times of programs that are none": Case(
        "Time;D40\n01.01.1970 00:00:00;40,001\n01.01.1970 00:00:00;40,002\n", [(40.001, None), (40.002, None)]
    ),
    "milliseconds": Case("Time,D40\n1763442300123,40.001\n", bad=(2,), words="milliseconds since 1970-01-01"),
    "milliseconds that are named": Case(
        "Time,D40\n1763442300123,40.001\n1763442360456,40.002\n",
        [(40.001, "2025-11-18T05:05:00.123000"), (40.002, "2025-11-18T05:06:00.456000")],
        cli={"time_format": "milliseconds since 1970-01-01"},
        page={"time_format": "milliseconds since 1970-01-01"},
        bridge={"times": "milliseconds since 1970-01-01"},
    ),
    "heading again": Case(
        "Time;D40\n18.11.2025 06:05;40,001\nTime;D40\n18.11.2025 06:06;40,002\n", morning(40.001, 40.002)
    ),
    "footer that is left out": Case(
        THREE + "\nMean;40,002\nStdDev;0,001\nDurchschnitt;40,002\n",
        morning(40.001, 40.002, 40.003),
        cli={"last_line": 4},
        page={"last_line": "4"},
        bridge={"statistics": "skip"},
    ),
    "footer without times": Case(
        "Part;D40\nP1;40,001\nP2;40,002\nDurchschnitt;40,0015\nMax value;40,002\nŚrednia;40,0015\nPrůměr;40,0015\n",
        bad=(4, 5, 6, 7),
    ),
    "footer": Case(THREE + "\nMean;40,002\nCpk;1,45\n", bad=(6, 7)),
    "blanks": Case(
        PRINTED,
        [(2.176, None), (2.171, None), (2.169, None)],
        size="2.167",
        column="Meas D",
        cli={"delimiter": "blanks"},
        page={"delimiter": "blanks"},
        bridge={"delimiter": "blanks"},
    ),
    "comma for both": Case(
        "Time,Value\n2025-11-18 06:05:00,40,001\n2025-11-18 06:06:00,40,002\n", bad=(2, 3), words="quotation marks"
    ),
    "comma for both that is said": Case(
        "Time,Value\n2025-11-18 06:05:00,40,001\n2025-11-18 06:06:00,40,002\n",
        bad=(2, 3),
        words="quotation marks",
        cli={"decimal": ","},
        page={"decimal": "comma"},
        bridge={"decimal": ","},
    ),
    "comma in quotes": Case(
        '"Time","Value"\n"2025-11-18 06:05:00","40,001"\n"2025-11-18 06:06:00","40,002"\n', morning(40.001, 40.002)
    ),
    "thousands": Case("Time;Value\n18.11.2025 06:05;1.040,001\n", bad=(2,), words="thousands"),
    "thousands or decimals": Case(
        THOUSANDS,
        size="1.25",
        column="D40 [µm]",
        whole=True,
        words="1.250 um may be 1.250 or 1250",
        bridge={"decimal": None},
    ),
    "decimals that are said": Case(
        THOUSANDS,
        morning(0.00125, 0.001251),
        size="0",
        column="D40 [µm]",
        cli={"decimal": "."},
        page={"decimal": "point"},
        bridge={"decimal": "."},
    ),
    "decimals that tell": Case(
        THOUSANDS + "18.11.2025 06:07;0.980\n",
        morning(0.00125, 0.001251, 0.00098),
        size="0",
        column="D40 [µm]",
        bridge={"decimal": None},
    ),
    "brackets": Case(
        "Time;D40\n18.11.2025 06:05;(40,003)\n", bad=(2,), words="a reference dimension, or a size below 0"
    ),
    "a bound": Case("Time;D40\n18.11.2025 06:05;<0,001\n", bad=(2,), words="it is beyond what the gauge shows"),
    "minus sign": Case(
        "Time;Deviation\n18.11.2025 06:05;\N{MINUS SIGN}0,003\n18.11.2025 06:06;+0,002\n",
        morning(-0.003, 0.002),
        size="0",
        column="Deviation",
    ),
    "title in inches": Case(
        "Report 4711\nALL DIMENSIONS IN INCHES\nTime,D40\n2025-11-18 06:05,1.57480\n2025-11-18 06:06,1.57484\n",
        morning(39.99992, 40.000936),
    ),
    "unit as the last word": Case(
        "Time,D40 inches\n2025-11-18 06:05,1.57480\n2025-11-18 06:06,1.57484\n",
        morning(39.99992, 40.000936),
        column="D40 inches",
    ),
    "title of some unit": Case("Tolerances in µm\n" + THREE, words="cannot be determined of which", whole=True),
    "title of a part of a unit": Case("Alle Maße in 1/1000 mm\n" + THREE, words="1/1000 mm", whole=True),
    "title of a length that is not known": Case("All dimensions in feet\n" + THREE, words="feet", whole=True),
    "part of a unit": Case(
        THREE.replace("D40", "D40 [1/1000 mm]"), words="1/1000 mm", whole=True, column="D40 [1/1000 mm]"
    ),
    "a tenth of a thou": Case(
        THREE.replace("D40", "D40 ten-thou"), words="ten-thou", whole=True, column="D40 ten-thou"
    ),
    "in that may be inches": Case(THREE.replace("D40", "Bore in"), words="in", whole=True, column="Bore in"),
    "braces": Case("Time,Size {in}\n2025-11-18 06:05,1.57480\n", morning(39.99992), column="Size {in}"),
    "a unit that is in doubt and named": Case(
        "Time,Bore in\n2025-11-18 06:05,1.57480\n",
        morning(39.99992),
        column="Bore in",
        cli={"unit": data.Unit.INCH},
        page={"unit": "inch"},
        bridge={"unit": "inch"},
    ),
    "in within a word": Case(THREE.replace("D40", "BoreIn"), words="In", whole=True, column="BoreIn"),
    "mu": Case(THREE.replace("D40", "D40 mu"), words="mu", whole=True, column="D40 mu"),
    "an area": Case(THREE.replace("D40", "D40 [mm²]"), words="mm²", whole=True, column="D40 [mm²]"),
    "a system of units": Case("Units: English\n" + THREE, words="English", whole=True),
    "feet": Case(THREE.replace("D40", "D40_ft"), words="ft", whole=True, column="D40_ft"),
    "a tolerance in the name": Case(THREE.replace("D40", "Bore 5 µm"), words="5 µm", whole=True, column="Bore 5 µm"),
    "microinches": Case(
        "Time,D microinch\n2025-11-18 06:05,40000\n", [(1.016, MORNING.format(5))], size="1.016", column="D microinch"
    ),
    "inches in one word": Case("Time,boreInches\n2025-11-18 06:05,1.57480\n", morning(39.99992), column="boreInches"),
    "shifts S and N": Case(
        "Shift;Time;Part;D40\nS;18.11.2025 06:05;P1;40,001\nN;18.11.2025 06:06;P2;40,002\n", morning(40.001, 40.002)
    ),
    "a row of s and n": Case(
        "What;Time;Part;D40\nF;18.11.2025 06:05;P1;40,001\ns;;;0,001\n", bad=(3,), words="statistics"
    ),
    "nominal as a row": Case(
        "Time;Part;D40\n;Nominal;40\n18.11.2025 06:05;P1;40,001\n;USL;40,008\n", bad=(2, 4), words="statistics"
    ),
    "inches": Case(
        "Time,D40 (in)\n2025-11-18 06:05,1.57480\n2025-11-18 06:06,1.57484\n",
        morning(39.99992, 40.000936),
        column="D40 (in)",
    ),
    "mil": Case(UNIT.format("mil"), morning(0.00254, 0.003048, 0.002032), size="0", column="Run-out [mil]"),
    "µin": Case(UNIT.format("µin"), morning(2.54e-6, 3.048e-6, 2.032e-6), size="0", column="Run-out [µin]"),
    **{
        unit: Case(UNIT.format(unit), morning(*sizes), size="0", column=f"Run-out [{unit}]")
        for unit, sizes in {
            "thou": (0.00254, 0.003048, 0.002032),
            "tenths": (0.000254, 0.0003048, 0.0002032),
            "um": (0.0001, 0.00012, 0.00008),
            "nm": (1e-7, 1.2e-7, 8e-8),
        }.items()
    },
    "cm": Case(UNIT.format("cm"), morning(1.0, 1.2, 0.8), size="0.1", column="Run-out [cm]"),
    "a quote far from the target": Case(
        UNIT.format('"'), size="0.1", column='Run-out ["]', far=True, words="lies more than 1 mm"
    ),
    "like rows": Case(
        "Time,D40\n2025-11-18 06:05,40.001\n2025-11-18 06:05,40.001\n2025-11-18 06:05,40.003\n",
        [(size, MORNING.format(5)) for size in (40.001, 40.001, 40.003)],
    ),
    "sep line": Case("sep=;\r\nTime;D40\r\n18.11.2025 06:05;40,001\r\n", morning(40.001)),
    "sep line and mark": Case("\ufeffsep=,\r\nTime,D40\r\n2025-11-18 06:05,40.001\r\n", morning(40.001)),
    "utf-16": Case("Zeit\tWert\r\n18.11.2025 06:05:00\t40,001\r\n", morning(40.001), encoding="utf-16"),
    "month first": Case(
        US, [(40.001, "2025-11-18T05:05:10"), (40.002, "2025-11-18T17:06:10"), (40.003, "2025-11-17T23:06:10")]
    ),
    "two digits of a year": Case(
        GERMAN,
        [(40.001, "2025-11-18T05:05:11"), (39.998, "2025-11-18T05:06:12")],
        cli={"time_format": "%d.%m.%y %H:%M:%S"},
        page={"time_format": "%d.%m.%y %H:%M:%S"},
        bridge={"times": "%d.%m.%y %H:%M:%S"},
        encoding="cp1252",
    ),
    "two digits without their form": Case(GERMAN, bad=(2, 3), words="%d.%m.%y", encoding="cp1252"),
    "inches far from the target": Case(
        UNIT.format("inch"), size="0.1", column="Run-out [inch]", far=True, words="lies more than 1 mm"
    ),
    "inches without a unit": Case("Time,D40\n2025-11-18 06:05,1.57480\n", far=True, words="lies more than 1 mm"),
    "days of a spreadsheet": Case(
        "Time,D40\n45979.25339,40.001\n",
        [(40.001, "2025-11-18T05:04:52.896000")],
        cli={"time_format": "days since 1899-12-30"},
        page={"time_format": "days since 1899-12-30"},
        bridge={"times": "days since 1899-12-30"},
    ),
    "closed by END": Case("Time\tD40\n18.11.2025 06:05\t40.001\nEND\n", morning(40.001)),
    "tabs and quotes": Case(
        '"Date/Time"\t"Messwert"\t"Remark"\n"18.11.2025 06:05"\t"40,001"\t"a, b; c"\n"18.11.2025 06:06"\t"40,002"\t""\n',
        morning(40.001, 40.002),
        column="Messwert",
    ),
    "footers in one cell": Case(
        THREE + "Anzahl: 3;\n;Mittelwert: 40,002\ns = 0,001;\n", bad=(5, 6, 7), words="limits or statistics"
    ),
    "a footer in one cell that is left out": Case(
        "D40\n40,001\n40,002\nAnzahl: 2\n",
        [(40.001, None), (40.002, None)],
        cli={"last_line": 3},
        page={"last_line": "3"},
        bridge={"statistics": "skip"},
    ),
    "a unit above": Case("Job;4711\nUnit:;inch\n\nTime;D40\n18.11.2025 06:05;1,57484\n", morning(40.000936)),
    "a row of units": Case("Time;D40;Angle\n;[inch];°\n18.11.2025 06:05;1,57484;3\n", morning(40.000936)),
    "two features of one name": Case(
        "Time;Nominal;Measured\n18.11.2025 06:05;40;40,001\n18.11.2025 06:06;40,000;40,002\n18.11.2025 06:07;2;2,001\n",
        bad=(4,),
        words="two characteristics of one name",
    ),
    "one column": Case("D40\n40.0023\n39.9987\n", [(40.0023, None), (39.9987, None)]),
    "an hour that never was": Case("Zeit;Wert\n30.03.2025 02:30;40,001\n", bad=(2,), words="does not exist"),
    "an hour that was twice": Case(
        "Zeit;Wert\n26.10.2025 02:15;40,001\n26.10.2025 02:45;40,002\n", bad=(2, 3), words="+01:00"
    ),
    "seconds": Case("Time,D40\n1763442300,40.001\n", bad=(2,), words="seconds since 1970-01-01"),
    "seconds that are named": Case(
        "Time,D40\n1763442300,40.001\n",
        morning(40.001),
        cli={"time_format": "seconds since 1970-01-01"},
        page={"time_format": "seconds since 1970-01-01"},
        bridge={"times": "seconds since 1970-01-01"},
    ),
    "a zone by its letters": Case("Time,D40\n2025-11-18T06:05:00 CET,40.001\n", bad=(2,)),
    "zones": Case(
        "Time,D40\n2025-11-18T06:05:00.123456789Z,40.001\n2025-11-18T06:06:00+0100,40.002\n",
        [(40.001, "2025-11-18T06:05:00.123456"), (40.002, "2025-11-18T05:06:00")],
    ),
}
DAY = datetime(2025, 11, 18)  # noqa: DTZ001 - a cell knows no zone
BOOKS = {
    "workbook": Case(
        cells=[
            ["Date", "Time", "Size", ""],
            ["", "", "D40", "Unit"],
            [DAY, time(6, 5), 40.001, "mm"],
            ["18.11.2025", "06:06", "40,002", "mm"],
            [DAY, time(6, 7), 1.57488, '"'],
        ],
        good=morning(40.001, 40.002, 40.001952),
    ),
    "workbook with a footer": Case(
        cells=[["Time", "D40"], [DAY.replace(hour=6, minute=5), 40.001], [], ["Mittelwert", 40.001]],
        good=morning(40.001),
        cli={"last_line": 2},
        page={"last_line": "2"},
        bridge={"statistics": "skip"},
        formats={"B2": '0.00"mm"', "B4": '0.00"mm"'},
    ),
    "workbook in microinches": Case(
        cells=[
            ["Time", "D40 [µin]"],
            [DAY.replace(hour=6, minute=5), 40000],
            [DAY.replace(hour=6, minute=6), 40010.125],
        ],
        good=morning(1.016, 1.016257175),
        size="1.016",
        column="D40 [µin]",
    ),
    "workbook with a text of thousands": Case(
        cells=[["Time", "D40 [µin]"], [DAY, 40000], [DAY, "40,010"]],
        size="1.016",
        column="D40 [µin]",
        whole=True,
        words="40,010 uin is a text that may be 40.010 or 40010",
    ),
    "workbook with a formula": Case(
        cells=[["Time", "D40"], [DAY, 40.001], [DAY, "=A1"], [DAY, "#N/A"]], bad=(3, 4), words="formula"
    ),
    "workbook with a share": Case(
        cells=[["Time", "D40"], [DAY, 40.001]], bad=(2,), words="is not a number", formats={"B2": "0.0%"}
    ),
    "workbook of the Mac": Case(
        cells=[["Time", "D40"], [DAY.replace(hour=6, minute=5), 40.001]], good=morning(40.001), epoch=MAC_EPOCH
    ),
    "workbook that is none": Case("Time;D40\n18.11.2025;40,001\n", whole=True, words="not an XLSX workbook"),
}
TABLES |= BOOKS
"""By their names; `Time` or what stands for it is the column of times."""
TIMES = ("Date+Time", "Datum+Uhrzeit", "Time", "Zeit", "Date/Time")
EVERY_DOOR = {
    *("three", "cells missing", "cut off", "marks", "marks that are named", "heading again", "blanks", "minus sign"),
    *("footer that is left out", "footer", "unit beside the size", "a torque in the header", "title in inches"),
    *("title of some unit", "in that may be inches", "a unit that is in doubt and named", "microinches", "utf-16"),
    *("two digits of a year", "inches far from the target", "days of a spreadsheet", "two features of one name"),
    *(
        "thousands or decimals",
        "an hour that was twice",
        "seconds that are named",
        "workbook",
        "workbook with a footer",
    ),
    *("workbook with a formula", "workbook that is none"),
}
"""One table of each kind: what is said beside the file, or asked, at each door. The others are the same file to all: in the short
run they go by REST and through the bridge."""


def as_expected(found: Readings, case: Case) -> bool:
    sizes = [size for size, _at in found] == [pytest.approx(size, abs=1e-12) for size, _at in case.good]
    return sizes and all(at == wanted for (_size, at), (_good, wanted) in zip(found, case.good, strict=True) if wanted)


def names_of(case: Case) -> tuple[list[str], str]:
    """The names of the columns, and the one that is measured."""
    if case.cells:
        return ["Date", "Time"] if "Date" in case.cells[0] else ["Time"], case.column or "D40"
    rows = [line for line in case.text.replace("\ufeff", "").splitlines() if line and "sep=" not in line]
    head = next(
        line
        for line in rows
        if not line.startswith(
            ("Plate", "Date:", "Job", "Unit:", "Report", "All ", "Alle ", "ALL", "Tolerances", "Units")
        )
    )
    cells = [cell.strip().strip('"') for cell in re.split(r"[;,\t]| {2,}", head.strip())]
    return cells, case.column or next(each for each in cells if each in {"D40", "Wert", "Value", "Measured", "Istmaß"})


@pytest.mark.parametrize(
    ("name", "every"),
    [pytest.param(name, True, id=name, marks=() if name in EVERY_DOOR else pytest.mark.long) for name in TABLES]
    + [pytest.param(name, False, id=f"{name}-two") for name in TABLES if name not in EVERY_DOOR],
)
def test_a_table_means_the_same_at_every_door(plant: Plant, tmp_path: Path, name: str, every: bool) -> None:
    case = TABLES[name]
    path = tmp_path / f"{name.replace(' ', '-')}.{'xlsx' if name in BOOKS else 'csv'}"
    path.write_bytes(case.content)
    cells, column = names_of(case)
    refused = bool(case.bad) or case.whole or case.far

    if every:
        by_command = plant.shop.another("cli", **LENGTHS[case.size])
        said = plant.command(path, characteristic=by_command, mapping=f"measured={column}", **case.cli)
        assert as_expected(plant.stored(by_command), case), said
        assert bool(said) == refused, said

    by_rest = plant.shop.another("rest", **LENGTHS[case.size])
    how = case.cli | ({"missing": case.cli["missing"].split(",")} if "missing" in case.cli else {})
    content = b64encode(case.content).decode() if name in BOOKS else case.text
    answer = plant.table(path, content, characteristic=by_rest, map={"measured": column}, timezone=ZONE, **how)
    assert as_expected(plant.stored(by_rest), case), answer
    assert (answer["status"] == 422) == refused
    found = {int(line) for line in re.findall(r"line (\d+)", str([each["field"] for each in answer.get("errors", [])]))}
    assert sorted(found) == list(case.bad or [2] * case.far), "far: the first line of readings"
    assert case.words in str(answer)

    if every:
        by_page = plant.shop.another("page", **LENGTHS[case.size])
        shown = html.unescape(plant.page(path, by_page, column_measured=column, **case.page))
        assert as_expected(plant.stored(by_page), case), shown
        assert bool(shown) == refused
        lines = [int(line) for line in re.findall(r'<tr><td class="num">(\d+)</td>', shown.partition('id="flaws"')[2])]
        assert sorted(set(lines)) == list(case.bad)
        assert case.words in shown

    at = next((each for each in TIMES if all(part in cells for part in each.split("+"))), None)
    columns = {"measured": column} | ({"measured_at": at} if at else {})
    decimal = "." if re.search(r"(?m)(^|[;,\t ])-?\d+\.\d{3,}\b", case.text) else ","
    form = {"format": "xlsx"} if name in BOOKS else {"decimal": decimal}
    readings, faults, words = bridged(path, {"*": "x"}, columns=columns, **(form | case.bridge))
    assert refused or as_expected(readings, case)
    if case.far:
        entries = [
            Entry(line, "*", {"characteristic": "x", "measured": size}, "") for line, (size, _at) in enumerate(readings)
        ]
        assert case.words in str(far_off(entries, {"x": Target(LENGTHS[case.size]["target"], 1.0)}))
        return
    assert case.whole or sorted(set(faults)) == list(case.bad), words  # type: ignore[type-var]
    assert bool(faults) == refused
    assert case.words in words


def test_a_table_by_rest_says_how_it_was_understood(plant: Plant, tmp_path: Path) -> None:
    key = plant.shop.another("rest", **D40)
    text = "Time;Wert [µm];Remark\n18.11.2025 06:05;40001;chip\n"
    answer = plant.table(tmp_path / "a.csv", text, characteristic=key, timezone=ZONE, dry_run=True)
    assert (answer["stored"], answer["unit"], answer["ignored"]) == (1, "um", ["Remark"])
    assert answer["columns"] == {"measured": "Wert [µm]", "measured_at": "Time"}
    assert plant.stored(key) == []
    for name, words in (("a.dfq", "/readings/aqdef"), ("a.xls", "saved as xlsx"), ("a.xlsx", "Base64")):
        assert words in str(plant.table(tmp_path / name, text, characteristic=key))
    plant.shop.call("POST", "/readings/table", 404, name="a.csv", content=text, characteristic="nobody")
    wide = plant.table(tmp_path / "a.csv", f"{key}\n40.001\n", characteristics={"1": key})
    assert [(each["name"], each["stored"]) for each in wide["characteristics"]] == [(key, 1)]


def test_letters_that_are_guessed_are_shown_with_a_name(plant: Plant, tmp_path: Path, capsys: Any) -> None:
    """Ψ1 and Ø1 are one byte: only a person knows."""
    path, key = tmp_path / "a.csv", plant.shop.another("letters", **D40)
    path.write_bytes("Time;Part;D40\n18.11.2025 06:05;Ψ1;40,001\n".encode("cp1253"))
    how = {"characteristic": key, "mapping": "measured=D40", "dry_run": True}
    assert plant.command(path, **how) == ""
    assert "Letters are read as cp1252: “Ø1”." in " ".join(capsys.readouterr().err.split())
    data = {"csrf": plant.engineer.csrf(), "characteristic": key}
    sent = plant.engineer.browser.post("/import", data=data, files={"file": ("a.csv", path.read_bytes())})
    assert "Guessed: cp1252, such as “Ø1”." in html.unescape(sent.text)
    assert plant.command(path, encoding="cp1253", **how) == ""
    assert "Letters are" not in capsys.readouterr().err
    assert plant.page(path, key, column_measured="3", encoding="iso-8859-7") == ""
    with plant.house.database.begin() as session:
        entry = queries.entry_of(session, key)
        assert entry is not None
        assert [row["part"] for row in exporting.rows(session, entry)] == ["Ψ1"]
