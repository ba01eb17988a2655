"""Batch on torch: fit the material of a rope by gradient descent through a batch of roll-outs."""

from __future__ import annotations

import matplotlib.pyplot as plt
import numpy as np
import torch
from matplotlib.figure import Figure

from lariat.geometry import Obstacle, Pose, pack
from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.rod.torch import rollout

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
"""Orientation of a grip that points along x, wxyz."""
POST = Obstacle("cylinder", (0.0, 0.05, 0.15), radius=0.03, height=0.3)
"""Post that the ropes swing against."""


def main() -> Figure:
    torch.manual_seed(0)
    rod = Rod(RodProperties(0.45, 0.008, 0.044, youngs_modulus=1e6), 24)
    states = []
    for half in np.linspace(0.10, 0.18, 8):  # eight ropes, each between grips of its own
        ends = (Pose(np.array([x, 0.0, 0.35]), LEVEL) for x in (-half, half))
        states.append(rod.rest(*ends).state)
    actions = np.zeros((8, 30, 2, 6))
    actions[:, :, :, 1] = 0.3  # towards the post
    spec = RolloutSpec(states, actions, dt=0.02, obstacles=pack((POST,)))
    truth = {
        "bending_stiffness": torch.tensor(3.5e-4, dtype=torch.float64),
        "linear_density": torch.tensor(0.06, dtype=torch.float64),
    }
    measured = rollout(rod, spec, parameters=truth)

    guess = (rod.properties.bending_stiffness, rod.properties.linear_density)
    logarithms = torch.tensor(np.log(guess), requires_grad=True)
    optimizer = torch.optim.LBFGS([logarithms], max_iter=40, line_search_fn="strong_wolfe")
    history = []

    def cost() -> torch.Tensor:
        optimizer.zero_grad()
        values = dict(zip(truth, logarithms.exp(), strict=True))
        error = rollout(rod, spec, parameters=values) - measured
        loss = 1e6 * error.square().sum(-1).mean()  # [mm^2]
        loss.backward()
        history.append((float(loss.detach()), *logarithms.detach().exp().tolist()))
        return loss

    optimizer.step(cost)
    for name, fitted in zip(truth, logarithms.detach().exp().tolist(), strict=True):
        print(f"{name}: found {fitted:.4g}, true {float(truth[name]):.4g}")
    figure, axes = plt.subplots()
    axes.semilogy([row[0] for row in history])
    axes.set(xlabel="evaluation", ylabel="mean squared error [mm²]")
    return figure


if __name__ == "__main__":
    main().savefig("07_batch_on_torch.png")
