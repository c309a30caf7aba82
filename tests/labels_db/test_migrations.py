"""A new database, an older one, a newer one."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from alembic.autogenerate import compare_metadata
from alembic.runtime.migration import MigrationContext
from sqlalchemy import select

from labels_db import migrate
from labels_db.database import Database
from labels_db.errors import NewerDatabaseError
from labels_db.migrate import MIGRATIONS, open_database
from labels_db.models import Base, QueryScore, Run
from labels_db.records import FitReport, record_fit
from tests.labels_db import given

NEXT = '''
"""A later version, which rebuilds tables that others point at."""

import sqlalchemy as sa
from alembic import op

revision, down_revision, branch_labels, depends_on = "9999", {head!r}, None, None


def upgrade() -> None:
    for table in ("queries", "fits", "runs"):
        with op.batch_alter_table(table, recreate="always") as batch:
            batch.add_column(sa.Column("colour", sa.String(), server_default="red"))


def downgrade() -> None:
    for table in ("queries", "fits", "runs"):
        op.drop_column(table, "colour")
'''


def test_migrations_make_exactly_the_models_tables(database: Database) -> None:
    with database.write() as session:
        context = MigrationContext.configure(session.connection(), opts={"compare_type": True})
        assert compare_metadata(context, Base.metadata) == []


def test_opening_again_changes_nothing(database: Database) -> None:
    with database.write() as session:
        given.a_run(session)
    again = open_database(database.path)
    with again.read() as session:
        assert session.get(Run, "mill") is not None
    again.close()


@pytest.fixture
def later_version(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The program as a later version, with one more migration."""
    folder = shutil.copytree(MIGRATIONS, tmp_path / "migrations")
    head = max(path.name[:4] for path in (MIGRATIONS / "versions").glob("*.py"))
    (folder / "versions" / "9999_later.py").write_text(NEXT.format(head=head), encoding="utf-8")
    monkeypatch.setattr(migrate, "MIGRATIONS", folder)


def _with_scores(database: Database) -> None:
    """Rows in tables that hang together, one of them by a cascade."""
    with database.write() as session:
        owner = given.a_claim(session)
        scores = {query.id: 0.5 for query in given.queries(session, owner, 3)}
        record_fit(
            session, owner, index=0, step=1, cursor=0, report=FitReport(3, 1, 1.0, None), probabilities=scores
        )


@pytest.mark.usefixtures("later_version")
def test_an_older_database_keeps_its_rows(database: Database) -> None:
    _with_scores(database)
    database.close()
    later = open_database(database.path)
    with later.read() as session:
        columns = session.connection().exec_driver_sql("SELECT colour FROM queries").scalars().all()
        assert columns == ["red"] * 3
        assert len(session.scalars(select(QueryScore)).all()) == 3
        assert session.connection().exec_driver_sql("PRAGMA foreign_keys").scalar() == 1
    later.close()


def test_a_newer_database_is_refused(database: Database) -> None:
    with database.write() as session:
        session.connection().exec_driver_sql("UPDATE alembic_version SET version_num = '9999'")
    with pytest.raises(NewerDatabaseError, match=r"made by a newer Pebble .*9999.*Update this installation"):
        open_database(database.path)


def test_a_migration_that_breaks_links_is_undone(database: Database) -> None:
    _with_scores(database)
    with pytest.raises(RuntimeError, match="rows that point nowhere"), database.rebuild() as connection:
        connection.exec_driver_sql("DELETE FROM queries")
    with database.read() as session:
        assert len(session.scalars(select(QueryScore)).all()) == 3
        assert session.connection().exec_driver_sql("PRAGMA foreign_keys").scalar() == 1
