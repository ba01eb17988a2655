"""Gateway service: scenes that are no scenes, and other gateways and writers."""

from __future__ import annotations

from pathlib import Path

import pytest

from lariat.safety.guard.scene_guard import SceneGuard
from lariat.scenario import SIDES, load
from lariat.scenario.settings import load_with
from lariat.trajectory import SECOND
from services.robot_gateway.service import (
    REACTION_TIME,
    GatewayOptions,
    RobotGatewayService,
    build,
)
from shared import topics
from shared.messages import (
    ArmCommand,
    ArmSetpoints,
    ArmStates,
    Obstacle,
    ObstacleMotion,
    Scene,
    SceneMotion,
    Setpoints,
)
from shared.runtime.service import Inbox, Received
from shared.topics import Topic

FOLDER = Path(__file__).parents[3] / "scenarios"
SCENARIO, FIXED_END = load(FOLDER / "three-cylinders.toml"), load(FOLDER / "fixed-end.toml")
NAN = float("nan")
START = 1_000_000_000


@pytest.fixture
def gateway() -> RobotGatewayService:
    return build(SCENARIO, "gateway-0")


def step_with(gateway: RobotGatewayService, scene: Scene) -> set[str]:
    """Names of the obstacles that the gateway keeps away from after a scene."""
    received = Received(scene, "stranger", 0, 0)
    key = topics.SCENE_STATE.key
    list(gateway.step(Inbox({key: received}, {key: [received]}), 1_000_000_000))
    return {o.name for o in gateway.cell.follower.constraints.collision.scene.obstacles}


def test_empty_scene_keeps_the_scenarios_bodies(gateway: RobotGatewayService) -> None:
    assert step_with(gateway, Scene(revision=99)) == {"table", "low", "middle", "high"}


@pytest.mark.parametrize(
    "obstacle",
    [
        Obstacle(name="far", shape="sphere", position=[NAN, 9.0, 9.0], radius=0.1),
        Obstacle(name="far", shape="torus", position=[9.0, 9.0, 9.0]),
        Obstacle(name="far", shape="sphere", position=[9.0], radius=0.1),
    ],
    ids=["not finite", "unknown shape", "wrong length"],
)
def test_scene_with_garbage_is_refused_and_logged(
    gateway: RobotGatewayService, obstacle: Obstacle, caplog: pytest.LogCaptureFixture
) -> None:
    names = step_with(gateway, Scene(revision=99, obstacles=[obstacle]))
    assert names == {"table", "low", "middle", "high"}
    assert "refused scene/state: " in caplog.text


def setpoints(sequence: int, count: int, dt: int = 20_000_000, hold: bool = False) -> Received:
    """Setpoints of a writer that stays where it is."""
    starts = SCENARIO.grips(SCENARIO.start)
    arms = [
        ArmSetpoints(
            arm=side,
            positions=count * start.position.tolist(),
            orientations=count * start.orientation.tolist(),
        )
        for side, start in zip(SIDES, starts, strict=True)
    ]
    message = Setpoints(session="writer", sequence=sequence, t0=START, dt=dt, arms=arms, hold=hold)
    return Received(message, "controller-0", sequence, START)


def step_with_setpoints(gateway: RobotGatewayService, *arrived: Received) -> ArmStates:
    for tick in range(8, 0, -1):  # The cell arms itself.
        list(gateway.step(Inbox({}, {}), START - tick * 8_000_000))
    ((_, state),) = gateway.step(Inbox({}, {topics.ARM_SETPOINTS.key: arrived}), START)
    assert isinstance(state, ArmStates)
    return state


