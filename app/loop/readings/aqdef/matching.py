"""Characteristics of an AQDEF file: their unit and limits, the parameters they are set up with, and which ones are known here."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from app.core.natural_limit import NaturalLimit, looks_natural, target_of
from app.core.parameters import Parameters, cautious
from app.core.plausibility import INCH, inch_warnings, looks_like_inches
from app.files.aqdef.description import LONGEST, Characteristic, Description
from app.files.aqdef.values import number_of
from app.files.formats.cell_values import Unreadable, folded
from app.files.formats.units import LENGTHS, length_unit
from app.language.i18n import _
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.warnings.wording import sentence

NEW = "+"
"""Chosen for a characteristic that is to be set up."""
SLACK = 5e-7  # mm; limits that differ by less are the same
NATURAL = "2"


@dataclass(frozen=True)
class Content:
    """One characteristic of a file. Lengths in mm.

    unit: of the file's numbers. natural_limit: as the file says, None where it says nothing. obstacle: why it is not imported at all. not_new: why it cannot be set up out of the file.
    line: the one that stands against it, else the first that describes it; 0 where none does.
    """

    index: int
    part: str
    part_name: str
    number: str
    name: str
    unit: str
    nominal: float | None = None
    lower: float | None = None
    upper: float | None = None
    obstacle: str = ""
    not_new: str = ""
    remarks: tuple[str, ...] = ()
    machine: str = ""
    natural_limit: NaturalLimit | None = None
    line: int = 0

    @property
    def title(self) -> str:
        """As people know it: number and name."""
        words = dict.fromkeys(word for word in (self.number, self.name) if word)
        return " ".join(words) or _("Characteristic {index}").format(index=self.index)

    @property
    def scale(self) -> float:
        """Millimetres in its unit."""
        return LENGTHS[self.unit]

    @property
    def identity(self) -> tuple[str, str, str]:
        """By which it is remembered: part, number, name."""
        return ((self.part or self.part_name)[:LONGEST], self.number[:LONGEST], self.name[:LONGEST])

    @property
    def target(self) -> float | None:
        """The size expected, mm: nominal, else the natural limit, else between the limits."""
        if self.nominal is not None:
            return self.nominal
        if self.lower is None or self.upper is None:
            return None
        return target_of(0.0, self.upper, self.lower, self.natural)

    @property
    def natural(self) -> NaturalLimit | None:
        """The natural limit that it is set up with: the file's, else 0 of a form, which nothing is below."""
        if self.natural_limit is None and self.lower == 0 and not self.nominal:
            of_form = self.nominal == 0 or looks_natural(f"{self.number} {self.name}")
            return NaturalLimit.LOWER if of_form else None
        return self.natural_limit


def contents(description: Description, unit: str | None = None) -> list[Content]:
    """Every characteristic of the file. unit: of lengths for which it names none."""
    return [_content(description, each, unit) for each in description.characteristics.values()]


def _content(description: Description, each: Characteristic, unit: str | None) -> Content:
    part = description.part_of(each)
    said: list[str] = []
    word = each.fields.get("K2142", "")
    own_unit, obstacle = _unit(word, unit, said)
    if each.counts:
        obstacle = _("counts parts (K2004 = {kind}); Inband keeps measured sizes").format(kind=each.fields["K2004"])
    elif each.grades:
        obstacle = _("holds grades, no sizes (K2004 = {kind}, 0 is measured)").format(kind=each.fields["K2004"])
    nominal, lower, upper = (None, None, None) if obstacle else _limits(each.fields, LENGTHS[own_unit], said)
    natural = _natural(each.fields, f"{each.number} {each.name}", nominal, said)
    machine = part.get("K1081", "") or part.get("K1082", "") or _only(description.catalogues.get("K4062", {}))
    return Content(
        each.index,
        part.get("K1001", ""),
        part.get("K1002", ""),
        each.number,
        each.name,
        own_unit,
        nominal,
        lower,
        upper,
        obstacle,
        "" if obstacle else not_new(nominal, lower, upper),
        tuple(said),
        machine,
        None if obstacle else natural,
        each.lines.get(
            "K2004" if each.counts or each.grades else "K2142" if obstacle else "", min(each.lines.values(), default=0)
        ),
    )


