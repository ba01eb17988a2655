"""A camera that fails in the middle of a run: it is said why, the arms hold, the run goes on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from lariat.scenario.cameras import DEFAULT_CAMERA
from lariat.scenario.settings import load_with
from lariat.trajectory import SECOND
from services.sim.service import SimService
from shared import topics
from shared.messages import REACHED, NodeChain, Setpoints, TaskState, stamp_of
from shared.runtime.service import Inbox, Publication
from stack import services
from stack.simulation import closed_loop
from stack.simulation.simulated_run import SimulatedRun
from stack.simulation.simulated_time import Delivery, session_id
from tests.closed_loop.loop import SCENARIOS

COLOR = topics.CAMERA_COLOR.at(DEFAULT_CAMERA)
DEPTH = topics.CAMERA_DEPTH.at(DEFAULT_CAMERA)
CALIBRATION = topics.CAMERA_CALIBRATION.at(DEFAULT_CAMERA)
Fault = Callable[[Publication], Publication | None]


def silent(publication: Publication) -> None:
    """No camera."""


def black(publication: Publication) -> Publication:
    if publication.topic.key == COLOR.key:
        return _colored(publication, np.zeros((480, 640, 3), np.uint8))
    return publication


def without_depth(publication: Publication) -> Publication:
    if publication.topic.key != DEPTH.key:
        return publication
    old: Any = publication.message
    nothing = np.full((old.height, old.width), np.nan, "<f4")
    new = RawImage(timestamp=old.timestamp, width=old.width, height=old.height)
    new.encoding, new.step, new.data = "32FC1", 4 * old.width, nothing.tobytes()
    return Publication(publication.topic, new)


def small(publication: Publication) -> Publication:
    if publication.topic.key == COLOR.key:
        return _colored(publication, np.zeros((240, 320, 3), np.uint8))
    return publication


def miscalibrated(publication: Publication) -> Publication:
    if publication.topic.key == CALIBRATION.key:
        new = type(publication.message)()
        new.CopyFrom(publication.message)
        new.K[0] *= 1.3
        new.K[4] *= 1.3
        return Publication(publication.topic, new)
    return publication


def _colored(publication: Publication, image: np.ndarray) -> Publication:
    data = cv2.imencode(".jpg", image)[1].tobytes()
    new = CompressedImage(timestamp=publication.message.timestamp, data=data, format="jpeg")
    return Publication(publication.topic, new)


class Frozen:
    """The same images for ever, with new stamps."""

    def __init__(self) -> None:
        self._kept: dict[str, bytes] = {}

    def __call__(self, publication: Publication) -> Publication:
        if publication.topic.key in (COLOR.key, DEPTH.key):
            kept = self._kept.setdefault(publication.topic.key, publication.message.data)
            publication.message.data = kept
        return publication


class OneAfterTheOther:
    """Several faults, each for a time that says it."""

    LASTING = 380_000_000

    def __init__(self, *faults: Fault) -> None:
        self._faults = faults
        self._began: int | None = None

    def __call__(self, publication: Publication) -> Publication | None:
        now = stamp_of(publication.message)
        self._began = self._began or now
        index = min((now - self._began) // self.LASTING, len(self._faults) - 1)
        return self._faults[index](publication)


@dataclass
class FailingLab:
    """The sim, whose camera fails for a while."""

    lab: SimService
    fault: Fault
    begin: int
    end: int

    def __post_init__(self) -> None:
        self.name, self.rate, self.latency = self.lab.name, self.lab.rate, self.lab.latency
        self.reads, self.writes = self.lab.reads, self.lab.writes

    def warm_up(self) -> None:
        self.lab.warm_up()

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        for publication in self.lab.step(inbox, now):
            fails = self.begin <= now < self.end and publication.topic.key != topics.ROPE_TRUTH.key
            passed = self.fault(publication) if fails else publication
            if passed is not None:
                yield passed


def run_with(
    fault: Fault,
    begin: int,
    end: int,
    name: str,
    time_limit: float,
    stop_after: float | None = None,
) -> tuple[SimulatedRun, list[Delivery]]:
    """Run of a scenario whose camera fails for a time, and what was said of rope, arms and task."""
    of = load_with(SCENARIOS / f"{name}.toml", (f"run.time_limit={time_limit}",))
    members = [
        FailingLab(services.build(n, of, session_id(n)), fault, begin, end)
        if n == "sim"
        else services.build(n, of, session_id(n))
        for n in services.NAMES
    ]
    log: list[Delivery] = []
    keys = (topics.ROPE_NODES.key, topics.ARM_SETPOINTS.key, topics.TASK_STATE.key)
    outcome = closed_loop.run(
        of,
        stop_after=stop_after,
        members=tuple(members),
        taps=(lambda d: log.append(d) if d.key in keys else None,),
    )
    return outcome, log


def test_a_rope_at_its_goal_that_is_not_seen_for_a_while_needs_no_other_path() -> None:
    begin, end = 4 * SECOND, 5 * SECOND
    outcome, log = run_with(silent, begin, end, "fixed-end", 6.0)
    states: list[TaskState] = [d.parse() for d in log if d.key == topics.TASK_STATE.key]  # pyright: ignore[reportAssignmentType]
    at_goal = [state for state in states if state.stamp > begin]
    assert {(state.state, state.replan_count) for state in at_goal} == {(REACHED, 0)}
    setpoints = [d.parse() for d in log if d.key == topics.ARM_SETPOINTS.key]
    holds = [(m.stamp, m.hold) for m in setpoints if isinstance(m, Setpoints)]
    assert any(hold for stamp, hold in holds if begin < stamp < end)
    assert not any(hold for stamp, hold in holds if stamp > end + SECOND // 2)
    assert outcome.score.final_error_mm is not None
    assert outcome.score.final_error_mm < 0.5


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (
            OneAfterTheOther(silent, black, without_depth, small, Frozen()),
            ("no frame of camera", "no pixel is brighter", "no depth where", "320 x 240", "frozen"),
        ),
        (miscalibrated, ("lariat calibrate",)),
    ],
    ids=["images", "calibration"],
)
def test_the_arms_hold_within_half_a_second_and_the_run_goes_on(
    fault: Fault, words: tuple[str, ...]
) -> None:
    begin, end = 2_000_000_000, 3_900_000_000
    outcome, log = run_with(fault, begin, end, "three-cylinders", 6.0, stop_after=0.2)
    assert outcome.score.reached, outcome.reason
    seen = [d.parse() for d in log if d.key == topics.ROPE_NODES.key]
    lost = {m.lost for m in seen if isinstance(m, NodeChain) and m.lost}
    assert all(any(w in reason for reason in lost) for w in words), lost
    held = [
        d.received
        for d in log
        if d.key == topics.ARM_SETPOINTS.key
        and d.received > begin
        and isinstance(m := d.parse(), Setpoints)
        and m.hold
    ]
    # A calibration is said once a second: a wrong one may come so much later.
    late = 1.0 if fault is miscalibrated else 0.0
    assert held[0] < begin + (late + 0.6) * SECOND
    assert outcome.score.contact_time_s == 0.0
