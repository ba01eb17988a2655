"""Network that tells the pixels of ropes from all others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.perception.network.pictures import CROP_SIDE, CROPS_PER_PICTURE, training_crops
from benchmarks.perception.pictures.generators import Ground, rendered_picture
from lariat.perception.image import network


@pytest.mark.parametrize(("seed", "ground"), [(7000, "plain"), (7001, "plain"), (7002, "clutter")])
def test_network_tells_ropes_from_shadows_and_things(seed: int, ground: Ground) -> None:
    picture = rendered_picture(seed, 2, ground)
    seen = network.rope_log_odds(picture.color) > 0.0
    truth = picture.labels > 0
    assert seen.shape == truth.shape
    assert 2.0 * np.sum(seen & truth) / (np.sum(seen) + np.sum(truth)) > 0.85


def test_weights_of_another_version_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    weights = bytearray(network.WEIGHTS.read_bytes())
    weights[-100] ^= 1
    other = tmp_path / "ropes.onnx"
    other.write_bytes(weights)
    monkeypatch.setattr(network, "WEIGHTS", other)
    network.loaded_network.cache_clear()
    try:
        with pytest.raises(RuntimeError, match=r"ropes\.onnx is not the network of this version"):
            network.rope_log_odds(np.zeros((64, 64, 3), np.uint8))
    finally:
        network.loaded_network.cache_clear()


def test_training_pictures_are_labelled_where_a_cable_changes_them() -> None:
    crops = list(training_crops(3))
    assert len(crops) == CROPS_PER_PICTURE
    again = list(training_crops(3))
    shown = [mask.mean() for _, mask in crops]
    assert 0.0 < max(shown) < 0.9
    for (color, mask), (same, _) in zip(crops, again, strict=True):
        assert color.shape == (CROP_SIDE, CROP_SIDE, 3)
        assert set(np.unique(mask)) <= {0, 1}
        assert np.array_equal(color, same)
