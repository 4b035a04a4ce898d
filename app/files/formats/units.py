"""Units of length, as files and headers of columns name them: one table for every door, so that no size becomes a silent mm.

A number with its unit behind it is read in `app.files.formats.number_with_unit`.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any, Final, Literal, get_args

from app.files.formats.cell_values import Unreadable
from app.files.formats.column_names import NAMES, TEMPERATURES, key_of
from app.language.i18n import _

Unit = Literal["mm", "um", "nm", "cm", "m", "inch", "mil", "tenth", "uin"]
LENGTHS: Final[dict[str, float]] = {
    "mm": 1.0,
    "um": 1e-3,
    "nm": 1e-6,
    "cm": 10.0,
    "m": 1000.0,
    "inch": 25.4,
    "mil": 25.4e-3,
    "tenth": 25.4e-4,
    "uin": 25.4e-6,
}
"""Millimetres in each unit. A mil or thou is 0.001 inch, a machinist's tenth 0.0001 inch."""
assert tuple(LENGTHS) == get_args(Unit)

_WORDS: Final[dict[str, str]] = {
    word: unit
    for unit, words in {
        "mm": "mm millimeter millimeters millimetern millimetre millimetres millimetri milimetar milimetara milimetri milimetrih "
        "milímetro milímetros milimetro milimetros milimetry milimetrů milimetrów milimetrach milimetrech milimetre milliméter "
        "milliméterben millimètre millimètres "
        "мм миллиметр миллиметры миллиметрах милиметар 毫米 ミリ",
        "um": "µm um mikrometer mikrometern micrometer micrometers micrometre micrometres micron microns mikron mikrona mikroni mikronen "
        "mikronima mikronih mikrony mikronů mikronów mikronach mikronech mikronban mikrón mícron mícrons micrones micra micras mikra mikrometar mikrometara mikrometri "
        "mikrometrov mikrometrih mikrometrů mikrometrów mikrometr mikrometrach mikrometrech mikrométer mikrométerben mikrometre micromètre micromètres micrometro micrometri micrómetro micrómetros "
        "mkm мкм микрон микроны микронах микрона микронима микрометр микрометры микрометрах 微米 ミクロン マイクロメートル",
        "nm": "nm nanometer nanometre",
        "cm": "cm centimeter centimetre zentimeter см",
        "m": "m meter metre м",
        "inch": "in in. ins inch inches zoll inč inča inči inčima pouce pouces pollice pollici pulgada pulgadas pulg polegada polegadas "
        "tomme tommer tuuma tuumaa tuumat tuumina hüvelyk hüvelykben palce palců palcích cale calach inç дюйм дюйма дюймы дюймов дюймах инч инча инчи инчима 英寸 インチ "
        "\" '' ″ ”",
        "mil": "mil mils thou thous thou. milliinch",
        "tenth": "tenth tenths",
        "uin": "µin uin µinch uinch microinch microinches",
    }.items()
    for word in words.split()
}
OTHER_UNITS: Final = frozenset(
    ["", "-", "–", "°", "deg", "grad", "rad", "%", "s", "min", "h", "n", "kn", "nm", "kg", "g", "°c", "bar", "rpm"]
)
"""Words of a row of units, or in a name, that are none of length."""
_ONLY_AS_WRITTEN: Final = {"nm": {"nm"}, "m": {"m"}, "mm": {"mm", "MM"}}
"""Units whose other cases are something else: Nm is a torque, M a million, Mm a million metres."""
_BRACKETS: Final = re.compile(r"\[([^\[\]]*)\]|\(([^()]*)\)|<([^<>]*)>")
LONGEST_SIZE: Final = 400  # characters; what is longer is not a size
_LAST_WORD: Final = re.compile(r"[_ ]([^_ ]+)$")
_OTHER_SCALES: Final = {"f", "fahrenheit", "k", "kelvin", "r", "rankine", "℉"}
_WORDS_OF: Final = re.compile(r"[^\W\d_]+")
_GAUGES: Final = frozenset(
    ["micrometer", "mikrometer", "micrometro", "micrómetro", "micromètre", "mikrometre", "mikrometr", "mikrométer"]
)
_IN_GAUGES: Final = re.compile(rf"\b(?:in|en|em|w|v|u)\s+({'|'.join(sorted(_GAUGES))})\b", re.IGNORECASE)
_THINGS: Final = frozenset(["cale", "palce"])
"""Inches in Polish and Czech; in French a gauge block or a shim, in Polish the fingers of a gripper."""
_UNMISTAKABLE: Final = frozenset(
    ["mm", "µm", "мм", "мкм", "inč", "inç", "毫米", "微米", "英寸", "インチ"]
    + [
        word
        for word, unit in _WORDS.items()
        if len(word) > 3 and unit in {"mm", "um", "inch", "mil", "uin"} and word not in _GAUGES | _THINGS
    ]
)
"""Words that mean a unit wherever they stand in a name; a micrometer is a gauge as well, *cale* a gauge block. Others do at its end only: *um* is a German word, *in* an English one."""
_AT_END: Final = re.compile(r"(?:[-_,;/ .:=|]|(?<=\d))(mm|MM|[uµμ]m|nm|cm|mils?|tenths?|[uµμ]in)$", re.IGNORECASE)
_INCHES_AT_END: Final = re.compile(r"""(?:[_,;/:=|] ?|(?<=\d) ?)(in\.?|["″”]|'')$|(?<=\s)(["″”]|'')$""", re.IGNORECASE)
_CAPITAL_WITHIN: Final = re.compile(r"(?<=[a-zß-ÿ])(?=[A-ZА-Я])")
_WIDE: Final = str.maketrans("（）【】［］「」{}«»：，", "()[][][]()():,")
"""Brackets of other scripts, and such as set theory has, as those that are known."""
_QUOTED: Final = re.compile(r"[“\"'‘]([^“\"'‘”’]+)[”\"'’]")
_OF_A_UNIT: Final = re.compile(
    r"(?<!\w)(?:(micro[- ]?|mikro[- ]?|[uµμ]-?)|milli[- ]?)(?:inch(?:es)?|in|zoll|[\"″”])(?!\w)|\b(micro|mikro|milli)[- ]met(?:er|re)s?\b",
    re.IGNORECASE,
)
"""A unit in two words or with a mark, such as *micro inch* or *µ"*."""
_LENGTH: Final = r"""(?:mm|[uµμ]m|inch(?:es)?|in|zoll|["″])"""
_PART: Final = rf"""1\s*/\s*10+\s*{_LENGTH}(?!\w)|[\[(]\s*1\s*/\s*10+\s*[\])]|\b{_LENGTH}\s*(?:/|\*|x|×|·)\s*10+\b
|\b1?e-\d+\s*{_LENGTH}(?!\w)|\b{_LENGTH}\s*e-\d|\b10+\s*ths?\b
|\b(?:ten|hundredths?)[- ]?thou(?:sandths?)?s?\b|\btenths?\s+(?:of\s+)?(?:an?\s+)?(?:mm|thou|mil|micron|inch)
|\b(?:thousandths?|hundredths?|tausendstel|hundertstel|zehntel|hiljadit\w+|stotink\w+|tisočink\w+|desetink\w+|тысячн\w+|[mc]illièmes?|centièmes?
|dixièmes?|mil[eé]simas?|mill[eé]sim[oi]|cent[eé]sim[aoi]s?|d[eé]cim[aoi]s?|setiny|tisíciny|tysięczn\w+)\b"""
_PARTS_OF: Final = re.compile(_PART, re.IGNORECASE | re.VERBOSE)
"""Such as *1/1000 mm*: sizes counted in parts or multiples of a unit."""
_SCALED: Final = re.compile(
    _PART
    + rf"""|(?:\b(?:in|u|v|в|у)\s+|[\[(=:]\s*)\d+(?:[.,]\d+)?\s*{_LENGTH}(?!\w)
    |(?<![\d.,±])(?<!±\s)(?:0?[.,]0*1\s*(?:inch|in|["″])|0?[.,]001\s*mm)(?!\w)|(?<!\d\s)(?<=[\s(\[_])[x×*]\s?10{{2,}}\b|\b10\s*(?:\^|⁻)
    |\b{_LENGTH}\s*(?:\^\s*[23]|[²³])|\b{_LENGTH}\s*/\s*(?:s|min|rev|h|mm?|K|°C)\b|\bsq\.?\s*(?:mm|in)\b
    |\b{_LENGTH}\s*(?:or|oder|ili|ou|[,/|])\s*{_LENGTH}(?!\w)
    |\[\s*[x×*]?\s*(?:1?e[-+]?\d+|0?[.,]0*1|10{{3,}})\s*\]""",
    re.IGNORECASE | re.VERBOSE,
)
"""The same in a name, a factor alone (*[0.001]*), and what is no length or either of two: *mm²*, *mm/min*, *mm or in*."""
_TOLERANCE: Final = re.compile(r"(?<![\w.,])\d+(?:[.,]\d+)?\s*(?:[uµμ]m|microns?)(?!\w)")
"""Such as the 5 µm of *Run-out 5 µm*, a tolerance rather than the unit of the sizes."""
_OTHERS: Final = frozenset(
    re.findall(
        r"\S+",
        f"""ft foot feet fuß fuss pied pieds yd yard yards dm decimeter decimeters decimetre decimetres furlong furlongs fathom fathoms mile
    miles km angstrom angstroms px pixel pixels counts micro micros ångström ångströms {" ".join(sorted(_GAUGES | _THINGS))} µ μ mu my col cola palec imperial english customary
    thousandths tenths nm kn ncm ° º deg °c ℃ % ‰ rpm psi""",
    )
)
"""Words of units that are not known, of none of length, or of whole systems; at the end of a name and in brackets."""
_OTHER_SYSTEMS: Final = _OTHERS - OTHER_UNITS - {"my", "col", "counts"}
_OTHER_AT_END: Final = re.compile(
    rf"(?:[-_,;/ .:=|]|(?<=\d))({'|'.join(map(re.escape, sorted(_OTHERS)))})$|(?<=\S[ .-])(in\.?|ins)$|^(um|mils?|in(?=_[a-z]?\d))_"
    r"|(?<![^\W\d_])(angle|[^\W\d_]*winkel|ugao|угол|угао)[ _]?\d*$",
    re.IGNORECASE,
)
"""Those, *in* where it may be inches as well as a word (*Bore in*), and names of angles."""
_MARK_APART: Final = re.compile(r"[µμ]\s+m")
_AXES: Final = frozenset("xyzuvwijkrdlpt" + "xyzvwijkrdlpt".upper() + "U") - {"u"}
"""Letters in square brackets that say which size it is: *CIR1 [X]*. A small u is a µ where none can be typed."""
_NO_UNITS: Final = (
    {*"xyzabcuvwijkrdln", "id", "max", "min", "avg", "mean", "med", "std", "ist", "soll", "act", "nom", "dia", "abs", "rel"}
    | {"dev", "ok", "nok", "raw", "ref", "bore", "boss", "hole", "slot", "pin", "web", "key", "rib", "top", "mid", "left", "back", "side"}
    | {"face", "end", "low", "high", "deep", "flat", "loc", "pos", "cir", "nest", "lsl", "usl", "oben", "vorn", "od"}
)  # fmt: skip
"""Words in round brackets that say which size it is, and in no unit."""


