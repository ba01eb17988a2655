from __future__ import annotations

import numpy as np

from dashboard import palette
from dashboard.scene.tube_view import MIN_SCALE_CHANGE, TubeView
from dashboard.web.private_viser import PrivateViser


def test_tube_follows_its_nodes_and_its_segments_only_what_is_seen() -> None:
    private = PrivateViser("test")
    try:
        tube = TubeView(private.server.scene, "/rope", 0.004)
        nodes = np.linspace([0.0, 0.0, 0.1], [0.3, 0.0, 0.1], 4)
        tube.show(nodes, palette.ROPE)
        segments = tube.segments
        assert segments is not None
        for stretch, length in ((0.5 * MIN_SCALE_CHANGE, 0.1), (0.01, 0.11)):
            moved = nodes + np.array([0.0, 0.2, 0.0])
            moved[:, 0] *= (0.1 + stretch) / 0.1
            tube.show(moved, palette.ROPE)
            middles = (moved[:-1] + moved[1:]) / 2.0
            np.testing.assert_allclose(segments.batched_positions, middles, atol=1e-6)
            scales = np.asarray(segments.batched_scales)
            np.testing.assert_allclose(scales[:, 2], length, atol=1e-7)
    finally:
        private.close()
