"""Made-up input of every verb: an exit code, one line for a refusal, and no word
of a library. FUZZ_COUNT examples of each kind instead of a few, anew each time, with that variable.
"""

from __future__ import annotations

import json
import os
import shutil
import socket
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NoReturn

import cv2
import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from benchmarks.faults.hostile_messages import spoiled
from cli import __main__ as lariat
from cli import goal, run, show, watch
from lariat.arms.description import CR5_URDF
from shared.bus import Unreachable
from stack import client

ROOT = Path(__file__).parents[2]
COUNT = "FUZZ_COUNT"
"""Variable of the environment with the number of examples."""
fuzz = settings(
    max_examples=int(os.environ.get(COUNT, "12")),
    derandomize=COUNT not in os.environ,
    deadline=None,
    database=None,
    suppress_health_check=list(HealthCheck),
)
NUMBERS = st.sampled_from([0, -1, 1, 2, 7, 1e-9, 1e-3, 0.5, 1e9, 1e300]) | st.floats()
VALUES = st.one_of(
    NUMBERS,
    st.integers(-(2**70), 2**70),
    st.sampled_from(["", "x", "/", "nan", "é", "left", True, [], {}, [[]], [1.0, 2.0]]),
    st.lists(NUMBERS, max_size=4),
)
Call = Callable[..., str]


