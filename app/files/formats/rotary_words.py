"""Names that a control's protocol of the rotary axes uses, folded (no case, no accents): de, en, sl."""

HEAD_KEYS = ("created", "program", "tool", "kinematics", "mode")
AXIS_KEYS = (
    "start_angle",
    "end_angle",
    "incidence",
    "points",
    "radius",
    "backlash",
    "scatter_before",
    "scatter_after",
    "greatest",
    "angle_error",
    "mean_error",
)
OPTIMISED = ("optimi", "kompensiert", "compensated", "kompenzirano")  # after the correction
WORTHLESS = frozenset(
    [
        "messprotokoll",
        "tchprauto",
        "rotary",
        "vrtilna",
        "rotacijska",
        "merjena",
        "measured",
        "vermessene",
        "gemessene",
        "protokoll",
        "measuring",
        "log",
        "protocol",
        "merilni",
        "protokol",
        "protokol",
        "meritve",
        "kinematik",
        "kinematics",
        "kinematika",
        "ergebnisse",
        "results",
        "rezultati",
        "tastsystem",
        "touch",
        "probe",
        "tipalni",
        "sistem",
    ]
) | {
    "measuring log",
    "merilni protokol",
    "protokol meritve",
    "touch probe cycle 452",
    "tastsystemzyklus 452",
    "cikel 452",
}

LABELS: tuple[tuple[str, frozenset[str]], ...] = (
    (
        "created",
        frozenset(
            {
                "datum und uhrzeit",
                "datum",
                "erstellt",
                "erstellt am",
                "date and time",
                "date",
                "created",
                "datum in cas",
                "ustvarjeno",
            }
        ),
    ),
    (
        "program",
        frozenset(
            {
                "nc programm",
                "programm",
                "pfad des nc programms",
                "nc program",
                "program",
                "path of the nc program",
                "nc programm pfad",
                "pot nc programa",
            }
        ),
    ),
    ("tool", frozenset({"werkzeug", "werkzeugname", "tool", "tool name", "ime orodja", "orodje"})),
    (
        "kinematics",
        frozenset(
            {"aktive kinematik", "kinematik", "active kinematics", "kinematics", "aktivna kinematika", "kinematika"}
        ),
    ),
    (
        "mode",
        frozenset(
            {
                "modus",
                "ausgefuhrter modus",
                "durchgefuhrter modus",
                "mode",
                "executed mode",
                "mode executed",
                "izveden nacin",
                "nacin",
            }
        ),
    ),
    (
        "ball_radius",
        frozenset(
            {
                "kalibrierkugelradius",
                "radius kalibrierkugel",
                "radius der kalibrierkugel",
                "q407",
                "calibration sphere radius",
                "radius of the calibration sphere",
                "sphere radius",
                "ball radius",
                "polmer umeritvene krogle",
                "polmer krogle",
            }
        ),
    ),
    ("start_angle", frozenset({"startwinkel", "start angle", "starting angle", "zacetni kot", "startni kot"})),
    ("end_angle", frozenset({"endwinkel", "end angle", "stop angle", "koncni kot"})),
    (
        "incidence",
        frozenset(
            {
                "anstellwinkel",
                "incidence angle",
                "inclination angle",
                "angle of incidence",
                "nastavitveni kot",
                "naravnalni kot",
            }
        ),
    ),
    (
        "points",
        frozenset(
            {
                "anzahl messpunkte",
                "anzahl der messpunkte",
                "messpunkte",
                "number of measuring points",
                "number of points",
                "measuring points",
                "stevilo merilnih tock",
                "st merilnih tock",
            }
        ),
    ),
    (
        "radius",
        frozenset(
            {
                "messkreisradius",
                "radius des messkreises",
                "measuring circle radius",
                "measuring radius",
                "radius of the measuring circle",
                "polmer merilnega kroga",
            }
        ),
    ),
    (
        "backlash",
        frozenset(
            {
                "lose",
                "umkehrspiel",
                "ermittelte lose",
                "backlash",
                "measured backlash",
                "averaged backlash",
                "zracnost",
                "dolocena zracnost",
            }
        ),
    ),
    (
        "angles",
        frozenset(
            {
                "achspositionen",
                "positionen der achse",
                "positionen",
                "axis positions",
                "positions",
                "position of the axis",
                "polozaji osi",
                "polozaji",
            }
        ),
    ),
    (
        "scatter_before",
        frozenset(
            {"standardabweichung", "streuung", "standard deviation", "scatter", "standardno odstopanje", "razprsenost"}
        ),
    ),
    (
        "greatest",
        frozenset(
            {
                "maximale abweichung",
                "max abweichung",
                "grosste abweichung",
                "maximum deviation",
                "max deviation",
                "maximum error",
                "najv odstopanje",
                "najvecje odstopanje",
            }
        ),
    ),
    ("angle_error", frozenset({"winkelfehler", "angle error", "angular error", "napaka kota", "kotna napaka"})),
    (
        "correction",
        frozenset(
            {
                "korrekturbetrage",
                "korrekturbetrage in allen achsen",
                "presetverschiebung",
                "preset verschiebung",
                "correction values",
                "correction values in all axes",
                "compensation values",
                "compensation values in all axes",
                "preset shift",
                "prenosi popravkov",
                "prenosi popravkov po vseh oseh",
                "popravki",
                "zamik referencnih tock",
            }
        ),
    ),
    (
        "before",
        frozenset(
            {
                "position vor",
                "achsposition vor",
                "position der uberpruften drehachsen vor",
                "position vor der presetkompensation",
                "position vor optimierung",
                "position before",
                "axis position before",
                "position of the measured rotary axes before",
                "position before preset compensation",
                "position before optimization",
                "polozaj pred",
                "polozaj osi pred",
                "polozaj preverjenih rotacijskih osi pred",
            }
        ),
    ),
    (
        "after",
        frozenset(
            {
                "position nach",
                "achsposition nach",
                "position der uberpruften drehachsen nach",
                "position nach der presetkompensation",
                "position nach optimierung",
                "position after",
                "axis position after",
                "position of the measured rotary axes after",
                "position after preset compensation",
                "position after optimization",
                "polozaj po",
                "polozaj osi po",
                "polozaj preverjenih rotacijskih osi po",
            }
        ),
    ),
    (
        "mean_error",
        frozenset(
            {
                "gemittelter positionierfehler",
                "mittlerer positionierfehler",
                "positionierfehler",
                "mean positioning error",
                "averaged positioning error",
                "average positioning error",
                "positioning error",
                "povprecna pozicionirna napaka",
                "pozicionirna napaka",
            }
        ),
    ),
)
"""The key and its labels. A label may go on in the protocol: `Position vor der Optimierung`."""
