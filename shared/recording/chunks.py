"""Records of an MCAP file that a recording is read from: chunks are taken apart, indexes left out.

A chunk holds most records of a file, nearly all of them messages. Those are read here, several
times as fast as by the library's reader, which reads each number with a call of its own.
"""

from __future__ import annotations

import struct
import zlib
from io import BytesIO

from lz4.frame import LZ4FrameDecompressor
from mcap import records as mcap_records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.stream_reader import StreamReader
from zstandard import ZstdDecompressor

MAX_RECORD_SIZE = 2**27
"""Size of a record, compressed or not, above which it counts as damage [bytes]; a chunk holds at
most one image beyond `CHUNK_SIZE`."""
MAX_RECORD_COUNT = 40_000
"""Number of records of a chunk above which it counts as damage; one of `CHUNK_SIZE` has below
10,000, and a chunk of compressed zeros millions."""
_RECORD = struct.Struct("<BQ")
"""Begin of a record: its opcode, and the length of what follows [bytes]."""
_MESSAGE = struct.Struct("<HIQQ")
"""Begin of a message: channel, sequence number, log time and publish time [ns]."""


class PlainReader(StreamReader):
    """Reader of all records but the indexes, which only help to jump in a file."""

    def _read_record(self, opcode: int, length: int) -> mcap_records.McapRecord | None:
        if opcode in (Opcode.MESSAGE_INDEX, Opcode.CHUNK_INDEX):
            self._stream.read(length)
            return None
        return super()._read_record(opcode, length)


def records_of(chunk: mcap_records.Chunk) -> list[mcap_records.McapRecord]:
    """Return the schemas, channels and messages of a chunk.

    ValueError: damaged, too large, or of a compression that is not known; ZstdError, RuntimeError
    or struct.error: it cannot be decompressed or read.
    """
    content = _content(chunk)
    if chunk.uncompressed_crc and zlib.crc32(content) != chunk.uncompressed_crc:
        raise ValueError("its checksum differs")
    records: list[mcap_records.McapRecord] = []
    position = count = 0
    while position < len(content):
        opcode, length = _RECORD.unpack_from(content, position)
        count += 1
        if not opcode or count > MAX_RECORD_COUNT:
            raise ValueError("a record has no kind" if not opcode else f"it has {count} records")
        begin = position + _RECORD.size
        position = begin + length
        if position > len(content):
            raise ValueError(f"a record claims {length} bytes, more than the rest of the chunk")
        if opcode == Opcode.MESSAGE:
            if length < _MESSAGE.size:
                raise ValueError(f"a message has {length} bytes, less than its header")
            channel, sequence, log_time, publish_time = _MESSAGE.unpack_from(content, begin)
            payload = content[begin + _MESSAGE.size : position]
            records.append(
                mcap_records.Message(
                    channel_id=channel,
                    sequence=sequence,
                    log_time=log_time,
                    publish_time=publish_time,
                    data=payload,
                )
            )
        elif opcode == Opcode.CHANNEL:
            records.append(mcap_records.Channel.read(_stream(content, begin, position)))
        elif opcode == Opcode.SCHEMA:
            records.append(mcap_records.Schema.read(_stream(content, begin, position)))
    return records


def _stream(content: bytes, begin: int, end: int) -> ReadDataStream:
    return ReadDataStream(BytesIO(content[begin:end]))


def _content(chunk: mcap_records.Chunk) -> bytes:
    """Uncompressed content of a chunk, in memory of a bounded size."""
    match chunk.compression:
        case "":
            content = chunk.data
        case "zstd":
            with ZstdDecompressor().stream_reader(chunk.data) as reader:
                content = reader.read(MAX_RECORD_SIZE + 1)
        case "lz4":
            content = LZ4FrameDecompressor().decompress(chunk.data, MAX_RECORD_SIZE + 1)
        case other:
            raise ValueError(f"compression {other!r} is not known")
    if len(content) > MAX_RECORD_SIZE:
        raise ValueError(f"its content is larger than {MAX_RECORD_SIZE / 2**20:g} MiB")
    return content
