"""Readings in messages of JSON: in Inband's own form, or in the form of others, whose members a configuration names."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, Final, NamedTuple

from app.bridge.fields import EVERY, Form, put
from app.bridge.json_text import read_json
from app.files.formats.cell_values import Unreadable
from app.files.formats.units import UnknownUnit, beside, unit_in

KINDS: Final[dict[str, tuple[type, ...]]] = {
    "characteristic": (str, int),
    "measured": (int, float),
    "touches": (list,),
    "measured_at": (str,),
    "machined_at": (str,),
    "part": (str, int),
    "key": (str, int),
    "correction_in_effect": (int,),
    "first_move_triggered": (bool,),
    "context": (dict,),
}
"""What the body of a reading may hold."""
NAMES: Final = {
    str: "a text",
    int: "a whole number",
    float: "a number",
    list: "a list",
    bool: "true or false",
    dict: "an object",
}
LONGEST_KEY: Final = 128
LARGEST: Final = 65_536  # bytes of a message


class Found(NamedTuple):
    """One reading of a message. said: its key as the message says it, by which the sender knows it. fault: why it is none.

    left_out: temperatures, in words by field.
    """

    key: str | None
    said: str | int | None
    body: dict[str, Any]
    fault: str | None = None
    left_out: Mapping[str, str] = MappingProxyType({})


class WrongMessage(ValueError):
    """A message that holds no reading; the words say why."""


def object_in(payload: bytes) -> dict[str, Any]:
    """The JSON object of a message. Raises `WrongMessage` with a sentence."""
    if len(payload) > LARGEST:
        raise WrongMessage(f"The message has {len(payload)} bytes, the most is {LARGEST}.")
    try:
        content = read_json(payload)
    except UnicodeDecodeError:
        raise WrongMessage("The message is not UTF-8.") from None
    except json.JSONDecodeError as error:
        raise WrongMessage(f"The message is no JSON: {error}. Was it cut off?") from None
    except ValueError as error:
        raise WrongMessage(f"The message {error}.") from None
    if not isinstance(content, dict):
        raise WrongMessage("The message is no JSON object {…}.")
    return content


def own_reading(payload: bytes, characteristics: Mapping[str, str], form: Form) -> Found:
    """The reading in a message of Inband's own form. Numbers as characteristic, part and key are taken for their texts."""
    try:
        body = object_in(payload)
    except WrongMessage as error:
        return Found(None, None, {}, str(error))
    said = body.get("key")
    key = str(said) if isinstance(said, str | int) and not isinstance(said, bool) else ""
    if not 1 <= len(key) <= LONGEST_KEY:
        key, said = "", None
    fault = _fault(body)
    if fault is None and not key:
        fault = f"The reading has no key of 1 to {LONGEST_KEY} characters: without one a repeat cannot be distinguished from a reading."
    if fault is not None:
        return Found(key or None, said, body, fault)
    content = {name: value for name, value in body.items() if value is not None and name != "key"}
    name = str(content["characteristic"])
    content["characteristic"] = characteristics.get(name, name)
    if "part" in content:
        content["part"] = str(content["part"])
    for each in ("measured", "touches"):
        if each in content:
            content[each] = _scaled(content[each], form.scale)
    return Found(key, said, content)


def _fault(body: Mapping[str, Any]) -> str | None:
    if unknown := sorted(body.keys() - KINDS.keys()):
        return f"The reading has a field that is not known: {unknown[0]!r}. Known are {', '.join(KINDS)}."
    for name, value in body.items():
        wanted = KINDS[name]
        if value is not None and (not isinstance(value, wanted) or (isinstance(value, bool) and bool not in wanted)):
            shown = json.dumps(value, ensure_ascii=False)[:40]
            kinds = " or ".join(NAMES[each] for each in wanted)
            return f"{name} = {shown} is not of the kind that a reading has there: {kinds}."
    if body.get("characteristic") in {None, ""}:
        return "The reading has no characteristic."
    if (body.get("measured") is None) == (body.get("touches") is None):
        return "The reading has either measured or touches."
    return None


def _scaled(value: Any, scale: float) -> Any:
    if isinstance(value, list):
        return [_scaled(each, scale) for each in value]
    is_length = isinstance(value, int | float) and not isinstance(value, bool)
    return round(value * scale, 9) if is_length and scale != 1.0 else value


