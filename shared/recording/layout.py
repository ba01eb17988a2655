"""Layout of a recording: names and sizes that its writer and its reader share."""

from __future__ import annotations

CHUNK_SIZE = 256 * 1024
"""Uncompressed size at which a chunk is written [bytes]."""
SCENARIO_ATTACHMENT = "scenario.toml"
"""Name of the attachment with the scenario's text; its CSV files are attachments as well."""
ROBOT_DESCRIPTION_TOPIC = "robot_description"
"""Topic of the file's first message, the URDF of the cell; it is no topic of the bus. ROS 2,
Foxglove and Rerun take a robot's description from a topic of this name and type."""
ROBOT_DESCRIPTION_SCHEMA = ("std_msgs/msg/String", "ros2msg", b"string data")
"""Name, encoding and text of the schema of that message."""
PROTOBUF = "protobuf"
"""Encoding of all other messages and of their schemas."""
ORDERED_FROM = "ordered_from"
"""Metadata key: log time from which messages are stored in order [ns]; before it in any order."""
METADATA_NAME = "lariat"
"""Name of the metadata record with the scenario's name and the versions."""
LIBRARY = "lariat"
"""Beginning of the name by which the head of a file names its writer."""
