from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry.cable_routes import held_clips
from lariat.geometry.obstacles import pack_supports
from lariat.rod import Rod, cable_laying
from lariat.rod.cable_laying import laid, laying
from lariat.rod.strains import forces, tensions
from lariat.scenario import Scenario
from lariat.scenario.rod_properties import rod_properties
from lariat.scenario.settings import load_with


def moved(*clips: tuple[float, float, float]) -> tuple[str, ...]:
    """Settings that place the clips: x and y [m], and heading [deg]."""
    return tuple(
        setting
        for k, (x, y, heading) in enumerate(clips)
        for setting in (f"clips.{k}.position=[{x}, {y}, 0.0]", f"clips.{k}.heading={heading}")
    )


MOVED = moved((-0.182, -0.022, 22.4), (-0.013, -0.027, -4.7), (0.195, 0.013, 3.8))
"""Clips moved by up to 27 mm and turned by up to 18 degrees."""
STICKY = moved((-0.222, -0.04, 25.9), (-0.028, -0.021, 17.1), (0.174, 0.018, 39.7))
"""The same, where the way to lay the cable that is tried first fails at twice the friction."""


def board(*settings: str) -> Scenario:
    return load_with("harness-board", settings)


@pytest.mark.parametrize("bending_radius", [0.05, 1.0])
def test_a_rod_is_laid_into_all_clips(bending_radius: float):
    scenario = board(f"rope.bending_radius={bending_radius}")
    rod, bodies = Rod(rod_properties(scenario.rope), scenario.rope.node_count), scenario.bodies
    stops, grips = scenario.route_stops(scenario.goal), scenario.grips(scenario.goal)
    hanging, waypoints = laying(rod, stops, grips, (True, True), bodies)
    assert held_clips(scenario.goal.route, bodies, hanging.positions) == []
    end = laid(rod, hanging, waypoints, pack_supports(bodies)).final
    assert held_clips(scenario.goal.route, bodies, end.positions) == ["low", "middle", "high"]
    np.testing.assert_allclose(end.positions[[0, -1]], [g.position for g in grips], atol=1e-6)
    # It lies on the board between the outer clips.
    between = np.abs(end.positions[:, 0]) < 0.2
    np.testing.assert_allclose(end.positions[between, 2], 0.0035, atol=2e-4)
    assert np.max(tensions(end.positions, rod.properties)) < 0.5


@pytest.mark.parametrize("clips", [MOVED, STICKY])
def test_a_rod_is_laid_on_a_moved_board_whatever_its_friction_and_yield(clips: tuple[str, ...]):
    scenario = board(*clips)
    rod, bodies = Rod(rod_properties(scenario.rope), scenario.rope.node_count), scenario.bodies
    stops, grips = scenario.route_stops(scenario.goal), scenario.grips(scenario.goal)
    hanging, waypoints = laying(rod, stops, grips, (True, True), bodies)
    for friction, radius in ((1.0, 1.0), (2.0, 1.5), (0.5, 1.5), (2.0, 0.67), (0.5, 0.67)):
        rope = replace(scenario.rope, bending_radius=0.05 * radius)
        rough = pack_supports([replace(b, friction=friction * b.friction) for b in bodies])
        end = laid(Rod(rod_properties(rope), rod.node_count), hanging, waypoints, rough).final
        assert held_clips(scenario.goal.route, bodies, end.positions) == ["low", "middle", "high"]


def test_ends_aim_beside_clips_that_a_bending_rod_would_miss(monkeypatch: pytest.MonkeyPatch):
    scenario = board(*MOVED)
    rod = Rod(rod_properties(scenario.rope), scenario.rope.node_count)
    stops, grips = scenario.route_stops(scenario.goal), scenario.grips(scenario.goal)
    monkeypatch.setattr(cable_laying, "TRIED_SETTINGS", cable_laying.TRIED_SETTINGS[:1])
    legs = {leg.name for clip in scenario.clips if clip.name != "middle" for leg in clip.bodies}
    without_legs = pack_supports([b for b in scenario.bodies if b.name not in legs])
    clip, misses = stops[0].clip, []
    assert clip is not None
    for count in (0, 8):
        monkeypatch.setattr(cable_laying, "MAX_CORRECTIONS", count)
        start = laying(rod, stops, grips, (True, True), scenario.bodies)
        for nodes in laid(rod, *start, without_legs).positions:
            left, up = min(clip.crossings(nodes), key=lambda at: abs(at[0]), default=(0.0, np.inf))
            if up < clip.height:
                misses.append(abs(left))
                break
    assert misses[0] > 0.004 > 0.001 > misses[1]


def test_tension_of_nodes_is_the_force_along_a_hanging_rod():
    scenario = board()
    rod = Rod(rod_properties(scenario.rope), 40)
    state = rod.rest(*scenario.grips(scenario.start)).state
    edges = np.diff(state.positions, axis=0)
    along = np.sum(forces(rod, state) * edges, axis=1) / np.linalg.norm(edges, axis=1)
    np.testing.assert_allclose(tensions(state.positions, rod.properties), along, atol=2e-3)
    # Half of its weight hangs from each end; the ends are nearly level.
    weight = 9.81 * rod.properties.linear_density * rod.properties.length
    assert 0.3 * weight < np.max(along) < weight
