"""Aligning, composing pallets with parts, computing again, acknowledging warnings. Lengths in mm, angles in degrees."""

from datetime import UTC, datetime

import numpy as np
from sqlalchemy.orm import Session

from app.access.audit.actions import record as audit
from app.access.callers import Caller
from app.core.geometry.frames import frame, from_angles, on_pallet
from app.core.geometry.layout import MOTIONS
from app.core.geometry.plausible import motion_warnings
from app.core.programs.frames import offset_of
from app.core.warning import CodedWarning, as_stored
from app.db.events import publish
from app.errors import Conflict, Invalid
from app.geometry.alignment import queries
from app.geometry.alignment.evaluation import NEEDS, Values, frame_values, middle_of, solved, warnings_of
from app.geometry.alignment.queries import subject_of
from app.geometry.alignment.schemas import AlignmentIn, AlignmentRecomputeIn, PalletIn
from app.geometry.alignment.tables import Alignment
from app.language.i18n import _
from app.loop.machines.queries import lock_machines
from app.loop.readings import queries as reading_queries
from app.loop.readings import results_actions as readings
from app.loop.tables.machines import Machine
from app.loop.warnings import actions as warned
from app.loop.warnings.queries import bounds_of, unacknowledged
from app.web.created import Created, sent_before
from app.web.warnings import WarningsAcknowledgeIn

ASKED_ONCE = {"machine", "kind", "method", "name", "part", "key", "aligned_at", "characteristics"}


def align(session: Session, machine: Machine, body: AlignmentIn, caller: Caller) -> Created[Alignment]:
    """Find where the part lies and keep it with its touches. Raises `Invalid`, `Conflict`."""
    lock_machines(session, [machine.id])
    inputs = _kept(machine, body)
    if (before := _sent_before(session, machine, body.key, body.kind, body.method, inputs)) is not None:
        return before
    named = {str(name): key for name, key in (body.characteristics or {}).items()}
    entries = reading_queries.entries_for_results(session, machine.id, named)
    alignment = Alignment(
        machine_id=machine.id,
        kind=body.kind,
        method=body.method,
        name=body.name,
        part=body.part,
        aligned_at=body.aligned_at or datetime.now(UTC),
        actor=caller.name,
        key=body.key,
        given=inputs,
        result=solved(body.kind, body.method, inputs, bounds_of(machine)),
    )
    stored = _keep(session, machine, alignment, caller)
    values = {name: float(stored.result["shift"][at]) for at, name in enumerate("abc")}
    readings.ask_for(
        session, entries, values, readings.Source(f"alignment:{stored.id}", stored.aligned_at, stored.part)
    )
    return Created(stored)


def _kept(machine: Machine, body: AlignmentIn) -> Values:
    """Inputs of the computation, checked for what the schema cannot see."""
    needed = NEEDS[body.kind]
    if getattr(body, needed) is None:
        raise Invalid.at(needed, _("is needed for the kind {kind}").format(kind=body.kind), do=_("Send the points."))
    if (body.work_offset is None) != (body.base is None):
        missing = "base" if body.base is None else "work_offset"
        raise Invalid.at(missing, _("work_offset and base belong together: the offset, and its value while probing"))
    inputs = body.model_dump(exclude=ASKED_ONCE, exclude_none=True)
    for name in NEEDS.values():
        if name != needed:
            inputs.pop(name, None)
    if not inputs["tip"] or needed != "touches":
        inputs.pop("tip")
    if body.work_offset is not None:
        offset = offset_of(machine.control, body.work_offset)
        if offset is None:
            raise Invalid.at(
                "work_offset", _("{offset} is no work offset of this control").format(offset=repr(body.work_offset))
            )
        inputs["work_offset"] = offset.word
    return inputs


def _sent_before(
    session: Session, machine: Machine, key: str | None, kind: str, method: str, inputs: Values
) -> Created[Alignment] | None:
    earlier = None if key is None else queries.by_key(session, machine, key)
    if earlier is None:
        return None
    same = (earlier.kind, earlier.method, earlier.given) == (kind, method, inputs)
    return sent_before(earlier, key, _("alignment"), same=same, number=earlier.id)


def _keep(session: Session, machine: Machine, alignment: Alignment, caller: Caller) -> Alignment:
    session.add(alignment)
    session.flush()
    if caller.kind == "person" and alignment.recomputed_from is None:
        after = {"shift": alignment.result["shift"], "angles": alignment.result["angles"]}
        audit(session, caller.name, "aligned", f"alignment/{alignment.id}", None, after)
    publish(session, {"kind": "alignment", "machine": machine.key, "id": alignment.id})
    return alignment


