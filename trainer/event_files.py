"""Metrics as TensorBoard event files, for those who look at many runs side by side."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from tensorboard.compat.proto.event_pb2 import Event
from tensorboard.compat.proto.summary_pb2 import Summary
from tensorboard.summary.writer.event_file_writer import EventFileWriter

from labels_db.records import Measurement


class EventFiles:
    """One folder per run; every attempt adds a file."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._writer = EventFileWriter(str(folder))

    def write(self, measurements: Iterable[Measurement]) -> None:
        for m in measurements:
            summary = Summary(value=[Summary.Value(tag=m.name, simple_value=m.value)])
            self._writer.add_event(Event(step=m.step, summary=summary))
        self._writer.flush()

    def close(self) -> None:
        self._writer.close()
