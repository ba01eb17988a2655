"""Writer of recordings."""

from __future__ import annotations

import os
import struct
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import IO

from google.protobuf.descriptor import Descriptor, FileDescriptor
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter

from lariat.files.bounded_file import read_file
from lariat.scenario import Scenario
from lariat.scenario.scenario import MAX_NODES_FILE_SIZE
from shared.cell_description import cell_urdf
from shared.recording.layout import (
    CHUNK_SIZE,
    LIBRARY,
    METADATA_NAME,
    PROTOBUF,
    ROBOT_DESCRIPTION_SCHEMA,
    ROBOT_DESCRIPTION_TOPIC,
    SCENARIO_ATTACHMENT,
)
from shared.topics import Topic
from shared.version import MESSAGE_VERSION, RECORDING_VERSION, commit, version

FLUSH_PERIOD = 100_000_000
"""Longest log time that is lost when the writer is killed [ns]."""
MAX_CHANNELS = 4096
"""Most channels of a file; MCAP numbers 65536, and ids of publishers can be made up."""
OTHER_PUBLISHERS = "others"
"""Publisher of the messages of all publishers beyond `MAX_CHANNELS`."""


class Writer:
    """Writer of one recording."""

    def __init__(
        self,
        path: Path,
        scenario: Scenario,
        started: int,
        metadata: Mapping[str, str] | None = None,
        sync_period: int | None = None,
    ) -> None:
        """Create the file, which must not exist yet.

        Args:
            path: The file.
            scenario: Scenario of the run; its text and CSV files become attachments.
            started: Log time of the start, from which flushes are counted [ns].
            metadata: Further metadata beside the scenario's name and the versions.
            sync_period: Time between two flushes that also begin to store the file on the disk, so
                that a loss of power loses no more than that and the time that the disk takes [ns];
                None leaves that to the operating system.

        Raises:
            OSError: The file cannot be written.
        """
        self.path = path
        """The file."""
        self.messages = 0
        """Number of messages written."""
        path.parent.mkdir(parents=True, exist_ok=True)
        self._stream: IO[bytes] = path.open("xb")
        self._writer = McapWriter(
            self._stream, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD
        )
        self._channels: dict[tuple[str, str], int] = {}
        self._schemas: dict[str, int] = {}
        self._flushed = self._synced = started
        self._sync_period = sync_period or 0
        self._sync = DiskSync(self._stream.fileno(), path.parent) if sync_period else None
        self._writer.start(profile="", library=f"{LIBRARY} {version()}")
        about = {
            "scenario": scenario.name,
            "version": version(),
            "commit": commit(),
            "recording_version": str(RECORDING_VERSION),
            "message_version": str(MESSAGE_VERSION),
        }
        self._writer.add_metadata(METADATA_NAME, {**about, **(metadata or {})})
        for name, content in _files(scenario).items():
            kind = "application/toml" if name == SCENARIO_ATTACHMENT else "text/csv"
            self._writer.add_attachment(0, started, name, kind, content)
        self._write_robot_description(cell_urdf(scenario), started)
        self._stream.flush()

    @property
    def bytes(self) -> int:
        """Size of the file so far [bytes]."""
        return self._stream.tell()

    def write(
        self,
        topic: Topic,
        payload: bytes,
        publisher: str,
        sequence: int,
        log_time: int,
        publish_time: int = 0,
    ) -> None:
        """Add one message, unless its topic is one that recordings leave out.

        Log times must not decrease, but before the time `ORDERED_FROM` of the metadata.

        Args:
            topic: Topic with a concrete key.
            payload: Serialised message.
            publisher: Id of the process start that sent it.
            sequence: Number among the publisher's messages on this topic, from 0.
            log_time: Time of receipt [ns].
            publish_time: Time at which it was sent, by the publisher's clock [ns]; 0 if unknown.

        Raises:
            OSError: The disk is full or gone.
        """
        if not topic.recorded:
            return
        self._writer.add_message(
            self._channel(topic, publisher),
            log_time,
            payload,
            publish_time or log_time,
            sequence % 2**32,
        )
        self.messages += 1
        self.flush(log_time)

    def flush(self, now: int, at_once: bool = False) -> None:
        """Pass everything to the operating system, once per flush period.

        Args:
            now: Present log time [ns].
            at_once: Whether to do so before the period is over.

        Raises:
            OSError: The disk is full or gone.
        """
        if at_once or now - self._flushed >= FLUSH_PERIOD:
            self._flushed = now
            self._writer.flush()
            if self._sync and now - self._synced >= self._sync_period:
                self._synced = now
                self._sync.request()

    def close(self) -> None:
        """Write the index and close the file."""
        try:
            self._writer.finish()
            self._stream.flush()
        finally:
            try:
                if self._sync:
                    self._sync.close()
            finally:
                self._stream.close()

    def _write_robot_description(self, urdf: str, started: int) -> None:
        name, encoding, text = ROBOT_DESCRIPTION_SCHEMA
        schema = self._writer.register_schema(name, encoding, text)
        channel = self._writer.register_channel(ROBOT_DESCRIPTION_TOPIC, "cdr", schema)
        content = urdf.encode() + b"\0"
        # Little-endian CDR: its header, the string's length and the string.
        message = struct.pack("<4BI", 0, 1, 0, 0, len(content)) + content
        self._writer.add_message(channel, started, message, started)

    def _channel(self, topic: Topic, publisher: str) -> int:
        key = (topic.key, publisher)
        if key not in self._channels and len(self._channels) >= MAX_CHANNELS:
            key = (topic.key, OTHER_PUBLISHERS)
        if key not in self._channels:
            self._channels[key] = self._writer.register_channel(
                topic.key, PROTOBUF, self._schema(topic.type.DESCRIPTOR), {"publisher": key[1]}
            )
        return self._channels[key]

    def _schema(self, descriptor: Descriptor) -> int:
        name = descriptor.full_name
        if name not in self._schemas:
            content = descriptor_set(descriptor).SerializeToString(deterministic=True)
            self._schemas[name] = self._writer.register_schema(name, PROTOBUF, content)
        return self._schemas[name]


