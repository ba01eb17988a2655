"""Policy of Stable-Baselines3 behind the observations of `ShapeControl`."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from jaxtyping import Float32
from stable_baselines3 import PPO, SAC

Algorithm = Literal["sac", "ppo"]
"""Algorithm of reinforcement learning."""
LEARNERS: dict[Algorithm, type[SAC] | type[PPO]] = {"sac": SAC, "ppo": PPO}
"""Classes of Stable-Baselines3 by the algorithm."""
SEEN_NODES = 5
"""Number of nodes of rope and goal that the policy sees, evenly spaced from end to end."""
LENGTH_SCALES = (0.2, 0.02)
"""Lengths that scale distances to order one, far from the goal and near it [m]."""


FULL_SPEED_DISTANCE = 0.1
"""Distance of a grip from its end of the goal from which on it may have its full speed [m]."""


def features(observation: dict[str, np.ndarray]) -> Float32[np.ndarray, "f"]:
    """Return the inputs of the network, each of order one.

    They are the distance of some nodes of the rope, and of both grips, from the goal at a coarse
    and at a fine scale, the direction from each grip to its end of the goal, and position and
    velocity of the grips.

    Args:
        observation: Observation of `ShapeControl` with nodes.
    """
    nodes, goal = observation["nodes"], observation["goal"]
    seen = np.linspace(0, len(goal) - 1, SEEN_NODES).round().astype(int)
    left = np.concatenate([goal[seen] - nodes[seen], _ways(observation)])
    parts = [np.tanh(left / scale).ravel() for scale in LENGTH_SCALES]
    ways = left[-2:]
    parts.append((ways / (np.linalg.norm(ways, axis=1, keepdims=True) + 1e-6)).ravel())
    grips = observation["grips"][:, :3]
    parts += [grips.ravel() / LENGTH_SCALES[0], observation["velocities"][:, :3].ravel()]
    return np.concatenate(parts).astype(np.float32)


def slowed(
    output: Float32[np.ndarray, "2 3"], observation: dict[str, np.ndarray]
) -> Float32[np.ndarray, "2 3"]:
    """Return the action for the output of the network: the nearer to the goal, the slower.

    Args:
        output: Output of the network, from -1 to 1.
        observation: Observation that it answers.
    """
    distances = np.linalg.norm(_ways(observation), axis=1, keepdims=True)
    return (output * np.minimum(distances / FULL_SPEED_DISTANCE, 1.0)).astype(np.float32)


def _ways(observation: dict[str, np.ndarray]) -> Float32[np.ndarray, "2 3"]:
    """Differences from each grip to its end of the goal [m]."""
    return observation["goal"][[0, -1]] - observation["grips"][:, :3]


class PolicyView(gymnasium.Wrapper):
    """`ShapeControl` as the network sees it: `features` are observed, actions are `slowed`."""

    def __init__(self, env: gymnasium.Env) -> None:
        """Wrap an environment that observes nodes.

        Args:
            env: Environment.
        """
        super().__init__(env)
        size = 3 * (len(LENGTH_SCALES) * (SEEN_NODES + 2) + 6)
        self.observation_space = spaces.Box(-np.inf, np.inf, (size,), np.float32)
        self._observation: dict[str, np.ndarray] = {}

    def reset(self, **options: Any) -> tuple[Float32[np.ndarray, "f"], dict[str, Any]]:
        """Begin an episode."""
        self._observation, info = self.env.reset(**options)
        return features(self._observation), info

    def step(
        self, action: np.ndarray
    ) -> tuple[Float32[np.ndarray, "f"], Any, bool, bool, dict[str, Any]]:
        """Advance by one period."""
        slow = slowed(action, self._observation)
        self._observation, reward, terminated, truncated, info = self.env.step(slow)
        return features(self._observation), reward, terminated, truncated, info


class ReinforcedPolicy:
    """Deterministic part of a policy that reinforcement learning has trained."""

    def __init__(self, model: SAC | PPO) -> None:
        """Take a model of Stable-Baselines3.

        Args:
            model: Model that was trained on `PolicyView`.
        """
        self.model = model

    def act(self, observation: dict[str, np.ndarray]) -> Float32[np.ndarray, "2 3"]:
        """Return the action for an observation of `ShapeControl`."""
        output = self.model.predict(features(observation), deterministic=True)[0]
        return slowed(output, observation)

    @staticmethod
    def load(file: Path, algorithm: Algorithm) -> ReinforcedPolicy:
        """Return the policy of a file that `reinforcement.train` wrote.

        Args:
            file: File of the weights.
            algorithm: Algorithm that trained them.
        """
        return ReinforcedPolicy(LEARNERS[algorithm].load(file, device="cpu"))
