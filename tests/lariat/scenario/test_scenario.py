"""Scenarios are read completely or refused in one line."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.geometry import poses
from lariat.scenario import Scenario, load, parse
from lariat.scenario.entries import obstacle_entry
from lariat.scenario.rod_properties import rod_properties
from shared.messages import Scene, obstacle_message, scene_obstacles

FOLDER = Path(__file__).parents[3] / "scenarios"
SMALLEST = """
name = "smallest"
[rope]
length = 0.45
diameter = 0.008
[start]
line = [[-0.2, 0.0, 0.3], [0.2, 0.0, 0.3]]
[goal]
line = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]
"""


def changed(old: str, new: str, folder: Path = FOLDER) -> object:
    assert old in SMALLEST
    return parse(SMALLEST.replace(old, new), folder)


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.toml")), ids=lambda p: p.stem)
def test_every_shipped_scenario_is_valid(path: Path) -> None:
    scenario = load(path)
    assert scenario.name == path.stem
    assert scenario.text == path.read_text()


def test_defaults_of_the_smallest_scenario() -> None:
    scenario = parse(SMALLEST, FOLDER)
    assert scenario.plant.model == "rod"
    assert scenario.plant_rope == replace(scenario.rope, node_count=118)
    assert [scenario.end(s).driver for s in ("left", "right")] == ["ideal", "ideal"]
    assert not scenario.end("left").rotates
    assert [b.name for b in scenario.bodies] == ["table"]
    assert scenario.sensing.source == "truth"
    assert scenario.control.method == "gauss_newton"
    assert scenario.control.planner
    assert not scenario.control.adapt
    assert (scenario.run.time_limit, scenario.run.tolerance) == (10.0, 0.003)


def test_removed_limit_of_recordings_names_the_option_that_replaces_it() -> None:
    with pytest.raises(ConfigurationError, match=r"recording\.keep.*--keep GB"):
        parse(f"{SMALLEST}[recording]\nkeep = 0.01\n", FOLDER)


def test_grips_point_along_the_rope_from_left_to_right() -> None:
    scenario = parse(SMALLEST, FOLDER)
    z = np.array([0.0, 0.0, 1.0])
    for shape in (scenario.start, scenario.goal):
        left, right = scenario.grips(shape)
        along = poses.normalized(right.position - left.position)
        for grip in (left, right):
            np.testing.assert_allclose(poses.rotate(grip.orientation, z), along, atol=1e-12)
        # Parallel frames: no twist.
        np.testing.assert_allclose(left.orientation, right.orientation, atol=1e-12)


def test_nodes_of_another_count_are_resampled_by_arc_length(tmp_path: Path) -> None:
    angle = np.linspace(0.0, 1.0, 101)
    radius = 0.45
    chain = np.stack([radius * np.sin(angle), 0 * angle, 0.2 + radius * np.cos(angle)], axis=1)
    np.savetxt(tmp_path / "goal.csv", chain, delimiter=",", header="x, y, z")
    scenario = changed(
        "line = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]", "nodes = 'goal.csv'", tmp_path
    )
    nodes = scenario.nodes(scenario.goal)  # pyright: ignore[reportAttributeAccessIssue]
    assert nodes.shape == (40, 3)
    np.testing.assert_allclose(nodes[[0, -1]], chain[[0, -1]], atol=1e-12)
    edges = np.linalg.norm(np.diff(nodes, axis=0), axis=1)
    assert np.ptp(edges) < 1e-4 * edges.mean()


@pytest.mark.parametrize(
    ("part", "line"),
    [
        ([0.1, 0.3], None),
        ([0.3, 0.1], "part = [0.3, 0.1] ends before it begins"),
        ([0.1, 0.35], "goal.nodes is 0.2000 m long, goal.part 0.2500 m"),
        ([0.3, 0.5], "goal.part = [0.3, 0.5] m is more than 0.9 of a rope of 0.45 m, or beyond"),
    ],
)
def test_nodes_of_a_part_leave_the_grips_open(
    tmp_path: Path, part: list[float], line: str | None
) -> None:
    shape = np.stack([np.linspace(0.0, 0.2, 50), np.zeros(50), np.full(50, 0.2)], axis=1)
    np.savetxt(tmp_path / "part.csv", shape, delimiter=",")
    old = "line = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]"
    if line is not None:
        with pytest.raises(ConfigurationError, match=re.escape(line)):
            changed(old, f"nodes = 'part.csv'\npart = {part}", tmp_path)
        return
    scenario = changed(old, f"nodes = 'part.csv'\npart = {part}", tmp_path)
    assert isinstance(scenario, Scenario)
    assert scenario.nodes(scenario.goal) is None
    own = scenario.part_nodes(scenario.goal)
    assert own is not None
    np.testing.assert_allclose(own, shape, atol=1e-12)
    for wanted, given in zip(
        scenario.grips(scenario.goal), scenario.grips(scenario.start), strict=True
    ):
        np.testing.assert_array_equal(wanted.position, given.position)


def test_part_of_a_rope_at_rest_keeps_its_grips() -> None:
    line = "line = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]"
    scenario = changed(line, f"{line}\npart = [0.1, 0.2]")
    assert isinstance(scenario, Scenario)
    assert scenario.goal.part == (0.1, 0.2)
    assert scenario.part_nodes(scenario.goal) is None
    left, right = scenario.grips(scenario.goal)
    assert left.position.tolist() == [-0.1, 0.1, 0.3]
    assert right.position.tolist() == [0.25, 0.1, 0.3]


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        (
            "length = 0.45",
            "lenght = 0.45",
            "unknown key 'lenght' in [rope]; did you mean 'length'?",
        ),
        ("length = 0.45", "", "rope.length is missing; it has no default"),
        (
            "length = 0.45",
            "length = -0.45",
            "rope.length = -0.45 m is out of bounds; give a value between 0.02 and 20 m",
        ),
        (
            "diameter = 0.008",
            "diameter = 0.008\nyoungs_modulus = 3.0",
            "rope.youngs_modulus = 3.0 Pa is out of bounds; give a value between 1000 and 3e+11 Pa",
        ),
        (
            "[0.25, 0.1, 0.3]",
            "[0.45, 0.1, 0.3]",
            "goal: its ends are 0.5500 m apart, out of reach of a rope of 0.45 m "
            "(limit 0.99 of it); bring them closer",
        ),
        (
            "[goal]",
            "[[obstacles]]\nname = 'ball'\nshape = 'sphere'\nradius = 0.05\n"
            "position = [-0.2, 0.03, 0.3]\n[goal]",
            "start lies inside obstacle 'ball' (24.0 mm deep with the rope's radius); "
            "move the shape or the obstacle",
        ),
        (
            "[goal]",
            "[[obstacles]]\nshape = 'sphere'\nposition = [0.0, 0.0, 0.1]\n[goal]",
            "[obstacles[0]] a sphere needs radius",
        ),
        (
            "[0.25, 0.1, 0.3]",
            "[0.25, 0.1, 1.3]",
            "goal: its ends are",
        ),
        (
            "[goal]",
            "[ends.left]\ndriver = 'fixed'\n[goal]",
            "ends.left is fixed, but the goal has that end 141.4 mm away from the start; "
            "give both the same end or choose another driver",
        ),
        (
            "[goal]",
            "[limits]\nworkspace = [[-0.1, -1.0, 0.0], [1.0, 1.0, 1.0]]\n[goal]",
            "start: the left grip at [-0.2, 0.0, 0.3] m is outside limits.workspace",
        ),
        ("line = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]", "nodes = 'none.csv'", "cannot read nodes"),
        (
            "line = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]",
            "line = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]\npart = [0.0, 0.44]",
            "goal.part = [0.0, 0.44] m is more than 0.9 of a rope of 0.45 m, or beyond its end; "
            "without part, the whole rope counts",
        ),
        ('name = "smallest"', "name = ", "scenario: not valid TOML"),
    ],
)
def test_an_error_names_the_key_the_value_and_the_way_out(old: str, new: str, line: str) -> None:
    with pytest.raises(ConfigurationError, match=f"^{re.escape(line)}") as refusal:
        changed(old, new)
    assert "\n" not in str(refusal.value)


def test_a_newer_version_is_refused_before_its_unknown_keys():
    with pytest.raises(ConfigurationError, match="version = 2"):
        parse("version = 2\nunheard_of = 3\n", Path())


def test_a_version_that_is_no_number_is_refused(tmp_path: Path):
    with pytest.raises(ConfigurationError, match=r"version = '1'.*int"):
        parse("version = '1'\n" + SMALLEST, tmp_path)


@pytest.mark.parametrize("name", ["/dev/zero", "../goal.csv", "pipe", "large.csv"])
def test_nodes_come_from_a_small_regular_file_beside_the_scenario(tmp_path: Path, name: str):
    os.mkfifo(tmp_path / "pipe")
    with (tmp_path / "large.csv").open("wb") as stream:
        stream.truncate(1 << 40)
    with pytest.raises(ConfigurationError, match=r"nodes.*(outside|regular|larger)"):
        changed("line = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]", f"nodes = '{name}'", tmp_path)


def test_a_scenario_is_a_small_regular_file(tmp_path: Path):
    with (tmp_path / "large.toml").open("wb") as stream:
        stream.truncate(1 << 40)
    with pytest.raises(ConfigurationError, match="larger than 1 MiB"):
        load(tmp_path / "large.toml")
    with pytest.raises(ConfigurationError, match="/dev/zero"):
        load("/dev/zero")


def test_a_text_that_nests_without_end_is_refused():
    with pytest.raises(ConfigurationError, match="a key has 5001 parts"):
        parse("a" + ".b" * 5000 + " = 1", Path())


@pytest.mark.parametrize("name", ["x" * 101, "", "a\\nb", "\\u001b[2J"])
def test_name_that_no_file_or_terminal_takes_is_refused(name: str) -> None:
    with pytest.raises(ConfigurationError, match="name"):
        changed('name = "smallest"', f'name = "{name}"')


def test_text_has_a_bounded_length() -> None:
    with pytest.raises(ConfigurationError, match="has 1001 characters"):
        changed('name = "smallest"', f'name = "s"\ndescription = "{"x" * 1001}"')


def test_every_shape_is_among_the_files(tmp_path: Path) -> None:
    goal = '[[next_goals]]\nnodes = "g.csv"\n[[events]]\ntime = 1.0\ngoal = {nodes = "h.csv"}\n'
    for name in ("g.csv", "h.csv"):
        (tmp_path / name).write_text("-0.2,0,0.3\n0,0,0.2\n0.2,0,0.3\n")
    text = SMALLEST.replace("length = 0.45", "length = 0.447214")
    assert parse(text + goal, tmp_path).shape_files == ("g.csv", "h.csv")


def test_too_many_obstacles_are_refused(tmp_path: Path):
    obstacle = "[[obstacles]]\nshape = 'sphere'\nposition = [0.0, 0.9, 0.9]\nradius = 0.01\n"
    with pytest.raises(ConfigurationError, match=r"301 obstacles.*256"):
        parse(SMALLEST + 300 * obstacle, tmp_path)


def test_too_many_goals_are_refused() -> None:
    goal = "[[next_goals]]\nline = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]\n"
    with pytest.raises(ConfigurationError, match=r"201 next_goals.*200"):
        parse(SMALLEST + 201 * goal, FOLDER)


def test_every_node_of_the_controller_is_one_of_the_finer_plant() -> None:
    scenario = changed("diameter = 0.008", "diameter = 0.008\nnode_count = 30")
    assert scenario.plant_rope.node_count == 88  # pyright: ignore[reportAttributeAccessIssue]
    assert (88 - 1) % (30 - 1) == 0


GRIPPED = """
[ends.left]
grip_length = 0.02
[ends.right]
grip_length = 0.02
"""


def test_believed_and_true_rope_are_without_what_lies_in_the_grippers() -> None:
    scenario = parse(SMALLEST + GRIPPED, FOLDER)
    assert scenario.rope.length == pytest.approx(0.41)
    assert scenario.plant_rope.length == pytest.approx(0.41)
    longer = parse(SMALLEST + GRIPPED + "[plant.rope]\nlength = 0.46\n", FOLDER)
    assert longer.rope.length == pytest.approx(0.41)
    assert longer.plant_rope.length == pytest.approx(0.42)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[ends.left]\ngrip_length = -0.01\n", "ends.left.grip_length = -0.01 m is out of bounds"),
        ("[ends.left]\ngrip_length = 0.3\n", "0.3 m is more than 0.5 of rope.length = 0.45 m"),
        (
            "[plant.rope]\nlength = 0.05\n[ends.left]\ngrip_length = 0.04\n",
            "0.04 m is more than 0.5 of plant.rope.length = 0.05 m",
        ),
        ("[plant.grips.left]\noffset = [0.1, 0, 0]\n", r"plant.grips.left.offset\[0\] = 0.1 m is"),
        ("[plant.grips.right]\nrotation = [0, 0, 90]\n", r"plant.grips.right.rotation\[2\] = 90"),
    ],
)
def test_grips_that_cannot_hold_the_rope_are_refused_by_name(text: str, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        parse(SMALLEST + text, FOLDER)


def test_a_live_plant_is_as_fine_as_real_time_allows_unless_its_nodes_are_given() -> None:
    scenario = parse(SMALLEST + '[plant]\nmodel = "mujoco"\n', FOLDER)
    assert scenario.plant_rope.node_count == 118
    assert scenario.live.plant_rope.node_count == 79
    given = parse(SMALLEST + "[plant.rope]\nnode_count = 200\n", FOLDER)
    assert given.live.plant_rope.node_count == 200


def test_a_line_that_is_not_utf8_is_named(tmp_path: Path) -> None:
    path = tmp_path / "latin.toml"
    path.write_bytes('name = "a"\ndescription = "Schnür"\n'.encode("latin-1"))
    with pytest.raises(ConfigurationError, match=r"line 2.*UTF-8"):
        load(path)


def test_friction_of_a_support_reaches_the_model_by_the_bus_and_by_the_file() -> None:
    table = '[[obstacles]]\nshape = "sphere"\nradius = 0.05\nposition = [0, 0, 0.1]\n'
    support = table + "support = true\nfriction = 0.4\n"
    (body,) = [body for body in parse(SMALLEST + support, FOLDER).bodies if body.support]
    assert body.friction == 0.4
    assert scene_obstacles(Scene(obstacles=[obstacle_message(body)]))[0].friction == 0.4
    assert obstacle_entry(body)["friction"] == 0.4
    with pytest.raises(ConfigurationError, match=r"friction = 0\.4.*support"):
        parse(SMALLEST + support.replace("support = true\n", ""), FOLDER)


def test_a_cable_yields_as_its_data_sheet_says() -> None:
    rope = SMALLEST.replace("diameter = 0.008\n", "diameter = 0.008\nbending_radius = 0.05\n")
    scenario = parse(rope + "[plant.rope]\nyield_curvature = 30.0\nhardening = 0.1\n", FOLDER)
    assert rod_properties(scenario.rope).yield_curvature == pytest.approx(20.0)
    true = rod_properties(scenario.plant_rope)
    assert (true.yield_curvature, true.hardening) == (30.0, 0.1)
    assert len(rod_properties(parse(SMALLEST, FOLDER).rope).layers) == 0
    with pytest.raises(
        ConfigurationError, match=r"yield_curvature.*bending_radius|bending_radius.*yield_curvature"
    ):
        parse(rope.replace("bending", "yield_curvature = 10.0\nbending"), FOLDER)
    with pytest.raises(ConfigurationError, match=r"plant\.model = 'mujoco'"):
        parse(rope + '[plant]\nmodel = "mujoco"\n', FOLDER)


@pytest.mark.parametrize(
    ("old", "new", "fault"),
    [
        ('"middle", "right', '"gone", "right', "goal: the route names 'gone', which is no clip"),
        ('"left of near"', '"left of gone"', "goal: the route names the peg 'gone'"),
        ('"left of near"', '"left of low"', "goal: 'low' is a clip"),
        ("[-0.10, -0.011, 0.015]", "[-0.10, 0.35, 0.015]", "the cable 0.6700 m"),
        ('"low", "left of near", "middle"', '"middle", "left of near", "low"', "its heading"),
        ('name = "near"', 'name = "low-left"', "two obstacles have the name 'low-left'"),
        ("[goal]\n", "[goal]\nends_only = true\n", "route and ends_only exclude each other"),
        ("opening = 0.009\nheight = 0.022", "opening = 0.009\nheight = 0.002", "leg_radius"),
    ],
)
def test_a_route_that_contradicts_its_board_is_refused(old: str, new: str, fault: str):
    board = load("harness-board")
    assert board.grips(board.goal)[0].position.tolist() == list(board.goal.line[0])  # pyright: ignore
    assert old in board.text
    with pytest.raises(ConfigurationError, match=re.escape(fault)):
        parse(board.text.replace(old, new, 1), board.folder)
