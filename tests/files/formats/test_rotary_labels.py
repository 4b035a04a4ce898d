"""Labels that other versions of the control use, in three languages, and tables laid out otherwise."""

import pytest

from app.files.formats.rotary_protocol import Protocol, read_protocol

AXIS = {"de": "Drehachse B", "en": "Rotary axis B", "sl": "Rotacijska os B"}


def said(language: str, label: str, value: str) -> Protocol:
    return read_protocol(f"<h2>{AXIS[language]}</h2><table><tr><td>{label}</td><td>{value}</td></tr></table>")


@pytest.mark.parametrize(
    ("language", "key", "label"),
    [
        ("de", "backlash", "Gemittelte Lose, wenn Q423&gt;0"),
        ("en", "backlash", "Averaged backlash, if Q423&gt;0"),
        ("sl", "backlash", "Določena zračnost, če je Q423&gt;0"),
        ("de", "points", "Anzahl der Messpunkte"),
        ("en", "points", "Number of measuring points"),
        ("sl", "points", "Število merilnih točk"),
        ("de", "radius", "Radius des Messkreises"),
        ("en", "radius", "Radius of the measuring circle"),
        ("sl", "radius", "Polmer merilnega kroga"),
        ("de", "scatter_before", "Standardabweichung (Streuung)"),
        ("de", "scatter_before", "Standardabweichung vor Optimierung"),
        ("de", "scatter_after", "Standardabweichung nach der Kompensation"),
        ("en", "scatter_before", "Standard deviation, measured"),
        ("en", "scatter_before", "Scatter before optimization"),
        ("en", "scatter_after", "Optimized standard deviation"),
        ("sl", "scatter_before", "Izmerjeno standardno odstopanje osi B"),
        ("sl", "scatter_after", "Optimirano standardno odstopanje B-osi"),
        ("de", "greatest", "Größter Fehler"),
        ("en", "greatest", "Max. error"),
        ("sl", "greatest", "Največja napaka"),
        ("de", "angle_error", "Winkelabweichung"),
        ("en", "angle_error", "Angular error"),
        ("sl", "angle_error", "Kotna napaka"),
        ("de", "mean_error", "Gemittelte Positionierabweichung"),
        ("en", "mean_error", "Averaged positioning error"),
        ("sl", "mean_error", "Povprečna napaka pozicioniranja"),
        ("de", "start_angle", "Start-Winkel"),
        ("en", "end_angle", "Stop angle"),
        ("sl", "incidence", "Naklonski kot"),
    ],
)
def test_a_number_of_an_axis(language: str, key: str, label: str) -> None:
    made = said(language, label, "0,0125")
    assert made.axes["B"].numbers == {key: 0.0125}
    assert made.unread == []


