from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from dashboard.scene.scene_setup import initial_viewpoint
from lariat.arms.installation import kinematics_of
from lariat.geometry.cameras import Camera, Intrinsics, looking_at
from lariat.scenario import SIDES, load
from tests.dashboard.stage import hanging


@pytest.mark.parametrize("width", [900, 500])
@pytest.mark.parametrize("path", sorted(Path("scenarios").glob("*.toml")), ids=lambda p: p.stem)
def test_start_and_goal_are_in_the_first_view(path: Path, width: int) -> None:
    scenario = load(path)
    viewpoint = initial_viewpoint(scenario, width / 900)
    focal_length = 450.0 / np.tan(viewpoint.field_of_view / 2.0)
    intrinsics = Intrinsics(width, 900, focal_length, focal_length, width / 2.0, 450.0)
    camera = Camera(intrinsics, looking_at(tuple(viewpoint.position), tuple(viewpoint.target)))
    grips = [g.position for s in (scenario.start, scenario.goal) for g in scenario.grips(s)]
    # Of an arm, what is near its grip.
    arms = [s for s in SIDES if scenario.end(s).driver == "cr5"]
    for side in arms:
        grip = scenario.grips(scenario.start)[SIDES.index(side)].position
        base = np.array(scenario.end(side).base_position)
        grips.append(grip + 0.4 * (np.array([*base[:2], grip[2]]) - grip))
    pixels, depth = camera.project(np.array(grips))
    assert np.all(depth > 0.0)
    assert np.all((pixels > 0.0) & (pixels < [width, 900.0]))


@pytest.mark.parametrize("name", ["cable", "fixed-end", "rope", "two-arms"])
def test_no_arm_hides_the_rope_in_the_first_view(name: str) -> None:
    scenario = load(name)
    eye = initial_viewpoint(scenario).position
    for shape in (scenario.start, scenario.goal):
        grips = scenario.grips(shape)
        ends = [g.position for g in grips]
        nodes = hanging(*ends, scenario.rope.length, 30)[1:-1]
        lines = eye + np.linspace(0.0, 1.0, 200)[:, None, None] * (nodes - eye)
        for side, grip in zip(SIDES, grips, strict=True):
            if scenario.end(side).driver != "cr5":
                continue
            kinematics = kinematics_of(scenario, side)
            assert kinematics is not None
            joints = kinematics.solve_anywhere(grip)
            assert joints is not None
            centres, radii = kinematics.link_spheres(joints[None])
            distances = np.linalg.norm(lines[..., None, :] - centres[0], axis=-1)
            assert np.all(distances > radii)
