"""Files as the machines and spreadsheets of German, Czech, French, Hungarian and American shops write them."""

from datetime import UTC
from pathlib import Path

import pytest

from app.loop.readings.importing.layout import Wishes, look
from app.loop.readings.importing.lines import Line, lines

MORNING = "2025-11-18T05:0{}:00+00:00"
Found = list[tuple[float, str | None] | str]
"""Sizes, mm, with their times, UTC; words of the refusal of a line."""


def at(*sizes: float) -> Found:
    """Sizes of one a minute from 06:05 on."""
    return [(size, MORNING.format(5 + place)) for place, size in enumerate(sizes)]


FILES: dict[str, tuple[str, str, Found]] = {
    "Mahr, µ the only sign": (
        "cp1252",
        "Datum;Uhrzeit;Istwert;Einheit\n18.11.2025;06:05:00;2,1;µm\n18.11.2025;06:06:00;0,0019;mm\n",
        at(0.0021, 0.0019),
    ),
    "Czech, with µ": (
        "cp1250",
        "Datum;Naměřená hodnota [µm];Poznámka\n18.11.2025 6:05;2,5;přesný\n18.11.2025 6:06;3,5;říz\n",
        at(0.0025, 0.0035),
    ),
    "German, the clock in a column of its own": ("utf-8", "Datum;Uhr;Wert\n18.11.2025;06:05;40,001\n", at(40.001)),
    "Hungarian, dots behind the day": (
        "cp1250",
        "Dátum;Idő;Alkatrész;Mért érték\n2025.11.18.;6:05:00;A1;40,001\n2025.11.18.;6:06:00;A2;40,002\n",
        at(40.001, 40.002),
    ),
    "Hungarian, one column of times": ("utf-8", "Időpont;Érték\n2025. 11. 18. 6:05:00;40,001\n", at(40.001)),
    "French, times in a column of hours": ("utf-8", "Heure;Valeur\n18/11/2025 06:05;40,001\n", at(40.001)),
    "French, months by their names": ("cp1252", "Date et heure;Mesure\n18 nov. 2025 06:05;40,001\n", at(40.001)),
    "French, day or month": ("utf-8", "Date;Valeur\n05/11/2025 06:05;40,001\n", ["could be day/month or month/day"]),
    "French, a mean below": (
        "utf-8",
        "Date;Valeur\n18/11/2025 06:05;40,001\nÉcart-type;0,0007\n",
        [*at(40.001), "holds limits or statistics"],
    ),
    "American, inches": ("utf-8", "Date,Time,Actual (in)\n11/18/2025,6:05:00 AM,1.57480\n", at(39.99992)),
    "minus behind the number": ("utf-8", "Zeit;Wert\n18.11.2025 06:05;0,003-\n", ["is not a number"]),
    "blanks that do not break": (
        "utf-8",
        "Zeit;Wert\n18.11.2025 06:05;40,001\u00a0\n18.11.2025 06:06;\u00a040,002\u202fmm\n",
        at(40.001, 40.002),
    ),
    "offsets in the hour that is there twice": (
        "utf-8",
        "Zeit;Wert\n26.10.2025 02:30 +02:00;40,001\n26.10.2025 02:30 +01:00;40,002\n",
        [(40.001, "2025-10-26T00:30:00+00:00"), (40.002, "2025-10-26T01:30:00+00:00")],
    ),
}


def read(path: Path, **mapping: str) -> Found:
    found: Found = []
    for each in lines(path, look(path, Wishes(mapping=mapping, timezone="Europe/Belgrade")), "x"):
        if isinstance(each, Line):
            moment = each.reading.measured_at
            at_utc = moment.astimezone(UTC).isoformat() if moment else None
            found.append((each.reading.measured or 0.0, at_utc))
        else:
            found.append(str(each))
    return found


@pytest.mark.parametrize("name", FILES)
def test_a_file_of_a_shop(tmp_path: Path, name: str) -> None:
    encoding, text, wanted = FILES[name]
    path = tmp_path / "a.csv"
    path.write_bytes(text.encode(encoding))
    found = read(path)
    assert len(found) == len(wanted)
    for one, other in zip(found, wanted, strict=True):
        assert (other in one) if isinstance(other, str) else (one == other)


@pytest.mark.parametrize("measured", ["2", "40,001 mm"])
def test_of_a_file_without_a_heading_the_first_line_is_a_reading(tmp_path: Path, measured: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text("1;40,001 mm;18.11.2025 06:05:00\n2;40,002 mm;18.11.2025 06:06:00\n")
    assert read(path, measured=measured, measured_at="3") == at(40.001, 40.002)
    path.write_text("Part;1;2\nA;40,001;40,002\n")
    assert read(path, measured="1", part="Part") == [(40.001, None)], "a number may be a name"


def test_a_diameter_that_is_called_as_a_mean_is_a_characteristic(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    for head, rest in (("Znak;Hodnota", ""), ("Znak;Hodnota;Jmenovitá hodnota", ";40")):
        path.write_text(f"{head}\nPrůměr;40,001{rest}\nKruhovost;0,003{rest}\n")
        assert look(path, Wishes()).names == ("Průměr", "Kruhovost")


@pytest.mark.parametrize("head", ["Pos.;Maß;Istwert", "Mera;Vrednost;Datum", "Размер;Значение", "Size,Actual"])
def test_a_column_that_could_be_the_measured_one_names_what_is_measured_in_another(tmp_path: Path, head: str) -> None:
    path, sign = tmp_path / "a.csv", "," if "," in head else ";"
    values = {"Pos.": "1", "Istwert": "40.001", "Vrednost": "40.001", "Значение": "40.001", "Actual": "40.001"}
    rows = (
        sign.join(values.get(column, "18.11.2025" if column == "Datum" else name) for column in head.split(sign))
        for name in ("D40", "L16")
    )
    path.write_text("\n".join((head, *rows, "")))
    assert look(path, Wishes()).names == ("D40", "L16")
