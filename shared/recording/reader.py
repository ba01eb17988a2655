"""Reader of recordings, whole or damaged."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

from google.protobuf.message import DecodeError
from mcap import records as mcap_records

from lariat.configuration import ConfigurationError, reason_of
from lariat.files.bounded_file import path_inside
from lariat.files.file_kind import kind_of
from lariat.scenario import Scenario, parse
from lariat.suggestion import did_you_mean_file
from shared import topics
from shared.door import Door
from shared.recording.chunks import MAX_RECORD_SIZE, PlainReader, records_of
from shared.recording.layout import (
    LIBRARY,
    METADATA_NAME,
    ORDERED_FROM,
    PROTOBUF,
    SCENARIO_ATTACHMENT,
)
from shared.topics import Topic
from shared.version import MESSAGE_VERSION, RECORDING_VERSION

MAX_UNORDERED_SIZE = 2**28
"""Size of the messages at a file's begin that are put in order, each counted with `ENTRY_SIZE`;
beyond it they are yielded as they are stored [bytes]."""
ENTRY_SIZE = 2**9
"""Memory that a message takes beside its payload [bytes]."""
MAX_FILES_SIZE = 2**26
"""Largest size of the scenario and its CSV files in a recording together [bytes]."""
READABLE_VERSIONS = {"recording_version": RECORDING_VERSION, "message_version": MESSAGE_VERSION}
"""Newest versions that can be read, by their key in the metadata; an older file may lack a key."""


@dataclass(frozen=True)
class Entry:
    """Recorded message, not decoded."""

    key: str
    """Concrete key of its topic."""
    schema: str
    """Full name of its protobuf type."""
    payload: bytes
    """Serialised message."""
    publisher: str
    """Id of the process start that sent it."""
    sequence: int
    """Number among the publisher's messages on this topic, from 0."""
    log_time: int
    """Time of receipt [ns]."""
    version: int = MESSAGE_VERSION
    """Version of the message set that it was written with; 0 if the file has none."""
    publish_time: int = 0
    """Time at which it was sent, by the publisher's clock [ns]."""

    @property
    def topic(self) -> Topic:
        """Topic of the message.

        Raises:
            KeyError: This version of Lariat has no such topic.
        """
        return topics.find(self.key)

    def parse(self) -> Any:
        """Return the decoded message.

        Raises:
            KeyError: This version of Lariat has no such topic.
            ConfigurationError: The bytes are none.
        """
        try:
            return self.topic.type.FromString(self.payload)
        except DecodeError as error:
            raise ConfigurationError(f"a message of {self.key} does not decode: {error}") from error


