"""${message}

Revision: ${up_revision}
Revises: ${down_revision | comma,n}
Date: ${create_date}
"""

import sqlalchemy as sa
from alembic import op
${imports if imports else ""}

revision: str = ${repr(up_revision)}
down_revision: str | None = ${repr(down_revision)}
branch_labels = None
depends_on = None


def upgrade() -> None:
    # A lock on a busy table stops every reading: no rewrite of a big table, indexes with postgresql_concurrently
    # in op.get_context().autocommit_block(), NOT NULL by way of a validated CHECK.
    ${upgrades if upgrades else "pass"}


def downgrade() -> None:
    ${downgrades if downgrades else "pass"}
