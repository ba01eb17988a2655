"""Your driver: an arm of any make by its URDF and one class; the gateway does all else."""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from examples.methods.lagging_arm import LaggingArm
from lariat.scenario.settings import load_with
from lariat.trajectory import SECOND
from shared import topics
from stack.simulation import closed_loop
from stack.simulation.simulated_time import Delivery


def main() -> Figure:
    driver = f"ends.right.driver={LaggingArm.__module__}:{LaggingArm.__name__}"
    settings = (driver, "sensing.source=truth", "plant.model=rod", "run.time_limit=4.0")
    joints: list[list[float]] = []

    def listen(delivery: Delivery) -> None:
        if delivery.key == topics.ARM_STATE.key:
            state = delivery.parse()
            joints.append([state.stamp / SECOND, *state.arms[1].joints])

    outcome = closed_loop.run(load_with(Path("fixed-end"), settings), taps=(listen,))
    print(f"error {outcome.score.final_error_mm:.2f} mm, {outcome.reason}")
    figure, axes = plt.subplots()
    times, *angles = np.array(joints).T
    for k, angle in enumerate(angles):
        axes.plot(times - times[0], angle - angle[0], label=f"joint {k + 1}")
    axes.set(xlabel="time [s]", ylabel="motion of the joint [rad]")
    axes.legend()
    return figure


if __name__ == "__main__":
    main().savefig("13_your_driver.png")
