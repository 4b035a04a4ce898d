"""Aligning, composing pallets with parts, computing again. Lengths in mm, angles in degrees."""

from collections.abc import Callable
from datetime import UTC, datetime
from math import isfinite
from typing import Any, NamedTuple

import numpy as np
from sqlalchemy.orm import Session

from app.alignments import queries, wording
from app.alignments.schemas import AlignmentIn, PalletIn, RecomputeIn
from app.alignments.tables import Alignment
from app.audit.actions import record as audit
from app.core.geometry import alignment as core
from app.core.geometry.frames import angles_of, frame, from_angles, on_pallet, vector_of
from app.core.geometry.in_plane import Hole, InPlane, two_holes, two_points
from app.core.geometry.layout import MOTIONS, NotLaidOut
from app.core.geometry.points import Degenerate, Floats
from app.core.programs.frames import offset_of
from app.db.events import publish
from app.errors import Conflict, FieldError, Invalid
from app.machines.queries import lock_machines
from app.machines.tables import Machine
from app.people.callers import Caller
from app.readings import actions as readings
from app.readings import queries as reading_queries
from app.web.i18n import _
from app.zeros.wording import degenerate

NEEDS = {"points": "touches", "two_points": "side", "two_holes": "holes"}
ASKED_ONCE = {"machine", "kind", "method", "name", "part", "key", "aligned_at", "characteristics"}
Values = dict[str, Any]


class Made(NamedTuple):
    """An alignment; again: it was sent before with the same key, and nothing happened now."""

    alignment: Alignment
    again: bool = False


def align(session: Session, machine: Machine, given: AlignmentIn, caller: Caller) -> Made:
    """Find where the part lies and keep it with its touches. Raises `Invalid`, `Conflict`."""
    lock_machines(session, [machine.id])
    kept = _kept(machine, given)
    if (before := _sent_before(session, machine, given.key, given.kind, given.method, kept)) is not None:
        return before
    named = {str(name): key for name, key in (given.characteristics or {}).items()}
    entries = reading_queries.entries_for_results(session, machine.id, named)
    made = Alignment(
        machine_id=machine.id,
        kind=given.kind,
        method=given.method,
        name=given.name,
        part=given.part,
        aligned_at=given.aligned_at or datetime.now(UTC),
        actor=caller.name,
        key=given.key,
        given=kept,
        result=_solved(given.kind, given.method, kept),
    )
    stored = _keep(session, machine, made, caller)
    values = {name: float(stored.result["shift"][at]) for at, name in enumerate("abc")}
    readings.ask_for(
        session, entries, values, readings.Source(f"alignment:{stored.id}", stored.aligned_at, stored.part)
    )
    return Made(stored)


def _kept(machine: Machine, given: AlignmentIn) -> Values:
    """What it is computed from, checked for what the schema cannot see."""
    needed = NEEDS[given.kind]
    if getattr(given, needed) is None:
        wrong = _("is needed for the kind {kind}").format(kind=given.kind)
        raise Invalid(f"{needed}: {wrong}.", _("Send the touches."), errors=[FieldError(needed, wrong)])
    if (given.work_offset is None) != (given.base is None):
        missing = "base" if given.base is None else "work_offset"
        wrong = _("work_offset and base belong together: where the offset is, and what it was while touching")
        raise Invalid(f"{missing}: {wrong}.", errors=[FieldError(missing, wrong)])
    kept = given.model_dump(exclude=ASKED_ONCE, exclude_none=True)
    for name in NEEDS.values():
        if name != needed:
            kept.pop(name, None)
    if not kept["tip"] or needed != "touches":
        kept.pop("tip")
    if given.work_offset is not None:
        offset = offset_of(machine.control, given.work_offset)
        if offset is None:
            wrong = _("{offset} is no work offset of this control").format(offset=repr(given.work_offset))
            raise Invalid(f"work_offset: {wrong}.", errors=[FieldError("work_offset", wrong)])
        kept["work_offset"] = offset.word
    return kept


