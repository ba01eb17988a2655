"""Repair of damaged recordings."""

from __future__ import annotations

from pathlib import Path

from mcap import records
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from shared.recording.layout import CHUNK_SIZE, LIBRARY, ROBOT_DESCRIPTION_TOPIC
from shared.recording.reader import Recording
from shared.version import version


def copy_readable(source: Path, target: Path) -> tuple[int, str]:
    """Copy all readable records of a recording to a new one with an index."""
    recording = Recording(source)
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    described: set[int] = set()
    count = 0
    with target.open("xb") as stream:
        writer = McapWriter(stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)
        writer.start(profile="", library=f"{LIBRARY} {version()}")
        for r in recording.records():
            match r:
                case records.Schema() if r.id not in schemas:
                    schemas[r.id] = writer.register_schema(r.name, r.encoding, r.data)
                case records.Channel() if r.id not in channels and r.schema_id in schemas:
                    channels[r.id] = writer.register_channel(
                        r.topic, r.message_encoding, schemas[r.schema_id], dict(r.metadata)
                    )
                    described |= {r.id} if r.topic == ROBOT_DESCRIPTION_TOPIC else set()
                case records.Message() if r.channel_id in channels:
                    writer.add_message(
                        channels[r.channel_id], r.log_time, r.data, r.publish_time, r.sequence
                    )
                    count += r.channel_id not in described
                case records.Attachment():
                    writer.add_attachment(r.create_time, r.log_time, r.name, r.media_type, r.data)
                case records.Metadata():
                    writer.add_metadata(r.name, dict(r.metadata))
                case _:
                    pass
        writer.finish()
    return count, recording.damage
