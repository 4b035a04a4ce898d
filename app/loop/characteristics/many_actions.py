"""One parameter of many characteristics changed together, and a machine set up like another one."""

from collections.abc import Collection, Mapping, Sequence
from itertools import count
from typing import Any, NamedTuple

from sqlalchemy.orm import Session

from app.core.parameters import BY_NAME, FIELDS, Field, read
from app.errors import FieldError, InbandError, Invalid
from app.language.i18n import _
from app.loop.characteristics import actions, queries, wording
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.characteristics.schemas import CharacteristicChange, CharacteristicIn
from app.loop.machines import actions as machine_actions
from app.loop.machines import queries as machines
from app.loop.machines.actions import MachineIn
from app.loop.tables.machines import Machine
from app.web.forms import parsed

OF_ONE = {"nominal", "upper_deviation", "lower_deviation", "target", "tolerance_width"}  # each drawing has its own
LIMITS = {
    "zero_range",
    "averaging_limit",
    "wear_limit",
    "confidence_limit",
    "max_step",
    "max_total",
    "plausible_jump",
}


def changeable() -> list[Field]:
    """The parameters that several characteristics can have in common."""
    return [field for field in FIELDS if field.name not in OF_ONE]


class NewValue(NamedTuple):
    """A parameter and its new value; share: the value is a percentage of each one's tolerance width (R35)."""

    name: str
    value: Any
    share: bool = False

    def of(self, current: CurrentCharacteristic) -> Any:
        """The value for one characteristic; lengths in mm."""
        if not self.share or isinstance(self.value, bool) or not isinstance(self.value, int | float):
            return self.value
        return round(current.parameters.tolerance_width * self.value / 100, 9)


class PlannedChange(NamedTuple):
    """The change of one characteristic, worded; errors: the reasons why it cannot be made."""

    current: CurrentCharacteristic
    before: str
    after: str
    errors: list[str]

    @property
    def is_same(self) -> bool:
        return not self.errors and self.before == self.after


def worded_now(current: CurrentCharacteristic, name: str) -> str:
    """A parameter in force, in words."""
    return wording.worded(name, current.version.parameters)


def planned(currents: Sequence[CurrentCharacteristic], new: NewValue) -> list[PlannedChange]:
    """The changes that a new value comes to. Stores nothing."""
    return [_planned(current, new) for current in currents]


def _planned(current: CurrentCharacteristic, new: NewValue) -> PlannedChange:
    present = current.version.parameters
    changed = actions.merged(present, {new.name: new.of(current)})
    errors = [error.message for error in actions.refusals(changed, current.machine)]
    value = None if errors else getattr(read(changed)[0], new.name)
    after = "–" if errors else wording.worded(new.name, present | {new.name: value})
    return PlannedChange(current, worded_now(current, new.name), after, errors)


def change_many(session: Session, versions: Mapping[str, int], new: NewValue, reason: str, actor: str) -> int:
    """Give characteristics (by key, with the version that was looked at) the new value, all of them or none.

    Returns the number that was changed. Raises `NotFound`, `Invalid`, and `Conflict` where a person has changed the
    parameters meanwhile; each names the characteristic.
    """
    if new.name in OF_ONE or new.name not in BY_NAME:
        raise Invalid.at("parameter", _("Choose a parameter that several characteristics can have in common."))
    currents = [queries.characteristic_named(session, key) for key in sorted(versions)]
    changed = 0
    with session.begin_nested():  # all or none
        machines.lock_machines(session, [current.machine.id for current in currents])
        for current in currents:
            key = current.characteristic.key
            change = CharacteristicChange(
                parameters={new.name: new.of(current)}, parameters_version=versions[key], reason=reason or None
            )
            try:
                after = actions.change_characteristic(session, key, change, actor)
            except InbandError as error:
                error.detail = f"{key}: {error.detail}"
                raise
            changed += after.version.version != versions[key]
    return changed


