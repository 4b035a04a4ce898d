"""Names of columns that people give them, by the field that they mean: in English, German, Serbian, Slovene and Russian.

What was measured, when, and which part, also in languages in which measuring machines are set: French, Italian, Spanish,
Portuguese, Polish, Czech, Hungarian, Dutch, Swedish, Turkish, Romanian, Croatian, Japanese, Chinese, Korean.
"""

import re

from app.files.formats.cell_values import LONGEST_NAME, folded

UPPER_LIMITS = (
    "upper limit", "usl", "upper spec", "upper specification limit", "max size", "obere grenze", "oberer grenzwert", "ogw",
    "gornja granica", "zgornja meja", "верхний предел", "limite supérieure", "limite superiore", "límite superior", "górna granica",
    "horní mez", "felső határ", "felső tűréshatár",
)  # fmt: skip
LOWER_LIMITS = (
    "lower limit", "lsl", "lower spec", "lower specification limit", "min size", "untere grenze", "unterer grenzwert", "ugw",
    "donja granica", "spodnja meja", "нижний предел", "limite inférieure", "limite inferiore", "límite inferior", "dolna granica",
    "dolní mez", "alsó határ", "alsó tűréshatár",
)  # fmt: skip
"""Names of columns that hold a limit as a size; *upper* and *lower* by any other name are deviations from the nominal size."""
UPPER_OF_EITHER = ("upper", "up", "oben", "ober", "obere", "gornja", "zgornja", "верх", "верхний")
LOWER_OF_EITHER = ("lower", "low", "unten", "unter", "untere", "donja", "spodnja", "низ", "нижний")
"""Names of columns of limits that do not say whether they are sizes or deviations: their numbers do, beside the nominal size."""

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
        "measured", "measured value", "measurement", "measurement value", "meas", "meas value", "value", "actual", "actual value",
        "measured size", "actual size", "actual dimension", "size", "diameter",
        "messwert", "wert", "istwert", "ist", "istmass", "mass", "gemessen", "gemessener wert", "messergebnis", "durchmesser",
        "izmereno", "izmerena vrednost", "vrednost", "mera", "izmerjeno", "izmerjena vrednost", "meritev", "mere",
        "precnik", "premer", "пречник", "диаметр",
        "измерено", "измерена вредност", "вредност", "мера", "значение", "измеренное значение", "размер", "результат",
        "mesure", "valeur mesurée", "mesuré", "cote mesurée", "valeur réelle", "cote réelle", "valeur",
        "valore misurato", "misurato", "misura", "valore effettivo", "valore",
        "valor medido", "medido", "medida", "medición", "valor real", "medição", "valor",
        "zmierzono", "wartość zmierzona", "zmierzona wartość", "wartość rzeczywista", "pomiar", "wartość",
        "naměřeno", "naměřená hodnota", "skutečná hodnota", "hodnota", "mért érték", "mért", "érték",
        "meetwaarde", "gemeten", "gemeten waarde", "waarde", "mätvärde", "uppmätt", "ölçülen", "ölçülen değer", "ölçüm", "değer",
        "valoare măsurată", "măsurat", "valoare", "izmjereno", "izmjerena vrijednost", "vrijednost", "mjera",
        "測定値", "実測値", "测量值", "实测值", "測量值", "實測值", "측정값", "측정치",
    ),
    "measured_at": (
        "measured at", "timestamp", "date time", "date and time", "time and date", "time date", "measured on", "measurement time",
        "measuring time", "measurement date", "measuring date", "time", "date",
        "zeitstempel", "messzeit", "messzeitpunkt", "messdatum", "gemessen am", "datum uhrzeit", "datum und uhrzeit", "datum zeit",
        "datum und zeit", "zeitpunkt", "zeit", "datum",
        "vreme merenja", "datum i vreme", "datum vreme", "vreme", "cas meritve", "datum in cas", "datum cas", "cas",
        "време мерења", "датум и време", "датум време", "време", "датум",
        "время измерения", "дата измерения", "дата и время", "дата время", "время", "дата",
        "date de mesure", "heure de mesure", "date et heure", "date heure", "horodatage",
        "data e ora", "data ora", "data di misura", "data misura", "fecha y hora", "fecha hora", "fecha de medición",
        "fecha", "data e hora", "data hora", "data da medição", "data",
        "data i godzina", "data godzina", "data pomiaru", "czas pomiaru", "czas", "datum a čas", "datum měření", "čas měření",
        "dátum idő", "mérés ideje", "mérés dátuma", "dátum", "idő", "datum en tijd", "datum tijd", "meetdatum", "tijdstip", "tijd",
        "datum och tid", "datum tid", "tid", "tarih saat", "ölçüm tarihi", "tarih", "data și ora", "datum i vrijeme", "vrijeme mjerenja",
        "vrijeme", "測定日時", "日時", "測定日", "測定時刻", "时间", "日期", "日期时间", "测量时间", "時間", "日期時間", "측정일시", "측정시간", "일시",
    ),
    "machined_at": (
        "machined at", "cut at", "bearbeitet", "gefertigt", "gefertigt am", "obradeno", "vreme obrade", "izdelano",
        "cas izdelave", "обрађено", "време обраде", "обработано", "время обработки",
    ),
    "part": (
        "part", "part number", "part no", "part nr", "part id", "partnb", "serial", "serial number", "serial no", "sn", "teil", "teilenummer", "teile nr",
        "teil nr", "seriennummer", "serien nr",
        "werkstuck", "deo", "komad", "serijski broj", "kos", "obdelovanec", "serijska stevilka",
        "део", "комад", "серијски број", "деталь", "номер детали", "серийный номер",
        "pièce", "numéro de série", "no de série", "n° de série", "pezzo", "numero di serie", "pieza", "número de serie", "peça", "número de série",
        "część", "numer seryjny", "díl", "výrobní číslo", "alkatrész", "sorozatszám", "onderdeel", "serienummer", "parça", "seri no", "serijski broj",
        "部品番号", "ワーク番号", "シリアル番号", "零件号", "工件号", "序列号",
    ),
    "characteristic": (
        "characteristic", "characteristic name", "characteristic id", "characteristic no", "characteristic number", "feature", "feature name",
        "merkmal", "merkmalsname", "merkmal nr", "merkmalnr", "merkmalsnummer", "merkmalbezeichnung", "merkmalsbezeichnung", "prüfmerkmal",
        "messmerkmal", "karakteristika", "znacilnost", "карактеристика", "характеристика",
        "caractéristique", "caratteristica", "característica", "cecha", "charakterystyka", "charakteristika", "znak", "jellemző", "kenmerk",
        "egenskap", "özellik", "karakteristik", "caracteristică", "značajka", "特性", "測定項目", "특성",
    ),
    "unit": (
        "unit", "units", "uom", "einheit", "masseinheit", "jedinica", "merna jedinica", "enota", "merska enota",
        "единица", "единица измерения", "ед изм", "јединица",
    ),
    "nominal": (
        "nominal", "nominal value", "nominal size", "nom", "design value", "soll", "sollwert", "sollmass", "nennmass", "nominalna vrednost", "nazivna mera",
        "номинал", "номинальное значение", "nominale", "cote nominale", "valeur nominale", "valore nominale", "quota nominale",
        "valor nominal", "wartość nominalna", "wymiar nominalny", "jmenovitá hodnota", "jmenovitý rozměr", "névleges", "névleges érték",
        "névleges méret",
    ),
    "upper": (
        "uppertol", "upper tol", "up tol", "uptol", "upper limit tol", "ob tol", "obere tol", "upper tolerance", "upper deviation", "+tol", "plus tol", "oberes abmass", "obere toleranz",
        "gornje odstupanje", "zgornje odstopanje", "верхнее отклонение", "tol sup", "tolérance supérieure", "écart supérieur",
        "tolleranza superiore", "tolerancia superior", "tolerância superior", "horní tolerance", "horní úchylka", "felső tűrés",
        "górna odchyłka", *UPPER_LIMITS, *UPPER_OF_EITHER,
    ),
    "lower": (
        "lowertol", "lower tol", "low tol", "lowtol", "lower limit tol", "un tol", "unt tol", "untere tol", "lower tolerance", "lower deviation", "unteres abmass", "untere toleranz",
        "donje odstupanje", "spodnje odstopanje", "нижнее отклонение", "tol inf", "tolérance inférieure", "écart inférieur",
        "tolleranza inferiore", "tolerancia inferior", "tolerância inferior", "dolní tolerance", "dolní úchylka", "alsó tűrés",
        "dolna odchyłka", *LOWER_LIMITS, *LOWER_OF_EITHER,
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


_BETWEEN = re.compile(r"(?<=\w)(?: *[/&] *|\+)(?=\w)")


def key_of(heading: str) -> str:
    """A name of a column for comparing: as `folded`, without blanks and without signs between and behind its words.

    >>> key_of("Date/Time"), key_of("Datum & Uhrzeit [UTC]"), key_of("MeasuredValue:"), key_of("+Tol")
    ('datetime', 'datumuhrzeit', 'measuredvalue', '+tol')
    """
    return folded(_BETWEEN.sub(" ", heading[:LONGEST_NAME]).rstrip(" :=")).replace(" ", "")
