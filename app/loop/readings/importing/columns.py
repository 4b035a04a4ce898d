"""Fields of a table by the names of its columns, in five languages, or as a person maps them."""

from collections.abc import Mapping, Sequence

from app.errors import FieldError, Invalid
from app.files.formats.column_names import NAMES, key_of
from app.files.formats.units import LENGTHS, UnknownUnit, in_another_scale, unit_in
from app.language.i18n import _
from app.loop.readings.importing.refusals import wrong
from app.loop.readings.origin import COLUMNS

ORIGIN = COLUMNS[:2]
"""Fields that are no choice of a person: they are there in what Inband wrote."""
VERDICT = ("code", "excluded")
"""Columns of the same, by which a reading that counted for nothing there does not count here."""
DRAWN = ("nominal", "upper", "lower", "natural_limit")
"""Fields of a characteristic, not of its readings: they set it up where it is missing."""
_WORDS = {name: [key_of(word) for word in words] for name, words in NAMES.items()}
DATES = frozenset(map(key_of, (
    "date", "datum", "дата", "датум", "data", "fecha", "dátum", "tarih", "日付", "日期", "날짜", "measured on", "messdatum",
)))  # fmt: skip
FEATURES = frozenset(map(key_of, ("feature", "feature name", "element", "element name", "geometrieelement")))
NAMED = ("id", *map(key_of, (
    "name", "dimension", "dimension name", "dim", "size", "maß", "mera", "mere", "mjera", "мера", "размер", "balloon", "balloon no", "balloon number", "item", "label", "parameter",
    "bezeichnung", "benennung", "messgröße", "messstelle", "naziv", "oznaka", "ime", "назив", "ознака", "наименование",
    "название", "обозначение", "désignation", "dénomination", "libellé", "cote", "denominazione", "nome", "quota", "denominación",
    "nombre", "cota", "denominação", "nazwa", "wymiar", "název", "označení", "rozměr", "megnevezés", "név", "méret", "benaming", "naam",
    "benämning", "namn", "mått", "ad", "isim", "ölçü", "denumire", "nume", "cotă", "名称", "項目", "测量项目", "项目", "이름", "항목",
)))  # fmt: skip
"""Columns that name a characteristic beside its nominal size or limits; all but the first, a number of a row, without them too."""
_OF_FRENCH = frozenset(
    map(key_of, ("mesure", "mesuré", "valeur", "valeur mesurée", "cote mesurée", "valeur réelle", "cote réelle"))
)
"""Beside one of these a column *Nom* is that of names, not of nominal sizes."""
AXES = frozenset({"axis", "ax", "achse", "osa", "os", "оса", "ось"})
TIMES = frozenset(map(key_of, (
    "time", "zeit", "uhrzeit", "uhr", "vreme", "cas", "време", "время", "vrijeme", "heure", "ora", "hora", "godzina", "czas", "idő", "időpont",
    "tijd", "tid", "saat", "時刻", "時間", "时间", "시간", "messzeit", "time of day", "clock",
)))  # fmt: skip
_TOLERANCES = frozenset(map(key_of, (
    "tol", "tolerance", "toleranz", "tolerancija", "toleranca", "допуск", "толеранција", "tolérance", "tolleranza", "tolerancia",
    "tolerância", "tolerancja", "tolerantie", "tolerans", "公差", "공차",
)))  # fmt: skip
"""Columns that are both deviations where their cells say so: ±0.05."""


def columns_of(header: tuple[str, ...], mapping: Mapping[str, str]) -> dict[str, tuple[int, ...]]:
    """The places of each field: as a person maps it, else by the name of a column. Raises `Invalid`."""
    problems: list[FieldError] = []
    columns: dict[str, tuple[int, ...]] = {}
    for name, column in mapping.items():
        if name not in NAMES:
            message = _("There is no field {name}; there are {names}.").format(name=repr(name), names=", ".join(NAMES))
            problems.append(FieldError("map", message))
        elif column:  # an empty one says: not in this file
            places = _places(header, column)
            if places is None:
                message = _("There is no column {column}; the file has: {header}.")
                message = message.format(column=repr(column), header=", ".join(header))
                if len(header) == 1:
                    message += " " + _("Columns that are aligned by blanks are parted by --delimiter blanks.")
                problems.append(FieldError(f"map {name}", message))
            elif in_another_scale(header, name, places):
                message = _("The column {column} names another scale; temperatures are in °C.").format(
                    column=repr(column)
                )
                problems.append(FieldError(f"map {name}", message))
            else:
                columns[name] = places
    if problems:
        raise Invalid(problems[0].message, _("Nothing was imported."), errors=problems)
    used_places = {place for places in columns.values() for place in places}
    guesses = [guess for guess in guesses_of(header).items() if not in_another_scale(header, *guess)]
    columns |= {name: guess for name, guess in guesses if name not in mapping and not used_places & set(guess)}
    if "characteristic" in columns:
        return columns
    return {name: places for name, places in columns.items() if name not in DRAWN}


def by_places(header: tuple[str, ...], cells: Sequence[str], mapping: Mapping[str, str]) -> dict[str, tuple[int, ...]]:
    """The places of each field in a table without a heading: as numbers of columns, else by its first cells. Raises `Invalid`."""
    first = {cell: header[at] for at, cell in reversed([*enumerate(cells)])}

    def named(column: str) -> str:
        if not column or _place(header, column) is not None:
            return column
        if column in first or "+" not in column:
            return first.get(column, column)
        return "+".join(named(part.strip()) for part in column.split("+"))

    return columns_of(header, {name: named(column) for name, column in mapping.items()})


