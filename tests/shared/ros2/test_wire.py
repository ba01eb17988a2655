"""Wire of rmw_zenoh: keys, tokens, identifiers and attachments as documented, byte for byte."""

from __future__ import annotations

import pytest

from shared.ros2.wire import LATCHED, Attachment, Entity, NodeEntity, Qos

ZID = "2577bc6434e620097dc285d328136b1c"
NODE = NodeEntity(0, ZID, 0, "/lariat", "lariat")
STRING = "std_msgs::msg::dds_::String_"
HASH = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"


def test_the_key_is_that_of_a_recorded_talker():
    node = NodeEntity(0, ZID, 0, "", "talker")
    entity = Entity(node, 1, "MP", node.resolved("chatter"), "std_msgs/msg/String")
    assert entity.key == f"0/chatter/{STRING}/{HASH}"


def test_tokens_name_node_topic_type_and_quality():
    entity = Entity(NODE, 1, "MP", NODE.resolved("text"), "std_msgs/msg/String")
    assert NODE.token == f"@ros2_lv/0/{ZID}/0/0/NN/%/%lariat/lariat"
    assert (
        entity.token
        == f"@ros2_lv/0/{ZID}/0/1/MP/%/%lariat/lariat/%lariat%text/{STRING}/{HASH}/::,10:,:,:,,"
    )
    assert NodeEntity(0, ZID, 0, "", "peer").token == f"@ros2_lv/0/{ZID}/0/0/NN/%/%/peer"


@pytest.mark.parametrize(
    ("qos", "text"),
    [
        (Qos(), "::,10:,:,:,,"),
        (Qos(reliable=False), "2::,10:,:,:,,"),
        (LATCHED, ":1:,1:,:,:,,"),
    ],
)
def test_quality_leaves_defaults_out(qos: Qos, text: str):
    assert qos.encoded() == text


def test_the_identifier_is_that_of_an_independent_implementation():
    # pyzeros 0.1.0 computed it from the token.
    entity = Entity(NODE, 1, "MP", "/lariat/text", "std_msgs/msg/String")
    assert entity.gid.hex() == "3e34923fc364697ff955032ca89a15b9"


def test_attachments_have_33_bytes():
    sent = Attachment(3, 1_700_000_000_000_000_000, bytes(range(16)))
    content = sent.encoded()
    assert (len(content), content[16]) == (33, 16)
    assert Attachment.decoded(content) == sent


@pytest.mark.parametrize("content", [b"", b"\x00" * 33, b"\x00" * 32])
def test_other_attachments_are_refused(content: bytes):
    with pytest.raises(ValueError, match="attachment"):
        Attachment.decoded(content)
