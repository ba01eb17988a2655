"""Policies in seeded scenes that their training has not seen: `lariat bench policies`.

A policy is trained through the rod's gradients, by imitation of the planner, or by SAC or PPO
(`environments.policies`), then shapes a finer rope in the environment `environments.shape_control`.
The baseline goes straight to the goal.
"""

from __future__ import annotations

import json as encoder
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Literal, Protocol

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table

from benchmarks.conditions import PLANT_NAMES
from benchmarks.result_block import find_block, show
from environments.policies import distillation
from environments.policies.distillation import DistillationSettings
from environments.policies.grip_policy import GripPolicy
from environments.policies.training import TrainingSettings, train
from environments.shape_control import ShapeControl
from lariat.configuration import ConfigurationError
from lariat.scenario import load

REACHED_ERROR = 5e-3
"""Mean node distance to the goal at which it is reached [m]."""
FINAL_STEPS = 4
"""Number of last steps over which the final error is averaged."""
Algorithm = Literal["gradients", "distilled", "sac", "ppo"]
"""Algorithm of a training: through the rod's gradients, from planned paths, or from rewards."""
Policy = Callable[[dict[str, np.ndarray]], np.ndarray]
"""Function from an observation to an action."""


class Trained(Protocol):
    """Policy that was trained."""

    def act(self, observation: dict[str, np.ndarray]) -> np.ndarray:
        """Return the action for an observation of `ShapeControl`."""
        ...


@dataclass(frozen=True)
class Episode:
    """Result of one episode."""

    error: float
    """Mean node distance of true rope and goal over the last 0.2 s [m]."""
    clearance: float
    """Least clearance of rope and grippers [m]."""
    touched: bool
    """Whether rope or gripper touched an obstacle."""
    reached_after: float | None
    """Time after which the rope stayed within `REACHED_ERROR` [s]; None if it did not."""

    @property
    def succeeded(self) -> bool:
        """Whether the goal was reached and nothing was touched."""
        return self.error <= REACHED_ERROR and not self.touched


