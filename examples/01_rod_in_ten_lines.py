"""A rod in ten lines: a rope hangs between two grips, and one grip rises."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from lariat.geometry import Pose
from lariat.rod import Rod, RodProperties, RolloutSpec


def main() -> Figure:
    rod = Rod(
        RodProperties(length=0.45, diameter=0.008, linear_density=0.044, youngs_modulus=1e6), 40
    )
    along_x = np.array([0.5, 0.5, 0.5, 0.5])  # wxyz: the z axis of a grip lies along the rope
    left, right = (Pose(np.array([x, 0.0, 0.3]), along_x) for x in (0.0, 0.35))
    rest = rod.rest(left, right)
    actions = np.zeros((20, 2, 6))  # velocities of both grips: linear [m/s], angular [rad/s]
    actions[:, 1, 2] = 0.15
    motion = rod.rollout(RolloutSpec(rest.state, actions, dt=0.05))
    assert motion.failure is None

    print(f"right grip: from {rest.state.positions[-1]} to {motion.positions[-1, -1].round(3)} m")
    figure, axes = plt.subplots()
    for step in range(0, 20, 4):
        axes.plot(*motion.positions[step, :, ::2].T, label=f"{0.05 * (step + 1):.2f} s")
    axes.set(xlabel="x [m]", ylabel="z [m]", aspect="equal")
    axes.legend()
    return figure


if __name__ == "__main__":
    main().savefig("01_rod_in_ten_lines.png")