@pytest.mark.parametrize("action", [ArmCommand.HOLD, ArmCommand.ARM, ArmCommand.RESUME])
def test_a_message_of_the_topic_of_holds_holds_whatever_it_asks(
    gateway: RobotGatewayService, action: ArmCommand.Action
) -> None:
    state = step_with_setpoints(gateway, setpoints(1, 40))
    assert state.mode == ArmStates.MOVING
    command = ArmCommand(id="h", action=action, boot=state.boot, answers=state.stamp)
    arrived = Inbox({}, {topics.ARM_HOLD.key: [Received(command, "ros2-0", 1, START)]})
    ((_, held),) = gateway.step(arrived, START + 8_000_000)
    assert (held.mode, held.last_command) == (ArmStates.HOLDING, "h")
    assert held.reason.startswith("held by a ROS 2 node")
    ((_, later),) = gateway.step(arrived, START + 16_000_000)
    assert (later.mode, later.may_move) == (ArmStates.HOLDING, False)


@pytest.mark.parametrize(("count", "dt"), [(2000, 2_000_000), (41, 10_000_000), (16, 200_000_000)])
def test_chunk_that_takes_too_long_to_check_is_refused(
    gateway: RobotGatewayService, count: int, dt: int
) -> None:
    state = step_with_setpoints(gateway, setpoints(1, count, dt))
    assert state.refused_sequence == 1
    assert "finite" in state.chunk_refusal


def test_longest_chunk_is_followed(gateway: RobotGatewayService) -> None:
    assert step_with_setpoints(gateway, setpoints(1, 40)).refused_sequence == 0


def test_only_the_newest_chunk_of_a_tick_is_checked(
    gateway: RobotGatewayService, monkeypatch: pytest.MonkeyPatch
) -> None:
    checked = []
    check = gateway.cell.follower.check
    monkeypatch.setattr(
        gateway.cell.follower,
        "check",
        lambda chunk, now, offset: checked.append(chunk) or check(chunk, now, offset),
    )
    state = step_with_setpoints(gateway, *(setpoints(k, 20) for k in range(512)))
    list(gateway.step(Inbox({}, {}), START + 8_000_000))
    assert len(checked) == 1
    assert state.sequence == 511


def test_forged_chunk_of_the_writers_session_does_not_hide_the_real_one(
    gateway: RobotGatewayService,
) -> None:
    forged = setpoints(40, 20)
    for arm in forged.message.arms:
        arm.positions[0] += 0.5
    assert step_with_setpoints(gateway, setpoints(1, 20), forged).refused_sequence == 40
    arrived = [setpoints(2, 20), forged]
    ((_, state),) = gateway.step(Inbox({}, {topics.ARM_SETPOINTS.key: arrived}), START + 8_000_000)
    assert isinstance(state, ArmStates)
    assert (state.sequence, state.mode) == (2, ArmStates.MOVING)


def test_strangers_chunks_do_not_hide_that_of_the_writer(gateway: RobotGatewayService) -> None:
    step_with_setpoints(gateway, setpoints(1, 20))
    strangers = [setpoints(k, 20) for k in range(8)]
    for k, item in enumerate(strangers):
        item.message.session = f"stranger-{k}"
    arrived = [setpoints(2, 20), *strangers]
    ((_, state),) = gateway.step(Inbox({}, {topics.ARM_SETPOINTS.key: arrived}), START + 8_000_000)
    assert isinstance(state, ArmStates)
    assert (state.sequence, state.mode) == (2, ArmStates.MOVING)


def test_writer_whose_clock_is_an_hour_behind_is_followed_after_its_holds(
    gateway: RobotGatewayService,
) -> None:
    behind = setpoints(2, 20)
    behind.message.t0 -= 3600 * SECOND
    assert step_with_setpoints(gateway, setpoints(1, 0, hold=True), behind).sequence == 2


def test_hold_counts_beside_newer_chunks(gateway: RobotGatewayService) -> None:
    state = step_with_setpoints(gateway, setpoints(1, 0, hold=True), setpoints(0, 20))
    assert state.sequence == 1


