"""Words of a control's protocol of the rotary axes: the table beside this module, and what a plant adds to it."""

import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from pathlib import Path

from app.errors import Invalid
from app.files.formats.cell_values import folded
from app.language.i18n import _

TABLE = Path(__file__).with_suffix(".toml")
SETTING = "INBAND_ROTARY_WORDS"
LONGEST_LABEL = 120
SHORTEST = 2  # letters of the beginning of a word
HEAD_KEYS = ("created", "program", "tool", "kinematics", "mode")
AXIS_KEYS = (
    *("start_angle", "end_angle", "incidence", "points", "radius", "backlash"),
    *("scatter_before", "scatter_after", "greatest", "angle_error", "mean_error"),
)
MARKS = ("title", "axis", "axis_first", "optimised", "earlier", "setting")
"""Tables of words that are no labels."""
GOVERNED = {"optimised": "scatter", "earlier": "scatter", "setting": "backlash"}
"""The labels beside which a mark counts: one that is in them always would decide nothing."""


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


@dataclass(frozen=True)
class Table:
    """The words of one file, folded. labels: their meanings; stems: with theirs, in order; marks: by the table's name."""

    labels: dict[str, str] = field(default_factory=dict)
    stems: list[tuple[str, str]] = field(default_factory=list)
    marks: dict[str, list[str]] = field(default_factory=lambda: {mark: [] for mark in MARKS})

    def meaning(self, words: str) -> str | None:
        """Meaning of a folded label: a known one, one that goes on (the longest), or by its stems."""
        beginnings = [label for label in self.labels if f"{words} ".startswith(f"{label} ")]
        if beginnings:
            return self.labels[max(beginnings, key=len)]
        return next((meaning for stem, meaning in self.stems if fits(words, stem)), None)


@dataclass(frozen=True)
class Words:
    """Tables one after the other: what an earlier one knows, no later one changes."""

    tables: tuple[Table, ...]

    def key(self, words: str, everything: str = "") -> str | None:
        """Meaning of a folded label, or None. everything: with the text in brackets.

        >>> known_words().key("maximaler fehler"), known_words().key("bediener der nachtschicht")
        ('greatest', None)
        """
        key = self.meaning(words)
        if key == "backlash" and self._marked("setting", words):
            return None
        if key == "scatter":
            return "scatter_after" if self.is_optimised(everything) else "scatter_before"
        return key

    def meaning(self, words: str) -> str | None:
        """Name of the table whose words a folded label has, or None."""
        return next((meaning for table in self.tables if (meaning := table.meaning(words))), None)

    @property
    def meanings(self) -> list[str]:
        """Names of the tables that there may be."""
        return [*dict.fromkeys(meaning for table in self.tables for _stem, meaning in table.stems), *MARKS]

    def is_optimised(self, everything: str) -> bool:
        """Tell if a label is about the state after the correction."""
        return self._marked("optimised", everything) and not self._marked("earlier", everything)

    def is_title(self, words: str) -> bool:
        """Tell if a row without a value is a heading that says nothing."""
        return words in self._titles or self._titles.issuperset(words.split())

    def without_axis(self, words: str) -> tuple[str, str]:
        """The letter of the axis that a folded label names, or nothing, and the label without it.

        >>> known_words().without_axis("lose der c achse"), known_words().without_axis("lose")
        (('c', 'lose der'), ('', 'lose'))
        """
        named = self._axis.search(words)
        if named is None:
            return "", words
        return named[1] or named[2], " ".join(self._axis.sub(" ", words).split())

    def is_axis(self, words: str) -> bool:
        """Tell if a folded label is the word for an axis alone: Vermessene Rotationsachse."""
        return self._alone.fullmatch(words) is not None

    def plain(self, label: str) -> str:
        """A printed label as it is looked up: folded, without an axis."""
        return self.without_axis(folded(label.strip().rstrip(":= ")[:LONGEST_LABEL]))[1]

    def _marked(self, mark: str, words: str) -> bool:
        return any(fits(words, stem) for stem in self._of(mark))

    def _of(self, *marks: str) -> list[str]:
        return [word for table in self.tables for mark in marks for word in table.marks[mark]]

    @cached_property
    def _titles(self) -> frozenset[str]:
        return frozenset(self._of("title"))

    @cached_property
    def _axis(self) -> re.Pattern[str]:
        first, either = _any_of(self._of("axis", "axis_first")), _any_of(self._of("axis"))
        return re.compile(rf"\b(?:{first})\s+([abc])\b|\b([abc])\s?(?:{either})\b")

    @cached_property
    def _alone(self) -> re.Pattern[str]:
        return re.compile(rf"(?:[a-z]{{1,20}} ){{0,2}}(?:{_any_of(self._of('axis', 'axis_first'))})")


