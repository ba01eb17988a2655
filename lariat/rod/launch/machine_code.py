"""The kernel as machine code, kept from one process to the next.

Taichi's own cache keeps what LLVM makes of the kernel's source, but reads the source anew in every
process, to know that it has not changed, and lets LLVM write the machine code anew: five seconds.
Where a computer has an assembler, the first process that needs the kernel has another one write it
into a library (see `assembling`), under a key of everything that it comes from. The others load
that, and need no Taichi. Where there is none, or the library does not answer as Taichi does,
everything goes through Taichi.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import functools
import hashlib
import importlib.metadata
import logging
import os
import platform
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int32

Kernel = Callable[[Int32[np.ndarray, "k"], Float64[np.ndarray, "m"], int], object]
"""Of the two arrays of `layout` and the count of rods."""

KEPT = 4
"""Libraries that stay in the folder; those used least recently go."""
SYMBOL = "roll"
_HERE = Path(__file__).parent
AGAIN = 86400.0
"""After a failure nobody tries for so long [s]: every start would be 15 s slower for nothing."""
_LIMIT = 300.0
"""Time that the other process may take [s]; it takes 15 s of a processor."""

logger = logging.getLogger(__name__)


@functools.cache
def kernel() -> Kernel | None:
    """The kernel from its library, which is made where it is missing; None where it cannot be."""
    if not sys.platform.startswith("linux") or not (shutil.which("as") and shutil.which("ld")):
        return None
    try:
        return loaded(_library(Path.home() / ".cache" / "lariat"))
    except (OSError, RuntimeError) as error:
        logger.warning("the rod's kernel goes through Taichi, at 5 s a process: %s", error)
        return None


def _library(folder: Path) -> Path:
    """The library of this source on this computer, made if it is missing."""
    path = folder / f"rod-{_key()}.so"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        note = path.with_suffix(".failed")
        # Of processes that start together one makes it, and the others wait for that.
        with (folder / "rod.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if note.exists() and time.time() - note.stat().st_mtime < AGAIN:
                raise OSError(f"{note.read_text()} (delete {note} to try again at once)")
            if not path.exists():
                _make(path, note)
        for old in sorted(folder.glob("rod-*.so"), key=lambda p: p.stat().st_mtime)[:-KEPT]:
            old.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        # In a folder that only others may write to nothing is thrown out either.
        path.touch()
    return path


def _make(path: Path, note: Path) -> None:
    root = str(_HERE.parents[2])
    search = os.pathsep.join([root, *filter(None, [os.environ.get("PYTHONPATH")])])
    try:
        subprocess.run(
            [sys.executable, "-m", "lariat.rod.launch.compilation", str(path)],
            env={**os.environ, "PYTHONPATH": search},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_LIMIT,
            check=True,
        )
    except subprocess.SubprocessError as error:
        said = str(getattr(error, "stderr", None) or error).strip().splitlines()[-1]
        reason = f"its machine code could not be made: {said}"
        note.write_text(reason)
        raise OSError(reason) from error
    note.unlink(missing_ok=True)


def _key() -> str:
    """Of all that machine code depends on: the source, the compiler and the processor."""
    known = hashlib.sha256()
    for name in sorted((_HERE.parent / "kernels").glob("*.py")):
        known.update(name.read_bytes())
    for name in ("layout.py", "taichi_runtime.py", "compilation.py"):
        known.update((_HERE / name).read_bytes())
    known.update(importlib.metadata.version("taichi").encode())
    known.update(platform.machine().encode())
    for line in Path("/proc/cpuinfo").read_text().split("\n\n")[0].splitlines():
        if line.startswith(("model", "flags", "Features", "CPU ")):
            known.update(line.encode())
    return known.hexdigest()[:16]


class _Arguments(ctypes.Structure):
    """How Taichi lays out two arrays and a count."""

    _fields_ = (
        ("integer_count", ctypes.c_int32),
        ("integers", ctypes.c_void_p),
        ("double_count", ctypes.c_int32),
        ("doubles", ctypes.c_void_p),
        ("count", ctypes.c_int32),
    )


class _Context(ctypes.Structure):
    """What Taichi hands to a kernel; only the arguments are of use to one that is serial."""

    _fields_ = (
        ("arguments", ctypes.POINTER(_Arguments)),
        ("runtime", ctypes.c_void_p),
        ("thread", ctypes.c_int32),
        ("results", ctypes.c_void_p),
    )


def loaded(library: Path) -> Kernel:
    """The kernel of a library.

    Raises:
        OSError: This is no library with a kernel.
    """
    # Sines come from there; who loads a library that lacks one learns of it only when it is called.
    ctypes.CDLL("libm.so.6", mode=ctypes.RTLD_GLOBAL)
    try:
        function = getattr(ctypes.CDLL(str(library)), SYMBOL)
    except AttributeError as error:
        raise OSError(f"{library} has no {SYMBOL}; delete it") from error
    function.restype = None
    function.argtypes = (ctypes.POINTER(_Context),)

    def run(
        integers: Int32[np.ndarray, "k"], doubles: Float64[np.ndarray, "m"], count: int
    ) -> None:
        arguments = _Arguments(
            len(integers), integers.ctypes.data, len(doubles), doubles.ctypes.data, count
        )
        function(_Context(ctypes.pointer(arguments)))

    return run
