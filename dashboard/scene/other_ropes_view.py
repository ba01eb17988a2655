"""Ropes beside the held one, as thin lines."""

from __future__ import annotations

import numpy as np
import viser
from jaxtyping import Float64, UInt8

from dashboard import palette
from dashboard.scene.chain_lines import LinesView
from shared.messages import OtherRopes, chain

LINE_THICKNESS = 3.0
"""Thickness of a line on the screen [pixels]."""


class OtherRopesView:
    """Lines of all ropes beside the held one, paler where they are remembered."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._lines = LinesView(scene, "/other_ropes", LINE_THICKNESS)

    @property
    def visible(self) -> bool:
        """Whether they are drawn."""
        return self._lines.visible

    @visible.setter
    def visible(self, value: bool) -> None:
        self._lines.visible = value

    def show(self, message: OtherRopes) -> None:
        """Replace the lines."""
        segments, colors = other_rope_segments(message)
        if len(segments):
            self._lines.show(segments, colors)
        else:
            self._lines.hide()


def other_rope_segments(
    message: OtherRopes,
) -> tuple[Float64[np.ndarray, "m 2 3"], UInt8[np.ndarray, "m 2 3"]]:
    """Return the segments of all ropes and their colours."""
    segments, colors = [np.zeros((0, 2, 3))], [np.zeros((0, 2, 3), np.uint8)]
    for line in (line for rope in message.ropes for line in rope.lines):
        points = chain(line.positions)
        color = palette.linear(palette.OTHER_ROPE if line.seen else palette.UNOBSERVED)
        segments.append(np.stack([points[:-1], points[1:]], axis=1))
        colors.append(np.broadcast_to(np.uint8(color), segments[-1].shape))
    return np.concatenate(segments), np.concatenate(colors)