@pytest.fixture
def call(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> Call:
    """Function that calls a verb and returns its refusal; empty where it did not refuse."""
    monkeypatch.chdir(tmp_path)

    def begins(*values: object, **options: object) -> NoReturn:
        raise Unreachable("what is read is in order")

    for module, name in ((goal, "connect"), (run, "run"), (show, "Site")):
        monkeypatch.setattr(module, name, begins)

    def call(*words: object) -> str:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            code = lariat.main([str(word) for word in words])
        told = capfd.readouterr().err
        for word in ("Warning", "WARN", "Traceback", "libpng"):
            assert word not in told, words
        lines = told.splitlines()
        if code != 2:
            assert code in (0, 1)
            return ""
        assert sum(line.startswith("lariat: ") for line in lines) == 1, (words, told)
        return lines[-1]

    return call


def toml(value: Any) -> str:
    """Value as TOML."""
    match value:
        case bool():
            return str(value).lower()
        case str():
            return f"'{value}'"
        case list():
            return f"[{', '.join(map(toml, value))}]"
        case _:
            return str(value)


def changed(text: str) -> st.SearchStrategy[str]:
    """Scenario with one to three values that are others, or lines that are missing."""
    lines = text.splitlines()
    keys = [k for k, line in enumerate(lines) if " = " in line]

    def change(edits: Sequence[tuple[int, Any]]) -> str:
        new = list(lines)
        for k, value in edits:
            new[k] = "" if value is None else f"{new[k].partition(' = ')[0]} = {toml(value)}"
        return "\n".join(new)

    edit = st.tuples(st.sampled_from(keys), VALUES | st.none())
    return st.lists(edit, min_size=1, max_size=3).map(change)


def shipped(*names: str) -> st.SearchStrategy[str]:
    texts = [(ROOT / f"scenarios/{name}.toml").read_text() for name in names]
    return st.sampled_from(texts).flatmap(changed)


@fuzz
@given(shipped("fixed-end", "rope", "second-rope", "over-a-bar", "markers"))
def test_scenarios_are_refused_alike(call: Call, tmp_path: Path, text: str) -> None:
    shutil.copytree(ROOT / "scenarios/goals", tmp_path / "goals", dirs_exist_ok=True)
    (tmp_path / "a.toml").write_text(text)
    assert call("check", "a.toml") == call("run", "a.toml")
    call("goal", "a.toml")
    call("shape", "a.toml", "--output", "shape.csv")


def motion(shape: tuple[int, ...], scale: float, kind: str, bad: float | None) -> Any:
    """Vertices of a wavering rope, or of none."""
    v = 0.02 * np.random.default_rng(0).normal(size=shape)
    if shape[-1] == 3:
        v[..., 0] += np.linspace(0.0, 0.5, shape[-2])
    if bad is not None:
        v.flat[v.size // 2] = bad
    with np.errstate(all="ignore"):
        return (v * scale).astype(kind)


MOTIONS = st.fixed_dictionaries(
    {
        "vertices": st.builds(
            motion,
            st.sampled_from(
                [(1, 12, 4, 3), (2, 11, 6, 3), (1, 3, 3, 3), (12, 4, 3), (1, 12, 4, 2)]
            ),
            st.sampled_from([1.0, 1e-3, 0.0, 50.0, 1e3, 1e300]),
            st.sampled_from(["f8", "f4", "i4", "c16", "U3", "?"]),
            st.sampled_from([None, np.nan, np.inf, 1e30]),
        ),
    },
    optional={"dt": NUMBERS | st.text(max_size=3), "prescribed": st.lists(st.integers(-7, 7))},
)
MOTION_OPTIONS = ("fit-seconds", "bending-stiffness", "linear-density", "diameter", "scale", "dt")


@fuzz
@given(MOTIONS, st.sampled_from(MOTION_OPTIONS), NUMBERS)
@example(
    {"vertices": motion((1, 12, 4, 3), 1.0, "c16", np.inf), "dt": 0, "prescribed": []}, "dt", 1
)
def test_motions(
    call: Call, tmp_path: Path, arrays: dict[str, Any], option: str, number: float
) -> None:
    np.savez(tmp_path / "a.npz", **arrays)
    call("identify", "a.npz", f"--{option}", number)


def picture(size: tuple[int, int], channels: int, depth: str, ending: str, seed: int) -> bytes:
    """Noise, or a bright line."""
    image = np.random.default_rng(seed).integers(0, 250, (*size, channels)).astype(depth)
    if seed == 2:
        image[:] = 30
        image[size[0] // 2 : size[0] // 2 + 3] = 200
    flat = image[..., 0] if channels == 1 else image
    return cv2.imencode(ending, flat)[1].tobytes()


WHOLE_PICTURES = st.builds(
    picture,
    st.sampled_from([(1, 1), (1, 40), (7, 3), (24, 32), (60, 80)]),
    st.sampled_from([1, 3, 4]),
    st.sampled_from(["u1", "u2"]),
    st.just(".png"),
    st.integers(0, 3),
)
PICTURES = WHOLE_PICTURES | WHOLE_PICTURES.flatmap(spoiled) | st.binary(max_size=40)
CAMERAS = st.dictionaries(st.sampled_from(["fx", "fy", "cx", "cy", "width"]), VALUES, max_size=2)


@fuzz
@given(
    PICTURES,
    PICTURES,
    CAMERAS,
    st.sampled_from(["length", "diameter", "depth-scale", "nodes", "doubtful"]),
    NUMBERS,
)
def test_pictures(
    call: Call,
    tmp_path: Path,
    image: bytes,
    depth: bytes,
    camera: dict[str, Any],
    option: str,
    number: float,
) -> None:
    (tmp_path / "a.png").write_bytes(image)
    (tmp_path / "d.png").write_bytes(depth)
    (tmp_path / "k.json").write_text(json.dumps({"fx": 40, "fy": 40, "cx": 16, "cy": 12} | camera))
    words = ["--depth", "d.png", "--camera", "k.json", "--length", 0.5, "--diameter", 0.01]
    call("see", "a.png", *words, f"--{option}", number)
    call("see", "a.png")
    call("cover", "d.png", "--field-of-view", number)


OBJ = b"v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2//1 3//1 -1//1\n"
FACET = b"facet\nouter loop\nvertex 0 0 0\nvertex 0.1 0 0\nvertex 0 0.1 0\nendloop\nendfacet\n"
STL = b"solid a\n" + 2 * FACET + b"endsolid a\n"
MESHES = st.sampled_from([("a.obj", OBJ), ("a.stl", STL)]).flatmap(
    lambda mesh: st.tuples(st.just(mesh[0]), spoiled(mesh[1]) | st.just(mesh[1]))
)
MESH_OPTIONS = {"scale": 1, "most": 1, "tolerance": 1, "position": 3, "orientation": 4}


@fuzz
@given(MESHES, st.sampled_from(list(MESH_OPTIONS)), NUMBERS)
def test_meshes(
    call: Call, tmp_path: Path, mesh: tuple[str, bytes], option: str, number: float
) -> None:
    name, content = mesh
    (tmp_path / name).write_bytes(content)
    call("cover", name, f"--{option}", *[number] * MESH_OPTIONS[option])


@fuzz
@given(spoiled((ROOT / "scenarios/goals/rope-1.csv").read_bytes()), NUMBERS)
def test_tables(call: Call, tmp_path: Path, table: bytes, scale: float) -> None:
    (tmp_path / "a.csv").write_bytes(table)
    call("goal", "a.csv", "--scale", scale)
    call("check", "rope", "--set", f"goal.nodes={tmp_path / 'a.csv'}")


def robots(text: str) -> st.SearchStrategy[str]:
    """URDF with an attribute that is another, or missing."""
    parts = text.split('"')

    def change(at: int, value: str | None) -> str:
        if value is None:
            return '"'.join([*parts[: 2 * at], *parts[2 * at + 2 :]])
        return '"'.join([*parts[: 2 * at + 1], value, *parts[2 * at + 2 :]])

    values = [
        "",
        "0",
        "0 0 0",
        "1 2",
        "nan nan nan",
        "1e400",
        "180",
        "link_1",
        "base_link",
        "fixed",
    ]
    places = st.integers(0, len(parts) // 2 - 1)
    return st.builds(change, places, st.sampled_from([*values, "continuous", "prismatic", None]))


# An arm of one joint: the last hangs at the base.
ONE_JOINT = CR5_URDF.read_text().replace('<parent link="link_5"', '<parent link="base_link"')


@fuzz
@example(ONE_JOINT)
@given(robots(CR5_URDF.read_text()))
def test_robots_are_refused_alike(call: Call, tmp_path: Path, urdf: str) -> None:
    (tmp_path / "a.urdf").write_text(urdf)
    values = {"driver": "simulated", "flange": "link_6", "urdf": tmp_path / "a.urdf"}
    cell = ["fixed-end", *(w for k, v in values.items() for w in ("--set", f"ends.right.{k}={v}"))]
    assert call("check", *cell) == call("run", *cell)


RECORDING = (ROOT / "tests/replay/camera.mcap").read_bytes()
FORMATS = ("csv", "parquet", "ros2", "rerun", "foxglove-layout", "lerobot", "video", "gif")


@fuzz
@given(spoiled(RECORDING), st.sampled_from(["replay", "repair", "calibrate", "show", *FORMATS]))
def test_recordings(call: Call, tmp_path: Path, recording: bytes, use: str) -> None:
    (tmp_path / "a.mcap").write_bytes(recording)
    (tmp_path / "a.mcap.cut").unlink(missing_ok=True)
    if use not in FORMATS:
        call(use, "a.mcap")
        return
    folder = tmp_path / "out"
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    call("export", "a.mcap", "--to", use, "--output", folder / "a.mp4")


def options(**values: st.SearchStrategy[Any]) -> st.SearchStrategy[list[Any]]:
    """Words of some of these options."""
    chosen = st.fixed_dictionaries({}, optional=values)
    return chosen.map(
        lambda each: [w for k, v in each.items() for w in (f"--{k.replace('_', '-')}", v)]
    )


NAMES = st.sampled_from(["cell", "a/b", "é", "a b", "", "*", "//", ".."]) | st.text(max_size=6)
NOBODY = "tcp/127.0.0.1:1"
"""Endpoint at which nothing listens."""
ENDPOINTS = st.just(NOBODY) | st.sampled_from(
    ["", "x", "tcp/", "tcp/127.0.0.1", "127.0.0.1:1", "tcp/127.0.0.1:99999", "tcp/[::1]:1"]
    + [f"{kind}/127.0.0.1:1" for kind in ("tls", "udp", "ws", "none", "unixsock-stream")]
)
SETTINGS = st.binary(max_size=20) | st.dictionaries(
    st.sampled_from(["mode", "x", "", "transport/auth/usrpwd/user", "transport/link/tls"]), VALUES
).map(lambda table: json.dumps(table).encode())
FILES = st.sampled_from(["a.json", "none.json", "/dev/null", "/proc/x", ".", ""])
PORTS = st.sampled_from([0, -1, 1, 80, 65535, 65536, 2**70, "x"])
CELLS = options(
    namespace=st.just("cell") | NAMES,
    mode=st.sampled_from(["peer", "client", "x"]),
    settings=FILES,
)
SCENARIOS = st.sampled_from(["fixed-end", "none", ".", "", "a.json"])
CLIENTS = st.one_of(
    st.sampled_from(
        [["status"], ["status", "--json"]]
        + [[verb] for verb in ("pause", "stop", "reset", "restore", "arm", "disarm", "ack")]
    ),
    st.builds(lambda more: ["start", *more], options(scenario=SCENARIOS)),
    st.builds(lambda x: ["approach", x], NUMBERS | NAMES),
    st.builds(lambda x, more: ["grip", x, *more], NAMES | st.just("open"), options(side=NAMES)),
    st.builds(lambda x, more: ["goal", x, *more], SCENARIOS | FILES, options(scale=NUMBERS)),
    st.builds(lambda x: ["goal", "--line", *x], st.lists(NUMBERS, min_size=6, max_size=6)),
    st.builds(lambda more: ["watch", *more], options(port=PORTS, token_file=FILES)),
)


@fuzz
@given(CLIENTS, ENDPOINTS, CELLS, SETTINGS)
def test_clients(
    call: Call,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[Any],
    endpoint: str,
    cell: list[Any],
    content: bytes,
) -> None:
    for module in (client, watch):
        monkeypatch.setattr(module, "JOIN_TIMEOUT", 0.05)
    monkeypatch.setattr(goal, "connect", client.connect)
    (tmp_path / "a.json").write_bytes(content)
    call(*words, "--connect", endpoint, *cell)


@pytest.fixture
def taken_port() -> Iterator[int]:
    """Port that another process holds, so that no stack starts on it."""
    with socket.socket() as holder:
        holder.bind(("127.0.0.1", 0))
        holder.listen()
        yield holder.getsockname()[1]


@fuzz
@given(
    shipped("fixed-end", "rope", "over-a-bar", "markers") | st.just("name = 'x'"),
    options(
        namespace=NAMES,
        dashboard_port=PORTS,
        dashboard_address=NAMES,
        dashboard_password_file=FILES,
        keep=NUMBERS,
        ros2_router=ENDPOINTS,
        saved_scenarios=FILES,
    ),
    st.none() | st.sampled_from([0, -1, 65536, 2**70, "x"]),
)
def test_stacks(
    call: Call, tmp_path: Path, taken_port: int, text: str, words: list[Any], port: object
) -> None:
    shutil.copytree(ROOT / "scenarios/goals", tmp_path / "goals", dirs_exist_ok=True)
    (tmp_path / "a.toml").write_text(text)
    assert call("up", "a.toml", *words, "--port", taken_port if port is None else port)


@fuzz
@given(
    st.sampled_from(["out", "a.toml", "/dev/null", "/proc/x", ""]),
    options(
        address=NAMES | st.sampled_from(["127.0.0.1", "a" * 300, "*.lab", "256.0.0.1", "a_b"]),
        namespace=st.just("cell") | NAMES,
        days=st.sampled_from([-1, 0, 1, 365, 36500, 3_000_000, 2**70]),
    ),
    st.binary(max_size=9) | st.none(),
)
def test_certificates(
    call: Call, tmp_path: Path, folder: str, words: list[Any], key: bytes | None
) -> None:
    (tmp_path / "a.toml").write_text("")
    shutil.rmtree(tmp_path / "out", ignore_errors=True)
    if key is not None:
        (tmp_path / "out/authority").mkdir(parents=True)
        (tmp_path / "out/authority/key.pem").write_bytes(key)
    call("certs", folder, *words)
