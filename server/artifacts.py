"""Clips, videos and exported policies: found through their rows, never through a path that a client sends."""

from __future__ import annotations

import re
from typing import Annotated

from fastapi import APIRouter, Header
from starlette.responses import Response

from labels_db.artifacts import clip_of, content_of, export_of, video_of
from labels_db.feedback_sessions import fail_queries_showing
from labels_db.models import Clip
from labels_db.storage import ArtifactError
from server.api_requests import Count, RunId
from server.services import ServicesDep
from server.templating import FOREVER

router = APIRouter(include_in_schema=False)

RangeHeader = Annotated[str | None, Header(alias="range")]
IfNoneMatch = Annotated[str | None, Header()]


def clip_address(clip: Clip) -> str:
    """Where browsers get a clip: one address for one picture, whatever data folder is served there next."""
    return f"/artifacts/clips/{clip.segment_id}?content={content_of(clip)}"


@router.get("/artifacts/clips/{segment_id}")
def clip(
    segment_id: Count, services: ServicesDep, content: str | None = None, if_none_match: IfNoneMatch = None
) -> Response:
    """A segment's sprite sheet; browsers may keep it under an address that names its content."""
    with services.database.read() as session:
        found = clip_of(session, segment_id, content)
    kept = FOREVER.replace("public", "private") if content else "private, no-cache"
    headers = {"ETag": f'"{found.checksum}"', "Cache-Control": kept}
    if if_none_match == headers["ETag"]:
        return Response(status_code=304, headers=headers)
    try:
        data = services.store.read(found.artifact_key, found.checksum)
    except ArtifactError as error:  # nobody can answer without it, so nobody is to be asked again
        with services.database.write() as session:
            fail_queries_showing(session, segment_id, str(error))
        raise
    return Response(data, media_type="image/webp", headers=headers)


@router.get("/runs/{run_id}/videos/{step}.mp4")
def video(run_id: RunId, step: Count, services: ServicesDep, wanted: RangeHeader = None) -> Response:
    """The policy's episode at one evaluation, in the pieces a player asks for."""
    with services.database.read() as session:
        key = video_of(session, run_id, step)
    return ranged(services.store.read(key), wanted, media_type="video/mp4")


@router.get("/runs/{run_id}/exports/{command_id}")
def export(run_id: RunId, command_id: Count, services: ServicesDep) -> Response:
    """The policy that a command exported, as a file to keep."""
    with services.database.read() as session:
        found = export_of(session, run_id, command_id)
    data = services.store.read(found.key, found.checksum)
    headers = {"Content-Disposition": f'attachment; filename="{found.name}"'}
    return Response(data, media_type="application/octet-stream", headers=headers)


def ranged(data: bytes, wanted: str | None, *, media_type: str) -> Response:
    """The bytes asked for by one `Range: bytes=a-b` (RFC 9110); anything else gets all of them."""
    headers = {"Accept-Ranges": "bytes", "Cache-Control": "private, max-age=60"}
    match = re.fullmatch(r"bytes=(\d{0,18})-(\d{0,18})", (wanted or "").strip())
    if match is None or match.group(0) == "bytes=-":
        return Response(data, media_type=media_type, headers=headers)
    first, last = _bounds(*match.groups(), length=len(data))
    if first >= len(data) or first > last:
        headers["Content-Range"] = f"bytes */{len(data)}"
        return Response(status_code=416, headers=headers)
    headers["Content-Range"] = f"bytes {first}-{last}/{len(data)}"
    return Response(data[first : last + 1], status_code=206, media_type=media_type, headers=headers)


def _bounds(first: str, last: str, *, length: int) -> tuple[int, int]:
    """First and last byte, both included; without a first, the last so many bytes."""
    if not first:
        return max(0, length - int(last)), length - 1
    return int(first), min(int(last), length - 1) if last else length - 1
