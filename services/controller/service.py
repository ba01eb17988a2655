"""Owns the task, and turns what is seen and planned into setpoints for the arms."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterator

import numpy as np

from services.controller.control_loop import SETPOINT, Command, ControlLoop
from services.controller.goals import GoalMaker
from services.controller.models import adaptation_of, check, model_of
from services.controller.motion import Motion
from services.controller.objective import Surroundings
from services.controller.paper_adaptation import PaperAdaptation
from services.controller.path_track import PathTrack
from services.controller.publications import (
    STATES,
    chunk_message,
    goal_message,
    goal_of,
    motion_of,
    paper_parameters,
    plan_message,
    track_of,
)
from services.controller.run_monitor import RunMonitor
from services.controller.snag import SnagWatch
from services.controller.state_estimate import StateEstimate
from services.controller.task import Refused, Task
from shared import topics
from shared.geometry import obstacles as geometry
from shared.geometry.obstacles import Obstacle
from shared.messages import (
    ArmStates,
    GoalPreview,
    NodeChain,
    Parameter,
    Parameters,
    RunResult,
    Setpoints,
    TaskRequest,
    TaskState,
    chain,
    grip_pose,
    poses_known,
    scene_obstacles,
)
from shared.rod import Rod, RodProperties
from shared.scenario import SIDES, Scenario
from shared.service import SECOND, Inbox, Publication

log = logging.getLogger(__name__)

BLIND = 9 * SECOND // 20
"""Control goes on without a fresh look at the rope for this long [ns]: half a second, less what an
arm takes to follow, so that it has begun to brake in time."""
STRAYED = 0.04
"""Distance between command and arm at which the command is given up [m]: a CR5 is 0.1 s behind, and
the gateway watches how far it is off its path."""
TAUT = 0.98
"""Distance of the grips, as a share of the rope's length, from which a rod has no rest shape to be
put into that is worth the name [-]."""
STALLED = 5 * SECOND
"""At the end of a path for so long without being within tolerance, control has stalled [ns]; sooner
where the rope rests and comes no nearer."""
LEARNING = 3 * SECOND
"""Longest that a run waits while the rope's material is learnt from its shape at rest [ns]."""
STUCK = 3 * SECOND // 2
"""At the end of a path for so long before a rope that rests counts as stuck [ns]."""
PATIENCE = 2
"""New paths that are asked for after stalling, in one run."""
LEARNT = 0.2
"""Change of the stiffness's logarithm that makes a path worth planning again."""
START_APART = 0.003
"""Most distance of a path's start from the grips [m]."""
NEAR_GOAL = 0.03
"""Mean node distance to the goal from which its own clearance is enough [m]."""
STRETCH = 0.002
"""By which the rope may be pulled longer, as a share of its length [-]."""
LEAST_CLEARANCE = 0.005
"""What is left of a path must keep this, or another one is asked for [m]."""