class Speaker:
    """Steps the gateway every 8 ms with the messages of one tick."""

    def __init__(self, gateway: RobotGatewayService) -> None:
        self.gateway = gateway
        self.now = SECOND
        self.state = ArmStates()
        self.tick()

    def tick(self, *messages: tuple[Topic, object]) -> ArmStates:
        self.now += SECOND // 125
        arrived: dict[str, list[Received]] = {}
        for topic, message in messages:
            item = Received(message, "someone", 0, self.now)
            arrived.setdefault(topic.key, []).append(item)
        inbox = Inbox({key: items[-1] for key, items in arrived.items()}, arrived)
        (publication,) = self.gateway.step(inbox, self.now)
        assert isinstance(publication.message, ArmStates)
        self.state = publication.message
        return self.state

    def command(self, action: ArmCommand.Action, **changes: object) -> str:
        """Answer of the gateway to a person who saw the newest state."""
        shown = {
            "id": f"command-{self.now}",
            "boot": self.state.boot,
            "answers": self.state.stamp,
            "session": self.state.next_session,
            "action": action,
        }
        return self.tick((topics.ARM_COMMAND, ArmCommand(**{**shown, **changes}))).refusal


@pytest.fixture
def speaker(gateway: RobotGatewayService) -> Speaker:
    return Speaker(gateway)


def test_second_gateway_stops_the_cell_until_it_is_gone_and_a_person_goes_on(
    speaker: Speaker,
) -> None:
    assert speaker.tick().may_move, "a cell without real arms arms itself"
    other = (topics.ARM_STATE, ArmStates(boot="gateway-1"))
    state = speaker.tick(other)
    assert (state.mode, state.cause) == (ArmStates.HOLDING, "second_gateway")
    assert "gateway-1" in state.reason
    assert "gateway-1 speaks" in speaker.command(ArmCommand.ACKNOWLEDGE)
    speaker.command(ArmCommand.DISARM)
    assert "gateway-1 speaks" in speaker.command(ArmCommand.ARM)
    for _ in range(130):
        state = speaker.tick()
    assert "gateway-1" not in state.reason
    assert speaker.command(ArmCommand.ARM) == ""
    assert speaker.state.may_move


def test_cell_does_not_arm_itself_beside_another_gateway(gateway: RobotGatewayService) -> None:
    other = Received(ArmStates(boot="gateway-1"), "gateway-1", 0, SECOND)
    inbox = Inbox({}, {topics.ARM_STATE.key: [other]})
    for tick in range(8):
        ((_, state),) = gateway.step(inbox, SECOND + tick * 8_000_000)
        assert isinstance(state, ArmStates)
        assert state.mode == ArmStates.DISARMED


def test_own_state_is_no_second_gateway(speaker: Speaker) -> None:
    assert speaker.tick((topics.ARM_STATE, speaker.state)).may_move


def hold(session: str, sequence: int) -> tuple[Topic, Setpoints]:
    return topics.ARM_SETPOINTS, Setpoints(session=session, sequence=sequence, hold=True)


def test_cell_is_not_armed_while_two_writers_speak(speaker: Speaker) -> None:
    speaker.command(ArmCommand.DISARM)
    speaker.tick(hold("a", 1), hold("b", 1))
    assert speaker.state.next_session == ""
    assert "a and b speak at once" in speaker.state.reason
    assert "a and b speak at once" in speaker.command(ArmCommand.ARM)
    for k in range(70):
        speaker.tick(hold("a", 2 + k))
    assert speaker.state.next_session == "a"
    assert "names the writer 'b'" in speaker.command(ArmCommand.ARM, session="b")
    assert speaker.command(ArmCommand.ARM) == ""


def test_stranger_neither_replaces_the_writer_nor_reports_refusals_to_it(speaker: Speaker) -> None:
    speaker.tick(hold("a", 1))
    for k in range(20):
        speaker.tick(hold("a", 2 + k), hold("stranger", 2**62), hold("a", 2**62))
    state = speaker.state
    assert (state.session, state.sequence, state.refused_sequence) == ("a", 21, 0)
    assert state.may_move
    assert "stranger" in state.reason


