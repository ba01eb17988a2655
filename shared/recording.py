"""Recordings: MCAP files that hold everything a cell said, and the scenario it ran.

A file holds one channel for each topic and publisher, the protobuf descriptors of every message
(so that it opens in Foxglove, Rerun and whatever else reads MCAP), the scenario with the CSV files
it names, and the version of Lariat. Messages stand in the order of their log time, which is the
time of their receipt. What was written before the last flush survives any death of the writer.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from google.protobuf.descriptor import Descriptor, FileDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap import records
from mcap.exceptions import McapError
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from zstandard import ZstdError

from shared import topics
from shared.aliases import current_topic_key
from shared.messages import Parameters
from shared.messages.parameters import fill_typed_fields
from shared.scenario import Scenario, parse
from shared.topics import Topic
from shared.version import MESSAGE_VERSION, RECORDING_VERSION, commit, version

CHUNK_SIZE = 256 * 1024
"""Uncompressed bytes after which a chunk is written."""
FLUSH_PERIOD = 1_000_000_000
"""Most that a killed writer loses [ns of log time]."""
SCENARIO = "scenario.toml"
"""Attachment that holds the scenario's text; the CSV files it names lie beside it."""
LARGEST_RECORD = 1 << 30
"""A longer one is taken for damage [bytes]."""

KNOWN_VERSIONS = {"recording_version": RECORDING_VERSION, "message_version": MESSAGE_VERSION}
"""Newest versions that are read, by their key in the metadata; a file without one is older."""

DAMAGE = (McapError, ZstdError, struct.error, ValueError, EOFError, RuntimeError, MemoryError)
"""What reading a cut or overwritten file raises."""


@dataclass(frozen=True)
class Entry:
    """One recorded message."""

    key: str
    """Of its topic."""
    schema: str
    """Full name of its message."""
    payload: bytes
    publisher: str
    """Id of the process start that sent it."""
    sequence: int
    """Its number among the publisher's messages on this topic, from 0."""
    log_time: int
    """When it was received [ns]."""

    @property
    def topic(self) -> Topic:
        """The row of the topic table.

        Raises:
            KeyError: This version of Lariat has no such topic.
        """
        return topics.find(self.key)

    def parse(self) -> Any:
        """The message."""
        message = self.topic.type.FromString(self.payload)
        if isinstance(message, Parameters):
            fill_typed_fields(message)
        return message


