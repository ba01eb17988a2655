from __future__ import annotations

import numpy as np

from dashboard import palette
from dashboard.scene.other_ropes_view import other_rope_segments
from shared.messages import OtherRope, OtherRopes, RopeLine

LINE = np.array([[0.0, 0.0, 0.2], [0.1, 0.0, 0.2], [0.2, 0.0, 0.2]])


def test_remembered_lines_are_grey() -> None:
    lines = [
        RopeLine(positions=LINE.ravel(), seen=True),
        RopeLine(positions=LINE[:2].ravel(), seen=False),
    ]
    segments, colors = other_rope_segments(OtherRopes(ropes=[OtherRope(lines=lines)]))
    np.testing.assert_array_equal(segments[:2], [LINE[:2], LINE[1:]])
    shown, grey = palette.linear(palette.OTHER_ROPE), palette.linear(palette.UNOBSERVED)
    np.testing.assert_array_equal(colors[:, 0], [shown, shown, grey])


def test_no_ropes_have_no_segments() -> None:
    segments, colors = other_rope_segments(OtherRopes())
    assert segments.shape == colors.shape == (0, 2, 3)
