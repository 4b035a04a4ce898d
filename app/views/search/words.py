"""Names as people type them: in words, in any order, without the marks that no keyboard has and the hyphens that nobody types.

*bore 30*, *30 bore*, *lathe1* and *seat d40* find Bore Ø30 H7, lathe-1 and Seat Ø40 (seat-d40): every word has to occur, and
blanks, hyphens, dots and Ø count neither in what is typed nor in the names.
"""

from collections.abc import Sequence

from sqlalchemy import ColumnElement, and_, case, func, literal, true

SEPARATORS = " -_./,;:()[]'\"Øø⌀"
BETWEEN = "|"
"""Stands between two names of one thing, so that no word begins in one and ends in the next."""
MOST_WORDS = 8
_AWAY = str.maketrans("", "", SEPARATORS + BETWEEN)
_BLANK = str.maketrans(dict.fromkeys(SEPARATORS, " "))


def words_of(term: str) -> list[str]:
    """The words of what is typed, in small letters; none of marks alone.

    >>> words_of("Bore Ø30"), words_of("lathe-1"), words_of(" - ")
    (['bore', '30'], ['lathe1'], [])
    """
    return [word for word in map(squeezed, term.split()) if word][:MOST_WORDS]


def squeezed(text: str) -> str:
    """A text in small letters without the marks that do not count."""
    return text.lower().translate(_AWAY)


def rank(words: Sequence[str], *names: str) -> int | None:
    """Rank of a name for these words: 0 its whole name, 1 how that begins, 2 words that begin so, 3 somewhere; None: not all occur.

    >>> rank(["seat", "40"], "Bearing seat Ø40"), rank(["lathe1"], "Lathe 1"), rank(["ore"], "Bore"), rank(["x"], "Bore")
    (2, 0, 3, None)
    """
    lower = BETWEEN + BETWEEN.join(names).lower() + BETWEEN
    tight = BETWEEN.join(name.translate(_AWAY) for name in lower.split(BETWEEN))
    if not all(word in tight for word in words):
        return None
    whole = BETWEEN + "".join(words)
    if whole in tight:
        return 0 if whole + BETWEEN in tight else 1
    spaced = lower.translate(_BLANK).replace(BETWEEN, " ")
    return 2 if all(f" {word}" in spaced for word in words) else 3


def matching(words: Sequence[str], *names: ColumnElement[str]) -> tuple[ColumnElement[bool], ColumnElement[int]]:
    """The same in SQL: the condition that all words occur in these columns, and the rank."""
    lower = func.lower(func.concat(BETWEEN, func.concat_ws(BETWEEN, *names), BETWEEN))
    tight = func.translate(lower, SEPARATORS, "")
    spaced = func.translate(lower, SEPARATORS + BETWEEN, " " * (len(SEPARATORS) + 1))
    whole = BETWEEN + "".join(words)
    ranked = case(
        (func.strpos(tight, whole + BETWEEN) > 0, 0),
        (func.strpos(tight, whole) > 0, 1),
        (and_(true(), *(func.strpos(spaced, f" {word}") > 0 for word in words)), 2),
        else_=literal(3),
    )
    return and_(true(), *(func.strpos(tight, word) > 0 for word in words)), ranked