def _sent_before(
    session: Session, machine: Machine, key: str | None, kind: str, method: str, kept: Values
) -> Made | None:
    found = None if key is None else queries.by_key(session, machine, key)
    if found is None:
        return None
    if (found.kind, found.method, found.given) == (kind, method, kept):
        return Made(found, again=True)
    raise Conflict(
        _("Alignment {number} was sent with the key {key} already, and with other values.").format(
            number=found.id, key=repr(key)
        ),
        _("A key names one alignment for ever: use another one."),
        number=found.id,
    )


def _keep(session: Session, machine: Machine, made: Alignment, caller: Caller) -> Alignment:
    session.add(made)
    session.flush()
    if caller.kind == "person" and made.recomputed_from is None:
        after = {"shift": made.result["shift"], "angles": made.result["angles"]}
        audit(session, caller.name, "aligned", f"alignment/{made.id}", None, after)
    publish(session, {"kind": "alignment", "machine": machine.key, "id": made.id})
    return made


# --- solving


def _solved(kind: str, method: str, kept: Values) -> Values:
    """The frame and how well it is known. Raises `Invalid` that names the touches."""
    solve: Callable[[Values], Values] = {
        "points": lambda given: _points(method, given),
        "two_points": _side,
        "two_holes": _holes,
    }[kind]
    try:
        return solve(kept)
    except NotLaidOut as problem:
        wrong, remedy = wording.loose(problem)
        at = problem.at
    except Degenerate as problem:
        wrong, remedy = degenerate(problem)
        at = problem.at
    name = NEEDS[kind]
    fields = [f"{name}[{number - 1}]" for number in at] or [name]
    raise Invalid(f"{fields[0]}: {wrong}.", remedy, errors=[FieldError(field, wrong) for field in fields])


def _points(method: str, given: Values) -> Values:
    touches = [
        core.Touch.by_tip(tuple(each["nominal"]), tuple(each["normal"]), tuple(each["measured"]), given.get("tip", 0.0))
        if "measured" in each
        else core.Touch.off_by(tuple(each["nominal"]), tuple(each["normal"]), each["deviation"])
        for each in given["touches"]
    ]
    found = core.align(
        touches,
        core.Method(method),
        solve_for=given.get("solve_for", MOTIONS),
        repeatability=given.get("repeatability"),
    )
    advised = found.advice
    return _frame(found.motion) | {
        "deviations": _rounded(found.deviations),
        "residuals": _rounded(found.residuals),
        "leverage": _rounded(found.leverage, 6),
        "condition": found.condition,
        "difference": found.difference,
        "solved_for": list(found.solved_for),
        "uncertainty": found.uncertainty,
        "weakest": _rounded(found.weakest, 6),
        "misfits": [list(group) for group in found.misfits],
        "advice": None
        if advised is None
        else {
            "place": list(advised.place),
            "normal": list(advised.normal),
            "gain": advised.gain if isfinite(advised.gain) else None,
        },
        "rms": found.rms,
    }


def _side(given: Values) -> Values:
    pair = given["side"]
    return _plane(
        two_points([each["nominal"] for each in pair], [each["measured"] for each in pair], given.get("repeatability"))
    )


def _holes(given: Values) -> Values:
    holes = []
    for at, each in enumerate(given["holes"]):
        try:
            holes.append(
                Hole(tuple(each["centre"]))
                if "centre" in each
                else Hole.from_touches([tuple(touch) for touch in each["touches"]], each["tip"], inside=each["inside"])
            )
        except Degenerate as problem:
            wrong, remedy = degenerate(problem)
            field = f"holes[{at}].touches"
            raise Invalid(f"{field}: {wrong}.", remedy, errors=[FieldError(field, wrong)]) from None
    found = two_holes([each["nominal"] for each in given["holes"]], holes, given.get("repeatability"))
    return _plane(found) | {
        "holes": [
            {"centre": list(hole.centre), "diameter": hole.diameter, "residuals": _rounded(hole.residuals)}
            for hole in holes
        ]
    }


def _plane(found: InPlane) -> Values:
    return _frame(found.motion) | {
        "off": None if found.off is None else round(found.off, 9) + 0.0,
        "uncertainty": found.uncertainty,
        "solved_for": ["a", "b", "gamma"],
    }


