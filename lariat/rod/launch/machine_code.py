"""Machine code of the kernel, kept from one process to the next.

Taichi's own cache keeps the LLVM code of a kernel, but every process reads the source again to
check that it has not changed, and generates the machine code again, which takes five seconds. On a
computer with an assembler, the first process that needs the kernel therefore starts another one
that writes it into a library (see `compilation`). All others load the library and need no Taichi.

The library is named after its key (see `kernel_key`), and carries the key inside. Only a library
that carries the key of this package's own sources is used; another one is replaced. Without an
assembler, or when the library cannot be made, the kernel runs through Taichi.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import functools
import logging
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int32

from lariat.rod.launch.kernel_key import PACKAGE_ROOT, kernel_key, own_sources

Kernel = Callable[[Int32[np.ndarray, "k"], Float64[np.ndarray, "m"], int], object]
"""Function of the two arrays of `layout` and the number of rods."""

KERNEL_SYMBOL = "lariat_rod_rollout"
"""Name of the kernel's function in a library."""
KEY_MARKER = "lariat-rod-kernel-key:"
"""Text in a library that precedes its key."""
MAX_KEPT_LIBRARIES = 4
"""Number of libraries that stay in the folder; the least recently used are deleted."""
RETRY_DELAY = 86400.0
"""Time after a failed compilation before it is tried again [s]; an attempt takes 15 s."""
COMPILATION_TIME_LIMIT = 300.0
"""Time after which the compiling process is stopped [s]; it takes about 15 s."""

_COMPILING_PROGRAM = """
import importlib.util, sys
root, folder = sys.argv[1:]
spec = importlib.util.spec_from_file_location(
    "lariat", root + "/__init__.py", submodule_search_locations=[root]
)
sys.modules["lariat"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(sys.modules["lariat"])
from lariat.rod.launch import compilation
compilation.main(folder)
"""
"""Program of the compiling process: imports the package `lariat` from its folder alone, so that no
other one on the search path can take its place."""

logger = logging.getLogger(__name__)


class ForeignLibraryError(OSError):
    """File that is not a library of the kernel, or one that was compiled from other sources."""


@functools.cache
def kernel() -> Kernel | None:
    """Return the kernel of a library, which is compiled if it is missing; None if that fails."""
    if not sys.platform.startswith("linux") or not (shutil.which("as") and shutil.which("ld")):
        return None
    try:
        return _own_kernel(Path.home() / ".cache" / "lariat")
    except (OSError, RuntimeError) as error:
        logger.warning(
            "the rod's kernel runs through Taichi, which costs each process 5 s: %s", error
        )
        return None


def library_path(folder: Path, key: str) -> Path:
    """Return the file of the library with a key."""
    return folder / f"rod-{key[:16]}.so"


def _own_kernel(folder: Path) -> Kernel:
    """Return the kernel that was compiled from this package's sources.

    Raises:
        OSError: There is no such library, and none can be compiled.
    """
    key = kernel_key(own_sources())
    path = _library(folder, key)
    try:
        return load(path, key)
    except ForeignLibraryError as error:
        logger.warning("%s; it is compiled again", error)
        path.unlink(missing_ok=True)
        return load(_library(folder, key), key)


def _library(folder: Path, key: str) -> Path:
    """Return the file that a key names, compiled if it is missing.

    Raises:
        OSError: It cannot be compiled, or a compilation failed less than `RETRY_DELAY` ago.
    """
    path = library_path(folder, key)
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        failure = path.with_suffix(".failed")
        # One of the processes that start together compiles; the others wait for it.
        with (folder / "rod.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if failure.exists() and time.time() - failure.stat().st_mtime < RETRY_DELAY:
                raise OSError(f"{failure.read_text()} (delete {failure} to try again at once)")
            if not path.exists():
                _compile(path, failure)
        for old in sorted(folder.glob("rod-*.so"), key=lambda p: p.stat().st_mtime)[
            :-MAX_KEPT_LIBRARIES
        ]:
            old.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        # Without the right to write, the time of use stays as it is.
        path.touch()
    return path


def _compile(path: Path, failure: Path) -> None:
    """Compile the library in a process of its own, which names it after the sources it read."""
    try:
        subprocess.run(
            [sys.executable, "-P", "-c", _COMPILING_PROGRAM, str(PACKAGE_ROOT), str(path.parent)],
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


class _Arguments(ctypes.Structure):
    """Arrays of the kernel and a number, laid out as Taichi passes them."""

    _fields_ = (
        ("integer_count", ctypes.c_int32),
        ("integers", ctypes.c_void_p),
        ("double_count", ctypes.c_int32),
        ("doubles", ctypes.c_void_p),
        ("matrix33_count", ctypes.c_int32),
        ("matrices33", ctypes.c_void_p),
        ("matrix36_count", ctypes.c_int32),
        ("matrices36", ctypes.c_void_p),
        ("rod_count", ctypes.c_int32),
    )


class _Context(ctypes.Structure):
    """Context that Taichi passes to a kernel; a serial kernel reads the arguments alone."""

    _fields_ = (
        ("arguments", ctypes.POINTER(_Arguments)),
        ("runtime", ctypes.c_void_p),
        ("thread", ctypes.c_int32),
        ("results", ctypes.c_void_p),
    )


def load(path: Path, key: str) -> Kernel:
    """Return the kernel of a library.

    Args:
        path: File of the library.
        key: Key that the library must carry.

    Raises:
        ForeignLibraryError: The file carries another key, or none.
        OSError: The file cannot be read, or not be loaded as a library.
    """
    # Read from the file, before any of its code is loaded: a loaded library cannot be replaced.
    carried = re.search(rf"{KEY_MARKER}([0-9a-f]+)".encode(), path.read_bytes())
    if carried is None:
        raise ForeignLibraryError(f"{path} is not a library of the rod's kernel")
    if carried[1].decode() != key:
        raise ForeignLibraryError(
            f"{path} was compiled from other sources: its key is {carried[1].decode()[:16]} "
            f"instead of {key[:16]}"
        )
    # The library calls libm's sine, but does not name libm as a dependency.
    ctypes.CDLL("libm.so.6", mode=ctypes.RTLD_GLOBAL)
    function = getattr(ctypes.CDLL(str(path)), KERNEL_SYMBOL)
    function.restype = None
    function.argtypes = (ctypes.POINTER(_Context),)

    def run(
        integers: Int32[np.ndarray, "k"], doubles: Float64[np.ndarray, "m"], count: int
    ) -> None:
        size, address = len(doubles), doubles.ctypes.data
        arguments = _Arguments(
            len(integers),
            integers.ctypes.data,
            size,
            address,
            size // 9,
            address,
            size // 18,
            address,
            count,
        )
        function(_Context(ctypes.pointer(arguments)))

    return run
