"""Setting up characteristics and changing their parameters. A change makes a new version; none is ever altered."""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from app.access.audit.actions import record
from app.core.decision.decide import voids_corrections
from app.core.decision.limits import nanometres
from app.core.fits import with_fit
from app.core.natural_limit import target_of
from app.core.parameters import (
    BY_R,
    TWO_POINT_SWITCH,
    Feature,
    ParameterError,
    Parameters,
    Problem,
    Variant,
    default_averaging_limit,
    read,
    without_location,
)
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics import form_actions, queries, wording
from app.loop.characteristics.correction_actions import supersede
from app.loop.characteristics.correction_queries import correction_changed, open_corrections
from app.loop.characteristics.form_actions import parameters_of_form, refused_for_form
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.characteristics.schemas import CharacteristicChange, CharacteristicIn, warnings_of
from app.loop.machines import queries as machines
from app.loop.tables.characteristics import Characteristic, ParametersVersion
from app.loop.tables.machines import Machine
from app.loop.tables.readings import Stream
from app.loop.tables.tools import AverageMemory, Tool

__all__ = [
    "CharacteristicChange",
    "CharacteristicIn",
    "add_characteristic",
    "change_characteristic",
    "merged",
    "refusals",
    "warnings_of",
]

DRAWING = ("nominal", "upper_deviation", "lower_deviation")
TARGET = ("target", "tolerance_width")
OF_LEVEL = ("target", "factor", "tool_memory", "average_memory", "plausible_jump")


def add_characteristic(session: Session, given: CharacteristicIn, actor: str) -> CurrentCharacteristic:
    """Set up a characteristic with version 1 of its parameters.

    Raises `Invalid` for parameters that cannot be used or a machine that is not there, `Conflict` for a taken key.
    """
    machine = machines.find_machine(session, given.machine)
    if machine is None:
        raise Invalid.at(
            "machine", _("There is no machine {key}; set it up first").format(key=repr(given.machine[:64]))
        )
    if queries.key_is_taken(session, given.key):
        raise Conflict(
            _("There is a characteristic {key} already.").format(key=repr(given.key)),
            _("Choose another key, or change the characteristic that is there."),
            errors=[FieldError("key", _("is taken"))],
        )
    source = form_actions.source_of(session, machine, given.form_of) if given.form_of is not None else None
    parameters = _read(given.parameters if source is None else parameters_of_form(given.parameters), machine)
    errors = contested(session, machine, given.key, parameters)
    if errors or (source is not None and (errors := refused_for_form(parameters))):
        raise _refused(errors)
    new = Characteristic(machine_id=machine.id, key=given.key, name=given.name, part=given.part, unit=given.unit)
    if source is not None and given.form_of is not None:
        new.form_of, new.form = source.id, given.form_of.result.value
    session.add(new)
    session.flush()
    version = _new_version(new, 1, parameters, actor, None)
    session.add(version)
    session.flush()
    session.add(
        Stream(
            machine_id=machine.id,
            characteristic_id=new.id,
            parameters_version=1,
            tool_memory=parameters.tool_memory,
            average_memory=parameters.average_memory,
        )
    )
    after = given.model_dump(exclude={"parameters"}) | {"parameters": parameters.as_dict()}
    record(session, actor, "characteristic added", f"characteristic/{new.key}", None, after)
    publish(session, {"kind": "characteristic", "machine": machine.key, "characteristic": new.key})
    return queries.characteristic_named(session, new.key)


def change_characteristic(
    session: Session, key: str, change: CharacteristicChange, actor: str
) -> CurrentCharacteristic:
    """Change its name or part, or make a new version of its parameters.

    Raises `NotFound`; `Invalid`, also for a change of parameters without a reason; `Conflict` when someone else has
    changed the parameters since ``parameters_version``.
    """
    current = queries.characteristic_named(session, key)
    _refuse_moving(current, change)
    changes: list[dict[str, Any]] = []
    if change.parameters is not None or change.parameters_version is not None:
        machines.lock_machines(session, [current.machine.id])
        session.expire_all()  # what was read before the lock may have changed while waiting for it
        current = queries.characteristic_named(session, key)
        _refuse_stale(current, change.parameters_version)
    if change.parameters is not None:
        current, changes = _change_parameters(session, current, change.parameters, change.reason, actor)
    names = change.model_dump(include={"name", "part"}, exclude_unset=True)
    if names.get("name", "") is None:
        del names["name"]
    before = {name: getattr(current.characteristic, name) for name in names}
    if names != before:
        for name, value in names.items():
            setattr(current.characteristic, name, value)
        record(session, actor, "characteristic changed", f"characteristic/{key}", before, names, change.reason)
        changes = changes or [_changed(current)]
    if changes:
        publish(session, *changes)
    return current


