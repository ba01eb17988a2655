"""Invalid motions are rejected with an error that names the fault."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.identification import check_motion
from lariat.identification.motion import Up, doubts, with_z_up

VALID_VERTICES = np.zeros((2, 20, 8, 3))
VALID_VERTICES[..., 0] = np.arange(8) * 0.1
HELD_VERTICES = np.array([0, 1, 6, 7])


def bent(index: tuple[int, ...], value: float) -> np.ndarray:
    changed = VALID_VERTICES.copy()
    changed[index] = value
    return changed


@pytest.mark.parametrize(
    ("vertices", "dt", "held", "words"),
    [
        (VALID_VERTICES[0], 0.01, HELD_VERTICES, r"vertices must be \(sequences"),
        (VALID_VERTICES[..., :2], 0.01, HELD_VERTICES, "got shape"),
        (VALID_VERTICES[:, :4], 0.01, HELD_VERTICES, "at least 1 sequence of 10 frames"),
        (bent((1, 7, 3, 2), np.nan), 0.01, HELD_VERTICES, r"vertices\[1, 7, 3\] is"),
        (bent((0, 5, 4, 0), 0.3), 0.01, HELD_VERTICES, "vertices 3 and 4 of sequence 0 coincide"),
        (1000.0 * VALID_VERTICES, 0.01, HELD_VERTICES, "--scale 0.001"),
        (VALID_VERTICES, 0.0, HELD_VERTICES, "dt must be between"),
        (VALID_VERTICES, [0.01, 0.02], HELD_VERTICES, "dt must be one number"),
        (VALID_VERTICES, 0.01, np.array([], dtype=int), "prescribed is empty"),
        (VALID_VERTICES, 0.01, np.array([0, 1, 8]), "within 0 and 7"),
        (VALID_VERTICES, 0.01, np.array([0, 3, 7]), "held in the middle"),
        (VALID_VERTICES, 0.01, np.array([3]), "held in the middle"),
        (VALID_VERTICES, 0.01, np.arange(8), "nothing is left to predict"),
        (VALID_VERTICES, 0.01, np.array([0.5, 1.0]), "row of vertex indices"),
        (VALID_VERTICES.astype(str), 0.01, HELD_VERTICES, "must be numbers"),
    ],
)
def test_invalid_motion_is_rejected_by_name(
    vertices: object, dt: object, held: object, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        check_motion(vertices, dt, held)


@pytest.mark.parametrize(
    ("held", "ends"),
    [([0, 1, 6, 7], (2, 2)), ([0, -1], (1, 1)), ([7, 6], (0, 2)), ([0, 1, 2, 7], (3, 1))],
)
def test_held_runs_are_counted_from_both_ends(held: list[int], ends: tuple[int, int]) -> None:
    found = check_motion(VALID_VERTICES, 0.01, np.array(held))
    assert (found.left, found.right) == ends
    assert found.free.sum() == 8 - len(held)


@pytest.mark.parametrize("held", [HELD_VERTICES, np.array([0]), np.array([6, 7])])
@pytest.mark.parametrize("up", ["x", "y", "z", "-x", "-y", "-z"])
def test_gravity_tells_which_axis_points_up(held: np.ndarray, up: Up):
    hanging = VALID_VERTICES.copy()
    hanging[..., 2] = -0.4 * np.sin(np.linspace(0.0, np.pi, 8))
    if len(held) < 4:
        hanging[..., 2] = -0.5 * np.abs(np.arange(8) - (0 if held[0] == 0 else 7))
    assert doubts(check_motion(hanging, 0.01, held)) == ()
    # Positions whose axis `up` is what z was.
    k = "xyz".index(up[-1])
    turned = np.roll(hanging, k + 1, axis=-1) * (-1.0 if up.startswith("-") else 1.0)
    told = "".join(doubts(check_motion(turned, 0.01, held)))
    assert told.endswith(f"give --up {up}") or (up == "z" and not told)
    np.testing.assert_array_equal(with_z_up(turned, up)[..., 2], hanging[..., 2])


def test_a_tilted_frame_is_said():
    hanging = VALID_VERTICES.copy()
    hanging[..., 2] = -0.4 * np.sin(np.linspace(0.0, np.pi, 8))
    s, c = np.sin(0.8), np.cos(0.8)
    tilted = hanging @ np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])
    (line,) = doubts(check_motion(tilted, 0.01, HELD_VERTICES))
    assert "turn the vertices" in line


def test_a_rope_as_long_as_a_hall_is_asked_for_its_unit():
    (line,) = doubts(check_motion(10.0 * VALID_VERTICES, 0.01, HELD_VERTICES))
    assert "7 m long" in line
    assert "--scale 0.001" in line
