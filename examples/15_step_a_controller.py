"""Step a controller against a plant: no process, no bus, no clock."""

from __future__ import annotations

from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from lariat.control import ArmCondition, Request, RequestAction, RopeObservation
from lariat.geometry import polylines
from lariat.rope_controller import RopeController
from lariat.scenario import load
from lariat.scenario.sections import Shape
from lariat.simulation import EndMotion, World
from lariat.trajectory import SECOND, MotionState, SetpointChunk, Spline

PERIOD = SECOND // 50
"""Time between two steps [ns]."""
READY = ArmCondition(True, True, "", reset_count=1, refused_chunks=0, refusal="")
"""Condition of arms that are armed and follow."""


def main(duration: float = 4.0) -> Figure:
    scenario = load("three-cylinders")
    goal = Shape(line=((-0.16, -0.10, 0.36), (0.18, -0.14, 0.34)))
    control = replace(scenario.control, planner=False)
    scenario = replace(scenario, goal=goal, control=control)
    world, controller, chunk = World(scenario), RopeController(scenario), None
    motion, errors = MotionState.at_rest(*world.grips), []
    for now in range(SECOND, SECOND + round(duration * SECOND), PERIOD):
        if chunk is not None:
            motion = Spline(chunk, chunk.start)(now)  # arms that follow exactly
        ends = [EndMotion(g, *t) for g, t in zip(motion.grips, motion.twists, strict=True)]
        world.advance(*ends, now)
        controller.take_arms(motion, READY, now)
        nodes = polylines.resample_smooth(world.nodes, scenario.rope.node_count)
        noise = np.full(len(nodes), 1e-4)
        controller.take_rope(RopeObservation(now, nodes, noise, noise > 0.0), now)
        if now == SECOND:
            controller.carry_out(Request("1", RequestAction.START), now)
        chunks = [c for c in controller.step(now) if isinstance(c, SetpointChunk)]
        chunk = chunks[-1] if chunks else chunk
        errors.append(polylines.mean_node_distance(nodes, controller.task.goal.nodes))

    print(f"error {1e3 * errors[-1]:.2f} mm, {controller.task.state.name}")
    figure, axes = plt.subplots()
    axes.semilogy(np.arange(len(errors)) * PERIOD / SECOND, 1e3 * np.array(errors))
    axes.set(xlabel="time [s]", ylabel="error [mm]")
    return figure


if __name__ == "__main__":
    main().savefig("15_step_a_controller.png")