def test_hold_is_confirmed_after_a_chunk_of_anybody_was_refused(speaker: Speaker) -> None:
    speaker.tick(hold("a", 830))
    assert "sequence 1 after 830" in speaker.tick(hold("a", 1)).chunk_refusal
    assert speaker.command(ArmCommand.HOLD) == ""
    assert speaker.state.mode == ArmStates.HOLDING


def test_acknowledgement_accepts_only_the_writer_that_it_names(speaker: Speaker) -> None:
    speaker.tick(hold("a", 1))
    speaker.command(ArmCommand.HOLD)
    for _ in range(70):
        speaker.tick()
    speaker.tick(hold("b", 1))
    assert speaker.state.next_session == "b"
    assert "names the writer 'a'" in speaker.command(ArmCommand.ACKNOWLEDGE, session="a")
    assert speaker.state.needs_acknowledgement
    assert speaker.command(ArmCommand.ACKNOWLEDGE) == ""
    assert speaker.state.needs_resume
    assert speaker.command(ArmCommand.RESUME) == ""
    assert speaker.tick(hold("b", 2)).session == "b"


def test_refusals_of_one_writer_are_none_of_the_next(speaker: Speaker) -> None:
    def refused(session: str, sequence: int) -> tuple[Topic, Setpoints]:
        chunk = setpoints(sequence, 41).message
        chunk.session, chunk.t0 = session, speaker.now
        return topics.ARM_SETPOINTS, chunk

    speaker.tick(hold("a", 299))
    state = speaker.tick(refused("a", 300))
    assert (state.sequence, state.refused_sequence) == (299, 300)
    speaker.command(ArmCommand.HOLD)
    for _ in range(70):
        speaker.tick()
    speaker.tick(hold("b", 1))
    speaker.command(ArmCommand.ACKNOWLEDGE)
    state = speaker.tick()
    assert (state.session, state.refused_sequence) == ("b", 0)
    speaker.command(ArmCommand.RESUME)
    state = speaker.tick(hold("b", 2))
    assert (state.sequence, state.refused_sequence, state.chunk_refusal) == (2, 0, "")
    state = speaker.tick(refused("b", 3))
    assert (state.sequence, state.refused_sequence) == (2, 3)


def test_command_answers_a_state_by_the_gateways_clock_alone(speaker: Speaker) -> None:
    speaker.command(ArmCommand.HOLD)
    speaker.tick()
    wrong_clock = {"stamp": 2**61}
    assert speaker.command(ArmCommand.ACKNOWLEDGE, **wrong_clock) == ""
    # A resumption that answers the state before the acknowledgement comes too early.
    before = speaker.state.stamp - 2 * SECOND // 125
    assert "has changed" in speaker.command(ArmCommand.RESUME, answers=before)
    assert speaker.state.needs_resume
    for _ in range(130):
        speaker.tick()
    assert "s old" in speaker.command(ArmCommand.RESUME, answers=speaker.now - 2 * SECOND)
    assert speaker.command(ArmCommand.RESUME) == ""


def test_command_that_arrives_twice_is_carried_out_once(speaker: Speaker) -> None:
    speaker.command(ArmCommand.DISARM)
    assert speaker.command(ArmCommand.ARM, id="arm-1") == ""
    assert speaker.command(ArmCommand.ARM, id="arm-1") == ""
    assert "armed already" in speaker.command(ArmCommand.ARM, id="arm-2")