def run(
    scene: tuple[Literal["easy", "hard"], ...] = ("easy", "hard"),
    plant: Literal["rod", "mujoco", "links"] = "mujoco",
    plant_nodes: int = 118,
    count: int = 40,
    seed: int = 0,
    algorithm: Algorithm = "gradients",
    iterations: int = 500,
    steps: int = 100_000,
    goals: int = 128,
    weights: Path | None = None,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Train a policy and measure it on goals that it has not seen.

    On one core, training through gradients takes two minutes, by planned paths four, 15 000 steps
    of SAC five, 400 000 steps of PPO 18, and an episode about four seconds with MuJoCo's rope.

    Examples:
      lariat bench policies
      lariat bench policies --scene easy --count 100 --plant rod
      lariat bench policies --weights policy.pt
      lariat bench policies --algorithm distilled --weights distilled.pt
      lariat bench policies --algorithm sac --scene easy --steps 15000 --weights sac.zip
      lariat bench policies --algorithm ppo --scene easy --steps 400000 --weights ppo.zip

    Args:
        scene: Kinds of the scenes.
        plant: Simulator of the true rope.
        plant_nodes: Number of nodes of the true rope; that of the training has 20, or 10 for
            sac and ppo.
        count: Number of episodes of each kind and policy.
        seed: Seed of the scenes; that of the training is 1000.
        algorithm: Algorithm of the training; sac and ppo learn the easy scenes only.
        iterations: Steps of the optimiser through gradients.
        steps: Steps of the environment by sac or ppo.
        goals: Goals of each kind in the training.
        weights: File of the trained weights: read where it exists, else written. Weights of sac and
            ppo with fewer steps are trained on.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.

    Returns:
        0 if the trained policy reaches 95 % of the easy goals within 5 mm and touches nothing in
        them, else 1.
    """
    block = find_block(docs)
    console = Console(stderr=True, highlight=False)
    with Progress(console=console, transient=True) as progress:
        trained: Trained
        if algorithm == "gradients":
            settings = TrainingSettings(iterations=iterations, goals=goals)
            trained = _by_gradients(settings, weights, progress)
        elif algorithm == "distilled":
            trained = _by_planned_paths(DistillationSettings(goals=goals), weights, progress)
        else:
            trained = _by_rewards(algorithm, steps, goals, weights, progress)
        straight = GripPolicy(load("three-cylinders").limits.speed).double()
        policies: dict[str, Trained] = {"straight": straight, "trained": trained}
        bar = progress.add_task("episodes", total=count * len(scene) * len(policies))
        results: dict[tuple[str, str], list[Episode]] = {}
        for kind in scene:
            env = ShapeControl(kind, plant, plant_node_count=plant_nodes, scene_seed=seed)
            for number in range(count):
                for name, policy in policies.items():
                    episode = run_episode(env, policy.act, number)
                    results.setdefault((kind, name), []).append(episode)
                    progress.advance(bar)
            env.close()
    rows = {f"{kind}, {name}": summary(found) for (kind, name), found in results.items()}
    if json:
        episodes = {f"{k}, {n}": [asdict(e) for e in found] for (k, n), found in results.items()}
        print(encoder.dumps({"summary": rows, "episodes": episodes}))
    else:
        caption = f"plant: {PLANT_NAMES[plant]}, n = {plant_nodes}; sensed: truth; not adapting"
        show([_table(rows, caption)], block)
    easy = results.get(("easy", "trained"))
    return 0 if easy is None or np.mean([e.succeeded for e in easy]) >= 0.95 else 1


def run_episode(env: ShapeControl, policy: Policy, scene: int) -> Episode:
    """Run one episode.

    Args:
        env: Environment.
        policy: Function from an observation to an action.
        scene: Number of the scene.
    """
    observation, info = env.reset(seed=0, options={"scene": scene})
    errors, clearance, touched, truncated = [], np.inf, False, False
    while not truncated:
        observation, _, _, truncated, info = env.step(policy(observation))
        errors.append(info["error"])
        clearance = min(clearance, info["clearance"], info["gripper_clearance"])
        touched |= bool(info["touched"])
    beyond = np.flatnonzero(np.array(errors) > REACHED_ERROR)
    begins = int(beyond[-1]) + 1 if len(beyond) else 0
    reached = None if begins == len(errors) else env.period * (begins + 1)
    return Episode(float(np.mean(errors[-FINAL_STEPS:])), clearance, touched, reached)


def summary(episodes: list[Episode]) -> dict[str, float]:
    """Return statistics of several episodes.

    Args:
        episodes: Results.
    """
    errors = [1e3 * e.error for e in episodes]
    times = [e.reached_after for e in episodes if e.reached_after is not None] or [np.nan]
    figures = {
        "episodes": len(episodes),
        "within 5 mm": sum(e.error <= REACHED_ERROR for e in episodes),
        "within 5 mm, untouched": sum(e.succeeded for e in episodes),
        "median error [mm]": np.median(errors),
        "largest error [mm]": np.max(errors),
        "median time to 5 mm [s]": np.median(times),
        "touched": sum(e.touched for e in episodes),
        "clearance below 3 mm": sum(e.clearance < 3e-3 for e in episodes),
    }
    return {name: round(float(value), 3) for name, value in figures.items()}


def _by_gradients(
    settings: TrainingSettings, weights: Path | None, progress: Progress
) -> GripPolicy:
    if weights is not None and weights.exists():
        return GripPolicy.load(weights)
    bar = progress.add_task("training", total=settings.iterations)
    policy = train(settings, lambda step, cost: progress.update(bar, completed=step + 1))
    if weights is not None:
        policy.save(weights)
    return policy


def _by_planned_paths(
    settings: DistillationSettings, weights: Path | None, progress: Progress
) -> GripPolicy:
    if weights is not None and weights.exists():
        return GripPolicy.load(weights)
    bar = progress.add_task("training", total=1.0)
    policy = distillation.train(settings, lambda share: progress.update(bar, completed=share))
    if weights is not None:
        policy.save(weights)
    return policy


def _by_rewards(
    algorithm: Literal["sac", "ppo"],
    steps: int,
    goals: int,
    weights: Path | None,
    progress: Progress,
) -> Trained:
    # Imported late: the other policies do not need Stable-Baselines3.
    try:
        from environments.policies import reinforcement
    except ModuleNotFoundError as error:
        raise ConfigurationError(
            f"--algorithm {algorithm} needs {error.name}, which is not installed; run in the "
            "clone: pip install -e . -e './stack[learn]'"
        ) from error
    bar = progress.add_task("training", total=steps)
    settings = reinforcement.ReinforcementSettings(algorithm, steps=steps, goals=goals)
    return reinforcement.train(settings, weights, lambda done: progress.update(bar, completed=done))


def _table(rows: dict[str, dict[str, float]], caption: str) -> Table:
    table = Table(caption=caption)
    table.add_column("")
    for name in rows:
        table.add_column(name, justify="right")
    for figure in next(iter(rows.values())):
        table.add_row(escape(figure), *(f"{row[figure]:g}" for row in rows.values()))
    return table
