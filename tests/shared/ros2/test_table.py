"""Names, frames and qualities that a scenario gives its ROS 2 node."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from cli import ros2
from lariat.configuration import ConfigurationError, read
from lariat.scenario.sections import Ros2, Ros2Topic
from shared.ros2.outputs import outputs
from shared.ros2.table import Table
from shared.ros2.wire import Qos


def test_without_changes_it_is_the_table_of_outputs():
    assert [o.name for o in Table().outputs] == [o.name for o in outputs()]


def test_a_topic_gets_name_rate_and_quality():
    change = Ros2Topic("/seen/NAME", rate=5.0, reliable=True, depth=1)
    table = Table(Ros2(topics={"camera/NAME/depth/image_raw": change}), ("front", "rear"))
    (row,) = [o for o in table.outputs if o.name.startswith("/seen")]
    assert row.name_for("camera/rear/depth") == "/seen/rear"
    assert (row.rate, row.qos) == (5.0, Qos(reliable=True, depth=1))


def test_one_camera_needs_no_name_of_its_own_and_two_do():
    settings = Ros2(topics={"camera/NAME/depth/image_raw": Ros2Topic("/depth")})
    Table(settings, ("front",))
    with pytest.raises(ConfigurationError, match=r"front.*rear.*'/depth'"):
        Table(settings, ("front", "rear"))


def test_frames_have_the_prefix_and_the_world_its_name():
    table = Table(Ros2(world_frame="map", frame_prefix="cell/"))
    assert [table.frame(n) for n in ("world", "left/grip", "")] == ["map", "cell/left/grip", ""]
    assert table.urdf('<link name="world"/>') == '<link name="map"/>'


@pytest.mark.parametrize(
    ("topics", "words"),
    [
        ({"rope/point": {}}, "unknown topic 'rope/point'.* did you mean 'rope/points'"),
        ({"nowhere": {}}, "lariat ros2 lists them"),
        ({"start": {"depth": 3}}, "ros2.topics.start.*depth.*remove it"),
        ({"goal": {"rate": 3.0}}, "ros2.topics.goal.*rate = 3.0.*remove rate"),
        ({"goal": {"name": "a b"}}, "'a b' is no ROS 2 name; use letters"),
        ({"goal": {"name": "a/**"}}, "is no ROS 2 name"),
        ({"goal": {"depth": 0}}, "depth = 0 is out of bounds"),
        ({"goal": {"name": "/joint_states"}}, "goal and /joint_states have one name"),
    ],
)
def test_what_is_wrong_is_named_in_one_line(topics: dict, words: str):
    with pytest.raises(ConfigurationError, match=words) as caught:
        Table(read(Ros2, {"topics": topics}, "ros2"))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("table", [{"namespace": "a"}, {"world_frame": "a-b"}])
def test_names_of_frames_and_namespace_are_checked(table: dict):
    with pytest.raises(ConfigurationError, match="ros2"):
        read(Ros2, table, "ros2")


def test_the_command_prints_what_a_scenario_changes(capsys: pytest.CaptureFixture[str]):
    assert ros2.main(Path("three-cylinders"), set=("ros2.world_frame=map",)) == 0
    assert "frame map" in capsys.readouterr().out


def test_every_display_of_the_rviz_file_shows_a_topic_of_the_table_as_it_is():
    file = Path(__file__).parents[3] / "docs/guide/lariat.rviz"
    table = Table()
    rows = {o.name if o.name[0] == "/" else f"/lariat/{o.name}": o for o in table.outputs}
    rows[table.description.name] = table.description
    shown = yaml.safe_load(file.read_text())["Visualization Manager"]
    assert shown["Global Options"]["Fixed Frame"] == table.settings.world_frame
    count = 0
    for display in shown["Displays"]:
        topic = display.get("Topic") or display.get("Description Topic")
        if not topic:
            continue
        row, kind = rows[topic["Value"]], display["Class"].partition("/")[2]
        assert kind in ("RobotModel", row.type.rpartition("/")[2])
        durability = "Transient Local" if row.qos.latched else "Volatile"
        assert topic["Durability Policy"] == durability
        assert (topic["Reliability Policy"] == "Reliable") is row.qos.reliable
        count += 1
    assert count == 4
