"""Obstacle checks: valid bodies pass, each invalid value is named."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lariat.geometry.obstacle_checks import check_obstacle
from lariat.geometry.obstacles import TABLE, Obstacle

BALL = Obstacle("sphere", (0.3, 0.0, 0.1), radius=0.05, name="ball")
BOX = Obstacle("box", (0.0, 0.0, 0.1), size=(0.1, 0.2, 0.3), name="box")


@pytest.mark.parametrize("body", [TABLE, BALL, BOX], ids=lambda body: body.name)
def test_valid_body_passes(body: Obstacle) -> None:
    check_obstacle(body)


@pytest.mark.parametrize(
    ("body", "error"),
    [
        (replace(BALL, name=""), "needs a name"),
        (replace(BALL, position=(float("nan"), 0.0, 0.0)), "not finite"),
        (replace(BALL, position=(30.0, 0.0, 0.0)), "positions are in metres"),
        (replace(BALL, radius=0.0), "0 < radius"),
        (replace(BOX, size=(0.1, -0.2, 0.3)), "0 < size"),
        (replace(BOX, orientation=(0.0, 0.0, 0.0, 0.0)), "must not be zero"),
        (replace(BOX, orientation=(1.0, 1.0, 0.0, 0.0)), "unit quaternion"),
    ],
)
def test_invalid_value_is_named(body: Obstacle, error: str) -> None:
    with pytest.raises(ValueError, match=error):
        check_obstacle(body)
