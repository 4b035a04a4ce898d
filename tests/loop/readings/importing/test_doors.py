"""Files of others at every door: the command, the page, REST and the bridge's preview say the same of each.

The shapes are those of real files. What each means is written down here as sizes and moments; a file that is refused names the
lines. All doors are called in this process, on one plant.
"""

import html
import io
import json
import re
from base64 import b64encode
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime, time
from pathlib import Path
from typing import Any

import click
import pytest
import typer
from openpyxl import Workbook
from openpyxl.utils.datetime import MAC_EPOCH, WINDOWS_EPOCH

from app.bridge import file_content
from app.bridge.configuration import configuration_from
from app.bridge.file_content import read_content
from app.bridge.file_entries import Entry
from app.bridge.plausible import Target, far_off
from app.cli import data
from app.core.parameters import read
from app.errors import InbandError
from app.files.aqdef.values import OF_CHARACTERISTIC as C
from app.files.aqdef.values import OF_FIELD as F
from app.files.formats.column_names import NAMES
from app.loop.readings import exporting, queries, table_api
from app.loop.readings.aqdef import actions as aqdef_actions
from app.loop.readings.aqdef import content as aqdef_content
from app.loop.readings.aqdef.matching import parameters_of
from app.loop.readings.importing import drawn, uploads
from app.loop.readings.importing import lines as importing
from app.loop.readings.importing.layout import Wishes, look
from tests.conftest import NewDatabase, drop_database
from tests.in_process import InProcess, in_process
from tests.shop import Person, Shop

ZONE = "Europe/Belgrade"
D40: dict[str, Any] = {"target": 40.0, "tolerance_width": 0.1, "averaging_limit": 0.033333}
LENGTHS = {
    "40": D40,
    "0.1": D40 | {"target": 0.1, "tolerance_width": 0.2, "confidence_limit": 1.0},
    "16": D40 | {"target": 16.0},
    "2.167": D40 | {"target": 2.167},
    "1.25": D40 | {"target": 1.25},
    "0": D40 | {"target": 0.0},
    "1.016": D40 | {"target": 1.016},
}
MORNING = "2025-11-18T05:0{}:00"
Readings = list[tuple[float, str | None]]


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
    "title of some unit": Case("Tolerances in µm\n" + THREE, words="nobody can tell", whole=True),
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


class Plant:
    """The plant of these tests, and what came of a file at each door."""

    def __init__(self, house: InProcess) -> None:
        self.house, self.shop, self.engineer = house, Shop(house), Person(house, "engineer")

    def stored(self, key: str) -> Readings:
        with self.house.database.begin() as session:
            entry = queries.entry_of(session, key)
            assert entry is not None
            return [
                (row["measured"], row["measured_at"].astimezone(UTC).replace(tzinfo=None).isoformat())
                for row in exporting.rows(session, entry)
            ]

    def command(self, path: Path, **options: Any) -> str:
        """What the command says; the error that it ends with."""
        try:
            data.import_file(path, timezone=ZONE, database_url=self.house.database.dsn, **options)
        except (typer.Exit, typer.BadParameter, click.ClickException, InbandError) as error:
            return f"refused {error}"
        return ""

    def table(self, path: Path, text: str, **given: Any) -> dict[str, Any]:
        """The answer of REST, and its status."""
        sent = {"name": path.name, "content": text, **given}
        answer = self.shop.admin.post("/api/v1/readings/table", json=sent)
        assert answer.status_code in {200, 422}, answer.text
        content: dict[str, Any] = answer.json()
        return content | {"status": answer.status_code}

    def page(self, path: Path, characteristic: str = "", **said: str) -> str:
        """The page of the refusal, after the preview said the same; nothing where it was imported."""
        browser, csrf = self.engineer.browser, self.engineer.csrf()
        sent = browser.post(
            "/import",
            data={"csrf": csrf, "characteristic": characteristic},
            files={"file": (path.name, path.read_bytes())},
        )
        if sent.status_code == 422:
            return f"refused {sent.text}"
        assert sent.status_code == 200, sent.text
        token = re.search(r"/import/([\w-]{22})", str(sent.url))
        assert token is not None
        said = {"characteristic": characteristic, "timezone": ZONE} | said
        preview = browser.get(f"/import/{token[1]}", params=said)
        assert preview.status_code == 200
        if not characteristic:
            said |= dict(re.findall(r'<input type="hidden" name="(to_\d+)" value="([^"]*)"', preview.text))
        answer = browser.post(f"/import/{token[1]}", data=said | {"csrf": csrf}, follow_redirects=False)
        refused = answer.status_code != 303
        assert refused == ("disabled" in preview.text[: preview.text.index("Import all")][-200:]), "preview and import"
        return f"refused {answer.text}" if refused else ""


