"""Check motions of both grips against every rule of a cell."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from lariat.geometry import Obstacle
from lariat.planning import plan, scenario_problem
from lariat.safety import ChunkRefused, check_motion
from lariat.scenario import load


def main() -> Figure:
    scenario = load("three-cylinders")
    path = plan(scenario_problem(scenario))
    ball = Obstacle("sphere", tuple(path.positions[len(path.positions) // 2, 1]), radius=0.03)
    figure, axes = plt.subplots()
    for name, dt, others in (
        ("planned", path.dt, ()),
        ("three times as fast", path.dt / 3.0, ()),
        ("with a ball in the way", path.dt, (ball,)),
    ):
        obstacles = (*scenario.bodies, *others)
        try:
            check_motion(scenario, path.positions, path.orientations, dt, obstacles)
            verdict = "keeps every rule"
        except ChunkRefused as refused:
            verdict = str(refused)
        print(f"{name}: {verdict}")
        speed = np.linalg.norm(np.diff(path.positions[:, 1], axis=0), axis=1) / dt
        axes.plot(dt * np.arange(len(speed)), speed, label=f"{name}: {verdict}")
    axes.set(xlabel="time [s]", ylabel="speed of the right grip [m/s]")
    axes.legend(fontsize=8)
    return figure


if __name__ == "__main__":
    main().savefig("16_check_a_motion.png")
