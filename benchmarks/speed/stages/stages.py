"""Stages of the loop, and the time of each from sampled call stacks.

A sample belongs to the innermost function of its stack that is named here, so that the rod's
kernels count for the stage that launches them. What no stage names is the rest of its process.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Literal, NamedTuple

Unit = Literal["frame", "step", "run"]
"""Unit of a stage's work: an image of the camera, a step of the process, a whole run."""


class Stage(NamedTuple):
    """Part of the loop's work."""

    process: str
    """Process that does it."""
    name: str
    """Name in tables."""
    unit: Unit
    """Unit to which its time is related."""


class Frame(NamedTuple):
    """Function in a call stack."""

    file: str
    """Path of its source file."""
    function: str
    """Its name."""


class Sample(NamedTuple):
    """Call stack of one moment."""

    stack: tuple[Frame, ...]
    """Functions, the outermost first."""
    seconds: float
    """Time for which it stands [s]."""


REST = "rest"
"""Name of the stage of a process that holds what no other stage names."""
OUTSIDE = Stage("runner", REST, "run")
"""Stage of what no process does: delivery of messages in simulated time, the score."""

_FUNCTIONS: dict[Stage, tuple[str, ...]] = {
    Stage("sim", "plant", "step"): (
        "lariat/simulation/plants/mujoco_plant.py:step",
        "lariat/simulation/plants/rod_plant.py:step",
    ),
    Stage("sim", "render", "frame"): ("lariat/simulation/camera/rgbd_camera.py:take",),
    Stage("sim", "encode", "frame"): (
        "services/sim/camera_messages.py:color_message",
        "services/sim/camera_messages.py:depth_message",
    ),
    Stage("perception", "decode", "frame"): ("services/perception/camera_view.py:images",),
    Stage("perception", "segment", "frame"): (
        "lariat/perception/centerline/observation.py:observe",
    ),
    Stage("perception", "fit", "frame"): (
        "lariat/perception/centerline/estimator.py:_best_hypothesis",
    ),
    Stage("planner", "plan", "run"): ("lariat/planning/whole_path.py:plan",),
    Stage("controller", "model", "step"): (
        "lariat/control/estimation/state_estimator.py:advance",
        "lariat/control/estimation/state_estimator.py:observe",
        "lariat/control/estimation/state_estimator.py:predict",
    ),
    Stage("controller", "horizon", "step"): ("lariat/control/mpc/gauss_newton.py:plan",),
    Stage("controller", "setpoints", "step"): (
        "lariat/control/mpc/receding_horizon.py:_setpoints",
        "lariat/control/mpc/setpoint_stream.py:extended",
    ),
    Stage("controller", "guard", "step"): ("lariat/control/supervision/clearance_guard.py:check",),
    Stage("robot_gateway", "check chunks", "step"): (
        "services/robot_gateway/writer_control.py:take_chunks",
        "services/robot_gateway/writer_control.py:advance",
    ),
    Stage("robot_gateway", "follow", "step"): ("lariat/safety/motion/follower.py:step",),
    Stage("robot_gateway", "drive", "step"): ("services/robot_gateway/arms.py:exchange",),
    Stage("runner", "deliver", "run"): (
        "stack/simulation/simulated_time.py:_deliver",
        "stack/simulation/simulated_time.py:_publish",
    ),
    Stage("runner", "score", "run"): ("stack/simulation/scoring.py:__call__",),
}
"""Functions of each stage, as `path:name`."""
_RECEIVE, _PUBLISH = "shared/bus/subscription.py:take", "shared/bus/publisher.py:put"
"""Functions of the bus, in every live process."""
_BY_FUNCTION = {place: stage for stage, places in _FUNCTIONS.items() for place in places}


def times(samples: Iterable[Sample], process: str | None = None) -> Counter[Stage]:
    """Return the time of each stage [s].

    Args:
        samples: Call stacks.
        process: Process from which they are; None where one process steps all services.
    """
    found: Counter[Stage] = Counter()
    for sample in samples:
        found[_stage(sample.stack, process)] += sample.seconds
    return found


def within(samples: Iterable[Sample], place: str) -> list[Sample]:
    """Return the samples in whose stack a function is, as `path:name`."""
    return [s for s in samples if any(_place(frame).endswith(place) for frame in s.stack)]


def _stage(stack: Sequence[Frame], process: str | None) -> Stage:
    for frame in reversed(stack):
        place = _place(frame)
        for known, stage in _BY_FUNCTION.items():
            if place.endswith(known):
                return stage
        if process and place.endswith(_RECEIVE):
            return Stage(process, "receive", "step")
        if process and place.endswith(_PUBLISH):
            return Stage(process, "publish", "step")
    if process:
        return Stage(process, REST, "step")
    for frame in reversed(stack):
        _, services, path = frame.file.rpartition("services/")
        if services and frame.file.endswith("/service.py"):
            return Stage(path.partition("/")[0], REST, "step")
    return OUTSIDE


def _place(frame: Frame) -> str:
    return f"{frame.file}:{frame.function}"
