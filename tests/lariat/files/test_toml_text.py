"""TOML is read in bounded time, and as the parser reads it."""

from __future__ import annotations

import time
import tomllib
from pathlib import Path

import pytest

from lariat.files.toml_text import MAX_KEY_DEPTH, MAX_TOML_SIZE, parse_toml
from lariat.scenario.shipped import SHIPPED_FOLDER

TRICKY = r'''
a = "a.b.c.d.e.f.g.h.i.j.k.l [[[[" # a.b.c.d.e.f.g.h.i.j.k
b = """x "" \""" a.b.c.d.e.f.g.h.i.j.k """""
c = 'a\'
d = """a.b.c.d.e.f.g.h.i.j.k"""
e = [1.5, 1979-05-27T07:32:00.999Z, {x.y = [[1]]}]
"f.g.h.i.j.k.l.m.n.o.p.q" = 1
'''


@pytest.mark.parametrize("path", sorted(SHIPPED_FOLDER.glob("*.toml")), ids=lambda p: p.stem)
def test_shipped_scenario_is_read_as_by_the_parser(path: Path) -> None:
    assert parse_toml(path.read_text()) == tomllib.loads(path.read_text())


def test_dots_and_brackets_of_texts_and_comments_do_not_count() -> None:
    assert parse_toml(TRICKY) == tomllib.loads(TRICKY)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a" + ".a" * 30_000 + " = 1", "a key has 30001 parts"),
        ("[" + "a." * 30_000 + "a]", "a key has 30001 parts"),
        ("x = {" + '"".' * 30_000 + "a = 1}", "a key has 30001 parts"),
        ("a = 'x'\nb" + " . 'b' " * 30_000 + " = 1", "a key has 30001 parts"),
        ("a = " + "[" * 100_000, "more than 32 deep"),
        ("a = " + "{a = " * 100_000, "more than 32 deep"),
        ("#" * (MAX_TOML_SIZE + 1), "more than 1048576"),
        ('"""\\' * (MAX_TOML_SIZE // 4), "Expected '='"),
        ("a = " + "9" * 100_000, "limit"),
    ],
    ids=range(9),
)
def test_hostile_text_is_refused_at_once(text: str, words: str) -> None:
    begun = time.process_time()
    with pytest.raises(ValueError, match=words):
        parse_toml(text)
    assert time.process_time() - begun < 1.0


def test_longest_text_of_deep_keys_takes_seconds_and_not_hours() -> None:
    key = ".".join("a" * (MAX_KEY_DEPTH - 1))
    lines = "".join(f"[k{k}.{key}]\n" for k in range(MAX_TOML_SIZE // 30))
    begun = time.process_time()
    parse_toml(lines[:MAX_TOML_SIZE].rpartition("\n")[0])
    assert time.process_time() - begun < 20.0