def fits(names: Sequence[str], mapping: Mapping[str, str]) -> bool:
    """Tell of names that have the columns which a person names, and one that is measured."""
    columns = [column for column in mapping.values() if column and not column.isdigit()]
    named = all(column in names or all(part.strip() in names for part in column.split("+")) for column in columns)
    return named and ("measured" in mapping or "measured" in guesses_of(tuple(names)))


def nominal_of(
    header: tuple[str, ...], columns: Mapping[str, tuple[int, ...]], mapping: Mapping[str, str]
) -> tuple[int, ...]:
    """The column of nominal sizes, also where they set nothing up; none where a person says so."""
    if "nominal" in columns or "nominal" in mapping or "measured" not in columns:
        return columns.get("nominal", ())
    guess = guesses_of(header).get("nominal", ())
    return () if set(guess) & {place for places in columns.values() for place in places} else guess


def column_unit(column: str, said: str | None) -> str | None:
    """The unit of a column's numbers: what a person said, else what its header names. Raises `Invalid`."""
    try:
        return said or unit_in(column)
    except UnknownUnit as error:
        raise wrong(
            "unit",
            _(
                "The header of the column {column} names the unit {unit}, which is not known as a length. "
                "Say in which unit its numbers are: {units}."
            ).format(column=column, unit=error.word, units=", ".join(LENGTHS)),
        ) from None


def _places(header: tuple[str, ...], column: str) -> tuple[int, ...] | None:
    """Return the place of a column: by its name or number, or two that belong together as Date+Time or 2+3."""
    place = _place(header, column)
    if place is not None:
        return (place,)
    places = [_place(header, part.strip()) for part in column.split("+")]
    named_places = tuple(place for place in places if place is not None)
    return named_places if len(named_places) == len(places) else None


def _place(header: tuple[str, ...], column: str) -> int | None:
    if column in header:
        return header.index(column)
    if column.isascii() and column.isdigit() and len(column) < 6 and 1 <= int(column) <= len(header):
        return int(column) - 1
    return None


def is_unsigned(column: str) -> bool:
    """Tell of a column of lower deviations without a sign, which its name has: -TOL."""
    return column.strip().lower().replace(" ", "") in {"-tol", "tol-", "-tolerance"}


def is_both_ways(text: str) -> bool:
    """Tell of one column, or one cell, for both deviations, the same up and down: ±TOL.

    >>> is_both_ways("±Tol"), is_both_ways("Tol. +/- [mm]"), is_both_ways("+TOL"), is_both_ways("Tol")
    (True, True, False, False)
    """
    return "±" in text or "+/-" in text or "+-" in text


def is_tolerance(column: str) -> bool:
    """Tell of a column that does not say which limit it gives.

    >>> is_tolerance("Tol. [mm]"), is_tolerance("-Tol"), is_tolerance("+Tol")
    (True, False, False)
    """
    return key_of(column) in _TOLERANCES and not is_unsigned(column)


def guesses_of(header: tuple[str, ...]) -> dict[str, tuple[int, ...]]:
    """The fields that the names of columns mean."""
    names = [key_of(name) for name in header]
    if _OF_FRENCH & set(names):
        names = ["name" if each == "nom" else each for each in names]
    guesses: dict[str, tuple[int, ...]] = {}
    for name, words in _WORDS.items():
        ranked = sorted((words.index(each), place) for place, each in enumerate(names) if each in words)
        if ranked:
            guesses[name] = (ranked[0][1],)
    date = next((place for place, each in enumerate(names) if each in DATES), None)
    time = next((place for place, each in enumerate(names) if each in TIMES), None)
    moments = tuple(place for place in (date, time) if place is not None)
    if (
        len(moments) > 1 or "measured_at" not in guesses
    ):  # also in languages whose words for both together are not known
        guesses |= {"measured_at": moments} if moments else {}
    unsigned = [at for at, name in enumerate(header) if is_unsigned(name)]
    if "lower" not in guesses and unsigned:
        guesses["lower"] = (unsigned[0],)
    both = [at for at, name in enumerate(header) if is_both_ways(name) or is_tolerance(name)]
    if both and not {"upper", "lower"} & guesses.keys():
        guesses |= {"upper": (both[0],), "lower": (both[0],)}
    features = [at for at, each in enumerate(names) if each in FEATURES]
    if features and guesses.get("characteristic", (-1,))[0] not in features:
        guesses["characteristic"] = tuple(
            sorted((*guesses.get("characteristic", ()), features[0]))
        )  # Circle 3, Diameter
    beside = next((at for at, each in enumerate(names) if each in AXES), None)
    if "characteristic" in guesses and beside is not None:
        guesses["characteristic"] += (beside,)  # a feature has several: X, Y, D
    elif "characteristic" not in guesses and "measured" in guesses:
        drawn = {"nominal", "upper", "lower"} & guesses.keys()
        naming = NAMED if drawn else NAMED[1:]  # of several persons or parts it is asked
        free = [each if (at,) != guesses["measured"] else "" for at, each in enumerate(names)]
        named = next((free.index(each) for each in naming if each in free), beside if drawn else None)
        guesses |= {} if named is None else {"characteristic": (named,)}
    if set(COLUMNS) <= set(header):
        guesses |= {name: (header.index(name),) for name in (*ORIGIN, *VERDICT) if name in header}
    return guesses
