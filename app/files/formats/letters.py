"""The encoding of a text in single bytes, by its headings and letters. What looks like East Asia is asked about, not guessed."""

import re
from functools import cache
from typing import NamedTuple

from app.files.formats.column_names import NAMES, key_of

_SIGNS_OF_ALL = "°ºª±µ²³×·–—„“”‚‘’…€§«»\N{NO-BREAK SPACE}"
_LATIN = "äöüÄÖÜß" + _SIGNS_OF_ALL
# The common letters of German and French, of Serbian and Slovene, and of Cyrillic; rare ones would only confuse.
LETTERS = {
    "cp1252": _LATIN + "Øøéàç",
    "cp1250": _LATIN + "čćšžđČĆŠŽĐľ",
    "iso-8859-2": _LATIN + "čćšžđČĆŠŽĐ",
    "cp1251": "аеионрстлвкмдпузбјљњжчцшћђАВДИКМНОПРСТ" + _SIGNS_OF_ALL,
    "iso-8859-5": "аеионрстлвкмдпузбјљњжчцшћђАВДИКМНОПРСТ",
}
_WESTERN = ("äöüß", "àâæçèéêëîïôùûüœ", "àáâãçéêíóôõú", "áéíñóúü", "àèéìòù", "æøåéö", "åäöé", "äöõüšž")
_EASTERN = ("ąćęłńóśźż", "áčďéěíňóřšťúůýž", "áäčďéíĺľňóôŕšťúýž", "áéíóöőúüű", "ăâîşţ", "čćđšž")
_CYRILLIC = (
    "абвгдежзийклмнопрстуфхцчшщъыьэюяё", "абвгдђежзијклљмнњопрстћуфхцчџш", "абвгґдеєжзиіїйклмнопрстуфхцчшщьюя",
)  # fmt: skip
LANGUAGES = {
    "cp1252": _WESTERN,
    "cp1250": _EASTERN,
    "iso-8859-2": _EASTERN,
    "cp1251": _CYRILLIC,
    "iso-8859-5": _CYRILLIC,
    "cp850": _WESTERN,
    "cp1254": ("âçğıîöşûüi\N{COMBINING DOT ABOVE}",),
    "cp1257": ("ąčęėįšųūž", "āčēģīķļņšūž"),
    "cp1253": ("αβγδεζηθικλμνξοπρστυφχψωςάέήίϊΐόύϋΰώ",),
    "cp852": _EASTERN,
    "cp866": _CYRILLIC,
    "mac_roman": _WESTERN,
}
"""The letters beyond a to z of each language, in lower case, by the encodings that its files have."""
_COMMON = {
    **dict.fromkeys(("cp1251", "iso-8859-5", "cp866"), frozenset("оаеинтрслвкмд")),
    "cp1253": frozenset("αοιετσνρημκλςάόήίέ"),
}
"""Letters of which most text of a script is made: the bytes of one encoding are rare letters in another."""
_OF_ONE_SCRIPT = frozenset(_COMMON)
_OF_DOS_AND_MAC = frozenset({"cp850", "cp852", "mac_roman"})
_WORD = re.compile(r"[^\W\d_]+")
_SIGN_WITHIN = re.compile(
    r"(?<=[^\W\d_])[°±²³×„“”‚‹›«»•¹¼½¾¿§…](?=[^\W\d_])|(?<=[^\W\d_])[¼½¾]|(?<=[^\W\d_nN])º|(?<!\d)ª(?=[^\W\d_])|(?<=[^\W\d_])¡|[\x80-\x9f\N{REPLACEMENT CHARACTER}]"
)
# No word of theirs: á between vowels or behind one at the end, õ and û at the end, ì, ò and ù within, œ before another letter than i or u; č and ć between consonants; ъ, ы
# and ь at the beginning.
_FOREIGN = {
    "western": re.compile(
        r"ã(?=[bcdfgjklnprtvxz])|(?<=[aeiou])á(?:[aeiou]|(?![^\W\d_]))|[õû](?![^\W\d_])|[ìòù](?=[^\W\d_])|œ(?![iu])",
        re.IGNORECASE,
    ),
    "eastern": re.compile(
        r"ľ(?=[eií])|(?<![^\W\d_])ľ(?:m|in)(?![^\W\d_])|[čć](?=c)|(?<=[aeiou])á(?:[aeiou]|(?![^\W\d_]))|(?<=[bcdfghjklmnpqstvwxz])[čć](?=[bcdfghjklmnpqstvwxz])",
        re.IGNORECASE,
    ),
    "cyrillic": re.compile(r"\b[ъыь]", re.IGNORECASE),
}
_FAMILY = {
    **dict.fromkeys(("cp1251", "iso-8859-5", "cp866"), "cyrillic"),
    **dict.fromkeys(("cp1250", "iso-8859-2", "cp852"), "eastern"),
    **dict.fromkeys(("cp1252", "cp850", "mac_roman"), "western"),
}
MOST_LINES = 500
MOST = 100_000  # bytes of them
_WHOLE_LETTERS = re.compile(rb"[\x00-\xff]*[\x00-\x3f]")  # no letter of two bytes is cut there
LONGEST_OF_ONE = 2  # letters of a word that may have no Latin letter among them
_MICRO = re.compile(r"(?<![^\W\d_])µ(?=(?:m|in)(?![^\W\d_]))")
"""The sign of µm, which is a letter in other encodings."""
_SIGNS = re.compile("[" + re.escape(_SIGNS_OF_ALL) + "]")
_STRANGE = re.compile("[^\x00-\x7f\\w" + re.escape(_SIGNS_OF_ALL) + "¼½¾¿¡©®™№•‹›]")
CLEARLY = 1.5  # common letters more that another script has to have
FEWEST = 2  # letters of two bytes
CAPITALS = 32  # bytes among which the capitals of a script lie
_BEYOND = re.compile(r"[^\x00-\x7f]")
_TWO_SCRIPTS = re.compile(r"[A-Za-z](?=[\u0400-\u04ff])|[\u0400-\u04ff](?=[A-Za-z])")


