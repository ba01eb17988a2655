"""MCAP file under way: schemas, channels and messages in compressed chunks, and indexes of all.

The library's writer copies each message several times and leaves no choice of the compression.
"""

from __future__ import annotations

import struct
import zlib
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import IO

from mcap import records as mcap_records
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC
from zstandard import STRATEGY_FAST, ZstdCompressionParameters, ZstdCompressor

from shared.recording.layout import CHUNK_SIZE

COMPRESSION = "zstd"
# Noise of depth images repeats nowhere: a longer search takes a quarter more time for 1 % of size.
_PARAMETERS = ZstdCompressionParameters(
    strategy=STRATEGY_FAST, min_match=5, hash_log=14, window_log=20
)
_MESSAGE = struct.Struct("<BQHIQQ")
"""Begin of a message: opcode, length of what follows [bytes], channel, sequence number, log time
and publish time [ns]."""
_CHUNK = struct.Struct("<BQQQQII4sQ")
"""Begin of a chunk: opcode, length of what follows, first and last log time [ns], size and checksum
of the content, length of the compression's name, the name, size of the compressed content."""
_INDEX = struct.Struct("<BQHI")
"""Begin of the index of a channel's messages in a chunk: opcode, length of what follows, channel
and size of the entries [bytes]."""
_HEAD_SIZE = 9
"""Size of the opcode and the length of a record [bytes]."""
_CHECKED_FOOTER = struct.Struct("<BQQQ")
"""Part of the footer that its checksum covers: opcode, length, begins of summary and offsets."""