class Writer:
    """Writes one recording."""

    def __init__(
        self,
        path: Path,
        scenario: Scenario,
        started: int,
        metadata: Mapping[str, str] | None = None,
    ) -> None:
        """Opens the file, which must not exist yet.

        Args:
            path: The file.
            scenario: What is being run; its text and files are kept inside.
            started: Log time from which flushes are counted [ns].
            metadata: More to keep beside name, version and commit.

        Raises:
            OSError: The file cannot be written.
        """
        self.path = path
        self.messages = 0
        """Written so far."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._stream: IO[bytes] = path.open("xb")
        self._writer = McapWriter(
            self._stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD
        )
        self._channels: dict[tuple[str, str], int] = {}
        self._schemas: dict[str, int] = {}
        self._flushed = self._latest = started
        self._writer.start(profile="", library=f"lariat {version()}")
        about = {
            "scenario": scenario.name,
            "version": version(),
            "commit": commit(),
            "recording_version": str(RECORDING_VERSION),
            "message_version": str(MESSAGE_VERSION),
        }
        self._writer.add_metadata("lariat", {**about, **(metadata or {})})
        for name, content in _files(scenario).items():
            kind = "application/toml" if name == SCENARIO else "text/csv"
            self._writer.add_attachment(0, started, name, kind, content)
        self._stream.flush()

    @property
    def bytes(self) -> int:
        """Written to the file so far."""
        return self._stream.tell()

    def write(
        self, topic: Topic, payload: bytes, publisher: str, sequence: int, log_time: int
    ) -> None:
        """Adds one message.

        Raises:
            OSError: The disk is full or gone.
        """
        # Two clocks that meet in one recorder may disagree by a little; the file stays in order.
        self._latest = max(self._latest, log_time)
        self._writer.add_message(
            self._channel(topic, publisher), self._latest, payload, self._latest, sequence
        )
        self.messages += 1
        self.flush(self._latest)

    def flush(self, now: int) -> None:
        """Hands everything to the system when the last time is a second ago."""
        if now - self._flushed >= FLUSH_PERIOD:
            self._flushed = now
            self._writer.flush()

    def close(self) -> None:
        """Ends the file with its index."""
        try:
            self._writer.finish()
        finally:
            self._stream.close()

    def _channel(self, topic: Topic, publisher: str) -> int:
        key = (topic.key, publisher)
        if key not in self._channels:
            self._channels[key] = self._writer.register_channel(
                topic.key, "protobuf", self._schema(topic.type.DESCRIPTOR), {"publisher": publisher}
            )
        return self._channels[key]

    def _schema(self, descriptor: Descriptor) -> int:
        name = descriptor.full_name
        if name not in self._schemas:
            content = descriptor_set(descriptor).SerializeToString(deterministic=True)
            self._schemas[name] = self._writer.register_schema(name, "protobuf", content)
        return self._schemas[name]


def descriptor_set(descriptor: Descriptor) -> FileDescriptorSet:
    """The file of a message with all that it imports, imports first."""
    seen: dict[str, FileDescriptor] = {}

    def visit(file: FileDescriptor) -> None:
        if file.name not in seen:
            for dependency in file.dependencies:
                visit(dependency)
            seen[file.name] = file

    visit(descriptor.file)
    answer = FileDescriptorSet()
    for file in seen.values():
        file.CopyToProto(answer.file.add())
    return answer


def _files(scenario: Scenario) -> dict[str, bytes]:
    shapes = [scenario.start, scenario.goal, *(e.goal for e in scenario.events if e.goal)]
    names = dict.fromkeys(shape.nodes for shape in shapes if shape.nodes)
    return {
        SCENARIO: scenario.text.encode(),
        **{name: (scenario.folder / name).read_bytes() for name in names},
    }


@dataclass
class Recording:
    """A file being read, whole or cut."""

    path: Path
    metadata: dict[str, str] = field(default_factory=dict)
    """Scenario's name, version, commit and what the writer added."""
    files: dict[str, bytes] = field(default_factory=dict)
    """The scenario's text and the CSV files it names."""
    damage: str = ""
    """What is wrong with the file, known after all messages were read; empty when it is whole."""

    @classmethod
    def open(cls, path: Path | str) -> Recording:
        """A recording whose head has been read.

        Raises:
            ValueError: The file is missing, no MCAP file, or of a newer version.
        """
        recording = cls(Path(path))
        for record in recording._records():
            if isinstance(record, records.Metadata) and record.name == "lariat":
                recording.metadata = dict(record.metadata)
                recording._check_version()
            elif isinstance(record, records.Attachment):
                recording.files[record.name] = record.data
            elif isinstance(record, records.Message | records.DataEnd):
                break
        return recording

    def _check_version(self) -> None:
        for key, known in KNOWN_VERSIONS.items():
            text = self.metadata.get(key, "0")
            if not text.isdecimal() or int(text) > known:
                raise ValueError(
                    f"{self.path} has {key.replace('_', ' ')} {text}, this Lariat reads up to "
                    f"{known}; update it"
                )

    def messages(self, keys: Iterable[str] | None = None) -> Iterator[Entry]:
        """All readable messages, or those of some topics, in the order of their log time."""
        wanted = None if keys is None else set(keys)
        schemas: dict[int, records.Schema] = {}
        channels: dict[int, records.Channel] = {}
        for record in self._records():
            if isinstance(record, records.Schema):
                schemas[record.id] = record
            elif isinstance(record, records.Channel):
                channels[record.id] = record
            elif isinstance(record, records.Message):
                channel = channels.get(record.channel_id)
                # Its channel went with a damaged chunk.
                if channel is None or channel.schema_id not in schemas:
                    continue
                key = current_topic_key(channel.topic)
                if wanted is None or key in wanted:
                    yield Entry(
                        key,
                        schemas[channel.schema_id].name,
                        record.data,
                        channel.metadata.get("publisher", ""),
                        record.sequence,
                        record.log_time,
                    )

    def scenario(self, folder: Path) -> Scenario:
        """The scenario that was run; its files are laid into `folder`.

        Raises:
            ValueError: The file holds none, or one that this version does not accept.
        """
        if SCENARIO not in self.files:
            raise ValueError(f"{self.path} holds no scenario; it was not recorded by Lariat")
        for name, content in self.files.items():
            if Path(name).is_absolute() or ".." in Path(name).parts:
                raise ValueError(f"{self.path} holds a file named {name!r}, outside of its folder")
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
        text = self.files[SCENARIO].decode()
        return parse(text, folder, source=f"the scenario in {self.path}")

    def _records(self) -> Iterator[records.McapRecord]:
        """Every record up to the end or the cut; chunks are opened, broken ones left out."""
        try:
            stream = self.path.open("rb")
        except OSError as error:
            raise ValueError(f"cannot read recording {self.path}: {error}") from error
        with stream:
            reader = StreamReader(stream, emit_chunks=True, record_size_limit=LARGEST_RECORD)
            position = 0
            source = iter(reader.records)
            while True:
                try:
                    record = next(source, None)
                except DAMAGE as error:
                    if position == 0:
                        raise ValueError(f"{self.path} is no MCAP file: {error}") from error
                    self.damage = f"ends after {position} bytes of whole records"
                    return
                if record is None:
                    return
                if isinstance(record, records.Chunk):
                    try:
                        inner = breakup_chunk(record, validate_crc=True)
                    except DAMAGE as error:
                        self.damage = f"a chunk before byte {stream.tell()} is broken: {error}"
                        inner = []
                    yield from inner
                else:
                    yield record
                position = stream.tell()


def copy_readable(source: Path, target: Path) -> tuple[int, str]:
    """Writes all that is readable of a recording to a new one with an index.

    Returns:
        The number of messages, and what was wrong with the source.
    """
    recording = Recording(source)
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    count = 0
    with target.open("xb") as stream:
        writer = McapWriter(stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)
        writer.start(profile="", library=f"lariat {version()}")
        for r in recording._records():
            match r:
                case records.Schema() if r.id not in schemas:
                    schemas[r.id] = writer.register_schema(r.name, r.encoding, r.data)
                case records.Channel() if r.id not in channels and r.schema_id in schemas:
                    channels[r.id] = writer.register_channel(
                        r.topic, r.message_encoding, schemas[r.schema_id], dict(r.metadata)
                    )
                case records.Message() if r.channel_id in channels:
                    writer.add_message(
                        channels[r.channel_id], r.log_time, r.data, r.publish_time, r.sequence
                    )
                    count += 1
                case records.Attachment():
                    writer.add_attachment(r.create_time, r.log_time, r.name, r.media_type, r.data)
                case records.Metadata():
                    writer.add_metadata(r.name, dict(r.metadata))
                case _:
                    pass
        writer.finish()
    return count, recording.damage
