"""titles of experiments"""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"
branch_labels = None
depends_on = None


def upgrade() -> None:
    op.create_table(
        "experiment_titles",
        sa.Column("experiment", sa.String(), nullable=False),
        sa.Column("title", sa.String(), nullable=False),
        sa.PrimaryKeyConstraint("experiment", name=op.f("pk_experiment_titles")),
    )


def downgrade() -> None:
    op.drop_table("experiment_titles")
