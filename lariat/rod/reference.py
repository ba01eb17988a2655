"""Implicit step of the rod in plain NumPy: a readable form of the kernel, and its test reference.

One step of implicit Euler of duration h goes from positions x1 and orientations q1 to the minimizer
of the energy

    (I)  sum over nodes  m wt |x - y|^2 / 2             y = x1 + carry h v
         sum over edges  wt J |2 Im(conj(q^) q)|^2 / 2  q^ = q1 exp(carry h w)
    (W)  sum over nodes  -m g x
    (S)  sum over edges  l K |e / l - d3|^2 / 2         e = x_i+1 - x_i,  d3 = R(q_i) z
    (B)  sum over bends  k |u - rest|^2 / 2             u = log(conj(q_i) q_i+1)
    (D)  sum over bends  tau / h k |u - u1|^2 / 2       u1 = u of the step before
    (A)  sum over both ends of all edges  h C rho d l / 12 |a - (a t) t|^3

with velocities v, angular velocities w in the frames of the edges, k = (EI, EI, GJ) / l, damping c
in wt = (1 + c h) / h^2 and carry = 1 / (1 + c h), and internal damping tau. (A) is the drag of air
of density rho, with the drag coefficient C, the diameter d, the velocity a = (x - x1) / h of a node
and the axis t of the edge before the step. Contact is left out.
The bends at a clamp act over the lengths `RodModel.bend_lengths`. Unknowns are x, and
rotations phi of the edges in their own frames, q exp(phi): blocks of three, in the order node 0,
edge 0, node 1, edge 1, ...

`lariat.rod.kernels` computes the same with a banded Hessian, with contact, and with derivatives.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses
from lariat.rod.model import ImplicitRodModel
from lariat.rod.state import RodState

Z = np.array([0.0, 0.0, 1.0])
"""Axis of an edge's frame that lies along the edge."""
IDENTITY = np.eye(3)
"""Identity matrix."""
Term = tuple[float, Float64[np.ndarray, "k"], Float64[np.ndarray, "k k"]]
"""Energy [J], gradient and Hessian for k unknowns."""

GripFrames = tuple[Float64[np.ndarray, "l 4"], Float64[np.ndarray, "r 4"]]
"""Frames of the clamps at the left and at the right end; none at other ends."""

MAX_ITERATIONS = 100
"""Largest number of Newton iterations of a step."""
STEP_TOLERANCE = 1e-12
"""Largest entry of the last Newton step [m, rad]."""


def implicit_step(
    model: ImplicitRodModel, state: RodState, action: Float64[np.ndarray, "2 6"], dt: float
) -> RodState:
    """Return the state after one step of implicit Euler, by mixed Newton iterations.

    Args:
        model: Rod; its scheme and its tolerance are not used.
        state: State before the step.
        action: Grip velocities in the world frame: linear [m/s], then angular [rad/s].
        dt: Duration h [s].

    Raises:
        RuntimeError: The iterations do not converge.
    """
    x, q = state.positions.copy(), _edges(model, state.orientations)
    grips = _grip_frames(model, state, action, dt)
    edges = np.diff(x, axis=0) / model.edge_length
    tensions = model.properties.stretch_stiffness * (edges - poses.rotate(q, Z))
    for _ in range(MAX_ITERATIONS):
        _, g, H = energy(model, state, dt, x, q, grips, tensions)
        s, driven = _grip_step(model, state, action, dt, x)
        free = ~driven
        H_ff, H_fd = H[np.ix_(free, free)], H[np.ix_(free, driven)]
        # Away from a minimum the Hessian may have negative eigenvalues, along which Newton climbs.
        lowest = np.linalg.eigvalsh(H_ff)[0]
        H_ff += max(0.0, -2.0 * lowest) * np.eye(len(H_ff))
        s[free] = np.linalg.solve(H_ff, -g[free] - H_fd @ s[driven])
        dx, phi = s.reshape(-1, 3)[::2], s.reshape(-1, 3)[1::2]
        # Stretch is far stiffer than all else. Its force is a variable of its own, which follows
        # the linear solve: with the force of the iterate, Newton's method would crawl.
        edges = np.diff(x + dx, axis=0) / model.edge_length
        d3 = poses.rotate(q, Z + np.cross(phi, Z))
        tensions = model.properties.stretch_stiffness * (edges - d3)
        x, q = x + dx, poses.normalized(poses.multiply(q, poses.exponential(phi)))
        if np.max(np.abs(s)) < STEP_TOLERANCE:
            frames = np.vstack([grips[0], q, grips[1]])
            turned = poses.multiply(frames, poses.conjugate(state.orientations))
            return RodState(x, frames, (x - state.positions) / dt, poses.logarithm(turned) / dt)
    raise RuntimeError(f"no convergence in {MAX_ITERATIONS} iterations")