def merged(current: Mapping[str, Any], given: Mapping[str, Any]) -> dict[str, Any]:
    """The current set with what was given in its place, for `read`.

    Nominal with deviations, or target with width: what is given replaces what was said the other way. R34 at its default
    follows R35. Another natural limit moves the target, the limits stay.
    """
    changed = dict(current)
    given = {  # R24 = 0 leaves the other variants as they are
        raw: value
        for raw, value in with_fit(given).items()
        if raw.upper() != TWO_POINT_SWITCH or value not in (0, None) or current.get("variant") == Variant.TWO_POINT
    }
    names = {raw: _name_of(raw) for raw in given}
    named = {names[raw] for raw, value in given.items() if value is not None}
    if named & set(DRAWING):
        drop: tuple[str, ...] = TARGET
    elif named & set(TARGET):
        drop = DRAWING
    elif "natural_limit" in names.values():
        drop = ("target",)
        if current.get("nominal") is None:
            given = {"target": _target_for(given, Parameters.from_dict(current)), **given}
    else:
        drop = ()
    if changed.get("averaging_limit") == default_averaging_limit(
        current["tolerance_width"], current.get("natural_limit")
    ):
        drop = (*drop, "averaging_limit")  # it was left to follow the tolerance, and goes on following it
    for name in (*drop, *names.values()):
        changed.pop(name, None)
    return changed | given


def _target_for(given: Mapping[str, Any], current: Parameters) -> float:
    """The target of the same limits with the natural limit that is given."""
    lower, upper = current.sizes
    return target_of(0.0, upper, lower, given.get("natural_limit"))


def _name_of(raw: str) -> str:
    return "variant" if raw.upper() == TWO_POINT_SWITCH else BY_R.get(raw.upper(), raw)


def refusals(given: Mapping[str, Any], machine: Machine | None = None) -> list[FieldError]:
    """Everything that is wrong with a whole set of parameters on this machine; nothing if it can be used."""
    problems = without_location(given, machine.tool_locations, machine.average_locations) if machine is not None else []
    try:
        read(given)
    except ParameterError as error:
        problems = [*error.problems, *problems]
    return wording.field_errors(problems)


def contested(session: Session, machine: Machine, key: str, parameters: Parameters) -> list[FieldError]:
    """The error of a tool whose offset parts and its own size would correct, by turns: each would undo what the other did.

    The size of a tool is compared with the sum of all its corrections, so that of another characteristic would be taken back.
    """
    if parameters.measures_only:
        return []
    for other in queries.correcting(session, machine.id, parameters.tool_memory):
        if other.characteristic.key != key and Feature.TOOL in {parameters.feature, other.parameters.feature}:
            return wording.field_errors(
                [
                    Problem(
                        "tool_memory", "contested", {"tool": parameters.tool_memory, "other": other.characteristic.key}
                    )
                ]
            )
    return []


def _read(given: Mapping[str, Any], machine: Machine) -> Parameters:
    """Raises `Invalid` with everything that is wrong at once."""
    errors = refusals(given, machine)
    if errors:
        raise _refused(errors)
    return read(given)[0]


def _refused(errors: list[FieldError]) -> Invalid:
    return Invalid.of(errors, _("Correct the named fields and send them again; nothing was changed."), said=3)


def _refuse_moving(current: CurrentCharacteristic, change: CharacteristicChange) -> None:
    errors = []
    if change.key not in {None, current.characteristic.key}:
        errors.append(FieldError("key", _("cannot be changed: readings and programs call the characteristic by it")))
    if change.machine not in {None, current.machine.key}:
        errors.append(
            FieldError(
                "machine", _("cannot be changed: the readings belong to it. Set up a new characteristic instead")
            )
        )
    if errors:
        raise Invalid.of(errors)


def _refuse_stale(current: CurrentCharacteristic, expected: int | None) -> None:
    version = current.version
    if expected is not None and expected != version.version:
        raise Conflict(
            _("{who} has changed the parameters meanwhile: version {now} is in force, you looked at {then}.").format(
                who=version.created_by, now=version.version, then=expected
            ),
            _("Look at the new version, then repeat your change."),
            parameters_version=version.version,
        )


