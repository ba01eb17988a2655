"""Time integration schemes have their order, agree, and never gain energy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.rod import Rod, RodProperties, RolloutSpec
from lariat.rod.integration_schemes import Scheme
from lariat.rod.strains import curvatures, forces, moments

PROPERTIES = RodProperties(0.4, 0.008, 0.05, 1e6, internal_damping=0.01)


def swung(scheme: Scheme, substeps: int) -> np.ndarray:
    """Return the nodes of a level rod 0.2 s after its release from one pin."""
    rod = Rod(PROPERTIES, 12, "pinned", "free", tolerance=1e-11, scheme=scheme)
    start = rod.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    return rod.rollout(RolloutSpec(start, np.zeros((10, 2, 6)), 0.02, substeps=substeps)).positions[
        -1
    ]


@pytest.mark.parametrize(("scheme", "order"), [("euler", 1), ("sdirk2", 2)])
def test_a_scheme_converges_with_its_order(scheme: Scheme, order: int) -> None:
    coarse, fine, finer = (swung(scheme, count) for count in (16, 32, 64))
    ratio = np.linalg.norm(coarse - fine) / np.linalg.norm(fine - finer)
    # The stiff modes still fall faster than that.
    assert order - 0.3 < np.log2(ratio) < order + 0.6


def test_both_schemes_converge_to_the_same_motion() -> None:
    # The first order is off by 2 mm itself at this step.
    assert np.linalg.norm(swung("euler", 400) - swung("sdirk2", 20), axis=1).max() < 2e-3


def test_internal_damping_takes_energy_from_bending_and_none_from_a_fall() -> None:
    properties = replace(PROPERTIES, damping=0.0, internal_damping=0.05)
    weightless = Rod(properties, 12, "free", "free", gravity=(0.0, 0.0, 0.0))
    start = weightless.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
    drifting = replace(start, velocities=np.tile([0.0, 0.3, 0.2], (12, 1)))
    final = weightless.rollout(RolloutSpec(drifting, np.zeros((10, 2, 6)), 0.01)).final
    assert np.allclose(final.velocities, [0.0, 0.3, 0.2], atol=1e-6)

    def remaining_speed(damping: float) -> float:
        """Return the speed of a weightless cantilever half a second after it was struck."""
        made = replace(properties, youngs_modulus=1e8, internal_damping=damping)
        rod = Rod(made, 12, right="free", gravity=(0.0, 0.0, 0.0), scheme="sdirk2")
        struck = np.zeros((12, 3))
        struck[:, 2] = np.linspace(0.0, 1.0, 12) ** 2
        still = rod.straight([0.0, 0.0, 0.0], [1.0, 0.0, 0.0])
        moved = rod.rollout(
            RolloutSpec(replace(still, velocities=struck), np.zeros((50, 2, 6)), 0.01)
        )
        return float(np.linalg.norm(moved.final.velocities))

    assert remaining_speed(0.05) < 0.2 * remaining_speed(0.0)


def test_sdirk2_never_gains_energy_while_the_grips_rest() -> None:
    properties = replace(PROPERTIES, damping=0.0, internal_damping=0.0)
    rod = Rod(properties, 20, scheme="sdirk2")
    actions = np.zeros((10, 2, 6))
    actions[:, 1, :3] = [-1.0, 0.5, 0.3]
    moving = rod.rollout(
        RolloutSpec(rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3]), actions, 0.01)
    ).final
    mass = properties.linear_density * rod.edge_length
    energies = []
    for _ in range(60):
        lengths = rod.model.bend_lengths[:, None]
        bending = np.sum(moments(rod, moving) * curvatures(rod, moving) * lengths) / 2.0
        stretch = np.sum(forces(rod, moving) ** 2) * rod.edge_length / 2.0 / 2000.0
        kinetic = 0.5 * mass * np.sum(moving.velocities[1:-1] ** 2)
        fall = 9.81 * mass * np.sum(moving.positions[1:-1, 2])
        energies.append(bending + stretch + kinetic + fall)
        moving = rod.rollout(RolloutSpec(moving, np.zeros((1, 2, 6)), 0.01)).final
    # Two orders above the first sample's share of the grips' velocity would show at once.
    assert max(energies[1:]) <= energies[1] + 1e-3 * (energies[1] - energies[-1])
