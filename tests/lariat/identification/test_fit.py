"""The material of a rope is identified from its motion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.identification import (
    Finding,
    Motion,
    findings,
    generic_rope,
    identify,
    predict,
    undetermined,
)
from lariat.identification.rod_twin import RodTwin
from tests.lariat.identification.ropes import (
    CURVED_PROPERTIES,
    NODES,
    STIFFNESS,
    TRUE_PROPERTIES,
    recorded,
)

NOISE = 3e-4


def named(found: list[Finding], name: str) -> Finding:
    return next(f for f in found if f.name == name)


@pytest.mark.parametrize(("right", "factor"), [("clamped", 10.0), ("clamped", 0.1), ("free", 1.0)])
def test_stiffness_is_found_from_any_start(right: str, factor: float) -> None:
    motion = recorded(CURVED_PROPERTIES, sequences=1, frames=90, right=right, noise=NOISE)
    start = generic_rope()
    start = start.with_stiffness(factor * STIFFNESS * start.linear_density)
    fit = identify(motion, start)
    stiffness = named(findings(fit), "stiffness")
    assert abs(stiffness.value - STIFFNESS) < max(3.0 * stiffness.standard_deviation, 1e-3)
    assert stiffness.standard_deviation < 0.5 * STIFFNESS
    assert "--dt" not in " ".join(undetermined(fit))
    other = recorded(CURVED_PROPERTIES, sequences=1, frames=120, right=right, noise=NOISE, seed=5)
    assert np.mean(predict(other, fit.properties, fit.length_scale).scores) < 3e-3


def test_vertices_on_the_rope_that_are_taken_for_a_gripper_are_noticed() -> None:
    """Every vertex is on the rope; taken for clamps, the outer two make it seem softer by 40 %."""
    motion = recorded(sequences=1, on_rope=True)
    clamped = identify(motion)
    measured = identify(replace(motion, grip="measured"))
    assert clamped.other_grip > 0.9
    assert "--grip measured" in " ".join(undetermined(clamped))
    assert measured.other_grip < 0.1
    wrong, right = (named(findings(fit), "stiffness") for fit in (clamped, measured))
    assert wrong.standard_deviation > 2.0 * right.standard_deviation
    assert abs(wrong.value - STIFFNESS) < 3.0 * wrong.standard_deviation
    assert abs(right.value - STIFFNESS) < 0.5 * abs(wrong.value - STIFFNESS)


def test_a_wrong_time_between_frames_is_told_by_gravity() -> None:
    motion = recorded(sequences=1, frames=90, noise=NOISE)
    slow = identify(replace(motion, dt=2.0 * motion.dt))
    assert f"try --dt {motion.dt:g}" in " ".join(undetermined(slow))


def test_undetermined_properties_are_listed() -> None:
    fit = identify(recorded(sequences=1, frames=60, right="free", noise=NOISE))
    found = findings(fit)
    assert not named(found, "twist_ratio").known
    listed = " ".join(undetermined(fit))
    assert "Mass" in listed
    assert "Twist ratio" in listed
    assert "Mass" not in " ".join(undetermined(fit, density_known=True))
    assert TRUE_PROPERTIES.linear_density == pytest.approx(generic_rope().linear_density)


def test_a_coarse_rod_says_how_much_its_length_is_off(monkeypatch: pytest.MonkeyPatch) -> None:
    motion = recorded(sequences=1, frames=90)
    alone = identify_coarsely(motion, monkeypatch, refined=False)
    stated = identify_coarsely(motion, monkeypatch, refined=True)
    assert stated.value == alone.value
    # The innermost held vertices are the middles of the outer edges.
    error = abs(stated.value - TRUE_PROPERTIES.length * (NODES - 2) / (NODES - 1))
    assert error > 3.0 * alone.standard_deviation
    assert 0.3 * error < stated.standard_deviation < 3.0 * error


def identify_coarsely(motion: Motion, monkeypatch: pytest.MonkeyPatch, refined: bool) -> Finding:
    """Length found with a rod of twelve nodes, with or without the error of its resolution."""
    with monkeypatch.context() as patched:
        patched.setattr("lariat.identification.fit.RodTwin", lambda m, given: RodTwin(m, given, 12))
        if not refined:
            patched.setattr("lariat.identification.fit.NODE_REFINEMENT", 0.0)
            patched.setattr("lariat.identification.fit.STEP_REFINEMENT", 0.0)
        return named(findings(identify(motion)), "length")


def test_drag_of_a_light_rope_is_told_from_its_damping() -> None:
    """It slows fast motion more, and motion across the rope alone."""
    density, coefficient = 0.002, 1.1
    light = replace(TRUE_PROPERTIES, linear_density=density, drag_coefficient=coefficient)
    light = light.with_stiffness(STIFFNESS * density)
    start = replace(generic_rope(), linear_density=density, drag_coefficient=0.5)
    start = start.with_stiffness(STIFFNESS * density)
    fit = identify(recorded(light, right="free", noise=NOISE), start)
    drag = named(findings(fit), "drag_coefficient_per_density")
    assert drag.known
    assert abs(drag.value - coefficient / density) < 3.0 * drag.standard_deviation
    assert drag.standard_deviation < 0.2 * drag.value
    damping = named(findings(fit), "damping")
    assert abs(damping.value - light.damping) < 3.0 * damping.standard_deviation


def test_drag_that_is_given_as_none_is_not_fitted() -> None:
    fit = identify(recorded(sequences=1, frames=40))
    assert not any(f.name.startswith("drag") for f in findings(fit))


def test_motion_that_is_too_short_is_refused() -> None:
    with pytest.raises(ValueError, match="too few"):
        identify(recorded(sequences=1, frames=30), seconds=0.05)
