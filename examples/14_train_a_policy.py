"""Train a policy: through the rod's gradients, then tried on goals that it has not seen."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.figure import Figure

from environments.policies.training import TrainingSettings, train
from environments.shape_control import ShapeControl


def main(iterations: int = 100, goals: int = 16) -> Figure:
    costs: list[float] = []
    settings = TrainingSettings(iterations=iterations, goals=goals, scenes=("hard",))
    policy = train(settings, lambda step, cost: costs.append(cost))

    env = ShapeControl("hard", plant="rod", time_limit=6.0)  # a finer rope, goals of another seed
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4))
    for scene in range(2):
        observation, info = env.reset(seed=0, options={"scene": scene})
        errors, truncated = [1e3 * info["error"]], False
        while not truncated:
            observation, _, _, truncated, info = env.step(policy.act(observation))
            errors.append(1e3 * info["error"])
        print(f"scene {scene}: error {errors[-1]:.2f} mm")
        right.semilogy([env.period * k for k in range(len(errors))], errors)
    env.close()
    left.plot(costs, color="0.8")
    left.plot(np.convolve(costs, np.ones(10) / 10.0, mode="valid"))
    left.set(xlabel="step of the training", ylabel="cost, and its mean over ten steps [m]")
    right.set(xlabel="time [s]", ylabel="error on hidden goals [mm]")
    figure.tight_layout()
    return figure


if __name__ == "__main__":
    main().savefig("14_train_a_policy.png")