class McapFile:
    """Writer of one file."""

    def __init__(self, stream: IO[bytes], library: str) -> None:
        """Write the header.

        Args:
            stream: Stream at the begin of an empty file.
            library: Name and version of the program that writes.

        Raises:
            OSError: As for all that writes: the disk is full or gone.
        """
        self._stream = stream
        self._compressor = ZstdCompressor(compression_params=_PARAMETERS)
        self._schemas: list[mcap_records.Schema] = []
        self._channels: list[mcap_records.Channel] = []
        self._attachments: list[mcap_records.AttachmentIndex] = []
        self._metadata: list[mcap_records.MetadataIndex] = []
        self._chunks: list[mcap_records.ChunkIndex] = []
        self._counts: dict[int, int] = defaultdict(int)
        """Number of messages of each channel."""
        self._parts: list[bytes] = []
        """Records of the chunk under way."""
        self._size = 0
        """Size of these records [bytes]."""
        self._entries: dict[int, list[int]] = {}
        """Log time and place in the chunk of each of its messages, one after the other, by
        channel."""
        self._times: tuple[int, int] | None = None
        """First and last log time in the chunk [ns]; None as long as it holds no message."""
        stream.write(MCAP0_MAGIC)
        self._write(mcap_records.Header("", library))

    def add_metadata(self, name: str, entries: Mapping[str, str]) -> None:
        """Write texts by their names."""
        offset = self._stream.tell()
        length = self._write(mcap_records.Metadata(name=name, metadata=dict(entries)))
        self._metadata.append(mcap_records.MetadataIndex(offset, length, name))

    def add_attachment(self, file: mcap_records.Attachment) -> None:
        """Write a file that belongs to the messages."""
        offset = self._stream.tell()
        length = self._write(file)
        self._attachments.append(
            mcap_records.AttachmentIndex(
                offset,
                length,
                file.log_time,
                file.create_time,
                len(file.data),
                file.name,
                file.media_type,
            )
        )

    def register_schema(self, name: str, encoding: str, content: bytes) -> int:
        """Add the type of messages, and return its number."""
        schema = mcap_records.Schema(
            id=len(self._schemas) + 1, data=content, encoding=encoding, name=name
        )
        self._schemas.append(schema)
        self._add(_bytes_of(schema))
        return schema.id

    def register_channel(
        self, topic: str, encoding: str, schema: int, metadata: Mapping[str, str] | None = None
    ) -> int:
        """Add a channel of messages of one type, and return its number."""
        channel = mcap_records.Channel(
            len(self._channels) + 1, topic, encoding, dict(metadata or {}), schema
        )
        self._channels.append(channel)
        self._add(_bytes_of(channel))
        return channel.id

    def add_message(
        self, channel: int, log_time: int, payload: bytes, publish_time: int, sequence: int = 0
    ) -> None:
        """Add a message, and write the chunk if it is full.

        Args:
            channel: Number of its channel.
            log_time: Time of receipt [ns].
            payload: Encoded message.
            publish_time: Time of sending [ns].
            sequence: Number given by its publisher.
        """
        first, last = self._times or (log_time, log_time)
        self._times = min(first, log_time), max(last, log_time)
        self._entries.setdefault(channel, []).extend((log_time, self._size))
        self._counts[channel] += 1
        length = _MESSAGE.size - _HEAD_SIZE + len(payload)
        head = _MESSAGE.pack(Opcode.MESSAGE, length, channel, sequence, log_time, publish_time)
        self._add(head, payload)
        if self._size > CHUNK_SIZE:
            self._write_chunk()

    def flush(self) -> None:
        """Pass everything to the operating system."""
        self._write_chunk()
        self._stream.flush()

    def finish(self) -> None:
        """Write the indexes and the end of the file; the stream stays open."""
        self._write_chunk()
        self._write(mcap_records.DataEnd(0))
        begin = self._stream.tell()
        summary, offsets = RecordBuilder(), RecordBuilder()
        for opcode, group in (
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.ATTACHMENT_INDEX, self._attachments),
            (Opcode.METADATA_INDEX, self._metadata),
        ):
            first = summary.count
            for record in group:
                record.write(summary)
            mcap_records.SummaryOffset(opcode, begin + first, summary.count - first).write(offsets)
        groups = summary.end()
        content, places = groups + offsets.end(), (begin, begin + len(groups))
        footer = mcap_records.Footer(*places, 0)
        size = len(_bytes_of(footer)) - _HEAD_SIZE
        footer.summary_crc = zlib.crc32(
            _CHECKED_FOOTER.pack(Opcode.FOOTER, size, *places), zlib.crc32(content)
        )
        self._stream.write(content)
        self._write(footer)
        self._stream.write(MCAP0_MAGIC)

    def _add(self, *parts: bytes) -> None:
        self._parts += parts
        self._size += sum(map(len, parts))

    def _write(self, record: mcap_records.McapRecord) -> int:
        """Write a record outside of chunks; its size [bytes]."""
        return self._stream.write(_bytes_of(record))

    def _write_chunk(self) -> None:
        """Write the chunk under way, if it holds a message, with the index of its messages."""
        if self._times is None:
            return
        content, (first, last), entries = b"".join(self._parts), self._times, self._entries
        self._parts, self._size, self._entries, self._times = [], 0, {}, None
        compressed = self._compressor.compress(content)
        place = self._stream.tell()
        length = _CHUNK.size + len(compressed)
        self._stream.write(
            _CHUNK.pack(
                Opcode.CHUNK,
                length - _HEAD_SIZE,
                first,
                last,
                len(content),
                zlib.crc32(content),
                len(COMPRESSION),
                COMPRESSION.encode(),
                len(compressed),
            )
        )
        self._stream.write(compressed)
        end, offsets = place + length, {}
        for channel, values in entries.items():
            offsets[channel] = end
            end += self._stream.write(_message_index(channel, values))
        self._chunks.append(
            mcap_records.ChunkIndex(
                chunk_length=length,
                chunk_start_offset=place,
                compression=COMPRESSION,
                compressed_size=len(compressed),
                message_end_time=last,
                message_index_length=end - place - length,
                message_index_offsets=offsets,
                message_start_time=first,
                uncompressed_size=len(content),
            )
        )

    def _statistics(self) -> mcap_records.Statistics:
        chunks = self._chunks
        return mcap_records.Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=len(chunks),
            message_count=sum(self._counts.values()),
            message_end_time=max((c.message_end_time for c in chunks), default=0),
            message_start_time=min((c.message_start_time for c in chunks), default=0),
            metadata_count=len(self._metadata),
            schema_count=len(self._schemas),
        )


def _message_index(channel: int, entries: Sequence[int]) -> bytes:
    size = 8 * len(entries)
    head = _INDEX.pack(Opcode.MESSAGE_INDEX, _INDEX.size - _HEAD_SIZE + size, channel, size)
    return head + struct.pack(f"<{len(entries)}Q", *entries)


def _bytes_of(record: mcap_records.McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()
