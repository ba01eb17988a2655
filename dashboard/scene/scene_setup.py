"""Parts of the scene that are set once: background, light, first viewpoint, camera frustum."""

from __future__ import annotations

from importlib.util import find_spec
from typing import NamedTuple

import numpy as np
import viser
from jaxtyping import Float64

from dashboard import palette
from lariat.arms.description import arm_description
from lariat.geometry import poses
from lariat.scenario import SIDES, Scenario
from lariat.scenario.cameras import CameraSetup
from lariat.scenario.placement import base_of

VERTICAL_FIELD_OF_VIEW = float(np.deg2rad(42.0))
"""Field of view of the browser's camera [rad]."""
VIEW_DIRECTION = np.array([0.88, -1.3, 0.8])
"""Position of the browser's camera from the middle of the scene, relative to its size [-]."""
TARGET_DROP = 0.08
"""Distance of the view's target below the middle of the scene, relative to its size [-]."""
FULL_ASPECT = 1.0
"""Width of the view over its height below which the view moves back [-]."""
FIRST_ASPECT = 0.79
"""Width of the view over its height where the window has 1280 by 800 pixels [-]."""
NARROW_ASPECT = 0.7
"""Width of the view over its height below which a window begins further back, as a phone's [-]."""
TURN = np.deg2rad(15.0)
"""Step by which the view turns about the scene until no arm hides the rope [rad]."""
ARM_MARGIN = 0.015
"""Distance that the view keeps between arm and rope, in the plane of the rope [m]."""
ROPE_SAMPLES = 30
"""Points of the rope that must be seen [-]."""
ARM_SHARE = 0.5
"""Share of the way from a grip to the base of its arm that is in view [-]."""
MIN_SCENE_SIZE = 0.5
"""Least size of the scene, relative to the rope's length [-]."""
DETOUR = 0.01
"""Distance between a view that is asked for and the one before it, along each axis [m]."""
FRUSTUM_SCALE = 0.06
"""Scale of the camera's frustum in viser's units [-]."""


class Viewpoint(NamedTuple):
    """Pose and lens of a browser's camera."""

    position: Float64[np.ndarray, "3"]
    """Centre of projection [m]."""
    target: Float64[np.ndarray, "3"]
    """Point in the centre of the image [m]."""
    field_of_view: float
    """Vertical field of view [rad]."""


def initial_viewpoint(scenario: Scenario, aspect: float = FIRST_ASPECT) -> Viewpoint:
    """Viewpoint above, with start, goal, obstacles and the fore of the arms in view.

    It is in front of the scene, turned about it where an arm would hide the rope.
    """
    grips = [g.position for s in (scenario.start, scenario.goal) for g in scenario.grips(s)]
    centres = [o.position for o in scenario.bodies if o.shape != "half_space"]
    points = np.array(grips + centres + _forearms(scenario))
    middle = (points.min(axis=0) + points.max(axis=0)) / 2.0
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    size = max(extent, MIN_SCENE_SIZE * scenario.rope.length)
    target = middle - np.array([0.0, 0.0, TARGET_DROP * size])
    offset = (middle + size * VIEW_DIRECTION - target) * max(FULL_ASPECT / aspect, 1.0)
    return Viewpoint(
        position=target + _unhidden(scenario, target, offset),
        target=target,
        field_of_view=VERTICAL_FIELD_OF_VIEW,
    )


def _aspect(client: viser.ClientHandle) -> float:
    """Width of a window over its height; it may say that it has neither."""
    return max(client.camera.image_width, 1) / max(client.camera.image_height, 1)


def show_whole(client: viser.ClientHandle, scenario: Scenario) -> None:
    """Move the camera of a window to the first viewpoint for its shape."""
    viewpoint = initial_viewpoint(scenario, _aspect(client))
    # viser sends no view that it believes a browser to have, and a slow browser may have left it
    # since: the way there leads over another one.
    client.camera.position = viewpoint.position + DETOUR
    client.camera.position = viewpoint.position
    client.camera.look_at = viewpoint.target


def _unhidden(
    scenario: Scenario, target: Float64[np.ndarray, "3"], offset: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "3"]:
    """Offset of the camera, turned about the target as little as lets the rope be seen [m]."""
    ropes, (centres, radii) = _ropes(scenario), _arm_spheres(scenario)
    if not len(radii):
        return offset
    turns = sorted((TURN * k for k in range(-11, 13)), key=abs)
    views = [poses.rotate(poses.exponential(np.array([0.0, 0.0, t])), offset) for t in turns]
    # The first of those that hide least.
    return min(views, key=lambda view: _hidden_count(target + view, ropes, centres, radii))


