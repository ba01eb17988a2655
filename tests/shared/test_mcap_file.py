"""Files of the MCAP writer, read by the library."""

from __future__ import annotations

import io
import struct

import numpy as np
import zstandard
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Attachment, Chunk, MessageIndex, Statistics
from mcap.stream_reader import StreamReader
from mcap.writer import Writer

from shared.recording.layout import CHUNK_SIZE
from shared.recording.mcap_file import McapFile

TIMES = (5, 3, 9, 8, 1, 12)
"""Log times of the messages [ns], out of order."""


def written(payloads: list[bytes]) -> io.BytesIO:
    """File of two channels, whose messages take turns, with an attachment and metadata."""
    stream = io.BytesIO()
    file = McapFile(stream, "lariat test")
    file.add_metadata("about", {"scenario": "rope"})
    file.add_attachment(Attachment(1, 2, "nodes.csv", "text/csv", b"0, 1, 2"))
    schema = file.register_schema("lariat.NodeChain", "protobuf", b"its descriptors")
    topics = ("rope/nodes", "rope/truth")
    channels = [
        file.register_channel(t, "protobuf", schema, {"publisher": "sim-0"}) for t in topics
    ]
    for k, (time, payload) in enumerate(zip(TIMES, payloads, strict=True)):
        file.add_message(channels[k % 2], time, payload, time - 1, sequence=k)
    file.finish()
    stream.seek(0)
    return stream


def test_file_of_several_chunks_is_read_through_its_indexes() -> None:
    noise = np.random.default_rng(0)
    payloads = [noise.bytes(CHUNK_SIZE // 2) for _ in TIMES]
    reader = make_reader(written(payloads), validate_crcs=True)
    summary = reader.get_summary()
    assert summary is not None
    assert summary.statistics == Statistics(
        attachment_count=1,
        channel_count=2,
        channel_message_counts={1: 3, 2: 3},
        chunk_count=3,
        message_count=6,
        message_end_time=12,
        message_start_time=1,
        metadata_count=1,
        schema_count=1,
    )
    assert [(c.message_start_time, c.message_end_time) for c in summary.chunk_indexes] == [
        (3, 5),
        (8, 9),
        (1, 12),
    ]
    ordered = sorted(range(len(TIMES)), key=TIMES.__getitem__)
    assert [
        (m.log_time, m.publish_time, m.sequence, m.data, c.topic, c.metadata)
        for _, c, m in reader.iter_messages()
    ] == [
        (
            TIMES[k],
            TIMES[k] - 1,
            k,
            payloads[k],
            ("rope/nodes", "rope/truth")[k % 2],
            {"publisher": "sim-0"},
        )
        for k in ordered
    ]
    assert [m.sequence for *_, m in reader.iter_messages(["rope/truth"], starting_at=8)] == [3, 5]
    assert [(f.name, f.data) for f in reader.iter_attachments()] == [("nodes.csv", b"0, 1, 2")]
    assert [m.metadata for m in reader.iter_metadata()] == [{"scenario": "rope"}]


def test_indexes_tell_where_each_message_of_a_chunk_is() -> None:
    stream = written([bytes([k]) * (k + 1) for k in range(len(TIMES))])
    chunk = next(r for r in StreamReader(stream, emit_chunks=True).records if isinstance(r, Chunk))
    content = zstandard.decompress(chunk.data)
    stream.seek(0)
    indexes = [r for r in StreamReader(stream).records if isinstance(r, MessageIndex)]
    assert [index.channel_id for index in indexes] == [1, 2]
    found = [(time, content[place : place + 23]) for i in indexes for time, place in i.records]
    assert [(time, head[0], head[15:]) for time, head in found] == [
        (time, Opcode.MESSAGE, struct.pack("<Q", time)) for time in (*TIMES[::2], *TIMES[1::2])
    ]
    stream.seek(0)
    summary = make_reader(stream).get_summary()
    assert summary is not None
    (place,) = summary.chunk_indexes
    end = place.chunk_start_offset + place.chunk_length + place.message_index_length
    opcodes = [stream.getvalue()[k] for k in (*place.message_index_offsets.values(), end)]
    assert opcodes == [Opcode.MESSAGE_INDEX, Opcode.MESSAGE_INDEX, Opcode.DATA_END]


def test_file_without_a_message_has_the_bytes_of_the_librarys() -> None:
    ours, theirs = io.BytesIO(), io.BytesIO()
    file, other = McapFile(ours, "lariat test"), Writer(theirs)
    other.start("", "lariat test")
    file.add_metadata("about", {"scenario": "rope"})
    other.add_metadata("about", {"scenario": "rope"})
    file.add_attachment(Attachment(1, 2, "nodes.csv", "text/csv", b"0, 1, 2"))
    other.add_attachment(1, 2, "nodes.csv", "text/csv", b"0, 1, 2")
    for writer in (file, other):
        writer.register_schema("lariat.NodeChain", "protobuf", b"its descriptors")
        writer.register_channel("rope/nodes", "protobuf", 1, {"publisher": "sim-0"})
        writer.finish()
    assert ours.getvalue() == theirs.getvalue()
