"""Checks of the scene and of images of it."""

from __future__ import annotations

from foxglove_schemas_protobuf.CameraCalibration_pb2 import CameraCalibration
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from lariat.files.image_header import MAX_PIXEL_COUNT, check_image
from lariat.geometry.obstacle_checks import MAX_OBSTACLES, check_obstacle
from shared import messages
from shared.messages.checks.values import Checks, check_length, check_places

MAX_DISTORTION_COUNT = 14
"""Largest number of distortion coefficients of a camera."""


def _check_scene(message: messages.Scene) -> None:
    if len(message.obstacles) > MAX_OBSTACLES:
        raise ValueError(f"{len(message.obstacles)} obstacles, more than {MAX_OBSTACLES}")
    for obstacle in messages.scene_obstacles(message):
        check_obstacle(obstacle)


def _check_scene_motion(message: messages.SceneMotion) -> None:
    if len(message.motions) > MAX_OBSTACLES:
        raise ValueError(f"{len(message.motions)} motions, more than {MAX_OBSTACLES}")
    for motion in message.motions:
        check_length(f"{motion.name!r}: position", motion.position, 3)
        check_length(f"{motion.name!r}: velocity", motion.velocity, 3)
        check_length(f"{motion.name!r}: waypoints", motion.waypoints, 3 * len(motion.times))
        check_places(f"{motion.name!r}: position", motion.position)
        check_places(f"{motion.name!r}: waypoints", motion.waypoints)
    messages.obstacle_motions(message)


def _check_color(message: CompressedImage) -> None:
    check_image(message.data)


def _check_pixel_count(width: int, height: int) -> None:
    if not 0 < width * height <= MAX_PIXEL_COUNT:
        raise ValueError(f"{width} x {height} pixels; an image has 1 to {MAX_PIXEL_COUNT}")


def _check_depth(message: RawImage) -> None:
    _check_pixel_count(message.width, message.height)


def _check_calibration(message: CameraCalibration) -> None:
    _check_pixel_count(message.width, message.height)
    check_length("K", message.K, 9)
    if not (message.K[0] > 0.0 and message.K[4] > 0.0):
        raise ValueError(f"focal lengths are {message.K[0]:g} and {message.K[4]:g} pixels")
    if len(message.D) > MAX_DISTORTION_COUNT:
        raise ValueError(f"D has {len(message.D)} values, more than {MAX_DISTORTION_COUNT}")


CHECKS: Checks = {
    messages.Scene: _check_scene,
    messages.SceneMotion: _check_scene_motion,
    CompressedImage: _check_color,
    RawImage: _check_depth,
    CameraCalibration: _check_calibration,
}
"""Check of each type of message."""
