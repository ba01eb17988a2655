"""Page of capabilities: it names all that a user can do, and tests that exist."""

from __future__ import annotations

import re
from dataclasses import fields
from pathlib import Path

import pytest

from cli.__main__ import VERBS
from cli.export import OUTPUT_NAMES
from lariat.scenario import Scenario
from lariat.scenario.sections import DRIVERS
from shared.topics import TOPICS

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "reference" / "capabilities.md").read_text()
TESTS = re.findall(r"`(tests/[\w/]+\.py)(?:::(\w+))?`", PAGE)
UNLISTED_KEYS = {"version", "name", "description", "seed", "table", "folder", "text"}
"""Fields of a scenario that are no section."""


@pytest.mark.parametrize(("file", "name"), TESTS, ids=lambda part: Path(part).stem if part else "")
def test_every_test_that_holds_a_capability_exists(file: str, name: str):
    assert f"def {name or 'test_'}" in (ROOT / file).read_text()


def test_every_verb_export_driver_section_and_topic_is_on_the_page():
    words = {word for code in re.findall(r"`([^`]+)`", PAGE) for word in code.split()}
    wanted = {*VERBS, *OUTPUT_NAMES, *DRIVERS.included, *(topic.key for topic in TOPICS)}
    wanted |= {field.name for field in fields(Scenario)} - UNLISTED_KEYS
    assert wanted - words == set()


def test_every_package_of_the_library_is_on_the_page():
    packages = {f"lariat.{path.parent.name}" for path in (ROOT / "lariat").glob("*/__init__.py")}
    helpers = {"lariat.files", "lariat.kernel_cache", "lariat.shapes"}
    assert packages - helpers - set(re.findall(r"`([\w.]+)`", PAGE)) == set()
