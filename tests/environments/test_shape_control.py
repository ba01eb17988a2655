"""Rope shaping by Gymnasium's interface."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from environments.shape_control import ID, ShapeControl


def straight_to_the_goal(observation: dict[str, np.ndarray], gain: float = 4.0) -> np.ndarray:
    """Velocities that are proportional to the distance of each grip from its end of the goal."""
    ends = observation["goal"][[0, -1]].astype(float)
    return gain * (ends - observation["grips"][:, :3]) / 0.5


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("observation", ["nodes", "camera"])
def test_environment_passes_the_checker_of_gymnasium(observation: str):
    env = gymnasium.make(
        ID, node_count=10, plant_node_count=19, observation=observation, scene_count=1
    )
    check_env(env.unwrapped, skip_render_check=True)
    env.close()


def test_a_proportional_law_reaches_an_easy_goal_on_a_finer_rope():
    env = ShapeControl(node_count=20, time_limit=4.0)
    observation, info = env.reset(seed=0, options={"scene": 3})
    begin = info["error"]
    truncated = False
    while not truncated:
        observation, reward, terminated, truncated, info = env.step(
            straight_to_the_goal(observation)
        )
        assert not terminated
        assert reward < 0.0
    assert env.true_nodes.shape == (58, 3)
    assert begin > 0.05
    assert info["error"] < 1e-3
    env.close()


def test_motion_keeps_the_limits_whatever_the_actions():
    env = ShapeControl(node_count=10, plant_node_count=10, time_limit=2.0)
    env.reset(seed=1)
    limits, random = env.scenario.limits, np.random.default_rng(0)
    previous = np.zeros((2, 6))
    truncated = False
    while not truncated:
        action = random.choice([-1.0, 1.0], size=(2, 3)).astype(np.float32)
        observation, _, _, truncated, _ = env.step(action)
        grips, velocities = observation["grips"], observation["velocities"]
        assert np.linalg.norm(velocities[:, :3], axis=1).max() <= limits.speed + 1e-6
        change = np.linalg.norm(velocities - previous, axis=1) / 0.05
        assert change.max() <= limits.acceleration + 1e-4
        distance = np.linalg.norm(grips[1, :3] - grips[0, :3])
        assert distance <= limits.overstretch * env.scenario.rope.length + 1e-6
        previous = velocities
    env.close()


def test_several_environments_step_together():
    envs = gymnasium.make_vec(
        ID, 2, vectorization_mode="sync", node_count=10, plant_node_count=10, scene_count=50
    )
    observation, _ = envs.reset(seed=3)
    assert observation["nodes"].shape == (2, 10, 3)
    assert not np.array_equal(observation["goal"][0], observation["goal"][1])
    _, rewards, _, _, info = envs.step(np.zeros((2, 2, 3), np.float32))
    assert rewards.shape == info["error"].shape == (2,)
    envs.close()


def test_a_scene_that_changes_in_the_run_is_refused():
    with pytest.raises(ValueError, match="got 'moving'"):
        ShapeControl(scene="moving")  # type: ignore[arg-type]


def test_environments_step_in_processes_of_their_own():
    options = {"node_count": 10, "plant_node_count": 10, "scene_count": 50}
    both = [
        gymnasium.make_vec(ID, 2, vectorization_mode="sync", **options),
        gymnasium.make_vec(
            ID,
            2,
            vectorization_mode="async",
            vector_kwargs={"context": "spawn"},
            **options,
        ),
    ]
    action = np.full((2, 2, 3), 0.5, np.float32)
    for envs in both:
        envs.reset(seed=3)
    (here, reward, *_), (there, same_reward, *_) = (envs.step(action) for envs in both)
    np.testing.assert_allclose(there["nodes"], here["nodes"], atol=1e-6)
    np.testing.assert_allclose(same_reward, reward, atol=1e-6)
    for envs in both:
        envs.close()
