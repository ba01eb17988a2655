"""Settings that save the present goal and obstacles with a scenario."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lariat.files.toml_text import parse_toml
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import SIDES, Goal, Scenario
from lariat.scenario.entries import inline, numbers, obstacle_entry

SAME = 1e-6
"""Largest difference of two equal coordinates [m], or components of a quaternion [-]."""


def goal_settings(goal: Goal, scenario: Scenario) -> list[str]:
    """Return the setting of a goal's grips, turns and part; none where they are the scenario's."""
    if any(len(g.position) != 3 or len(g.orientation) != 4 for g in goal.grips):
        return []
    same_part = goal.part == scenario.goal.part
    # The grips of the scenario's own part were found, and are found again.
    if same_part and scenario.goal.leaves_grips_open:
        return []
    ends = [scenario.end(side) for side in SIDES]
    # What an end cannot move is the start's in every goal.
    is_own = all(
        (end.driver == "fixed" or np.allclose(grip.position, pose.position, atol=SAME))
        and (not end.rotates or abs(np.dot(grip.orientation, pose.orientation)) > 1.0 - SAME)
        for end, grip, pose in zip(ends, goal.grips, scenario.grips(scenario.goal), strict=True)
    )
    if is_own and goal.terms == scenario.goal.terms:
        return []
    rotating = [side for side, end in zip(SIDES, ends, strict=True) if end.rotates]
    return [f"goal={inline(goal.entry(rotating))}"]


def obstacle_settings(obstacles: Sequence[Obstacle], scenario: Scenario) -> list[str]:
    """Return the setting of a scene's obstacles; none where they are the scenario's."""
    table = parse_toml(scenario.text)
    file = table.get("obstacles", [])
    names = [o.body(k).name for k, o in enumerate(scenario.obstacles)]
    listed = dict(zip(names, zip(file, scenario.obstacles, strict=True), strict=True))
    saved, changed = [], False
    scene = {o.name: o for o in obstacles}
    ours = {body.name for body in scenario.bodies} - set(names)
    for name, (entry, own) in listed.items():
        body = scene.pop(name, None)
        if body is None:
            changed = True
            continue
        entry = {**entry, "name": name}
        # Where a marker stands, perception finds it.
        if own.marker is None and not np.allclose(body.position, own.position, atol=SAME):
            entry["position"], changed = numbers(body.position), True
            entry["orientation"] = numbers(body.orientation)
        saved.append(entry)
    for body in scene.values():
        if body.name not in ours:
            saved.append(obstacle_entry(body))
            changed = True
    return [f"obstacles={inline(saved)}"] if changed else []
