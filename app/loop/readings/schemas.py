"""Readings as a machine sends them, and the errors when one cannot be used.

The fast way is msgspec; what it refuses is looked at once more, field by field, so that the answer names
everything that is wrong in words that a machinist understands.
"""

import json
from collections.abc import Callable, Iterator
from datetime import datetime
from math import isfinite
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct

from app.core.parameters import LARGEST_LENGTH
from app.errors import FieldError, Invalid
from app.language.i18n import _
from app.web.fields import AHEAD, EARLIEST, HISTORY_BEGINS, MACHINED_AHEAD

Length = Annotated[float, Meta(ge=-LARGEST_LENGTH, le=LARGEST_LENGTH)]
Moment = Annotated[datetime, Meta(tz=True)]
MOST_POINTS, MOST_REPEATS = 100, 100


MOST_OF_CONTEXT = 100  # events, process parameters, further fields
LONGEST_COMMENT = 1000
_Text = Annotated[str, Meta(min_length=1, max_length=128)]
_Comment = Annotated[str, Meta(min_length=1, max_length=LONGEST_COMMENT)]
_Number = Annotated[float, Meta(ge=-1e300, le=1e300)]


class Context(Struct, forbid_unknown_fields=True, omit_defaults=True):
    """The circumstances of a reading. Nothing but `by_hand` is of account for the decision; they are shown and handed on."""

    order: Annotated[_Text | None, Meta(description="Number of the order.")] = None
    batch: Annotated[_Text | None, Meta(description="Batch or heat of the material.")] = None
    nest: Annotated[
        Annotated[int, Meta(ge=0, le=999_999)] | None, Meta(description="Number of the nest or cavity.")
    ] = None
    spindle: Annotated[_Text | None, Meta(description="The spindle that cut the part.")] = None
    fixture: Annotated[_Text | None, Meta(description="The fixture, pallet or chuck in which it was cut.")] = None
    program: Annotated[_Text | None, Meta(description="The program that cut it.")] = None
    operator: Annotated[_Text | None, Meta(description="Who measured.")] = None
    machine: Annotated[_Text | None, Meta(description="The machine that made the part, as the sender calls it.")] = None
    gauge: Annotated[_Text | None, Meta(description="What it was measured with.")] = None
    by_hand: Annotated[
        bool | None,
        Meta(
            description="true: a person measured it with a gauge of their own. The empirical value (R11) is what the machine's "
            "probe reads too much, so it is not taken off."
        ),
    ] = None
    comment: Annotated[_Comment | None, Meta(description="Remark.")] = None
    events: Annotated[
        Annotated[list[_Text], Meta(max_length=MOST_OF_CONTEXT)] | None,
        Meta(description="What happened at the part or before it, such as a change of the tool."),
    ] = None
    process: Annotated[
        Annotated[dict[_Text, _Number], Meta(max_length=MOST_OF_CONTEXT)] | None,
        Meta(description="Process parameters by name, with their unit in the name: a pressure, a spindle speed."),
    ] = None
    part_temperature: Annotated[
        _Number | None,
        Meta(
            description="Temperature of the part when it was measured, °C. One that cannot be true is stored as it is sent, and not "
            "used: no reading is refused for a broken sensor. Nothing is decided by it."
        ),
    ] = None
    machine_temperature: Annotated[
        _Number | None,
        Meta(description="Temperature of the machine, at its scale or its frame, °C; as `part_temperature`."),
    ] = None
    fields: Annotated[
        Annotated[
            dict[Annotated[str, Meta(pattern=r"^K00[0-9]{2}$")], _Comment],
            Meta(max_length=MOST_OF_CONTEXT),
        ]
        | None,
        Meta(description="Further fields of a value in an AQDEF file, by their K number."),
    ] = None