def length_unit(word: str) -> str | None:
    """The unit of length that a word names, one of `LENGTHS`; None where it names another or nothing.

    >>> length_unit("[MM]"), length_unit("μm"), length_unit("thou"), length_unit("Nm"), length_unit("°")
    ('mm', 'um', 'mil', None, None)
    """
    word = word.strip(" []()<>\t").replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")
    folded = word.lower()
    as_written = _ONLY_AS_WRITTEN.get(folded)
    return None if as_written is not None and word not in as_written else _WORDS.get(folded)


def in_celsius(header: str) -> bool:
    """Tell if nothing in the name of a column of temperatures names another scale than °C.

    >>> in_celsius("Part temperature"), in_celsius("Teiltemperatur [°C]"), in_celsius("temp (probe 1)")
    (True, True, True)
    >>> in_celsius("Part temperature [°F]"), in_celsius("Teiltemperatur (K)"), in_celsius("part_temp_F")
    (False, False, False)
    """
    words = [word for each in _BRACKETS.findall(header) for word in each if word] or _LAST_WORD.findall(header)
    return not any(word.strip().lower().lstrip("°º").removeprefix("deg").strip() in _OTHER_SCALES for word in words)


def in_another_scale(header: Sequence[str], field: str, places: Sequence[int]) -> bool:
    """Tell if these columns would be a temperature whose names say another scale than °C.

    >>> in_another_scale(["measured", "Part temperature [°F]"], "part_temperature", [1])
    True
    """
    return field in TEMPERATURES and not all(in_celsius(header[place]) for place in places)


