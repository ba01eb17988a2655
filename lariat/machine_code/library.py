"""Libraries with the machine code of kernels: found, compiled where they are missing, and loaded.

A library is named after its key (see `kernel_key`), and carries the key inside. Only a library
that carries the key of the package's own sources is used; another one is replaced.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import functools
import importlib.metadata
import logging
import re
import shutil
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lariat.machine_code.call import CompiledKernel
from lariat.machine_code.kernel_key import NoCompilerError, library_folder, own_key, version_file
from lariat.machine_code.kernel_source import Kernel, KernelSource

KERNEL_SYMBOL = "lariat_kernel"
"""Name of the kernel's function in a library."""
KEY_MARKER = "lariat-kernel-key:"
"""Text in a library that precedes its key."""
ARGUMENTS_MARKER = "lariat-kernel-arguments:"
"""Text in a library that precedes the types of the kernel's arguments."""
MAX_KEPT_LIBRARIES = 40
"""Number of libraries of a kernel that stay in the folder; the least recently used are deleted."""
RETRY_DELAY = 86400.0
"""Time after a failed compilation before it is tried again [s]; an attempt takes up to 15 s."""
COMPILATION_TIME_LIMIT = 300.0
"""Time after which the compiling process is stopped [s]; it takes up to 15 s."""

_COMPILING_PROGRAM = """
import importlib.util, pathlib, sys
folder, root, packages, *source = sys.argv[1:]
for package in packages.split(","):
    path = root + "/" + package
    spec = importlib.util.spec_from_file_location(
        package, path + "/__init__.py", submodule_search_locations=[path]
    )
    sys.modules[package] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules[package])
from lariat.machine_code import compilation
from lariat.machine_code.kernel_source import KernelSource
name, function, modules, trials = source
source = KernelSource(name, function, tuple(modules.split(",")), trials, pathlib.Path(root))
compilation.main(folder, source)
"""
"""Program of the compiling process: imports the packages from the root alone, so that no others on
the search path can take their place."""

logger = logging.getLogger(__name__)


class ForeignLibraryError(OSError):
    """File that is not a library of a kernel, or one that was compiled from other sources."""


def kernel(source: KernelSource) -> Kernel:
    """Return a kernel from its library, which is compiled if it is missing, or through Taichi.

    Raises:
        NoCompilerError: There is no library, and no Taichi.
    """
    return compiled_kernel(source) or _through_taichi(source)


@functools.cache
def compiled_kernel(source: KernelSource) -> CompiledKernel | None:
    """Return the kernel of a library, which is compiled if it is missing; None if that fails.

    It needs no compiler where a library is kept; without either it is None, and nothing is said.
    """
    if not sys.platform.startswith("linux"):
        return None
    try:
        return _own_kernel(source, library_folder())
    except NoCompilerError:
        return None
    except (OSError, RuntimeError) as error:
        logger.warning(
            "the kernel %s runs through Taichi, which costs each process 0.5 to 5 s: %s",
            source.name,
            error,
        )
        return None


def _through_taichi(source: KernelSource) -> Kernel:
    # Taichi is slow to import, and kernels compile against its runtime, which must start first.
    from lariat.machine_code import taichi_runtime

    taichi_runtime.start()
    from lariat.machine_code import compilation

    return compilation.attribute(source.function)


def library_path(folder: Path, name: str, key: str) -> Path:
    """Return the file of a kernel's library with a key."""
    return folder / f"{name}-{key[:16]}.so"


def _own_kernel(source: KernelSource, folder: Path) -> CompiledKernel:
    """Return the kernel that was compiled from its own sources.

    Raises:
        OSError: There is no such library, and none can be compiled.
        NoCompilerError: There is none, and no compiler.
    """
    key = own_key(source)
    path = _library(source, folder, key)
    try:
        return load(path, key)
    except ForeignLibraryError as error:
        logger.warning("%s; it is deleted", error)
        path.unlink(missing_ok=True)
        return load(_library(source, folder, key), key)


def _library(source: KernelSource, folder: Path, key: str) -> Path:
    """Return the file that a key names, compiled if it is missing.

    Raises:
        OSError: It cannot be compiled, or a compilation failed less than `RETRY_DELAY` ago.
        NoCompilerError: It is missing, and there is no compiler.
    """
    path = library_path(folder, source.name, key)
    if not path.exists():
        if not (find_spec("taichi") and shutil.which("as") and shutil.which("ld")):
            raise NoCompilerError
        folder.mkdir(parents=True, exist_ok=True)
        failure = path.with_suffix(".failed")
        # One of the processes that start together compiles; the others wait for it.
        with (folder / f"{source.name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if failure.exists() and time.time() - failure.stat().st_mtime < RETRY_DELAY:
                raise OSError(f"{failure.read_text()} (delete {failure} to try again at once)")
            if not path.exists():
                _compile(source, path, failure)
        kept = sorted(folder.glob(f"{source.name}-*.so"), key=lambda p: p.stat().st_mtime)
        for old in kept[:-MAX_KEPT_LIBRARIES]:
            old.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        # Without the right to write, the time of use stays as it is.
        path.touch()
    return path


def compiling_command(source: KernelSource, folder: Path) -> list[str]:
    """Return the command that compiles a kernel into a folder."""
    words = [str(folder), str(source.root), ",".join(source.packages)]
    words += [source.name, source.function, ",".join(source.modules), source.trials]
    return [sys.executable, "-P", "-c", _COMPILING_PROGRAM, *words]


def _compile(source: KernelSource, path: Path, failure: Path) -> None:
    """Compile the library in a process of its own, which names it after the sources it read."""
    try:
        subprocess.run(
            compiling_command(source, path.parent),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=COMPILATION_TIME_LIMIT,
            check=True,
        )
        reason = "" if path.exists() else "its sources changed while it was compiled"
        cause = None
    except subprocess.SubprocessError as error:
        message = str(getattr(error, "stderr", None) or error).strip().splitlines()[-1]
        reason, cause = f"its machine code could not be compiled: {message}", error
    if reason:
        failure.write_text(reason)
        raise OSError(reason) from cause
    failure.unlink(missing_ok=True)
    version_file(path.parent).write_text(importlib.metadata.version("taichi"))


def load(path: Path, key: str) -> CompiledKernel:
    """Return the kernel of a library.

    Args:
        path: File of the library.
        key: Key that the library must carry.

    Raises:
        ForeignLibraryError: The file carries another key, or none.
        OSError: The file cannot be read, or not be loaded as a library.
    """
    # Read from the file, before any of its code is loaded: a loaded library cannot be replaced.
    content = path.read_bytes()
    carried = re.search(rf"{KEY_MARKER}([0-9a-f]+)".encode(), content)
    codes = re.search(rf"{ARGUMENTS_MARKER}([\w:,]+)".encode(), content)
    if carried is None or codes is None:
        raise ForeignLibraryError(f"{path} is not a library of a kernel")
    if carried[1].decode() != key:
        raise ForeignLibraryError(
            f"{path} was compiled from other sources: its key is {carried[1].decode()[:16]} "
            f"instead of {key[:16]}"
        )
    # A library calls libm's sine, but does not name libm as a dependency.
    ctypes.CDLL("libm.so.6", mode=ctypes.RTLD_GLOBAL)
    function: Any = getattr(ctypes.CDLL(str(path)), KERNEL_SYMBOL)
    return CompiledKernel(function, codes[1].decode())
