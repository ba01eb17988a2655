"""A run's score against a cell whose motion is known in closed form."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest

from lariat.configuration import ConfigurationError
from lariat.scenario.settings import load_with, to_toml
from shared.recording import Recording
from stack.simulation import closed_loop
from stack.simulation.score import as_json
from tests.stack import small_cell


@pytest.fixture
def scenario(tmp_path: Path):
    return small_cell.scenario(tmp_path)


def test_the_score_is_that_of_the_known_motion(scenario):
    score = closed_loop.run(scenario, members=small_cell.members(scenario)).score
    assert score.reached
    way = 0.2 - scenario.run.tolerance
    assert score.reached_s == pytest.approx(way / small_cell.SPEED, abs=0.06)
    assert score.final_error_mm == pytest.approx(0.0, abs=0.1)
    # 0.39 m between the ends of a rope of 0.40 m.
    assert score.length_error_mm == pytest.approx(10.0, abs=1e-6)
    assert score.min_clearance_mm == pytest.approx(25.0, abs=0.05)
    assert score.contact_time_s == 0.0
    assert score.sim_s == pytest.approx(scenario.run.time_limit, abs=0.1)


def test_a_run_that_ends_away_from_the_goal_is_not_reached(scenario):
    score = closed_loop.run(scenario, members=small_cell.members(scenario, speed=0.01)).score
    assert not score.reached
    assert score.reached_s is None
    assert score.final_error_mm == pytest.approx(200.0 - 30.0, abs=2.0)


def test_the_time_in_contact_is_how_long_the_rope_touches(tmp_path: Path):
    text = small_cell.TEXT.replace("0.1, 0.36]", "0.1, 0.30]")
    scenario = small_cell.scenario(tmp_path, text)
    score = closed_loop.run(scenario, members=small_cell.members(scenario)).score
    # Within 35 mm of the post's centre, on both sides.
    assert score.contact_time_s == pytest.approx(0.07 / small_cell.SPEED, abs=0.04)
    assert score.min_clearance_mm == pytest.approx(-35.0, abs=0.1)
    lean = small_cell.scenario(tmp_path, text.replace("radius = 0.03", "radius=0.03\nsupport=true"))
    score = closed_loop.run(lean, members=small_cell.members(lean)).score
    assert score.contact_time_s == 0.0


def test_a_run_ends_when_it_is_reached_if_asked(scenario):
    outcome = closed_loop.run(
        scenario, stop_after=0.0, members=small_cell.members(scenario, speed=1.0)
    )
    assert outcome.score.reached
    assert outcome.score.sim_s < 1.0


def test_the_recording_holds_every_message_of_the_run(scenario, tmp_path: Path):
    seen = []
    path = tmp_path / "run.mcap"
    closed_loop.run(scenario, path, taps=(seen.append,), members=small_cell.members(scenario))
    entries = [e for e in Recording(path).messages() if not e.key.startswith("view/")]
    assert [
        (e.key, e.publisher, e.sequence, e.log_time, e.publish_time, e.payload) for e in entries
    ] == [(d.key, d.publisher, d.sequence, d.received, d.published, d.payload) for d in seen]
    drawings = [e.parse() for e in Recording(path).messages(["view/scene"])]
    assert len(drawings) > 40
    lines = {entity.id: entity.lines for entity in drawings[-1].entities}
    assert len(lines["rope"][0].points) == len(lines["goal"][0].points) == 5


def test_two_runs_publish_the_same_bytes(scenario):
    logs = []
    for _ in range(2):
        log = []
        closed_loop.run(scenario, taps=(log.append,), members=small_cell.members(scenario))
        logs.append(log)
    assert logs[0] == logs[1]
    assert len(logs[0]) > 500


def test_a_cell_that_never_becomes_ready_says_what_is_missing(scenario):
    rope, controller, _ = small_cell.members(scenario)
    outcome = closed_loop.run(scenario, members=(rope, controller))
    assert not outcome.score.reached
    assert "arm/state" in outcome.reason
    json.dumps(as_json(outcome.score), allow_nan=False)


def test_settings_replace_single_values_and_are_kept_as_text(tmp_path: Path):
    path = tmp_path / "s.toml"
    path.write_text(small_cell.TEXT)
    changed = load_with(
        path, ["sensing.source=camera", "obstacles.0.radius=0.02", "limits.speed = 0.25"], seed=7
    )
    assert (changed.sensing.source, changed.seed, changed.limits.speed) == ("camera", 7, 0.25)
    assert changed.obstacles[0].radius == 0.02
    assert tomllib.loads(changed.text)["obstacles"][0]["radius"] == 0.02
    table = tomllib.loads(small_cell.TEXT)
    assert tomllib.loads(to_toml(table)) == table


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("sensing.sorce=truth", "unknown key 'sorce'"),
        ("rope.length=-1", "rope.length = -1.0 m is out of bounds"),
        ("obstacles.5.radius=1", "must be a number from 0 to 0"),
        ("seed", "write --set KEY=VALUE"),
        ("rope.length.x=3", "no table"),
    ],
)
def test_a_bad_setting_is_refused_by_name(tmp_path: Path, setting: str, message: str):
    path = tmp_path / "s.toml"
    path.write_text(small_cell.TEXT)
    with pytest.raises(ConfigurationError, match=message):
        load_with(path, [setting])