def foreign_readings(
    payload: bytes, machine: str, fields: Mapping[str, str], characteristics: Mapping[str, str], form: Form
) -> list[Found]:
    """The readings in a message of others. fields: by field the member, with points where one is inside another.

    Without ``measured`` among the fields the names in characteristics are members with sizes. A message without a key is known
    by what it says: it needs a time or a part.
    """
    try:
        content = object_in(payload)
    except WrongMessage as error:
        return [Found(None, None, {}, str(error))]
    values = {field: value for field, path in fields.items() if (value := member(content, path)) is not None}
    if "measured" in fields:
        path = fields["measured"]
        if "measured" not in values:
            words = f"The message has no value at {path!r}, where fields says that measured stands."
            return [Found(None, values.get("key"), {}, words)]
        sizes = [(str(values.get("characteristic", EVERY)), values.pop("measured"), _unit_beside(content, path))]
    else:
        sizes = [
            (name, size, _unit_beside(content, name))
            for name in characteristics
            if (size := member(content, name)) is not None
        ]
    if not sizes:
        return [Found(None, None, {}, "The message has none of the members that characteristics names.")]
    return list(_mapped(payload, machine, values, sizes, characteristics, form, fields))


def _mapped(
    payload: bytes,
    machine: str,
    values: Mapping[str, Any],
    sizes: list[tuple[str, Any, Any]],
    characteristics: Mapping[str, str],
    form: Form,
    fields: Mapping[str, str],
) -> Iterator[Found]:
    said, alone = values.get("key"), "measured" in fields
    for name, size, unit in sizes:
        if (key := characteristics.get(name)) is None:
            yield Found(None, None, {}, f"{name!r} is not named in machine.{machine}.characteristics. Add it there.")
            continue
        body: dict[str, Any] = {"characteristic": key}
        wrong, left_out = "unit", dict[str, str]()
        try:
            own = form.in_unit(unit_in(fields.get("measured", name)), values.get("unit", unit))
            for field, value in {**values, "measured": size}.items():
                if field not in {"characteristic", "unit", "key"}:
                    wrong = f"{field} = {json.dumps(value, ensure_ascii=False)[:40]}"
                    if (read := own.value(field, "" if value is None else value)) is not None:
                        put(body, field, read)
                    elif of_value := own.left_out(field, value):
                        left_out[field] = f"{wrong} {of_value}."
        except (Unreadable, UnknownUnit) as error:
            words = error if isinstance(error, Unreadable) else f"{error.word}, in the name of the member, is no length"
            yield Found(None, None, {}, f"{wrong} {words}.")
            continue
        if said is None and not body.keys() & {"measured_at", "machined_at", "part"}:
            words = "The reading has no key, no time and no part: a repeat cannot be distinguished from a reading. Map one of them."
            yield Found(None, None, {}, words)
            continue
        first = str(said) if said is not None else f"{machine}:{_digest(payload)}"
        whole = first if alone else f"{first}:{name}"
        if len(whole) > LONGEST_KEY:
            whole = f"{machine}:{_digest(whole.encode())}"
        yield Found(whole, said if alone and said is not None else whole, body, left_out=left_out)


def _unit_beside(content: Any, path: str) -> Any:
    """The unit that stands beside a size in its object, else in the nearest one around it."""
    while path:
        path = "" if path in content else path.rpartition(".")[0]
        around = member(content, path) if path else content
        if isinstance(around, dict) and (unit := beside(around, "unit")) is not None:
            return unit
    return None


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:32]


def member(content: Any, path: str) -> Any:
    """The value of a member of an object; a point in the name leads into it, a number into a list. None if it is not there.

    >>> member({"d": {"d40": [1.5]}, "a.b": 2}, "d.d40.0"), member({"a.b": 2}, "a.b"), member({}, "a")
    (1.5, 2, None)
    """
    if isinstance(content, dict) and path in content:
        return content[path]
    first, _, rest = path.partition(".")
    if isinstance(content, list) and first.isdecimal() and int(first) < len(content):
        inner = content[int(first)]
    elif isinstance(content, dict) and first in content and rest:
        inner = content[first]
    else:
        return None
    return member(inner, rest) if rest else inner
