from __future__ import annotations

import numpy as np
import pytest

from services.perception.centerline.occlusion import occlusion_uncertainty

EDGE = 0.01


def chain(count: int, pull: float) -> np.ndarray:
    """Nodes on a line, closer together than the rope's edges by a factor."""
    return np.stack([np.arange(count) * EDGE * pull, np.zeros(count), np.zeros(count)], axis=1)


def test_a_taut_hidden_stretch_has_nowhere_to_go() -> None:
    seen = np.ones(20, bool)
    seen[5:15] = False
    assert np.max(occlusion_uncertainty(chain(20, 1.0), EDGE, seen, (True, True))) == pytest.approx(
        0.0, abs=1e-9
    )


def test_a_hidden_stretch_with_length_to_spare_may_be_a_loop() -> None:
    seen = np.ones(20, bool)
    seen[5:15] = False
    sigma = occlusion_uncertainty(chain(20, 0.3), EDGE, seen, (True, True))
    assert np.all(sigma[seen] == 0.0)
    # Eleven edges over a third of their length reach five centimetres to the side, to any side.
    assert 0.02 < np.max(sigma) < 0.05
    assert int(np.argmax(sigma)) in (9, 10)
    sagging = occlusion_uncertainty(chain(20, 0.9), EDGE, seen, (True, True))
    assert 0.002 < np.max(sagging) < 0.01


def test_a_free_end_out_of_sight_is_less_known_the_further_it_is() -> None:
    seen = np.ones(20, bool)
    seen[12:] = False
    free = occlusion_uncertainty(chain(20, 1.0), EDGE, seen, (True, False))
    assert np.all(np.diff(free[11:]) > 0.0)
    held = occlusion_uncertainty(chain(20, 1.0), EDGE, seen, (True, True))
    assert np.max(held) == pytest.approx(0.0, abs=1e-9)
