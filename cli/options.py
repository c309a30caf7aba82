"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from labels_db.data_folder import DataFolder


def _data_folder(path: str) -> DataFolder:
    return DataFolder(Path(path).expanduser())


Data = Annotated[
    DataFolder,
    typer.Option(
        "--data",
        parser=_data_folder,
        envvar="PEBBLE_DATA",
        metavar="DIR",
        default_factory=lambda: "./data",
        show_default="./data",
        help="Folder with database, artifacts, logs and token.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for programs; the last line is the result.")]
RunId = Annotated[str, typer.Argument(metavar="RUN", help="A run, as `pebble runs` lists them.")]
Seed = Annotated[int | None, typer.Option(min=0, max=2**31 - 1, help="Where all randomness starts.")]
