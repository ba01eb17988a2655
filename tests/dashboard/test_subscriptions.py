from __future__ import annotations

from dashboard.subscriptions import silence
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmStates, NodeChain, TaskState
from shared.runtime.service import Inbox, Received


def inbox(**received: int) -> Inbox:
    messages = {
        "task": (topics.TASK_STATE, TaskState()),
        "arm": (topics.ARM_STATE, ArmStates()),
        "rope": (topics.ROPE_NODES, NodeChain()),
    }
    found = {}
    for name, second in received.items():
        topic, message = messages[name]
        found[topic.key] = Received(message, "stage", 1, second * SECOND)
    return Inbox(found, {})


def test_services_that_were_heard_and_are_not_any_more_are_named() -> None:
    now = 100 * SECOND
    assert silence(inbox(task=99, arm=99, rope=99), now) == ""
    assert silence(inbox(), now) == "", "what has not come yet is not silent"
    assert all(w in silence(inbox(task=90, arm=99), now) for w in ("controller", "10 s"))
    silent = silence(inbox(task=90, arm=80, rope=95), now)
    assert all(word in silent for word in ("controller, robot gateway and perception", "5 s"))