@pytest.fixture(scope="module")
def plant(new_database: NewDatabase) -> Iterator[Plant]:
    url = new_database()
    with pytest.MonkeyPatch.context() as patch, in_process(url, timezone=ZONE) as house:
        for module in (
            importing,
            aqdef_actions,
            aqdef_content,
            table_api,
            uploads,
            file_content,
        ):  # tests/files/test_apart.py has the other process
            patch.setattr(module, "apart", lambda work, *given: work(*given))
        yield Plant(house)
    drop_database(url)


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


LONG = (
    "partnb\tid\tactual\tnominal\tuppertol\tlowertol\tcomment\tgroup1\tgroup2\n"
    + "".join(
        f"{part}\t{name}\t{size:.7f}\t{nominal}\t0.005\t-0.005\n"
        for part, last in ((815, 16.003), (816, 16.004), (817, 16.005))
        for name, size, nominal in (("Seal_1_X", 0.001, 0), ("Seal_1_Y", 0.0, 0), ("Seal_1_D", last, 16))
    )
)  # fmt: skip
PARTS = {"Seal_1_X": [0.001] * 3, "Seal_1_Y": [0.0] * 3, "Seal_1_D": [16.003, 16.004, 16.005]}


@pytest.mark.parametrize("door", ["command", "page", "rest"])
def test_a_table_with_one_row_a_characteristic_is_sorted_by_its_names(plant: Plant, tmp_path: Path, door: str) -> None:
    path, text = tmp_path / "chr.txt", LONG
    keys = {name: plant.shop.another(door, **LENGTHS["16" if name[-1] == "D" else "0"]) for name in PARTS}
    for name, key in keys.items():
        text = text.replace(name, f"Seat {key}")
    path.write_text(text)
    if door == "rest":
        assert plant.table(path, text)["stored"] == 9
    else:
        assert (plant.command(path) if door == "command" else plant.page(path)) == ""
    assert {name: [size for size, _at in plant.stored(key)] for name, key in keys.items()} == PARTS
    with plant.house.database.begin() as session:
        entry = queries.entry_of(session, keys["Seal_1_D"])
        assert entry is not None
        assert [row["part"] for row in exporting.rows(session, entry)] == ["815", "816", "817"]


@pytest.mark.parametrize("door", ["command", "page", "rest"])
def test_the_name_in_a_row_says_the_unit_of_the_row(plant: Plant, tmp_path: Path, door: str) -> None:
    key, path = plant.shop.another("long"), tmp_path / "chr.csv"
    path.write_text(
        f"Characteristic,Actual,Part\n{key} [inch],1.57480,P1\nAngle [deg],12.5,P1\n{key} [inch],1.57484,P2\n"
    )
    mapping = {f"{key} [inch]": key}
    if door == "command":
        assert plant.command(path, columns=f"{key} [inch]={key}") == ""
    elif door == "page":
        assert plant.page(path, key) == ""
    else:
        assert plant.table(path, path.read_text(), characteristics=mapping)["stored"] == 2
    assert [size for size, _at in plant.stored(key)] == [39.99992, 40.000936]
    columns = {"measured": "Actual", "characteristic": "Characteristic", "part": "Part"}
    readings, faults, words = bridged(path, mapping, columns=columns, others="skip")
    assert not faults, words
    assert [size for size, _at in readings] == [39.99992, 40.000936]


def test_a_row_whose_name_has_an_unknown_unit_is_no_millimetre(plant: Plant, tmp_path: Path) -> None:
    key, path = plant.shop.another("long"), tmp_path / "chr.csv"
    path.write_text("Characteristic,Actual,Part\nBore [furlong],40.001,P1\n")
    assert plant.command(path, columns=f"Bore [furlong]={key}") == "refused 1"
    assert plant.stored(key) == []
    columns = {"measured": "Actual", "characteristic": "Characteristic"}
    _readings, faults, words = bridged(path, {"Bore [furlong]": key}, columns=columns)
    assert list(faults) == [2]
    assert "furlong" in words