class ControllerService:
    """The controller on the bus."""

    name = "controller"
    reads = (
        topics.ROPE_NODES,
        topics.ARM_STATE,
        topics.SCENE_STATE,
        topics.CONTROLLER_PATH,
        topics.TASK_REQUEST,
        topics.TASK_GOAL_DRAFT,
    )
    writes = (
        topics.ARM_SETPOINTS,
        topics.CONTROLLER_PLAN,
        topics.CONTROLLER_PARAMETERS,
        topics.TASK_STATE,
        topics.TASK_GOAL_PREVIEW,
        topics.RUN_RESULT,
    )
    rate = 50.0
    latency = 0.010

    def __init__(self, scenario: Scenario, session: str) -> None:
        self._scenario, self._session = scenario, session
        rope = {k: v for k, v in vars(scenario.rope).items() if k != "node_count"}
        self._rod = Rod(RodProperties(**rope), scenario.rope.node_count)
        moves = np.zeros((2, 6), dtype=bool)
        for row, side in zip(moves, SIDES, strict=True):
            row[:3] = scenario.end(side).driver != "fixed"
            row[3:] = scenario.end(side).rotates
        start = scenario.grips(scenario.start)
        self._goals = GoalMaker(scenario, self._rod, start)
        resettable = not any(scenario.end(side).address for side in SIDES)
        self.task = Task(
            self._goals.of_shape(scenario.goal),
            settings={"adapt": "true" if scenario.control.adapt else "false"},
            resettable=resettable,
        )
        self._model = model_of(scenario, self._rod)
        self.estimate = StateEstimate(self._model, Motion.at_rest(*start), 0)
        self.adaptation = adaptation_of(scenario, self._model)
        self.loop = ControlLoop(self.estimate, moves, scenario.control, scenario.limits)
        self.snag = SnagWatch(scenario.rope.length)
        self.monitor = RunMonitor(scenario.run.tolerance, scenario.rope.diameter / 2.0)
        self._lay(scenario.bodies)
        self._scene_revision = 0
        self._arms: ArmStates | None = None
        self._resets: int | None = None
        self._seen = 0
        self._followed: tuple[int, int] | None = None
        self._arrived = self._stalls = self._relearnt = 0
        self._planned_stiffness = self.adaptation.bending_stiffness
        self._sequence = 0
        self._image_stamp = 0
        self._events = sorted(
            (e for e in scenario.events if e.goal is not None), key=lambda e: e.time
        )
        self._events_done = 0
        self._goal_clearance: tuple[tuple[int, int], float] = (-1, -1), np.inf
        self._sent: dict[str, int] = {}
        self._revision_sent = 0

    def warm_up(self) -> None:
        """Compiles by controlling a rope that already is where it shall be."""
        start = self._goals.start
        estimate = StateEstimate(self._model, Motion.at_rest(*start), 0)
        loop = ControlLoop(estimate, self.loop.moves, self._scenario.control, self._scenario.limits)
        nodes = estimate.nodes
        loop.follow(PathTrack.standing(estimate.motion, nodes, SETPOINT * 1e-9), SETPOINT)
        for k in (1, 2, 3):
            estimate.advance(estimate.motion, k * SETPOINT)
            loop.step(k * SETPOINT, nodes, self._surroundings())

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """One step of control."""
        self._take_arms(inbox)
        self._take_rope(inbox, now)
        for request in inbox.every(topics.TASK_REQUEST):
            self._handle(request.message, now)
        self._take_events(now)
        self._take_scene(inbox)
        yield from self._preview(inbox, now)
        if self._arms is not None:
            yield from self._control(inbox, now)
        yield from self._states(now)

    def _take_arms(self, inbox: Inbox) -> None:
        arrived = inbox.every(topics.ARM_STATE)
        if not arrived or not poses_known(arrived[-1].message):
            return
        arms: ArmStates = arrived[-1].message
        self._arms = arms
        motion = motion_of(arms)
        if self._resets != arms.reset_count or self.estimate.time == 0:
            self._resets = arms.reset_count
            self.estimate.restart(motion, arms.stamp, turns=round(self._scenario.start.turns))
            self.loop.disengage()
            self._seen = 0
        else:
            self.estimate.advance(motion, arms.stamp)

    def _take_rope(self, inbox: Inbox, now: int) -> None:
        item = inbox.fresh(topics.ROPE_NODES)
        if item is None or self._arms is None:
            return
        rope: NodeChain = item.message
        if not rope.positions or rope.stamp < self.estimate.begun:
            return
        nodes = chain(rope.positions)
        count = len(nodes)
        sigma = np.array(rope.sigma) if rope.sigma else np.zeros(count)
        observed = np.array(rope.observed) if rope.observed else np.ones(count, dtype=bool)
        self.estimate.observe(rope.stamp, nodes, sigma, observed)
        if self.estimate.astray and self.loop.resting:
            self.estimate.restart(
                self.estimate.motion, self.estimate.time, nodes, self.estimate.turns
            )
        if np.any(observed):
            # Guesses at what is hidden are no look at the rope.
            self._seen, self._image_stamp = now, rope.stamp
        if self._adapts:
            change = self.adaptation.look(self.estimate, rope.stamp, nodes, sigma, observed)
            if change is not None:
                self._become(change)
        # Noise would add to every distance: the run is judged by the estimate.
        believed = self.estimate.modelled_at(rope.stamp) + self.estimate.offset
        self.monitor.look(rope.stamp, believed, self.task.goal.nodes, self._obstacles)
        self._watch(rope.stamp, nodes, observed)

    def _become(self, change: np.ndarray) -> None:
        """Goes on with the rod that was learnt, by which its rest shape changes so much [m]."""
        rod = self._model.with_properties(self.adaptation.properties)
        positions = self.estimate.motion.positions
        apart = np.linalg.norm(positions[1] - positions[0])
        begun = self.loop.path is not None
        if self.adaptation.standing and not begun and apart < TAUT * rod.properties.length:
            self.estimate.rests_as(rod)
        else:
            self.estimate.becomes(rod, change)

    def _watch(self, stamp: int, nodes: np.ndarray, observed: np.ndarray) -> None:
        """Gives up when the rope hangs on something, before the grips pull on it."""
        if self.task.state != "running" or self.loop.path is None:
            self.snag.begin()
            return
        caught = self.snag.look(stamp, nodes, self.estimate.modelled_at(stamp), observed)
        if caught:
            log.warning(caught)
            self.snag.begin()
            self.task.enter("failed", caught)

    def _take_events(self, now: int) -> None:
        if self.task.state not in ("running", "reached"):
            return
        while self._events_done < len(self._events):
            event = self._events[self._events_done]
            if now < self.task.run_started + round(event.time * SECOND):
                return
            self._events_done += 1
            assert event.goal is not None
            self.task.set_goal(self._goals.of_shape(event.goal))
            self.task.enter("running", f"the goal changed {event.time:g} s into the run")

    def _take_scene(self, inbox: Inbox) -> None:
        item = inbox.latest(topics.SCENE_STATE)
        if item is None or item.message.revision == self._scene_revision:
            return
        self._scene_revision = item.message.revision
        self._lay(scene_obstacles(item.message))
        if self.loop.path is None or self.task.state != "running":
            return
        ahead = self.loop.remaining[::5]
        avoid = [o for o in self._obstacles if not o.support]
        if self.monitor.clearance_of(ahead, avoid) < LEAST_CLEARANCE:
            self.task.ask_for_path()

    def _lay(self, obstacles: tuple[Obstacle, ...]) -> None:
        """Takes what surrounds the rope; the model leans on the part that it may lean on."""
        self._obstacles = obstacles
        supports = [o for o in obstacles if o.support]
        self.estimate.supports = geometry.pack(supports) if supports else None

    def _handle(self, request: TaskRequest, now: int) -> None:
        task = self.task
        refusal = ""
        try:
            match request.action:
                case TaskRequest.SET_GOAL:
                    goal = goal_of(request.goal, self._goals, self._obstacles)
                    self._goals.check(goal, self._obstacles)
                    task.set_goal(goal)
                case TaskRequest.START:
                    resumed = task.state == "paused"
                    self._check_arms()
                    task.start(now)
                    if not resumed:
                        self._events_done = self._stalls = self._relearnt = 0
                        self.monitor.begin(now, task.replan_count)
                case TaskRequest.PAUSE:
                    task.pause()
                case TaskRequest.STOP:
                    task.stop()
                case TaskRequest.RESET:
                    task.reset()
                case TaskRequest.SET:
                    task.set(request.key, request.value)
        except Refused as error:
            refusal = str(error)
        task.answered(request.id, refusal)

    def _check_arms(self) -> None:
        """Refuses a run that could not begin."""
        arms = self._arms
        if arms is None:
            raise Refused("the arms have not said yet where they are; is the gateway running?")
        if arms.mode == ArmStates.DISARMED:
            raise Refused(f"the arms are disarmed ({arms.reason}); arm them first")
        if arms.mode == ArmStates.FAULT or arms.needs_acknowledgement:
            raise Refused(f"the arms hold ({arms.reason}); acknowledge first")

    def _preview(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        item = inbox.fresh(topics.TASK_GOAL_DRAFT)
        if item is None:
            return
        draft = item.message
        answer = GoalPreview(draft=draft.id, stamp=now)
        try:
            grips = self._goals.held(grip_pose(draft.left), grip_pose(draft.right))
            goal = self._goals.between(*grips, self._obstacles)
            answer.goal.CopyFrom(goal_message(goal))
            self._goals.check(goal, self._obstacles)
            answer.reachable = True
        except ValueError as error:
            answer.reason = str(error)
        yield Publication(topics.TASK_GOAL_PREVIEW, answer)

    def _control(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        halted = self._halted(now)
        if halted:
            self.loop.disengage()
            yield self._hold(now, halted)
            return
        waiting = self._waiting(inbox, now)
        if waiting:
            chunk = None if self.loop.resting else self.loop.brake(now)
            if chunk is None:
                self.loop.disengage()
                yield self._hold(now, waiting)
            else:
                yield self._setpoints(now, chunk)
            return
        goal = self.task.goal
        self.loop.oriented = goal.left_oriented, goal.right_oriented
        command = self.loop.step(now, self.task.goal.nodes, self._surroundings())
        yield self._setpoints(now, command.chunk)
        yield Publication(topics.CONTROLLER_PLAN, self._plan(command))
        self._judge(now)

    def _halted(self, now: int) -> str:
        """Why nothing may be sent but a hold; empty when there is no such reason."""
        arms, task = self._arms, self.task
        assert arms is not None
        if task.state not in ("running", "reached"):
            return task.reason
        if arms.needs_acknowledgement or arms.mode in (ArmStates.DISARMED, ArmStates.FAULT):
            return f"the arms do not follow: {arms.reason}"
        if task.reset_count != arms.reset_count:
            return "waiting for the arms to reset"
        if now - self._seen > BLIND or self._seen == 0:
            if self.loop.path is not None:
                task.ask_for_path()
            return f"the rope has not been seen for {BLIND / SECOND:g} s"
        if self.loop.strayed() > STRAYED:
            task.ask_for_path()
            return f"an arm is {1e3 * self.loop.strayed():.0f} mm from where it should be"
        return ""

    def _waiting(self, inbox: Inbox, now: int) -> str:
        """Why there is nothing to follow, after taking a path that is new; empty when there is."""
        task = self.task
        wanted = (task.goal_revision, task.replan_count)
        if self._followed == wanted and self.loop.path is not None:
            return ""
        if not self.loop.resting:
            return "coming to rest before another path"
        if not self._scenario.control.planner:
            here = self.estimate.motion
            self.loop.follow(PathTrack.standing(here, self.estimate.nodes, SETPOINT * 1e-9), now)
            self._followed = wanted
            return ""
        item = inbox.latest(topics.CONTROLLER_PATH)
        if item is None:
            return "waiting for a path"
        path = item.message
        if (path.goal_revision, path.replan_count) != wanted:
            return "waiting for a path"
        if not path.left_positions:
            task.enter("failed", path.reason)
            return path.reason
        if self._unlearnt(now):
            return "learning the rope before it is moved"
        if self._learnt_since(path.bending_stiffness) and self._relearnt < PATIENCE:
            self._relearnt += 1
            task.ask_for_path()
            return "the rope has turned out to be another one; waiting for a path"
        track = track_of(path)
        apart = np.linalg.norm(track.positions[0] - self.estimate.motion.positions, axis=1)
        if np.max(apart) > START_APART:
            task.ask_for_path()
            return "the path begins elsewhere; waiting for another"
        self.loop.follow(track, now)
        self._arrived = 0
        self._planned_stiffness = path.bending_stiffness
        self._followed = wanted
        return ""

    def _unlearnt(self, now: int) -> bool:
        """Whether a look or two more at the rope as it hangs will tell what it is made of."""
        waited = now - self.task.run_started
        return self._adapts and not self.adaptation.settled and waited < LEARNING

    def _judge(self, now: int) -> None:
        """Whether the goal is reached, or given up."""
        task, path = self.task, self.loop.path
        if path is None or not self.loop.arrived:
            return
        if self.monitor.settled(now):
            self._arrived = 0
            if task.state == "running":
                task.enter("reached", "within tolerance and at rest")
            return
        self._arrived = self._arrived or now
        rests = self.monitor.resting(now)
        stuck = rests and self.monitor.stuck(now) and now - self._arrived > STUCK
        if task.state != "running" or not (rests or now - self._arrived > STALLED):
            return
        # "Unreachable" was said of the rope as it was believed to be.
        learnt = rests and self._learnt_since(self._planned_stiffness)
        stalled = path.reached and (stuck or now - self._arrived > STALLED)
        if (learnt or stalled) and self._stalls < PATIENCE:
            self._arrived = 0
            self._stalls += 1
            task.ask_for_path()
        elif stalled:
            error = f"{1e3 * self.monitor.error:.1f} mm from the goal on average"
            task.enter("failed", f"stalled {error}, {PATIENCE} new paths did not help")
        elif stuck:
            task.enter("failed", path.reason)

    def _learnt_since(self, stiffness: float) -> bool:
        """Whether the rope has turned out to be another one than a path was planned for.

        Args:
            stiffness: EI of that one [N m^2]; 0 in recordings that are older than it.
        """
        if not self._adapts or isinstance(self.adaptation, PaperAdaptation) or stiffness <= 0.0:
            return False
        return abs(math.log(self.adaptation.bending_stiffness / stiffness)) > LEARNT

    @property
    def _adapts(self) -> bool:
        return self.task.settings["adapt"] == "true"

    def _surroundings(self) -> Surroundings:
        scenario = self._scenario
        return Surroundings(
            tuple(o for o in self._obstacles if not o.support),
            self._clearance(),
            scenario.rope.diameter / 2.0,
            0.99 * scenario.limits.overstretch * scenario.rope.length,
            (1.0 + STRETCH) * scenario.rope.length,
        )

    def _clearance(self) -> float:
        """What to keep: all that is wanted on the way, no more than the goal has at its end [m]."""
        wanted = self._scenario.control.clearance
        revision = (self.task.goal_revision, self._scene_revision)
        if self._goal_clearance[0] != revision:
            avoid = [o for o in self._obstacles if not o.support]
            radius = self._scenario.rope.diameter / 2.0
            own = geometry.chain_clearance(self.task.goal.nodes, radius, avoid)
            self._goal_clearance = revision, own
        near_goal = self.monitor.error < NEAR_GOAL
        return min(wanted, self._goal_clearance[1] - 5e-4) if near_goal else wanted

    def _setpoints(self, now: int, chunk) -> Publication:
        self._sequence += 1
        message = chunk_message(chunk, now, self._session, self._sequence, self._image_stamp)
        return Publication(topics.ARM_SETPOINTS, message)

    def _hold(self, now: int, reason: str) -> Publication:
        self._sequence += 1
        return Publication(
            topics.ARM_SETPOINTS,
            Setpoints(
                stamp=now, session=self._session, sequence=self._sequence, hold=True, reason=reason
            ),
        )

    def _plan(self, command: Command):
        return plan_message(command, round(self.loop.time_step * SECOND))

    def _states(self, now: int) -> Iterator[Publication]:
        task = self.task
        busy = task.state in ("running", "reached")
        if task.revision != self._revision_sent or self._due(
            "task", now, SECOND // 5 if busy else SECOND
        ):
            self._revision_sent = task.revision
            self._sent["task"] = now
            yield Publication(topics.TASK_STATE, self._task_state(now))
        if self._arms is not None and self._due("parameters", now, SECOND // 10):
            yield Publication(topics.CONTROLLER_PARAMETERS, self._parameters(now))
        if task.run and self._due("result", now, SECOND):
            yield Publication(topics.RUN_RESULT, self._result(now))

    def _due(self, what: str, now: int, period: int) -> bool:
        if what in self._sent and now - self._sent[what] < period:
            return False
        self._sent[what] = now
        return True

    def _task_state(self, now: int) -> TaskState:
        task, monitor = self.task, self.monitor
        return TaskState(
            stamp=now,
            revision=task.revision,
            state=STATES[task.state],
            reason=task.reason,
            goal=goal_message(task.goal),
            goal_revision=task.goal_revision,
            reset_count=task.reset_count,
            replan_count=task.replan_count,
            run=task.run,
            run_started=task.run_started,
            settings=task.settings,
            last_request=task.last_request,
            refusal=task.refusal,
            error=monitor.error,
            clearance=monitor.clearance,
            turns=self.estimate.turns,
        )

    def _parameters(self, now: int) -> Parameters:
        adaptation = self.adaptation
        if isinstance(adaptation, PaperAdaptation):
            return paper_parameters(adaptation, now, self.estimate.innovation)
        return Parameters(
            stamp=now,
            parameters=[
                Parameter(
                    name=e.name,
                    value=e.value,
                    standard_deviation=e.standard_deviation if self._adapts else 0.0,
                    unit=e.unit,
                )
                for e in adaptation.estimates
            ],
            prediction_error=self.estimate.innovation,
        )

    def _result(self, now: int) -> RunResult:
        task, monitor = self.task, self.monitor
        return RunResult(
            stamp=now,
            run=task.run,
            reached=task.state == "reached",
            duration=(now - task.run_started) / SECOND,
            error=monitor.error,
            max_node_error=monitor.max_node_error,
            min_clearance=monitor.min_clearance,
            replans=max(task.replan_count - monitor.replans_before, 0),
            reason=task.reason,
        )


def build(scenario: Scenario, session: str) -> ControllerService:
    """The controller of a scenario."""
    check(scenario)
    return ControllerService(scenario, session)
