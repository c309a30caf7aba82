"""Messages between the run and its rendering process: a JSON header and raw bytes, each length-prefixed."""

from __future__ import annotations

import json
import struct
from typing import IO, Any

_LENGTHS = struct.Struct("<II")

Header = dict[str, Any]


def send(stream: IO[bytes], header: Header, body: bytes = b"") -> None:
    """Write one message and flush it; OSError if nobody reads any more."""
    text = json.dumps(header).encode("utf-8")
    stream.write(_LENGTHS.pack(len(text), len(body)) + text + body)
    stream.flush()


def receive(stream: IO[bytes]) -> tuple[Header, bytes] | None:
    """Read one message; None at the end of the stream, even in the middle of a message."""
    prefix = stream.read(_LENGTHS.size)
    if len(prefix) < _LENGTHS.size:
        return None
    header_size, body_size = _LENGTHS.unpack(prefix)
    content = stream.read(header_size + body_size)
    if len(content) < header_size + body_size:
        return None
    header: Header = json.loads(content[:header_size])
    return header, content[header_size:]
