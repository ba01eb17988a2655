"""Old names are read, and what an old recording holds is still known."""

from __future__ import annotations

from pathlib import Path

import pytest
from google.protobuf.descriptor import Descriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from mcap.reader import make_reader

from lariat.configuration import ConfigurationError
from lariat.scenario import load
from lariat.scenario.aliases import (
    SCENARIO_KEYS,
    TOPIC_KEYS,
    current_field_name,
    current_topic_key,
    with_current_keys,
)
from lariat.scenario.scenario import Scenario
from shared import topics

OLD_RECORDING = Path(__file__).parents[2] / "replay" / "three-cylinders.mcap"


def test_an_old_scenario_key_is_read_under_its_new_name():
    aliases = {"limits.pull": "limits.contact.force", "speed": "limits.speed", "seed": "noise.seed"}
    table = {"limits": {"pull": 20.0, "jerk": 1.0}, "speed": 0.5, "name": "a"}
    read = with_current_keys(table, aliases)
    assert read == {
        "limits": {"contact": {"force": 20.0}, "jerk": 1.0, "speed": 0.5},
        "name": "a",
    }
    assert table["limits"] == {"pull": 20.0, "jerk": 1.0}


def test_a_value_under_both_names_is_refused():
    with pytest.raises(ConfigurationError, match=r"limits\.pull is the old name of limits\.force"):
        with_current_keys(
            {"limits": {"pull": 20.0, "force": 10.0}}, {"limits.pull": "limits.force"}
        )


def test_old_topics_and_fields_have_their_new_names():
    assert current_topic_key("rope/chain", {"rope/chain": "rope/nodes"}) == "rope/nodes"
    assert current_topic_key("rope/nodes") == "rope/nodes"
    aliases = {"lariat.ArmState.pull": "force"}
    assert current_field_name("lariat.ArmState", "pull", aliases) == "force"
    assert current_field_name("lariat.NodeChain", "pull", aliases) == "pull"


def test_every_alias_leads_to_a_name_that_exists():
    for new in TOPIC_KEYS.values():
        topics.find(new)
    for new in SCENARIO_KEYS.values():
        value: object = load("rope")
        for part in new.split("."):
            value = getattr(value, part)


def test_the_messages_of_an_old_recording_have_their_fields_still():
    with OLD_RECORDING.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    kinds = {topic.type.DESCRIPTOR.full_name: topic.type.DESCRIPTOR for topic in topics.TOPICS}
    own = [s for s in summary.schemas.values() if s.name.startswith("lariat.")]
    assert len(own) > 10
    for schema in own:
        pool = DescriptorPool()
        for file in FileDescriptorSet.FromString(schema.data).file:
            pool.Add(file)
        assert_holds(kinds[schema.name], pool.FindMessageTypeByName(schema.name))
    for channel in summary.channels.values():
        topics.find(current_topic_key(channel.topic))


def assert_holds(new: Descriptor, old: Descriptor) -> None:
    for field in old.fields:
        same = new.fields_by_number[field.number]
        assert same.name == current_field_name(old.full_name, field.name)
        assert (same.type, same.is_repeated) == (field.type, field.is_repeated)
        if field.message_type is not None and field.message_type.full_name.startswith("lariat."):
            assert_holds(same.message_type, field.message_type)


def test_an_old_scenario_is_read_as_the_present_one():
    old = Path(__file__).parent / "old" / "version-1.toml"
    assert isinstance(load(old), Scenario)
    assert load(old).version == 1
