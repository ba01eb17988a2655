"""Recordings: readable by other software, and after the death of the writer."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import time
import tracemalloc
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.json_format import MessageToDict
from google.protobuf.message_factory import GetMessageClass
from mcap.data_stream import RecordBuilder
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import Writer as McapWriter

from cli.repair import repair
from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario, parse
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import NodeChain, timestamp
from shared.recording import Recording, Writer, chunks, reader
from shared.recording.layout import ORDERED_FROM, ROBOT_DESCRIPTION_TOPIC
from shared.version import MESSAGE_VERSION, RECORDING_VERSION

MCAP_MAGIC = b"\x89MCAP0\r\n"
OLD_RECORDING = Path(__file__).parents[2] / "replay" / "three-cylinders.mcap"
TEXT = """
name = "recorded"
[rope]
length = 0.45
diameter = 0.008
[start]
line = [[-0.2, 0.0, 0.3], [0.2, 0.0, 0.3]]
[goal]
nodes = "goal.csv"
"""


@pytest.fixture
def scenario(tmp_path: Path):
    (tmp_path / "goal.csv").write_text("-0.225,0,0.3\n0,0,0.3\n0.22,0,0.3\n")
    return parse(TEXT, tmp_path)


def write(writer: Writer, count: int, first: int = 0) -> None:
    for k in range(first, first + count):
        chain = NodeChain(stamp=k, positions=[0.1 * k, 2.0, 3.0], observed=[True])
        writer.write(
            topics.ROPE_NODES,
            chain.SerializeToString(),
            "perception-0",
            k,
            SECOND + k * SECOND // 30,
        )


def indexed_count(path: Path) -> int:
    """Messages of the bus that a reader of the index alone finds."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    # The first message is the robots' description.
    return summary.statistics.message_count - 1


def test_messages_are_read_back_with_publisher_and_sequence(tmp_path: Path, scenario):
    writer = Writer(tmp_path / "a.mcap", scenario, SECOND)
    write(writer, 100)
    writer.close()
    recording = Recording.open(tmp_path / "a.mcap")
    entries = list(recording.messages())
    assert recording.damage == ""
    assert [e.sequence for e in entries] == list(range(100))
    assert {e.publisher for e in entries} == {"perception-0"}
    assert entries[7].parse().positions[0] == pytest.approx(0.7)
    assert entries[7].log_time == SECOND + 7 * SECOND // 30
    assert recording.metadata["scenario"] == "recorded"
    assert recording.metadata["version"]


def test_a_recording_contains_the_scenario_and_its_files(tmp_path: Path, scenario):
    Writer(tmp_path / "a.mcap", scenario, SECOND).close()
    (tmp_path / "goal.csv").unlink()
    other = tmp_path / "elsewhere"
    again = Recording.open(tmp_path / "a.mcap").scenario(other)
    assert again == scenario
    nodes = again.nodes(again.goal)
    assert nodes is not None
    assert nodes[0].tolist() == [-0.225, 0.0, 0.3]


def test_a_reader_that_knows_nothing_of_lariat_decodes_every_message(tmp_path: Path, scenario):
    writer = Writer(tmp_path / "a.mcap", scenario, SECOND)
    write(writer, 3)
    image = CompressedImage(timestamp=timestamp(5 * SECOND), format="jpeg", data=b"\xff\xd8")
    color = topics.CAMERA_COLOR.at("overhead")
    writer.write(color, image.SerializeToString(), "sim-0", 0, 2 * SECOND)
    writer.close()
    assert indexed_count(tmp_path / "a.mcap") == 4
    decoded = {}
    with (tmp_path / "a.mcap").open("rb") as stream:
        answer = make_reader(stream, validate_crcs=True)
        for schema, channel, message in answer.iter_messages():
            assert schema is not None
            if channel.topic == ROBOT_DESCRIPTION_TOPIC:
                continue
            assert (schema.encoding, channel.message_encoding) == ("protobuf", "protobuf")
            # Only what the file itself says of its messages: an empty pool of descriptors.
            pool = DescriptorPool()
            for file in FileDescriptorSet.FromString(schema.data).file:
                pool.Add(file)
            kind = GetMessageClass(pool.FindMessageTypeByName(schema.name))
            decoded[channel.topic] = MessageToDict(kind.FromString(message.data))
    assert decoded["rope/nodes"]["positions"] == pytest.approx([0.2, 2.0, 3.0])
    assert decoded["camera/overhead/color"] == {
        "timestamp": "1970-01-01T00:00:05Z",
        "format": "jpeg",
        "data": "/9g=",
    }