def energy(
    model: ImplicitRodModel,
    before: RodState,
    dt: float,
    x: Float64[np.ndarray, "n 3"],
    q: Float64[np.ndarray, "n-1 4"],
    grips: GripFrames,
    tensions: Float64[np.ndarray, "n-1 3"],
) -> Term:
    """Return the energy of a step [J], its gradient and its Hessian.

    Args:
        model: Rod.
        before: State before the step.
        dt: Duration h [s].
        x: Positions of the iterate [m].
        q: Orientations of the edges of the iterate.
        grips: Frames of the clamps after the step.
        tensions: Forces of the edges in the geometric part of the Hessian [N], world frame; with
            K (e / l - d3) it is the Hessian of the energy.
    """
    p, n, length = model.properties, model.node_count, model.edge_length
    weight, carry = (1.0 + p.damping * dt) / dt**2, 1.0 / (1.0 + p.damping * dt)
    total, g, H = 0.0, np.zeros(6 * n - 3), np.zeros((6 * n - 3, 6 * n - 3))

    def add(block: int, term: Term) -> None:
        nonlocal total
        places = slice(3 * block, 3 * block + len(term[1]))
        total += term[0]
        g[places] += term[1]
        H[places, places] += term[2]

    masses = p.linear_density * length * p.density_at(n)
    masses[[0, -1]] *= 0.5
    targets = before.positions + carry * dt * before.velocities
    for i in range(n):
        away, gravity = x[i] - targets[i], np.asarray(model.gravity)
        value = masses[i] * (0.5 * weight * away @ away - gravity @ x[i])
        add(2 * i, (value, masses[i] * (weight * away - gravity), masses[i] * weight * IDENTITY))

    edges = _edges(model, before.orientations)
    spin = poses.rotate(poses.conjugate(edges), _edges(model, before.angular_velocities))
    targets = poses.multiply(edges, poses.exponential(carry * dt * spin))
    inertia = p.linear_density * length * p.diameter**2 / 16.0 * np.array([1.0, 1.0, 2.0])
    for i in range(n - 1):
        add(2 * i + 1, rotational_inertia(weight * inertia, targets[i], q[i]))
        stretched = (x[i + 1] - x[i]) / length
        add(2 * i, stretch(p.stretch_stiffness, length, stretched, q[i], tensions[i]))
        axis = poses.rotate(edges[i], Z)
        drag = 0.25 * p.drag_coefficient * p.air_density * p.diameter * length
        for node in (i, i + 1):
            velocity = (x[node] - before.positions[node]) / dt
            add(2 * node, air_drag(drag, velocity, axis, dt))

    stiffness = np.array([p.bending_stiffness, p.bending_stiffness, p.twisting_stiffness])
    stiffnesses = np.outer(p.profile_at(model.bend_places) / model.bend_lengths, stiffness)
    rest = p.rest_curvature_at(model.bend_places) * model.bend_lengths[:, None]
    frames, left = np.vstack([grips[0], q, grips[1]]), len(grips[0])
    for i, (q0, q1) in enumerate(pairwise(frames)):
        u1 = poses.logarithm(
            poses.multiply(poses.conjugate(before.orientations[i]), before.orientations[i + 1])
        )
        for k, u in (
            (stiffnesses[i], rest[i]),
            (p.internal_damping / dt * stiffnesses[i], u1),
        ):
            value, gradient, hessian = bend(k, u, q0, q1)
            # Of the bend at a clamp, the rotation of the edge alone is unknown.
            inner = slice(6, 9) if i < left else slice(0, 3) if i - left == n - 2 else slice(0, 9)
            block = 2 * (i - left) + (3 if i < left else 1)
            add(block, (value, gradient[inner], hessian[inner, inner]))
    return total, g, H


def rotational_inertia(
    inertia: Float64[np.ndarray, "3"], target: Float64[np.ndarray, "4"], q: Float64[np.ndarray, "4"]
) -> Term:
    """Return (I) of an edge, with d Im(u) / d phi = W / 2 for u = conj(target) q.

    Args:
        inertia: wt J about the axes of the edge [kg m^2/s^2].
        target: Orientation q^ to which inertia alone would lead.
        q: Orientation.
    """
    u = poses.multiply(poses.conjugate(target), q)
    re, im = u[0], u[1:]
    W = re * IDENTITY + _cross(im)
    moment = 2.0 * inertia * im
    H = W.T @ np.diag(inertia) @ W - 0.5 * moment @ im * IDENTITY
    return float(moment @ im), W.T @ moment, H


def air_drag(
    drag: float, velocity: Float64[np.ndarray, "3"], axis: Float64[np.ndarray, "3"], dt: float
) -> Term:
    """Return (A) of one end of an edge, for the block of its node.

    Args:
        drag: Force per squared speed [kg/m].
        velocity: Velocity of the node [m/s].
        axis: Axis of the edge before the step.
        dt: Duration h [s].
    """
    across = IDENTITY - np.outer(axis, axis)
    u = across @ velocity
    speed = float(np.linalg.norm(u)) or np.finfo(float).tiny
    H = speed * across + np.outer(u, u) / speed
    return dt * drag * speed**3 / 3.0, drag * speed * u, drag / dt * H


