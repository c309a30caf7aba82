"""Clips and videos: by row, whole or in pieces, and never damaged."""

from __future__ import annotations

import pytest

from labels_db.models import Clip
from server.artifacts import clip_address, ranged
from tests.server.conftest import Site
from tests.web import demo


def drawn(site: Site) -> Clip:
    """A segment's clip, in the record and in the store."""
    with site.database.write() as session:
        run = demo.queued(session, demo.WINDMILL)
        made = demo.segment(session, site.services.store, run.id, 1)
        session.flush()
        assert made.clip is not None
        return made.clip


def test_a_clip_is_served_once_and_kept(site: Site) -> None:
    url = clip_address(drawn(site))
    answer = site.client.get(url)
    assert (answer.status_code, answer.headers["content-type"]) == (200, "image/webp")
    assert "immutable" in answer.headers["cache-control"]
    again = site.client.get(url, headers={"If-None-Match": answer.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")
    assert site.anonymous.get(url).status_code == 401


def test_a_browser_keeps_a_clip_by_its_content_alone(site: Site) -> None:
    """Another data folder, served at this address tomorrow, has other clips of the same numbers."""
    clip = drawn(site)
    address = clip_address(clip)
    assert address.startswith(f"/artifacts/clips/{clip.segment_id}?content=")
    assert site.client.get(address[:-1] + ("0" if address[-1] != "0" else "1")).status_code == 404
    assert "no-cache" in site.client.get(f"/artifacts/clips/{clip.segment_id}").headers["cache-control"]


def test_a_damaged_clip_is_not_served(site: Site) -> None:
    clip = drawn(site)
    site.services.store.write(clip.artifact_key, b"something else")
    answer = site.client.get(clip_address(clip))
    assert answer.status_code == 404
    assert "damaged" in answer.text


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/artifacts/clips/1", 404),
        ("/artifacts/clips/x", 422),
        (f"/artifacts/clips/{2**80}", 422),
        ("/artifacts/clips/../../token", 404),
        ("/runs/nobody/videos/1.mp4", 404),
        ("/runs/nobody/videos/x.mp4", 422),
    ],
)
def test_what_is_not_there(site: Site, path: str, status: int) -> None:
    assert site.client.get(path).status_code == status


@pytest.mark.parametrize(
    ("wanted", "status", "body", "content_range"),
    [
        (None, 200, b"0123456789", None),
        ("bytes=0-", 206, b"0123456789", "bytes 0-9/10"),
        ("bytes=2-4", 206, b"234", "bytes 2-4/10"),
        ("bytes=8-99", 206, b"89", "bytes 8-9/10"),
        ("bytes=-3", 206, b"789", "bytes 7-9/10"),
        ("bytes=-99", 206, b"0123456789", "bytes 0-9/10"),
        ("bytes=10-", 416, b"", "bytes */10"),
        ("bytes=4-2", 416, b"", "bytes */10"),
        ("bytes=-0", 416, b"", "bytes */10"),
        ("bytes=0-1,4-5", 200, b"0123456789", None),
        ("bytes=-", 200, b"0123456789", None),
        (f"bytes={'9' * 5000}-", 200, b"0123456789", None),
        ("lines=0-1", 200, b"0123456789", None),
    ],
)
def test_ranges(wanted: str | None, status: int, body: bytes, content_range: str | None) -> None:
    answer = ranged(b"0123456789", wanted, media_type="video/mp4")
    assert (answer.status_code, answer.body) == (status, body)
    assert answer.headers.get("content-range") == content_range
    assert answer.headers["accept-ranges"] == "bytes"
