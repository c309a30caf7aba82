"""Rendering, in a process of its own: nothing imported here loads OpenGL."""

from trainer.rendering.errors import RenderingError, RenderingLost, RenderingUnavailable
from trainer.rendering.process import check_rendering
from trainer.rendering.renderer import Renderer
from trainer.rendering.sheet import EncodedClip, verify_clip

__all__ = [
    "EncodedClip",
    "Renderer",
    "RenderingError",
    "RenderingLost",
    "RenderingUnavailable",
    "check_rendering",
    "verify_clip",
]
