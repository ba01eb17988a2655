"""Steps of Adam on velocities and on the weights of the network."""

from __future__ import annotations

import numpy as np
import torch

from lariat.paper.policies import Actions, Network


def test_actions_are_shifted_by_the_elapsed_steps_and_keep_the_last_one() -> None:
    actions = Actions(step_count=3, component_count=1, rate=1.0)
    nodes, goal = np.zeros((3, 4, 3)), np.zeros((4, 3))
    for gradient in ([[0.0], [-1.0], [0.0]], [[0.0], [0.0], [-1.0]]):
        actions.begin(0)
        actions.learn(np.array(gradient))
    np.testing.assert_allclose(actions.velocities(nodes, goal).ravel(), [0.0, 1.0, 1.0])
    actions.begin(1)
    np.testing.assert_allclose(actions.velocities(nodes, goal).ravel(), [1.0, 1.0, 1.0])


def test_network_descends_the_loss_of_its_velocities() -> None:
    random = np.random.default_rng(0)
    network = Network(4, 6, 1e-3, seed=3)
    nodes, goal = random.normal(size=(5, 4, 3)), random.normal(size=(4, 3))
    wanted = random.normal(size=(5, 6))
    misses = []
    for _ in range(30):
        miss = network.velocities(nodes, goal) - wanted
        misses.append(float(np.sum(miss**2)))
        network.learn(2.0 * miss)
    assert misses[-1] < 0.2 * misses[0]


def test_networks_of_one_seed_are_the_same_and_leave_the_global_seed_alone() -> None:
    state = torch.get_rng_state()
    first, second = (Network(4, 6, 1e-3, seed=3) for _ in range(2))
    assert torch.equal(torch.get_rng_state(), state)
    for own, other in zip(first.layers.parameters(), second.layers.parameters(), strict=True):
        assert torch.equal(own, other)


def test_network_is_differentiated_in_its_nodes() -> None:
    random = np.random.default_rng(0)
    network = Network(4, 6, 1e-3, seed=3)
    nodes, goal = random.normal(size=(2, 4, 3)), random.normal(size=(4, 3))
    along, gradient = random.normal(size=nodes.shape), random.normal(size=(2, 6))

    def cost(h: float) -> float:
        return float(np.sum(gradient * network.velocities(nodes + h * along, goal)))

    slope = (cost(1e-3) - cost(-1e-3)) / 2e-3
    cost(0.0)
    found = network.gradient_in_nodes(gradient, nodes)
    np.testing.assert_allclose(np.sum(found * along), slope, rtol=1e-2)