def test_states_name_the_scenario_and_the_hosts_of_real_arms(gateway: RobotGatewayService) -> None:
    ((_, state),) = gateway.step(Inbox({}, {}), START)
    assert state.scenario == SCENARIO.name
    assert [arm.address for arm in state.arms] == ["", ""]
    real = RobotGatewayService(
        gateway.cell, SceneGuard([]), "lab", addresses={"right": "192.168.5.1"}
    )
    ((_, state),) = real.step(Inbox({}, {}), START + 8_000_000)
    assert state.scenario == "lab"
    assert {arm.arm: arm.address for arm in state.arms} == {"left": "", "right": "192.168.5.1"}


def places_with(gateway: RobotGatewayService, motion: SceneMotion, seconds: float) -> list[float]:
    """Places along x of the sphere that the gateway keeps away from, after motions are known."""
    key, received = topics.SCENE_MOTION.key, Received(motion, "stranger", 0, 0)
    list(gateway.step(Inbox({key: received}, {key: [received]}), round(seconds * SECOND)))
    return places(gateway)


def places(gateway: RobotGatewayService) -> list[float]:
    solids = gateway.cell.follower.constraints.collision.scene.solids
    return [o.position[0] for o in solids if o.name == "cart"]


def test_moving_obstacle_is_kept_away_from_where_it_is_and_where_it_will_be(
    gateway: RobotGatewayService,
) -> None:
    cart = Obstacle(name="cart", shape="sphere", position=[0.9, 9.0, 0.0], radius=0.1)
    step_with(gateway, Scene(revision=99, obstacles=[cart]))
    motion = ObstacleMotion(
        name="cart",
        position=[0.9, 9.0, 0.0],
        velocity=[-0.2, 0.0, 0.0],
        times=[2 * SECOND, 6 * SECOND],
        waypoints=[0.9, 9.0, 0.0, 0.1, 9.0, 0.0],
    )
    message = SceneMotion(run_started=SECOND, motions=[motion])
    ahead = -0.2 * REACTION_TIME
    assert places_with(gateway, message, 4.0) == pytest.approx([0.5, 0.5 + ahead / 2, 0.5 + ahead])
    # No further message is needed for the obstacle to be followed.
    list(gateway.step(Inbox({}, {}), 5 * SECOND))
    assert places(gateway) == pytest.approx([0.3, 0.3 + ahead / 2, 0.3 + ahead])
    assert places_with(gateway, SceneMotion(), 7.0) == [0.9]


def test_motion_of_the_table_is_refused(gateway: RobotGatewayService) -> None:
    table = ObstacleMotion(name="table", times=[0, SECOND], waypoints=[0.0] * 5 + [-0.4])
    places_with(gateway, SceneMotion(motions=[table]), 5.0)
    (half_space,) = gateway.cell.follower.constraints.collision.scene.half_spaces
    assert half_space.position == (0.0, 0.0, 0.0)


def test_command_that_cannot_be_read_is_refused_and_the_next_one_is_taken(
    gateway: RobotGatewayService,
) -> None:
    unknown = Received(ArmCommand(id="a", action=99), "stranger", 0, START)  # pyright: ignore
    hold = Received(ArmCommand(id="b", action=ArmCommand.HOLD), "page", 0, START)
    arrived = {topics.ARM_COMMAND.key: [unknown, hold]}
    (published,) = gateway.step(Inbox({}, arrived), START)
    assert gateway.door.refused == 1
    assert published.message.last_command == "b"


@pytest.mark.parametrize("address", ["", "127.0.0.1"])
def test_whatever_has_an_address_can_reach_hardware(address: str) -> None:
    overrides = [f"ends.{s}.address={address}" for s in SIDES if FIXED_END.end(s).driver == "cr5"]
    scenario = load_with(FOLDER / "fixed-end.toml", overrides)
    gateway = build(scenario, "g", GatewayOptions("127.0.0.31", "127.0.0.32"))
    ((_, state),) = gateway.step(Inbox({}, {}), START)
    gateway.cell.close()
    assert state.reaches_hardware is not scenario.simulated
    assert state.reaches_hardware is bool(address)
    assert gateway.cell.arm_automatically is not bool(address)
