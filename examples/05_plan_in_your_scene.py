"""Plan in your scene: a rope through a window, by a whole path of both grips."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from lariat.geometry import TABLE, Obstacle, Pose
from lariat.planning import Problem, plan
from lariat.rod import Rod, RodProperties
from lariat.scenario.sections import Goal, Limits

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
"""Orientation of a grip that points along x, wxyz."""
FRAME = (
    Obstacle("box", (0.0, 0.0, 0.05), size=(1.8, 0.02, 0.10), name="sill"),
    Obstacle("box", (0.0, 0.0, 0.85), size=(1.8, 0.02, 0.90), name="lintel"),
    Obstacle("box", (-0.60, 0.0, 0.25), size=(0.60, 0.02, 0.30), name="left jamb"),
    Obstacle("box", (0.60, 0.0, 0.25), size=(0.60, 0.02, 0.30), name="right jamb"),
)
"""Wall with a window 0.6 m wide and 0.3 m high."""


def main() -> Figure:
    rod = Rod(RodProperties(0.45, 0.008, 0.044, youngs_modulus=1e6), 24)
    start = (Pose(np.array([-0.17, -0.2, 0.30]), LEVEL), Pose(np.array([0.17, -0.2, 0.30]), LEVEL))
    goal = (Pose(np.array([-0.15, 0.2, 0.20]), LEVEL), Pose(np.array([0.15, 0.2, 0.20]), LEVEL))
    problem = Problem(
        rod=rod,
        state=rod.rest(*start).state,
        grips=start,
        goal=Goal(rod.rest(*goal).state.positions, *goal),
        moves=np.array([[True] * 3 + [False] * 3] * 2),  # the grips move and do not rotate
        obstacles=(TABLE, *FRAME),
        supports=(),
        limits=Limits(),
        clearance=0.012,
        tolerance=0.003,
    )
    path = plan(problem)
    assert path.reached, path.reason

    print(f"duration {path.dt * len(path.nodes):.1f} s, clearance {1e3 * path.clearance:.1f} mm")
    figure = plt.figure()
    axes = figure.add_subplot(projection="3d")
    for nodes in path.nodes[:: max(1, len(path.nodes) // 12)]:
        axes.plot(*nodes.T, color="C0", alpha=0.5)
    axes.plot(*problem.goal.nodes.T, color="C3", label="goal")
    x, z = [-0.3, 0.3, 0.3, -0.3, -0.3], [0.1, 0.1, 0.4, 0.4, 0.1]
    axes.plot(x, [0.0] * 5, z, color="0.3", label="window")
    axes.set(xlabel="x [m]", ylabel="y [m]", zlabel="z [m]")
    axes.legend()
    return figure


if __name__ == "__main__":
    main().savefig("05_plan_in_your_scene.png")
