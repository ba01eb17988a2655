"""Trackers of a scenario's rope and of its marked obstacles."""

from __future__ import annotations

from lariat.geometry.cameras import Camera, Intrinsics
from lariat.perception.centerline.estimate import RopeDimensions
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.centerline.settings import CenterlineSettings
from lariat.perception.markers.marker_obstacles import MarkerObstacles
from lariat.perception.tracking.camera_tracker import CameraTracker
from lariat.perception.tracking.centerline_tracker import CenterlineTracker
from lariat.perception.tracking.extension_tracker import ExtensionTracker
from lariat.perception.tracking.paper_baseline import PaperTracker, PaperTrackerSettings
from lariat.scenario import Scenario
from lariat.scenario.cameras import CameraSetup
from lariat.scenario.extensions import extension
from lariat.scenario.rod_properties import rod_properties
from lariat.scenario.sections import PERCEPTION_METHODS

GRAVITY = 9.81
"""Gravitational acceleration [m/s^2]."""


def rope_dimensions(scenario: Scenario) -> RopeDimensions:
    """Return what perception knows of a scenario's rope."""
    rope = scenario.rope
    weight = GRAVITY * rope.linear_density
    return RopeDimensions(
        rope.length,
        rope.diameter / 2.0,
        rope.node_count,
        weight / rod_properties(rope).bending_stiffness,
    )


def camera_tracker(
    scenario: Scenario, setup: CameraSetup, intrinsics: Intrinsics | None = None
) -> CameraTracker:
    """Return the tracker of a scenario's rope in the images of one of its cameras.

    Args:
        scenario: Rope, grips, obstacles and settings of sensing.
        setup: The camera, one of `scenario.camera_setups`.
        intrinsics: Calibration of its images; that of the scenario if None.

    Raises:
        ConfigurationError: A method from outside cannot be created.
    """
    s, camera = scenario.sensing, Camera(intrinsics or setup.intrinsics, setup.T_world_camera)
    rope = rope_dimensions(scenario)
    own = extension("sensing.method", s.method, PERCEPTION_METHODS)
    if own is not None:
        return ExtensionTracker(own, camera, rope)
    if s.method == "paper":
        fixed_end = scenario.grips(scenario.start)[0]
        return PaperTracker(camera, rope, fixed_end, PaperTrackerSettings(threshold=s.threshold))
    settings = CenterlineSettings(
        threshold=s.threshold,
        rope_color=s.rope_color,
        depth_sigma=s.depth_noise,
        depth_quantum=s.depth_quantum,
    )
    estimator = CenterlineEstimator(camera, rope, settings)
    return CenterlineTracker(estimator, rod_properties(scenario.rope), scenario.bodies)


def needs_brightness_alone(scenario: Scenario) -> bool:
    """Return whether brightness alone detects the rope, so that no colours need be decoded."""
    s = scenario.sensing
    own = extension("sensing.method", s.method, PERCEPTION_METHODS) is not None
    return not own and (s.method == "paper" or s.rope_color is None)


def marker_obstacles(scenario: Scenario) -> MarkerObstacles | None:
    """Return the tracker of the scenario's marked obstacles; None when nothing carries a marker."""
    marked = scenario.marked_obstacles
    if not marked and scenario.sensing.flange_marker is None:
        return None
    bodies = {o.name: o for o in scenario.bodies}
    return MarkerObstacles(
        {o.marker: bodies[name] for name, o in marked.items()},
        {o.marker: o.marker_size for o in marked.values()},
        scenario.rope.diameter,
    )
