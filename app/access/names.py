"""Names of people and keys: what they may be made of, and which look alike.

The record tells people by their names (and by their numbers beside), so no name may pose as another one, as a key, or as
Inband itself. Letters of every script are welcome; what cannot be seen, and words mixed of scripts whose letters look alike,
are not. After Unicode Technical Standard 39, with its confusable letters of Cyrillic, Greek and Armenian only.
"""

import unicodedata
from collections.abc import Iterable

from app.errors import Conflict, FieldError, Invalid
from app.language.i18n import _
from app.web.fields import Text200
from app.web.validation import checked

PUNCTUATION = " .,'’ʼ-‐·_@+&"
ALIKE = {"LATIN", "CYRILLIC", "GREEK", "COPTIC", "ARMENIAN", "CHEROKEE", "LISU"}
"""Scripts with letters that are taken for those of another one."""
RESERVED = ("inband", "key", "commandline", "command", "sign-in", "system")
"""First words under which the record knows an actor that is not a person."""
# Not seen, although they are letters or marks to Unicode: fillers, joiners, selectors of variants.
_UNSEEN = {
    0x034F,
    0x115F,
    0x1160,
    0x17B4,
    0x17B5,
    0x2800,
    0x3164,
    0xFFA0,
    *range(0x180B, 0x1810),
    *range(0xFE00, 0xFE10),
}
_SAME = str.maketrans(
    # Cyrillic, Greek, Armenian, and signs: by what they look like in upper or lower case.
    "авгезікмнорстухѕјһԁԛԝүёαβγεζηικμνορτυχօսոհցյ01l|ıᴀʙᴄᴅᴇɪᴊᴋᴍɴᴏᴘʀᴛᴜᴠᴡʏᴢɑɡ’ʼ‐·",
    "abre3ikmhopctyxsjhdqwyëabyezhikmvoptuxounhgjoiiiiabcdeijkmnoprtuvwyzag''-.",
)


def as_stored(name: str) -> str:
    """Return the name as it is stored and compared at the sign-in: composed (NFC), with single blanks."""
    return " ".join(unicodedata.normalize("NFC", name).split())


def skeleton(name: str) -> str:
    """Return what a name looks like: two names with the same skeleton are taken for each other.

    >>> skeleton("Adm1n") == skeleton("аdmin"), skeleton("Ана") == skeleton("Ana")
    (True, False)
    """
    folded = unicodedata.normalize("NFKC", unicodedata.normalize("NFKC", name).casefold())
    return as_stored(folded.translate(_SAME).replace("rn", "m").replace("vv", "w"))


def of_person(name: str, others: Iterable[str]) -> str:
    """Return the name of a new person as it is stored. others: the names of everybody who was ever let in.

    Raises `Invalid` for a name that cannot be read or poses as what is no person, `Conflict` for one that is taken or
    looks like one that is.
    """
    name = seen(name)
    strange = next(
        (letter for letter in name if not letter.isalnum() and not _mark(letter) and letter not in PUNCTUATION), None
    )
    if strange:
        _refuse(
            _("holds the character {character}; letters, digits, blanks and . , ' - _ @ + & are taken").format(
                character=repr(strange)
            )
        )
    if not any(letter.isalnum() for letter in name):
        _refuse(_("holds no letter"))
    words = skeleton(name).replace("-", " ").split()
    reserved = {skeleton(word) for word in RESERVED}
    if words and (words[0] in reserved or "".join(words[:2]) in reserved or skeleton(name).split()[0] in reserved):
        _refuse(_("begins like the name of a key or of Inband itself"))
    names = {skeleton(other): other for other in others}
    other = names.get(skeleton(name))
    if other is not None and other.casefold() == name.casefold():
        raise Conflict(
            _("There is a person named {name} already.").format(name=other),
            _("Choose another name, for example with the first letter of the family name."),
            errors=[FieldError("name", _("is taken"))],
        )
    if other is not None:
        raise Conflict(
            _("{name} looks like {other}, who is there already.").format(name=name, other=other),
            _("Choose another name, for example with the first letter of the family name."),
            errors=[FieldError("name", _("looks like the name of another user"))],
        )
    return name


def seen(name: str) -> str:
    """Return a name of which everything is seen, as it is stored. Raises `Invalid`."""
    name = as_stored(checked(Text200, name, "name"))
    for letter in name:
        if not letter.isprintable() or ord(letter) in _UNSEEN or 0xE0100 <= ord(letter) <= 0xE01EF:
            _refuse(_("holds a character that cannot be seen (U+{code})").format(code=f"{ord(letter):04X}"))
    for word in name.split():
        scripts = {script for letter in word if letter.isalpha() and (script := _script(letter)) in ALIKE}
        if len(scripts) > 1:
            _refuse(_("mixes letters of several scripts in the word {word}").format(word=repr(word)))
    return name


def _script(letter: str) -> str:
    return unicodedata.name(unicodedata.normalize("NFKC", letter)[0], "").partition(" ")[0]


def _mark(letter: str) -> bool:
    return unicodedata.category(letter).startswith("M")


def _refuse(wrong: str) -> None:
    raise Invalid(f"name: {wrong}", _("Choose another name."), errors=[FieldError("name", wrong)])
