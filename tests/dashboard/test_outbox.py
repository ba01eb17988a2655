from __future__ import annotations

from dashboard.outbox import Notification, Outbox
from lariat.geometry.poses import IDENTITY, Pose
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmCommand, ArmStates, Obstacle, Scene, SceneRequest, TaskRequest
from shared.messages import TaskState as Task

NOW = 50 * SECOND


def started(outbox: Outbox) -> str:
    request = outbox.request_task(TaskRequest.START, "Start")
    list(outbox.take(NOW))
    return request


def test_each_request_is_sent_once_with_a_stamp_and_an_id_of_its_own() -> None:
    outbox = Outbox("dashboard-ab")
    outbox.request_task(TaskRequest.START, "Start")
    outbox.request_scene(SceneRequest.REMOVE, Obstacle(name="low"), "Remove low")
    outbox.command_arms(ArmCommand.HOLD, ArmStates(boot="boot-7", stamp=NOW - 8), "Hold")
    sent = list(outbox.take(NOW))
    assert [p.topic for p in sent] == [
        topics.TASK_REQUEST,
        topics.SCENE_REQUEST,
        topics.ARM_COMMAND,
    ]
    assert {p.message.stamp for p in sent} == {NOW}
    assert len({p.message.id for p in sent}) == 3
    command = sent[2].message
    assert (command.boot, command.answers) == ("boot-7", NOW - 8)
    assert list(outbox.take(NOW)) == []


def test_refusal_is_reported_once_with_the_receivers_reason() -> None:
    outbox = Outbox("dashboard-ab")
    state = Task(last_request=started(outbox), refusal="the arms are disarmed")
    assert outbox.notifications(NOW, state, None, []) == [
        Notification("Start: refused", "the arms are disarmed")
    ]
    assert outbox.notifications(NOW + 9 * SECOND, state, None, []) == []


def test_accepted_request_is_answered_even_when_a_later_one_hides_its_id() -> None:
    outbox = Outbox("dashboard-ab")
    started(outbox)
    last = started(outbox)
    assert outbox.notifications(NOW, Task(last_request=last), None, []) == []
    assert outbox.notifications(NOW + 9 * SECOND, None, None, []) == []


def test_missing_answer_is_reported_once_after_three_seconds() -> None:
    outbox = Outbox("dashboard-ab")
    started(outbox)
    assert outbox.notifications(NOW + 2 * SECOND, None, None, []) == []
    (notification,) = outbox.notifications(NOW + 4 * SECOND, None, None, [])
    assert notification.title == "Start: no answer"
    assert "controller" in notification.body
    assert outbox.notifications(NOW + 5 * SECOND, None, None, []) == []


def test_answers_to_other_sessions_and_of_other_receivers_are_ignored() -> None:
    outbox = Outbox("dashboard-ab")
    request = started(outbox)
    others = [ArmStates(last_command=request, refusal="no")]
    scene = Scene(last_request="lariat-77-1", refusal="no")
    assert (
        outbox.notifications(NOW, Task(last_request="lariat-1", refusal="no"), scene, others) == []
    )


def test_missing_answer_to_a_draft_is_not_reported() -> None:
    outbox = Outbox("dashboard-ab")
    pose = Pose(IDENTITY[:3], IDENTITY)
    outbox.draft_goal(pose, pose, 0.0)
    assert [p.topic for p in outbox.take(NOW)] == [topics.TASK_GOAL_DRAFT]
    assert outbox.notifications(NOW + 9 * SECOND, None, None, []) == []
