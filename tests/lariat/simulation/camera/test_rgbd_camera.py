from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.obstacles import TABLE, Obstacle, scene_distance
from lariat.geometry.poses import Pose
from lariat.simulation.camera.marker_plates import MarkerPlate
from lariat.simulation.camera.rgbd_camera import RgbdCamera, Tube
from lariat.simulation.camera.sensor_noise import NOISELESS, SensorNoise

VIEW = Camera(
    Intrinsics.symmetric(320, 240, math.radians(60.0)),
    looking_at((0.05, -0.6, 0.6), (0.0, 0.0, 0.1)),
)
RADIUS = 0.01
TILT = tuple(poses.exponential(np.array([0.4, -0.3, 0.8])))
BODIES = (
    TABLE,
    Obstacle("cylinder", (-0.15, 0.0, 0.1), TILT, radius=0.03, height=0.15),
    Obstacle("box", (0.15, 0.05, 0.1), TILT, size=(0.05, 0.1, 0.15)),
    Obstacle("sphere", (0.0, 0.1, 0.15), radius=0.05),
    Obstacle("capsule", (0.0, -0.15, 0.08), TILT, radius=0.03, height=0.1),
    Obstacle("cone", (0.12, -0.2, 0.08), TILT, radius=0.05, height=0.12),
    Obstacle("cone", (-0.12, -0.2, 0.08), (0.0, 1.0, 0.0, 0.0), radius=0.05, height=0.12),
)


def arch() -> Float64[np.ndarray, "n 3"]:
    x = np.linspace(-0.2, 0.2, 20)
    return np.stack([x, 0.3 * x, 0.25 - 2.0 * x**2], axis=1)


