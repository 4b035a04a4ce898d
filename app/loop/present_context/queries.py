"""The present context of a machine. Never writes."""

from sqlalchemy.orm import Session

from app.loop.present_context.tables import PresentContext


def present_of(session: Session, machine_id: int) -> PresentContext | None:
    """The one that holds; None where none was ever set."""
    return session.get(PresentContext, machine_id, populate_existing=True)
