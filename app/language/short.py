"""A text as it is read in passing: at most fifteen words of it."""

import re

MOST_WORDS = 15
_ENDS = re.compile(r"(?<=[.?!])\s")
_WITH_UNIT = re.compile(r"\s(?=(?:µm|mm|%|°|h|s|min)\b)")
_PARTS = re.compile(r"(?<=[:;,])\s")


def in_short(text: str) -> str:
    """The first sentence; of a longer one the part that says the most in fifteen words. The rest is where there is time to read.

    >>> in_short("Deviation 6.0 µm is beyond 5.0 µm: corrected in full. The part was cut before it.")
    'Deviation 6.0 µm is beyond 5.0 µm: corrected in full.'
    >>> in_short("Deviation 60 µm lies more than 30 µm from the level of the readings before: neither wear nor scatter explains it.")
    'Deviation 60 µm lies more than 30 µm from the level of the readings before.'
    """
    sentence = _ENDS.split(text.strip(), maxsplit=1)[0]
    if words(sentence) <= MOST_WORDS:
        return sentence
    parts = _PARTS.split(sentence)
    begun = [" ".join(parts[:count]) for count in range(len(parts), 0, -1)]
    rests = [" ".join(parts[count:]) for count in range(1, len(parts))]
    fitting = (part for part in (*begun, *rests) if 4 <= words(part) <= MOST_WORDS)
    found = next(fitting, None)
    if found is None:
        return " ".join(sentence.split(" ")[: MOST_WORDS - 1]) + " …"
    return found[:1].upper() + found[1:].rstrip(":;,.") + ("" if found[-1] in "?!" else ".")


def words(text: str) -> int:
    """Number of words; a number and its unit are one.

    >>> words("The part is too large: deviation +12 µm.")
    7
    """
    return len(_WITH_UNIT.sub("", text).split())