def _any_of(words: Iterable[str]) -> str:
    longest_first = sorted(words, key=len, reverse=True)
    return "|".join(re.sub(r"^\\\*", "[a-z]{0,20}", re.escape(word)) for word in longest_first)


@lru_cache(maxsize=8)
def known_words(added: Path | None = None) -> Words:
    """The words that Inband knows, and those of a plant's own file. A file is read once.

    Raises `Invalid` for one that cannot be read, a meaning that there is not, and words that contradict.
    """
    if added is None:
        return Words((_read(TABLE, Words(())),))
    known = known_words()
    return Words((*known.tables, _read(added, known)))


def _read(path: Path, known: Words) -> Table:
    """The table of a file. known: what its words may not contradict."""
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise _refused(path, _("cannot be read: {error}").format(error=error.strerror)) from None
    except ValueError as error:  # no UTF-8, or no TOML
        raise _refused(path, _("is not TOML in UTF-8: {error}").format(error=error)) from None
    table = Table()
    for name in sorted(content, key=lambda name: name not in MARKS):  # words for an axis are taken out of labels
        for printed, is_stem in _words_of(path, name, content[name], known):
            where = f"[{name}] “{printed}”"
            beside = Words((*known.tables, table))
            words = folded(printed) if is_stem or name in MARKS else beside.plain(printed)
            if not words.strip("*= ") or (
                is_stem and any(len(stem) < SHORTEST and stem[0] != "=" for stem in words.split())
            ):
                raise _refused(path, _("{where} is too short").format(where=where))
            other = _contradicted(name, words, is_stem, known, table) if known.tables else None
            if other is not None:
                raise _refused(
                    path,
                    _("{where} is known as [{other}] already").format(where=where, other=other),
                    _("Remove it, or write more of the label."),
                )
            if name in MARKS:
                table.marks[name].append(words)
            elif is_stem:
                table.stems.append((words, name))
            else:
                table.labels[words] = name
    return table


def _words_of(path: Path, name: str, table: object, known: Words) -> list[tuple[str, bool]]:
    """The words of a table as printed, and if they are stems. Raises `Invalid` for what cannot be in it."""
    if known.tables and name not in known.meanings:
        raise _refused(
            path,
            _("[{name}] is no meaning").format(name=name[:60]),
            _("The meanings are {meanings}.").format(meanings=", ".join(known.meanings)),
        )
    forms = ("stems",) if name in GOVERNED else ("labels",) if name in MARKS else ("labels", "stems")
    if not isinstance(table, dict) or not all(
        form in forms and isinstance(words, list) and all(isinstance(word, str) for word in words)
        for form, words in table.items()
    ):
        raise _refused(
            path,
            _("[{name}] holds something else than {forms}").format(name=name, forms=_(" and ").join(forms)),
            _('Write {form} = ["one", "another"] below it.').format(form=forms[0]),
        )
    return [(word, form == "stems") for form in forms for word in table.get(form, ())]


def _contradicted(name: str, words: str, is_stem: bool, known: Words, table: Table) -> str | None:
    """The other meaning that a word has already, if it has one."""
    if name == "title":
        return None
    if name in GOVERNED:
        opposite = {"optimised": "earlier", "earlier": "optimised"}.get(name, "")
        if any(words in each.marks.get(opposite, ()) for each in (*known.tables, table)):
            return opposite
        governed = [
            label for each in known.tables for label, meaning in each.labels.items() if meaning == GOVERNED[name]
        ]
        return GOVERNED[name] if any(fits(label, words) for label in governed) else None
    own = dict(table.stems) if is_stem else table.labels
    said = known.meaning(words.replace("=", "").lstrip("*")) or own.get(words)
    return None if said == name else said


def _refused(path: Path, wrong: str, do: str | None = None) -> Invalid:
    return Invalid.at(SETTING, f"{path}: {wrong}", do=do or _("Correct the file, or leave the setting out."))
