"""Write the migration from the last one's tables to the models': `make migration NAME=what_changes`."""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

from alembic import command
from alembic.script import ScriptDirectory

from labels_db.database import Database
from labels_db.migrate import MIGRATIONS, alembic_config, open_database


def next_revision() -> str:
    """Migrations are numbered: 0001, 0002, …"""
    head = ScriptDirectory.from_config(alembic_config()).get_current_head()
    return f"{int(head or 0) + 1:04d}"


def write_migration(database: Database, name: str) -> Path:
    """Compare a database as the migrations leave it with the models, and write down the difference."""
    config, revision = alembic_config(), next_revision()
    config.set_main_option("file_template", "%%(rev)s_%%(slug)s")
    with database.rebuild() as connection:
        config.attributes["connection"] = connection
        command.revision(config, name, autogenerate=True, rev_id=revision)
    return next((MIGRATIONS / "versions").glob(f"{revision}_*.py"))


def tidy(path: Path) -> None:
    """Leave out the generator's remarks and format the rest as the project does."""
    lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
    path.write_text("".join(line for line in lines if "# ###" not in line), encoding="utf-8")
    for step in ("format", "check --fix"):
        subprocess.run([sys.executable, "-m", "ruff", *step.split(), "--quiet", str(path)], check=True)


def main() -> None:
    """Write the file and say where it lies."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", help="what changes, as in 'clips get a poster frame'")
    name = parser.parse_args().name
    with tempfile.TemporaryDirectory() as folder, open_database(Path(folder) / "before.db") as database:
        path = write_migration(database, name)
    tidy(path)
    print(f"Wrote {path.name}. Read it, then run `make test`.")


if __name__ == "__main__":
    main()
