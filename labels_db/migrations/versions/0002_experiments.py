"""experiments, and what a segment earned on average before a feedback session"""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    with op.batch_alter_table("runs", schema=None) as batch_op:
        batch_op.add_column(sa.Column("experiment", sa.String(), nullable=True))
        batch_op.add_column(sa.Column("method", sa.String(), nullable=True))
        batch_op.create_index(batch_op.f("ix_runs_experiment"), ["experiment"], unique=False)
    with op.batch_alter_table("feedback_sessions", schema=None) as batch_op:
        batch_op.add_column(sa.Column("segment_return", sa.Double(), nullable=True))


def downgrade() -> None:
    with op.batch_alter_table("feedback_sessions", schema=None) as batch_op:
        batch_op.drop_column("segment_return")
    with op.batch_alter_table("runs", schema=None) as batch_op:
        batch_op.drop_index(batch_op.f("ix_runs_experiment"))
        batch_op.drop_column("method")
        batch_op.drop_column("experiment")
