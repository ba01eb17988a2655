"""Topics that the page shows, and ages of their newest messages."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared import topics
from shared.runtime.service import Inbox
from shared.topics import Topic

SERVICES = (
    "sim",
    "perception",
    "planner",
    "controller",
    "robot_gateway",
    "recorder",
    "dashboard",
)
"""Services whose health is shown, in the order of their rows."""

HEALTHS = {name: topics.HEALTH.at(name) for name in SERVICES}
"""Health of each service."""
LOGS = tuple(topics.LOG.at(name) for name in SERVICES)
"""Logs of the services."""
TASK_STATE = replace(topics.TASK_STATE, buffering="every")
"""States of the task, all of them: a plot that leaves some out does not show the run's extremes."""
READS: tuple[Topic, ...] = (
    topics.ROPE_NODES,
    topics.ROPE_OTHERS,
    topics.ROPE_TRUTH,
    topics.SCENE_STATE,
    topics.SCENE_MOTION,
    TASK_STATE,
    topics.TASK_GOAL_PREVIEW,
    topics.CONTROLLER_PATH,
    topics.CONTROLLER_PLAN,
    topics.CONTROLLER_PARAMETERS,
    topics.ARM_STATE,
    topics.RUN_RESULT,
    topics.RUN_RECORD,
    topics.RUN_LIST,
    topics.RUN_CURVES,
    topics.RUN_MOTION,
    topics.RUN_PICTURE,
    topics.RUN_VIDEO,
    topics.GOAL_LIST,
    topics.STACK_STATE,
    topics.CAMPAIGN_STATE,
    *HEALTHS.values(),
    *LOGS,
)
"""Topics that the dashboard reads, beside those of the cameras."""


def reads(scenario: Scenario) -> tuple[Topic, ...]:
    """Return the topics that the dashboard of a cell reads."""
    names = [camera.name for camera in scenario.camera_setups]
    kinds = (topics.CAMERA_COLOR, topics.CAMERA_CALIBRATION)
    return (*(topic.at(name) for name in names for topic in kinds), *READS)


STALE_AGE = 2.5
"""Age above which a message that is published at least once a second counts as missing [s]."""


def latest_with_age(inbox: Inbox, topic: Topic, now: int) -> tuple[Any, float]:
    """Return the newest message of a topic and its age [s]; None and 0 before the first."""
    item = inbox.latest(topic)
    return (None, 0.0) if item is None else (item.message, (now - item.received) / SECOND)


LOOP = ("sim", "perception", "planner", "controller", "robot_gateway")
"""Services without which no run can begin."""


def unheard(inbox: Inbox) -> list[str]:
    """Return the services of the loop that have never been heard of."""
    return [name for name in LOOP if inbox.latest(HEALTHS[name]) is None]


SOURCES = (
    (topics.TASK_STATE, "controller"),
    (topics.ARM_STATE, "robot gateway"),
    (topics.ROPE_NODES, "perception"),
)
"""States without which the page shows the past, and the services that publish them."""


def silence(inbox: Inbox, now: int) -> str:
    """Return which services have fallen silent, and for how long; empty when all are heard."""
    ages = {name: latest_with_age(inbox, topic, now)[1] for topic, name in SOURCES}
    silent = [name for name, age in ages.items() if age > STALE_AGE]
    if not silent:
        return ""
    names = " and ".join(filter(None, [", ".join(silent[:-1]), silent[-1]]))
    verb = "is" if len(silent) == 1 else "are"
    return f"The {names} {verb} silent for {min(ages[name] for name in silent):.0f} s"
