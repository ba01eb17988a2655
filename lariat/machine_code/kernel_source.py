"""Kernel of Taichi and the sources that it is compiled from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

ROOT = Path(__file__).parents[2]
"""Folder of the package `lariat` that this module belongs to."""
COMPILER_MODULES = (
    "lariat.machine_code.compilation",
    "lariat.machine_code.taichi_runtime",
    "lariat.machine_code.target_processor",
)
"""Modules with the settings of the compiler."""

Kernel = Callable[..., object]
"""Function of the kernel's arguments: contiguous arrays and numbers."""


class Trial(NamedTuple):
    """Launch by which a library is compared with Taichi's kernel."""

    arguments: Sequence[np.ndarray[Any, Any] | float]
    """Arguments of the kernel; floats are doubles, integers have 32 bits."""
    results: Sequence[np.ndarray[Any, Any]]
    """Arrays that the kernel writes: arguments, or views into them."""


@dataclass(frozen=True)
class KernelSource:
    """Kernel of Taichi, the sources that it is compiled from, and trials of it."""

    name: str
    """Name of its libraries' files."""
    function: str
    """Kernel, as `package.module:function`, all of whose loops are serialized."""
    modules: tuple[str, ...]
    """Modules and packages with the source of the kernel and its constants; all of them, and no
    others below a package, are imported with the kernel."""
    trials: str
    """Function, as `package.module:function`, that returns a list of new `Trial`s, equal at every
    call, which together run every part of the kernel."""
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