def _only(entries: Mapping[int, str]) -> str:
    return next(iter(entries.values())) if len(entries) == 1 else ""


def _unit(word: str, said_unit: str | None, said: list[str]) -> tuple[str, str]:
    """Return the unit and why it cannot be used. Only what the file does not say is taken from elsewhere."""
    if word.strip():
        known = length_unit(word)
        if known is None:
            return "mm", _("is not a length: its unit is {unit} (K2142)").format(unit=repr(word))
        if known not in {"mm", "um"}:
            said.append(_("its unit is {unit} (K2142): values and limits are converted to mm").format(unit=known))
        return known, ""
    if said_unit is None:
        said.append(_("the file names no unit (K2142): taken for mm"))
    return said_unit or "mm", ""


def _limits(
    fields: Mapping[str, str], scale: float, said: list[str]
) -> tuple[float | None, float | None, float | None]:
    """Nominal size, lower and upper limit, mm."""

    def length(key: str) -> float | None:
        text = fields.get(key, "")
        if not text:
            return None
        try:
            return round(number_of(text) * scale, 9)
        except Unreadable as error:
            said.append(f"{key}: {text!r} {error}")
            return None

    nominal = length("K2101")
    found: list[float | None] = []
    for limit, deviation, kind in (("K2110", "K2112", "K2120"), ("K2111", "K2113", "K2121")):
        value, off = length(limit), length(deviation)
        if value is None and off is not None and nominal is None:
            said.append(
                _("{deviation} is an offset from a nominal size (K2101), which is missing").format(deviation=deviation)
            )
        if value is None and off is not None and nominal is not None:
            value = round(nominal + off, 9)
        elif value is not None and off is not None and nominal is not None and abs(nominal + off - value) > SLACK:
            said.append(
                _("{limit} and {deviation} do not agree; {limit} counts").format(limit=limit, deviation=deviation)
            )
        if value is not None and fields.get(kind) == "0":
            said.append(
                _("{kind} = 0 says that there is no limit, {limit} names one; it counts").format(kind=kind, limit=limit)
            )
        found.append(value)
    lower, upper = found
    if lower is None and upper is not None and (fields.get("K2120") == NATURAL or not nominal):
        lower = 0.0
        said.append(_("no lower limit: a form error, which is never below 0"))
    return nominal, lower, upper


def _natural(fields: Mapping[str, str], name: str, nominal: float | None, said: list[str]) -> NaturalLimit | None:
    """The limit that the file calls natural (K2120, K2121 = 2); an ordinary lower one of a form error is not believed."""
    lower, upper = (fields.get(key, "").strip() == NATURAL for key in ("K2120", "K2121"))
    if lower and upper:
        said.append(_("both limits are natural ones (K2120, K2121 = 2), so nothing would be judged: both are judged"))
        return NaturalLimit.NONE
    if lower or upper:
        return NaturalLimit.LOWER if lower else NaturalLimit.UPPER
    if fields.get("K2111") and not (fields.get("K2110") or fields.get("K2112") or nominal):
        return NaturalLimit.LOWER  # as `_limits` has it: a form error
    ordinary = fields.get("K2120", "").strip() == "1" and not looks_natural(name)
    return NaturalLimit.NONE if ordinary else None