class ReadingIn(Struct, forbid_unknown_fields=True, gc=False):
    """One reading as it is sent. Lengths in mm, times RFC 3339 with an offset."""

    characteristic: Annotated[str, Meta(min_length=1, max_length=64, description="The key of the characteristic.")]
    measured: Annotated[Length | None, Meta(description="The size, mm.")] = None
    touches: Annotated[
        Annotated[
            list[Annotated[list[Length | None], Meta(max_length=MOST_REPEATS)] | None], Meta(max_length=MOST_POINTS)
        ]
        | None,
        Meta(
            description="In place of measured: one list per point (R23), each with its repeats (R27). null is a "
            "touch that is missing. A missing touch, or one outside ±a (R28), makes a probe fault of the reading: it is stored, "
            "raises the alarm, and the answer is `stop`. More points or repeats than there can be are refused."
        ),
    ] = None
    measured_at: Annotated[Moment | None, Meta(description="When it was measured; if left out, when it came in.")] = (
        None
    )
    machined_at: Annotated[
        Moment | None,
        Meta(
            description="When the part was cut: in place of correction_in_effect, if the machine knows only the time."
        ),
    ] = None
    part: Annotated[
        Annotated[str, Meta(min_length=1, max_length=128)] | None, Meta(description="Serial number of the part.")
    ] = None
    key: Annotated[
        Annotated[str, Meta(min_length=1, max_length=128)] | None,
        Meta(
            description="Yours, unique per characteristic: sent again, you get the first answer and nothing happens twice."
        ),
    ] = None
    correction_in_effect: Annotated[
        Annotated[int, Meta(ge=0, le=2_147_483_647)] | None,
        Meta(
            description="Number of the last correction the machine had applied when it cut this part; 0 for none. "
            "It also confirms the pending ones up to it."
        ),
    ] = None
    first_move_triggered: Annotated[
        bool,
        Meta(
            description="true: the probe triggered on its first move, where there should have been air (no bore, a chip, a "
            "wrong part). measured is then the position where it did, and may be left out; it is judged a probe fault whatever its "
            "value."
        ),
    ] = False
    context: Annotated[Context | None, Meta(description="Its circumstances: order, batch, nest, events and more.")] = (
        None
    )

    @property
    def is_by_hand(self) -> bool:
        """Tell if a person measured it, with a gauge that does not read what the probe reads too much."""
        return self.context is not None and bool(self.context.by_hand)


FIELDS = ReadingIn.__struct_fields__
_one = msgspec.json.Decoder(ReadingIn)
_many = msgspec.json.Decoder(list[ReadingIn])
_raw = msgspec.json.Decoder(list[msgspec.Raw])


def decode_one(body: bytes, now: datetime) -> ReadingIn:
    """The reading in a body. Raises `Invalid`."""
    try:
        reading = _one.decode(body)
    except (msgspec.MsgspecError, UnicodeDecodeError):
        reading = _retry(_loads(body), "")
    else:
        if body.count(b'"') != _quotes(reading):
            _loads(body)
    if not _plain(reading, now + AHEAD) and (errors := list(_sense(reading, now, ""))):
        raise _invalid(errors)
    return reading


def reading_of(fields: dict[str, Any], now: datetime) -> ReadingIn:
    """The reading of history that these fields make, out of a file; times may be datetimes, from 1900 on. Raises `Invalid`."""
    try:
        reading = msgspec.convert(fields, ReadingIn)
    except msgspec.ValidationError:
        written = {n: v.isoformat() if isinstance(v, datetime) else v for n, v in fields.items()}
        reading = _retry(written, "")
    if not _plain(reading, now + AHEAD) and (errors := list(_sense(reading, now, "", HISTORY_BEGINS))):
        raise _invalid(errors)
    return reading


def decode_many(body: bytes, now: datetime, *, lines: bool) -> list[ReadingIn]:
    """The readings in a JSON list, or one per line of NDJSON. Raises `Invalid` with what is wrong, by position."""
    try:
        readings = _one.decode_lines(body) if lines else _many.decode(body)
    except (msgspec.MsgspecError, UnicodeDecodeError):
        readings = _retry_many(body, lines=lines)
    else:
        if body.count(b'"') != sum(map(_quotes, readings)):
            _load_many(body, lines=lines)
    latest = now + AHEAD
    if _all_plain(readings, latest):
        return readings
    errors = [
        error
        for at, reading in enumerate(readings)
        if not _plain(reading, latest)
        for error in _sense(reading, now, f"[{at}].")
    ]
    if errors:
        raise _invalid(errors)
    return readings


