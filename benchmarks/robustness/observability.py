"""How well a rope can be known from the shapes in which it hangs.

Cramér-Rao bounds: the true rope at rest at the start and at the goal is seen with noise, and the
controller knows neither the stiffness nor, beyond their tolerances, length and grips. Where a bound
is wide the shapes do not tell the quantity, whatever the estimator. Twist and supports of the goal
are left out, and so are the shapes on the way.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from benchmarks.robustness.combinations import GRIP_OFFSET, GRIP_ROTATION, LENGTH_ERROR
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod
from lariat.scenario import SIDES, Scenario
from lariat.simulation.plants.factory import true_properties
from lariat.simulation.rest_shape import goal_grips

SIGHT_SIGMA = 0.0005
"""Standard deviation of each coordinate of a seen point [m]."""
SEEN_POINT_COUNT = 10
"""Number of points of a shape whose errors are independent."""
STIFFNESS_PRIOR = np.log(4.0)
"""Standard deviation of the logarithm of the stiffness before the rope is seen [-]."""
DIFFERENCE_SHARE = 0.3
"""Step of the finite differences, in standard deviations of the unknown before it is seen [-]."""


@dataclass(frozen=True)
class Bounds:
    """Least standard deviations that the shapes at start and goal admit."""

    stiffness: float
    """Of the stiffness, relative to it, were the points of the rope recognized [-]."""
    place: float
    """Root mean square of the nodes at the goal along the rope, which is seen across itself [m]."""


def bounds(scenario: Scenario) -> Bounds:
    """Return how well the shapes of a scenario's true rope tell what is hidden."""
    prior = _prior(scenario)
    before = np.diag(np.where(prior > 0.0, 1.0 / np.maximum(prior, 1e-12) ** 2, 1.0))
    recognized, across = before.copy(), before.copy()
    along = np.zeros((SEEN_POINT_COUNT, len(prior)))
    for left, right in (scenario.grips(scenario.start), goal_grips(scenario)):
        _, tangents = _points(scenario, left, right, np.zeros(len(prior)))
        jacobian = _jacobian(scenario, left, right, prior)
        along = np.einsum("kc,kcp->kp", tangents, jacobian)
        normal = jacobian - tangents[..., None] * along[:, None]
        for information, rows in ((recognized, jacobian), (across, normal)):
            rows = rows.reshape(-1, len(prior))
            information += rows.T @ rows / SIGHT_SIGMA**2
    spread = along @ np.linalg.inv(across) @ along.T
    return Bounds(
        float(np.sqrt(np.linalg.inv(recognized)[0, 0])), float(np.sqrt(np.mean(np.diag(spread))))
    )


def _prior(scenario: Scenario) -> Float64[np.ndarray, "p"]:
    """Standard deviation of each unknown before the rope is seen; 0 for what is known.

    Unknowns: logarithm of the stiffness ratio [-], share of length [-], and for each end an offset
    [m] and a rotation vector [rad].
    """
    ends = []
    for side in SIDES:
        rotation = np.radians(GRIP_ROTATION) if scenario.end(side).rotates else 0.0
        ends += [GRIP_OFFSET / np.sqrt(3.0)] * 3 + [rotation / np.sqrt(3.0)] * 3
    return np.array([STIFFNESS_PRIOR, LENGTH_ERROR, *ends])


def _jacobian(
    scenario: Scenario, left: Pose, right: Pose, prior: Float64[np.ndarray, "p"]
) -> Float64[np.ndarray, "k 3 p"]:
    """Derivatives of the seen points; those of known quantities are zero."""
    columns = np.zeros((SEEN_POINT_COUNT, 3, len(prior)))
    for k, sigma in enumerate(prior):
        if sigma > 0.0:
            step = DIFFERENCE_SHARE * sigma * np.eye(len(prior))[k]
            ahead, behind = (_points(scenario, left, right, d)[0] for d in (step, -step))
            columns[..., k] = (ahead - behind) / (2.0 * step[k])
    return columns


def _points(
    scenario: Scenario, left: Pose, right: Pose, changes: Float64[np.ndarray, "p"]
) -> tuple[Float64[np.ndarray, "k 3"], Float64[np.ndarray, "k 3"]]:
    """Seen points of the true rope at rest with its unknowns changed, and unit tangents there."""
    properties = true_properties(scenario)
    changed = replace(
        properties,
        youngs_modulus=properties.youngs_modulus * float(np.exp(changes[0])),
        length=properties.length * (1.0 + float(changes[1])),
    )
    grips = (
        grip @ Pose(change[:3], poses.exponential(change[3:]))
        for grip, change in zip((left, right), changes[2:].reshape(2, 6), strict=True)
    )
    nodes = Rod(changed, scenario.rope.node_count).rest(*grips).state.positions
    chosen = np.linspace(0, len(nodes) - 1, SEEN_POINT_COUNT + 2).round().astype(int)[1:-1]
    tangents = poses.normalized(np.gradient(nodes, axis=0))
    return nodes[chosen], tangents[chosen]