def _frame(motion: Floats) -> Values:
    return {
        "matrix": [[float(each) + 0.0 for each in row] for row in motion],
        "shift": _rounded(motion[:3, 3]),
        "angles": _rounded(angles_of(motion[:3, :3]), 10),
        "turns": _rounded(np.degrees(vector_of(motion[:3, :3])), 10),
    }


def _rounded(values: Any, places: int = 9) -> list[float]:
    return [round(float(each), places) + 0.0 for each in values]


# --- pallets, and once more


def compose(session: Session, given: PalletIn, caller: Caller) -> Made:
    """The alignment of a pallet and that of a part on it, the one after the other. Raises `NotFound`, `Conflict`."""
    pallet, part = queries.alignment(session, given.pallet), queries.alignment(session, given.part)
    machine = session.get_one(Machine, pallet.machine_id)
    caller.must_at(machine.id, "operator")
    caller.must_at(part.machine_id, "viewer")
    lock_machines(session, [machine.id])
    if pallet.id == part.id:
        wrong = _("is the alignment of the pallet itself")
        raise Invalid(f"part: {wrong}.", errors=[FieldError("part", wrong)])
    kept: Values = {"pallet": pallet.id, "part": part.id} | (
        {"pose": given.pose.model_dump()} if given.pose is not None else {}
    )
    # The text is for the machine that the pallet stands on.
    kept |= {name: pallet.given[name] for name in ("work_offset", "base", "table") if name in pallet.given}
    if (before := _sent_before(session, machine, given.key, "pallet", "exact", kept)) is not None:
        return before
    pose = None
    if given.pose is not None:
        pose = frame(from_angles(0.0, 0.0, given.pose.rotation), given.pose.shift)
    motion = on_pallet(np.array(pallet.result["matrix"]), np.array(part.result["matrix"]), pose)
    made = Alignment(
        machine_id=machine.id,
        kind="pallet",
        method="exact",
        name=given.name,
        part=part.part,
        aligned_at=max(pallet.aligned_at, part.aligned_at),
        actor=caller.name,
        key=given.key,
        given=kept,
        result=_frame(motion) | {"uncertainty": {}, "solved_for": list(MOTIONS)},
        pallet_id=pallet.id,
        part_id=part.id,
    )
    return Made(_keep(session, machine, made, caller))


def recompute(session: Session, alignment: Alignment, given: RecomputeIn, caller: Caller) -> Alignment:
    """The same touches once more; a new alignment, and the first one stays on record. Raises `Invalid`."""
    machine = session.get_one(Machine, alignment.machine_id)
    lock_machines(session, [machine.id])
    if alignment.kind == "pallet":
        raise Conflict(
            _("Alignment {number} has no touches of its own: it was composed.").format(number=alignment.id),
            _("Compute alignment {pallet} or {part} again, and compose those.").format(
                pallet=alignment.pallet_id, part=alignment.part_id
            ),
        )
    kept = dict(alignment.given)
    method = given.method or alignment.method
    if given.repeatability is not None:
        kept["repeatability"] = given.repeatability
    if given.leave_out:
        touches = kept.get("touches") or []
        beyond = [at for at in given.leave_out if at > len(touches)]
        if beyond:
            wrong = _("there is no touch {at}").format(at=", ".join(map(str, beyond)))
            raise Invalid(f"leave_out: {wrong}.", errors=[FieldError("leave_out", wrong)])
        kept["touches"] = [touch for at, touch in enumerate(touches, 1) if at not in given.leave_out]
    made = Alignment(
        machine_id=machine.id,
        kind=alignment.kind,
        method=method,
        name=alignment.name,
        part=alignment.part,
        aligned_at=alignment.aligned_at,
        actor=caller.name,
        given=kept,
        result=_solved(alignment.kind, method, kept),
        recomputed_from=alignment.id,
    )
    stored = _keep(session, machine, made, caller)
    before, after = ({"shift": each.result["shift"], "angles": each.result["angles"]} for each in (alignment, stored))
    audit(session, caller.name, "alignment computed again", f"alignment/{alignment.id}", before, after, given.reason)
    return stored
