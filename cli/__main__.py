"""Command line: `lariat VERB`.

A verb's module is imported when the verb is used: `lariat --help` does not wait for compilers.
"""

from __future__ import annotations

import importlib
import io
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from functools import wraps
from typing import Any

from lariat.plain_text import plain_text
from lariat.suggestion import did_you_mean
from shared.runtime.closed_pipe import ending_with_the_reader
from stack.launcher.library_environment import LIBRARY_ENVIRONMENT

SUCCESS, FAILURE, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130
"""Exit codes."""

VERBS = {
    "up": ("cli.up:main", "start the live stack with dashboard and recorder"),
    "run": ("cli.run:main", "run the closed loop in simulated time, headless"),
    "check": ("cli.check:main", "check a scenario before anything moves"),
    "shape": ("cli.shape:main", "write a rest shape of a scenario's true rope as a goal"),
    "cover": ("cli.cover:main", "write a mesh or a depth image as obstacles of a scenario"),
    "status": ("cli.status:main", "show the state of a running stack"),
    "goal": ("cli.goal:main", "set the goal of a running stack"),
    "start": ("cli.task:start", "start the run, or resume a paused one"),
    "pause": ("cli.task:pause", "pause the run: the arms hold"),
    "stop": ("cli.task:stop", "end the run: the arms hold"),
    "reset": ("cli.task:reset", "return rope and arms to the start (simulation only)"),
    "restore": ("cli.task:restore", "reset goal and obstacles as well (simulation only)"),
    "arm": ("cli.arm:arm", "allow the arms to move"),
    "disarm": ("cli.arm:disarm", "stop the arms and keep them still"),
    "approach": ("cli.arm:approach", "let the arms go to the start while you hold a key"),
    "ack": ("cli.arm:ack", "acknowledge the reason of a hold"),
    "resume": ("cli.arm:resume", "let acknowledged arms move again"),
    "grip": ("cli.arm:grip", "open or close a gripper"),
    "show": ("cli.show:main", "open a recording in the dashboard, with a time bar"),
    "watch": ("cli.watch:main", "serve a running stack to Foxglove, live and read-only"),
    "replay": ("cli.replay:main", "rerun services on recorded inputs and compare their outputs"),
    "export": ("cli.export:main", "write a recording for Foxglove, Rerun, ROS 2 or as tables"),
    "repair": ("cli.repair:main", "copy the readable part of a damaged recording"),
    "identify": ("cli.identify:main", "identify a rope's material from its measured motion"),
    "calibrate": (
        "cli.calibrate:main",
        "estimate the camera's pose from a marker that an arm carries",
    ),
    "certs": ("cli.certs:main", "make certificates and access rules for the bus of a cell"),
    "ros2": ("cli.ros2:main", "list the topics of the cell's ROS 2 node"),
    "see": ("cli.see:main", "find the centrelines of ropes in an image"),
    "bench": ("", "run a benchmark and print its table"),
}
"""Function, as `module:function`, and summary of each verb."""
CLIENT_VERBS = (
    "status",
    "goal",
    "start",
    "pause",
    "stop",
    "reset",
    "restore",
    "arm",
    "disarm",
    "ack",
    "grip",
    "approach",
    "resume",
    "watch",
)
"""Verbs that talk to a running stack."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one verb.

    Args:
        arguments: Words after `lariat`; by default those of the command line.

    Returns:
        0 for success, 1 for failure, 2 for bad input, 130 after Ctrl-C, 141 if the reader of
        standard output has gone.
    """
    with ending_with_the_reader():
        return _run(arguments)


def _run(arguments: Sequence[str] | None) -> int:
    """Run one verb; see `main`."""
    for name, value in LIBRARY_ENVIRONMENT.items():
        os.environ.setdefault(name, value)
    argv = list(sys.argv[1:] if arguments is None else arguments)
    if not argv or argv[0] in ("-h", "--help"):
        print(_help())
        return SUCCESS if argv else BAD_INPUT
    if argv[0] == "--version":
        from shared.version import commit, version

        print(f"lariat {version()} {commit()}".rstrip())
        return SUCCESS
    argv = _verb_first(argv)
    verb, *rest = argv
    if verb not in VERBS:
        hint = did_you_mean(verb, VERBS) or " `lariat --help` lists them"
        return _refuse(f"unknown verb {verb!r};{hint}")
    if verb == "bench":
        return _bench(rest)
    return _call(VERBS[verb][0], f"lariat {verb}", rest)


def _call(target: str, prog: str, arguments: Sequence[str]) -> int:
    """Import `module:function` and run it with arguments of the command line."""
    import inspect

    import tyro

    module, _, function = target.partition(":")
    try:
        verb: Callable[..., int | None] = getattr(importlib.import_module(module), function)
        text = re.split(r"\n(?:Args|Returns):", inspect.cleandoc(verb.__doc__ or ""))[0].rstrip()

        @wraps(verb)
        def parsed(*values: object, **options: object) -> tuple[Any, dict[str, Any]]:
            return values, options

        said = io.StringIO()
        try:
            with _plain_usage() if {"-h", "--help"} & set(arguments) else redirect_stderr(said):
                values, options = tyro.cli(
                    parsed, prog=prog, description=text, args=list(arguments)
                )
        except SystemExit as end:
            if not end.code:
                raise
            return _refuse(f"{_first_words(said.getvalue())}; {prog} --help explains")
        _check_finite(options)
        return verb(*values, **options) or SUCCESS
    except ImportError as error:
        return _refuse(_missing(prog, module, error))
    except KeyboardInterrupt:
        return INTERRUPTED
    except Exception as error:
        return _report(error)