def test_publish_time_is_kept_apart_from_log_time(tmp_path: Path, scenario):
    writer = Writer(tmp_path / "a.mcap", scenario, SECOND)
    payload = NodeChain().SerializeToString()
    writer.write(topics.ROPE_NODES, payload, "perception-0", 0, 3 * SECOND, 2 * SECOND)
    # Without a time of sending, that of the receipt.
    writer.write(topics.ROPE_NODES, payload, "perception-0", 1, 4 * SECOND)
    writer.close()
    times = [(e.log_time, e.publish_time) for e in Recording(tmp_path / "a.mcap").messages()]
    assert times == [(3 * SECOND, 2 * SECOND), (4 * SECOND, 4 * SECOND)]


def stored(
    path: Path, scenario: Scenario, times: list[int], ordered_from: str, **more: str
) -> list[int]:
    """Log times as they are read from a file in which they are stored in the given order [s]."""
    writer = Writer(path, scenario, SECOND, {ORDERED_FROM: ordered_from, **more})
    for k, log_time in enumerate(times):
        writer.write(topics.ROPE_NODES, bytes(100), "perception-0", k, log_time * SECOND)
    writer.close()
    return [e.log_time // SECOND for e in Recording(path).messages()]


def test_messages_that_a_file_begins_with_are_read_in_order_of_time(tmp_path: Path, scenario):
    times = [4, 5, 1, 2, 3, 6, 7, 6]
    ordered = stored(tmp_path / "a.mcap", scenario, times, str(6 * SECOND))
    assert ordered == [1, 2, 3, 4, 5, 6, 7, 6]
    with (tmp_path / "a.mcap").open("rb") as stream:
        others = [m.log_time // SECOND for _, _, m in make_reader(stream).iter_messages()]
    assert others == [1, *sorted(times)]
    assert stored(tmp_path / "b.mcap", scenario, times, "0") == times
    assert stored(tmp_path / "c.mcap", scenario, [3, 1, 2], "x" * 5000) == [1, 2, 3]


def test_a_file_that_claims_to_be_without_order_is_read_in_little_memory(
    tmp_path: Path, scenario, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(reader, "MAX_UNORDERED_SIZE", 4 * (100 + reader.ENTRY_SIZE))
    times = [*range(10, 0, -1)]
    read = stored(tmp_path / "a.mcap", scenario, times, "9" * 5000)
    assert read == [*sorted(times[:5]), *times[5:]]


def test_a_killed_writer_loses_at_most_a_second(tmp_path: Path, scenario):
    path = tmp_path / "killed.mcap"
    program = f"""
import time
from pathlib import Path
from shared.recording import Writer
from lariat.scenario import load
from tests.shared.recording.test_recording import write
writer = Writer(Path({str(path)!r}), load({str(tmp_path / "s.toml")!r}), 1_000_000_000)
write(writer, 300)
print("written", flush=True)
time.sleep(60)
"""
    (tmp_path / "s.toml").write_text(TEXT)
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"written\n"
        os.kill(process.pid, signal.SIGKILL)
    recording = Recording.open(path)
    sequences = [e.sequence for e in recording.messages()]
    assert sequences == list(range(len(sequences)))
    assert len(sequences) >= 300 - 30
    assert "whole records" in recording.damage
    assert repair(path).messages == len(sequences)
    assert Recording.open(path).damage == ""


@pytest.mark.parametrize("fraction", [0.3, 0.6, 0.9])
def test_repair_keeps_everything_before_the_cut(tmp_path: Path, scenario, fraction: float):
    path = tmp_path / "cut.mcap"
    writer = Writer(path, scenario, SECOND)
    write(writer, 900)
    writer.close()
    whole = path.read_bytes()
    path.write_bytes(whole[: int(fraction * len(whole))])
    before = list(Recording(path).messages())
    result = repair(path)
    again = Recording.open(path)
    assert list(again.messages()) == before
    assert again.damage == ""
    assert again.scenario(tmp_path / "x") == scenario
    assert result.messages == len(before) > 0
    assert Path(result.kept).read_bytes() == whole[: int(fraction * len(whole))]
    assert repair(path).damage == ""
    assert indexed_count(path) == len(before)


def test_a_damaged_chunk_is_skipped(tmp_path: Path, scenario):
    path = tmp_path / "broken.mcap"
    writer = Writer(path, scenario, SECOND)
    write(writer, 900)
    writer.close()
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    chunk = summary.chunk_indexes[len(summary.chunk_indexes) // 2]
    content, middle = (
        bytearray(path.read_bytes()),
        chunk.chunk_start_offset + chunk.chunk_length // 2,
    )
    content[middle : middle + 8] = b"\x55" * 8
    path.write_bytes(bytes(content))
    recording = Recording(path)
    sequences = [e.sequence for e in recording.messages()]
    assert sequences[0] == 0
    assert sequences[-1] == 899
    assert 800 < len(sequences) < 900
    assert "damaged" in recording.damage


def test_another_file_is_refused_by_name(tmp_path: Path):
    (tmp_path / "a.txt").write_text("no recording at all")
    with pytest.raises(ValueError, match=r"a\.txt.*text.*MCAP"):
        Recording.open(tmp_path / "a.txt")
    with pytest.raises(ValueError, match=r"missing\.mcap"):
        Recording.open(tmp_path / "missing.mcap")


def test_a_recording_carries_the_versions_of_file_and_messages(tmp_path: Path, scenario):
    Writer(tmp_path / "a.mcap", scenario, SECOND).close()
    metadata = Recording.open(tmp_path / "a.mcap").metadata
    assert metadata["recording_version"] == str(RECORDING_VERSION)
    assert metadata["message_version"] == str(MESSAGE_VERSION)


def test_a_file_of_version_1_is_read_as_stored_and_its_readers_refuse_one_to_be_ordered(
    tmp_path: Path, scenario
):
    assert stored(tmp_path / "old.mcap", scenario, [3, 1], "0", recording_version="1") == [3, 1]
    assert stored(tmp_path / "new.mcap", scenario, [3, 1], str(4 * SECOND)) == [1, 3]
    assert int(Recording.open(tmp_path / "new.mcap").metadata["recording_version"]) > 1


@pytest.mark.parametrize("key", ["recording_version", "message_version"])
def test_a_recording_of_a_newer_version_is_refused(tmp_path: Path, scenario, key: str):
    Writer(tmp_path / "a.mcap", scenario, SECOND, {key: "99"}).close()
    with pytest.raises(ValueError, match=rf"has {key.replace('_', ' ')} 99, .* update Lariat"):
        Recording.open(tmp_path / "a.mcap")


def chunk_record(compression: str, content: bytes, claimed: int) -> bytes:
    """Record of a chunk, written by hand."""
    name = compression.encode()
    body = struct.pack("<QQQI", 0, 0, claimed, 0) + struct.pack("<I", len(name)) + name
    body += struct.pack("<Q", len(content)) + content
    return b"\x06" + struct.pack("<Q", len(body)) + body


def test_chunks_hold_what_the_library_reads_in_them():
    with OLD_RECORDING.open("rb") as stream:
        library = [
            r for r in StreamReader(stream, emit_chunks=True).records if isinstance(r, Chunk)
        ]
    assert len(library) > 1
    for chunk in library:
        assert chunks.records_of(chunk) == breakup_chunk(chunk)


@pytest.mark.parametrize(
    "content",
    [
        struct.pack("<BQ", Opcode.MESSAGE, 21) + bytes(21),
        struct.pack("<BQ", Opcode.MESSAGE, 22) + bytes(21),
        struct.pack("<BQ", Opcode.MESSAGE, 21) + bytes(21) + struct.pack("<BQ", 0xFF, 0),
        struct.pack("<BQ", Opcode.CHANNEL, 3) + bytes(3),
        struct.pack("<BQ", 0xFF, 2**63),
        b"\x05",
    ],
)
def test_a_chunk_whose_records_are_cut_is_damaged(content: bytes):
    chunk = Chunk("", content, 0, 0, 0, len(content))
    with pytest.raises((ValueError, struct.error, McapError)):
        chunks.records_of(chunk)


@pytest.mark.parametrize("compress", [zstandard.compress, lz4.frame.compress])
def test_a_chunk_that_unpacks_to_more_than_a_record_is_skipped(
    tmp_path: Path, scenario, monkeypatch: pytest.MonkeyPatch, compress
):
    for module in (reader, chunks):
        monkeypatch.setattr(module, "MAX_RECORD_SIZE", 1 << 20)
    path = tmp_path / "bomb.mcap"
    writer = Writer(path, scenario, SECOND)
    write(writer, 10)
    writer.close()
    kind = "zstd" if compress is zstandard.compress else "lz4"
    bomb = chunk_record(kind, compress(bytes(64 << 20)), 100)
    content = path.read_bytes()
    path.write_bytes(content[:8] + bomb + content[8:])
    tracemalloc.start()
    assert len(list(Recording(path).messages())) == 10
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 << 20


def test_a_record_is_no_longer_than_its_file(tmp_path: Path):
    path = tmp_path / "claims.mcap"
    path.write_bytes(MCAP_MAGIC + b"\x06" + struct.pack("<Q", 1 << 26) + bytes(100))
    tracemalloc.start()
    with pytest.raises(ValueError, match="not an MCAP"):
        Recording.open(path)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1 << 20


def test_files_of_a_recording_stay_in_their_folder(tmp_path: Path):
    recording = Recording(tmp_path / "a.mcap", files={"scenario.toml": b"", "../out.csv": b""})
    with pytest.raises(ValueError, match=r"'\.\./out\.csv'"):
        recording.scenario(tmp_path / "x")


def test_a_device_is_no_recording():
    with pytest.raises(ValueError, match="not a regular file"):
        Recording.open("/dev/zero")


@pytest.mark.parametrize(
    "record",
    [
        struct.pack("<BQ", 0, 0),
        struct.pack("<BQ", 0xFF, 0),
        struct.pack("<BQ", Opcode.MESSAGE, 22) + bytes(22),
    ],
    ids=["zeros", "unknown", "messages"],
)
def test_compressed_emptiness_is_damage_and_takes_no_minutes(
    tmp_path: Path, record: bytes, scenario: Scenario
) -> None:
    path = tmp_path / "empty.mcap"
    writer = Writer(path, scenario, SECOND)
    write(writer, 100)
    content = zstandard.compress(record * (2**26 // len(record)))
    chunk = RecordBuilder()
    Chunk("zstd", content, 0, 0, 0, 2**26).write(chunk)
    writer._writer.flush()
    writer._stream.write(10 * chunk.end())
    write(writer, 100)
    writer.close()
    assert path.stat().st_size < 200_000
    begun = time.process_time()
    recording = Recording(path)
    assert len(list(recording.messages())) == 200
    assert "damaged" in recording.damage
    assert time.process_time() - begun < 20.0


def test_a_file_of_another_recorder_is_refused_by_its_name(tmp_path: Path):
    path = tmp_path / "other.mcap"
    with path.open("wb") as stream:
        writer = McapWriter(stream)
        writer.start(profile="ros2", library="otherrec 1.0")
        channel = writer.register_channel("/chatter", "cdr", 0)
        writer.add_message(channel, 1, b"1234", 1)
        writer.finish()
    for verb in (Recording.open, repair):
        with pytest.raises(ConfigurationError, match="otherrec"):
            verb(path)
