"""Key of a kernel's machine code: a hash of everything that the code is made from."""

from __future__ import annotations

import functools
import hashlib
import importlib.metadata
import os
from pathlib import Path

from llvmlite import binding as llvm

from lariat.kernel_cache.source import KernelSource, NoCompilerError

LANGUAGES = ("taichi", "quadrants")
"""Packages that translate kernels; the first one that is installed does."""
LEVEL = "x86-64-v3"
"""LLVM's name of any processor with AVX2."""
LEVEL_FEATURES = frozenset(
    {
        *("cx16", "lzcnt", "popcnt", "sahf", "sse4.1", "sse4.2", "ssse3"),
        *("avx", "avx2", "bmi", "bmi2", "f16c", "fma", "movbe", "xsave"),
    }
)
"""Instructions of that level beyond those of every x86-64, by LLVM's names."""


def cache_folder() -> Path:
    """Return the folder of kept machine code.

    Raises:
        RuntimeError: The user has no home.
    """
    kept = os.environ.get("XDG_CACHE_HOME")
    return (Path(kept) if kept else Path.home() / ".cache") / "lariat"


def compiler_file(folder: Path) -> Path:
    """Return the file in a folder of machine code that names the compiler that made it last."""
    return folder / "compiler"


def kernel_key(source: KernelSource) -> str:
    """Return the SHA-256 of sources, compiler and target, as 64 hexadecimal digits.

    Raises:
        OSError: A source cannot be read.
        NoCompilerError: There is no compiler, nor machine code that names its own.
    """
    content, root = hashlib.sha256(), source.root
    for name, path in sorted((path.relative_to(root).as_posix(), path) for path in files(source)):
        text = path.read_bytes()
        content.update(f"{name}:{len(text)}:".encode())
        content.update(text)
    content.update(compiler().encode())
    content.update(" ".join(target()).encode())
    return content.hexdigest()


def language() -> str | None:
    """Return the version of the package that translates kernels here, e.g. `taichi 1.7.4`."""
    for name in LANGUAGES:
        try:
            return f"{name} {importlib.metadata.version(name)}"
        except importlib.metadata.PackageNotFoundError:
            continue
    return None


def compiler() -> str:
    """Return what compiles kernels, or where nothing does, what made those that are kept.

    Raises:
        NoCompilerError: There is no compiler, nor machine code that names its own.
    """
    if here := language():
        return f"{here}, llvmlite {importlib.metadata.version('llvmlite')}"
    kept = compiler_file(cache_folder())
    if not kept.exists():
        raise NoCompilerError
    return kept.read_text()


@functools.cache
def target() -> tuple[str, str]:
    """Return the processor that kernels are compiled for here, and its features, as LLVM names it.

    On every x86-64 with AVX2 it is the level x86-64-v3: all of these run the same machine code,
    which, with the same C library, gives the same bits. Elsewhere it is the processor at hand.
    """
    features = llvm.get_host_cpu_features()
    if all(features.get(name) for name in LEVEL_FEATURES):
        return LEVEL, ""
    return llvm.get_host_cpu_name(), features.flatten()


def files(source: KernelSource) -> list[Path]:
    """Return the files of Python source that a kernel is compiled from."""
    paths: list[Path] = []
    for module in source.all_modules:
        path = source.root.joinpath(*module.split("."))
        paths += path.rglob("*.py") if path.is_dir() else [path.with_suffix(".py")]
    return paths
