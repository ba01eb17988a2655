from __future__ import annotations

from dashboard.outbox import VALIDITY, Complaint, Outbox
from lariat.geometry.poses import IDENTITY, Pose
from shared import topics
from shared.messages import ArmCommand, ArmStates, Obstacle, Scene, SceneRequest, TaskRequest
from shared.messages import TaskState as Task
from shared.service import SECOND

NOW = 50 * SECOND


def started(outbox: Outbox) -> str:
    request = outbox.task(TaskRequest.START, "Start")
    list(outbox.take(NOW))
    return request


def test_requests_leave_once_stamped_and_with_ids_of_their_own() -> None:
    outbox = Outbox("dashboard-ab")
    outbox.task(TaskRequest.START, "Start")
    outbox.scene(SceneRequest.REMOVE, Obstacle(name="low"), "Remove low")
    outbox.arm(ArmCommand.HOLD, "boot-7", "Hold")
    sent = list(outbox.take(NOW))
    assert [p.topic for p in sent] == [
        topics.TASK_REQUEST,
        topics.SCENE_REQUEST,
        topics.ARM_COMMAND,
    ]
    assert {p.message.stamp for p in sent} == {NOW}
    assert len({p.message.id for p in sent}) == 3
    command = sent[2].message
    assert (command.boot, command.expires) == ("boot-7", NOW + VALIDITY)
    assert list(outbox.take(NOW)) == []


def test_refusal_is_said_once_in_the_owners_words() -> None:
    outbox = Outbox("dashboard-ab")
    state = Task(last_request=started(outbox), refusal="the arms are disarmed")
    assert outbox.complaints(NOW, state, None, []) == [
        Complaint("Start: refused", "the arms are disarmed")
    ]
    assert outbox.complaints(NOW + 9 * SECOND, state, None, []) == []


def test_accepted_request_is_answered_even_when_a_later_one_hides_its_id() -> None:
    outbox = Outbox("dashboard-ab")
    started(outbox)
    last = started(outbox)
    assert outbox.complaints(NOW, Task(last_request=last), None, []) == []
    assert outbox.complaints(NOW + 9 * SECOND, None, None, []) == []


def test_silence_is_said_once_after_three_seconds() -> None:
    outbox = Outbox("dashboard-ab")
    started(outbox)
    assert outbox.complaints(NOW + 2 * SECOND, None, None, []) == []
    (complaint,) = outbox.complaints(NOW + 4 * SECOND, None, None, [])
    assert complaint.title == "Start: no answer"
    assert "controller" in complaint.reason
    assert outbox.complaints(NOW + 5 * SECOND, None, None, []) == []


def test_answers_to_others_and_of_other_owners_are_not_ours() -> None:
    outbox = Outbox("dashboard-ab")
    request = started(outbox)
    others = [ArmStates(last_command=request, refusal="no")]
    scene = Scene(last_request="lariat-77-1", refusal="no")
    assert outbox.complaints(NOW, Task(last_request="lariat-1", refusal="no"), scene, others) == []


def test_drafts_wait_for_no_answer() -> None:
    outbox = Outbox("dashboard-ab")
    pose = Pose(IDENTITY[:3], IDENTITY)
    outbox.draft(pose, pose)
    assert [p.topic for p in outbox.take(NOW)] == [topics.TASK_GOAL_DRAFT]
    assert outbox.complaints(NOW + 9 * SECOND, None, None, []) == []
