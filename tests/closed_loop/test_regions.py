"""A rope is kept inside of its region on the way: by planner, controller and gateway."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.control.mpc.collision_scene import CollisionScene
from lariat.control.supervision.clearance_guard import ClearanceGuard
from lariat.geometry.obstacles import chain_clearance
from lariat.planning import preflight
from lariat.rod import Rod
from lariat.scenario.rod_properties import rod_properties
from lariat.scenario.settings import load_with
from shared import topics
from shared.messages import chain
from stack.simulation import closed_loop
from stack.simulation.simulated_time import Delivery
from tests.closed_loop.loop import SCENARIOS

BEAM = 'obstacles=[{name="beam", shape="box", position=[0, 0.01, 0.27], size=[0.9, 0.04, 0.06]}]'
TRAY = 'keep_in=[{name="tray", shape="box", position=[0, 0, 0.17], size=[1.2, 1.2, 0.34]}]'


def test_rope_passes_below_a_beam_where_its_region_ends_above() -> None:
    # The beam hides the rope from the camera.
    cell = load_with(SCENARIOS / "three-cylinders.toml", [BEAM, TRAY, 'sensing.source="truth"'])
    log: list[Delivery] = []
    score = closed_loop.run(cell, stop_after=0.2, taps=(log.append,)).score
    assert score.reached
    ropes = [chain(d.parse().positions) for d in log if d.key == topics.ROPE_TRUTH.key]
    radius = cell.plant_rope.diameter / 2.0
    inside = min(chain_clearance(nodes, radius, cell.regions) for nodes in ropes)
    assert inside > 0.01
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm <= 1e3 * inside + 1e-3
    assert score.contact_time_s == 0.0


def test_goal_outside_is_refused_before_anything_moves() -> None:
    low = TRAY.replace("0.34]", "0.20]")
    with pytest.raises(ConfigurationError, match=r"start.*'tray'.*34\.0 mm"):
        load_with(SCENARIOS / "three-cylinders.toml", [low])


def test_rope_that_hangs_out_between_its_grips_is_refused() -> None:
    high = 'keep_in=[{name="tray", shape="box", position=[0, 0, 0.4], size=[1.2, 1.2, 0.4]}]'
    cell = load_with(SCENARIOS / "three-cylinders.toml", [high])
    with pytest.raises(ConfigurationError, match=r"outside.*'tray'"):
        preflight.check(cell)


def test_guard_and_progress_know_the_regions() -> None:
    cell = load_with(SCENARIOS / "three-cylinders.toml", [BEAM, TRAY])
    left, right = cell.grips(cell.start)
    rod = Rod(rod_properties(cell.rope), cell.rope.node_count)
    nodes = rod.rest(left, right).state.positions
    up = np.array([0.0, 0.0, 0.01])
    rising = np.stack([nodes + k * up for k in range(1, 6)])
    scene = CollisionScene(cell)
    guard = ClearanceGuard(cell.rope.diameter / 2.0, cell.control.clearance)
    threat = guard.check(nodes, nodes, rising, 0.0, scene.avoided)
    assert threat is not None
    assert threat.obstacle == "tray"
    assert scene.foreseen == cell.bodies
    below = np.stack([nodes - 0.1 * k * up for k in range(1, 6)])
    assert guard.check(nodes, nodes, below, 0.0, scene.avoided) is None
