"""Gradient through a swing: find the motion of a grip that swings the free end to a target."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from lariat.geometry import Pose
from lariat.rod import Rod, RodProperties, RolloutSpec

TARGET = np.array([0.30, 0.0, 0.75])
"""Point that the free end shall reach after the last step [m]."""
STEPS, BLOCKS, DT = 60, 12, 0.01
"""Number of time steps, number of blocks of constant grip velocity, and time step [s]."""
EFFORT = 2e-3
"""Weight of the squared grip velocities, relative to the squared distance [s^2]."""


def main() -> Figure:
    rope = RodProperties(length=0.5, diameter=0.008, linear_density=0.044, youngs_modulus=1e6)
    rod = Rod(rope, 30, right="free")
    down = np.array([0.0, 1.0, 0.0, 0.0])  # wxyz: z points down, along the rope
    grip = Pose(np.array([0.0, 0.0, 1.0]), down)
    start = rod.rest(grip, grip).state
    block = np.arange(STEPS) * BLOCKS // STEPS
    actions = np.zeros((BLOCKS, 2, 6))

    for _ in range(30):
        spec = RolloutSpec(start, actions, DT, STEPS, block)
        # Gauss-Newton: the Jacobian of the tip in the velocities of the left grip along x and z.
        linearization = rod.linearize(spec)
        tip = linearization.rollout.positions[-1, -1]
        jacobian = linearization.d_positions_d_actions[-1, -1][:, :, 0, [0, 2]].reshape(3, -1)
        v = actions[:, 0, [0, 2]].ravel()
        hessian = jacobian.T @ jacobian + EFFORT / BLOCKS * np.eye(v.size)
        step = np.linalg.solve(hessian, jacobian.T @ (TARGET - tip) - EFFORT / BLOCKS * v)
        v += min(1.0, 0.3 / np.abs(step).max()) * step
        actions[:, 0, [0, 2]] = v.reshape(BLOCKS, 2)

    motion = rod.rollout(RolloutSpec(start, actions, DT, STEPS, block))
    miss = np.linalg.norm(motion.positions[-1, -1] - TARGET)
    print(f"the tip misses its target by {1e3 * miss:.1f} mm")
    figure, axes = plt.subplots()
    for step in range(0, STEPS, 6):
        axes.plot(*motion.positions[step, :, ::2].T, color="0.7")
    axes.plot(*motion.positions[-1, :, ::2].T)
    axes.plot(*TARGET[::2], "x", color="C3", label="target")
    axes.set(xlabel="x [m]", ylabel="z [m]", aspect="equal")
    axes.legend()
    return figure


if __name__ == "__main__":
    main().savefig("02_gradient_through_a_swing.png")