@pytest.mark.parametrize(
    ("language", "key", "label"),
    [
        ("de", "correction", "Korrekturbeträge in allen Achsen (Preset-Verschiebung)"),
        ("en", "correction", "Compensation values in all axes (preset shift)"),
        ("en", "correction", "Correction amounts in all axes"),
        ("sl", "correction", "Prenosi popravkov po vseh oseh (zamik referenčnih točk)"),
        ("de", "before", "Position der überprüften Drehachsen vor der Preset-Kompensation (bezogen auf die Spindelnase)"),
        ("en", "after", "Position of the tested rotary axes after preset compensation (relative to the spindle nose)"),
        ("sl", "before", "Položaj preverjenih rotacijskih osi pred izravnavo prednastavitev (nanaša se na vreteno)"),
        ("sl", "after", "Položaj preverjenih rotacijskih osi po izravnavi prednastavitev (nanaša se na vreteno)"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("value", ["X 0,0123 Y -0,0081 Z 0", "X=0.0123; Y=−0.0081; Z=0", "+0.0123 -0.0081 0.0000"])
def test_a_vector_of_an_axis(language: str, key: str, label: str, value: str) -> None:
    assert said(language, label, value).axes["B"].vectors == {key: (0.0123, -0.0081, 0.0)}


@pytest.mark.parametrize(
    ("label", "key"),
    [
        ("Datum und Uhrzeit der Erstellung", "created"),
        ("Creation date and time of the log", "created"),
        ("Datum in čas, ko je bila datoteka ustvarjena", "created"),
        ("Pfad des NC-Programms, aus dem der Zyklus abgearbeitet wurde", "program"),
        ("Path of the NC program from which the cycle was run", "program"),
        ("Pot NC-programa, iz katerega se je izvajal cikel", "program"),
        ("Durchgeführter Modus", "mode"),
        ("Mode used", "mode"),
    ],
)
def test_the_head(label: str, key: str) -> None:
    made = read_protocol(f"<table><tr><td>{label}</td><td>22.11.2026 10:15</td></tr></table>")
    assert made.head == {key: "22.11.2026 10:15"}


def test_date_and_time_apart() -> None:
    assert read_protocol("Date: 22.11.2026\nTime: 10:15:32").head["created"] == "22.11.2026 10:15:32"
    made = read_protocol("<table><tr><td>Datum<td>22.11.2026<td>Uhrzeit<td>10:15</table>")
    assert made.head["created"] == "22.11.2026 10:15"


@pytest.mark.parametrize(
    "heading",
    [
        "Achse: C",
        "C-Achse",
        "Rotationsachse C",
        "C-Rundachse",
        "Vermessene Drehachse: C",
        "Drehtisch C",
        "Rotary axis: C",
        "Axis of rotation: C",
        "Rotary table C",
        "Os C",
        "Axis C:",
        "Rotacijska os: C",
        "Vrtilna os C",
        "C",
    ],
)
def test_headings_of_an_axis(heading: str) -> None:
    made = read_protocol(f"<title>TCHPRAUTO</title><p>{heading}</p><p>Backlash: 0.002</p>")
    assert (made.axes["C"].numbers, made.unread) == ({"backlash": 0.002}, [])


def test_axes_side_by_side() -> None:
    made = read_protocol(
        "<table><tr><th></th><th>A</th><th>C</th></tr><tr><td>Startwinkel</td><td>-30</td><td>-90</td></tr>"
        "<tr><td>Lose</td><td>0,0011</td><td>0,0021 °</td></tr></table>"
    )
    assert made.axes["A"].numbers == {"start_angle": -30.0, "backlash": 0.0011}
    assert made.axes["C"].numbers == {"start_angle": -90.0, "backlash": 0.0021}


def test_before_and_after_in_one_row_and_a_row_for_each_direction() -> None:
    made = read_protocol(
        "<h2>C axis</h2><table><tr><td>Standard deviation<td>0.0134<td>0.0021<tr><td>Correction X<td>0.0123"
        "<tr><td>Correction Y<td>-0.0081</table><p>EX0C = 0.0123 EY0C = -0.0081 mm EA0C 0.0021°</p>"
    )
    axis = made.axes["C"]
    assert axis.numbers == {"scatter_before": 0.0134, "scatter_after": 0.0021}
    assert axis.vectors == {"correction": (0.0123, -0.0081, 0.0)}
    assert axis.errors == {"EX0C": 0.0123, "EY0C": -0.0081, "EA0C": 0.0021}
    assert made.unread == []


@pytest.mark.parametrize(
    "line",
    [
        "Bediener der Nachtschicht: Huber 3",
        "Winkelbereich Lose-Kompensation Q432: 0.5",
        "Werkzeugwechsel nach 12 Teilen: ja",
        "Backlash: 0.5",
        "Temperature of the spindle: 31.2",
    ],
)
def test_what_is_something_else_is_reported(line: str) -> None:
    """The backlash too, where it stands there twice with another value."""
    made = read_protocol(f"<h2>C axis</h2><p>Backlash: 0.002</p><p>{line}</p>")
    assert made.axes["C"].numbers == {"backlash": 0.002}
    assert [each.text for each in made.unread] == [line]
