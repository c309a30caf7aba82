"""Bringing a database to this version's tables: an older one is migrated, a newer one refused."""

from __future__ import annotations

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.runtime.migration import MigrationContext
from alembic.script import ScriptDirectory

from labels_db.database import Database
from labels_db.errors import NewerDatabaseError

MIGRATIONS = Path(__file__).parent / "migrations"


def alembic_config() -> Config:
    """Alembic without an ini file: all it needs is where the migrations lie."""
    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    return config


def migrate(database: Database) -> None:
    """Create or migrate the tables; NewerDatabaseError where this version does not know them.

    One write transaction holds all of it, so that two processes starting together do not both migrate.
    """
    config = alembic_config()
    scripts = ScriptDirectory.from_config(config)
    with database.rebuild() as connection:
        revision = MigrationContext.configure(connection).get_current_revision()
        _refuse_newer(database, scripts, revision)
        if revision != scripts.get_current_head():
            config.attributes["connection"] = connection
            command.upgrade(config, "head")


def _refuse_newer(database: Database, scripts: ScriptDirectory, revision: str | None) -> None:
    known = {script.revision for script in scripts.walk_revisions()}
    if revision is not None and revision not in known:
        raise NewerDatabaseError(
            f"{database.path}: made by a newer Pebble (revision {revision}; this one knows up to"
            f" {scripts.get_current_head()}). Update this installation, or choose another folder with --data."
        )


def open_database(path: Path) -> Database:
    """The database at that path, with this version's tables."""
    database = Database(path)
    try:
        migrate(database)
    except BaseException:
        database.close()
        raise
    return database
