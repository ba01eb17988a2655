"""Cameras of a scenario: named ones, or the one that `[sensing]` places."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario, parse

TEXT = """
name = "cameras"
[rope]
length = 0.45
diameter = 0.008
[start]
line = [[-0.2, 0.0, 0.3], [0.2, 0.0, 0.3]]
[goal]
line = [[-0.2, 0.1, 0.3], [0.2, 0.1, 0.3]]
"""


def scenario(extra: str) -> Scenario:
    return parse(TEXT + extra, Path())


def test_a_scenario_without_cameras_has_the_one_that_sensing_places():
    (only,) = scenario("[sensing]\nposition = [0.0, 0.0, 2.0]\n").camera_setups
    assert (only.name, only.key) == ("overhead", "sensing")
    np.testing.assert_allclose(only.T_world_camera.position, [0.0, 0.0, 2.0])


def test_named_cameras_take_from_sensing_what_they_leave_open():
    one, other = scenario(
        "[sensing]\nresolution = [320, 240]\n"
        "[cameras.above]\nposition = [0.0, 0.0, 1.0]\n"
        "[cameras.side]\nposition = [0.0, -1.0, 0.5]\nresolution = [640, 480]\n"
        "field_of_view = 50.0\n"
    ).camera_setups
    assert (one.name, one.resolution, one.field_of_view) == ("above", (320, 240), 65.0)
    assert (other.name, other.resolution, other.field_of_view) == ("side", (640, 480), 50.0)
    assert other.key == "cameras.side"
    assert other.intrinsics.fx == pytest.approx(320.0 / np.tan(np.radians(25.0)))


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        ("[cameras.Top]\nposition = [0.0, 0.0, 1.0]\n", r"\[cameras.Top\]: a camera's name"),
        ("[cameras.rope]\nposition = [0.0, 0.0, 1.0]\n", "none of world"),
        ("[cameras.a]\nlook_at = [0.0, 0.0, 1.0]\n", "cameras.a.position is missing"),
        ("[cameras.a]\nposition = [0.0, 0.0, 1.0]\nposiion = 1\n", "did you mean 'position'"),
        ("[cameras]\na = 1\n", r"cameras.a must be a table, got 1; write \[cameras.a\]"),
        (
            "[sensing]\nlook_at = [0.1, 0.0, 0.0]\n[cameras.a]\nposition = [0.0, 0.0, 1.0]\n",
            r"sensing.look_at places the only camera, but there is \[cameras.a\]",
        ),
    ],
)
def test_what_contradicts_itself_is_named_with_a_way_out(extra: str, words: str):
    with pytest.raises(ConfigurationError, match=words):
        scenario(extra)