def stretch(
    stiffness: float,
    length: float,
    stretched: Float64[np.ndarray, "3"],
    q: Float64[np.ndarray, "4"],
    tension: Float64[np.ndarray, "3"],
) -> Term:
    """Return (S) of an edge, for the blocks of its first node, its rotation and its last node.

    Args:
        stiffness: K [N].
        length: Rest length l [m].
        stretched: Edge vector over rest length, e / l.
        q: Orientation.
        tension: Force in the geometric part of the Hessian [N], world frame.
    """
    R = poses.matrix(q)
    strain = stretched - R @ Z
    # d3 turns by R (phi x z) + R (phi x (phi x z)) / 2.
    J = np.hstack([-IDENTITY / length, R @ _cross(Z), IDENTITY / length])
    H = length * stiffness * J.T @ J
    t = R.T @ tension
    H[3:6, 3:6] += length * (t @ Z * IDENTITY - 0.5 * (np.outer(t, Z) + np.outer(Z, t)))
    force = stiffness * strain
    return 0.5 * length * float(force @ strain), length * J.T @ force, H


def bend(
    stiffness: Float64[np.ndarray, "3"],
    rest: Float64[np.ndarray, "3"],
    q0: Float64[np.ndarray, "4"],
    q1: Float64[np.ndarray, "4"],
) -> Term:
    """Return (B) of a bend, for the blocks of its first edge, the node between and its last edge.

    A rotation of the first edge changes u by -J_l^-1(u) phi, one of the last edge by J_r^-1(u) phi,
    with J_l^-1(u) = I - [u]x / 2 + c [u]x^2 and J_r^-1 its transpose.

    Args:
        stiffness: k [N m].
        rest: Rotation vector at rest [rad].
        q0: Orientation of the first edge.
        q1: Orientation of the last edge.
    """
    u = poses.logarithm(poses.multiply(poses.conjugate(q0), q1))
    c, dc = _log_coefficients(float(np.linalg.norm(u)))
    U = _cross(u)
    left = IDENTITY - 0.5 * U + c * U @ U
    moment = stiffness * (u - rest)
    M, twist = _cross(moment), U @ moment
    # Derivatives of J_l^-T(u) moment and J_l^-1(u) moment with respect to u.
    common = dc * np.outer(U @ twist, u) - c * (_cross(twist) + U @ M)
    first = left.T * stiffness + common - 0.5 * M
    last = left * stiffness + common + 0.5 * M
    g, H = np.zeros(9), np.zeros((9, 9))
    g[:3], g[6:] = -left.T @ moment, left @ moment
    H[:3, :3], H[6:, 6:] = _symmetric(first @ left), _symmetric(last @ left.T)
    H[6:, :3] = -last @ left
    H[:3, 6:] = H[6:, :3].T
    return 0.5 * float(moment @ (u - rest)), g, H


def _grip_step(
    model: ImplicitRodModel,
    before: RodState,
    action: Float64[np.ndarray, "2 6"],
    dt: float,
    x: Float64[np.ndarray, "n 3"],
) -> tuple[Float64[np.ndarray, "u"], Bool[np.ndarray, "u"]]:
    """Return the change of the unknowns that the grips drive, and a mask of these unknowns."""
    n = model.node_count
    s, driven = np.zeros((2 * n - 1, 3)), np.zeros((2 * n - 1, 3), dtype=bool)
    for end, hold, node in ((0, model.left, 0), (1, model.right, n - 1)):
        if hold != "free":
            goal = before.positions[node] + dt * action[end, :3]
            s[2 * node], driven[2 * node] = goal - x[node], True
    return s.ravel(), driven.ravel()


def _grip_frames(
    model: ImplicitRodModel, before: RodState, action: Float64[np.ndarray, "2 6"], dt: float
) -> GripFrames:
    """Return the frames of the clamps after a step."""
    left, right = model.clamps
    turns = poses.exponential(dt * action[:, 3:])
    ends = poses.multiply(turns, before.orientations[[0, -1]])
    return ends[:left], ends[2 - right :]


def _edges(
    model: ImplicitRodModel, frames: Float64[np.ndarray, "m c"]
) -> Float64[np.ndarray, "n-1 c"]:
    """Return the rows of the edges, without those of the clamps."""
    left, right = model.clamps
    return frames[left : len(frames) - right].copy()


def _log_coefficients(t: float) -> tuple[float, float]:
    """Return c = (1 - (t / 2) cot(t / 2)) / t^2, and c' / t."""
    if t < 1e-2:
        return 1.0 / 12.0 + t**2 / 720.0 + t**4 / 30240.0, 1.0 / 360.0 + t**2 / 7560.0
    cot, sin = 1.0 / np.tan(0.5 * t), np.sin(0.5 * t)
    c = (1.0 - 0.5 * t * cot) / t**2
    return c, (-2.0 / t**3 + 0.5 * cot / t**2 + 0.25 / (t * sin**2)) / t


def _cross(v: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "3 3"]:
    """Return [v]x, so that [v]x a = v x a."""
    return np.cross(IDENTITY, v)


def _symmetric(m: Float64[np.ndarray, "3 3"]) -> Float64[np.ndarray, "3 3"]:
    return 0.5 * (m + m.T)
