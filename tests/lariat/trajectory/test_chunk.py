from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.trajectory.chunk import Blend, Chunk, Sample, Spline

SECOND = 1_000_000_000


def chunk_of(x: np.ndarray, q: np.ndarray | None = None, dt: float = 0.02) -> Chunk:
    positions = np.zeros((len(x), 1, 3))
    positions[:, 0, 0] = x
    orientations = np.tile(poses.IDENTITY, (len(x), 1, 1)) if q is None else q[:, None]
    return Chunk("writer", 0, SECOND, dt, positions, orientations)


def test_straight_motion_is_reproduced_and_a_bend_is_rounded_by_a_sixth() -> None:
    dt, acceleration = 0.02, 1.5
    t = dt * np.arange(20)
    spline = Spline(chunk_of(0.2 * t), SECOND)
    assert np.isclose(spline(SECOND + round(0.1234e9)).position[0, 0], 0.2 * 0.1234)
    spline = Spline(chunk_of(acceleration * t**2 / 2.0), SECOND)
    middle = spline(SECOND + round(0.2e9))
    assert np.isclose(middle.velocity[0, 0, 0], acceleration * 0.2)
    assert np.isclose(middle.acceleration[0, 0, 0], acceleration)
    assert np.isclose(
        middle.position[0, 0], acceleration * 0.2**2 / 2.0 + acceleration * dt**2 / 6.0
    )


def test_curve_never_exceeds_the_differences_of_its_points() -> None:
    rng = np.random.default_rng(3)
    x = np.cumsum(np.cumsum(rng.normal(size=30))) * 1e-4
    x[-2:] = x[-1]
    spline = Spline(chunk_of(x), SECOND)
    samples = [spline(SECOND + k * 1_000_000) for k in range(650)]
    speeds = [abs(s.velocity[0, 0, 0]) for s in samples]
    accelerations = [abs(s.acceleration[0, 0, 0]) for s in samples]
    assert max(speeds) <= np.max(spline.differences(1)) + 1e-12
    assert max(accelerations) <= np.max(spline.differences(2)) + 1e-9
    assert not samples[-1].velocity.any()
    assert np.isclose(samples[-1].position[0, 0], x[-1])


def test_angular_velocity_is_that_of_the_curve() -> None:
    angles = np.linspace(0.0, 1.2, 30)[:, None] * np.array([0.3, 1.0, -0.4])
    q = poses.multiply(poses.exponential(angles), poses.exponential(np.array([[0.2, 0.1, 2.0]])))
    spline = Spline(chunk_of(np.zeros(30), q), SECOND)
    at, e = SECOND + round(0.2e9), 1_000
    turned = poses.multiply(spline(at + e).orientation, poses.conjugate(spline(at - e).orientation))
    np.testing.assert_allclose(
        poses.logarithm(turned) / 2e-6, spline(at).velocity[:, 1], rtol=1e-5, atol=1e-6
    )


def test_full_turns_are_followed_without_a_jump() -> None:
    angle = np.linspace(0.0, 3.0 * np.pi, 200)
    q = poses.exponential(angle[:, None] * np.array([[0.0, 0.0, 1.0]]))
    spline = Spline(chunk_of(np.zeros(200), q * np.sign(np.cos(angle))[:, None]), SECOND)
    assert np.isclose(spline(SECOND + 2 * SECOND).velocity[0, 1, 2], 3.0 * np.pi / (199 * 0.02))


@pytest.mark.parametrize("duration", [0.06, 0.2])
def test_blend_begins_with_the_motion_before_it_and_ends_on_the_curve(duration: float) -> None:
    spline = Spline(chunk_of(0.1 * 0.02 * np.arange(40)), SECOND)
    origin = Sample(
        np.array([[0.004, -0.003, 0.002]]),
        poses.exponential(np.array([[0.0, 0.02, 0.01]])),
        np.array([[[0.2, 0.05, 0.0], [0.1, 0.0, 0.0]]]),
        np.array([[[1.0, 0.0, -0.5], [0.0, 0.3, 0.0]]]),
    )
    now = SECOND + 30_000_000
    blend = Blend(spline, origin, now, duration)
    begun = blend(now)
    np.testing.assert_allclose(begun.position, origin.position, atol=1e-12)
    np.testing.assert_allclose(begun.velocity, origin.velocity, atol=1e-12)
    np.testing.assert_allclose(begun.acceleration, origin.acceleration, atol=1e-9)
    e = 0.001
    ahead = blend(now + round(e * 1e9))
    np.testing.assert_allclose(
        (ahead.position - begun.position) / e, origin.velocity[:, 0], atol=3e-3
    )
    over = now + round(duration * 1e9)
    np.testing.assert_allclose(blend(over).position, spline(over).position, atol=1e-12)
