"""`lariat VERB`: what a person types.

A verb is imported when it is asked for: `lariat --help` must not wait for compilers.
"""

from __future__ import annotations

import importlib
import os
import sys
from collections.abc import Callable, Sequence

from stack.launcher.library_environment import LIBRARY_ENVIRONMENT

SUCCESS, FAILURE, BAD_INPUT, INTERRUPTED = 0, 1, 2, 130

VERBS = {
    "up": ("cli.up:main", "the whole stack, live, with dashboard and recorder"),
    "run": ("cli.run:main", "the closed loop on simulated time, headless"),
    "check": ("cli.check:main", "say what is wrong with a scenario"),
    "status": ("cli.status:main", "how a running stack is"),
    "goal": ("cli.goal:main", "set the goal of a running stack"),
    "start": ("cli.task:start", "start the run, or resume a paused one"),
    "pause": ("cli.task:pause", "pause the run; the arms hold"),
    "stop": ("cli.task:stop", "end the run; the arms hold"),
    "reset": ("cli.task:reset", "rope and arms back to the start; simulation only"),
    "arm": ("cli.arm:arm", "allow the arms to move"),
    "disarm": ("cli.arm:disarm", "stop the arms and keep them still"),
    "ack": ("cli.arm:ack", "acknowledge why the arms hold"),
    "grip": ("cli.arm:grip", "open or close a gripper"),
    "show": ("cli.show:main", "a recording in the dashboard, with a time bar"),
    "replay": ("cli.replay:main", "feed services their recorded inputs, compare outputs"),
    "repair": ("cli.repair:main", "make a cut recording whole"),
    "identify": ("cli.identify:main", "a rope's material from its measured motion"),
    "calibrate": ("cli.calibrate:main", "where the camera stands, by a marker on an arm"),
    "see": ("cli.see:main", "the rope in one picture, from any camera"),
    "bench": ("", "a table of the paper, or a speed"),
}
TALKING = ("status", "goal", "start", "pause", "stop", "reset", "arm", "disarm", "ack", "grip")


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs one verb; its exit code."""
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
        return _refuse(f"unknown verb {verb!r}; `lariat --help` lists them")
    if verb == "bench":
        return _bench(rest)
    return _call(VERBS[verb][0], f"lariat {verb}", rest)


def _call(target: str, prog: str, arguments: Sequence[str]) -> int:
    """Imports `module:function` and runs it with arguments of the command line."""
    import inspect

    import tyro

    from shared.bus import BusError, Unreachable
    from shared.configuration import ConfigurationError
    from stack.client import Unanswered

    module, _, function = target.partition(":")
    try:
        verb: Callable[..., int | None] = getattr(importlib.import_module(module), function)
        text = inspect.cleandoc(verb.__doc__ or "").partition("\nArgs:")[0].rstrip()
        return tyro.cli(verb, prog=prog, description=text, args=list(arguments)) or SUCCESS
    except ImportError as error:
        return _refuse(_missing(prog, module, error))
    except (Unanswered, Unreachable) as error:
        print(f"lariat: {error}", file=sys.stderr)
        return FAILURE
    except (ConfigurationError, BusError) as error:
        return _refuse(str(error))
    except KeyboardInterrupt:
        return INTERRUPTED


def _bench(arguments: Sequence[str]) -> int:
    try:
        from benchmarks.benches import BENCHES
    except ModuleNotFoundError:
        return _refuse("there are no benches here; update the installation")
    if not arguments or arguments[0] in ("-h", "--help"):
        benches = "\n".join(f"  {name:12}{bench.summary}" for name, bench in BENCHES.items())
        print(
            "usage: lariat bench NAME [OPTIONS]\n\n"
            f"{benches}\n\n`lariat bench NAME --help` explains one."
        )
        return SUCCESS if arguments else BAD_INPUT
    name, *rest = arguments
    if name not in BENCHES:
        return _refuse(f"no bench {name!r}; there are {', '.join(BENCHES)}")
    return _call(f"{BENCHES[name].module}:run", f"lariat bench {name}", rest)


def _verb_first(argv: list[str]) -> list[str]:
    """Options before a talking verb count as its own, so that an alias can hold the cell:
    `alias cell2="lariat --connect tcp/cell2:7447 --mode client"`, then `cell2 start`."""
    if not argv[0].startswith("-"):
        return argv
    place = next((k for k, word in enumerate(argv) if word in TALKING), None)
    return argv if place is None else [argv[place], *argv[place + 1 :], *argv[:place]]


def _missing(prog: str, module: str, error: ImportError) -> str:
    library = (error.name or str(error)).partition(".")[0]
    if library in ("lariat", "shared", "services", "dashboard", "stack", "benchmarks", "cli"):
        if not isinstance(error, ModuleNotFoundError):
            raise error  # The file is there and asks for what is not: a mistake of ours.
        return f"{prog} is not part of this installation ({error.name or error})"
    return f"{prog} needs {library}, which is not installed; run `make .venv/installed` in the clone"


def _refuse(line: str) -> int:
    print(f"lariat: {line}", file=sys.stderr)
    return BAD_INPUT


def _help() -> str:
    verbs = "\n".join(f"  {verb:10}{text}" for verb, (_, text) in VERBS.items())
    return (
        "usage: lariat VERB [OPTIONS]\n\nShapes ropes and cables with a robot.\n\n"
        f"{verbs}\n\n"
        "`lariat VERB --help` explains one. --json answers with one JSON object on standard\n"
        "output. Exit codes: 0 success, 1 an honest failure, 2 bad input.\n\n"
        "  lariat up three-cylinders\n"
        "  lariat run three-cylinders --json\n"
        "  lariat start"
    )


if __name__ == "__main__":
    sys.exit(main())