# --- pallets, and once more


def compose(session: Session, body: PalletIn, caller: Caller) -> Created[Alignment]:
    """The alignment of a pallet and that of a part on it, the one after the other. Raises `NotFound`, `Conflict`."""
    pallet, part = queries.alignment(session, body.pallet), queries.alignment(session, body.part)
    machine = session.get_one(Machine, pallet.machine_id)
    caller.must_at(machine.id, "operator")
    caller.must_at(part.machine_id, "viewer")
    lock_machines(session, [machine.id])
    if pallet.id == part.id:
        raise Invalid.at("part", _("is the alignment of the pallet itself"))
    inputs: Values = {"pallet": pallet.id, "part": part.id} | (
        {"pose": body.pose.model_dump()} if body.pose is not None else {}
    )
    # The text is for the machine that the pallet is on.
    inputs |= {name: pallet.given[name] for name in ("work_offset", "base", "table") if name in pallet.given}
    if (before := _sent_before(session, machine, body.key, "pallet", "exact", inputs)) is not None:
        return before
    pose = None
    if body.pose is not None:
        pose = frame(from_angles(0.0, 0.0, body.pose.rotation), body.pose.shift)
    motion = on_pallet(np.array(pallet.result["matrix"]), np.array(part.result["matrix"]), pose)
    middle = np.array([*middle_of(part), 1.0])
    middle = middle if pose is None else pose @ middle
    warnings = [
        *motion_warnings(motion, middle[:3].tolist(), bounds_of(machine)),
        *(
            CodedWarning("composed_of_warned", {"number": component.id}, name)
            for name, component in (("pallet", pallet), ("part", part))
            if warned_of(session, component)
        ),
    ]
    alignment = Alignment(
        machine_id=machine.id,
        kind="pallet",
        method="exact",
        name=body.name,
        part=part.part,
        aligned_at=max(pallet.aligned_at, part.aligned_at),
        actor=caller.name,
        key=body.key,
        given=inputs,
        result=frame_values(motion) | {"uncertainty": {}, "solved_for": list(MOTIONS), "warnings": as_stored(warnings)},
        pallet_id=pallet.id,
        part_id=part.id,
    )
    return Created(_keep(session, machine, alignment, caller))


def warned_of(session: Session, alignment: Alignment) -> bool:
    """Return whether an alignment has warnings that are not acknowledged."""
    machine = session.get_one(Machine, alignment.machine_id)
    return bool(unacknowledged(session, machine.id, subject_of(alignment), warnings_of(alignment, machine)))


def acknowledge(session: Session, alignment: Alignment, body: WarningsAcknowledgeIn, caller: Caller) -> None:
    """Take an alignment as it is, although there are warnings. Raises `Conflict`."""
    machine = session.get_one(Machine, alignment.machine_id)
    warned.acknowledge(session, machine, subject_of(alignment), warnings_of(alignment, machine), body.reason, caller)


def recompute(session: Session, alignment: Alignment, body: AlignmentRecomputeIn, caller: Caller) -> Alignment:
    """The same touches once more; a new alignment, and the first one stays on record. Raises `Invalid`."""
    machine = session.get_one(Machine, alignment.machine_id)
    lock_machines(session, [machine.id])
    if alignment.kind == "pallet":
        raise Conflict(
            _("Alignment {number} has no points of its own: it was composed.").format(number=alignment.id),
            _("Compute alignment {pallet} or {part} again, and compose those.").format(
                pallet=alignment.pallet_id, part=alignment.part_id
            ),
        )
    inputs, method = body.applied_to(alignment.given), body.method or alignment.method
    recomputed = Alignment(
        machine_id=machine.id,
        kind=alignment.kind,
        method=method,
        name=alignment.name,
        part=alignment.part,
        aligned_at=alignment.aligned_at,
        actor=caller.name,
        given=inputs,
        result=solved(alignment.kind, method, inputs, bounds_of(machine)),
        recomputed_from=alignment.id,
    )
    stored = _keep(session, machine, recomputed, caller)
    before, after = ({"shift": row.result["shift"], "angles": row.result["angles"]} for row in (alignment, stored))
    audit(session, caller.name, "alignment computed again", f"alignment/{alignment.id}", before, after, body.reason)
    return stored
