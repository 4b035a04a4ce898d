"""Gauge studies.

Revision ID: 0014
Revises: 0013
Create Date: 2026-11-21
"""

revision = "0014"
down_revision: str | None = "0013"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