@dataclass
class Recording:
    """Recording that is read from a file, whole or damaged."""

    path: Path
    """The file."""
    metadata: dict[str, str] = field(default_factory=dict)
    """Name of the scenario, versions, commit, and what the writer added."""
    files: dict[str, bytes] = field(default_factory=dict)
    """Scenario's TOML and CSV files by name."""
    door: Door = field(default_factory=Door)
    """Refuses messages that cannot be read."""
    damage: str = ""
    """Damage of the file, known after all messages were read; empty if it is whole."""

    @classmethod
    def open(cls, path: Path | str) -> Recording:
        """Open a recording and read its metadata and files.

        Raises:
            ConfigurationError: The file cannot be read, is not MCAP, or has a newer version.
        """
        recording = cls(Path(path))
        for record in recording.records():
            if isinstance(record, mcap_records.Metadata) and record.name == METADATA_NAME:
                recording.metadata = dict(record.metadata)
                recording._check_version()
            elif isinstance(record, mcap_records.Attachment):
                recording.files[record.name] = record.data
                if sum(map(len, recording.files.values())) > MAX_FILES_SIZE:
                    raise ConfigurationError(
                        f"{path} holds files of more than {MAX_FILES_SIZE / 2**20:g} MiB; a "
                        "scenario needs less"
                    )
            elif isinstance(record, mcap_records.Message | mcap_records.DataEnd):
                break
        return recording

    def _check_origin(self, library: str) -> None:
        if not library.startswith(LIBRARY):
            writer = f"by {library!r}" if library else "by a writer without a name"
            raise ConfigurationError(f"{self.path} was not recorded by Lariat, but {writer}")

    def _check_version(self) -> None:
        for key, newest in READABLE_VERSIONS.items():
            if _number(self.metadata, key) > newest:
                text = self.metadata[key][:20]
                raise ConfigurationError(
                    f"{self.path} has {key.replace('_', ' ')} {text}, this Lariat reads versions "
                    f"up to {newest}; update Lariat"
                )

    def messages(self, keys: Iterable[str] | None = None) -> Iterator[Entry]:
        """Yield all readable messages of the bus in the order of their log time.

        Args:
            keys: Concrete keys of the topics to read; by default all.

        Raises:
            ConfigurationError: The file cannot be read or is not MCAP.
        """
        stored = self._stored(None if keys is None else set(keys))
        begin: list[Entry] = []
        size = ordered_from = 0
        for ordered_from, entry in stored:
            begin.append(entry)
            size += len(entry.payload) + ENTRY_SIZE
            if entry.log_time >= ordered_from or size > MAX_UNORDERED_SIZE:
                break
        yield from sorted(begin, key=lambda entry: entry.log_time)
        del begin
        yield from (entry for _, entry in stored)

    def _stored(self, keys: set[str] | None) -> Iterator[tuple[int, Entry]]:
        """Yield messages as they are stored, each with the time from which they are in order."""
        version = ordered_from = 0
        schemas: dict[int, mcap_records.Schema] = {}
        channels: dict[int, mcap_records.Channel] = {}
        for record in self.records():
            if isinstance(record, mcap_records.Schema):
                schemas[record.id] = record
            elif isinstance(record, mcap_records.Channel):
                channels[record.id] = record
            elif isinstance(record, mcap_records.Metadata) and record.name == METADATA_NAME:
                version = _number(record.metadata, "message_version")
                ordered_from = _number(record.metadata, ORDERED_FROM)
            elif isinstance(record, mcap_records.Message):
                channel = channels.get(record.channel_id)
                # The channel may have been in a damaged chunk.
                if channel is None or channel.schema_id not in schemas:
                    continue
                if channel.message_encoding != PROTOBUF:
                    continue
                key = channel.topic
                if keys is None or key in keys:
                    entry = Entry(
                        key,
                        schemas[channel.schema_id].name,
                        record.data,
                        channel.metadata.get("publisher", ""),
                        record.sequence,
                        record.log_time,
                        version,
                        record.publish_time,
                    )
                    yield ordered_from, entry

    def decoded(self, keys: Iterable[str] | None = None) -> Iterator[tuple[Entry, Any]]:
        """Yield the messages of known topics with their content; those without are left out.

        Args:
            keys: Concrete keys of the topics to read; by default all.

        Raises:
            ConfigurationError: The file cannot be read or is not MCAP.
        """
        for entry in self.messages(keys):
            try:
                _ = entry.topic
            except KeyError:
                continue  # A topic of another version.
            with self.door.guard(f"{entry.key} in {self.path}"):
                yield entry, entry.parse()

    def scenario(self, folder: Path) -> Scenario:
        """Return the recorded scenario.

        Raises:
            ConfigurationError: There is no scenario, or this version does not accept it.
        """
        if SCENARIO_ATTACHMENT not in self.files:
            raise ConfigurationError(
                f"{self.path} holds no scenario; it was not recorded by Lariat"
            )
        for name, content in self.files.items():
            try:
                path = path_inside(folder, name)
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_bytes(content)
            except (OSError, ValueError) as error:
                raise ConfigurationError(
                    f"{self.path} has an unusable file {name!r}: {error}"
                ) from error
        text = self.files[SCENARIO_ATTACHMENT].decode()
        return parse(text, folder, source=f"the scenario in {self.path}")

    def start(self) -> int:
        """Return the time of the first message [ns].

        Raises:
            ConfigurationError: There is none that can be read.
        """
        first = next(Recording(self.path).messages(), None)
        if first is None:
            raise ConfigurationError(f"{self.path} holds no message that can be read")
        return first.log_time

    def records(self) -> Iterator[mcap_records.McapRecord]:
        """Yield all records but indexes up to the end or the damage that ends the file.

        Records in chunks are yielded one by one; damaged chunks are skipped.

        Raises:
            ConfigurationError: The file cannot be read, is not MCAP, or is another recorder's.
        """
        if self.path.exists() and not self.path.is_file():
            raise ConfigurationError(f"cannot read recording {self.path}: not a regular file")
        try:
            stream = self.path.open("rb")
        except OSError as error:
            hint = did_you_mean_file(self.path) if isinstance(error, FileNotFoundError) else ""
            raise ConfigurationError(
                f"cannot read recording {self.path}: {error.strerror or error}{hint and f';{hint}'}"
            ) from error
        with stream:
            bounded: Any = _BoundedStream(stream)
            reader = PlainReader(bounded, emit_chunks=True, record_size_limit=MAX_RECORD_SIZE)
            position = 0
            source = iter(reader.records)
            while True:
                try:
                    record = next(source, None)
                except Exception as error:
                    # The libraries raise any of a dozen kinds for a cut or overwritten file.
                    if position == 0:
                        raise ConfigurationError(
                            f"{self.path} is {kind_of(self.path)}, not an MCAP file"
                        ) from error
                    self.damage = f"ends after {position} bytes of whole records"
                    return
                if record is None:
                    return
                if isinstance(record, mcap_records.Chunk):
                    try:
                        inner = records_of(record)
                    except Exception as error:
                        reason = reason_of(error)
                        self.damage = f"a chunk before byte {stream.tell()} is damaged: {reason}"
                        inner = []
                    yield from inner
                else:
                    if isinstance(record, mcap_records.Header):
                        self._check_origin(record.library)
                    yield record
                position = stream.tell()


def _number(metadata: dict[str, str], key: str) -> int:
    """Number of the metadata, 0 where it is missing, and 2^63 where there is no number."""
    text = metadata.get(key, "0")
    return int(text) if text.isdecimal() and len(text) < 20 else 2**63


class _BoundedStream:
    """File of which no more is read than it holds, whatever the length of a record claims."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._size = os.fstat(stream.fileno()).st_size

    def read(self, length: int) -> bytes:
        """Return the next bytes.

        Raises:
            EOFError: The rest of the file is shorter.
        """
        if length > self._size - self._stream.tell():
            raise EOFError(f"a record claims {length} bytes, more than the rest of the file")
        return self._stream.read(length)
