"""Curves of the drawing, from the messages that hold them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from services.recorder.view import colors
from services.recorder.view.colors import RgbaArray
from shared import topics
from shared.messages import NodeChain, Path, Plan, TaskState, chain, goal_of

PATH_SHAPES = 6
"""Number of the rope's shapes that are drawn along a path."""
CURVES = {
    topics.ROPE_NODES.key: "rope",
    topics.ROPE_TRUTH.key: "truth",
    topics.TASK_STATE.key: "goal",
    topics.CONTROLLER_PLAN.key: "prediction",
    topics.CONTROLLER_PATH.key: "path",
}
"""Name of what is drawn of each topic that holds curves."""


@dataclass(frozen=True)
class Curves:
    """Polylines of one kind, with a colour for each point."""

    lines: tuple[tuple[Float64[np.ndarray, "n 3"], RgbaArray], ...]
    """Points in the world [m] and colours of each line."""

    @property
    def points(self) -> Float64[np.ndarray, "n 3"]:
        """Points of all lines [m]."""
        return np.concatenate([np.zeros((0, 3)), *(points for points, _ in self.lines)])

    @property
    def colors(self) -> RgbaArray:
        """Colours of all points."""
        return np.concatenate([np.zeros((0, 4)), *(shades for _, shades in self.lines)])


def curves(message: NodeChain | TaskState | Plan | Path, key: str) -> Curves:
    """Return the curves of a message of a topic of `CURVES`."""
    if isinstance(message, NodeChain):
        return _rope(message, measured=key == topics.ROPE_NODES.key)
    if isinstance(message, TaskState):
        return _uniform(colors.GOAL, goal_of(message.goal).curve)
    if isinstance(message, Plan):
        count = message.node_count
        return _uniform(colors.PREDICTION, chain(message.nodes)[-count:] if count else None)
    return _path(message)


def _rope(message: NodeChain, measured: bool) -> Curves:
    nodes = chain(message.positions)
    if not measured:
        return _uniform(colors.TRUE_ROPE, nodes)
    sigma = np.array(message.sigma) if len(message.sigma) == len(nodes) else np.zeros(len(nodes))
    return Curves(((nodes, colors.of_sigma(sigma)),) if len(nodes) else ())


def _path(message: Path) -> Curves:
    lines = [chain(message.left_positions), chain(message.right_positions)]
    if message.node_count:
        shapes = chain(message.nodes).reshape(-1, message.node_count, 3)
        drawn = np.unique(np.linspace(0, len(shapes) - 1, PATH_SHAPES).round().astype(int))
        lines += [shapes[k] for k in drawn] if len(shapes) else []
    return _uniform(colors.PATH, *lines)


def _uniform(color: tuple[float, ...], *lines: Float64[np.ndarray, "n 3"] | None) -> Curves:
    drawn = [line for line in lines if line is not None and len(line)]
    return Curves(tuple((line, colors.uniform(color, len(line))) for line in drawn))
