"""Equilibria of the continuum that the rod discretizes, as solutions of a boundary value problem.

A Cosserat rod with arc length s, position x, orientation q, internal force F and moment M in the
world frame, and the stiffnesses of the discrete rod (stretch and shear K, bending EI, twist GJ):

    x' = d3(q) + F / K        q' = q u / 2, with u = (EI, EI, GJ)^-1 R(q)^T M + rest curvature
    F' = -density * gravity   M' = -d3(q) x F

`scipy.integrate.solve_bvp` solves it by collocation of fourth order on an adaptive mesh. A rest
shape of the rod selects one of several equilibria and is the first guess; the solution does not
depend on it otherwise. Unknowns are dimensionless, in units of the length L and of EI / L^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float64
from scipy.integrate import solve_bvp
from scipy.interpolate import BSpline, make_interp_spline

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import EDGE_AXIS, Rod, RodState, forces, moments

RESIDUAL_TOLERANCE = 1e-9
"""Largest relative residual of the differential equations on an interval of the mesh, RMS [-]."""
START_INTERVALS = 400
"""Number of intervals of the first mesh."""
MAX_MESH_NODES = 40_000
"""Largest number of mesh nodes."""

_X, _Q, _M = slice(0, 3), slice(3, 7), slice(7, 10)
"""Rows of position, orientation and moment among the unknown functions."""


@dataclass(frozen=True)
class Equilibrium:
    """Equilibrium of the continuum."""

    length: float
    """Length of the rod [m]."""
    solution: Any
    """Piecewise cubic interpolant of the unknown functions over s / L."""

    def positions(self, count: int) -> Float64[np.ndarray, "k 3"]:
        """Return points at evenly spaced arc lengths of the unstretched rod, with both ends [m]."""
        return self.length * self.solution(np.linspace(0.0, 1.0, count))[_X].T


def equilibrium(rod: Rod, left: Pose, right: Pose, rest: RodState) -> Equilibrium:
    """Solve for the equilibrium of the continuum next to a rest shape of the rod."""
    if rod.left == "free":
        raise ValueError("the left end must be clamped or pinned, got free; mirror the rod")
    problem = _BoundaryValueProblem(rod, left, right, rest)
    solved = solve_bvp(
        problem.derivatives,
        problem.boundary_residuals,
        problem.mesh,
        problem.guess,
        p=problem.force_guess,
        tol=RESIDUAL_TOLERANCE,
        max_nodes=MAX_MESH_NODES,
    )
    if not solved.success:
        raise RuntimeError(f"boundary value problem of the rod: {solved.message}")
    return Equilibrium(rod.properties.length, solved.sol)


class _BoundaryValueProblem:
    """Equations, boundary conditions and first guess in the form of `solve_bvp`."""

    def __init__(self, rod: Rod, left: Pose, right: Pose, rest: RodState) -> None:
        p = rod.properties
        self.rod, self.left, self.right = rod, left, right
        self.unit_force = p.bending_stiffness / p.length**2
        self.compliance = self.unit_force / p.stretch_stiffness
        self.twist_ratio = p.twisting_stiffness / p.bending_stiffness
        self.mesh = np.linspace(0.0, 1.0, START_INTERVALS + 1)
        self._load = np.asarray(rod.model.gravity) * p.linear_density * p.length / self.unit_force
        self._mass = _profile(p.density_profile).antiderivative()
        self._stiffness = _profile(p.stiffness_profile)
        self._rest_curvature = _profile(p.rest_curvature)
        self._guess(rest)

    def derivatives(
        self,
        s: Float64[np.ndarray, "m"],
        y: Float64[np.ndarray, "10 m"],
        force_at_left: Float64[np.ndarray, "3"],
    ) -> Float64[np.ndarray, "10 m"]:
        """Return the derivatives of the unknown functions with respect to s / L."""
        q = y[_Q].T
        d3 = poses.rotate(q, EDGE_AXIS)
        force = force_at_left - self._weight(s)
        local = poses.rotate(poses.conjugate(q), y[_M].T)
        u = local / (self._stiffness(s)[:, None] * np.array([1.0, 1.0, self.twist_ratio]))
        u += self.rod.properties.length * self._rest_curvature(s)
        spin = np.concatenate([np.zeros((len(s), 1)), u], axis=1)
        return np.concatenate(
            [
                (d3 + self.compliance * force).T,
                0.5 * poses.multiply(q, spin).T,
                np.cross(force, d3).T,
            ]
        )

    def boundary_residuals(
        self,
        first: Float64[np.ndarray, "10"],
        last: Float64[np.ndarray, "10"],
        force_at_left: Float64[np.ndarray, "3"],
    ) -> Float64[np.ndarray, "13"]:
        """Return what the boundary conditions require to be zero."""
        length = self.rod.properties.length
        residuals = [first[_X] - self.left.position / length]
        if self.rod.left == "clamped":
            residuals.append(first[_Q] - self._first_orientation)
        else:
            # A pinned rod may spin about its axis: its turn relative to the guess is set to zero.
            turned = poses.multiply(poses.conjugate(self._first_orientation), first[_Q])
            moment = poses.rotate(poses.conjugate(first[_Q]), first[_M])
            residuals += [moment[:2], turned[3:], [first[_Q] @ first[_Q] - 1.0]]
        if self.rod.right == "free":
            residuals += [force_at_left - self._weight(np.ones(1))[0], last[_M]]
        else:
            residuals.append(last[_X] - self.right.position / length)
            if self.rod.right == "clamped":
                turned = poses.multiply(poses.conjugate(self.right.orientation), last[_Q])
                residuals.append(turned[1:])
            else:
                residuals.append(last[_M])
        return np.concatenate(residuals)

    def _guess(self, rest: RodState) -> None:
        """Set the guess of the unknown functions on the mesh, and of the force at the left end."""
        rod, p = self.rod, self.rod.properties
        nodes = np.linspace(0.0, 1.0, rod.node_count)
        middles = 0.5 * (nodes[1:] + nodes[:-1])
        frames = _edge_frames(rod, rest)
        # Neighbouring quaternions get the same sign, so that they can be interpolated.
        signs = np.cumprod(np.sign(np.sum(frames[1:] * frames[:-1], axis=1)))
        frames[1:] *= signs[:, None]
        q = poses.normalized(_interpolate(self.mesh, middles, frames))
        if rod.left == "clamped":
            sign = np.sign(frames[0] @ self.left.orientation)
            self._first_orientation = sign * self.left.orientation
        else:
            self._first_orientation = frames[0]
        local = moments(rod, rest)
        moment = poses.rotate(q, _interpolate(self.mesh, rod.model.bend_places, local))
        moment *= p.length / p.bending_stiffness
        x = _interpolate(self.mesh, nodes, rest.positions) / p.length
        self.guess = np.concatenate([x, q, moment], axis=1).T
        force = forces(rod, rest)[0] / self.unit_force
        self.force_guess = force + self._weight(middles[:1])[0]

    def _weight(self, s: Float64[np.ndarray, "m"]) -> Float64[np.ndarray, "m 3"]:
        """Return the weight of the rod between its left end and s."""
        return self._mass(s)[:, None] * self._load


def _edge_frames(rod: Rod, state: RodState) -> Float64[np.ndarray, "n-1 4"]:
    """Return the orientations of the edges, without those of grips."""
    left, right = rod.model.clamps
    return state.orientations[left : len(state.orientations) - right].copy()


def _profile(values: Sequence[float] | Sequence[Sequence[float]]) -> BSpline:
    """Return the piecewise linear function of s / L through evenly spaced values."""
    knots = np.asarray(values, float)
    if len(knots) == 1:
        knots = np.repeat(knots, 2, axis=0)
    return make_interp_spline(np.linspace(0.0, 1.0, len(knots)), knots, k=1)


def _interpolate(
    at: Float64[np.ndarray, "m"], places: Float64[np.ndarray, "k"], rows: Float64[np.ndarray, "k c"]
) -> Float64[np.ndarray, "m c"]:
    return np.stack([np.interp(at, places, column) for column in rows.T], axis=1)
