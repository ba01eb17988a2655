from __future__ import annotations

import numpy as np
import pytest

from lariat.perception.centerline.occlusion import occlusion_uncertainty

EDGE = 0.01
"""Distance between nodes along the rope [m]."""


def chain(count: int, stretch: float) -> np.ndarray:
    """Nodes on a line, at `stretch` times the distance along the rope [m]."""
    return np.stack([np.arange(count) * EDGE * stretch, np.zeros(count), np.zeros(count)], axis=1)


def test_a_taut_hidden_stretch_has_no_uncertainty() -> None:
    seen = np.ones(20, bool)
    seen[5:15] = False
    assert np.max(occlusion_uncertainty(chain(20, 1.0), EDGE, seen, (True, True))) == pytest.approx(
        0.0, abs=1e-9
    )


def test_uncertainty_of_a_hidden_stretch_grows_with_its_slack() -> None:
    seen = np.ones(20, bool)
    seen[5:15] = False
    sigma = occlusion_uncertainty(chain(20, 0.3), EDGE, seen, (True, True))
    assert np.all(sigma[seen] == 0.0)
    # Eleven edges over a third of their length bulge by five centimetres, in any direction.
    assert 0.02 < np.max(sigma) < 0.05
    assert int(np.argmax(sigma)) in (9, 10)
    sagging = occlusion_uncertainty(chain(20, 0.9), EDGE, seen, (True, True))
    assert 0.002 < np.max(sagging) < 0.01


def test_uncertainty_of_a_hidden_free_end_grows_towards_its_tip() -> None:
    seen = np.ones(20, bool)
    seen[12:] = False
    free = occlusion_uncertainty(chain(20, 1.0), EDGE, seen, (True, False))
    assert np.all(np.diff(free[11:]) > 0.0)
    held = occlusion_uncertainty(chain(20, 1.0), EDGE, seen, (True, True))
    assert np.max(held) == pytest.approx(0.0, abs=1e-9)
