"""Remarks that are the same for many lines, said once: with the count and the first lines."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from app.language.i18n import _

FIRST = 3
MOST = 200  # different ones


class Remark(NamedTuple):
    """Something about a line that a person should know. wrong: its value cannot be taken; else it is only said."""

    line: int
    field: str
    value: str
    reason: str
    wrong: bool = False

    def __str__(self) -> str:
        where = _("line {line}").format(line=self.line) + (f", {self.field}" if self.field else "")
        return f"{where}: {f'{self.value!r} ' if self.value else ''}{self.reason}"


def lines_of(first: Sequence[int], count: int | None = None) -> str:
    """The lines of something, of which the first are named; count: of all, where `first` are not all.

    >>> lines_of([4]), lines_of([4, 9]), lines_of([4, 4]), lines_of([4, 9, 12, 13], 30)
    ('line 4', 'lines 4, 9', 'line 4', 'lines 4, 9, 12 and 27 more')
    """
    first = list(dict.fromkeys(first))
    count = len(first) if count is None else count
    if count == 1:
        return _("line {line}").format(line=first[0])
    named = ", ".join(map(str, first[: FIRST if count > FIRST + 1 else count]))
    if count <= len(first) and count <= FIRST + 1:
        return _("lines {lines}").format(lines=named)
    return _("lines {lines} and {count} more").format(lines=named, count=count - FIRST)


@dataclass
class _Same:
    first: Remark
    lines: list[int]
    count: int = 1  # of lines


@dataclass
class Repeats:
    """Remarks by field and reason, in the order of their first lines."""

    _found: dict[tuple[str, str], _Same] = field(default_factory=dict)

    def add(self, remark: Remark) -> None:
        """Take one more; of more than `MOST` different ones only those that are known."""
        name = (remark.field.partition("/")[0], remark.reason)
        same = self._found.get(name)
        if same is None:
            if len(self._found) < MOST:
                self._found[name] = _Same(remark, [remark.line])
            return
        if remark.line in same.lines:
            return
        same.count += 1
        if len(same.lines) <= FIRST:
            same.lines.append(remark.line)
        else:
            same.lines[-1] = remark.line

    def sentences(self) -> list[str]:
        """Each with its lines, its field and the first value."""
        return [_sentence(each) for each in self._found.values()]


def _sentence(same: _Same) -> str:
    if same.count == 1:
        return str(same.first)
    where = ", ".join(filter(None, (lines_of(same.lines, same.count), same.first.field.partition("/")[0])))
    return f"{where}: {f'{same.first.value!r} ' if same.first.value else ''}{same.first.reason}"


def once(remarks: Iterable[Remark]) -> list[str]:
    """Sentences of these remarks, each said once; a line that is named twice counts as one.

    >>> once([Remark(4, "K2142", "Nm", "is no length"), Remark(4, "K2142", "N", "is no length")])
    ["line 4, K2142: 'Nm' is no length"]
    """
    found = Repeats()
    for remark in remarks:
        found.add(remark)
    return found.sentences()
