"""Locks of the dependencies: complete, by hash, and without the name of a registry."""

from __future__ import annotations

import importlib.util
import re
from pathlib import Path
from types import ModuleType

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

FOLDER = Path(__file__).parents[1] / "requirements"
PARTS = sorted(path.stem for path in FOLDER.glob("*.txt"))


@pytest.fixture(scope="module")
def lock() -> ModuleType:
    spec = importlib.util.spec_from_file_location("lock", FOLDER / "lock.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("part", PARTS)
def test_lock_holds_every_dependency_by_version_and_hash(part: str, lock: ModuleType) -> None:
    text = (FOLDER / f"{part}.txt").read_text()
    assert "://" not in text
    entries = dict(re.findall(r"^([\w.-]+)==(\S+)(?: ;.*)? \\\n    --hash=sha256:", text, re.M))
    locked = {canonicalize_name(name): version for name, version in entries.items()}
    assert len(locked) == len(re.findall(r"^[\w.-]+==", text, re.M))
    for wanted in lock.requirements(part):
        requirement = Requirement(wanted)
        name = canonicalize_name(requirement.name)
        if name != "torch":
            assert name in locked, f"{part} lacks {wanted}; run `make lock`"
            assert requirement.specifier.contains(locked[name]), f"{wanted}; run `make lock`"


def test_parts_agree_on_every_version(lock: ModuleType) -> None:
    versions: dict[str, set[str]] = {}
    for part in PARTS:
        for name, version in re.findall(
            r"^(\S+)==(\S+)", (FOLDER / f"{part}.txt").read_text(), re.M
        ):
            versions.setdefault(name, set()).add(version)
    assert {name: v for name, v in versions.items() if len(v) > 1} == {}
    assert set(PARTS) == {"all", "dev", *lock.IMAGES}


def test_torch_stays_the_choice_of_the_user(lock: ModuleType) -> None:
    text = "a==1 \\\n    --hash=sha256:0\nnvidia-cublas-cu12==1\ntorch==2 \\\n    --hash=x\nb==2\n"
    assert lock.without_torch(text) == "a==1 \\\n    --hash=sha256:0\nb==2\n"
