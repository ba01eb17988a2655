"""Bad input: one clear line, exit code 2, and no process started."""

from __future__ import annotations

import json
import socket
import subprocess
import sys
from collections.abc import Iterator
from importlib.machinery import ModuleSpec
from pathlib import Path

import pytest

from cli import __main__ as lariat
from shared.runtime.free_port import free_port
from stack import dependencies
from stack.launcher import process

SCENARIO = """
name = "test"
[rope]
length = 0.45
diameter = 0.008
[start]
line = [[-0.2, 0.0, 0.3], [0.2, 0.0, 0.3]]
[goal]
line = [[-0.1, 0.1, 0.3], [0.25, 0.1, 0.3]]
"""


@pytest.fixture(autouse=True)
def nothing_starts(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: process.Process) -> None:
        raise AssertionError(f"{self.program.name} was started")

    monkeypatch.setattr(process.Process, "start", refuse)


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "test.toml"
    path.write_text(SCENARIO)
    return path


@pytest.fixture
def taken() -> Iterator[int]:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen()
        yield listener.getsockname()[1]


def refused(capfd: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line that a person reads."""
    assert lariat.main(arguments) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return err.strip()


@pytest.mark.parametrize("verb", ["up", "check", "run"])
@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("length", "lenght", "unknown key 'lenght' in [rope]; did you mean 'length'?"),
        ("0.45", "-0.45", "rope.length = -0.45 m is out of bounds"),
        ("[0.25, 0.1, 0.3]", "[0.75, 0.1, 0.3]", "goal: its ends are 0.8500 m apart, out of reach"),
        ("[-0.2, 0.0, 0.3]", "[0.0, 0.0, 0.002]", "start lies inside obstacle 'table'"),
    ],
)
def test_a_wrong_scenario(
    verb: str,
    old: str,
    new: str,
    line: str,
    scenario: Path,
    capfd: pytest.CaptureFixture[str],
) -> None:
    scenario.write_text(SCENARIO.replace(old, new))
    assert line in refused(capfd, verb, str(scenario))


def test_a_missing_file(capfd: pytest.CaptureFixture[str]) -> None:
    for verb in ("up", "check", "run", "replay", "repair"):
        assert "none.toml" in refused(capfd, verb, "none.toml")


def test_a_taken_port(scenario: Path, taken: int, capfd: pytest.CaptureFixture[str]) -> None:
    line = refused(capfd, "up", str(scenario), "--port", str(taken))
    assert f"port {taken} of 127.0.0.1" in line
    assert "--port" in line
    free = str(free_port())
    line = refused(capfd, "up", str(scenario), "--port", free, "--dashboard-port", str(taken))
    assert "--dashboard-port" in line


def test_a_library_that_is_not_installed(
    scenario: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario.write_text(SCENARIO + '[plant]\nmodel = "mujoco"\n')
    real = dependencies.find_spec

    def without_mujoco(name: str) -> ModuleSpec | None:
        return None if name == "mujoco" else real(name)

    monkeypatch.setattr(dependencies, "find_spec", without_mujoco)
    line = refused(capfd, "up", str(scenario))
    assert "needs mujoco" in line
    assert "pip install -e '.[all]'" in line


def test_an_unknown_verb(capfd: pytest.CaptureFixture[str]) -> None:
    assert "unknown verb 'upp'" in refused(capfd, "upp")
    assert "--line" in refused(capfd, "goal")
    assert "unknown benchmark 'nothing'" in refused(capfd, "bench", "nothing")


def test_a_rope_that_would_hang_into_an_obstacle(scenario: Path) -> None:
    """Only the rod knows: both grips are free, the middle between them is not."""
    block = (
        '[[obstacles]]\nname = "block"\nshape = "box"\n'
        "position = [0.0, 0.0, 0.1]\nsize = [0.1, 0.1, 0.2]\n"
    )
    text = SCENARIO.replace("0.0, 0.3], [0.2, 0.0, 0.3]", "0.0, 0.3], [0.1, 0.0, 0.3]")
    scenario.write_text(text + block)
    answer = subprocess.run(
        [sys.executable, "-m", "cli", "check", "--json", str(scenario)],
        capture_output=True,
        text=True,
        timeout=300.0,
    )
    assert answer.stdout == ""
    assert answer.returncode == 2
    last = answer.stderr.splitlines()[-1]
    assert last.startswith("lariat: start: ")
    assert "inside obstacle 'block'" in last


def test_no_running_stack_is_a_failure(capfd: pytest.CaptureFixture[str]) -> None:
    hub = f"tcp/127.0.0.1:{free_port()}"
    for verb in ("start", "status", "ack"):
        assert lariat.main([verb, "--connect", hub]) == 1
        out, err = capfd.readouterr()
        assert out == ""
        assert hub in err
        assert "`lariat up`" in err
        assert err.count("\n") == 1


def test_help_is_there_for_every_verb_and_comes_at_once() -> None:
    answer = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "cli", "--help"],
        capture_output=True,
        text=True,
        timeout=30.0,
    )
    assert answer.returncode == 0
    for verb in lariat.VERBS:
        assert f"\n  {verb} " in answer.stdout
    # What takes its time to import stays out.
    for library in ("taichi", "torch", "zenoh", "numpy", "tyro"):
        assert f"| {library}\n" not in answer.stderr


@pytest.mark.parametrize("verb", ["up", "check", "status", "goal", "start", "arm", "ack"])
def test_the_help_of_a_verb_shows_how_it_is_used(
    verb: str, capfd: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        lariat.main([verb, "--help"])
    assert end.value.code == 0
    out = capfd.readouterr().out
    assert f"Examples:\n  lariat {verb}" in out


def test_options_before_a_client_verb_belong_to_it(capfd: pytest.CaptureFixture[str]) -> None:
    hub = f"tcp/127.0.0.1:{free_port()}"
    assert lariat.main(["--connect", hub, "--namespace", "far", "start", "--json"]) == 1
    assert hub in capfd.readouterr().err


def test_check_answers_with_one_object(scenario: Path) -> None:
    answer = subprocess.run(
        [sys.executable, "-m", "cli", "check", "--json", str(scenario)],
        capture_output=True,
        text=True,
        timeout=300.0,
    )
    assert answer.returncode == 0
    report = json.loads(answer.stdout)
    assert report["ok"] is True
    # A rope of 0.45 m between grips 0.4 m apart sags by about 0.09 m, 0.2 m above the table.
    assert 150.0 < report["shapes"]["start"]["clearance_mm"] < 250.0
    assert report["shapes"]["start"]["nearest"] == "table"


@pytest.mark.parametrize(("verb", "usage"), [("goal", "[PATH]"), ("export", "[PATH ...]")])
def test_help_speaks_of_files_and_not_of_types(
    verb: str, usage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        lariat.main([verb, "--help"])
    text = capsys.readouterr().out
    assert text.splitlines()[0].endswith(usage)
    assert "None}" not in text
