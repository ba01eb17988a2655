"""What a person can do about a stop or a refusal, by the gateway's rule."""

from __future__ import annotations

ADVICE = {
    "finite": "A process sent something that is no motion; see the log of the controller.",
    "ordered": "Another controller speaks, or this one was restarted: acknowledge, then resume.",
    "fresh": "Controller, bus or machine were too slow: see the tab Health, acknowledge, resume.",
    "rest": "The motion does not end at rest; see the log of the controller.",
    "speed": "The motion exceeds limits.speed; see the log of the controller.",
    "acceleration": "The motion exceeds limits.acceleration; see the log of the controller.",
    "jerk": "The motion exceeds limits.jerk; see the log of the controller.",
    "step": "The arms are not where the motion is: it begins again from where they stand.",
    "workspace": "Place the goal inside limits.workspace, or widen it in the scenario.",
    "keep_in": "Place the goal inside the regions of keep_in, or widen them in the scenario.",
    "keep_out": "Move goal or obstacle, or raise control.clearance; limits.keep_out is kept.",
    "table": "Raise the goal: gripper or arm would touch the table.",
    "spacing": "Bring the grips of the goal further apart, or turn one of them.",
    "overstretch": "Bring the grips together, or look whether the rope is caught.",
    "joint_limits": "Turn the grip or move the goal: a joint of the arm is at its end.",
    "joint_speed": "Go slower near this pose, or turn the grip: a joint would turn too fast.",
    "joint_acceleration": "Go slower near this pose: a joint would speed up or brake too hard.",
    "singularity": "Turn the grip or move the goal: the arm is stretched out or folded.",
    "lost_link": "Check cable, power and address of the arm; it connects again by itself.",
}
"""Advice by rule."""
ACKNOWLEDGE = "Look at the cell, acknowledge, then resume."
"""Advice where no rule says more."""
APPROACH = "Let the arms approach the start: keep the button in the bar pressed."
"""Advice where the arms are away from the start."""


def advice(rule: str, needs_acknowledgement: bool, needs_approach: bool) -> str:
    """Return what to do about a stop; empty where it ends by itself."""
    if needs_approach:
        return APPROACH
    return ADVICE.get(rule, ACKNOWLEDGE if needs_acknowledgement else "")
