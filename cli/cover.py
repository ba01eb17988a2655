"""`lariat cover`: obstacles of a scenario from a mesh."""

from __future__ import annotations

import json as jsons
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from lariat.geometry import poses
from lariat.geometry.mesh_cover import cover_mesh
from lariat.geometry.obstacle_checks import MAX_SIZE
from lariat.geometry.obstacles import Obstacle
from shared.configuration import ConfigurationError
from shared.mesh_file import read_mesh
from shared.scenario.entries import inline, obstacle_entry


def main(
    mesh: tyro.conf.Positional[Path],
    /,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0),
    scale: float = 1.0,
    most: int = 16,
    tolerance: float = 1.0,
    support: bool = False,
    name: str = "",
    output: Path | None = None,
    json: bool = False,
) -> int:
    """Write a mesh as obstacles of a scenario: boxes, cylinders and spheres that contain it.

    Rope, grippers and links keep away from these bodies as from any obstacle, so that they keep at
    least as far from the mesh. A closed mesh is covered with its inside.

    Examples:
      lariat cover bracket.stl --scale 0.001 --position 0.1 0 0.05 --output my-cell.toml
      lariat cover fixture.obj --most 40 --tolerance 0.5

    Args:
        mesh: Mesh, an STL or OBJ file.
        position: Position of the mesh's origin in the world [m].
        orientation: Orientation of the mesh in the world, wxyz.
        scale: Length of the file's unit [m]: 0.001 for a file in millimetres.
        most: Largest number of bodies.
        tolerance: Distance that a body may stick out of the mesh; one that sticks out less is not
            divided further [mm].
        support: Whether the rope may lean on the bodies.
        name: Name of the bodies, which are numbered; by default that of the file.
        output: Scenario's TOML file to whose end the bodies are added; by default they are
            printed.
        json: Answer with one JSON object on standard output.

    Returns:
        0 when the bodies stick out no further than the tolerance; 1 when they do.

    Raises:
        ConfigurationError: The mesh cannot be read or covered.
    """
    if not 1 <= most <= 200 or not tolerance > 0.0 or not scale > 0.0:
        raise ConfigurationError(
            f"--most {most} --tolerance {tolerance} --scale {scale}: give 1 to 200 bodies, and "
            "lengths above zero"
        )
    turn = np.array(orientation)
    if not 0.5 < np.linalg.norm(turn) < 2.0:
        raise ConfigurationError(f"--orientation {orientation} is no unit quaternion")
    if output is not None and not output.is_file():
        raise ConfigurationError(f"there is no scenario {output}; give --output an existing file")
    try:
        triangles = scale * read_mesh(mesh)
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"cannot read mesh {mesh}: {error}") from error
    extent = float(np.max(np.ptp(triangles.reshape(-1, 3), axis=0)))
    if extent > MAX_SIZE:
        raise ConfigurationError(
            f"{mesh} is {extent:.4g} m large; a file in millimetres takes --scale 0.001"
        )
    try:
        cover = cover_mesh(triangles, most, 1e-3 * tolerance)
    except ValueError as error:
        raise ConfigurationError(f"{mesh}: {error}") from error
    stem = name or mesh.stem
    bodies = [
        placed(body, position, poses.normalized(turn), f"{stem}-{k}", support)
        for k, body in enumerate(cover.bodies, start=1)
    ]
    overreach = 1e3 * cover.overreach
    entries = [obstacle_entry(body) for body in bodies]
    origin = f"# {mesh.name}: {len(bodies)} bodies, which stick out {overreach:.1f} mm at most"
    text = "\n".join([origin, *map(_table, entries)])
    if output is not None:
        with output.open("a") as file:
            file.write(f"\n{text}")
    if json:
        print(jsons.dumps({"overreach_mm": round(overreach, 3), "obstacles": entries}))
    elif output is None:
        print(text, end="")
    count = f"{len(bodies)} bod{'y' if len(bodies) == 1 else 'ies'}"
    place = f"; added to {output}" if output is not None else ""
    print(f"{count}, sticking out {overreach:.1f} mm at most{place}", file=sys.stderr)
    return 0 if overreach <= tolerance else 1


def placed(
    body: Obstacle,
    position: tuple[float, float, float],
    turn: np.ndarray,
    name: str,
    support: bool,
) -> Obstacle:
    """Return a body of a mesh as an obstacle of the world.

    Args:
        body: Body in the frame of the mesh.
        position: Position of that frame [m].
        turn: Its orientation, wxyz.
        name: Name of the obstacle.
        support: Whether the rope may lean on it.
    """
    centre = poses.rotate(turn, np.array(body.position)) + np.array(position)
    orientation = poses.multiply(turn, np.array(body.orientation))
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
