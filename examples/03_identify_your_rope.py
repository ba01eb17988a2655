"""Identify your rope: stiffness and damping from the motion of markers along it."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from lariat.geometry import Pose
from lariat.identification import check_motion, findings, identify, predict
from lariat.rod import Rod, RodProperties, RolloutSpec

RATE = 100.0
"""Frames per second of the motion capture [Hz]."""
NOISE = 3e-4
"""Standard deviation of each coordinate of a marker [m]."""


def measured_motion(true_rope: RodProperties) -> np.ndarray:
    """Return markers (1 T V 3) of a rope whose right grip moves; yours come from a camera."""
    rod = Rod(true_rope, 89)  # finer than the rod of the identification
    along_x = np.array([0.5, 0.5, 0.5, 0.5])
    left, right = (Pose(np.array([x, 0.0, 0.3]), along_x) for x in (0.0, 0.3))
    time = np.arange(250) / RATE
    actions = np.zeros((len(time), 2, 6))
    for axis, frequency in enumerate((7.0, 9.0, 11.0)):
        actions[:, 1, axis] = 0.3 * np.sin(frequency * time)
    motion = rod.rollout(RolloutSpec(rod.rest(left, right).state, actions, 1.0 / RATE, substeps=4))
    markers = motion.positions[:, ::8]
    # One marker more on each gripper: with the end of the rope it tells the gripper's direction.
    back = np.array([0.03, 0.0, 0.0])
    markers = np.hstack([markers[:, :1] - back, markers, markers[:, -1:] + back])
    return (markers + NOISE * np.random.default_rng(0).normal(size=markers.shape))[None]


def main() -> Figure:
    true_rope = RodProperties(0.45, 0.008, 0.044, youngs_modulus=1.7e6, damping=0.8)
    vertices = measured_motion(true_rope)
    motion = check_motion(vertices, 1.0 / RATE, prescribed=[0, 1, -2, -1])
    fit = identify(motion)
    for found in findings(fit):
        if found.known and "[" not in found.name:
            print(f"{found.name}: {found.value:.4g} ± {found.standard_deviation:.2g} {found.unit}")
    truth = true_rope.bending_stiffness / true_rope.linear_density
    print(f"true stiffness: {truth:.4g}")

    predicted = predict(motion, fit.properties, fit.length_scale)
    print(f"open-loop error over {len(vertices[0]) / RATE} s: {1e3 * predicted.scores[0]:.2f} mm")
    figure, axes = plt.subplots()
    time = np.arange(vertices.shape[1]) / RATE
    axes.plot(time, 1e3 * vertices[0, :, 7, 2], ".", markersize=2, label="measured")
    axes.plot(time, 1e3 * predicted.vertices[0, :, 7, 2], label="predicted")
    axes.set(xlabel="time [s]", ylabel="height of the middle marker [mm]")
    axes.legend()
    return figure


if __name__ == "__main__":
    main().savefig("03_identify_your_rope.png")
