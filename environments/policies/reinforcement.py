"""Training of a policy in `ShapeControl` by SAC or PPO of Stable-Baselines3.

The policy sees the rope and the goal. It takes no derivative of the rod: it learns from rewards.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecEnv

from environments.policies.reinforced_policy import (
    LEARNERS,
    Algorithm,
    PolicyView,
    ReinforcedPolicy,
)
from environments.shape_control import ShapeControl, StaticKind


@dataclass(frozen=True)
class ReinforcementSettings:
    """Settings of a training."""

    algorithm: Algorithm = "sac"
    """Algorithm."""
    steps: int = 100_000
    """Number of steps of the environment."""
    scene: StaticKind = "easy"
    """Kind of the scenes that the goals are taken from."""
    goals: int = 128
    """Number of goals, from which episodes draw."""
    seed: int = 1000
    """Seed of the goals, of the draws and of the weights."""
    node_count: int = 10
    """Number of nodes of the rope."""
    time_limit: float = 3.0
    """Duration of an episode [s]."""
    checkpoint_period: int = 5_000
    """Number of steps of the environment between two checkpoints."""


WIDTHS = (128, 128)
"""Numbers of units of the hidden layers of each network."""
DISCOUNT = 0.95
"""Discount of the reward of a later step [-]: the rope is where the grips are within a second."""
OPTIONS: dict[Algorithm, dict[str, Any]] = {
    "sac": {
        "learning_rate": 7e-4,
        "batch_size": 256,
        "buffer_size": 100_000,
        "learning_starts": 1000,
        "tau": 0.02,
        "train_freq": 1,
    },
    "ppo": {
        "learning_rate": 5e-4,
        "n_steps": 512,
        "batch_size": 256,
        "ent_coef": 0.0,
        "policy_kwargs": {"log_std_init": -1.0},
    },
}
"""Options of each algorithm that differ from the library's."""
ENVIRONMENT_COUNTS: dict[Algorithm, int] = {"sac": 1, "ppo": 4}
"""Numbers of environments that are stepped together."""
REWARD_SCALE = 5.0
"""Factor of the reward in training [-]."""
NEAR_DISTANCES = (0.03, 0.005)
"""Distances to the goal below which a training rewards a step by up to 1 more [m]."""


class NearReward(gymnasium.Wrapper):
    """`ShapeControl` with a reward that grows steeply near the goal.

    The reward of `ShapeControl` falls linearly with the error. A centimetre of it is less than the
    noise of an exploring policy; millimetres need a scale of their own.
    """

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Advance by one period."""
        observation, reward, terminated, truncated, info = self.env.step(action)
        near = np.exp(-info["error"] / np.array(NEAR_DISTANCES)).sum()
        return observation, REWARD_SCALE * float(reward) + float(near), terminated, truncated, info


def train(
    settings: ReinforcementSettings,
    file: Path | None = None,
    report: Callable[[int], None] = lambda steps: None,
) -> ReinforcedPolicy:
    """Return a trained policy.

    A file that exists is trained on until it has seen `settings.steps` steps.

    Args:
        settings: Settings of the training.
        file: File of the weights, which is written at every checkpoint; SAC keeps its replay
            buffer beside it.
        report: Callback that takes the number of steps that are done.
    """
    environments = make_vec_env(
        lambda: training_environment(settings),
        n_envs=ENVIRONMENT_COUNTS[settings.algorithm],
        seed=settings.seed,
    )
    model = _model(settings, file, environments)
    missing = settings.steps - model.num_timesteps
    if missing > 0:
        checkpoints = _Checkpoints(settings.checkpoint_period, file, report)
        model.learn(missing, checkpoints, reset_num_timesteps=model.num_timesteps == 0)
        save(model, file)
    environments.close()
    return ReinforcedPolicy(model)


def training_environment(settings: ReinforcementSettings) -> gymnasium.Env:
    """Return the environment of a training.

    Args:
        settings: Settings of the training.
    """
    env = ShapeControl(
        settings.scene,
        node_count=settings.node_count,
        plant_node_count=settings.node_count,
        scene_count=settings.goals,
        scene_seed=settings.seed,
        time_limit=settings.time_limit,
    )
    return PolicyView(NearReward(env))


def save(model: SAC | PPO, file: Path | None) -> None:
    """Write the weights, and the replay buffer that SAC goes on from.

    Args:
        model: Model.
        file: File of the weights; None writes nothing.
    """
    if file is None:
        return
    model.save(file)
    if isinstance(model, SAC):
        model.save_replay_buffer(_buffer_file(file))


def _model(settings: ReinforcementSettings, file: Path | None, environments: VecEnv) -> SAC | PPO:
    learner = LEARNERS[settings.algorithm]
    if file is not None and file.exists():
        model = learner.load(file, environments, device="cpu")
        if isinstance(model, SAC) and _buffer_file(file).exists():
            model.load_replay_buffer(_buffer_file(file))
        return model
    options = OPTIONS[settings.algorithm]
    networks = {"net_arch": list(WIDTHS)} | options.get("policy_kwargs", {})
    return learner(
        "MlpPolicy",
        environments,
        seed=settings.seed,
        gamma=DISCOUNT,
        device="cpu",
        **options | {"policy_kwargs": networks},
    )


def _buffer_file(file: Path) -> Path:
    return file.with_suffix(".buffer.pkl")


class _Checkpoints(BaseCallback):
    """Saves the model from time to time and reports the steps."""

    def __init__(self, period: int, file: Path | None, report: Callable[[int], None]) -> None:
        super().__init__()
        self._period, self._file, self._report = period, file, report
        self._saved_at = 0

    def _on_training_start(self) -> None:
        self._saved_at = self.model.num_timesteps

    def _on_step(self) -> bool:
        self._report(self.model.num_timesteps)
        if self.model.num_timesteps - self._saved_at >= self._period:
            self._saved_at = self.model.num_timesteps
            assert isinstance(self.model, SAC | PPO)
            save(self.model, self._file)
        return True