def _quotes(reading: ReadingIn) -> int:
    """Return the number of quotation marks that a reading is written with, if each field is there once and no text holds any.

    msgspec takes the last of two fields of one name. A second one brings quotation marks of its own, so a body with
    another number of them is looked at by the reader that refuses it; one with as many has none. A context always brings more.
    """
    return 4 + 2 * (
        (reading.measured is not None)
        + (reading.touches is not None)
        + (reading.correction_in_effect is not None)
        + reading.first_move_triggered
        + 2
        * (
            (reading.key is not None)
            + (reading.part is not None)
            + (reading.measured_at is not None)
            + (reading.machined_at is not None)
        )
    )


def _retry(value: Any, prefix: str) -> ReadingIn:
    errors = list(_field_errors(value, prefix))
    if errors:
        raise _invalid(errors)
    try:
        return msgspec.convert(value, ReadingIn)
    except msgspec.ValidationError as error:
        raise _invalid([FieldError(prefix.rstrip("."), str(error))]) from None


def _load_many(body: bytes, *, lines: bool) -> list[Any]:
    if lines:
        filled = (line for line in body.splitlines() if line.strip())
        return [_loads(line, f"[{at}]") for at, line in enumerate(filled)]
    try:
        return [_loads(bytes(value), f"[{at}]") for at, value in enumerate(_raw.decode(body))]
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        values = _loads(body)  # takes NaN, so that its field can be named
    if not isinstance(values, list):
        raise _invalid([FieldError("", _("A batch is a JSON list of readings, or NDJSON with one reading per line."))])
    return values


def _retry_many(body: bytes, *, lines: bool) -> list[ReadingIn]:
    values = _load_many(body, lines=lines)
    errors: list[FieldError] = []
    for at, value in enumerate(values):
        errors.extend(_field_errors(value, f"[{at}]."))
        if len(errors) >= MOST_ERRORS:
            break
    if errors:
        raise _invalid(errors)
    return [_retry(value, f"[{at}].") for at, value in enumerate(values)]


MOST_ERRORS = 100


def _invalid(errors: list[FieldError]) -> Invalid:
    shown = errors[:MOST_ERRORS]
    return Invalid(
        shown[0].message if len(errors) == 1 else _("%(count)s things are wrong with it.") % {"count": len(errors)},
        _("Correct what is named under errors and send it again. Nothing of this request was stored."),
        errors=shown,
    )


def _loads(body: bytes, where: str = "") -> Any:
    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        made: dict[str, Any] = {}
        for name, value in pairs:
            if name in made:
                raise _invalid(
                    [FieldError(f"{where}.{name}".lstrip("."), _("This field is there twice; send it once."))]
                )
            made[name] = value
        return made

    try:
        return json.loads(body, object_pairs_hook=once)
    except UnicodeDecodeError:
        message = _("This is not UTF-8 text. Send JSON encoded as UTF-8.")
    except RecursionError:
        message = _("This is nested too deeply to be a reading.")
    except json.JSONDecodeError as error:
        message = (
            _("This is not JSON: %(error)s.") % {"error": error}
            if body.strip()
            else _("Nothing was sent. Send the reading as JSON.")
        )
    except ValueError:  # Python reads no whole number of thousands of digits
        message = _("This holds a number of thousands of digits.")
    raise _invalid([FieldError(where, message)])


def clean_text(value: str) -> bool:
    """Tell if a text can be stored: no control characters, no half surrogates."""
    return value.isprintable() or not any(c < " " or c == "\x7f" or "\ud800" <= c <= "\udfff" for c in value)


def _plain(reading: ReadingIn, latest: datetime) -> bool:
    """Tell if it is plain at a glance that `_sense` has nothing to say, as of nearly all readings."""
    measured_at, key, part = reading.measured_at, reading.key, reading.part
    return (
        reading.measured is not None
        and reading.touches is None
        and reading.machined_at is None
        and reading.context is None
        and (measured_at is None or EARLIEST <= measured_at <= latest)
        and reading.characteristic.isprintable()
        and (key is None or key.isprintable())
        and (part is None or part.isprintable())
    )