def copy_machine(session: Session, source: Machine, given: MachineIn, keys: Mapping[str, str], actor: str) -> Machine:
    """Set up a machine like another one, with the characteristics that are named: their key there to their key here.

    Settings and parameters are copied; offsets, averages, readings, empirical values and keys belong to the one machine.
    Raises `Conflict` for a machine that is there; `Invalid` with everything that is wrong with the characteristics.
    """
    settings = {name: getattr(source, name) for name in MachineIn.model_fields}
    with session.begin_nested():  # all or none
        created = machine_actions.add_machine(
            session, MachineIn(**settings | given.model_dump(exclude_unset=True)), actor
        )
        there = {
            current.characteristic.key: current for current in queries.characteristics(session, machine_id=source.id)
        }
        wrong = [_("{key} is not on {machine}").format(key=key, machine=source.key) for key in keys if key not in there]
        for key, new_key in sorted(
            keys.items(), key=lambda pair: pair[0] in there and there[pair[0]].source is not None
        ):
            if key in there:  # what is probed before its form
                wrong += _copy(session, there[key], new_key, created, actor, keys.get(there[key].source or ""))
        if wrong:
            raise Invalid(
                _("The machine was not copied."), errors=[FieldError("characteristics", each) for each in wrong]
            )
    return created


def _copy(
    session: Session, current: CurrentCharacteristic, key: str, machine: Machine, actor: str, source: str | None
) -> list[str]:
    """Set up a characteristic like this one on another machine; the errors, if it cannot be. source: as whose form."""
    like = current.characteristic
    wanted: dict[str, Any] = {"key": key, "name": like.name, "part": like.part, "machine": machine.key}
    if source is not None:
        wanted["form_of"] = {"characteristic": source, "result": like.form}
    try:
        actions.add_characteristic(
            session, parsed(CharacteristicIn, wanted | {"parameters": _as_given(current)}), actor
        )
    except InbandError as error:
        return [f"“{key}” {message}" for _field, message in error.errors]
    return []


def next_number(key: str, taken: Collection[str]) -> tuple[int, str]:
    """The first free number, and the key with it in place of its own.

    >>> next_number("lathe-1", {"lathe-1", "lathe-2"}), next_number("lathe", {"lathe"})
    ((3, 'lathe-3'), (2, 'lathe-2'))
    """
    stem, _dash, last = key.rpartition("-")
    first, stem = (int(last) + 1, stem) if stem and last.isdecimal() and len(last) < 6 else (2, key)
    return next((number, f"{stem}-{number}") for number in count(first) if f"{stem}-{number}" not in taken)


def key_like(key: str, machine: str, new_machine: str, number: int) -> str:
    """The key of a copied characteristic: with the new machine's key in it, or the number behind it.

    >>> key_like("lathe-1-d40", "lathe-1", "lathe-2", 2), key_like("shaft-d40", "lathe-1", "lathe-2", 2)
    ('lathe-2-d40', 'shaft-d40-2')
    """
    return key.replace(machine, new_machine) if machine in key else f"{key}-{number}"


def copied_keys(text: str) -> dict[str, str]:
    """The lines `key at the copied machine = new key`. Raises `Invalid` for a line that is none, and for a key that stands twice.

    >>> copied_keys("shaft-d40 = shaft-d40-2")
    {'shaft-d40': 'shaft-d40-2'}
    """
    keys: dict[str, str] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        there, _sign, here = (part.strip() for part in line.partition("="))
        if (there or here) and not (there and here):
            raise Invalid.at(
                "characteristics", _("line {n} must be: key at the copied machine = new key").format(n=number)
            )
        if there in keys:
            raise Invalid.at("characteristics", _("line {n} names {key} again").format(n=number, key=there))
        if there:
            keys[there] = here
    return keys


def _as_given(current: CurrentCharacteristic) -> dict[str, Any]:
    """The parameters as they were said: where the drawing was, target and width follow from it."""
    parameters = dict(current.version.parameters)
    drop = (
        ("target", "tolerance_width")
        if parameters.get("nominal") is not None
        else OF_ONE - {"target", "tolerance_width"}
    )
    return {name: value for name, value in parameters.items() if name not in drop}
