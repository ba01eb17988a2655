"""Twisted rods that leave their line: a localized helix, and a loop that twists round itself.

The localized helix has a closed form: van der Heijden & Thompson, "Helical and localised buckling
in twisted rods" (2000), in the numbers of Bergou et al., "Discrete elastic rods" (2008).

The loop forms as the ends of a twisted rod are brought together. Until it snaps, the work of the
grips is the change of the rod's energy. Then strands touch, and twist and writhe add up to the
turns that the grips hold as long as no strand passes through another (Calugareanu).
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
from jaxtyping import Float64

from benchmarks.physics.convergence import Case, Error
from benchmarks.physics.energy import clamp_load, elastic
from lariat.geometry import poses
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec, add_turns
from lariat.rod.strains import moments

HELIX = RodProperties(9.29, 0.2, 1.0, 1e6, stretch_stiffness=1e6).with_stiffness(1.345, 0.789)
"""Rod of the localized helix."""
HELIX_TURNS, HELIX_SLACK = 27.0, 0.3
"""Turns of twist [-], and distance by which the ends are brought together [m]."""
LOOP = RodProperties(0.45, 0.006, 0.044, 1e6, damping=5.0).with_stiffness(2e-4)
"""Rod that forms a loop."""
LOOP_NODES = 120
"""Number of nodes of that rod."""
LOOP_TURNS = 3.0
"""Turns that the grips hold [-]."""
SMOOTH_SLACK, FULL_SLACK = 0.12, 0.28
"""Distances by which the ends are brought together, before the rod snaps and in all [m]."""
SMOOTH_STEPS = 120
"""Equilibria between which the work of the grips is summed up."""
EQUILIBRIUM_DURATIONS = (1.0, 1.0, 10.0, 100.0)
"""Durations of the steps to the next equilibrium; the grip moves in the first [s]."""
CLOSING_SPEED = 0.04
"""Speed of the grip while the loop snaps and closes [m/s]."""
TIME_STEP = 0.005
"""Time step of that motion [s]."""
WEIGHTLESS = (0.0, 0.0, 0.0)
"""Absence of gravity [m/s^2]."""
RAY_LENGTH = 1e4
"""Length of the straight lines that continue a rod beyond its grips, in lengths of the rod [-]."""


def helix_error(node_count: int) -> Error:
    """Return the RMS distance of a localized helix from its envelope tanh^2 [-]."""
    places, envelope = helix_envelope(node_count)
    return Error(float(np.sqrt(np.mean((envelope - np.tanh(places) ** 2) ** 2))))


@cache
def helix_envelope(
    node_count: int,
) -> tuple[Float64[np.ndarray, "n-1"], Float64[np.ndarray, "n-1"]]:
    """Return arc lengths from the helix's middle in units of its width, and its envelope there."""
    rod = Rod(HELIX, node_count, gravity=WEIGHTLESS, tolerance=1e-8)
    s = np.linspace(-0.5, 0.5, node_count)
    bump = 0.02 * HELIX.length * np.exp(-((s / 0.08) ** 2))
    ripple = np.stack([0.0 * s, bump * np.cos(60.0 * s), bump * np.sin(60.0 * s)], axis=1)
    straight = rod.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    start = add_turns(replace(straight, positions=straight.positions + ripple), HELIX_TURNS)
    durations = np.concatenate([np.full(60, 0.1), 0.1 * 1.6 ** np.arange(40)])
    actions = np.zeros((len(durations), 2, 6))
    actions[:60, 1, 0] = -HELIX_SLACK / 6.0
    rollout, _ = rod.settle(start, actions, durations)
    cosine = poses.normalized(np.diff(rollout.positions[-1], axis=0))[:, 0]
    least = _least(cosine)
    envelope = (cosine - least) / (1.0 - least)
    moment = float(np.mean(moments(rod, rollout.final)[:, 2]))
    width = 2.0 * HELIX.bending_stiffness / moment * math.sqrt((1.0 + least) / (1.0 - least))
    middles = rod.edge_length * (np.arange(node_count - 1) + 0.5)
    centre = np.sum(middles * (1.0 - envelope)) / np.sum(1.0 - envelope)
    return (middles - centre) / width, envelope


def energy_error(node_count: int) -> Error:
    """Return the difference of work and energy until the loop snaps, relative to the work [%]."""
    energies, works, _ = smooth_closing(node_count)
    return Error(float(100.0 * np.max(np.abs(energies - energies[0] - works)) / -works[-1]))