def not_new(
    nominal: float | None, lower: float | None, upper: float | None, names: tuple[str, str] = ("K2110", "K2111")
) -> str:
    """The reason why it cannot be set up with these limits, mm; names: of lower and upper limit in its file."""
    if lower is None or upper is None:
        return _("it has no tolerance: {field} is missing").format(field=names[0 if upper is not None else 1])
    if upper - lower < 1e-6:
        return _("its upper limit is not above its lower one")
    if nominal is not None and not lower - 1000 <= nominal <= upper + 1000:
        return _("its nominal size lies far from its limits")
    return ""


def parameters_of(content: Content) -> dict[str, Any]:
    """The parameters it is set up with: the drawing's, and for what no file knows cautious values. It corrects nothing.

    Raises nothing where `not_new` is empty.
    """
    lower, upper = content.lower or 0.0, content.upper or 0.0
    nominal = content.target or 0.0
    width = round(upper - lower, 9)
    natural = content.natural
    return {
        "nominal": round(nominal, 9),
        "upper_deviation": round(upper - nominal, 9),
        "lower_deviation": round(lower - nominal, 9),
        **cautious(width, natural),
        **({} if natural is None else {"natural_limit": natural.value}),
    }


def key_for(content: Content, taken: dict[str, int]) -> str:
    """A key that is not taken, made of part, number and name; it is taken now. taken: keys, each with the last number behind it."""
    words = [content.part or content.part_name, content.number]
    if len(content.number) < 3:
        words.append(content.name)
    plain = "-".join(
        re.sub(r"[^a-z0-9._]+", "-", folded(word).replace(" ", "-")).strip("-._") for word in words if word
    )
    stem = re.sub(r"^[^a-z0-9]+", "", plain)[:58].strip("-") or f"aqdef-{content.index}"
    number, key = taken.get(stem, 1), stem
    while key in taken:
        number += 1
        key = f"{stem}-{number}"
    taken[stem] = number
    taken.setdefault(key, 1)
    return key


def guessed(
    found: Sequence[Content],
    known: Sequence[CurrentCharacteristic],
    remembered: Mapping[tuple[str, str, str], str],
) -> dict[int, str]:
    """The key of the characteristic that each is here: as remembered, else the one of its part with its number or name."""
    names: dict[str, _Alike] = {}
    for current in known:
        part = folded(current.characteristic.part or "")
        for name in {folded(current.characteristic.key), folded(current.characteristic.name)}:
            names.setdefault(name, _Alike()).add(current.characteristic.key, part)
    chosen: dict[int, str] = {}
    taken: set[str] = set()
    for content in found:
        if content.obstacle:
            continue
        key = remembered.get(content.identity) or _by_name(content, names)
        if key and key not in taken:
            chosen[content.index] = key
            taken.add(key)
    return chosen


@dataclass
class _Alike:
    """Characteristics here that have one name, by their part: two parts have a D40 each. Their keys, two of each at most."""

    of_part: dict[str, list[str]] = field(default_factory=dict)
    of_any: list[str] = field(default_factory=list)

    def add(self, key: str, part: str) -> None:
        for keys in [self.of_part.setdefault(part, []), *([self.of_any] if part else [])]:
            if len(keys) < 2:  # of two none is chosen, as of a thousand
                keys.append(key)

    def the_one(self, parts: set[str]) -> str | None:
        """The one that may be of these parts. Nothing said is no contradiction, but one of which it is said comes first."""
        of_them = [key for part in parts for key in self.of_part.get(part, ())] if parts else self.of_any
        fitting = [*of_them, *self.of_part.get("", ())]
        if len(fitting) > 1:
            fitting = of_them
        return fitting[0] if len(fitting) == 1 else None


def _by_name(content: Content, names: Mapping[str, _Alike]) -> str | None:
    parts = {folded(each) for each in (content.part, content.part_name)} - {""}
    for word in filter(None, (content.number, content.name)):
        alike = names.get(folded(word))
        if alike is not None and (key := alike.the_one(parts)) is not None:
            return key
    return None


