"""Names of columns that people give them, by the field that they mean: in English, German, Serbian, Slovene and Russian."""

# Folded: lower case, no accents, no unit. The first of a line is the field's own name.
NAMES: dict[str, tuple[str, ...]] = {
    "measured": (
        "measured", "measured value", "measurement", "value", "actual", "actual value", "size", "diameter",
        "messwert", "wert", "istwert", "ist", "istmass", "mass", "gemessen", "durchmesser",
        "izmereno", "izmerena vrednost", "vrednost", "mera", "izmerjeno", "izmerjena vrednost", "meritev", "mere",
        "precnik", "premer", "пречник", "диаметр",
        "измерено", "измерена вредност", "вредност", "мера", "значение", "измеренное значение", "размер", "результат",
    ),
    "measured_at": (
        "measured at", "time", "timestamp", "date time", "datetime", "date", "date and time", "measured on",
        "zeit", "zeitpunkt", "zeitstempel", "messzeit", "messzeitpunkt", "datum", "datum uhrzeit", "datum zeit",
        "vreme", "vreme merenja", "datum i vreme", "cas", "cas meritve", "datum in cas",
        "време", "време мерења", "датум", "датум и време", "время", "время измерения", "дата", "дата и время",
    ),
    "machined_at": (
        "machined at", "cut at", "bearbeitet", "gefertigt", "gefertigt am", "obradeno", "vreme obrade", "izdelano",
        "cas izdelave", "обрађено", "време обраде", "обработано", "время обработки",
    ),
    "part": (
        "part", "part number", "part id", "partnb", "serial", "serial number", "sn", "teil", "teilenummer", "teile nr", "seriennummer",
        "werkstuck", "deo", "komad", "serijski broj", "kos", "obdelovanec", "serijska stevilka",
        "део", "комад", "серијски број", "деталь", "номер детали", "серийный номер",
    ),
    "characteristic": (
        "characteristic", "characteristic name", "feature", "feature name", "merkmal", "merkmalsname", "karakteristika",
        "znacilnost", "карактеристика", "характеристика",
    ),
    "key": ("key", "schlussel", "kljuc", "ключ", "кључ"),
    "correction_in_effect": ("correction in effect",),
    "touches": ("touches",),
    "context": ("context",),
}  # fmt: skip
