"""The shape of a stored reading, shared by the one who writes it and those who read it."""

from collections.abc import Sequence
from datetime import datetime
from typing import Any, NamedTuple

import msgspec

MOST_OUTSTANDING = 100  # numbers stored with a reading; a machine that never confirms leaves ever more of them open


class Entry(NamedTuple):
    """The place of a characteristic: its machine and their keys."""

    machine_id: int
    machine: str
    characteristic_id: int
    characteristic: str

    def changed(self, sequence: int | None) -> dict[str, Any]:
        """The live event of a reading that came, or is another now."""
        return {
            "kind": "reading",
            "machine": self.machine,
            "characteristic": self.characteristic,
            "sequence": sequence,
        }


class Record(msgspec.Struct, frozen=True):
    """One row of the table `reading`, in the order of its columns."""

    machine_id: int
    characteristic_id: int
    sequence: int
    measured: float
    deviation: float
    decided: float
    average_before: float
    average_after: float
    measured_at: datetime
    received_at: datetime
    machined_at: datetime | None
    parameters_version: int
    correction_in_effect: int | None
    correction: int | None
    paused_by: int | None
    late: bool
    zone: str
    action: str
    code: str
    key: str | None
    part: str | None
    outstanding: Sequence[int] | None
    alarms: list[int] | None
    compensated: float | None
