"""Grips of a shape that is pulled at a node."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.run.node_drag_solver import CLOSE, NodeDragSolver
from lariat.geometry.poses import Pose
from lariat.rod import Rod
from lariat.scenario import load
from lariat.scenario.rod_properties import rod_properties

SCENARIO = load("three-cylinders")
ROD = Rod(rod_properties(SCENARIO.rope), SCENARIO.rope.node_count)
NODE = SCENARIO.rope.node_count // 3


def drag(
    solver: NodeDragSolver, grips: tuple[Pose, Pose], node: int, target: np.ndarray
) -> tuple[tuple[Pose, Pose], np.ndarray]:
    """Pull again and again, as a drag does; grips and nodes at its end."""
    for _ in range(6):
        grips = solver.pull(grips, node, target)
    return grips, ROD.rest(*grips).state.positions


@pytest.mark.parametrize("displacement", [(0.0, 0.05, 0.0), (0.03, 0.0, -0.03), (0.0, 0.0, 0.06)])
def test_rest_shape_passes_through_the_place_to_which_a_node_is_pulled(
    displacement: tuple[float, float, float],
) -> None:
    grips = SCENARIO.grips(SCENARIO.goal)
    before = ROD.rest(*grips).state.positions
    target = before[NODE] + displacement
    after, nodes = drag(NodeDragSolver(ROD, (True, True)), grips, NODE, target)
    assert np.linalg.norm(nodes[NODE] - target) < 2.0 * CLOSE
    # The rest of the shape follows less than if the whole rope had been moved.
    change = np.linalg.norm(nodes - before, axis=1).mean()
    assert change < 0.95 * np.linalg.norm(displacement)
    for old, new in zip(grips, after, strict=True):
        assert np.array_equal(old.orientation, new.orientation)


def test_fixed_end_stays_and_the_node_comes_as_near_as_it_can() -> None:
    grips = SCENARIO.grips(SCENARIO.goal)
    before = ROD.rest(*grips).state.positions
    # Beyond the reach of the rope from its fixed end.
    target = before[0] + np.array([0.0, 0.0, 0.3])
    after, nodes = drag(NodeDragSolver(ROD, (False, True)), grips, 4, target)
    assert np.array_equal(after[0].position, grips[0].position)
    assert np.linalg.norm(nodes[4] - target) < np.linalg.norm(before[4] - target)


def test_node_that_is_none_is_refused() -> None:
    with pytest.raises(ValueError, match=f"{SCENARIO.rope.node_count}"):
        NodeDragSolver(ROD, (True, True)).pull(
            SCENARIO.grips(SCENARIO.goal), SCENARIO.rope.node_count, np.zeros(3)
        )