class UnknownUnit(Exception):
    """A name or a title names a unit that is none of length, not known, or maybe of something else. `word`: as it is written."""

    def __init__(self, word: str) -> None:
        super().__init__(word)
        self.word = word


@lru_cache(maxsize=4096)
def unit_of_name(name: str, said: str | None = None) -> str | None:
    """The unit that the name of a characteristic carries in its rows: *D1 [inch]*. Raises `Unreadable` for one that is not known.

    said: the unit of its size by column, row, cell or person; then a word that may be no unit, such as in *Bore (top)* or *Hauteur cale*, is none.
    """
    try:
        return unit_in(name)
    except UnknownUnit as error:
        word = error.word.lower()
        if said and not (
            word in OTHER_UNITS
            or word in _OTHERS - _THINGS
            or any(sign in ",/*×" or sign.isdigit() for sign in word)
            or "thou" in word
        ):
            return None
        words = _("{name} names the unit {word}, which is no length that is known ({known})")
        raise Unreadable(words.format(name=name[:40], word=repr(error.word), known=", ".join(LENGTHS))) from None


def unit_in(header: str) -> str | None:
    """The unit that the name of a column or a characteristic carries, in brackets or as a word. Raises `UnknownUnit`.

    What is in square brackets is a unit, unless it holds a digit or is an axis; in round ones if it is short and no usual word.

    >>> unit_in("Wert [µm]"), unit_in("размер (мкм)"), unit_in("D40_mm"), unit_in("D (X)"), unit_in("measured")
    ('um', 'um', 'mm', None, None)
    >>> unit_in("D40 inches"), unit_in("Ra microinch"), unit_in("width, mil"), unit_in('D 1.5"'), unit_in("D1 [X]"), unit_in("in feed")
    ('inch', 'uin', 'mil', 'inch', None, None)
    >>> unit_in("Run-out [furlong]")
    Traceback (most recent call last):
        ...
    app.files.formats.units.UnknownUnit: furlong
    """
    header = _in_one_word(header[:LONGEST_SIZE].translate(_WIDE))
    if match := _SCALED.search(header) or _TOLERANCE.search(header):
        raise UnknownUnit(match[0].strip(" [(=:])"))
    unknown = None
    for square, round_, angle in _BRACKETS.findall(header):
        word = (square or round_ or angle).strip()
        if unit := length_unit(word) or length_unit(_MARK_APART.sub("µm", word)):
            return unit
        if like_a_unit(word, least_doubt=bool(square)) and not (square and word in _AXES):
            unknown = unknown or word
    if unknown is not None:
        raise UnknownUnit(unknown)
    header = _CAPITAL_WITHIN.sub(" ", header.strip())
    if (match := _AT_END.search(header)) and (unit := length_unit(match[1])):
        return unit
    if _INCHES_AT_END.search(header):
        return "inch"
    named = _unmistakable(header)
    if len(set(map(length_unit, named))) > 1:
        raise UnknownUnit(", ".join(named))
    if not named and (match := _OTHER_AT_END.search(header)):
        raise UnknownUnit(next(filter(None, match.groups())))
    return length_unit(named[0]) if named else None


