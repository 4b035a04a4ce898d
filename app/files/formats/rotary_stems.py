"""Meaning of a label of the protocol that is none of the known ones: by the words it is made of, de, en, sl.

Controls and versions say the same with other endings and more words ("Gemittelte Lose, wenn Q423>0"). Each rule is a
list of beginnings of words that all have to be there; `=` before one: the whole word. The first rule that fits counts.
"""

RULES: tuple[tuple[str, tuple[str, ...]], ...] = (
    ("created", ("erstell datum", "datum uhrzeit", "datum zeit", "creation date", "date time", "datum cas")),
    ("time", ("=uhrzeit", "=time", "=cas", "=ura")),
    ("program", ("nc programm", "nc program", "pfad programm", "path program", "pot programa")),
    ("ball_radius", ("kalibrierkugel radius", "kugel radius", "radius sphere", "radius ball", "polmer krogl")),
    ("radius", ("messkreis", "radius circle", "measuring radius", "polmer krog")),
    ("scatter", ("standardabw", "streuung", "standard dev", "scatter", "standardno odst", "razprsen")),
    (
        "mean_error",
        (
            "positionierfehler",
            "positionierabw",
            "positioning err",
            "positioning dev",
            "pozicionirn napak",
            "gemittelt abw",
            "gemittelt fehler",
            "mittler abw",
            "mittler fehler",
            "durchschnittlich abw",
            "mean err",
            "mean dev",
            "average err",
            "average dev",
            "povprecn napak",
            "povprecn odst",
        ),
    ),
    ("angle_error", ("winkelfehler", "winkelabw", "angle err", "angular err", "napak kot", "kotn napak")),
    (
        "greatest",
        (
            "max abw",
            "max fehler",
            "maximalfehler",
            "grosst abw",
            "grosst fehler",
            "max err",
            "max dev",
            "greatest err",
            "greatest dev",
            "largest err",
            "largest dev",
            "najv odst",
            "najv napak",
        ),
    ),
    (
        "before",
        ("position =vor", "achsposition =vor", "lage =vor", "position before", "lega pred", "polozaj pred"),
    ),
    ("after", ("position =nach", "achsposition =nach", "lage =nach", "position after", "lega =po", "polozaj =po")),
    (
        "correction",
        (
            "korrektur",
            "correction",
            "compensation val",
            "compensation amount",
            "popravk",
            "preset versch",
            "preset shift",
            "presetversch",
            "datum shift",
            "zamik tock",
        ),
    ),
    ("backlash", ("=lose", "umkehrspiel", "backlash", "zracnost")),
    ("start_angle", ("startwinkel", "start winkel", "start angle", "zacetni kot", "startni kot")),
    ("end_angle", ("endwinkel", "end winkel", "end angle", "stop angle", "koncni kot")),
    (
        "incidence",
        ("anstellwinkel", "incidence", "inclination", "nastavitven kot", "naravnaln kot", "naklonsk kot"),
    ),
    ("points", ("anzahl messp", "anzahl punkt", "number point", "stevil tock", "=st tock", "messpunkte")),
    ("angles", ("achsposition", "positionen", "messposition", "positions", "polozaji", "merilni polozaj")),
    ("kinematics", ("aktiv kinematik", "active kinematic", "aktivn kinematik")),
    ("mode", ("modus", "=mode", "nacin")),
    ("tool", ("=werkzeug", "=werkzeugname", "tool name", "ime orodj", "=orodje")),
)
SETTINGS = ("q432", "winkelbereich", "angle range", "kompenz")  # what was set for the cycle, not what it found
EARLIER = ("=vor", "=before", "=pred")


def fits(words: str, rule: str) -> bool:
    """Tell if all beginnings are in a folded label.

    >>> fits("gemittelte lose wenn q423>0", "=lose"), fits("polozaj osi pred", "polozaj =po")
    (True, False)
    """
    tokens = words.replace(",", " ").replace(":", " ").replace("/", " ").split()
    return all(
        any(token == stem[1:] if stem.startswith("=") else token.startswith(stem) for token in tokens)
        for stem in rule.split()
    )


def meaning(words: str) -> str | None:
    """The key of a folded label, or None. `scatter` says nothing of before or after.

    >>> meaning("maximaler fehler"), meaning("bediener der nachtschicht")
    ('greatest', None)
    """
    for key, rules in RULES:
        if any(fits(words, rule) for rule in rules):
            return None if key == "backlash" and any(setting in words for setting in SETTINGS) else key
    return None
