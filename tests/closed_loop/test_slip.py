"""A rope that slips out of a grip stops the arms, in words."""

from __future__ import annotations

from shared import topics
from shared.messages import FAILED, ArmStates, TaskState
from stack.simulation.simulated_time import Delivery
from tests.closed_loop.loop import messages


def run(*settings: str) -> tuple[list[TaskState], list[ArmStates], list[Delivery]]:
    """Run whose rope slips out of the left grip after 0.3 s."""
    slip = ("plant.slip.side=left", "plant.slip.time=0.3")
    plant = ("obstacles=[]", "plant.model=links", "plant.rope.node_count=40")
    log = messages("three-cylinders", *plant, *slip, "run.time_limit=1.5", *settings)
    tasks = [d.parse() for d in log if d.key == topics.TASK_STATE.key]
    return tasks, [d.parse() for d in log if d.key == topics.ARM_STATE.key], log


def stands(state: ArmStates) -> bool:
    return state.braking or state.mode == ArmStates.HOLDING


def test_run_ends_with_the_grip_that_the_rope_has_left() -> None:
    tasks, states, _ = run("sensing.source=truth")
    assert tasks[-1].state == FAILED
    assert tasks[-1].reason_code == TaskState.SLIPPED
    assert "out of the left grip" in tasks[-1].reason
    failed = next(task.stamp for task in tasks if task.state == FAILED)
    assert 1e-9 * (failed - tasks[-1].run_started) < 0.6
    after = [state for state in states if state.stamp > failed + 50_000_000]
    assert after
    assert all(stands(state) for state in after)


def test_arms_hold_where_the_camera_sees_a_rope_that_is_not_between_the_grips() -> None:
    _, states, log = run("sensing.source=camera")
    chains = [d.parse() for d in log if d.key == topics.ROPE_NODES.key]
    assert "contradicts the grips" in chains[-1].lost
    assert stands(states[-1])
    assert "not been seen" in states[-1].reason