def _in_one_word(name: str) -> str:
    """A name with its unit as one word, without quotation marks: *D40 'micro inch'* as *D40 microinch*."""

    def word(match: re.Match[str]) -> str:
        if match[2]:
            return "mm" if match[2].lower() == "milli" else "micron"
        return "microinch" if match[1] else "milliinch"

    name = _QUOTED.sub(lambda match: f"({match[1]})" if length_unit(match[1]) else match[0], name)
    return _OF_A_UNIT.sub(word, name)


def _unmistakable(text: str) -> list[str]:
    """The words of a text that mean a unit of length wherever they stand, as they are written."""
    words = _WORDS_OF.findall(_CAPITAL_WITHIN.sub(" ", text.replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")))
    return [word for word in words if word.lower() in _UNMISTAKABLE and length_unit(word)] + _IN_GAUGES.findall(text)


@lru_cache(maxsize=4096)
def _names(name: str, field: str) -> bool:
    return key_of(name) in _COLUMNS[field]


_COLUMNS: Final = {field: frozenset(map(key_of, NAMES[field])) for field in ("unit", "nominal")}


def is_unit_column(name: str) -> bool:
    """Tell of a column that names a unit for each row."""
    return _names(name, "unit")


def beside(row: Mapping[Any, Any], field: Literal["unit", "nominal"]) -> Any:
    """The unit or the nominal size that a row names in a column of its own, or an object in a member; None where it has none.

    >>> beside({"Actual": "0.4724", "Einheit": "Zoll"}, "unit"), beside({"Actual": "12"}, "nominal")
    ('Zoll', None)
    """
    return next((value for name, value in row.items() if _names(str(name), field)), None)


_TITLE: Final = re.compile(
    r"\b(?:units?(?:\s+of\s+measure(?:ment)?)?|uom|(?:ma(?:ß|ss)|längen)?einheit(?:en)?|jedinic[ae]|enot[ae]|unités?|unità|unidad(?:es)?"
    r"|единицы?|јединица|单位|単位)\s*[=:]\s*([^\s;,]+)",
    re.IGNORECASE,
)
_SIZES_IN: Final = re.compile(
    r"\b(?:all|dims?|dimensions?|sizes?|values?|measurements?|lengths?|results?|readings?|units?|ma(?:ß|ss)e?|werte?|messwerte?"
    r"|angaben|längen|alle|mere|mera|vrednosti|dimenzije|rezultati|cotes?|valeurs|размеры|значения|мере|вредности)\b"
    r"[^;|]{0,60}?(?:\b(?:in|are|sind|en|u|v|в|у|su|so)\b\s*|[:=]\s*)([^\s;,/]+)(?![^\s;,.)])",
    re.IGNORECASE,
)
_SYSTEM: Final = re.compile(
    r"\b(imperial|english|customary)\s+(?:units?|system|measure)|\bu\.?s\.?\s+(customary)\b", re.IGNORECASE
)
_UNIT_OF: Final = re.compile(
    rf"\b(?:in|u|v|в|у|en|units?|einheit(?:en)?|jedinica)(?:\s*[:=])?\s*(?:0?[.,]0*1\s*{_LENGTH}(?!\w)|10\s*(?:\^|⁻))"
    r"|\b(?:values?|sizes?|ma(?:ß|ss)e|werte|all)\b[^;|\d]{0,20}[x×*]\s?10{2,}\b",
    re.IGNORECASE,
)
"""Such as *values in 0.001 mm*; a resolution or a tolerance is none."""
_ALONE: Final = re.compile(r"[\[(<]\s*([^\s\[\]()<>]{1,12})\s*[\])>]")
_QUANTITY: Final = re.compile(r"\d\s*[^\W\d_]+")
"""Such as the 2 µm of an uncertainty: that is no unit of the table."""
_ABBREVIATED, _NAME_AND_VALUE = 2, 2


def unit_above(titles: Iterable[Sequence[str]]) -> str | None:
    """The unit of length that the lines above a table say for all of it; None where they say none. titles: their cells.

    >>> unit_above([["DIM LOC1= CIRCLE CIR1  UNITS=IN"]]), unit_above([["Part", "4711"], ["Einheit:", "", "µm"]])
    ('inch', 'um')
    >>> unit_above([["ALL DIMENSIONS IN INCHES"]]), unit_above([["Alle Maße in mm"]]), unit_above([["Report 3 (inch)"]])
    ('inch', 'mm', 'inch')

    Raises `UnknownUnit` where they name another unit than mm and do not say of what, or several: it cannot be determined which counts.

    >>> unit_above([["Tolerances in µm"]])
    Traceback (most recent call last):
        ...
    app.files.formats.units.UnknownUnit: µm
    """
    said, mentioned, scaled = dict[str, None](), list[str](), list[str]()
    for cells in titles:
        filled = [cell.strip()[:LONGEST_SIZE].translate(_WIDE) for cell in cells if cell.strip()]
        for at, cell in enumerate(filled):
            words = filled[at + 1 : at + 2] if is_unit_column(cell.rstrip(":= ")) else []
            words += [*_TITLE.findall(cell), *_SIZES_IN.findall(cell)]
            if len(filled) == 1:  # a title; in a row of several cells it may be of one column
                words += [*_ALONE.findall(cell), cell if len(cell) > _ABBREVIATED else ""]
            said |= {unit: None for word in words if (unit := length_unit(word.rstrip(".")))}
            mentioned += [word for word in words if word.lower().rstrip(".") in _OTHER_SYSTEMS]
            mentioned += [match[1] or match[2] for match in _SYSTEM.finditer(cell)]
            scaled += [match[0] for form in (_PARTS_OF, _UNIT_OF) for match in form.finditer(cell)]
            mentioned += _unmistakable(_QUANTITY.sub("", cell)) if len(filled) <= _NAME_AND_VALUE else []
    if scaled:
        raise UnknownUnit(", ".join(dict.fromkeys(scaled)))
    several = list(said) if said else [word for word in mentioned if length_unit(word) != "mm"]
    if len(several) > bool(said):
        raise UnknownUnit(", ".join(dict.fromkeys(several)))
    return next(iter(said), None)


def like_a_unit(word: str, *, least_doubt: bool = False) -> bool:
    """Tell of a word that may be a unit. least_doubt: it stands where units stand."""
    if not word or any(sign.isdigit() for sign in word) or len(word.split()) > 1:
        return False
    return least_doubt or word.lower() in _OTHERS or (len(word) <= 4 and word.lower() not in _NO_UNITS)
