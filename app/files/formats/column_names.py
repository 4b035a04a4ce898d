"""Names of columns that people give them, by the field that they mean: in English, German, Serbian, Slovene and Russian."""

UPPER_LIMITS = (
    "upper limit", "usl", "upper spec", "upper specification limit", "max size", "obere grenze", "oberer grenzwert", "ogw",
    "gornja granica", "zgornja meja", "верхний предел",
)  # fmt: skip
LOWER_LIMITS = (
    "lower limit", "lsl", "lower spec", "lower specification limit", "min size", "untere grenze", "unterer grenzwert", "ugw",
    "donja granica", "spodnja meja", "нижний предел",
)  # fmt: skip
"""Names of columns that hold a limit as a size; *upper* and *lower* by any other name are deviations from the nominal size."""

SUMMARIES = frozenset({
    "nominal", "nominal value", "nominal size", "target", "soll", "sollwert", "sollmass", "nennmass", "nazivna mera",
    "номинал", "usl", "lsl", "ucl", "lcl", "ogw", "ugw", "oeg", "ueg", "upper limit", "lower limit", "upper spec",
    "lower spec", "obere grenze", "untere grenze", "gornja granica", "donja granica", "zgornja meja", "spodnja meja",
    "tol", "+tol", "tolerance", "upper tol", "lower tol", "upper tolerance", "lower tolerance", "upper deviation",
    "lower deviation", "toleranz", "obere toleranz", "untere toleranz", "oberes abmass", "unteres abmass", "mean",
    "average", "avg", "xbar", "x bar", "mittelwert", "mittel", "prosek", "srednja vrednost", "povprecje", "среднее",
    "median", "min", "max", "minimum", "maximum", "мин", "макс", "range", "spannweite", "raspon", "размах", "std",
    "stdev", "std dev", "std deviation", "sigma", "s", "sd", "standard deviation", "standardabweichung",
    "standardna devijacija", "standardni odklon", "cp", "cpk", "pp", "ppk", "cm", "cmk", "count", "anzahl", "n", "sum",
    "summe", "total", "gesamt", "suma", "vsota", "итого", "сумма", "ukupno", "skupaj",
    "stddev", "std abw", "stdabw", "standardabw", "standard dev", "st dev", "streuung", "varianz", "variance", "mittelw", "mw", "durchschnitt",
    "mean value", "average value", "max value", "min value", "maximum value", "minimum value", "maxwert", "minwert", "kleinstwert",
    "grosstwert", "grosster wert", "kleinster wert", "toleranzmitte", "x quer", "6s", "6σ", "σ", "otg", "utg", "moyenne", "ecart type", "etendue",
    "cote nominale", "media", "dev std", "promedio", "prosecna vrednost", "broj merenja", "total parts",
    "srednia", "wartosc srednia", "odchylenie standardowe", "odch std", "rozstep", "mediana", "wartosc nominalna", "gorna granica",
    "dolna granica", "prumer", "prumerna hodnota", "stredni hodnota", "aritmeticky prumer", "smerodatna odchylka", "rozpeti", "pocet",
    "soucet", "jmenovita hodnota", "horni mez", "dolni mez", "priemer", "smerodajna odchylka", "atlag", "szoras", "terjedelem",
    "srednja vrijednost", "deviazione standard", "desviacion estandar", "desvio padrao", "gemiddelde", "standaardafwijking",
    "medelvarde", "standardavvikelse", "middelvaerdi", "gennemsnit", "ortalama", "medie", "keskiarvo",
})  # fmt: skip
"""First cells of rows that hold limits or statistics, and no part. Folded."""

TEMPERATURES = ("part_temperature", "machine_temperature")
"""Columns that are circumstances of a reading, °C."""
# Folded: lower case, no accents, no unit. The first of a line is the field's own name.
NAMES: dict[str, tuple[str, ...]] = {
    "measured": (
        "measured", "measured value", "measurement", "meas", "value", "actual", "actual value", "size", "diameter",
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
    "unit": (
        "unit", "units", "uom", "einheit", "masseinheit", "jedinica", "merna jedinica", "enota", "merska enota",
        "единица", "единица измерения", "ед изм", "јединица",
    ),
    "nominal": (
        "nominal", "nominal value", "nominal size", "nom", "design value", "soll", "sollwert", "sollmass", "nennmass", "nominalna vrednost", "nazivna mera",
        "номинал", "номинальное значение",
    ),
    "upper": (
        "uppertol", "upper tol", "up tol", "uptol", "upper limit tol", "ob tol", "obere tol", "upper tolerance", "upper deviation", "+tol", "plus tol", "oberes abmass", "obere toleranz",
        "gornje odstupanje", "zgornje odstopanje", "верхнее отклонение", *UPPER_LIMITS,
    ),
    "lower": (
        "lowertol", "lower tol", "low tol", "lowtol", "lower limit tol", "un tol", "unt tol", "untere tol", "lower tolerance", "lower deviation", "unteres abmass", "untere toleranz",
        "donje odstupanje", "spodnje odstopanje", "нижнее отклонение", *LOWER_LIMITS,
    ),
    "natural_limit": (
        "natural limit", "naturliche grenze", "prirodna granica", "naravna meja", "природна граница", "естественная граница",
    ),
    "key": ("key", "schlussel", "kljuc", "ключ", "кључ"),
    "correction_in_effect": ("correction in effect",),
    "touches": ("touches",),
    "context": ("context",),
    "part_temperature": (
        "part temperature", "part temp", "workpiece temperature", "teiltemperatur", "werkstucktemperatur",
        "temperatura dela", "temperatura obratka", "temperatura obdelovanca", "температура детали",
    ),
    "machine_temperature": (
        "machine temperature", "machine temp", "maschinentemperatur", "temperatura masine", "temperatura stroja",
        "температура станка",
    ),
}  # fmt: skip