@cache
def smooth_closing(
    node_count: int,
) -> tuple[Float64[np.ndarray, "k"], Float64[np.ndarray, "k"], RodState]:
    """Return energies [J], the work of the grips so far [J], and the last state.

    The states are equilibria of a twisted rod whose ends are brought together slowly.
    """
    rod = Rod(LOOP, node_count, gravity=WEIGHTLESS, tolerance=1e-9)
    straight = rod.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    s = np.linspace(-0.5, 0.5, node_count)
    bump = 1e-3 * LOOP.length * np.cos(np.pi * s) ** 2
    ripple = np.stack([0.0 * s, bump * np.cos(20.0 * s), bump * np.sin(20.0 * s)], axis=1)
    state = add_turns(replace(straight, positions=straight.positions + ripple), LOOP_TURNS)
    durations = np.array(EQUILIBRIUM_DURATIONS)
    still = np.zeros((len(durations), 2, 6))
    moving = still.copy()
    step = -SMOOTH_SLACK / SMOOTH_STEPS
    moving[0, 1, 0] = step / durations[0]
    energies, pulls = [], []
    for k in range(SMOOTH_STEPS + 1):
        rollout, _ = rod.settle(state, moving if k else still, durations)
        state = rollout.final
        energies.append(elastic(rod, state))
        pulls.append(clamp_load(rod, state, 1)[0])
    works = np.concatenate([[0.0], np.cumsum(0.5 * step * np.add(pulls[1:], pulls[:-1]))])
    return np.array(energies), works, state


def linking_error(node_count: int) -> Error:
    """Return the largest difference of twist plus writhe from the turns of the grips [turns]."""
    states = closing_states(node_count)
    return Error(max(abs(twist(s) + writhe(s.positions) - LOOP_TURNS) for s in states))


@cache
def closing_states(node_count: int) -> tuple[RodState, ...]:
    """Return states of the rod from before it snaps until its loop is closed."""
    rod = Rod(LOOP, node_count, gravity=WEIGHTLESS, self_contact=True)
    _, _, state = smooth_closing(node_count)
    blocks = 16
    duration = (FULL_SLACK - SMOOTH_SLACK) / CLOSING_SPEED / blocks
    steps = round(duration / TIME_STEP)
    actions = np.zeros((1, 2, 6))
    actions[0, 1, 0] = -CLOSING_SPEED
    states = [state]
    for _ in range(blocks):
        spec = RolloutSpec(states[-1], actions, TIME_STEP, steps=steps)
        states.append(rod.rollout(spec).final)
    return tuple(states)


def twist(state: RodState) -> float:
    """Return the twist of a rod's frames [turns]."""
    steps = poses.multiply(poses.conjugate(state.orientations[:-1]), state.orientations[1:])
    # Swing-twist decomposition: the rotation about the axis is by twice this angle.
    angles = 2.0 * np.arctan2(steps[:, 3], steps[:, 0])
    return float(np.sum(np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi) / (2.0 * np.pi))


def writhe(nodes: Float64[np.ndarray, "n 3"]) -> float:
    """Return the writhe of a chain along x that continues straight beyond its ends [turns].

    Gauss's double integral over pairs of edges in closed form: Klenin & Langowski, "Computation of
    writhe in modeling of supercoiled DNA", Biopolymers 54 (2000), method 1a.
    """
    ray = RAY_LENGTH * np.array([np.sum(np.linalg.norm(np.diff(nodes, axis=0), axis=1)), 0.0, 0.0])
    nodes = np.concatenate([nodes[:1] - ray, nodes, nodes[-1:] + ray])
    i, j = np.triu_indices(len(nodes) - 1, 2)
    r13, r14 = nodes[j] - nodes[i], nodes[j + 1] - nodes[i]
    r23, r24 = nodes[j] - nodes[i + 1], nodes[j + 1] - nodes[i + 1]
    normals = [np.cross(a, b) for a, b in ((r13, r14), (r14, r24), (r24, r23), (r23, r13))]
    lengths = [np.linalg.norm(n, axis=1, keepdims=True) for n in normals]
    units = [n / np.where(k > 0.0, k, 1.0) for n, k in zip(normals, lengths, strict=True)]
    sines = [np.sum(a * b, axis=1) for a, b in zip(units, units[1:] + units[:1], strict=True)]
    solid_angles = np.sum(np.arcsin(np.clip(sines, -1.0, 1.0)), axis=0)
    signs = np.sign(
        np.sum(np.cross(nodes[j + 1] - nodes[j], nodes[i + 1] - nodes[i]) * r13, axis=1)
    )
    return float(np.sum(solid_angles * signs) / (2.0 * np.pi))


def _least(values: Float64[np.ndarray, "m"]) -> float:
    """Return the least value of the parabola through the least sample and its neighbours."""
    k = int(np.clip(np.argmin(values), 1, len(values) - 2))
    before, at, after = values[k - 1 : k + 2]
    bend = before - 2.0 * at + after
    return float(at - (after - before) ** 2 / (8.0 * bend)) if bend > 0.0 else float(at)


CASES: tuple[Case, ...] = (
    Case("localized helix, RMS to tanh^2", "-", helix_error, (80, 180), {80: 0.03, 180: 0.015}),
    Case("loop, work and energy", "%", energy_error, (LOOP_NODES,), {LOOP_NODES: 0.1}),
    Case("loop, twist + writhe", "turns", linking_error, (LOOP_NODES,), {LOOP_NODES: 0.01}),
)
"""Cases of the table."""
