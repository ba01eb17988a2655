"""A RealSense as its maker's library plays it: a software device, recorded, then read back."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from lariat.configuration import ConfigurationError
from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.obstacles import TABLE
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.simulation.camera.rgbd_camera import Frame, RgbdCamera
from lariat.simulation.camera.sensor_noise import NOISELESS
from services.camera.service import CameraService
from services.camera.stream import CameraStream
from services.perception.decoding import decode_frame
from shared.messages import stamp_of
from shared.runtime.service import Inbox, Publication
from tests.services.perception.scenes import CAMERA, ROPE, curve, grips

rs = pytest.importorskip(
    "pyrealsense2",
    reason="the RealSense library is not installed; it is the extra camera of the stack",
)

from services.camera.realsense import RealSense  # noqa: E402

SIZE = (640, 480)
BASELINE = np.array([0.015, 0.0, 0.0])
"""From the colour camera to the depth camera, in the colour camera's frame [m]."""
FRAMES, PERIOD = 15, 1.0 / 30.0
BEGAN = 1_000_000.0
"""Of the recording, by the device's clock [ms]."""


def eyes() -> tuple[Camera, Camera]:
    """The colour camera, and the depth camera beside it, with a wider lens."""
    pose = CAMERA.T_world_camera
    beside = pose.position + poses.rotate(pose.orientation, BASELINE)
    return CAMERA, Camera(
        Intrinsics(*SIZE, 450.0, 450.0, 318.0, 242.0), Pose(beside, pose.orientation)
    )


def stream(sensor: object, kind: object, camera: Camera, number: int, bytes_a_pixel: int) -> object:
    i, lens, made = camera.intrinsics, rs.intrinsics(), rs.video_stream()
    lens.width, lens.height, lens.model = i.width, i.height, rs.distortion.none
    lens.fx, lens.fy, lens.ppx, lens.ppy, lens.coeffs = i.fx, i.fy, i.cx, i.cy, [0.0] * 5
    made.type, made.index, made.uid, made.intrinsics = kind, 0, number, lens
    made.width, made.height, made.fps, made.bpp = i.width, i.height, 30, bytes_a_pixel
    made.fmt = rs.format.z16 if bytes_a_pixel == 2 else rs.format.rgb8
    return sensor.add_video_stream(made, True)  # pyright: ignore


def shown(sensor: object, profile: object, pixels: np.ndarray, number: int) -> None:
    frame = rs.software_video_frame()
    frame.bpp = pixels.itemsize * (pixels.shape[2] if pixels.ndim == 3 else 1)
    frame.pixels, frame.stride = pixels, frame.bpp * pixels.shape[1]
    frame.timestamp, frame.frame_number = BEGAN + 1e3 * PERIOD * number, number + 1
    frame.domain, frame.profile = rs.timestamp_domain.hardware_clock, profile
    frame.depth_units = 0.001
    sensor.on_video_frame(frame)  # pyright: ignore


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("device") / "rope.db3"
    device = rs.software_device()
    device.register_info(rs.camera_info.name, "software")
    device.register_info(rs.camera_info.serial_number, "1")
    sensors = device.add_sensor("Stereo Module"), device.add_sensor("RGB Camera")
    color, depth = eyes()
    sensors[0].add_read_only_option(rs.option.depth_units, 0.001)
    profiles = (
        stream(sensors[0], rs.stream.depth, depth, 1, 2).as_video_stream_profile(),  # pyright: ignore
        stream(sensors[1], rs.stream.color, color, 2, 3).as_video_stream_profile(),  # pyright: ignore
    )
    away = rs.extrinsics()
    away.rotation, away.translation = [1, 0, 0, 0, 1, 0, 0, 0, 1], BASELINE.tolist()
    profiles[0].register_extrinsics_to(profiles[1], away)
    recorder = rs.recorder(str(file), device)
    queue = rs.frame_queue(50)
    recorded = recorder.query_sensors()
    for sensor, profile in zip(recorded, profiles, strict=True):
        sensor.open(profile)
        sensor.start(queue)
    for number in range(FRAMES):
        shown(sensors[0], profiles[0], pictured(depth).depth, number)
        shown(sensors[1], profiles[1], pictured(color).color, number)
        time.sleep(PERIOD)
    for sensor in recorded:
        sensor.stop()
        sensor.close()
    return file


def pictured(camera: Camera) -> Frame:
    return RgbdCamera(camera, NOISELESS).take(curve(3), ROPE.radius, (TABLE,))


def played(file: Path) -> list[Publication]:
    service = CameraService(
        [CameraStream(DEFAULT_CAMERA, RealSense("", SIZE, 30, file), latency=0.0)]
    )
    inbox, said, end = Inbox({}, {}), [], time.monotonic() + 5.0
    while len(said) < 3 + 2 * (FRAMES - 8) and time.monotonic() < end:
        said += list(service.step(inbox, time.monotonic_ns()))
        time.sleep(0.004)
    service.close()
    return said


def test_depth_of_a_device_lies_on_the_pixels_of_its_colour(recording: Path) -> None:
    said = [p.message for p in played(recording)]
    calibration, color, depth = said[:3]
    i = CAMERA.intrinsics
    np.testing.assert_allclose(
        list(calibration.K)[:6], [i.fx, 0.0, i.cx, 0.0, i.fy, i.cy], atol=0.01
    )
    images = decode_frame(color, depth)
    assert not isinstance(images, str)
    # The rope is seen where it is only if the one image lies on the other.
    nodes = curve(3)
    found = CenterlineEstimator(CAMERA, ROPE).estimate(*images, *grips(nodes))
    assert np.mean(np.linalg.norm(found.positions - nodes, axis=1)) < 1.5e-3


def test_exposures_of_a_device_are_stamped_as_far_apart_as_it_took_them(recording: Path) -> None:
    said = [p.message for p in played(recording)]
    stamps = np.array([stamp_of(m) for m in said if isinstance(m, CompressedImage)])
    steps = np.diff(stamps) * 1e-9 / PERIOD
    # No exposure twice; the offset between the clocks is the least seen so far, so it may shrink.
    assert np.all(steps > 0.3)
    assert np.median(np.abs(steps - np.rint(steps))) < 0.1


def test_a_device_that_is_not_there_is_named() -> None:
    with pytest.raises(ConfigurationError, match="camera 0815 at 640 x 480, 30 Hz"):
        RealSense("0815", SIZE, 30)