def descriptor_set(descriptor: Descriptor) -> FileDescriptorSet:
    """Return the `.proto` file of a message and all that it imports, imports first."""
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
    """Content of the scenario's TOML and CSV files by name."""
    return {
        SCENARIO_ATTACHMENT: scenario.text.encode(),
        **{
            name: read_file(scenario.folder / name, MAX_NODES_FILE_SIZE)
            for name in scenario.shape_files
        },
    }


class DiskSync:
    """Thread that has the disk store what the operating system holds of one file."""

    def __init__(self, descriptor: int, folder: Path) -> None:
        """Start the thread; the name of the file is stored first."""
        # A descriptor of its own: the last sync outlives the writer's file.
        self._descriptor = os.dup(descriptor)
        self._executor = ThreadPoolExecutor(1, thread_name_prefix="disk sync")
        self._pending: Future[None] = self._executor.submit(_sync_folder, folder)

    def request(self) -> None:
        """Begin to sync, unless the former sync is still under way.

        Raises:
            OSError: The former sync failed.
        """
        if self._pending.done():
            self._pending.result()
            self._pending = self._executor.submit(os.fdatasync, self._descriptor)

    def close(self) -> None:
        """Have the thread sync the whole file and end; the process waits for it at its exit."""
        self._executor.submit(self._finish)
        self._executor.shutdown(wait=False)

    def _finish(self) -> None:
        try:
            os.fdatasync(self._descriptor)
        finally:
            os.close(self._descriptor)


def _sync_folder(folder: Path) -> None:
    """Have the disk store the names of a folder's files, where the system can."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
