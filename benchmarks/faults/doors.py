"""Messages, files and second starts that no process may end of, nor spend minutes on."""

from __future__ import annotations

import resource
import struct
import subprocess
import sys
import time
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import psutil
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk

from benchmarks.faults.attack import Attack, NoControl
from benchmarks.live_stack import LiveStack
from lariat.files.mesh_file import HEADER_SIZE, RECORD
from lariat.scenario import Scenario, load
from shared import topics
from shared.messages import NodeChain, StackRequest, StackState, TaskState
from shared.recording import Writer
from shared.topics import Topic
from stack.client import Client
from stack.credentials.local_secret import find_local_secret
from stack.launcher import module_entry

SCENARIO = "three-cylinders"
"""Scenario that the controls use."""
ANSWER_TIMEOUT = 20.0
"""Longest wait for an answer of the launcher [s]."""
LONGEST, TIMEOUT = 20.0, 120.0
"""Longest processor time, and longest time, of a command with a hostile file [s]."""
PERIOD = 0.02
"""Time between two looks [s]."""
DEEP_KEY = ".a" * 30_000
"""Rest of a key with which the parser of TOML takes half a minute."""
ZEROS_SIZE = 3 * 2**30
"""Size of an array of zeros in a small file [bytes]."""
EMPTY_CHUNKS = 10
"""Chunks of a recording that unpack to nothing but headers of records."""
TRIANGLES = 200_000
"""Number of triangles of a mesh that cross each other."""

HOSTILE_REQUESTS = {
    "a setting whose key has 1801 parts": {"settings": ["rope" + ".a" * 1800 + "=1"]},
    "a scenario's name of 240 characters": {"settings": [f'name="{"x" * 240}"']},
    "10,000 settings": {"settings": ["seed=1"] * 10_000},
    "lists 3000 deep": {"settings": ["seed=" + "[" * 3000]},
    "an upload with a key of 30,001 parts": {"content": f"a{DEEP_KEY} = 1".encode()},
}
"""Fields of requests to save a scenario."""


def hostile_requests(stack: LiveStack) -> Iterator[Attack]:
    """Ask the launcher for what it cannot handle."""
    who, before = "a process with the bus's password", _processes(stack)
    with stack.connect() as client:
        if refusal := _save(client, settings=["seed=1"]):
            raise NoControl(f"an ordinary request is refused: {refusal}")
        for attempt, fields in HOSTILE_REQUESTS.items():
            refusal = _save(client, **fields)
            same = _processes(stack) == before
            outcome = f"refused: {refusal[:60]}" if refusal else "carried out"
            outcome = outcome if same else "a process ended"
            yield Attack(who, attempt, outcome, held=bool(refusal and same))


def _save(client: Client, **fields: object) -> str:
    """Ask to save the present scenario with changes; return the refusal."""
    states = client.bus.subscribe(topics.STACK_STATE)
    request = client.next_id()
    message = StackRequest(id=request, action=StackRequest.SAVE, name="bench", **fields)
    client.matched_publisher(topics.STACK_REQUEST).put(message)
    deadline = time.monotonic() + ANSWER_TIMEOUT
    while time.monotonic() < deadline:
        for _, item in states.take():
            state: StackState = item.message
            if state.last_request == request:
                return state.refusal
        time.sleep(PERIOD)
    raise NoControl("the launcher does not answer")


def second_stack(stack: LiveStack) -> Iterator[Attack]:
    """Start another stack of the same user on the port of the first one."""
    secret = find_local_secret((stack.hub,))
    if secret is None:
        raise NoControl("the stack has no secret")
    before, own = _processes(stack), secret.read_text()
    code, line = _command(stack.folder, "up", SCENARIO, "--port", str(stack.port))
    same = secret.exists() and secret.read_text() == own and _processes(stack) == before
    yield Attack(
        "a second `lariat up`",
        "start on the same port",
        line[:60] if same else "the first one is harmed",
        held=same and code == 2 and f"process {stack.pid}" in line,
    )


def _processes(stack: LiveStack) -> set[int]:
    return {each.pid for each in psutil.Process(stack.pid).children(recursive=True)}


