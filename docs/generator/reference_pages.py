"""MkDocs hook: pages of the reference that are written from the code at every build."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from mkdocs.structure.files import File

if TYPE_CHECKING:
    from mkdocs.config.defaults import MkDocsConfig
    from mkdocs.structure.files import Files

ROOT = Path(__file__).parents[2]
"""Folder of the repository."""
HELP_COLUMNS = "96"
"""Width of the commands' help [characters]."""
LIBRARY = {
    "runs": (
        "stack.simulation.closed_loop",
        "stack.simulation.simulated_run",
        "stack.simulation.score",
        "lariat.scenario.settings",
    ),
    "rod": ("lariat.rod", "lariat.rod.torch"),
    "identification": ("lariat.identification",),
    "xpbd": ("lariat.paper.xpbd",),
    "geometry": ("lariat.geometry", "lariat.geometry.poses", "lariat.geometry.polylines"),
    "trajectory": ("lariat.trajectory",),
    "protocols": ("lariat.protocols",),
    "environments": (
        "environments.shape_control",
        "environments.scenes",
    ),
}
"""Packages of each page of the library's reference."""

PATHS = (
    "reference/scenario.md",
    "reference/commands.md",
    "reference/topics.md",
    "reference/messages.md",
    "reference/processes.md",
    *(f"reference/library/{name}.md" for name in LIBRARY),
)
"""Paths of the written pages, below `docs/`."""


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Return the files of the site with the written pages."""
    if str(ROOT) not in sys.path:
        sys.path.insert(0, str(ROOT))
    for path, content in pages():
        files.append(File.generated(config, path, content=content))
    return files


def pages() -> Iterator[tuple[str, str]]:
    """Yield path and Markdown of every written page."""
    # Taichi complains of a replaced standard output where it is imported with one.
    os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "False")
    importlib.import_module("lariat.kernel_cache.language")
    library = (_library(name.capitalize(), packages) for name, packages in LIBRARY.items())
    from lariat.scenario.reference import reference

    written = (reference(), _commands(), _topics(), _messages(), _processes(), *library)
    yield from zip(PATHS, written, strict=True)


def _library(title: str, packages: Sequence[str]) -> str:
    return f"# {title}\n\n" + "\n\n".join(f"::: {package}" for package in packages) + "\n"


def _topics() -> str:
    from shared.topics import TOPICS

    rows = [
        f"| `{t.key}` | {t.type.DESCRIPTOR.full_name} | {t.owner} | {t.buffering} | "
        f"{t.max_size // 1024} KiB |"
        for t in TOPICS
    ]
    return "\n".join(
        [
            "# Topics\n",
            "Topics of the bus, from `shared/topics.py`. Keys are relative to the cell's",
            "namespace. [Messages](messages.md) have the fields.\n",
            "An inbox keeps the newest message of a topic with buffering `latest`, all messages",
            "of `every`, and of `joined` the newest with one stamp on several topics. A message",
            "beyond the largest size is dropped where it arrives.\n",
            "| key | message | owner | buffering | largest message |",
            "|---|---|---|---|---|",
            *rows,
            "",
        ]
    )


def _messages() -> str:
    parts = [
        "# Messages\n",
        "Messages of the bus, from `shared/messages`. Stamps are integer nanoseconds, quantities",
        "are SI, quaternions are wxyz, lists of points are flat. [Topics](topics.md) name the",
        "message of each key; the `foxglove` messages are those of Foxglove's schemas.\n",
    ]
    for file in sorted((ROOT / "shared" / "messages").glob("*.proto")):
        parts.append(f"## `{file.name}`\n\n```protobuf\n{file.read_text()}```\n")
    return "\n".join(parts)


def _processes() -> str:
    from stack.services import ALL

    parts = [
        "# Processes\n",
        "Each process is a *step* from an inbox to publications (`shared/runtime/service.py`); its",
        "rate is the number of steps in a second. Beside the [topics](topics.md) named here, every",
        "process writes its own `health/NAME`, `trace/NAME` and `log/NAME`, and the recorder hears",
        "all topics.\n",
    ]
    for name in ALL:
        package = name if name == "dashboard" else f"services.{name}"
        module = importlib.import_module(f"{package}.service")
        (process,) = (
            kind
            for kind in vars(module).values()
            if isinstance(kind, type)
            and kind.__module__ == module.__name__
            and getattr(kind, "name", None) == name
        )
        about = (module.__doc__ or "").partition("\n")[0]
        rows = [
            (word, ", ".join(f"`{t.key}`" for t in topics) or "none")
            for word, topics in (("reads", process.reads), ("writes", process.writes))
        ]
        table = "\n".join(f"| {word} | {keys} |" for word, keys in rows)
        parts.append(
            f"## `{name}`\n\n{about}\n\n| | |\n|---|---|\n"
            f"| folder | `{package.replace('.', '/')}` |\n| rate | {process.rate:g} Hz |\n{table}\n"
        )
    return "\n".join(parts)


def _commands() -> str:
    from benchmarks.benches import BENCHES
    from cli.__main__ import VERBS

    parts = ["# Commands\n", f"```\n{_help()}```\n"]
    for verb, (_, summary) in VERBS.items():
        if verb != "bench":
            parts.append(f"## `lariat {verb}`\n\n{_sentence(summary)}\n\n```\n{_help(verb)}```\n")
    parts.append("## `lariat bench`\n\nRun a benchmark and print its table.\n")
    for name, bench in BENCHES.items():
        text = _help("bench", *name.split())
        parts.append(f"### `lariat bench {name}`\n\n{_sentence(bench.summary)}\n\n```\n{text}```\n")
    return "\n".join(parts)


def _sentence(summary: str) -> str:
    return summary[:1].upper() + summary[1:] + "."


def _help(*words: str) -> str:
    """Help of a command, without colours."""
    from cli.__main__ import main

    captured = io.StringIO()
    before = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = HELP_COLUMNS
    try:
        with contextlib.redirect_stdout(captured), contextlib.suppress(SystemExit):
            main([*words, "--help"])
    finally:
        os.environ.pop("COLUMNS")
        if before is not None:
            os.environ["COLUMNS"] = before
    lines = (line.rstrip() for line in captured.getvalue().splitlines())
    return "\n".join(lines).strip("\n") + "\n"
