"""Training by SAC and PPO."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

reinforcement = pytest.importorskip(
    "environments.policies.reinforcement",
    reason="no stable-baselines3; install the extra `learn` of stack/pyproject.toml",
)

from environments.policies.reinforced_policy import (  # noqa: E402
    LEARNERS,
    PolicyView,
    ReinforcedPolicy,
    features,
    slowed,
)
from environments.shape_control import ShapeControl  # noqa: E402

SHORT = {"goals": 2, "node_count": 8, "time_limit": 0.5}


@pytest.mark.parametrize("algorithm", ["sac", "ppo"])
def test_a_saved_training_goes_on_where_it_ended(
    algorithm: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    for options in reinforcement.OPTIONS.values():
        monkeypatch.setitem(options, "batch_size", 32)
    monkeypatch.setitem(reinforcement.OPTIONS["sac"], "learning_starts", 20)
    monkeypatch.setitem(reinforcement.OPTIONS["sac"], "buffer_size", 200)
    monkeypatch.setitem(reinforcement.OPTIONS["ppo"], "n_steps", 8)
    file, reports = tmp_path / "policy.zip", []
    for steps in (64, 128):
        settings = reinforcement.ReinforcementSettings(algorithm, steps=steps, **SHORT)
        policy = reinforcement.train(settings, file, reports.append)
        assert policy.model.num_timesteps == steps
    assert reports[-1] == 128
    assert sum(64 < done <= 128 for done in reports) == sum(done <= 64 for done in reports)
    if algorithm == "sac":
        model = LEARNERS["sac"].load(file)
        model.load_replay_buffer(file.with_suffix(".buffer.pkl"))
        assert model.replay_buffer is not None
        assert model.replay_buffer.size() == 128
    env = ShapeControl(node_count=12, plant_node_count=12, scene_count=1)
    observation, _ = env.reset(seed=0)
    action = ReinforcedPolicy.load(file, algorithm).act(observation)
    assert action.shape == (2, 3)
    assert np.array_equal(action, policy.act(observation))
    env.close()


def test_the_features_vanish_with_the_distance_to_the_goal():
    env = PolicyView(ShapeControl(node_count=9, plant_node_count=9, scene_count=1))
    observation, _ = env.reset(seed=0)
    assert observation.shape == env.observation_space.shape
    assert np.abs(observation).max() < 5.0
    goal = np.random.default_rng(0).normal(size=(9, 3))
    there = {"nodes": goal, "goal": goal, "velocities": np.zeros((2, 6))}
    there["grips"] = np.hstack([goal[[0, -1]], np.zeros((2, 4))])
    assert not features(there)[:-12].any()
    assert not slowed(np.ones((2, 3), np.float32), there).any()
    env.close()


def test_the_reward_of_a_training_is_largest_at_the_goal():
    settings = reinforcement.ReinforcementSettings(**SHORT)
    env = reinforcement.training_environment(settings)
    env.reset(seed=0)
    rewards, errors = [], []
    for _ in range(10):
        goal = env.unwrapped._goal[[0, -1]]  # type: ignore[attr-defined]
        grips = env.unwrapped._motion.positions  # type: ignore[attr-defined]
        way = goal - grips
        _, reward, _, _, info = env.step(way / np.linalg.norm(way, axis=1, keepdims=True))
        rewards.append(reward)
        errors.append(info["error"])
    assert np.all(np.diff(errors[2:]) < 0.0)
    assert np.all(np.diff(rewards[3:]) > 0.0)
    env.close()
