"""The circumstances of a value in an AQDEF file: order, batch, nest, people and means by the file's catalogues, events, process."""

import re
from collections.abc import Callable
from typing import Any

from app.files.aqdef.description import Description
from app.files.aqdef.fields import CATALOGUES, FIELDS
from app.files.aqdef.values import Measured, Value, process_of
from app.files.formats.repeats import Remark
from app.language.i18n import _

LONGEST = 128  # characters of a text
LONGEST_COMMENT = 1000
HIGHEST_NEST = 999_999
TEMPERATURES = {"part temperature, °C": "part_temperature", "machine temperature, °C": "machine_temperature"}
"""Process parameters (K0011) that are fields of the context, by their names in the catalogue."""
_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f]+")


def context_of(
    value: Value, read: Measured, description: Description, tell: Callable[[Remark], None]
) -> dict[str, Any]:
    """The context of a reading as the contract has it, empty where nothing was said.

    What has no place of its own there, or is not as it should be, is kept as it is written, by its K number. tell: takes what
    a person should know.
    """

    def remark(name: str, text: str, reason: str) -> None:
        tell(Remark(value.line, f"{name}/{value.characteristic}", text[:40], reason))

    def fit(name: str, text: str, most: int = LONGEST) -> str:
        plain = _CONTROL.sub(" ", text).strip()
        if len(plain) > most:
            remark(name, plain, _("is longer than {most} characters; it is shortened").format(most=most))
        return plain[:most].strip()

    def named(name: str, entry: int | str) -> str:
        catalogue = CATALOGUES[name]
        return fit(name, description.named(entry, catalogue.long, catalogue.short))

    further = {name: text for name, text in value.fields.items() if name not in FIELDS or not FIELDS[name].read}
    if read.attribute:
        further["K0002"] = str(read.attribute)
    nest = read.nest
    if isinstance(nest, str) or not 0 <= nest <= HIGHEST_NEST:
        further["K0007"] = str(nest)
        remark("K0007", str(nest), _("is not the number of a nest; it is kept as a text"))
        nest = 0
    process = process_of(read.process) if read.process else {}
    if process is None:
        further["K0011"] = read.process
        remark("K0011", read.process, _("is not written as number/value; it is kept as a text"))
    sizes = {named("K0011", number) or "0": size for number, size in (process or {}).items()}
    temperatures = {name: sizes.pop(each) for each, name in TEMPERATURES.items() if each in sizes}
    found = {
        "order": fit("K0053", read.order),
        "batch": fit("K0006", read.batch),
        "nest": nest,
        "operator": named("K0008", read.operator),
        "machine": named("K0010", read.machine),
        "gauge": named("K0012", read.gauge),
        "comment": fit("K0009", read.text, LONGEST_COMMENT),
        "events": [text for each in read.events if (text := named("K0005", each))],
        "process": sizes,
        "fields": {name: fitted for name, text in further.items() if (fitted := fit(name, text, LONGEST_COMMENT))},
    }
    return {name: each for name, each in found.items() if each} | temperatures
