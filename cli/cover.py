"""`lariat cover`: obstacles of a scenario from a mesh or a depth image."""

from __future__ import annotations

import json as jsons
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from lariat.configuration import ConfigurationError, refusing
from lariat.files import depth_file
from lariat.files.mesh_file import read_mesh
from lariat.geometry import poses
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.geometry.depth_cover import cover_depth
from lariat.geometry.depth_solid import DepthSolid, SolidRange
from lariat.geometry.mesh_cover import MeshCover, cover_mesh
from lariat.geometry.obstacle_checks import MAX_SIZE
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.scenario.entries import inline, obstacle_entry


def main(
    file: tyro.conf.Positional[Path],
    /,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0),
    scale: float | None = None,
    most: int = 16,
    tolerance: float | None = None,
    look_at: tuple[float, float, float] | None = None,
    field_of_view: float | None = None,
    intrinsics: tuple[float, float, float, float] | None = None,
    depth_range: tuple[float, float] = (0.05, 2.0),
    floor: float | None = None,
    support: bool = False,
    name: str = "",
    output: Path | None = None,
    json: bool = False,
) -> int:
    """Write a mesh, or what a depth image shows, as obstacles of a scenario that contain it.

    The obstacles are boxes, cylinders and spheres. Rope, grippers and links keep away from these
    bodies as from any obstacle, so that they keep at least as far from the mesh, or from the
    surface that the image shows. A closed mesh is covered with its inside, and of a depth image all
    that the surface hides, down to a depth and to a floor.

    Examples:
      lariat cover bracket.stl --scale 0.001 --position 0.1 0 0.05 --output my-cell.toml
      lariat cover fixture.obj --most 40 --tolerance 0.5
      lariat cover depth.png --position 0 -0.05 1 --look-at 0 0 0.15 --field-of-view 65

    Args:
        file: Mesh, an STL or OBJ file; or depth image, a PNG of 16 bits or an array as NPY file.
        position: Position of the mesh's origin, or of the camera, in the world [m].
        orientation: Orientation of the mesh, or of the camera's optical frame (x right, y down, z
            forward), in the world, wxyz.
        scale: Length of the file's unit [m], e.g. 0.001 for millimetres; by default a metre, in a
            PNG a millimetre.
        most: Largest number of bodies.
        tolerance: Distance that a body may stick out of the mesh, or into the space that the image
            shows to be empty; one that sticks out less is not divided further [mm]. By default 1
            for a mesh and 20 for a depth image.
        look_at: Point in the world at which the camera looks, in place of its orientation [m].
        field_of_view: Horizontal field of view of a depth image, without lens distortion [deg].
        intrinsics: Focal lengths fx, fy and principal point cx, cy, in its place [pixels].
        depth_range: Least depth of a measurement, and depth at which the solid behind the surface
            ends [m].
        floor: Height in the world below which a depth image is left out [m], as where the table is
            an obstacle itself.
        support: Whether the rope may lean on the bodies.
        name: Name of the bodies, which are numbered; by default that of the file.
        output: Scenario's TOML file to whose end the bodies are added; by default they are
            printed.
        json: Answer with one JSON object on standard output.

    Returns:
        0 when the bodies stick out no further than the tolerance; 1 when they do.

    Raises:
        ConfigurationError: The file cannot be read or covered.
    """
    shows_depth = file.suffix.lower() in depth_file.SUFFIXES
    tolerance = tolerance if tolerance is not None else 20.0 if shows_depth else 1.0
    if not 1 <= most <= 200 or not tolerance > 0.0 or not (scale is None or scale > 0.0):
        raise ConfigurationError(
            f"--most {most} --tolerance {tolerance} --scale {scale}: give 1 to 200 bodies, and "
            "lengths above zero"
        )
    turn = np.array(orientation)
    if not 0.5 < np.linalg.norm(turn) < 2.0:
        raise ConfigurationError(f"--orientation {orientation} is no unit quaternion")
    if output is not None and not output.is_file():
        raise ConfigurationError(f"there is no scenario {output}; give --output an existing file")
    place, note = Pose(np.array(position), poses.normalized(turn)), ""
    if shows_depth:
        place = place if look_at is None else _looking(position, look_at)
        pinhole = _pinhole(field_of_view, intrinsics)
        extent = SolidRange(*depth_range, floor)
        solid = _solid(file, scale, pinhole, place, extent)
        cover = cover_depth(solid, most, 1e-3 * tolerance)
        place = Pose(np.zeros(3), poses.IDENTITY)
        note = f"; {100.0 * solid.unknown:.1f} % of the image show nothing, and nothing is there"
    else:
        cover = _mesh_cover(file, 1.0 if scale is None else scale, most, tolerance)
    stem = name or file.stem
    bodies = [
        placed(body, place, f"{stem}-{k}", support) for k, body in enumerate(cover.bodies, start=1)
    ]
    overreach = 1e3 * cover.overreach
    entries = [obstacle_entry(body) for body in bodies]
    origin = f"# {file.name}: {len(bodies)} bodies, which stick out {overreach:.1f} mm at most"
    text = "\n".join([origin, *map(_table, entries)])
    if output is not None:
        with output.open("a") as scenario:
            scenario.write(f"\n{text}")
    if json:
        print(jsons.dumps({"overreach_mm": round(overreach, 3), "obstacles": entries}))
    elif output is None:
        print(text, end="")
    count = f"{len(bodies)} bod{'y' if len(bodies) == 1 else 'ies'}"
    note += f"; added to {output}" if output is not None else ""
    print(f"{count}, sticking out {overreach:.1f} mm at most{note}", file=sys.stderr)
    return 0 if overreach <= tolerance else 1


