"""What can go wrong with rendering, in the words of whoever must mend it."""

from __future__ import annotations

INSTALL = "apt-get install libegl1 libgl1-mesa-dri libosmesa6"


class RenderingError(RuntimeError):
    """A picture could not be made."""


class RenderingUnavailable(RenderingError):  # noqa: N818
    """This machine has no OpenGL that the simulator can draw with."""

    def __init__(self, reasons: dict[str, str]) -> None:
        tried = "; ".join(f"{backend}: {reason}" for backend, reason in reasons.items())
        super().__init__(f"rendering: no OpenGL to draw with ({tried}); install it with `{INSTALL}`")


class RenderingLost(RenderingError):  # noqa: N818
    """The rendering process is gone, and was not brought back."""