def _first_words(box: str) -> str:
    """Return what a box of the parser says, down to its first rule, in one line."""
    lines = [line.strip("│ ") for line in box.splitlines() if not line.startswith(("╭", "╰"))]
    count = next((k for k, line in enumerate(lines) if line.startswith("──")), len(lines))
    text = re.sub(r"\[/?bold\]|\(required\)", "", " ".join(lines[:count]))
    return " ".join(text.split()).removesuffix(".")


def _check_finite(options: Mapping[str, object]) -> None:
    """Check the numbers of options."""
    from lariat.configuration import MAX_NUMBER, ConfigurationError

    for name, value in options.items():
        for number in value if isinstance(value, tuple) else (value,):
            if isinstance(number, int | float) and not abs(number) <= MAX_NUMBER:
                raise ConfigurationError(
                    f"--{name.strip('_').replace('_', '-')} takes finite numbers within "
                    f"±{MAX_NUMBER:g}, got {number}"
                )


@contextmanager
def _plain_usage() -> Iterator[None]:
    """Print a help without what the parser says of Python's types: `{None}|PATH` is `PATH`."""
    printed = io.StringIO()
    try:
        with redirect_stdout(printed):
            yield
    finally:
        text = re.sub(r"\[\[(\w+) \[\1 \.\.\.\]\]\]", r"[\1 ...]     ", printed.getvalue())
        text = re.sub(r"\{None\}\|(.*?)(?=  |$)", r"\1       ", text, flags=re.MULTILINE)
        print("\n".join(line.rstrip() for line in text.splitlines()))


def _report(error: Exception) -> int:
    """Report an error that a person can cure, and return the exit code; raise any other."""
    from lariat.configuration import ConfigurationError, reason_of
    from shared.bus import BusError, Unreachable
    from stack.client import RequestFailed

    if isinstance(error, RequestFailed | Unreachable):
        _refuse(str(error))
        return FAILURE
    if isinstance(error, ConfigurationError | BusError):
        return _refuse(str(error))
    # What a file or a disk of others causes; readers say of which file. A reader of standard output
    # that has gone is no fault.
    cured = isinstance(error, OSError | MemoryError | RecursionError)
    if cured and not isinstance(error, BrokenPipeError):
        return _refuse(reason_of(error))
    raise error


def _bench(arguments: Sequence[str]) -> int:
    try:
        from benchmarks.benches import BENCHES, find
    except ModuleNotFoundError:
        return _refuse("this installation has no benchmarks; use a clone of the repository")
    if not arguments or arguments[0] in ("-h", "--help"):
        benches = "\n".join(f"  {name:22}{bench.summary}" for name, bench in BENCHES.items())
        print(
            "usage: lariat bench NAME [PART] [OPTIONS]\n\n"
            f"{benches}\n\n`lariat bench NAME --help` explains one."
        )
        return SUCCESS if arguments else BAD_INPUT
    try:
        name, rest = find(list(arguments))
    except KeyError:
        words = " ".join(arguments[:2])
        hint = did_you_mean(words, BENCHES) or f" choose one of {', '.join(BENCHES)}"
        return _refuse(f"unknown benchmark {words!r};{hint}")
    return _call(f"{BENCHES[name].module}:run", f"lariat bench {name}", rest)


def _verb_first(argv: list[str]) -> list[str]:
    """Arguments with the options before a client verb moved behind it, so that an alias can name
    a cell:
    `alias cell2="lariat --connect tcp/cell2:7448 --mode client"`, then `cell2 start`."""
    if not argv[0].startswith("-"):
        return argv
    place = next((k for k, word in enumerate(argv) if word in CLIENT_VERBS), None)
    return argv if place is None else [argv[place], *argv[place + 1 :], *argv[:place]]


def _missing(prog: str, module: str, error: ImportError) -> str:
    library = (error.name or str(error)).partition(".")[0]
    if library in ("lariat", "shared", "services", "dashboard", "stack", "benchmarks", "cli"):
        if not isinstance(error, ModuleNotFoundError):
            raise error  # The module exists but imports a missing name: a programming error.
        return f"{prog} is not part of this installation ({error.name or error})"
    return f"{prog} needs {library}, which is not installed; `make .venv/installed` installs it"


def _refuse(line: str) -> int:
    print(f"lariat: {plain_text(line)}", file=sys.stderr)
    return BAD_INPUT


def _help() -> str:
    verbs = "\n".join(f"  {verb:11}{text}" for verb, (_, text) in VERBS.items())
    return (
        "usage: lariat VERB [OPTIONS]\n\nShapes ropes and cables with a robot.\n\n"
        f"{verbs}\n\n"
        "`lariat VERB --help` explains one. --json answers with one JSON object on standard\n"
        "output. Exit codes: 0 success, 1 failure, 2 bad input.\n\n"
        "  lariat up three-cylinders\n"
        "  lariat run three-cylinders --json\n"
        "  lariat start"
    )


if __name__ == "__main__":
    sys.exit(main())
