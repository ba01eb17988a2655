"""Attacks of a process that has the stack's password: what the gateway makes of its messages."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from benchmarks.faults.attacks.attack import Attack, NoControl
from benchmarks.live_stack import LiveStack
from shared import topics
from shared.messages import (
    REACHED,
    ArmCommand,
    ArmSetpoints,
    ArmStates,
    Scene,
    Setpoints,
    TaskRequest,
    validation,
)
from shared.messages.checks.values import MAX_INTEGER
from stack.client import Client, RequestFailed

WHO = "a process with the bus's password"
WATCH_TIME = 0.5
"""Time for which the arms are watched during an attack [s]."""
PERIOD = 0.02
"""Time between two hostile messages [s]."""
LIFT = 0.02
"""Height of the motion that hostile setpoints ask for [m]."""
POSES, DT = 26, 20_000_000
"""Number of poses of hostile setpoints, and time between two of them [ns]."""
STILL = 1e-4
"""Motion of a grip that counts as none [m]."""
RUN_TIMEOUT = 60.0
"""Longest wait for the goal of the lawful run afterwards [s]."""


def attacks(stack: LiveStack) -> Iterator[Attack]:
    """Publish setpoints, commands and scenes that nobody asked for, then run lawfully."""
    with stack.connect() as client:
        state = client.newest_arm_state()
        if not state.may_move:
            raise NoControl(f"the cell does not stand ready: {state.reason}")
        writer = state.next_session

        def setpoints(session: str, sequence: Callable[[int], int]) -> Callable[[int], None]:
            publisher = client.matched_publisher(topics.ARM_SETPOINTS)
            return lambda k: publisher.put(_lifting(client, state, session, sequence(k)))

        def command(**fields: object) -> Callable[[int], None]:
            publisher = client.matched_publisher(topics.ARM_COMMAND)
            return lambda k: publisher.put(ArmCommand(id=f"hostile-{k}-{fields}", **fields))

        empty = client.matched_publisher(topics.SCENE_STATE)
        for attempt, put in (
            ("setpoints under a session of its own", setpoints("stranger", lambda k: k)),
            (
                "setpoints of the controller, run ahead",
                setpoints(writer, lambda k: MAX_INTEGER - 1000 + k),
            ),
            ("setpoints of the controller, in its past", setpoints(writer, lambda k: 0)),
            (
                "an approach in the name of a former gateway",
                command(action=ArmCommand.APPROACH, boot="robot_gateway-0", answers=state.stamp),
            ),
            (
                "an approach that answers an old state",
                command(action=ArmCommand.APPROACH, boot=state.boot, answers=1),
            ),
            ("a scene without obstacles", lambda k: empty.put(Scene(revision=10**6 + k))),
        ):
            moved = _motion(client, put)
            yield Attack(WHO, attempt, f"moves a grip by {1e3 * moved:.2f} mm", moved < STILL)
        reached, words = _lawful_run(client)
        yield Attack("a person", "a run after all of this", words, reached)


def _lifting(client: Client, state: ArmStates, session: str, sequence: int) -> Setpoints:
    """Setpoints that lift every arm from where it is."""
    share = np.clip(np.linspace(0.0, 1.2, POSES), 0.0, 1.0)[:, None]
    lift = share**2 * (3.0 - 2.0 * share) * np.array([0.0, 0.0, LIFT])
    arms = [
        ArmSetpoints(
            arm=arm.arm,
            positions=(np.array(arm.position) + lift).ravel().tolist(),
            orientations=np.tile(arm.orientation, (POSES, 1)).ravel().tolist(),
        )
        for arm in state.arms
    ]
    message = Setpoints(
        session=session, sequence=max(sequence, 1), t0=client.now(), dt=DT, arms=arms
    )
    # One that the check of the bus drops would prove nothing of the gateway.
    validation.decode(topics.ARM_SETPOINTS, message.SerializeToString())
    return message


def _motion(client: Client, put: Callable[[int], None]) -> float:
    """Return how far a grip moves while hostile messages are published [m]."""
    begin = _positions(client.newest_arm_state())
    end, moved, k = time.monotonic() + WATCH_TIME, 0.0, 0
    states = client.bus.subscribe(topics.ARM_STATE)
    while time.monotonic() < end:
        put(k)
        k += 1
        time.sleep(PERIOD)
        for _, item in states.take():
            moved = max(moved, float(np.max(np.abs(_positions(item.message) - begin))))
    return moved


def _positions(state: ArmStates) -> np.ndarray:
    return np.array([arm.position for arm in state.arms])


def _lawful_run(client: Client) -> tuple[bool, str]:
    """Return whether a person reaches the goal, acknowledging what the attacks have stopped."""
    tasks = client.bus.subscribe(topics.TASK_STATE)
    stops, started = 0, False
    deadline = time.monotonic() + RUN_TIMEOUT
    while time.monotonic() < deadline:
        try:
            arms = client.newest_arm_state()
            if arms.needs_acknowledgement:
                stops += 1
                client.command_arms(ArmCommand.ACKNOWLEDGE)
                client.command_arms(ArmCommand.RESUME)
            if not started:
                client.request_task(TaskRequest.START)
                started = True
        except RequestFailed:
            pass
        time.sleep(0.1)
        if any(started and item.message.state == REACHED for _, item in tasks.take()):
            return True, f"reaches the goal after {stops} acknowledged stops"
    return False, f"does not reach the goal; {stops} stops were acknowledged"
