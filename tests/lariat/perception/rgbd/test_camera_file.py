"""Camera files of RealSense, Open3D, OpenCV and ROS."""

from __future__ import annotations

import json

import pytest

from lariat.perception.rgbd.camera_file import read_camera

ROWS = [600.0, 0.0, 320.0, 0.0, 601.0, 240.0, 0.0, 0.0, 1.0]
COLUMNS = [600.0, 0.0, 0.0, 0.0, 601.0, 0.0, 320.0, 240.0, 1.0]
SIZE = {"width": 640, "height": 480}
REALSENSE = {**SIZE, "fx": 600.0, "fy": 601.0, "ppx": 320.0, "ppy": 240.0}
DISTORTED = [0.1, -0.2, 0.0, 0.0, 0.0]
MATRIX = """
camera_matrix:{tag}
   rows: 3
   cols: 3
   data: {rows}
distortion_coefficients:{tag}
   rows: 1
   cols: 5
   data: {distorted}
"""
CALIBRATION = "image_width: 640\nimage_height: 480" + MATRIX
INFO = "header:\n  frame_id: camera\nheight: 480\nwidth: 640\ndistortion_model: plumb_bob\n"


def listed(name: str, numbers: list[float]) -> str:
    return f"{name}:\n" + "".join(f"- {x}\n" for x in numbers)


@pytest.mark.parametrize(
    ("text", "distortion", "model"),
    [
        (json.dumps({"fx": 600, "fy": 601, "cx": 320, "cy": 240, **SIZE}), (), ""),
        (
            json.dumps({**REALSENSE, "model": "Brown Conrady", "coeffs": DISTORTED}),
            DISTORTED,
            "plumb_bob",
        ),
        (json.dumps({**SIZE, "intrinsic_matrix": COLUMNS}), (), ""),
        (json.dumps({"intrinsic": {**SIZE, "intrinsic_matrix": COLUMNS}}), (), ""),
        (CALIBRATION.format(tag="", rows=ROWS, distorted=DISTORTED), DISTORTED, ""),
        (
            "%YAML:1.0\n---\n"
            + CALIBRATION.format(tag=" !!opencv-matrix", rows=ROWS, distorted=DISTORTED).replace(
                "   data", "   dt: d\n   data"
            ),
            DISTORTED,
            "",
        ),
        (INFO + listed("d", DISTORTED) + listed("k", ROWS) + "---\n", DISTORTED, "plumb_bob"),
    ],
)
def test_intrinsics_size_and_distortion_are_read(
    text: str, distortion: list[float], model: str
) -> None:
    camera = read_camera(text.encode())
    assert (camera.focal, camera.center) == ((600.0, 601.0), (320.0, 240.0))
    assert camera.size == (640, 480)
    assert (camera.distortion, camera.model) == (tuple(distortion), model)


@pytest.mark.parametrize("text", ["hello", "{}", '{"fx": 1.0}', '{"k": [1.0, 2.0]}'])
def test_what_is_no_camera_file_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="it "):
        read_camera(text.encode())
