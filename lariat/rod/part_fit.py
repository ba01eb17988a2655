"""Grips whose rope at rest gives a part of itself a wanted shape.

The rest of the rope is free. Levenberg-Marquardt on the displacements of the grips, with the
Jacobian of the rest shape by finite differences; it begins between grips at which the rod's own
rest shape, moved as a rigid body, lies on the wanted part as well as it can, and where both ends
rotate also between grips on the tangents of the part's ends.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.rod.results import Rest
from lariat.rod.rod import Rod
from lariat.rod.state import RodState
from lariat.rod.twist import add_turns

DISPLACEMENT, ROTATION = 0.001, 0.005
"""Displacement [m] and rotation [rad] of a grip for finite differences."""
MAX_STEP = 0.04
"""Largest component of a step: displacement [m], or rotation times `LEVER` [m]."""
LEVER = 0.1
"""Length that turns a rotation of a grip into a displacement [m]."""
MAX_ITERATIONS = 40
CLOSE = 1e-5
"""Mean distance of the nodes from the wanted part at which the fit ends [m]."""
LEAST_DECREASE = 1e-3
"""Decrease of the distance in an iteration below which the fit ends, as a share of it [-]."""
FIRST_DAMPING, MAX_DAMPING = 1e-3, 10.0
"""Damping of the first step, and the largest one, relative to the mean of the diagonal [-]."""
SPANS = (1.0, 0.75, 0.5)
"""Distances of the grips at which the fit begins, as shares of the given one [-]."""
SLACK = 0.9
"""Distance of a grip from the part along its tangent, as a share of the rope in between [-]."""
ALONG = np.array([0.0, 0.0, 1.0])
"""Direction of the rope in the frame of a grip."""

Grips = tuple[Pose, Pose]


@dataclass(frozen=True)
class PartFit:
    """Result of a fit."""

    grips: Grips
    """Left and right grip."""
    state: RodState
    """Rod at rest between them."""
    error: float
    """Mean distance of its nodes from the wanted part [m]."""


def part_points(
    shape: Float64[np.ndarray, "m 3"], part: tuple[float, float], node_count: int, length: float
) -> tuple[Float64[np.ndarray, "k 3"], Bool[np.ndarray, "n"]]:
    """Return where the nodes of a part lie [m], and which nodes they are.

    Args:
        shape: Nodes of the part in any number, its left end first [m].
        part: Distances of its ends from the left grip [m].
        node_count: Number of nodes of the rope.
        length: Length of the rope [m].
    """
    s = np.linspace(0.0, length, node_count)
    counted = (s >= part[0] - 1e-6 * length) & (s <= part[1] + 1e-6 * length)
    dense = polylines.resample_smooth(shape, 20 * node_count)
    at = (s[counted] - part[0]) / (part[1] - part[0])
    share = np.linspace(0.0, 1.0, len(dense))
    points = np.stack([np.interp(at, share, dense[:, k]) for k in range(3)], axis=1)
    return points, counted


def fit_part(
    rod: Rod,
    grips: Grips,
    moves: Bool[np.ndarray, "2 6"],
    points: Float64[np.ndarray, "k 3"],
    counted: Bool[np.ndarray, "n"],
    turns: float = 0.0,
    obstacles: Float64[np.ndarray, "m 13"] | None = None,
) -> PartFit:
    """Return grips whose rest shape brings some nodes as near to their points as it can.

    Args:
        rod: Rod that shapes the goals.
        grips: Present left and right grip; what does not move stays so.
        moves: Free components of each grip's displacement and rotation.
        points: Wanted places of the counted nodes [m].
        counted: Which nodes those are.
        turns: Whole turns of twist in the rod.
        obstacles: Supports, from `lariat.geometry.pack`.

    Raises:
        ValueError: The rod comes to rest between none of the grips that were tried.
    """
    fit = _Fit(rod, moves, points, counted, obstacles)
    best: PartFit | None = None
    firsts = list(_first_grips(grips, moves))
    if moves.all():
        firsts.append(_on_tangents(grips, points, counted, rod.properties.length))
    for first in firsts:
        rest = fit.at_rest(first, None)
        if rest is not None and turns:
            rest = fit.at_rest(first, add_turns(rest.state, turns))
        if rest is None:
            continue
        moved = _laid_on(first, moves, rest.state.positions[counted], points)
        again = fit.at_rest(moved, rest.state)
        solution = fit.solve(*((first, rest) if again is None else (moved, again)))
        if best is None or solution.error < best.error:
            best = solution
        if best.error < CLOSE:
            break
    if best is None:
        raise ValueError("the rope does not come to rest between the grips of the start")
    return best


class _Fit:
    """Levenberg-Marquardt iterations on the grips of one part."""

    def __init__(
        self,
        rod: Rod,
        moves: Bool[np.ndarray, "2 6"],
        points: Float64[np.ndarray, "k 3"],
        counted: Bool[np.ndarray, "n"],
        obstacles: Float64[np.ndarray, "m 13"] | None,
    ) -> None:
        self._rod, self._obstacles = rod, obstacles
        self._points, self._counted = points, counted
        self._free = [(side, axis) for side, axis in np.argwhere(moves)]

    def at_rest(self, grips: Grips, guess: RodState | None) -> Rest | None:
        """Rod at rest between two grips; None where there is no rest."""
        try:
            rest = self._rod.rest(*grips, guess=guess, obstacles=self._obstacles)
        except ValueError:
            return None
        return rest if rest.converged else None

    def solve(self, grips: Grips, rest: Rest) -> PartFit:
        """Improve the grips until nothing helps."""
        error = self._error(rest)
        self._damping = FIRST_DAMPING
        for _ in range(MAX_ITERATIONS if self._free else 0):
            improved = self._improved(grips, rest, error)
            if improved is None:
                break
            before, (grips, rest, error) = error, improved
            if error < CLOSE or error > (1.0 - LEAST_DECREASE) * before:
                break
        return PartFit(grips, rest.state, error)

    def _error(self, rest: Rest) -> float:
        return polylines.mean_node_distance(rest.state.positions[self._counted], self._points)

    def _improved(self, grips: Grips, rest: Rest, error: float) -> tuple[Grips, Rest, float] | None:
        """Grips after one step, the rod between them and its error; None where no step helps."""
        columns = []
        here = rest.state.positions[self._counted]
        for side, axis in self._free:
            size = DISPLACEMENT if axis < 3 else ROTATION
            near = self.at_rest(_displaced(grips, side, size * np.eye(6)[axis]), rest.state)
            if near is None:
                return None
            unit = size if axis < 3 else size * LEVER
            columns.append((near.state.positions[self._counted] - here).ravel() / unit)
        jacobian = np.stack(columns, axis=1)
        normal = jacobian.T @ jacobian
        gradient = jacobian.T @ (self._points - here).ravel()
        scale = np.trace(normal) / len(normal) * np.eye(len(normal))
        while self._damping <= MAX_DAMPING:
            damped = normal + self._damping * scale
            step = np.linalg.solve(damped, gradient)
            step *= min(1.0, MAX_STEP / float(np.max(np.abs(step))))
            after = grips
            for (side, axis), size in zip(self._free, step, strict=True):
                change = size if axis < 3 else size / LEVER
                after = _displaced(after, side, change * np.eye(6)[axis])
            new = self.at_rest(after, rest.state)
            if new is not None and (error_after := self._error(new)) < error:
                self._damping /= 5.0
                return after, new, error_after
            self._damping *= 5.0
        return None


def _first_grips(grips: Grips, moves: Bool[np.ndarray, "2 6"]) -> Iterator[Grips]:
    """Grips at which the fit begins: the given ones, then nearer to each other."""
    left, right = grips
    if not moves[:, :3].any():
        yield grips
        return
    for span in SPANS:
        gap = 0.5 * (1.0 - span) * (right.position - left.position)
        shift = [gap, -gap]
        for side in range(2):
            if not moves[side, :3].any():
                shift[1 - side] = shift[1 - side] - shift[side]
                shift[side] = np.zeros(3)
        yield (
            Pose(left.position + shift[0], left.orientation),
            Pose(right.position + shift[1], right.orientation),
        )


def _laid_on(
    grips: Grips,
    moves: Bool[np.ndarray, "2 6"],
    nodes: Float64[np.ndarray, "k 3"],
    points: Float64[np.ndarray, "k 3"],
) -> Grips:
    """Grips moved as one rigid body that brings nodes near to points, as far as they all move.

    Where both rotate, the body turns about the vertical, along which a rope at rest stays at rest.
    """
    if not moves[:, :3].all():
        return grips
    center, target = np.mean(nodes, axis=0), np.mean(points, axis=0)
    turn = np.array([1.0, 0.0, 0.0, 0.0])
    if moves[:, 3:].all():
        a, b = (nodes - center)[:, :2], (points - target)[:, :2]
        angle = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
        turn = poses.exponential(np.array([0.0, 0.0, angle]))
    left, right = (
        Pose(
            target + poses.rotate(turn, grip.position - center),
            poses.multiply(turn, grip.orientation),
        )
        for grip in grips
    )
    return left, right


def _on_tangents(
    grips: Grips,
    points: Float64[np.ndarray, "k 3"],
    counted: Bool[np.ndarray, "n"],
    length: float,
) -> Grips:
    """Grips on the tangents of the part's ends, turned to them by the least rotation."""
    edge = length / (len(counted) - 1)
    first, last = polylines.end_tangents(points)
    before, after = (edge * float(np.argmax(c)) for c in (counted, counted[::-1]))
    left, right = (
        poses.multiply(
            poses.rotation_between(poses.rotate(grip.orientation, ALONG), tangent),
            grip.orientation,
        )
        for tangent, grip in zip((first, last), grips, strict=True)
    )
    return (
        Pose(points[0] - SLACK * before * first, left),
        Pose(points[-1] + SLACK * after * last, right),
    )


def _displaced(grips: Grips, side: int, change: Float64[np.ndarray, "6"]) -> Grips:
    moved = list(grips)
    turned = poses.multiply(poses.exponential(change[3:]), grips[side].orientation)
    moved[side] = Pose(grips[side].position + change[:3], poses.normalized(turned))
    return moved[0], moved[1]
