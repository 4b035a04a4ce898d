"""Characteristics of form: run-out, out-of-roundness, taper or straightness of what another characteristic measures.

Each reading of that one which has the result brings a reading of this one, in the same transaction and with the same key.
"""

from collections.abc import Mapping
from typing import Any

from sqlalchemy import select
from sqlalchemy.orm import Session

from app.core.fits import with_fit
from app.core.natural_limit import NaturalLimit
from app.core.parameters import BY_R, Parameters, Variant, cautious
from app.core.variants import FormResult, forms_of
from app.errors import Conflict, FieldError, Invalid
from app.language.i18n import _
from app.loop.characteristics import queries, wording
from app.loop.characteristics.queries import CurrentCharacteristic
from app.loop.characteristics.schemas import FormOf
from app.loop.machines import queries as machines
from app.loop.tables.characteristics import Characteristic
from app.loop.tables.machines import Machine


def source_of(session: Session, machine: Machine, given: FormOf) -> Characteristic:
    """The characteristic whose readings bring the result. The machine is locked, so that the next reading knows of it.

    Raises `Invalid` for one that is not on this machine or has no such result, `Conflict` where it has its characteristic.
    """
    machines.lock_machines(session, [machine.id])
    source = queries.found(session, given.characteristic)
    field = "form_of.characteristic"
    if source is None or source.machine.id != machine.id:
        raise Invalid.at(
            field,
            _("there is no characteristic {key} on this machine").format(key=repr(given.characteristic[:64])),
        )
    if source.characteristic.form is not None:
        raise Invalid.at(field, _("is itself the form of another characteristic: name the one that is probed"))
    if given.result not in forms_of(source.parameters):
        raise Invalid.at("form_of.result", _no_such_result(source, given.result))
    other = session.scalar(
        select(Characteristic.key).where(
            Characteristic.machine_id == machine.id,
            Characteristic.form_of == source.characteristic.id,
            Characteristic.form == given.result,
        )
    )
    if other is not None:
        raise Conflict(
            _("{result} of {key} is the characteristic {other} already.").format(
                result=wording.result_label(given.result), key=source.characteristic.key, other=other
            ),
            _("Change that one."),
            errors=[FieldError("form_of.result", _("is a characteristic already: {other}").format(other=other))],
        )
    return source.characteristic


def _no_such_result(source: CurrentCharacteristic, result: FormResult) -> str:
    key, there = source.characteristic.key, forms_of(source.parameters)
    if not there:
        return _(
            "readings of {key} have no form: it needs points round (R25 = 2) or along (R25 = 3), or an indexed part (R25 = 1)"
        ).format(key=key)
    words = ", ".join(f"{form.value} ({wording.result_label(form)})" for form in there)
    return _("readings of {key} have no {result}, but {there}").format(key=key, result=result.value, there=words)


def parameters_of_form(given: Mapping[str, Any]) -> dict[str, Any]:
    """Its parameters: 0 is best and a natural limit, it corrects nothing; zones from the limit (R40) where nothing is given.

    Raises `Invalid` without a limit.

    >>> parameters_of_form({"R40": 0.012})["natural_limit"], parameters_of_form({"R40": 0.012})["zero_range"]
    ('lower', 0.002)
    """
    said = {raw: value for raw, value in with_fit(given).items() if value is not None}
    names = {BY_R.get(raw.upper(), raw): value for raw, value in said.items()}
    limit = names.get("upper_deviation")
    if isinstance(limit, bool) or not isinstance(limit, int | float) or limit <= 0:
        raise Invalid.at(
            "parameters.upper_deviation", _("R40 is the limit of the form deviation: a length above 0, mm")
        )
    usual = cautious(limit, NaturalLimit.LOWER)
    usual |= {"nominal": 0.0, "lower_deviation": 0.0, "natural_limit": NaturalLimit.LOWER.value, "mode": "measure_only"}
    return {name: value for name, value in usual.items() if name not in names} | said


def refused_for_form(parameters: Parameters) -> list[FieldError]:
    """Refuse one that corrects, or whose value would have to be probed."""
    errors = []
    if not parameters.measures_only:
        errors.append(
            FieldError("parameters.mode", _("must be measure_only: no offset corrects form, which has no sign"))
        )
    if parameters.natural_limit is not NaturalLimit.LOWER:
        errors.append(FieldError("parameters.natural_limit", _("must be lower: no form is below 0")))
    if parameters.variant is not Variant.SINGLE or parameters.accept_m > 1 or parameters.repeats > 1:
        errors.append(
            FieldError(
                "parameters.variant",
                _("must be single, without repeats and n of m: the points are those of the other one"),
            )
        )
    return errors
