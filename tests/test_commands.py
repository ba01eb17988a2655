"""Commands in documentation and help: each `lariat …` line is one that the program takes."""

from __future__ import annotations

import contextlib
import functools
import importlib
import io
import re
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import tyro

from benchmarks.benches import BENCHES, find
from cli.__main__ import VERBS, _verb_first

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
PLACEHOLDER = re.compile(r"(?:[\w-]+/)*[A-Z][A-Z_]+[.a-z0-9]*|…|\.\.\.|\{\w+\}|\[.*\]")
"""Words that stand for others: FILE, NAME, FILE.npz, folder/NAME.mcap, …"""
REPOSITORY_PATH = re.compile(r"(?:tests|scenarios|docs|benchmarks)/\S+")


def commands_of_text(text: str) -> Iterator[str]:
    """Words after `lariat` of each command in a page."""
    blocks = re.findall(r"^```\w*\n(.*?)^```", text, re.M | re.S)
    for line in (line for block in blocks for line in block.splitlines()):
        if match := re.match(r"\s*(?:\.venv/bin/)?lariat ([a-z].*)", line):
            yield match[1]
    prose = re.sub(r"^```.*?^```", "", text, flags=re.M | re.S)
    for code in re.findall(r"`([^`]+)`", prose):
        if match := re.match(r"(?:\.venv/bin/)?lariat ([a-z].*)", " ".join(code.split())):
            yield match[1]


def commands() -> Iterator[tuple[str, str]]:
    """Every command, with the page or the verb whose help prints it."""
    for page in PAGES:
        if page.name != "CHANGELOG.md":
            for command in commands_of_text(page.read_text()):
                yield str(page.relative_to(ROOT)), command
    for verb, (target, _) in VERBS.items():
        if target:
            yield from ((f"{verb} --help", c) for c in examples(function(target)))
    for name, bench in BENCHES.items():
        found = examples(function(f"{bench.module}:run"))
        yield from ((f"bench {name} --help", command) for command in found)


def function(target: str) -> Callable:
    module, _, name = target.partition(":")
    return getattr(importlib.import_module(module), name)


def examples(verb: Callable) -> list[str]:
    lines = (verb.__doc__ or "").splitlines()
    found = [re.match(r"\s+lariat (\S.*)", line) for line in lines]
    return [match[1].rstrip(".,") for match in found if match]


def problem(command: str) -> str:
    """Why the program would not take a command; empty if it takes it."""
    words = _verb_first(shlex.split(command.split("  #")[0].split(" | ")[0].split(" > ")[0]))
    verb, *rest = words
    if verb not in VERBS:
        return f"no verb {verb}"
    target = VERBS[verb][0]
    if verb == "bench":
        if not rest or PLACEHOLDER.fullmatch(rest[0]) or rest[0] == "--help":
            return ""
        try:
            name, rest = find(rest)
        except KeyError:
            return f"no benchmark {' '.join(rest[:2])}"
        target = f"{BENCHES[name].module}:run"
    files = [w for w in rest if REPOSITORY_PATH.fullmatch(w) and not PLACEHOLDER.fullmatch(w)]
    if missing := [word for word in files if not (ROOT / word).exists()]:
        return f"no file {missing[0]}"
    if not rest or "--help" in rest or any(PLACEHOLDER.fullmatch(word) for word in rest):
        # A mention of the verb, not a command with all its words; its options must exist.
        known = options(target)
        strange = [w for w in rest if w.startswith("--") and w.partition("=")[0] not in known]
        return f"no option {strange[0]}" if strange else ""
    return refusal(target, rest)


@functools.cache
def options(target: str) -> frozenset[str]:
    with contextlib.redirect_stdout(io.StringIO()) as text, contextlib.suppress(SystemExit):
        tyro.cli(function(target), args=["--help"])
    return frozenset(re.findall(r"--[\w-]+", text.getvalue()))


def refusal(target: str, words: list[str]) -> str:
    """Run the parser alone, with a function that does nothing."""
    verb = function(target)

    @functools.wraps(verb)
    def parsed(*_args, **_kwargs) -> int:
        return 0

    try:
        tyro.cli(parsed, args=words, console_outputs=False)
    except SystemExit as end:
        return "" if end.code == 0 else "its words are refused"
    return ""


def test_every_command_in_pages_and_help_is_taken():
    found = list(commands())
    assert len(found) > 80
    wrong = {
        f"{place}: lariat {command}": why for place, command in found if (why := problem(command))
    }
    assert wrong == {}


@pytest.mark.parametrize(
    ("command", "why"),
    [
        ("fly", "no verb fly"),
        ("bench birds", "no benchmark birds"),
        ("replay tests/replay/reference.mcap", "no file tests/replay/reference.mcap"),
        ("run three-cylinders --recrod x", "its words are refused"),
        ("run SCENARIO --recrod x", "no option --recrod"),
        ("grip shut", "its words are refused"),
    ],
)
def test_a_wrong_command_is_found(command: str, why: str):
    assert problem(command) == why
