"""Tables whose rows say of which characteristic each is, at every door: sorted by their names, set up, or asked about."""

import json
from pathlib import Path
from typing import Any

import pytest

from app.core.parameters import read
from app.files.formats.column_names import NAMES
from app.loop.readings import exporting, queries
from app.loop.readings.aqdef.matching import parameters_of
from app.loop.readings.importing import drawn
from app.loop.readings.importing.layout import Wishes, look
from tests.loop.readings.importing.doors import D40, LENGTHS, Plant, bridged

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
