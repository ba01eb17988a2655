"""Recording as a rosbag2 of standard ROS 2 messages, in MCAP.

Messages are the same from ROS 2 Humble to Lyrical. A header's stamp is the time
that the message describes, the bag's times are those of receipt.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer

from cli.export.drawn_messages import drawn_messages
from shared.cell_description import cell_urdf
from shared.recording import Recording
from shared.ros2.table import Table
from shared.ros2.types import STORE, encoded, ros

BAG_VERSION = 9
"""Version of the bag's metadata."""
FOREVER = QosTime(2147483647, 4294967295)
"""Time that DDS takes as infinite."""
LATCHED = Qos(
    QosHistory.KEEP_LAST,
    1,
    QosReliability.RELIABLE,
    QosDurability.TRANSIENT_LOCAL,
    FOREVER,
    FOREVER,
    QosLiveliness.AUTOMATIC,
    FOREVER,
    False,
)
"""Quality of service of topics whose last message is for those who join later."""


def write(recording: Recording, folder: Path) -> str:
    """Write the bag, a new folder; return one line about it."""
    with tempfile.TemporaryDirectory() as files:
        scenario = recording.scenario(Path(files))
        table, urdf = Table.of(scenario), cell_urdf(scenario)
    connections: dict[str, Any] = {}
    count = 0
    with Writer(folder, version=BAG_VERSION, storage_plugin=StoragePlugin.MCAP) as bag:

        def put(topic: str, message: Any, time: int, latched: bool) -> None:
            nonlocal count
            kind = message.__msgtype__
            if topic not in connections:
                qos = [LATCHED] if latched else []
                connections[topic] = bag.add_connection(
                    topic, kind, typestore=STORE, offered_qos_profiles=qos
                )
            bag.write(connections[topic], time, encoded(message))
            count += 1

        for drawn in drawn_messages(recording):
            if not count:
                message = ros(table.description.type, data=table.urdf(urdf))
                put(table.description.name, message, drawn.log_time, latched=True)
            with recording.door.guard(f"{drawn.key} in {recording.path}"):
                for output, message in table.recorded(drawn.key, drawn.message):
                    name = f"/{output.name_for(drawn.key).lstrip('/')}"
                    put(name, message, drawn.log_time, output.qos.latched)
    return f"{folder}: {count} messages on {len(connections)} topics"