def _all_plain(readings: list[ReadingIn], latest: datetime) -> bool:
    """Tell if `_plain` holds for all of them, in a third of the time."""
    texts = [text for r in readings for text in (r.key, r.part) if text is not None]
    times = [reading.measured_at for reading in readings if reading.measured_at is not None]
    return (
        "".join(texts).isprintable()
        and "".join({reading.characteristic for reading in readings}).isprintable()
        and (not times or (min(times) >= EARLIEST and max(times) <= latest))
        and all(
            r.measured is not None and r.touches is None and r.machined_at is None and r.context is None
            for r in readings
        )
    )


def _sense(reading: ReadingIn, now: datetime, prefix: str, earliest: datetime = EARLIEST) -> Iterator[FieldError]:
    """Check what the types alone cannot say."""
    if (reading.measured is None) == (reading.touches is None) and not (
        reading.first_move_triggered and reading.measured is None
    ):
        message = (
            _("A reading needs measured (mm), or touches in its place.")
            if reading.measured is None
            else _("Send measured or touches, not both: the value is made of the touches.")
        )
        yield FieldError(f"{prefix}measured", message)
    for name in ("characteristic", "part", "key"):
        value = getattr(reading, name)
        if value is not None and not value.isprintable() and not clean_text(value):
            yield FieldError(
                f"{prefix}{name}", _("This text holds control characters; send letters, digits and signs only.")
            )
    if reading.context is not None and not all(map(clean_text, _texts(reading.context))):
        yield FieldError(
            f"{prefix}context", _("This text holds control characters; send letters, digits and signs only.")
        )
    for name in ("measured_at", "machined_at"):
        if (moment := getattr(reading, name)) is None:
            continue
        if moment > now + AHEAD:
            yield FieldError(
                f"{prefix}{name}",
                _(
                    "%(time)s is more than a day ahead of the server's clock. Check the machine's clock and the unit of the time."
                )
                % {"time": moment.isoformat()},
            )
        elif moment < earliest:
            yield FieldError(
                f"{prefix}{name}",
                _("%(time)s lies before the year %(year)s. Check the machine's clock and the unit of the time.")
                % {"time": moment.isoformat(), "year": earliest.year},
            )
    cut = reading.machined_at if reading.correction_in_effect is None else None  # the number wins
    if cut and now + MACHINED_AHEAD < cut <= now + AHEAD:
        message = _("%(time)s is ahead of the server's clock. Set the machine's clock, or send correction_in_effect.")
        yield FieldError(f"{prefix}machined_at", message % {"time": cut.isoformat()})
    elif reading.measured_at and reading.machined_at and reading.machined_at > reading.measured_at:
        yield FieldError(
            f"{prefix}machined_at",
            _("A part cannot be measured before it is machined: machined_at lies after measured_at."),
        )


def _texts(context: Context) -> Iterator[str]:
    for value in msgspec.structs.astuple(context):
        if isinstance(value, str):
            yield value
        elif isinstance(value, list | dict):
            yield from value
    yield from (context.fields or {}).values()


def _context(value: Any) -> str | None:
    if not isinstance(value, dict):
        return _("A context is a JSON object, such as {example}.").format(example='{"order": "A-77", "nest": 2}')
    names = Context.__struct_fields__
    if unknown := [name for name in value if name not in names]:
        return _("There is no {name} in a context; there are: {names}.").format(
            name=repr(unknown[0]), names=", ".join(names)
        )
    for name, each in value.items():
        try:
            msgspec.convert({name: each}, Context)
        except msgspec.ValidationError:
            return _("{name} is not right: {must}.").format(name=name, must=_MUST[name]())
    return None


def _short_text() -> str:
    return _("a text of 1 to 128 characters")


_MUST: dict[str, Callable[[], str]] = dict.fromkeys(
    ("order", "batch", "spindle", "fixture", "program", "operator", "machine", "gauge"), _short_text
) | {
    "nest": lambda: _("a whole number from 0 to 999999"),
    "by_hand": lambda: _("true or false, without quotes"),
    "comment": lambda: _("a text of 1 to {most} characters").format(most=LONGEST_COMMENT),
    "events": lambda: _("a list of at most {most} texts").format(most=MOST_OF_CONTEXT),
    "process": lambda: _("an object of at most {most} numbers by name").format(most=MOST_OF_CONTEXT),
    "part_temperature": lambda: _("a number in °C, without quotes"),
    "machine_temperature": lambda: _("a number in °C, without quotes"),
    "fields": lambda: _("an object of texts by field, K0009 for example"),
}


