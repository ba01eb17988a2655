"""Conversion between the controller's types and the messages of the bus."""

from __future__ import annotations

from functools import partial

import numpy as np

from lariat.control.estimation.adaptation import Adaptation, ParameterEstimate
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.mpc.receding_horizon import Command
from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.control.run.arm_condition import ArmCondition
from lariat.control.run.goals import Pull
from lariat.control.run.reasons import Reason
from lariat.control.run.requests import Preview, Request, RequestAction
from lariat.control.supervision.path_choice import PathOffer
from lariat.safety.motion_contract import SETPOINT_PERIOD
from lariat.scenario import SIDES, Goal
from lariat.trajectory import MotionState, SetpointChunk
from shared import messages
from shared.messages import (
    ArmSetpoints,
    ArmStates,
    Estimate,
    GoalDraft,
    GoalPreview,
    NodeChain,
    Parameters,
    Path,
    Plan,
    RodParameters,
    Setpoints,
    TaskRequest,
    XpbdParameters,
    arm_state,
    chain,
    goal_message,
    goal_of,
)

STILL = (0.0, 0.0, 0.0)
"""Velocity of an arm that reports none."""


def rope_observation(message: NodeChain) -> RopeObservation:
    """Observation of the rope in a message."""
    nodes = chain(message.positions)
    count = len(nodes)
    return RopeObservation(
        message.stamp,
        nodes,
        np.array(message.sigma) if message.sigma else np.zeros(count),
        np.array(message.observed) if message.observed else np.ones(count, dtype=bool),
        message.p_wrong,
    )


def grip_motion(arms: ArmStates) -> MotionState:
    """Measured motion of both grips; their accelerations are zero."""
    states = [arm_state(arms, side) for side in SIDES]
    twists = [
        [state.linear_velocity[:] or STILL, state.angular_velocity[:] or STILL] for state in states
    ]
    return MotionState(
        np.array([state.position[:] for state in states]),
        np.array([state.orientation[:] for state in states]),
        np.array(twists),
        np.zeros((2, 2, 3)),
    )


def arm_condition(arms: ArmStates, session: str) -> ArmCondition:
    """Condition of the arms."""
    armed = arms.mode != ArmStates.DISARMED
    refused = arms.refused_sequence - arms.sequence if arms.session == session else 0
    return ArmCondition(
        armed, arms.may_move, arms.reason, arms.reset_count, refused, arms.chunk_refusal
    )


def task_request(message: TaskRequest) -> Request:
    """Request of a person; an action that this version does not know becomes None."""
    is_known = message.action in TaskRequest.Action.values()
    action = RequestAction[TaskRequest.Action.Name(message.action)] if is_known else None
    goal = goal_of(message.goal) if action is RequestAction.SET_GOAL else None
    return Request(message.id, action, goal, message.key, message.value, message.move)


def draft_request(message: GoalDraft) -> tuple[Goal, Pull | None]:
    """Goal between grips that are being dragged, and the node between them that is pulled."""
    grips = messages.grip_pose(message.left), messages.grip_pose(message.right)
    pull = (message.node, np.array(message.pull)) if message.pull else None
    return Goal(np.zeros((0, 3)), *grips, turns=message.turns), pull


def preview_message(preview: Preview, draft: str, now: int) -> GoalPreview:
    """Message of a preview."""
    reachable = preview.goal is not None and not preview.problem
    message = GoalPreview(draft=draft, stamp=now, reachable=reachable, reason=preview.problem)
    if preview.goal is not None:
        message.goal.CopyFrom(goal_message(preview.goal))
    return message


def chunk_message(
    chunk: SetpointChunk, now: int, session: str, sequence: int, image_stamp: int
) -> Setpoints:
    """Message of a chunk of setpoints."""
    arms = [
        ArmSetpoints(
            arm=side,
            positions=chunk.positions[:, k].ravel().tolist(),
            orientations=chunk.orientations[:, k].ravel().tolist(),
        )
        for k, side in enumerate(SIDES)
    ]
    return Setpoints(
        stamp=now,
        session=session,
        sequence=sequence,
        t0=chunk.start,
        dt=SETPOINT_PERIOD,
        arms=arms,
        image_stamp=image_stamp,
    )


def hold_message(reason: Reason, now: int, session: str, sequence: int) -> Setpoints:
    """Message that holds the arms."""
    return Setpoints(stamp=now, session=session, sequence=sequence, hold=True, reason=str(reason))


def plan_message(command: Command) -> Plan:
    """Message of the predicted horizon; its first chain is one step after the plan's start."""
    return Plan(
        stamp=command.plan_start + command.plan_step,
        dt=command.plan_step,
        node_count=command.plan.nodes.shape[1],
        nodes=command.plan.nodes.ravel().tolist(),
        cost=command.plan.cost,
        iterations=command.plan.iterations,
    )


def path_offer(path: Path) -> PathOffer:
    """Answer of the planner."""
    return PathOffer(
        path.stamp,
        path.goal_revision,
        path.replan_count,
        bool(path.left_positions),
        path.reason,
        path.bending_stiffness,
        path.node_count,
        path.others_revision,
        path.motion_run_started,
        path.start_after,
        path.start_before,
        path.certain_clearance,
        partial(reference_trajectory, path),
    )


def reference_trajectory(path: Path) -> ReferenceTrajectory:
    """Reference trajectory of a planned path."""
    if path.dt != SETPOINT_PERIOD:
        raise ValueError(
            f"the points of a path must be {SETPOINT_PERIOD} ns apart, as setpoints are, got "
            f"{path.dt} ns"
        )
    left, right = chain(path.left_positions), chain(path.right_positions)
    turned = [
        np.asarray(q, dtype=float).reshape(-1, 4)
        for q in (path.left_orientations, path.right_orientations)
    ]
    nodes = chain(path.nodes).reshape(len(left), path.node_count, 3)
    return ReferenceTrajectory(
        np.stack([left, right], axis=1),
        np.stack(turned, axis=1),
        SETPOINT_PERIOD * 1e-9,
        nodes,
        path.reached,
        path.reason,
        path.blocked,
    )


def parameters_message(
    adaptation: Adaptation, now: int, prediction_error: float, *, adapts: bool
) -> Parameters:
    """Message of the learnt parameters; given ones have no deviations."""

    def estimate(of: ParameterEstimate) -> Estimate:
        deviation = of.standard_deviation if adapts else 0.0
        return Estimate(value=of.value, standard_deviation=deviation)

    message = Parameters(stamp=now, prediction_error=prediction_error)
    scalars, profiles = adaptation.scalars, adaptation.profiles
    match adaptation.parameter_set:
        case "rod":
            single = {name: estimate(of) for name, of in scalars.items()}
            several = {name: [estimate(of) for of in row] for name, row in profiles.items()}
            message.rod.CopyFrom(RodParameters(**single, **several))
            if adapts:
                mean, covariance = adaptation.distribution
                message.unknowns.extend(mean)
                message.covariance.extend(covariance[np.tril_indices(len(mean))])
        case "xpbd":
            values = {name: of.value for name, of in scalars.items()}
            message.xpbd.CopyFrom(XpbdParameters(**values))
    return message
