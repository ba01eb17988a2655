"""Key of a kernel's machine code: a hash of everything that the code is made from.

The key is computed twice, independently: from the files below the root, by the process that looks
for the machine code, and from the files of the modules that were imported, by the process that
compiles it. The latter writes its key into the library, so that machine code of other sources
is recognized whatever the name of its file.
"""

from __future__ import annotations

import hashlib
import importlib.metadata
import sys
from collections.abc import Iterable
from pathlib import Path

from lariat.machine_code import target_processor
from lariat.machine_code.kernel_source import KernelSource


class NoCompilerError(Exception):
    """Machine code is not kept, and cannot be compiled here: Taichi, `as` or `ld` is missing.

    Without Taichi the text says in one line how to mend it.
    """


def library_folder() -> Path:
    """Return the folder of kept machine code.

    Raises:
        RuntimeError: The user has no home.
    """
    return Path.home() / ".cache" / "lariat"


def version_file(folder: Path) -> Path:
    """Return the file in a folder of machine code with the version of Taichi that made it last."""
    return folder / "taichi-version"


def kernel_key(files: Iterable[Path], root: Path) -> str:
    """Return the SHA-256 of sources, compiler and target, as 64 hexadecimal digits.

    Args:
        files: Files of Python source below `root`, in any order.
        root: Folder of the packages that they belong to; only paths relative to it count.

    Raises:
        ValueError: A source lies outside `root`.
        OSError: A source cannot be read.
        NoCompilerError: There is no Taichi, nor machine code that names its version.
    """
    content = hashlib.sha256()
    for name, path in sorted((path.relative_to(root).as_posix(), path) for path in files):
        source = path.read_bytes()
        content.update(f"{name}:{len(source)}:".encode())
        content.update(source)
    content.update(_compiler_version().encode())
    content.update(target_processor.target().encode())
    return content.hexdigest()


def _compiler_version() -> str:
    """Return the version of Taichi, or where there is none, of the one that made what is kept."""
    try:
        return importlib.metadata.version("taichi")
    except importlib.metadata.PackageNotFoundError:
        kept = version_file(library_folder())
        if not kept.exists():
            raise NoCompilerError from None
        return kept.read_text()


def own_key(source: KernelSource) -> str:
    """Return the key of the files below the kernel's root.

    Raises:
        OSError: A source cannot be read.
        NoCompilerError: There is no Taichi, nor machine code that names its version.
    """
    return kernel_key(own_files(source), source.root)


def own_files(source: KernelSource) -> list[Path]:
    """Return the files below the kernel's root that it is compiled from."""
    files: list[Path] = []
    for module in source.all_modules:
        path = source.root.joinpath(*module.split("."))
        files += path.rglob("*.py") if path.is_dir() else [path.with_suffix(".py")]
    return files


def imported_files(source: KernelSource) -> list[Path]:
    """Return the files of the modules, imported by this process, that make up the kernel."""
    modules = source.all_modules
    below = tuple(f"{module}." for module in modules)
    return [
        Path(module.__file__)
        for name, module in list(sys.modules.items())
        if name in modules or name.startswith(below)
        if module.__file__ is not None
    ]