def _change_parameters(
    session: Session, current: CurrentCharacteristic, given: Mapping[str, Any], reason: str | None, actor: str
) -> tuple[CurrentCharacteristic, list[dict[str, Any]]]:
    """Under the machine's lock. Returns the state now, and what to tell everybody."""
    characteristic, machine, version, *_more = current
    changed = merged(version.parameters, given)
    errors = refusals(changed, machine)
    old, new = current.parameters, None if errors else read(changed)[0]
    if new == old:
        return current, []
    if new is not None:
        errors += contested(session, machine, characteristic.key, new)
        errors += [] if characteristic.form is None else refused_for_form(new)
    if not reason:
        wrong = _("is required when parameters change: say why, for those who read it in a year")
        errors.append(FieldError("reason", wrong))
    if errors or new is None or not reason:
        raise _refused(errors)
    new_version = _new_version(characteristic, version.version + 1, new, actor, reason)
    session.add(new_version)
    session.flush()
    values: dict[str, Any] = {
        "parameters_version": new_version.version,
        "tool_memory": new.tool_memory,
        "average_memory": new.average_memory,
    }
    other_tool = new.tool_memory != old.tool_memory
    parts = queries.parts_cut(session, machine.id, old.tool_memory) if other_tool else 0
    if other_tool:
        values["sequence_at_tool_change"] = Stream.sequence  # parts cut with the other tool are not this one's
    if any(getattr(new, name) != getattr(old, name) for name in OF_LEVEL):
        # What was expected was expected under the old ones.
        values |= {"level": None, "level_sequence": None, "gain_from": Stream.sequence}
    session.execute(
        update(Stream)
        .where(Stream.machine_id == machine.id, Stream.characteristic_id == characteristic.id)
        .values(values)
        .execution_options(synchronize_session=False)
    )
    if other_tool:
        _keep_parts(session, machine.id, old.tool_memory, parts)
    now = current._replace(version=new_version)
    changes = [_changed(now)]
    if (other_tool or nanometres(new.target) != nanometres(old.target)) and new.average_memory:
        _restart_average(session, machine.id, new.average_memory)
        changes.append({"kind": "average", "machine": machine.key, "average_memory": new.average_memory})
    before, after = _differences(old.as_dict(), new.as_dict())
    if voids_corrections(old, new) or _another_empirical_value(session, machine.id, old, new):
        fallen = supersede(
            session,
            open_corrections(session, machine, characteristic=characteristic),
            new_version.created_at,
            actor,
            reason,
        )
        changes += [correction_changed(session, machine, correction) for correction in fallen]
        after |= {"superseded": [correction.number for correction in fallen]} if fallen else {}
    record(session, actor, "parameters changed", f"characteristic/{characteristic.key}", before, after, reason)
    return now, changes


def _another_empirical_value(session: Session, machine_id: int, old: Parameters, new: Parameters) -> bool:
    """Tell if another location R11 takes another empirical value off: what the probe read too much is in corrections."""
    if old.average_memory == new.average_memory:
        return False
    locations = (old.average_memory, new.average_memory)
    values = session.scalars(
        select(AverageMemory.empirical_value).where(
            AverageMemory.machine_id == machine_id, AverageMemory.location.in_(locations)
        )
    ).all()
    nothing = [0.0] * (len(locations) - len(values))  # R11 = 0, or a location that was never used
    return len({nanometres(value) for value in (*values, *nothing)}) > 1


def _keep_parts(session: Session, machine_id: int, tool_memory: int, parts: int) -> None:
    """The tool that a characteristic has left has cut these parts, although nobody counts them on it any more."""
    lost = parts - queries.parts_cut(session, machine_id, tool_memory)
    session.execute(
        update(Tool)
        .where(Tool.machine_id == machine_id, Tool.number == tool_memory)
        .values(parts_kept=Tool.parts_kept + lost)
        .execution_options(synchronize_session=False)
    )


def _restart_average(session: Session, machine_id: int, location: int) -> None:
    """M was the average about another target, or of another tool: it begins again at 0."""
    session.execute(
        update(AverageMemory)
        .where(AverageMemory.machine_id == machine_id, AverageMemory.location == location)
        .values(average=0.0, updated_at=func.now())
        .execution_options(synchronize_session=False)
    )


def _new_version(
    characteristic: Characteristic, number: int, parameters: Parameters, actor: str, reason: str | None
) -> ParametersVersion:
    return ParametersVersion(
        machine_id=characteristic.machine_id,
        characteristic_id=characteristic.id,
        version=number,
        parameters=parameters.as_dict(),
        created_by=actor,
        reason=reason,
    )


def _changed(current: CurrentCharacteristic) -> dict[str, Any]:
    return {
        "kind": "characteristic",
        "machine": current.machine.key,
        "characteristic": current.characteristic.key,
    }


def _differences(old: dict[str, Any], new: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    names = [name for name in new if old.get(name) != new[name]]
    return {name: old.get(name) for name in names}, {name: new[name] for name in names}