class _Asian(NamedTuple):
    """An encoding in which a letter is two bytes: all such pairs, and those of common letters."""

    pair: bytes
    common: bytes


TO_NAME = {
    "cp932": _Asian(
        rb"[\x81-\x9f\xe0-\xef][\x40-\x7e\x80-\xfc]|[\xa1-\xdf]", rb"[\x81-\x83\x88-\x97].|\x98[\x40-\x72]"
    ),
    "gb18030": _Asian(rb"[\x81-\xfe][\x40-\x7e\x80-\xfe]", rb"[\xa1\xa3\xb0-\xd7][\xa1-\xfe]"),
    "big5": _Asian(rb"[\xa1-\xf9][\x40-\x7e\xa1-\xfe]", rb"[\xa1-\xc6]."),
    "cp949": _Asian(rb"[\x81-\xfe][\x41-\x5a\x61-\x7a\x81-\xfe]", rb"[\xa1-\xa3\xb0-\xc8][\xa1-\xfe]"),
}
"""They are named, never guessed."""


def guessed(content: bytes) -> tuple[str, bool]:
    """The encoding whose letters fit best, and whether they are letters of Europe rather than of East Asia."""
    lines = b"\n".join([line for line in content.splitlines() if not line.isascii()][:MOST_LINES])
    if len(lines) > MOST:
        whole = _WHOLE_LETTERS.match(lines[:MOST])
        lines = whole[0] if whole else lines[:MOST]
    texts = {name: lines.decode(name, "replace") for name in LETTERS}
    if _MICRO.search(texts["cp1252"]) and _SIGNS.sub("", _MICRO.sub("", texts["cp1252"])).isascii():
        return "cp1252", True
    best = max(LETTERS, key=lambda name: (_is_of_a_language(texts[name], name), _fit(texts[name], LETTERS[name])))
    if not _is_of_a_language(texts[best], best):
        others = {name: lines.decode(name, "replace") for name in LANGUAGES if name not in LETTERS}
        best = next((name for name, text in others.items() if _is_of_a_language(text, name)), best)
        texts |= others
    if best in _COMMON:
        first, texts = best, texts | {name: lines.decode(name, "replace") for name in _COMMON}
        best = max(_COMMON, key=lambda name: _common(texts[name], name) + CLEARLY * (name == first))
    usual = all(sign in LETTERS.get(best, "") for sign in _BEYOND.findall(texts[best]))
    return best, usual or _known(texts[best]) > 0 or not any(_is_asian(lines, each) for each in TO_NAME.values())


