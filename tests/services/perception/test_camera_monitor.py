from __future__ import annotations

from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from services.perception.camera_monitor import CameraMonitor

MS = 1_000_000


def test_silence_is_reported_after_its_timeout_and_then_periodically() -> None:
    monitor = CameraMonitor("top")
    reported = [bool(monitor.silence(k * 50 * MS)) for k in range(20)]
    assert reported.index(True) == 7
    assert [k for k, r in enumerate(reported) if r] == [7, 12, 17]


def test_a_frame_ends_the_silence() -> None:
    monitor = CameraMonitor("top")
    monitor.silence(0)
    monitor.frame_arrived(290 * MS)
    assert monitor.silence(500 * MS) == ""
    silence = monitor.silence(600 * MS)
    assert "'top'" in silence
    assert "0.3 s" in silence


def test_a_calibration_is_awaited_for_two_seconds_after_the_first_frame() -> None:
    monitor = CameraMonitor("top")
    monitor.frame_arrived(5000 * MS)
    monitor.frame_arrived(6000 * MS)
    assert monitor.awaits_calibration(6900 * MS)
    assert not monitor.awaits_calibration(7000 * MS)


def test_a_camera_is_frozen_after_nine_identical_frames() -> None:
    monitor = CameraMonitor("top")
    color, depth = CompressedImage(data=b"a"), RawImage(data=b"b")
    assert not monitor.repeated(color, depth)
    for _ in range(7):
        assert monitor.repeated(color, depth)
        assert monitor.frozen() == ""
    assert monitor.repeated(color, depth)
    frozen = monitor.frozen()
    assert "'top'" in frozen
    assert "9 " in frozen
    assert not monitor.repeated(color, RawImage(data=b"c"))
    assert monitor.frozen() == ""
