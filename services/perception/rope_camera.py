"""One camera of perception: its frames, its faults, and the rope and markers in its images."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from jaxtyping import Float64

from lariat.geometry.cameras import Intrinsics
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import CenterlineEstimate
from lariat.perception.markers.marker_obstacles import MarkerObstacles, ObstacleMove
from lariat.perception.other_ropes.thin_structures import RgbdView
from lariat.perception.rgbd.line_of_sight import Sight, line_of_sight
from lariat.perception.tracking.camera_tracker import CameraTracker
from services.perception.camera_monitor import CameraMonitor
from services.perception.camera_view import CameraView, Images
from shared import topics
from shared.messages import stamp_of
from shared.runtime.service import Inbox


@dataclass(frozen=True)
class Exposure:
    """Undistorted images of one instant."""

    images: Images
    stamp: int
    """Time of the exposure [ns]."""
    arrival: int
    """Time of the step in which it arrived [ns]."""


@dataclass(frozen=True)
class CameraFault:
    """Reason why a camera gives no images."""

    reason: str
    stamp: int
    """Time at which it was found [ns]."""


class RopeCamera:
    """Camera by its name, with the tracker of the rope in its images."""

    def __init__(
        self,
        name: str,
        new_tracker: Callable[[Intrinsics], CameraTracker],
        markers: MarkerObstacles | None,
        grey: bool = False,
    ) -> None:
        self._new_tracker, self._markers = new_tracker, markers
        self._color = topics.CAMERA_COLOR.at(name)
        self._depth = topics.CAMERA_DEPTH.at(name)
        self._calibration = topics.CAMERA_CALIBRATION.at(name)
        self.reads = (self._color, self._depth, self._calibration)
        # Cameras publish it last.
        self.wakes = self._depth
        self._view, self._monitor = CameraView(name, grey), CameraMonitor(name)
        self._tracker: CameraTracker | None = None
        self._tracked_calibration = 0
        self._newest_color = CompressedImage()
        self._processed: RgbdView | None = None
        self.exposure: Exposure | None = None
        """Newest images that are not processed yet."""
        self.fault = ""
        """Reason why it gives no images; empty while it does."""

    def receive(self, inbox: Inbox, now: int) -> CameraFault | None:
        """Take the newest frame, or return the fault that is due to be reported at `now` [ns]."""
        frame = inbox.joined(self._color, self._depth)
        if frame is None:
            return self._failed(self._monitor.silence(now), now)
        self._monitor.frame_arrived(now)
        color, depth = frame[0].message, frame[1].message
        stamp = stamp_of(color)
        calibration = inbox.latest(self._calibration)
        if calibration is None and self._monitor.awaits_calibration(now):
            return None
        if self._monitor.repeated(color, depth):
            # A repeated frame is no new measurement, even before the camera counts as frozen.
            return self._failed(self._monitor.frozen(), stamp)
        images = self._view.images(color, depth, calibration.message if calibration else None)
        if isinstance(images, str):
            return self._failed(images, stamp)
        self.exposure, self.fault = Exposure(images, stamp, now), ""
        self._newest_color = color
        return None

    @property
    def marked_in_view(self) -> frozenset[str]:
        """Names of the obstacles whose markers it sees; none while it fails."""
        return self._markers.in_view if self._markers and not self.fault else frozenset()

    def follow_markers(self, obstacles: Sequence[Obstacle]) -> list[ObstacleMove]:
        """Return the obstacles that have moved in the newest images, and remove their markers."""
        exposure = self.exposure
        if self._markers is None or exposure is None:
            return []
        camera = self._calibrated_tracker().camera
        (color, depth), stamp = exposure.images, exposure.stamp
        masked, moves = self._markers.update(color, depth, stamp, camera, obstacles)
        self.exposure = Exposure((masked, depth), stamp, exposure.arrival)
        return moves

    def track(self, left: Pose | None, right: Pose | None) -> CenterlineEstimate:
        """Estimate the rope in the newest images, processed with that; None is no known grip."""
        assert self.exposure is not None
        (color, depth), stamp = self.exposure.images, self.exposure.stamp
        tracker, self.exposure = self._calibrated_tracker(), None
        estimate = tracker.track(color, depth, left, right, stamp)
        message = self._newest_color
        rgb = (lambda: color) if color.ndim == 3 else (lambda: self._view.color(message))
        self._processed = RgbdView(rgb, depth, tracker.camera, estimate.bias)
        return estimate

    @property
    def processed(self) -> RgbdView:
        """Images that were processed last."""
        assert self._processed is not None
        return self._processed

    def look(self, points: Float64[np.ndarray, "k 3"], radius: float) -> Sight:
        """Return what the images that were processed last show at points of a rope's axis."""
        if self._processed is None:
            nothing = np.zeros(len(points), bool)
            return Sight(nothing, nothing)
        return line_of_sight(points, radius, self._processed.depth, self._processed.camera)

    def adopt(
        self, estimate: CenterlineEstimate, left: Pose | None, right: Pose | None, stamp: int
    ) -> None:
        """Take over the estimate of all cameras; arguments as in `CameraTracker.adopt`."""
        if self._tracker is not None:
            self._tracker.adopt(estimate, left, right, stamp)

    def forget(self) -> None:
        """Drop what is known of the rope from earlier images."""
        if self._tracker is not None:
            self._tracker.forget()

    def _failed(self, reason: str, stamp: int) -> CameraFault | None:
        if not reason:
            return None
        self.fault = reason
        return CameraFault(reason, stamp)

    def _calibrated_tracker(self) -> CameraTracker:
        """Tracker for the newest calibration; a changed calibration creates a new one."""
        intrinsics = self._view.intrinsics
        assert intrinsics is not None
        if self._tracker is None or self._tracked_calibration != self._view.calibration_count:
            self._tracker = self._new_tracker(intrinsics)
            self._tracked_calibration = self._view.calibration_count
        return self._tracker