def doubts(content: Content, parameters: Parameters) -> list[str]:
    """Sentences on what does not fit between the file and the characteristic that it is said to be."""
    target = content.target
    if target is None:
        return []
    texts = [sentence(each) for each in inch_warnings([("K2101", target, parameters.target)])]
    if content.unit == "inch" and looks_like_inches(parameters.target, target):
        texts.append(
            _("{size} inch is {there} mm here: are the numbers of the file in mm already?").format(
                size=f"{target / INCH:g}", there=f"{parameters.target:g}"
            )
        )
    natural = content.natural_limit or NaturalLimit.NONE
    if natural is not NaturalLimit.NONE and natural is not parameters.natural_limit:
        texts.append(
            _(
                "The file calls the {which} limit a natural one ({field} = 2), the characteristic does not: its index is of both "
                "sides. Set its natural limit in Set-up."
            ).format(
                which=_("lower") if natural is NaturalLimit.LOWER else _("upper"),
                field="K2120" if natural is NaturalLimit.LOWER else "K2121",
            )
        )
    if texts or content.lower is None or content.upper is None:
        return texts
    here = parameters.sizes
    if max(abs(content.lower - here[0]), abs(content.upper - here[1])) > SLACK:
        texts.append(
            _(
                "The limits in the file, {lower:g} to {upper:g} mm, are not those of the characteristic, {low:g} to {high:g} mm."
            ).format(lower=content.lower, upper=content.upper, low=round(here[0], 6), high=round(here[1], 6))
        )
    return texts


def said(text: str, found: Sequence[Content]) -> dict[int, str]:
    """Choices out of a text: `D40=shaft-d40,Part:L12=+,D41=`: number, name or index of a characteristic, before it the part if need be.

    Nothing behind the sign leaves it out. Raises `ValueError` with a sentence.
    """
    pairs: list[tuple[str, str]] = []
    for pair in filter(None, (each.strip() for each in text.split(","))):
        name, sign, key = (each.strip() for each in pair.rpartition("="))
        if not sign or not name:
            raise ValueError(_("Write it as D40=shaft-d40, as D40=+ to set it up, or as D40= to leave it out."))
        pairs.append((name, key))
    return named(pairs, found)


def named(pairs: Iterable[tuple[str, str]], found: Sequence[Content]) -> dict[int, str]:
    """Choices out of pairs of a name in the file, as `said` has it, and a key. Raises `ValueError` with a sentence."""
    called = _called(found)
    chosen: dict[int, str] = {}
    for name, key in pairs:
        fitting = called.get(name, [])
        if len(fitting) != 1:
            there = ", ".join(each.title for each in found[:20])
            reason = (
                _("{name} is no characteristic of the file; it has: {there}.")
                if not fitting
                else _("{name} is {count} characteristics of the file: write the part before it, as PART:{name}.")
            )
            raise ValueError(reason.format(name=name, there=there, count=len(fitting)))
        chosen[fitting[0].index] = key
    return chosen


def leaving_out(some: Iterable[Content], found: Sequence[Content]) -> str:
    """The argument that leaves these characteristics of the file out, as `said` reads it."""
    called = _called(found)

    def plain(each: Content) -> str:
        words = (each.number, each.name, f"{each.part}:{each.number}", f"{each.part}:{each.name}")
        fitting = (word for word in words if called.get(word) == [each] and not set(word) & {",", '"'})
        return next(fitting, str(each.index))

    return ",".join(f"{plain(each)}=" for each in some)


def _called(found: Sequence[Content]) -> dict[str, list[Content]]:
    """The characteristics by number and name, alone and with the part before it; where nothing is called so by index."""
    named_so: dict[str, dict[int, Content]] = {}
    for each in found:
        for word in (each.number, each.name):
            for called in (word, f"{each.part}:{word}", f"{each.part_name}:{word}"):
                named_so.setdefault(called, {})[each.index] = each
    return {str(each.index): [each] for each in found} | {word: list(each.values()) for word, each in named_so.items()}
