"""Callers and what they may do."""

from dataclasses import dataclass
from typing import Literal

from app.access.tables import ROLES
from app.errors import NotAllowed
from app.language.i18n import _

Role = Literal["viewer", "operator", "engineer", "admin"]


@dataclass(frozen=True, slots=True)
class Caller:
    """A signed-in person, a key with a person's role, or a machine's own key.

    ``name`` is what the record (audit, corrections, alarms) says of who did it. Exactly one of ``role`` and
    ``machine_id`` is set. ``csrf`` is set for browsers only.
    """

    kind: Literal["person", "key", "machine"]
    name: str
    role: Role | None = None
    machine_id: int | None = None
    machine: str | None = None
    person_id: int | None = None
    key_id: int | None = None
    csrf: str = ""

    def may(self, role: Role) -> bool:
        """Tell if the caller has this role or a higher one. A machine's key has none."""
        return self.role is not None and ROLES.index(self.role) >= ROLES.index(role)

    def must(self, role: Role) -> None:
        """Raises `NotAllowed` unless the caller `may`."""
        if self.may(role):
            return
        if self.role is None:
            raise NotAllowed(
                _(
                    "The key of machine {machine} may only read what belongs to that machine, and send what the machine itself "
                    "measures, applies and reports: nothing that a person decides or sets up."
                ).format(machine=self.machine),
                _("Use the key or the sign-in of a person for this."),
            )
        raise NotAllowed(
            _("This needs the role {needed}; {name} has the role {role}.").format(
                needed=role, name=self.name, role=self.role
            ),
            _("Ask an administrator for the role, or a user who has it to do this."),
        )

    def must_at(self, machine_id: int, role: Role) -> None:
        """Raises `NotAllowed` unless this is that machine's own key, or a person with the role.

        For what a machine does itself: what it measures, applies and reports, and looking at its own set-up.
        """
        if self.machine_id is None:
            self.must(role)
        elif self.machine_id != machine_id:
            raise NotAllowed(
                _("The key of machine {machine} may not be used for another machine.").format(machine=self.machine),
                _("Use the key of the machine that this is about."),
            )

    def must_somewhere(self, role: Role) -> None:
        """Raises `NotAllowed` for a person without the role, before it is known which machine this is about."""
        if self.machine_id is None:
            self.must(role)

    @property
    def only_machine(self) -> int | None:
        """The machine to which lists are limited, or None for all."""
        return self.machine_id
