from __future__ import annotations

import numpy as np
import pytest

from lariat.rod import state_along

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
ARC = np.stack([0.1 * np.sin(np.linspace(0, 2, 9)), np.zeros(9), np.linspace(0, 0.2, 9)], axis=1)


@pytest.mark.parametrize("node", [0, 3, 7])
def test_an_edge_without_length_has_the_frame_of_its_neighbour(node: int) -> None:
    nodes = ARC.copy()
    nodes[node + 1] = nodes[node]
    along = state_along(nodes, LEVEL, LEVEL, (0, 0)).orientations
    assert np.all(np.isfinite(along))
    tangents = np.diff(nodes, axis=0)
    tangents[node] = tangents[node - 1 if node else 1]
    tangents /= np.linalg.norm(tangents, axis=1)[:, None]
    w, x, y, z = along.T
    axes = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z], 1)
    np.testing.assert_allclose(axes, tangents, atol=1e-12)


def test_a_chain_without_length_is_refused() -> None:
    with pytest.raises(ValueError, match="same point"):
        state_along(np.ones((5, 3)), LEVEL, LEVEL)
