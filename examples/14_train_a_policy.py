"""Train a policy: through the rod's gradients, then tried on goals that it has not seen."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import torch
from matplotlib.figure import Figure

from environments.shape_control import ShapeControl
from examples.methods.trained_policy import PERIOD, Policy, cost
from lariat.rod import Rod
from lariat.scenario.rod_properties import rod_properties


def main(iterations: int = 60, batch: int = 16) -> Figure:
    env = ShapeControl("hard", plant="rod", node_count=20, scene_seed=1000, time_limit=5.0)
    seen = [env.reset(options={"scene": k})[0]["goal"] for k in range(batch)]
    goals, scenario = torch.as_tensor(np.array(seen), dtype=torch.float64), env.scenario
    rod = Rod(rod_properties(scenario.rope), scenario.rope.node_count)
    start = rod.rest(*scenario.grips(scenario.start)).state
    torch.manual_seed(0)
    policy, costs = Policy(), []
    optimizer = torch.optim.Adam(policy.parameters(), 3e-3)
    for _ in range(iterations):
        optimizer.zero_grad()
        costs.append(cost(policy, rod, start, goals))
        costs[-1].backward()
        optimizer.step()

    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 4))
    hidden = ShapeControl("hard", plant="rod", node_count=20, time_limit=5.0)  # A finer rope.
    for scene in range(2):
        observation, info = hidden.reset(options={"scene": scene})
        errors, truncated = [1e3 * info["error"]], False
        while not truncated:
            grips, goal = observation["grips"][None, :, :3], observation["goal"][None]
            with torch.no_grad():
                velocity = policy(*(torch.as_tensor(x).double() for x in (grips, goal)))[0]
            action = (velocity / scenario.limits.speed).numpy()
            observation, _, _, truncated, info = hidden.step(action)
            errors.append(1e3 * info["error"])
        print(f"scene {scene}: error {errors[-1]:.2f} mm")
        right.semilogy(PERIOD * np.arange(len(errors)), errors)
    left.plot([float(c.detach()) for c in costs])
    left.set(xlabel="step of the training", ylabel="cost [m]")
    right.set(xlabel="time [s]", ylabel="error on hidden goals [mm]")
    figure.tight_layout()
    return figure


if __name__ == "__main__":
    main().savefig("14_train_a_policy.png")