def surface_distance(
    points: Float64[np.ndarray, "k 3"], chain: Float64[np.ndarray, "n 3"]
) -> Float64[np.ndarray, "k"]:
    """Signed distance to the obstacles and the rope, written without any ray."""
    distance = scene_distance(points, BODIES)
    for a, b in itertools.pairwise(chain):
        t = np.clip((points - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
        gap = np.linalg.norm(points - a - t[:, None] * (b - a), axis=1)
        distance = np.minimum(distance, gap - RADIUS)
    return distance


def test_every_depth_is_the_first_surface_on_its_ray() -> None:
    chain = arch()
    depth = RgbdCamera(VIEW, NOISELESS).take(chain, RADIUS, BODIES).depth / 1000.0
    rows, columns = np.mgrid[0:240:3, 0:320:3]
    pixels = np.stack([columns.ravel(), rows.ravel()], axis=1).astype(float)
    measured = depth[rows.ravel(), columns.ravel()]
    seen = measured > 0.0
    assert np.mean(seen) > 0.8
    on = surface_distance(VIEW.back_project(pixels[seen], measured[seen]), chain)
    # Half a millimetre of quantisation along the ray.
    assert np.max(np.abs(on)) < 0.7e-3
    for part in np.linspace(0.1, 0.99, 30):
        before = VIEW.back_project(pixels[seen], part * (measured[seen] - 0.001))
        assert np.min(surface_distance(before, chain)) > -1e-4


def test_rays_past_everything_have_no_depth() -> None:
    up = Camera(VIEW.intrinsics, looking_at((0.0, 0.0, 0.5), (0.0, 1.0, 1.5)))
    frame = RgbdCamera(up, NOISELESS).take(arch() - [0.0, 1.0, 0.0], RADIUS, BODIES)
    assert np.all(frame.depth[:100] == 0)


def test_depth_noise_has_its_standard_deviation() -> None:
    flat = (Obstacle("half_space", (0.0, 0.0, 0.0)),)
    down = Camera(VIEW.intrinsics, looking_at((0.0, 0.0, 0.8), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    camera = RgbdCamera(down, SensorNoise(depth_sigma=0.002, depth_bias=0.005), seed=3)
    frames = [
        camera.take(arch() + np.array([0.0, 0.0, 5.0]), RADIUS, flat, frame=k) for k in range(2)
    ]
    error = [f.depth / 1000.0 - 0.805 for f in frames]
    # Quantisation adds quantum^2 / 12.
    assert np.std(error[0]) == pytest.approx(math.hypot(0.002, 0.001 / math.sqrt(12)), rel=0.02)
    assert abs(np.mean(error[0])) < 2e-5
    assert abs(np.corrcoef(error[0].ravel(), error[1].ravel())[0, 1]) < 0.02
    shifted = np.corrcoef(error[0][:, 1:].ravel(), error[0][:, :-1].ravel())[0, 1]
    assert abs(shifted) < 0.02


def test_half_the_edge_pixels_drop_out() -> None:
    noise = SensorNoise(depth_sigma=0.0, edge_mixing=0.0, edge_dropout=0.5)
    exact = RgbdCamera(VIEW, NOISELESS).take(arch(), RADIUS, BODIES).depth
    noisy = RgbdCamera(VIEW, noise).take(arch(), RADIUS, BODIES).depth
    z = exact.astype(float) / 1000.0
    inner = z[1:-1, 1:-1]
    shifts = (z[:-2, 1:-1], z[2:, 1:-1], z[1:-1, :-2], z[1:-1, 2:])
    edge = np.max([np.abs(s - inner) for s in shifts], axis=0) > 0.021
    edge &= inner > 0.0
    assert np.mean(noisy[1:-1, 1:-1][edge] == 0) == pytest.approx(0.5, abs=0.07)


def test_a_frame_repeats_with_its_seed() -> None:
    def take(seed: int, frame: int) -> tuple[bytes, bytes]:
        picture = RgbdCamera(VIEW, seed=seed).take(arch(), RADIUS, BODIES, frame=frame)
        return picture.color.tobytes(), picture.depth.tobytes()

    assert take(5, 7) == take(5, 7)
    assert take(5, 7)[1] != take(5, 8)[1]
    assert take(5, 7)[1] != take(6, 7)[1]


def test_a_frame_depends_on_its_own_scene_only() -> None:
    # Half out of view at the top, and on a lower table, after the usual scene.
    chain, lower = arch() + np.array([0.0, 0.1, 0.35]), Obstacle("half_space", (0.0, 0.0, -0.1))
    camera = RgbdCamera(VIEW, seed=2)
    camera.take(arch(), RADIUS, BODIES)
    for bodies, colors in (((lower, *BODIES[1:]), None), (BODIES, [(90, 60, 30)] * len(BODIES))):
        after = camera.take(chain, RADIUS, bodies, colors, frame=1)
        alone = RgbdCamera(VIEW, seed=2).take(chain, RADIUS, bodies, colors, frame=1)
        np.testing.assert_array_equal(after.color, alone.color)
        np.testing.assert_array_equal(after.depth, alone.depth)


def test_a_frame_shows_each_body_where_it_is_however_it_moved_before() -> None:
    def scene(x: float, z: float) -> tuple[Obstacle, ...]:
        return (*BODIES, Obstacle("sphere", (x, 0.0, 0.2), radius=0.04), BODIES[3].moved((0, 0, z)))

    camera = RgbdCamera(VIEW, seed=2)
    shifts = ((0.1, 0.3), (0.1, 0.3), (0.1, 0.25), (0.12, 0.25), (0.12, 0.25), (0.1, 0.3))
    for frame, (x, z) in enumerate(shifts):
        # The sphere of `BODIES` is left out in every other frame.
        bodies = tuple(b for k, b in enumerate(scene(x, z)) if frame % 2 or k != 3)
        after = camera.take(arch(), RADIUS, bodies, frame=frame)
        alone = RgbdCamera(VIEW, seed=2).take(arch(), RADIUS, bodies, frame=frame)
        np.testing.assert_array_equal(after.color, alone.color)
        np.testing.assert_array_equal(after.depth, alone.depth)


def test_a_frame_keeps_nothing_of_the_rope_and_the_plates_before_it() -> None:
    flat = poses.IDENTITY
    camera = RgbdCamera(VIEW, seed=2)
    for frame, shift in enumerate((0.0, 0.06, 0.06, 0.02, 0.02, -0.1)):
        chain = arch() + np.array([0.0, shift, shift])
        places = ((0.1, -0.15, 0.01), (-0.15, -0.15, 0.01 + abs(shift)), (0.2, shift, 0.01))
        plates = [MarkerPlate(Pose(np.array(p), flat), 0.05, k) for k, p in enumerate(places)]
        after = camera.take(chain, RADIUS, BODIES, frame=frame, plates=plates)
        alone = RgbdCamera(VIEW, seed=2).take(chain, RADIUS, BODIES, frame=frame, plates=plates)
        np.testing.assert_array_equal(after.color, alone.color)
        np.testing.assert_array_equal(after.depth, alone.depth)


def test_an_obstacle_in_front_hides_the_rope() -> None:
    chain = arch()
    camera = RgbdCamera(VIEW, NOISELESS)
    eye = VIEW.T_world_camera.position
    wall = Obstacle("sphere", tuple(eye + 0.6 * (chain[10] - eye)), radius=0.05)
    (u, v), _ = VIEW.project(chain[10])
    pixel = round(float(v)), round(float(u))
    assert camera.take(chain, RADIUS).color[pixel][0] > 200
    assert camera.take(chain, RADIUS, [wall]).color[pixel][0] < 100


@pytest.mark.parametrize(("height", "visible"), [(0.32, True), (0.28, False)])
def test_of_two_ropes_in_contact_the_upper_one_is_seen(height: float, visible: bool) -> None:
    view = Camera(VIEW.intrinsics, looking_at((0.0, 0.0, 0.8), (0.0, 0.0, 0.3), (0.0, 1.0, 0.0)))
    chain = np.array([[-0.1, 0.0, 0.3], [0.1, 0.0, 0.3]])
    crossing = Tube(np.array([[0.0, -0.1, height], [0.0, 0.1, height]]), RADIUS, (200, 0, 0))
    camera = RgbdCamera(view, NOISELESS, background=0)
    frame = camera.take(chain, RADIUS, tubes=[crossing])
    (u, v), _ = view.project(chain.mean(axis=0))
    at = np.s_[round(float(v)) - 3 : round(float(v)) + 4, round(float(u)) - 3 : round(float(u)) + 4]
    green = frame.color[at][..., 1]
    assert np.all(green < 20) if visible else np.all(green > 200)
    nearest = 0.8 - max(height, 0.3) - RADIUS
    assert np.min(frame.depth[at]) == pytest.approx(1000.0 * nearest, abs=1.0)


def test_brightness_adds_up_to_the_rope_s_projected_width() -> None:
    chain = np.array([[-0.1, 0.0, 0.3], [0.1, 0.0, 0.3]])
    view = Camera(VIEW.intrinsics, looking_at((0.0, 0.0, 1.1), (0.0, 0.0, 0.3), (0.0, 1.0, 0.0)))
    frame = RgbdCamera(view, NOISELESS, background=0).take(chain, 0.004)
    column = frame.color[:, 160, 0].astype(float) / 255.0
    width = 2.0 * 0.004 * view.intrinsics.fx / 0.8
    # Shading dims the flanks: a headlight gives a cylinder 0.6 + 0.4 pi / 4 of its width.
    assert np.sum(column) == pytest.approx(width * (0.6 + 0.1 * math.pi), rel=0.05)


def test_impossible_noise_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match="edge_dropout"):
        SensorNoise(edge_dropout=1.5)
