"""Rendering, in a process of its own: nothing imported here loads OpenGL."""

from trainer.rendering.errors import RenderingError, RenderingLost, RenderingUnavailable
from trainer.rendering.process import check_rendering
from trainer.rendering.renderer import CLIP_SECONDS, VIDEO_SECONDS, Renderer, drawn
from trainer.rendering.sheet import EncodedClip, verify_clip

__all__ = [
    "CLIP_SECONDS",
    "VIDEO_SECONDS",
    "EncodedClip",
    "Renderer",
    "RenderingError",
    "RenderingLost",
    "RenderingUnavailable",
    "check_rendering",
    "drawn",
    "verify_clip",
]
