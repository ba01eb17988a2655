"""Parameters of the paper's rod by gradient descent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.paper.adaptation import PaperAdaptation
from lariat.paper.xpbd import XpbdProperties, XpbdRod
from lariat.rod import RolloutSpec
from lariat.scenario.sections import PaperControl
from tests.services.controller.cell import grips

TRUE = XpbdProperties(0.45, 0.008)
DT = 0.01


def test_wrong_stiffness_and_predictions_improve() -> None:
    plant = XpbdRod(TRUE, 20)
    believed = replace(TRUE, bending_compliance=2.0 * TRUE.bending_compliance)
    model = XpbdRod(believed, 20)
    adaptation = PaperAdaptation(model, PaperControl())
    state = plant.rest(*grips((-0.19, 0.0, 0.3), (0.19, 0.0, 0.3))).state
    known = replace(state)
    everywhere = np.ones(20, dtype=bool)
    errors = []
    for k in range(40):
        actions = np.zeros((5, 2, 6))
        actions[:, 1, :3] = [0.2 * np.cos(0.4 * k), 0.3 * np.sin(0.3 * k), 0.1 * np.sin(0.5 * k)]
        now = model.with_properties(adaptation.properties)
        expected = now.rollout(RolloutSpec(known, actions, DT)).final
        before, state = state, plant.rollout(RolloutSpec(state, actions, DT)).final
        misses = np.linalg.norm(expected.positions - state.positions, axis=1)
        errors.append(float(np.mean(misses)))
        adaptation.adapt(known, actions, DT, state.positions, everywhere)
        moved = (state.positions - before.positions) / (5 * DT)
        known = replace(expected, positions=state.positions, velocities=moved)
    true = XpbdRod(TRUE, 20).properties.material(20).bending_stiffness
    assert abs(np.log(adaptation.bending_stiffness / true)) < 0.5 * np.log(2.0)
    assert np.mean(errors[-10:]) < 0.6 * np.mean(errors[:5])


def test_unobserved_nodes_change_no_parameter() -> None:
    rod = XpbdRod(TRUE, 20)
    adaptation = PaperAdaptation(rod, PaperControl(optimizer_steps=3))
    state = rod.rest(*grips((-0.19, 0.0, 0.3), (0.19, 0.0, 0.3))).state
    seen = state.positions + 0.1
    change = adaptation.adapt(state, np.zeros((5, 2, 6)), DT, seen, np.zeros(20, dtype=bool))
    assert adaptation.properties == TRUE
    assert not change.any()
