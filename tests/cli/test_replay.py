"""Replay: a service that is what it was says what it said, and one that is not is found out."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli import replay
from lariat.configuration import ConfigurationError
from shared import topics
from shared.messages import ArmSetpoints, NodeChain, Parameters, Setpoints, XpbdParameters
from shared.recording import Recording, Writer
from stack import services
from stack.replay.comparison import field_differences
from stack.replay.recorded_service import RecordedService
from stack.replay.trace_replay import replay_start
from stack.simulation import closed_loop
from tests.stack import small_cell


@pytest.fixture
def scenario(tmp_path: Path):
    return small_cell.scenario(tmp_path)


@pytest.fixture
def path(tmp_path: Path, scenario) -> Path:
    path = tmp_path / "run.mcap"
    closed_loop.run(scenario, path, members=small_cell.members(scenario))
    return path


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch):
    """Puts the small controller in the place of the real one."""
    speeds = {"speed": small_cell.SPEED}

    def build(name, scenario, session, first_step):
        assert name == "controller"
        return small_cell.Straight(scenario, speeds["speed"])

    monkeypatch.setattr(services, "build", build)
    return speeds


def test_the_same_service_has_the_same_outputs(path: Path, scenario):
    result = replay_start(
        RecordedService(Recording.open(path), "controller"),
        small_cell.Straight(scenario, small_cell.SPEED),
        "controller-0",
    )
    assert result.same
    assert result.notes == []
    assert result.steps > 140
    assert result.compared["task/state"] > 140
    assert result.compared["arm/setpoints"] > 140


def test_another_service_is_found_out_where_it_differs_first(path: Path, small, capsys):
    small["speed"] = 1.001 * small_cell.SPEED
    assert replay.main(path, service=("controller",), json=True) == 1
    answer = json.loads(capsys.readouterr().out)
    assert not answer["same"]
    (service,) = answer["services"]
    assert set(service["differing"]) == {"arm/setpoints"}
    first = service["first_differences"][0]
    # 2.002 mm a step instead of 2 mm: out of tolerance (0.1 um) from the first step on.
    assert first["field"].startswith("arms[0].positions")
    assert abs(float(first["recorded"]) - float(first["replayed"])) == pytest.approx(2e-6, rel=0.2)
    assert 0.0 < first["time_s"] < 1.0


def test_update_puts_what_is_said_now_in_the_place_of_what_was_recorded(path: Path, small, capsys):
    small["speed"] = 0.5 * small_cell.SPEED
    before = [(e.key, e.publisher, e.sequence, e.log_time) for e in Recording(path).messages()]
    assert replay.main(path, service=("controller",), update=True) == 0
    assert replay.main(path, service=("controller",)) == 0
    small["speed"] = small_cell.SPEED
    assert replay.main(path, service=("controller",)) == 1
    after = [(e.key, e.publisher, e.sequence, e.log_time) for e in Recording(path).messages()]
    assert sorted(before) == sorted(after)
    shown = capsys.readouterr().out
    assert "300 differences" in shown
    assert "arms[0]" in shown


def test_a_cut_recording_is_replayed_up_to_the_cut(path: Path, small, capsys):
    content = path.read_bytes()
    path.write_bytes(content[: 2 * len(content) // 3])
    assert replay.main(path, service=("controller",), json=True) == 0
    captured = capsys.readouterr()
    (service,) = json.loads(captured.out)["services"]
    assert service["steps"] > 20
    assert 0.0 < service["step_ms"]["p50"] <= service["step_ms"]["p99"]
    assert "lariat repair" in captured.err


@pytest.mark.parametrize("time", ["simulated", "live"])
def test_a_recording_that_begins_later_than_the_service_says_so(
    path: Path, tmp_path, scenario, time: str
):
    late = tmp_path / "late.mcap"
    entries = [e for e in Recording(path).messages() if e.log_time >= 1_500_000_000]
    writer = Writer(late, scenario, entries[0].log_time, {"time": time})
    for e in entries:
        writer.write(e.topic, e.payload, e.publisher, e.sequence, e.log_time)
    writer.close()
    result = replay_start(
        RecordedService(Recording.open(late), "controller"),
        small_cell.Straight(scenario, small_cell.SPEED),
        "controller-0",
    )
    assert any("0.5 s" in note and "step 25" in note for note in result.notes)
    assert any("inputs of controller were sent before" in note for note in result.notes)
    assert {d.kind for d in result.differences} <= {"field", "lacks"}


def test_a_missing_message_is_a_difference(path: Path, scenario):
    class Silent(small_cell.Straight):
        def step(self, inbox, now):
            for publication in super().step(inbox, now):
                if publication.topic.key != "arm/setpoints":
                    yield publication

    recorded = RecordedService(Recording.open(path), "controller")
    result = replay_start(recorded, Silent(scenario, small_cell.SPEED), "controller-0")
    assert {(d.topic, d.replayed) for d in result.differences} == {("arm/setpoints", "nothing")}


def test_bad_input_is_refused_by_name(path: Path, tmp_path: Path, small):
    with pytest.raises(ConfigurationError, match="'controller'"):
        replay.main(path, service=("contoller",))
    with pytest.raises(ConfigurationError, match="trace/planner"):
        replay.main(path, service=("planner",))
    with pytest.raises(ConfigurationError, match=r"none\.mcap"):
        replay.main(tmp_path / "none.mcap")


def test_fields_are_compared_within_the_tolerance_of_their_topic_only():
    topic = topics.ROPE_NODES
    a = NodeChain(stamp=1, positions=[1.0, 2.0, 3.0])
    assert not list(field_differences(topic, a, NodeChain(stamp=1, positions=[1.0, 2.0, 3 + 5e-5])))
    (worst,) = field_differences(topic, a, NodeChain(stamp=1, positions=[1.0, 2.1, 3.01]))
    assert worst[0] == "positions[1]"
    assert worst[3] == pytest.approx(0.1)
    (stamp,) = field_differences(topic, a, NodeChain(stamp=2, positions=[1.0, 2.0, 3.0]))
    assert stamp == ("stamp", "1", "2", 1)
    (count,) = field_differences(topic, a, NodeChain(stamp=1, positions=[1.0]))
    assert count[:3] == ("positions", "3 values", "1 values")
    nan = NodeChain(positions=[float("nan")])
    assert not list(field_differences(topic, nan, nan))
    assert list(field_differences(topic, nan, NodeChain(positions=[1.0])))


def test_tolerances_reach_into_nested_messages_but_not_to_their_names():
    topic = topics.ARM_SETPOINTS
    a = Setpoints(arms=[ArmSetpoints(arm="left", positions=[0.1])])
    near = Setpoints(arms=[ArmSetpoints(arm="left", positions=[0.1 + 5e-8])])
    other = Setpoints(arms=[ArmSetpoints(arm="right", positions=[0.1])])
    assert not list(field_differences(topic, a, near))
    assert [d[0] for d in field_differences(topic, a, other)] == ["arms[0].arm"]
    p = Parameters(xpbd=XpbdParameters(mass=1.0))
    q = Parameters(xpbd=XpbdParameters(mass=1.1))
    assert [d[0] for d in field_differences(topics.CONTROLLER_PARAMETERS, p, q)] == ["xpbd.mass"]
