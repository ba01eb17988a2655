from __future__ import annotations

import numpy as np
from skimage import morphology

from services.perception.thinning import skeletonize


def test_skeletons_are_those_of_the_package() -> None:
    random = np.random.default_rng(0)
    for share in (0.5, 0.8, 0.95):
        mask = random.random((96, 128)) < share
        np.testing.assert_array_equal(skeletonize(mask), morphology.skeletonize(mask))
        np.testing.assert_array_equal(
            skeletonize(mask[:, ::2]), morphology.skeletonize(mask[:, ::2])
        )