def hostile_files(folder: Path) -> Iterator[Attack]:
    """Give hostile files to the command line; each kind has a file that it takes."""
    folder = folder / "hostile"
    folder.mkdir()
    scenario = load(SCENARIO)
    text, deep, named = (folder / f"{name}.toml" for name in ("valid", "deep", "named"))
    text.write_text(scenario.text)
    deep.write_text(f"{scenario.text}\n[rope.a{DEEP_KEY}]\n")
    named.write_text(scenario.text.replace(f'name = "{SCENARIO}"', f'name = "{"x" * 240}"'))
    attempts = {"a key of 30,001 parts": deep, "a name of 240 characters": named}
    yield from _files("check", text, attempts)
    _motions(folder)
    claim, zeros = folder / "claim.npz", folder / "zeros.npz"
    attempts = {"an array that claims 218 TiB": claim, "3 GiB of zeros": zeros}
    yield from _files("identify", folder / "valid.npz", attempts)
    valid = _recording(folder / "valid.mcap", scenario)
    empty = _recording(folder / "empty.mcap", scenario, chunks=_empty_chunk())
    yield from _files("export", valid, {"compressed emptiness": empty}, "--to", "csv", held=(0, 2))
    spoiled = _recording(folder / "spoiled.mcap", scenario, spoil=_spoiled)
    attempts = {"corrupt messages and unknown values": spoiled}
    yield from _files("export", None, attempts, "--to", "csv", held=(0,))
    rng = np.random.default_rng(0)
    tetrahedron = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    faces = tetrahedron[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    solid = _stl(folder / "valid.stl", faces)
    crossing = _stl(folder / "crossing.stl", rng.uniform(-0.5, 0.5, (TRIANGLES, 3, 3)))
    yield from _files("cover", solid, {f"{TRIANGLES} triangles that cross": crossing})


def _files(
    verb: str,
    valid: Path | None,
    hostile: dict[str, Path],
    *options: str,
    held: tuple[int, ...] = (2,),
) -> Iterator[Attack]:
    """Give files to a verb.

    Args:
        verb: The verb.
        valid: File that it takes.
        hostile: Hostile files by what they are.
        options: Further arguments.
        held: Exit codes of a verb that held.
    """
    if valid is not None:
        code, said = _command(valid.parent, verb, str(valid), *options)
        if code not in (0, 1):
            raise NoControl(f"lariat {verb} {valid} ends with {code}: {said}")
    for attempt, path in hostile.items():
        begun = _processor_time()
        code, said = _command(path.parent, verb, str(path), *options)
        seconds = _processor_time() - begun
        outcome = f"exit code {code} after {seconds:.1f} s of processor time"
        refused = code in held and "Traceback" not in said and seconds < LONGEST
        yield Attack(f"author of a file for {verb}", attempt, outcome, refused)


def _processor_time() -> float:
    """Return the processor time of all commands that have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _command(folder: Path, *words: str) -> tuple[int, str]:
    """Run the command line; return its exit code and what it says on standard error."""
    try:
        done = subprocess.run(
            [sys.executable, *module_entry.command("cli", *words)],
            cwd=folder,
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return -1, "no end"
    return done.returncode, done.stderr.strip()


def _motions(folder: Path) -> None:
    """Write motion files: one that is taken, one that claims too much, one of zeros."""
    time_axis = np.linspace(0.0, 1.0, 60)[:, None]
    nodes = np.linspace(0.0, 0.5, 9)[None]
    sway = 0.02 * np.sin(6.0 * time_axis) * np.sin(np.pi * nodes / 0.5)
    height = 0.3 - 0.1 * np.sin(np.pi * nodes / 0.5)
    vertices = np.stack(np.broadcast_arrays(nodes, sway, height), -1)
    own = {"dt": np.array(1.0 / 60.0), "prescribed": np.array([0, 1, 7, 8])}
    np.savez(folder / "valid.npz", vertices=vertices[None], **own)
    for name, shape, size in (
        ("claim.npz", (10, 10**9, 1000, 3), 0),
        ("zeros.npz", (1, ZEROS_SIZE // 24 // 10, 10, 3), ZEROS_SIZE),
    ):
        np.savez_compressed(folder / name, **own)
        with (
            zipfile.ZipFile(folder / name, "a", zipfile.ZIP_DEFLATED, compresslevel=1) as archive,
            archive.open("vertices.npy", "w", force_zip64=True) as file,
        ):
            header = {"descr": "<f8", "fortran_order": False, "shape": shape}
            np.lib.format.write_array_header_1_0(file, header)
            block = bytes(2**24)
            for _ in range(size // len(block)):
                file.write(block)


def _spoiled(topic: Topic, payload: bytes, k: int) -> bytes:
    if topic is topics.TASK_STATE:
        return TaskState(state=99).SerializeToString() if k % 2 else payload  # pyright: ignore
    return b"\xff" * 20 if k % 2 else payload


def _recording(
    path: Path,
    scenario: Scenario,
    chunks: bytes = b"",
    spoil: Callable[[Topic, bytes, int], bytes] = lambda topic, payload, k: payload,
) -> Path:
    """Write a small recording, with chunks in its middle and spoiled messages."""
    writer = Writer(path, scenario, 1)
    nodes = NodeChain(positions=np.linspace(0.0, 0.5, 30).tolist()).SerializeToString()
    for k in range(100):
        for topic, payload in ((topics.ROPE_NODES, nodes), (topics.TASK_STATE, b"")):
            writer.write(topic, spoil(topic, payload, k), "p-0", k, 10**8 * (k + 1))
        if k == 50 and chunks:
            writer._writer.flush()
            writer._stream.write(chunks)
    writer.close()
    return path


def _empty_chunk() -> bytes:
    """Chunks that are small, and unpack to millions of records without content."""
    content = struct.pack("<BQ", Opcode.MESSAGE, 22) + bytes(22)
    content *= 2**26 // len(content)
    chunk = RecordBuilder()
    Chunk("zstd", zstandard.compress(content), 0, 0, 0, len(content)).write(chunk)
    return EMPTY_CHUNKS * chunk.end()


def _stl(path: Path, triangles: np.ndarray) -> Path:
    rows = np.zeros(len(triangles), RECORD)
    rows["corners"] = triangles
    path.write_bytes(bytes(HEADER_SIZE - 4) + len(rows).to_bytes(4, "little") + rows.tobytes())
    return path
