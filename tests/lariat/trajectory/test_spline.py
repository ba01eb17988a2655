from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.trajectory import SetpointChunk, Spline

SECOND = 1_000_000_000


def chunk_of(x: np.ndarray, q: np.ndarray | None = None, dt: float = 0.02) -> SetpointChunk:
    positions = np.zeros((len(x), 1, 3))
    positions[:, 0, 0] = x
    orientations = np.tile(poses.IDENTITY, (len(x), 1, 1)) if q is None else q[:, None]
    return SetpointChunk(SECOND, dt, positions, orientations)


def test_straight_motion_is_reproduced_and_a_bend_is_rounded_by_a_sixth() -> None:
    dt, acceleration = 0.02, 1.5
    t = dt * np.arange(20)
    spline = Spline(chunk_of(0.2 * t), SECOND)
    assert np.isclose(spline(SECOND + round(0.1234e9)).positions[0, 0], 0.2 * 0.1234)
    spline = Spline(chunk_of(acceleration * t**2 / 2.0), SECOND)
    middle = spline(SECOND + round(0.2e9))
    assert np.isclose(middle.twists[0, 0, 0], acceleration * 0.2)
    assert np.isclose(middle.accelerations[0, 0, 0], acceleration)
    assert np.isclose(
        middle.positions[0, 0], acceleration * 0.2**2 / 2.0 + acceleration * dt**2 / 6.0
    )


def test_curve_never_exceeds_the_differences_of_its_points() -> None:
    rng = np.random.default_rng(3)
    x = np.cumsum(np.cumsum(rng.normal(size=30))) * 1e-4
    x[-2:] = x[-1]
    spline = Spline(chunk_of(x), SECOND)
    samples = [spline(SECOND + k * 1_000_000) for k in range(650)]
    speeds = [abs(s.twists[0, 0, 0]) for s in samples]
    accelerations = [abs(s.accelerations[0, 0, 0]) for s in samples]
    assert max(speeds) <= np.max(spline.differences(1)) + 1e-12
    assert max(accelerations) <= np.max(spline.differences(2)) + 1e-9
    assert not samples[-1].twists.any()
    assert np.isclose(samples[-1].positions[0, 0], x[-1])


def test_angular_velocity_is_that_of_the_curve() -> None:
    angles = np.linspace(0.0, 1.2, 30)[:, None] * np.array([0.3, 1.0, -0.4])
    q = poses.multiply(poses.exponential(angles), poses.exponential(np.array([[0.2, 0.1, 2.0]])))
    spline = Spline(chunk_of(np.zeros(30), q), SECOND)
    at, e = SECOND + round(0.2e9), 1_000
    turned = poses.multiply(
        spline(at + e).orientations, poses.conjugate(spline(at - e).orientations)
    )
    np.testing.assert_allclose(
        poses.logarithm(turned) / 2e-6, spline(at).twists[:, 1], rtol=1e-5, atol=1e-6
    )


def test_full_turns_are_followed_without_a_jump() -> None:
    angle = np.linspace(0.0, 3.0 * np.pi, 200)
    q = poses.exponential(angle[:, None] * np.array([[0.0, 0.0, 1.0]]))
    spline = Spline(chunk_of(np.zeros(200), q * np.sign(np.cos(angle))[:, None]), SECOND)
    assert np.isclose(spline(SECOND + 2 * SECOND).twists[0, 1, 2], 3.0 * np.pi / (199 * 0.02))
