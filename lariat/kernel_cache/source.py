"""Kernel and the sources that it is compiled from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

ROOT = Path(__file__).parents[2]
"""Folder of the package `lariat` that this module belongs to."""
COMPILER_MODULES = tuple(f"lariat.kernel_cache.{name}" for name in ("compiler", "runtime"))
"""Modules with the settings of the compiler."""
NO_COMPILER = (
    "neither Taichi nor Quadrants is installed, and this kernel is not kept for this processor: "
    "build the container images on this machine (docker compose build); elsewhere, pip install "
    "taichi, or quadrants from Python 3.14 on"
)


class NoCompilerError(Exception):
    """Kernel that is not kept and cannot be compiled here: neither Taichi nor Quadrants is there.

    The text says in one line how to mend it.
    """

    def __init__(self, text: str = NO_COMPILER) -> None:
        super().__init__(text)


class SelfTest(NamedTuple):
    """Launch by which machine code is compared with the kernel that Taichi runs."""

    arguments: Sequence[np.ndarray[Any, Any] | float]
    """Arguments of the kernel; floats are doubles, integers have 32 bits."""
    results: Sequence[np.ndarray[Any, Any]]
    """Arrays that the kernel writes: arguments, or views into them."""


@dataclass(frozen=True)
class KernelSource:
    """Kernel, the sources that it is compiled from, and its self-tests."""

    name: str
    """Name of its files in the cache."""
    function: str
    """Kernel, as `package.module:function`, all of whose loops are serialized."""
    modules: tuple[str, ...]
    """Modules and packages with the source of the kernel and its constants."""
    self_tests: str
    """Function, as `package.module:function`, that returns a list of new `SelfTest`s, equal at
    every call, which together run every part of the kernel."""
    root: Path = ROOT
    """Folder of the packages of the kernel and of `lariat`."""

    @property
    def packages(self) -> tuple[str, ...]:
        """Packages in the root that the compiling process imports."""
        return tuple(dict.fromkeys(("lariat", self.function.partition(".")[0])))

    @property
    def all_modules(self) -> tuple[str, ...]:
        """Modules of the kernel and of its compiler."""
        return (*self.modules, *COMPILER_MODULES)