def _number(value: Any) -> str | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return _("This must be a number in mm, such as 39.9981 (a decimal point, no unit, no quotes).")
    if isinstance(value, float) and not isfinite(value):
        return _("This is not a finite number. Of a probe that did not trigger send touches, with null for the touch.")
    if abs(value) > LARGEST_LENGTH:
        return _("%(value)g mm is longer than any machine. Lengths are in mm, not in µm or nm.") % {
            "value": float(value) if abs(value) < 1e300 else float("inf")
        }
    return None


def _time(value: Any) -> str | None:
    if isinstance(value, bool) or not isinstance(value, str):
        return _(
            "A time is RFC 3339 text with an offset, such as 2026-11-21T08:15:02.120+01:00, not a count of (milli)seconds."
        )
    try:
        msgspec.convert(value, Moment)
    except (msgspec.ValidationError, UnicodeEncodeError):
        return _("This is not a time with an offset; write it as 2026-11-21T08:15:02.120+01:00 or …Z.")
    return None


def _text(limit: int) -> Callable[[Any], str | None]:
    def check(value: Any) -> str | None:
        if not isinstance(value, str):
            return _("This must be text in quotes.")
        if not 1 <= len(value) <= limit:
            return _("This text must have 1 to %(limit)s characters; it has %(got)s.") % {
                "limit": limit,
                "got": len(value),
            }
        if not clean_text(value):
            return _("This text holds control characters; send letters, digits and signs only.")
        return None

    return check


def _touches(value: Any) -> str | None:
    if not isinstance(value, list) or not all(point is None or isinstance(point, list) for point in value):
        return _("Touches are one list per point, each with its repeats: [[39.998, 39.9982], [39.9979, 39.9981]].")
    if len(value) > MOST_POINTS or any(len(point or ()) > MOST_REPEATS for point in value):
        return _("No more than %(points)s points with %(repeats)s repeats each.") % {
            "points": MOST_POINTS,
            "repeats": MOST_REPEATS,
        }
    for at, point in enumerate(value, start=1):
        for repeat, touch in enumerate(point or (), start=1):
            if touch is not None and (problem := _number(touch)):
                return _("Point %(point)s, repeat %(repeat)s: %(problem)s") % {
                    "point": at,
                    "repeat": repeat,
                    "problem": problem,
                }
    return None


def _correction_number(value: Any) -> str | None:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= 2_147_483_647:
        return _("This is the number of the last correction the machine had applied: a whole number, 0 for none yet.")
    return None


def _yes_or_no(value: Any) -> str | None:
    return None if isinstance(value, bool) else _("This must be true or false, without quotes.")


_CHECKS: dict[str, Callable[[Any], str | None]] = {
    "characteristic": _text(64),
    "measured": _number,
    "touches": _touches,
    "measured_at": _time,
    "machined_at": _time,
    "part": _text(128),
    "key": _text(128),
    "correction_in_effect": _correction_number,
    "first_move_triggered": _yes_or_no,
    "context": _context,
}


def _field_errors(value: Any, prefix: str) -> Iterator[FieldError]:
    """Everything that is wrong with the fields of one reading that msgspec refused."""
    if not isinstance(value, dict):
        yield FieldError(prefix.rstrip("."), _("A reading is a JSON object with characteristic and measured."))
        return
    for name in value:
        if name not in _CHECKS:
            yield FieldError(
                f"{prefix}{name}",
                _("There is no such field in a reading; there are: %(fields)s.") % {"fields": ", ".join(FIELDS)},
            )
    if "characteristic" not in value or value["characteristic"] is None:
        yield FieldError(f"{prefix}characteristic", _("Name the characteristic that was measured."))
    for name, check in _CHECKS.items():
        if value.get(name) is not None and (problem := check(value[name])):
            yield FieldError(f"{prefix}{name}", problem)