def _mesh_cover(file: Path, scale: float, most: int, tolerance: float) -> MeshCover:
    with refusing(f"cannot read mesh {file}"):
        triangles = scale * read_mesh(file)
    extent = float(np.max(np.ptp(triangles.reshape(-1, 3), axis=0)))
    if extent > MAX_SIZE:
        raise ConfigurationError(
            f"{file} is {extent:.4g} m large; a file in millimetres takes --scale 0.001"
        )
    with refusing(file):
        return cover_mesh(triangles, most, 1e-3 * tolerance)


def _looking(position: tuple[float, float, float], target: tuple[float, float, float]) -> Pose:
    if position == target:
        raise ConfigurationError(f"--look-at {target} is where the camera is")
    return looking_at(position, target)


def _pinhole(
    field_of_view: float | None, intrinsics: tuple[float, float, float, float] | None
) -> Callable[[int, int], Intrinsics]:
    """Intrinsics of a camera by the width and the height of its images."""
    if (field_of_view is None) == (intrinsics is None):
        raise ConfigurationError(
            "a depth image needs either --field-of-view DEG or --intrinsics FX FY CX CY"
        )
    if intrinsics is not None:
        return lambda width, height: Intrinsics(width, height, *intrinsics)
    angle = field_of_view or 0.0
    if not 1.0 <= angle <= 170.0:
        raise ConfigurationError(f"--field-of-view {angle} is not within 1 to 170 degrees")
    return lambda width, height: Intrinsics.symmetric(width, height, np.deg2rad(angle))


def _solid(
    file: Path,
    scale: float | None,
    pinhole: Callable[[int, int], Intrinsics],
    place: Pose,
    extent: SolidRange,
) -> DepthSolid:
    if not 0.0 < extent.near < extent.far <= MAX_SIZE:
        raise ConfigurationError(
            f"--depth-range {extent.near:g} {extent.far:g}: give two depths within 0 to "
            f"{MAX_SIZE:g} m, the nearer one first"
        )
    with refusing(f"cannot use depth image {file}"):
        depth = depth_file.read_depth(file, scale)
        camera = Camera(pinhole(depth.shape[1], depth.shape[0]), place)
        if camera.intrinsics.doubt:
            print(f"lariat: {file}: {camera.intrinsics.doubt}", file=sys.stderr)
        return DepthSolid(depth, camera, extent)


def placed(body: Obstacle, place: Pose, name: str, support: bool) -> Obstacle:
    """Return a body of a mesh as an obstacle of the world."""
    centre = place.apply(np.array(body.position))
    orientation = poses.multiply(place.orientation, np.array(body.orientation))
    return replace(
        body,
        position=tuple(centre.tolist()),
        orientation=tuple(orientation.tolist()),
        name=name,
        support=support,
    )


def _table(entry: dict[str, Any]) -> str:
    """Return an obstacle's entry as TOML."""
    lines = [f"{key} = {inline(value)}" for key, value in entry.items()]
    return "\n".join(["[[obstacles]]", *lines, ""])
