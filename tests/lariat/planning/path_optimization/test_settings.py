"""Settings of the path optimisation: blocks for the length of a path."""

from __future__ import annotations

import pytest

from lariat.planning.path_optimization.settings import PathOptimizationSettings


@pytest.mark.parametrize(
    ("length", "blocks"), [(0.0, 9), (0.81, 9), (1.2, 12), (1.22, 13), (9.0, 20)]
)
def test_a_longer_path_has_more_blocks(length: float, blocks: int) -> None:
    settings = PathOptimizationSettings(blocks=9, block_length=0.1, max_blocks=20)
    assert settings.for_length(length).blocks == blocks
