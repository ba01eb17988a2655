"""Camera files: intrinsics and distortion as RealSense, Open3D, OpenCV and ROS write them.

| written by | recognised by |
|---|---|
| RealSense (JSON) | `ppx`, `ppy`, `coeffs`, `model` |
| Open3D (JSON) | `intrinsic_matrix`, column after column; alone or as `intrinsic` |
| OpenCV (YAML, XML, JSON), ROS's camera_calibration (YAML) | `camera_matrix` with its `data` |
| ROS (`camera_info` as YAML or JSON) | `k` or `K`, `d` or `D` |
| anything else (JSON) | `fx`, `fy`, `cx`, `cy` |
"""

from __future__ import annotations

import json
import re
from dataclasses import dataclass
from typing import Any

import cv2

OPENCV_NAMES = {"distortion.brown_conrady": "plumb_bob", "brown conrady": "plumb_bob"}
"""Names of OpenCV's distortion model in RealSense's files."""


@dataclass(frozen=True)
class CameraFile:
    """Content of a camera file."""

    focal: tuple[float, float]
    """Focal lengths along columns and rows [pixels]."""
    center: tuple[float, float]
    """Column and row of the principal point [pixels]."""
    size: tuple[int, int] | None
    """Width and height of the camera's images [pixels]; None where the file does not say."""
    distortion: tuple[float, ...]
    """Coefficients of the distortion model, in OpenCV's order."""
    model: str
    """Distortion model by its name in ROS; empty where the file does not say."""


def read_camera(content: bytes) -> CameraFile:
    """Return the content of a camera file.

    Args:
        content: JSON, or YAML or XML as OpenCV reads it.

    Raises:
        ValueError: It is none of these, or holds no intrinsics.
    """
    fields = _fields(content)
    fields = fields.get("intrinsic", fields)
    matrix = fields.get("camera_matrix", fields.get("k", fields.get("K")))
    matrix = matrix.get("data") if isinstance(matrix, dict) else matrix
    if "intrinsic_matrix" in fields:
        rows = [float(x) for x in fields["intrinsic_matrix"]]
        matrix = [rows[3 * (n % 3) + n // 3] for n in range(9)]
    if matrix is not None:
        flat = [x for row in matrix for x in (row if isinstance(row, list) else [row])]
        if len(flat) != 9:
            raise ValueError(f"it has a matrix of {len(flat)} numbers, not nine")
        numbers = [flat[n] for n in (0, 4, 2, 5)]
    else:
        names = ("fx", "fy", *(("ppx", "ppy") if "ppx" in fields else ("cx", "cy")))
        absent = [name for name in names if name not in fields]
        if absent:
            raise ValueError(f"it has no {' and no '.join(absent)}")
        numbers = [fields[name] for name in names]
    fx, fy, cx, cy = (float(x) for x in numbers)
    width = fields.get("width", fields.get("image_width"))
    height = fields.get("height", fields.get("image_height"))
    size = (int(width), int(height)) if width and height else None
    names = ("distortion_coefficients", "coeffs", "d", "D")
    distortion = next((fields[name] for name in names if fields.get(name)), [])
    distortion = distortion.get("data", []) if isinstance(distortion, dict) else distortion
    model = str(fields.get("distortion_model", fields.get("model", "")))
    model = OPENCV_NAMES.get(model.lower(), model)
    return CameraFile((fx, fy), (cx, cy), size, tuple(float(x) for x in distortion), model)


def _fields(content: bytes) -> dict[str, Any]:
    """Fields of a JSON, YAML or XML file."""
    text = content.decode()
    if text.lstrip().startswith("{"):
        return json.loads(text)
    if not text.lstrip().startswith(("%YAML", "<")):
        # OpenCV wants a header, and lists that are indented.
        text = "%YAML:1.0\n---\n" + re.sub(r"(?m)^- ", "  - ", text).replace("---\n", "")
    try:
        store = cv2.FileStorage(text, cv2.FILE_STORAGE_READ | cv2.FILE_STORAGE_MEMORY)
        return {name: _value(store.getNode(name)) for name in store.root().keys()}  # noqa: SIM118
    except (cv2.error, SystemError) as error:
        raise ValueError("it is neither JSON nor YAML or XML that OpenCV reads") from error


def _value(node: cv2.FileNode) -> Any:
    if node.isMap():
        return {name: _value(node.getNode(name)) for name in node.keys()}  # noqa: SIM118
    if node.isSeq():
        return [_value(node.at(k)) for k in range(node.size())]
    return node.string() if node.isString() else node.real()