def test_a_word_in_a_name_is_no_unit_where_the_unit_is_said(plant: Plant, tmp_path: Path) -> None:
    key, path = plant.shop.another("long"), tmp_path / "chr.csv"
    columns = {"measured": "Actual [mm]", "characteristic": "Characteristic"}
    for name, taken in (("Bore (top)", True), ("Angle (deg)", False), ("Bore [1/1000 mm]", False)):
        path.write_text(f"Characteristic,Actual [mm],Part\n{name},40.001,P1\n")
        assert (plant.command(path, columns=f"{name}={key}", mapping="measured=Actual [mm]") == "") == taken
        assert (bridged(path, {name: key}, columns=columns)[1] == []) == taken
    assert [size for size, _at in plant.stored(key)] == [40.001]


@pytest.mark.parametrize("head", ["Name,Nominal,Actual", "Bezeichnung,Istwert,Upper,Lower", "Actual,Dimension,USL,LSL"])
def test_a_name_beside_a_nominal_size_or_limits_is_the_characteristics(tmp_path: Path, head: str) -> None:
    path, columns = tmp_path / "a.csv", head.split(",")
    path.write_text(
        f"{head}\n{','.join('A' if each in {'Name', 'Bezeichnung', 'Dimension'} else '1' for each in columns)}\n"
    )
    assert look(path, Wishes()).names == ("A",)
    path.write_text("Time,Name,Actual\n2025-11-18 06:05,Ana,40.001\n")
    assert look(path, Wishes()).names == ("Ana",), "a person, perhaps: of several it is asked"


def test_characteristics_side_by_side_below_their_name_are_no_rows_of_limits(plant: Plant, tmp_path: Path) -> None:
    key, path = plant.shop.another("wide", **D40), tmp_path / "calypso.csv"
    path.write_text(
        "Characteristic;Diameter_1;Roundness\nNominal value;40,000;0,000\nUpper tolerance;0,050;0,010\n"
        "Lower tolerance;-0,050;\nPart 1;40,001;0,003\nPart 2;40,002;0,004\n"
    )
    refused = plant.command(path, characteristic=key, mapping="measured=Diameter_1")
    assert "line 2: 'Nominal value' holds limits or statistics: here the characteristics stand side by side" in refused
    said = {"mapping": "measured=Diameter_1,characteristic=", "first_line": 5}
    assert plant.command(path, characteristic=key, **said) == ""
    assert [size for size, _at in plant.stored(key)] == [40.001, 40.002]


def test_a_feature_and_its_characteristic_name_it_together(plant: Plant, tmp_path: Path) -> None:
    path = tmp_path / "chr.csv"
    path.write_text("Characteristic,Feature,Actual,Part\nDiameter,Circle 1,40.001,P1\nDiameter,Circle 2,20.002,P1\n")
    assert look(path, Wishes()).names == ("Diameter Circle 1", "Diameter Circle 2")


@pytest.mark.parametrize("door", ["command", "page", "rest"])
def test_of_such_a_table_what_is_missing_is_set_up_with_its_limits(plant: Plant, tmp_path: Path, door: str) -> None:
    stem, path = plant.shop.another("long").replace("-", ""), tmp_path / "chr.txt"
    form = f"815\t{stem}_F\t0.002\t\t0.01\n"  # a form error has an upper limit only
    path.write_text(LONG.replace("Seal_1", stem) + form + f"815\t{stem}_N\t12.003\t12\n")
    if door == "command":
        assert plant.command(path, create_missing=True, machine=plant.shop.machine) == ""
    elif door == "page":
        assert plant.page(path, all="new", machine=plant.shop.machine) == ""
    else:
        answer = plant.table(path, path.read_text(), create_missing=True, machine=plant.shop.machine)
        made = {
            each["name"]: (each["characteristic"], each["created"], each["stored"])
            for each in answer["characteristics"]
        }
        assert made[f"{stem}_D"] == (f"{stem}-d", True, 3)
        assert made[f"{stem}_N"] == (None, False, 0)
    for name, sizes in PARTS.items():
        key = name.replace("Seal_1", stem).lower().replace("_", "-")
        assert [size for size, _at in plant.stored(key)] == sizes
        parameters = plant.shop.call("GET", f"/characteristics/{key}")["parameters"]
        limits = [parameters[each] for each in ("nominal", "lower_deviation", "upper_deviation", "mode")]
        assert limits == [16.0 if name[-1] == "D" else 0.0, -0.005, 0.005, "measure_only"]
    parameters = plant.shop.call("GET", f"/characteristics/{stem}-f")["parameters"]
    assert (parameters["upper_deviation"], parameters["natural_limit"]) == (0.01, "lower")
    plant.shop.call("GET", f"/characteristics/{stem}-n", 404)
    assert plant.command(path, create_missing=True) == "", "what is there now is found by its name"
    plant.shop.call("GET", f"/characteristics/{stem}-d-2", 404)
    assert [size for size, _at in plant.stored(f"{stem}-d")] == PARTS["Seal_1_D"]