def _fit(text: str, letters: str) -> int:
    """Letters that its languages have, less those that they do not have; a heading that is known tells most, two scripts in a word against it."""
    fitting = sum(1 if sign in letters else -1 for sign in _BEYOND.findall(text))
    return fitting + 3 * _known(text) - 2 * len(_TWO_SCRIPTS.findall(text))


def _is_of_a_language(text: str, encoding: str) -> bool:
    """Tell if a heading is known, or all letters are of one language and no word is one that it cannot have."""
    if _known(text):
        return True
    words = [word for word in _WORD.findall(_SIGNS.sub(" ", text)) if not word.isascii()]
    if not words or _SIGN_WITHIN.search(text) or _STRANGE.search(text):
        return False
    foreign = _FOREIGN.get(_FAMILY.get(encoding, ""))
    if foreign is not None and any(foreign.search(word) for word in words):
        return False
    if encoding in _OF_ONE_SCRIPT:
        regular = all(word in {word.lower(), word.upper(), word.title()} for word in words)
        if not regular or any(letter.isascii() for word in words for letter in word) or len(max(words, key=len)) == 1:
            return False
    elif any(len(word) > LONGEST_OF_ONE and len(_BEYOND.findall(word)) == len(word) for word in words):
        return False
    if any(_has_capital_within(word, least_doubt=encoding in _OF_DOS_AND_MAC) for word in words):
        return False
    letters = set(_BEYOND.findall(" ".join(words).lower()))
    return any(letters <= set(alphabet) for alphabet in LANGUAGES[encoding])


def _has_capital_within(word: str, *, least_doubt: bool) -> bool:
    """Tell of a word with a capital beyond ASCII in front of a small letter within the word. least_doubt: or behind one, as in InnenØ."""
    beyond = (at for at, letter in enumerate(word) if at and letter.isupper() and not letter.isascii())
    return any(word[at + 1 : at + 2].islower() or (least_doubt and word[at - 1].islower()) for at in beyond)


def _common(text: str, encoding: str) -> int:
    """Common letters of a script in a text that can be of it."""
    return sum(letter in _COMMON[encoding] for letter in text.lower()) if _is_of_a_language(text, encoding) else -1


def _known(text: str) -> int:
    cells = (cell for cell in re.split(r"[;,\t|\r\n]", text) if not cell.isascii())
    return sum(key_of(cell) in _headings() for cell in cells)


@cache
def _headings() -> frozenset[str]:
    return frozenset(key_of(name) for names in NAMES.values() for name in names)


def _is_asian(content: bytes, encoding: _Asian) -> bool:
    """Tell if all bytes beyond ASCII are pairs, nearly all of common letters, and few of them touch a Latin letter.

    Words in capitals of Cyrillic or Greek are such pairs too; their bytes lie close together.
    """
    pairs = re.findall(encoding.pair, content)
    left = re.sub(encoding.pair, b"", content)
    if len(pairs) < FEWEST or not left.isascii():
        return False
    beyond = [byte for byte in content if byte > 0x7F]
    if max(beyond) - min(beyond) < CAPITALS:
        return False
    common = sum(re.fullmatch(encoding.common, pair) is not None for pair in pairs)
    runs = re.findall(rb"(?<![A-Za-z])(?:" + encoding.pair + rb")++(?![A-Za-z])", content)
    alone = sum(len(re.findall(encoding.pair, run)) for run in runs)
    return 5 * common >= 4 * len(pairs) and 2 * alone > len(pairs)
