"""Key of the kernel's machine code: a hash of everything that the code is made from.

The key is computed twice, independently: from the files of this package, by the process that looks
for the machine code, and from the files of the modules that were imported, by the process that
compiles it. The latter writes its key into the library, so that machine code of other sources
is recognized whatever the name of its file.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import platform
import sys
from collections.abc import Iterable
from pathlib import Path

PACKAGE_ROOT = Path(__file__).parents[2]
"""Folder of the package `lariat` that this module belongs to."""
_KERNELS = "rod/kernels"
"""Package of the kernel's source, relative to the root; every module in it enters the key."""
_LAUNCH_MODULES = (
    "rod/launch/codes.py",
    "rod/launch/compilation.py",
    "rod/launch/layout.py",
    "rod/launch/taichi_runtime.py",
)
"""Modules with the constants of the kernel and the settings of its compiler."""


def kernel_key(sources: Iterable[Path], root: Path = PACKAGE_ROOT) -> str:
    """Return the SHA-256 of sources, compiler and processor, as 64 hexadecimal digits.

    Args:
        sources: Files of Python source below `root`, in any order.
        root: Folder of the package `lariat` that they belong to; only paths relative to it count.

    Raises:
        ValueError: A source lies outside `root`.
        OSError: A source cannot be read.
    """
    content = hashlib.sha256()
    for name, path in sorted((path.relative_to(root).as_posix(), path) for path in sources):
        source = path.read_bytes()
        content.update(f"{name}:{len(source)}:".encode())
        content.update(source)
    content.update(importlib.metadata.version("taichi").encode())
    content.update(platform.machine().encode())
    for line in Path("/proc/cpuinfo").read_text().split("\n\n")[0].splitlines():
        if line.startswith(("model", "flags", "Features", "CPU ")):
            content.update(line.encode())
    return content.hexdigest()


def own_sources(root: Path = PACKAGE_ROOT) -> list[Path]:
    """Return the files of a package `lariat` that the kernel is compiled from."""
    return [*(root / _KERNELS).rglob("*.py"), *(root / name for name in _LAUNCH_MODULES)]


def imported_sources() -> list[Path]:
    """Return the files of the modules, imported by this process, that make up the kernel."""
    package = f"lariat.{_KERNELS.replace('/', '.')}"
    launch_modules = {f"lariat.{name[:-3].replace('/', '.')}" for name in _LAUNCH_MODULES}
    return [
        Path(module.__file__)
        for name, module in list(sys.modules.items())
        if name == package or name.startswith(f"{package}.") or name in launch_modules
        if module.__file__ is not None
    ]