@pytest.mark.parametrize(
    ("head", "row", "found"),
    [
        ("Feature;Meas;Nominal;+TOL;-TOL", "A;16.001;16;0.010;0.020", (16.0, 15.98, 16.01)),
        ("Feature;Meas;Nominal;USL;LSL", "A;16.001;16;16.010;15.990", (16.0, 15.99, 16.01)),
        ("Feature;Meas;Nominal;Upper;Lower", "A;16.001;16;16.010;15.990", (16.0, 15.99, 16.01)),
        ("Feature;Meas;Nominal;Upper;Lower", "A;16.001;16;0.010;-0.010", (16.0, 15.99, 16.01)),
        ("Feature;Meas;Nominal;Upper [µm];Lower [µm]", "A;16.001;16;10;-10", (16.0, 15.99, 16.01)),
        ("Feature;Meas;Upper;Lower", "A;16.001;16.010;15.990", "its Lower may be a size or a deviation"),
        ("Feature;Meas;USL;LSL", "A;16.001;16.010;15.990", (None, 15.99, 16.01)),
        ("Element;Actual;Nominal;Up.Tol;Low.Tol", "A;16.001;16;0.010;-0.020", (16.0, 15.98, 16.01)),
        ("Name;Istwert;Sollwert;Ob.Tol.;Un.Tol.", "Ring (Bore);16.001;16;0.010;-0.020", (16.0, 15.98, 16.01)),
        (
            "Feature;Measured value;Design value;Upper limit;Lower limit",
            "A;16;16;0.01;-0.01",
            "far from the nominal size",
        ),
        ("Feature;Axis;Nominal;Meas;+Tol;-Tol", "CONE1;Angle;30;30.001;0.1;-0.1", "names the unit 'Angle'"),
        ("Feature;Meas;Nominal;Upper Tol;Lower Tol;Unit", "A;0.5;0.5;0.001;-0.001;inch", (12.7, 12.6746, 12.7254)),
        ("Feature;Meas;Nominal [in];Upper Tol [µm];Lower Tol [µm]", "A;0.5;0.5;10;-10", (12.7, 12.69, 12.71)),
        ("Feature;Meas;Nominal;Upper Tol;Lower Tol", "A;16.001;16;0.010;0.005", "is above 0: a deviation"),
        ("Feature;Meas;Upper Tol;Lower Tol", "A;16.001;0.010;-0.005", "from a nominal size, which is missing"),
        ("Feature;Meas;Nominal;Upper Tol", "A;16.001;16;0.010", "the lower limit (--map lower=COLUMN) is missing"),
        (
            "Feature;Meas;Nominal;USL;LSL",
            "A;16;16;16.1;15.9\nA;16;16;16.2;15.9",
            "lines 2 and 3 give it different limits",
        ),
        ("Feature;Meas;Nominal;USL;LSL", "A;16;16;about;15.9", "'about' is not a number"),
        ("Feature;Meas;Nominal;±Tol", "A;16.001;16;0.010", (16.0, 15.99, 16.01)),
        ("Feature;Meas;Nominal;Tol. +/- [µm]", "A;16.001;16;±10", (16.0, 15.99, 16.01)),
        ("Feature;Meas;Nominal;+/-", "A;0.001;0;-0.005", (0.0, -0.005, 0.005)),
        ("Feature;Meas;±Tol", "A;16.001;0.010", "from a nominal size, which is missing"),
        ("Feature;Meas;Nominal;Tol", "A;16.001;16;±0.010", (16.0, 15.99, 16.01)),
        ("Feature;Meas;Nominal;Toleranz [µm]", "A;16.001;16;+/-10", (16.0, 15.99, 16.01)),
        ("Feature;Meas;Nominal;Tol", "A;16.001;16;0.010", "its Tol '0.010' may be half the tolerance or all of it"),
        ("Feature;Meas;Nominal;Tol", "A;16.001;16;H7", "its Tol 'H7' may be"),
        ("Feature;Meas;Nominal;Upper;Lower", "A;0.5;0.5;0.4;-0.4", (0.5, 0.1, 0.9)),
        ("Feature;Meas;Nominal;Upper;Lower", "A;0.2;0.2;0.3;0.1", (0.2, 0.1, 0.3)),
        ("Feature;Meas;Nominal;Upper;Lower", "A;0.2;0.2;0.3;-0.3", "may be a size or a deviation, and no other line"),
        ("Feature;Meas;Nominal;Upper;Lower", "A;0.2;0.2;0.3;-0.3\nB;16;16;0.1;0", (0.2, -0.1, 0.5)),
        ("Feature;Meas;Nominal;Upper;Lower", "A;0.2;0.2;0.3;0\nB;16;16;16.1;16", (0.2, 0.0, 0.3)),
        ("Feature;Meas;Nominal;Upper;Lower", "A;0.1;0.1;0.2;0.05\nB;16;16;0.1;0", "sizes by the numbers of line 2"),
        ("Feature;Meas;Nominal;Upper;Lower", "A;20;20;0.2;0\nB;16;16;16.1;15.9", "sizes by the numbers of line 3"),
        ("Feature;Meas;Nominal;Upper Tol;Lower Tol", "A;-25;-25;-24.9;-25.1", "near the nominal size: a size?"),
        ("Feature;Meas;Nominal;USL;LSL", "A;0.5;0.5;0.4;-0.4", "far from the nominal size: a deviation?"),
    ],
)
def test_the_limits_of_a_row(tmp_path: Path, head: str, row: str, found: tuple[float | None, ...] | str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(f"{head}\n{row}\n")
    named = {} if "Name;" not in head else {"characteristic": "Name"}
    content, *_others = drawn.contents(look(path, Wishes(mapping=named)))
    if isinstance(found, str):
        assert found in content.not_new
    else:
        assert content.not_new == ""
        assert (content.nominal, content.lower, content.upper) == pytest.approx(found)


@pytest.mark.parametrize(
    ("cells", "found"),
    [
        ("0;0.01;0;lower", "lower"),
        ("0;0.01;0;none", "none"),  # a position: sizes below 0 exist
        ("0;0.01;0;", "lower"),  # as it is assumed of every set
        ("16;0.01;-0.02;Upper", "upper"),
        ("0;0.01;0;left", "Natural limit 'left' is not lower, upper or none"),
    ],
)
def test_a_row_names_its_natural_limit(tmp_path: Path, cells: str, found: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(f"Feature;Meas;Nominal;Upper Tol;Lower Tol;Natural limit\nA;0.004;{cells}\n")
    [content] = drawn.contents(look(path, Wishes()))
    if content.not_new:
        assert found in content.not_new
    else:
        assert read(parameters_of(content))[0].natural_limit.value == found


@pytest.mark.parametrize("door", ["command", "page", "rest"])
def test_an_axis_beside_the_feature_belongs_to_its_name(plant: Plant, tmp_path: Path, door: str) -> None:
    path, stem = tmp_path / "pcdmis.csv", plant.shop.another("loc").replace("-", "")
    rows = (
        f"{stem},{axis},{nominal},{size},0.01,0.01\n" for axis, nominal, size in (("X", 10, 10.003), ("D", 16, 16.004))
    )
    text = "Feature,Axis,Nominal,Meas,+Tol,-Tol\n" + "".join(rows)
    path.write_text(text)
    if door == "command":
        assert plant.command(path, create_missing=True, machine=plant.shop.machine) == ""
    elif door == "page":
        assert plant.page(path, all="new", machine=plant.shop.machine) == ""
    else:
        assert plant.table(path, text, create_missing=True, machine=plant.shop.machine)["stored"] == 2
    assert [plant.stored(f"{stem}-{axis}")[0][0] for axis in "xd"] == [10.003, 16.004]
    names = {f"{stem} {axis}": axis.lower() for axis in "XD"}
    columns = {"characteristic": "Feature+Axis", "measured": "Meas"}
    assert [size for size, _at in bridged(path, names, columns=columns)[0]] == [10.003, 16.004]
    faults = bridged(path, {stem: "x"}, columns={"characteristic": "Feature", "measured": "Meas"})[1:]
    assert faults[0] == [3]
    assert "two characteristics of one name" in faults[1]


OBJECTS = [
    {"characteristic": name, "measured": size, "part": part}
    for part, last in ((815, 16.003), (816, 16.004), (817, 16.005))
    for name, size in (("Seal_1_X", 0.001), ("Seal_1_Y", 0.0), ("Seal_1_D", last))
]


@pytest.mark.parametrize("kind", ["json", "ndjson"])
def test_objects_are_sorted_by_their_characteristic_as_rows_are(plant: Plant, tmp_path: Path, kind: str) -> None:
    path, text = tmp_path / f"a.{kind}", json.dumps(OBJECTS) if kind == "json" else "\n".join(map(json.dumps, OBJECTS))
    keys = {name: plant.shop.another(kind, **LENGTHS["16" if name[-1] == "D" else "0"]) for name in PARTS}
    alone = plant.shop.another("d16", **LENGTHS["16"])
    path.write_text(text)
    for ask in (plant.command(path, characteristic=alone), plant.page(path, alone)):
        assert "none is called" in ask
    assert plant.stored(alone) == []
    for name, key in keys.items():
        text = text.replace(name, key)
    path.write_text(text)
    assert plant.command(path) == ""
    assert {name: [size for size, _at in plant.stored(key)] for name, key in keys.items()} == PARTS
    path.write_text(text.replace(keys["Seal_1_D"], alone))
    assert plant.page(path, alone) == ""
    assert [size for size, _at in plant.stored(alone)] == PARTS["Seal_1_D"], "its own rows only"


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


def test_of_such_a_table_one_characteristic_gets_its_own_rows_or_a_question(plant: Plant, tmp_path: Path) -> None:
    path = tmp_path / "chr.txt"
    path.write_text(LONG)

    def by_command(key: str) -> str:
        return plant.command(path, characteristic=key)

    def by_page(key: str) -> str:
        return plant.page(path, key)

    for ask in (by_command, by_page):
        key = plant.shop.another("d16", **LENGTHS["16"])
        assert "none is called" in ask(key)
        assert plant.stored(key) == []
        path.write_text(LONG.replace("Seal_1_D", key))
        assert ask(key) == ""
        assert [size for size, _at in plant.stored(key)] == PARTS["Seal_1_D"]
        path.write_text(LONG)
    columns = {"characteristic": "id", "measured": "actual", "part": "partnb"}
    readings, faults, _words = bridged(path, {name: name.lower() for name in PARTS}, columns=columns)
    assert (len(readings), faults) == (9, [])


def test_what_is_read_beside_is_not_called_passed_over(plant: Plant, tmp_path: Path, capsys: Any) -> None:
    path, stem = tmp_path / "a.csv", plant.shop.another("beside").replace("-", "")
    rows = f"{stem} A;16;16.1;15.9;16.001\n{stem} B;8;8.1;7.9;8.001\nC;8;;;8.001\n"
    path.write_text(f"Name;Nominal;USL;LSL;Actual\n{rows}")
    assert plant.command(path, create_missing=True, machine=plant.shop.machine) == ""
    said = capsys.readouterr().err.split()
    told = " ".join(said)
    assert told.count("passed over") == 1, "of the one that nobody reads, once"
    assert "line 4: is of 'C', which is not chosen; passed over." in told
    assert f"1 reading of {stem}-b" in told
    assert told.count("They are history") == 1
    assert plant.command(path, create_missing=True, machine=plant.shop.machine) == ""
    again = " ".join(capsys.readouterr().err.split())
    assert f"0 readings of {stem}-b. 1 was stored before and is not stored again." in again


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


@pytest.mark.parametrize("head", ["Name;Value", "Time;Name;Value", "Value;Dimension;Date", "Merkmal;Wert;Zeit"])
def test_of_a_name_and_a_value_a_row_each_is_of_the_characteristic_it_names(
    plant: Plant, tmp_path: Path, head: str
) -> None:
    path, key, columns = tmp_path / "two.csv", plant.shop.another("bore", **D40), head.split(";")
    moments = iter(range(5, 9))

    def line(name: str, size: str) -> str:
        at = f"18.11.2025 06:0{next(moments)}"
        cells = {"Value": size, "Wert": size, "Time": at, "Zeit": at, "Date": at}
        return ";".join(cells.get(column, name) for column in columns) + "\n"

    text = f"{head}\n" + line("Bore", "40.001") + line("Shaft", "40.002")
    place = next(at for at, column in enumerate(columns, 1) if column in {"Name", "Dimension", "Merkmal"})
    measured = next(at for at, column in enumerate(columns, 1) if column in {"Value", "Wert"})
    path.write_text(text)
    answer = plant.table(path, text, characteristic=key)
    for ask in (plant.command(path, characteristic=key), plant.page(path, key), str(answer)):
        assert "2 characteristics (Bore, Shaft)" in ask
        assert "--map characteristic=" in ask
    data = {"csrf": plant.engineer.csrf(), "characteristic": key}
    preview = plant.engineer.browser.post("/import", data=data, files={"file": ("two.csv", text)}).text
    assert 'name="column_characteristic"' in preview, "it can be said on the page too"
    assert plant.stored(key) == []
    path.write_text(text.replace("Bore", key))
    assert plant.command(path, characteristic=key) == ""
    assert [size for size, _at in plant.stored(key)] == [40.001], "its own row only"
    other = plant.shop.another("serial", **D40)
    path.write_text(text)
    said = {"column_characteristic": "", "column_part": str(place), "column_measured": str(measured)}
    assert plant.page(path, other, **said) == ""
    assert [size for size, _at in plant.stored(other)] == [40.001, 40.002], "where the names are those of parts"


def test_a_number_of_a_row_is_no_name(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("ID;Value\n1;40.001\n2;40.002\n")
    assert look(path, Wishes()).names == ()


@pytest.mark.parametrize(
    "head",
    [
        *("Feature,Actual,Nominal", "Actual,Name", "Value,Time,Characteristic", "Balloon No.,Measured", "Item;Value"),
        *("Prüfmerkmal;Messwert", "Messgröße;Wert;Datum", "Zeit;Bezeichnung;Istmaß", "Datum;Merkmal Nr.;Ist"),
        *("Date;Caractéristique;Valeur", "Date;Cote;Valeur mesurée", "Nom;Valeur", "Désignation;Mesure;Heure"),
        *("Datum;Znak;Naměřená hodnota", "Název;Hodnota", "Čas;Rozměr;Skutečná hodnota"),
        *("Dátum;Jellemző;Mért érték", "Megnevezés;Érték", "Méret;Mért érték;Idő"),
        *("Cecha;Wartość zmierzona", "Data;Nazwa;Pomiar", "Caratteristica;Valore", "Data;Quota;Misura"),
        *("Característica;Medición", "Nombre;Valor", "Kenmerk;Meetwaarde", "Egenskap;Mätvärde", "Özellik;Değer"),
        *("Denumire;Valoare", "Značajka;Vrijednost", "測定項目,測定値", "特性,测量值", "항목,측정값"),
    ],
)
def test_the_column_of_names_is_known_as_the_value_beside_it(tmp_path: Path, head: str) -> None:
    path, sign = tmp_path / "a.csv", ";" if ";" in head else ","
    values = {"actual", "value", "measured", *map(str.casefold, NAMES["measured"])}

    def cell(column: str, name: str) -> str:
        column = column.casefold()
        if column in values:
            return "16.001"
        if column == "nominal":
            return "16"
        return (
            "2025-11-18"
            if column in {"time", "date", "zeit", "datum", "heure", "čas", "dátum", "idő", "data"}
            else name
        )

    rows = (sign.join(cell(column, name) for column in head.split(sign)) for name in ("Bore 1", "Bore 2"))
    path.write_text("\n".join((head, *rows, "")), encoding="utf-8")
    assert look(path, Wishes()).names == ("Bore 1", "Bore 2")


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


CASES = Path(__file__).parent / "cases"
RUN_OUT = {
    "target": None,
    "tolerance_width": None,
    "nominal": 0,
    "upper_deviation": 0.0127,
    "lower_deviation": 0,
    "averaging_limit": 0.004,
    "tool_memory": 0,
    "average_memory": 0,
    "weighting_factor": 1,
}


def through_all_doors(plant: Plant, path: Path, **parameters: Any) -> str:
    """The key of a characteristic with the readings of a file, after all doors found the same in it."""
    written = [line.split(",") for line in path.read_text().splitlines()[1:]]
    wanted = [(float(size), in_utc(at)) for at, size in written]
    keys = [plant.shop.another(door, **parameters) for door in ("cli", "page", "rest")]
    assert plant.command(path, characteristic=keys[0]) == plant.page(path, keys[1]) == ""
    plant.table(path, path.read_text(), characteristic=keys[2])
    for key in keys:
        assert plant.stored(key) == wanted
    readings, _lines, words = bridged(path, {"*": "x"}, columns={"measured": "Value", "measured_at": "Time"})
    assert (readings, words) == (wanted, "")
    return keys[2]


def test_run_outs_of_a_file_are_judged_by_their_natural_limit(plant: Plant) -> None:
    path = Path(__file__).parents[3] / "quality" / "capability" / "runout-half-normal.csv"
    key = through_all_doors(plant, path, **RUN_OUT)
    found = plant.shop.call("GET", f"/characteristics/{key}/capability?last=all")
    assert round(found["percentiles"]["ppk"], 4) == 1.9398
    assert round(found["ppk"]["value"], 4) == 2.4087
    assert (found["natural_limit"], found["lower_limit"], found["cp"]) == ("lower", None, None)
    assert {found[name]["below"] for name in ("ppm_within", "ppm_overall", "ppm_observed")} == {None}


def test_rules_begin_again_with_the_baseline_of_a_file_that_shifts(plant: Plant) -> None:
    key = through_all_doors(plant, CASES / "rebase-after-shift.csv", target=40.0, tolerance_width=0.1)
    path = f"/characteristics/{key}"
    part: dict[str, Any] = {"quantity": "deviation", "first_sequence": 101, "last_sequence": 160, "reason": "shift"}
    frozen = plant.shop.call("POST", f"{path}/baselines", 201, **part)
    assert (frozen["centre"], frozen["sigma"]) == pytest.approx((0.00614, 0.0020158), abs=6e-7)
    rules = {"main": {f"nelson_{number}": "watch" for number in range(1, 9)}}
    plant.shop.call("PUT", f"{path}/rules", rules=rules, reason="all")
    shown = plant.shop.call("GET", f"{path}/control?first=101&last=60")
    assert [(each["rule"], each["first"], each["last"]) for each in shown["signals"]] == [("nelson_6", 135, 138)]


def test_a_gauge_study_with_one_row_a_reading_is_the_same_pasted_and_posted(plant: Plant) -> None:
    """As readings of a part of another size it is refused at each door, as every such file is."""
    path = CASES / "grr-long.csv"
    text = path.read_text()
    rows = [dict(zip(("part", "operator", "values"), line.split(","), strict=True)) for line in text.splitlines()[1:]]
    posted = [each | {"values": [float(each["values"])]} for each in rows]
    shop = plant.shop
    settings: dict[str, Any] = {"gauge": "Probe", "characteristic": shop.characteristic}
    shop.call("POST", "/gauge-studies", 201, kind="grr", rows=posted, **settings)
    typed = settings | {"kind": "grr", "machine": shop.machine, "do": "store", "table": text}
    plant.engineer.send("/gauges/new", **typed)
    for study in shop.call("GET", f"/gauge-studies?machine={shop.machine}&limit=2")["items"]:
        anova, ranges = study["grr"]
        (tested,) = [each for each in anova["table"] if each["source"] == "interaction"]
        assert (tested["f"], tested["p_value"]) == pytest.approx((0.5955, 0.767), abs=5e-4)
        sigma = {each["name"]: each["sigma"] for each in anova["components"]}
        wanted = {
            "grr": 0.00103834,
            "repeatability": 0.00103834,
            "reproducibility": 0,
            "part": 0.0157385,
            "total": 0.0157727,
        }
        assert {name: sigma[name] for name in wanted} == pytest.approx(wanted, abs=5e-8)
        assert (anova["pooled"], anova["ndc"]) == (True, 21)
        shares = [
            each["percent"] for method in (anova, ranges) for each in method["components"] if each["name"] == "grr"
        ]
        assert shares == pytest.approx([6.583, 6.685], abs=5e-4)
    key = shop.another(
        "part", **LENGTHS["16"]
    )  # as readings: no size is near the target, and nothing says whose they are
    assert "lies more than" in plant.command(path, characteristic=key)
    assert "lies more than" in html.unescape(plant.page(path, key))
    assert "lies more than" in str(plant.table(path, text, characteristic=key))
    readings, _lines, _words = bridged(path, {"*": "x"}, columns={"measured": "Measurement"})
    entries = [Entry(2, "*", {"characteristic": "x", "measured": size}, "") for size, _at in readings]
    assert far_off(entries, {"x": Target(16.0, 1.0)})
