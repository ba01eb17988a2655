"""Paths in blocks: their number for the length of a path."""

from __future__ import annotations

import pytest

from lariat.planning.path_optimization.block_path import blocks_of


@pytest.mark.parametrize(
    ("length", "blocks"), [(0.0, 12), (0.95, 12), (0.97, 13), (1.2, 15), (9.0, 32)]
)
def test_a_longer_path_has_more_blocks(length: float, blocks: int) -> None:
    assert blocks_of(length) == blocks
