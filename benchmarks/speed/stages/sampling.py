"""Call stacks of running processes, sampled from outside by py-spy.

The sampled code holds no clocks for it. A child of py-spy may always be sampled; a process that
runs already, by its owner where the kernel lets it (`kernel.yama.ptrace_scope` is 0) and by root.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.speed.stages.stages import Frame, Sample
from lariat.configuration import ConfigurationError

SAMPLING_RATE = 200
"""Samples per second [Hz]."""
WAITING = ("/threading.py", "/selectors.py", "/concurrent/futures/thread.py")
"""Files whose functions wait for another thread or a socket where they are innermost; py-spy takes
some of these threads for busy ones."""
PACE = ("/shared/runtime/live.py", "_keep_pace")
"""File and function in which a process waits for its next step."""


def sample_command(command: Sequence[str], keep: Path | None) -> tuple[str, list[Sample]]:
    """Run a command and return its standard output and its samples.

    Args:
        command: Program and arguments.
        keep: File for the profile in speedscope's format; by default it is not kept.

    Raises:
        ConfigurationError: py-spy is missing, or the command fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "profile.json"
        arguments = [*_py_spy(file), "--", *command]
        done = subprocess.run(arguments, stdout=subprocess.PIPE, text=True, check=False)
        if not file.exists():
            raise ConfigurationError(f"{' '.join(command)}: exit code {done.returncode}")
        _keep(file, keep)
        return done.stdout, read(file)


def sample_processes(
    processes: Mapping[str, int], duration: int, keep: Path | None
) -> dict[str, list[Sample]]:
    """Return the samples of processes that run, taken at the same time.

    Args:
        processes: Process id by name.
        duration: Duration [s].
        keep: Folder for the profiles in speedscope's format; by default they are not kept.

    Raises:
        ConfigurationError: py-spy is missing, or may not sample a process.
    """
    with tempfile.TemporaryDirectory() as folder:
        files = {name: Path(folder) / f"{name}.json" for name in processes}
        samplers = {
            name: subprocess.Popen(
                [*_py_spy(files[name]), "--pid", str(pid), "--duration", str(duration)],
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                text=True,
            )
            for name, pid in processes.items()
        }
        for name, sampler in samplers.items():
            _, problem = sampler.communicate()
            if sampler.returncode:
                way_out = "sample as root, or set kernel.yama.ptrace_scope to 0"
                line = problem.strip().splitlines()[-1] if problem.strip() else "no reason given"
                raise ConfigurationError(f"{name} cannot be sampled ({line}); {way_out}")
            _keep(files[name], keep and keep / f"{name}.json")
        return {name: read(file) for name, file in files.items()}


def read(file: Path) -> list[Sample]:
    """Return a profile in speedscope's format, without the samples of threads that wait."""
    profile = json.loads(file.read_text())
    # A method has the name of its class before it, where py-spy can tell.
    frames = [
        Frame(f.get("file") or "", f["name"].rpartition(".")[2])
        for f in profile["shared"]["frames"]
    ]
    return [
        Sample(tuple(frames[k] for k in stack), weight)
        for thread in profile["profiles"]
        for stack, weight in zip(thread["samples"], thread["weights"], strict=True)
        if stack and not _waits(frames[stack[-1]])
    ]


def _waits(innermost: Frame) -> bool:
    if innermost.file.endswith(PACE[0]):
        return innermost.function == PACE[1]
    return innermost.file.endswith(WAITING)


def _py_spy(file: Path) -> list[str]:
    beside = Path(sys.executable).with_name("py-spy")
    program = str(beside) if beside.exists() else shutil.which("py-spy")
    if program is None:
        raise ConfigurationError("py-spy is not installed; pip install -e '.[profile]'")
    return [
        program,
        "record",
        "--rate",
        str(SAMPLING_RATE),
        "--format",
        "speedscope",
        "--output",
        str(file),
    ]


def _keep(file: Path, keep: Path | None) -> None:
    if keep is not None:
        keep.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(file, keep)
