"""Clearance that a path keeps with a stated probability, where rope and grips are known in part.

Ropes are drawn from what is known of the present one, and rolled out along the path between the
same grippers. Another draw comes closer than the nearest of N with a probability of 1 / (N + 1),
whatever the distribution (Wilks, Determination of sample sizes for setting tolerance limits, Annals
of Mathematical Statistics 12(1), 1941). It is that of the whole path, instants and obstacles
together, and nothing is linearized: ropes near a fold, or grips that cancel a length, are no normal
distribution of shapes.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from jaxtyping import Float64, Int64

from lariat.control.estimation.rope_unknowns import RopeUnknowns
from lariat.geometry.obstacles import scene_distance
from lariat.geometry.polylines import with_midpoints
from lariat.geometry.swept_clearance import swept_clearance
from lariat.planning.path_check import ROD_SUBSTEPS, driven
from lariat.planning.problem import DrawnRope, Problem, WholePath
from lariat.rod import Rod

PROBABILITY = 0.99
"""Probability with which a path keeps its certain clearance [-]."""
MODEL_SHARE = 0.375
"""Share of the rest of that probability that is left to errors of the model [-]."""
DRAWS = round(1.0 / ((1.0 - MODEL_SHARE) * (1.0 - PROBABILITY))) - 1
"""Number of ropes of which the nearest is undercut with what remains of it."""
MIN_STRIDE, MAX_STEPS = 4, 75
"""Least number of points of a path per step of a drawn rope, and most steps of a path."""
NEAREST = 8
"""Number of the nearest ropes whose motion between two steps is regarded."""


def certain_clearance(problem: Problem, path: WholePath) -> float:
    """Return the clearance that a path keeps with `PROBABILITY` [m].

    Obstacles count as standing where they are seen.

    Args:
        problem: Problem with `DRAWS` drawn ropes; without any, the path's own clearance is certain.
        path: Path of the rope's ends.
    """
    stride = max(MIN_STRIDE, len(path) // MAX_STEPS)
    motions = [driven_rope(problem, path, rope, stride, substeps=1) for rope in problem.drawn]
    possible = [motion for motion in motions if motion is not None]
    if not possible or not problem.obstacles:
        return path.clearance
    nodes = np.stack(possible)
    points, own = with_midpoints(nodes), with_midpoints(path.nodes[_steps(path, stride)])
    # A distance changes by at most the distance travelled, which rules out most points.
    distance = scene_distance(own, problem.obstacles)
    shift = np.max(np.linalg.norm(points - own, axis=-1), axis=0)
    near = distance - shift <= np.min(distance + shift)
    rough = np.min(scene_distance(points[:, near], problem.obstacles), axis=1)
    nearest = nodes[np.argsort(rough)[:NEAREST]]
    swept = [swept_clearance(motion, problem.radius, problem.obstacles) for motion in nearest]
    return min(path.clearance, *swept)


def drawn_ropes(
    rod: Rod,
    unknowns: RopeUnknowns,
    mean: Float64[np.ndarray, "P"],
    covariance: Float64[np.ndarray, "P P"],
    seed: int,
    count: int = DRAWS,
) -> tuple[DrawnRope, ...]:
    """Return ropes drawn from a normal distribution of their unknowns.

    Args:
        rod: Rod whose number of nodes they have.
        unknowns: Meaning of the unknowns.
        mean: Means of the unknowns.
        covariance: Their covariance; its lower triangle is read.
        seed: Another one for each path, or all of them would be wrong together.
    """
    variances, axes = np.linalg.eigh(covariance)
    normal = np.random.default_rng(seed).standard_normal((count, len(mean)))
    # The symmetric root is the same whichever axes equal variances get.
    root = (axes * np.sqrt(np.maximum(variances, 0.0))) @ axes.T
    drawn = mean + normal @ root
    return tuple(
        DrawnRope(rod.with_properties(unknowns.properties(x)), unknowns.grip_errors(x).ends)
        for x in drawn
    )


def driven_rope(
    problem: Problem,
    path: WholePath,
    rope: DrawnRope,
    stride: int = 1,
    substeps: int = ROD_SUBSTEPS,
) -> Float64[np.ndarray, "k n 3"] | None:
    """Return the nodes of another rope that the same grippers lead along a path [m].

    Args:
        rope: Rope with as many nodes as the problem's.
        stride: Points of the path per step.
        substeps: Implicit steps of its rod per step.

    Returns:
        The nodes; None for a rope that is too short to be held at the start.
    """
    other = replace(problem, rod=rope.rod, held=rope.held)
    ends = other.ends(problem.grippers(path[_steps(path, stride)]))
    supports = problem.packed_supports
    try:
        rest = rope.rod.rest(*ends.pair(0), guess=problem.state, obstacles=supports)
    except ValueError:
        return None
    other = replace(other, state=rest.state)
    return driven(other, ends, stride * path.dt, substeps=substeps)


def _steps(path: WholePath, stride: int) -> Int64[np.ndarray, "k"]:
    """Indices of every so many points of a path, and of its last one."""
    last = len(path) - 1
    return np.append(np.arange(0, last, stride), last)
