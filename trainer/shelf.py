"""The shelf: where the segments of a query and their clips are put before its row appears."""

from __future__ import annotations

from dataclasses import dataclass

from labels_db.claims import Claim
from labels_db.models import Clip, FeedbackSession, Segment
from labels_db.storage import ArtifactStore
from trainer.rendering import EncodedClip, verify_clip
from trainer.segments import Pair, SegmentData


@dataclass(frozen=True)
class Shelf:
    """Artifacts of one attempt at a run, under keys that name the attempt."""

    store: ArtifactStore
    claim: Claim

    def pair(
        self,
        session: FeedbackSession,
        index: int,
        pair: Pair,
        clips: tuple[EncodedClip | None, EncodedClip | None] = (None, None),
    ) -> tuple[Segment, Segment]:
        """Store both segments of a query, and their clips if any; returns the rows that point at them."""
        query = f"a{self.claim.attempt}-s{session.index}-q{index}"
        return (
            self._segment(f"{query}-first", pair[0], clips[0]),
            self._segment(f"{query}-second", pair[1], clips[1]),
        )

    def _segment(self, place: str, segment: SegmentData, clip: EncodedClip | None) -> Segment:
        folder = f"runs/{self.claim.run_id}"
        key = f"{folder}/segments/{place}.safetensors"
        return Segment(
            run_id=self.claim.run_id,
            episode=segment.episode.number,
            start=segment.start,
            length=segment.length,
            policy_step=segment.episode.policy_step,
            artifact_key=key,
            checksum=self.store.write(key, segment.to_bytes()),
            true_return=segment.true_return,
            clip=self._clip(f"{folder}/clips/{place}.webp", clip) if clip else None,
        )

    def _clip(self, key: str, clip: EncodedClip) -> Clip:
        verify_clip(clip)
        return Clip(
            artifact_key=key,
            checksum=self.store.write(key, clip.data),
            frames=clip.frames,
            rows=clip.rows,
            columns=clip.columns,
            width=clip.width,
            height=clip.height,
            duration=clip.duration,
            times=list(clip.times),
        )
