"""Steps of Adam on velocities and on the weights of the network."""

from __future__ import annotations

import numpy as np

from lariat.paper.policies import Actions, Adam, Network


def test_first_step_of_adam_is_the_learning_rate_against_the_gradient() -> None:
    gradient = np.array([3.0, -0.2])
    change = Adam((2,), rate=0.01).step(gradient)
    np.testing.assert_allclose(change, [-0.01, 0.01], rtol=1e-6)


def test_actions_are_shifted_by_the_elapsed_steps_and_keep_the_last_one() -> None:
    actions = Actions(step_count=3, component_count=1, rate=1.0)
    nodes, goal = np.zeros((3, 4, 3)), np.zeros((4, 3))
    for gradient in ([[0.0], [-1.0], [0.0]], [[0.0], [0.0], [-1.0]]):
        actions.begin(0)
        actions.learn(np.array(gradient))
    np.testing.assert_allclose(actions.velocities(nodes, goal).ravel(), [0.0, 1.0, 1.0])
    actions.begin(1)
    np.testing.assert_allclose(actions.velocities(nodes, goal).ravel(), [1.0, 1.0, 1.0])


def test_network_learns_as_the_same_layers_in_torch() -> None:
    import torch

    network = Network(4, 6, 1e-3, seed=3)
    layers = torch.nn.Sequential(
        torch.nn.Linear(24, 256),
        torch.nn.ReLU(),
        torch.nn.Linear(256, 256),
        torch.nn.ReLU(),
        torch.nn.Linear(256, 6),
    )
    with torch.no_grad():
        for own, theirs in zip(network.layers, layers.parameters(), strict=True):
            theirs.copy_(own)
    adam = torch.optim.Adam(layers.parameters(), lr=1e-3)
    random = np.random.default_rng(0)
    goal = random.normal(size=(4, 3))
    for _ in range(3):
        nodes, gradient = random.normal(size=(5, 4, 3)), random.normal(size=(5, 6))
        inputs = np.concatenate([nodes.reshape(5, 12), np.tile(goal.ravel(), (5, 1))], axis=1)
        outputs = layers(torch.from_numpy(inputs).float())
        assert np.allclose(network.velocities(nodes, goal), outputs.detach().numpy(), atol=1e-5)
        adam.zero_grad()
        outputs.backward(torch.from_numpy(gradient).float())
        adam.step()
        network.learn(gradient)


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
