"""Adapter of the rod for cosseratbench (Van Slyke, Apache-2.0), which compares solvers of rods.

The suite states experiments without any solver, has adapters of its own for others, PyElastica and
MuJoCo among them, and judges all by the same metrics. Its command finds the rod by the entry point
of this package: `cosseratbench run catenary pendulum capstan --solver lariat`.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from cosseratbench import Capability, Scenario, Trajectory

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle, pack
from lariat.rod.model import End
from lariat.rod.properties import RodProperties
from lariat.rod.rod import Rod
from lariat.rod.rollout_spec import RolloutSpec
from lariat.rod.state import RodState

TIME_STEP = 0.005
"""Step, times `time_step_scale` [s]."""
MARGIN = 0.1
"""Gap to a body below which contact acts, relative to the radius of a rod [-]."""
TOLERANCE = 1e-9
"""Tolerance of the rod's solver [m]."""


class LariatRod:
    """Solver of cosseratbench: one rod, whose ends are pinned or free."""

    name = "lariat"
    capabilities = frozenset(
        {
            Capability.STRETCH,
            Capability.SHEAR,
            Capability.CYLINDER_CONTACT,
            Capability.PLANE_CONTACT,
        }
    )

    def __init__(self, time_step_scale: float = 1.0) -> None:
        """Create the solver. Args: time_step_scale: Factor on `TIME_STEP` [-]."""
        self._step = TIME_STEP * time_step_scale

    def run(self, scenario: Scenario, *, n_elements: int, n_frames: int) -> Trajectory:
        """Simulate a scenario.

        Raises:
            NotImplementedError: It has several rods, forces on ends, or clamped ends.
        """
        rod, body = _rod(scenario, n_elements), scenario.rods[0]
        frame_time = scenario.duration / (n_frames - 1)
        nodes, across = body.nodes(n_elements), body.directors(n_elements)
        along = poses.normalized(np.diff(nodes, axis=0))
        axes = np.stack([across, np.cross(along, across), along], axis=2)
        turns = np.array([poses.from_matrix(matrix) for matrix in axes])
        start = RodState(nodes, turns, np.zeros_like(nodes), np.zeros((n_elements, 3)))
        bodies = [_obstacle(o) for o in scenario.obstacles]
        spec = RolloutSpec(
            start,
            np.zeros((1, 2, 6)),
            frame_time,
            steps=n_frames - 1,
            substeps=math.ceil(frame_time / self._step - 1e-9),
            obstacles=pack(bodies) if bodies else None,
        )
        motion = rod.rollout(spec)
        turns = np.concatenate([turns[None], motion.orientations])
        return Trajectory(
            times=np.linspace(0.0, scenario.duration, n_frames),
            positions=(np.concatenate([nodes[None], motion.positions]),),
            directors=(poses.rotate(turns, np.array([1.0, 0.0, 0.0])),),
        )


def _rod(scenario: Scenario, n_elements: int) -> Rod:
    body, *others = scenario.rods
    if others or body.loads or "clamped" in (body.start.value, body.end.value):
        raise NotImplementedError("several rods, forces on ends, clamps of whole elements")
    material, area = body.material, body.area
    properties = RodProperties(
        body.length,
        2.0 * body.radius,
        material.density * area,
        material.youngs_modulus,
        poisson_ratio=material.youngs_modulus / (2.0 * material.shear_modulus) - 1.0,
        stretch_stiffness=material.youngs_modulus * area,
        # The way to an equilibrium may be damped.
        damping=2.0 * scenario.slowest_frequency() if scenario.quasi_static else 0.0,
        contact_margin=MARGIN * body.radius,
    )
    left, right = (_hold(end.value) for end in (body.start, body.end))
    scheme = "euler" if scenario.quasi_static else "sdirk2"
    gravity, touches = scenario.gravity, scenario.self_contact
    return Rod(properties, n_elements + 1, left, right, gravity, TOLERANCE, scheme, touches)


def _hold(condition: str) -> End:
    return "pinned" if condition == "pinned" else "free"


def _obstacle(body: Any) -> Obstacle:
    if body.kind == "plane":
        x, y, z = body.unit_normal.tolist()
        return Obstacle("half_space", body.point, normal=(x, y, z), friction=body.friction)
    w, x, y, z = poses.rotation_between(np.array([0.0, 0.0, 1.0]), body.unit_axis).tolist()
    size = {"radius": body.radius, "height": body.length}
    return Obstacle("cylinder", body.center, (w, x, y, z), friction=body.friction, **size)