def _hidden_count(
    eye: Float64[np.ndarray, "3"],
    points: Float64[np.ndarray, "n 3"],
    centres: Float64[np.ndarray, "k 3"],
    radii: Float64[np.ndarray, "k"],
) -> int:
    """Number of points that spheres hide from an eye."""
    rays = points - eye
    along = (centres - eye) @ rays.T / np.sum(rays**2, axis=1)
    nearest = eye + np.clip(along, 0.0, 1.0)[..., None] * rays
    distances = np.linalg.norm(nearest - centres[:, None], axis=2)
    return int(np.any((distances < radii[:, None] + ARM_MARGIN) & (along < 1.0), axis=0).sum())


def _ropes(scenario: Scenario) -> Float64[np.ndarray, "n 3"]:
    """Points of the rope at start and goal, as a parabola between the grips [m]."""
    t = np.linspace(0.0, 1.0, ROPE_SAMPLES)[1:-1, None]
    points = []
    for shape in (scenario.start, scenario.goal):
        left, right = (grip.position for grip in scenario.grips(shape))
        span = float(np.linalg.norm(right - left))
        sag = np.sqrt(max(0.375 * span * (scenario.rope.length - span), 0.0))
        points.append((1.0 - t) * left + t * right - 4.0 * t * (1.0 - t) * np.array([0, 0, sag]))
    return np.concatenate(points)


def _arm_spheres(
    scenario: Scenario,
) -> tuple[Float64[np.ndarray, "k 3"], Float64[np.ndarray, "k"]]:
    """Spheres around the links of all arms at start and goal: centres and radii [m]."""
    centres, radii = [np.zeros((0, 3))], [np.zeros(0)]
    if find_spec("pinocchio") is not None:
        # Imported late: the dashboard runs without Pinocchio, and draws no arms then.
        from lariat.arms.installation import kinematics_of

        for index, side in enumerate(SIDES):
            try:
                kinematics = kinematics_of(scenario, side)
            except ValueError:
                # A recording's scenario may name a file of another machine.
                continue
            if kinematics is None:
                continue
            for shape in (scenario.start, scenario.goal):
                joints = kinematics.solve_anywhere(scenario.grips(shape)[index])
                if joints is not None:
                    path, sizes = kinematics.link_spheres(joints[None])
                    centres.append(path[0])
                    radii.append(sizes)
    return np.concatenate(centres), np.concatenate(radii)


def _forearms(scenario: Scenario) -> list[Float64[np.ndarray, "3"]]:
    """Points beside start and goal, towards the bases of the arms that hold them [m]."""
    points = []
    for index, side in enumerate(SIDES):
        if arm_description(scenario, side) is None:
            continue
        base = base_of(scenario.end(side)).position
        for shape in (scenario.start, scenario.goal):
            grip = scenario.grips(shape)[index].position
            points.append(grip + ARM_SHARE * np.array([*(base - grip)[:2], 0.0]))
    return points


def set_up(server: viser.ViserServer, scenario: Scenario) -> None:
    """Set background, light and first viewpoint."""
    scene = server.scene
    scene.set_up_direction("+z")
    set_theme(server, light=False)
    # The default lights of viser bleach every colour.
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere(
        "/light/sky", sky_color=(214, 226, 255), ground_color=(70, 74, 84), intensity=1.7
    )
    scene.add_light_directional(
        "/light/lamp", intensity=2.0, position=(0.8, -1.0, 2.2), cast_shadow=True
    )
    viewpoint = initial_viewpoint(scenario)
    server.initial_camera.position = viewpoint.position
    server.initial_camera.look_at = viewpoint.target
    server.initial_camera.fov = viewpoint.field_of_view

    @server.on_client_connect
    def _(client: viser.ClientHandle) -> None:
        if _aspect(client) < NARROW_ASPECT:
            show_whole(client, scenario)


def set_theme(page: viser.ViserServer | viser.ClientHandle, light: bool) -> None:
    """Set the colours of panels and background, of all windows or of one."""
    page.gui.configure_theme(
        dark_mode=not light, show_logo=False, show_share_button=False, brand_color=palette.BRAND
    )
    weight = np.linspace(0.0, 1.0, 128)[:, None, None]
    top, bottom = (
        (palette.LIGHT_TOP, palette.LIGHT_BOTTOM)
        if light
        else (palette.BACKGROUND_TOP, palette.BACKGROUND_BOTTOM)
    )
    colors = (1.0 - weight) * np.array(top) + weight * np.array(bottom)
    page.scene.set_background_image(
        np.repeat(colors, 4, axis=1).round().astype(np.uint8), format="png"
    )


def add_camera(scene: viser.SceneApi, camera: CameraSetup) -> viser.CameraFrustumHandle:
    """Draw the frustum of a camera at its known pose."""
    pose = camera.T_world_camera
    width, height = camera.resolution
    half_height = np.tan(np.deg2rad(camera.field_of_view) / 2.0) * height / width
    return scene.add_camera_frustum(
        f"/camera/{camera.name}",
        fov=2.0 * float(np.arctan(half_height)),
        aspect=width / height,
        scale=FRUSTUM_SCALE,
        color=palette.CAMERA,
        thickness=0.002,
        position=pose.position,
        wxyz=pose.orientation,
    )
