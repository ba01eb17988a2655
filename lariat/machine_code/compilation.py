"""Compilation of a kernel into a library, in a process of its own.

Taichi writes assembly into the folder that its process runs in, reports on standard output, and
must be configured before it starts: hence the separate process. The library is kept only if it
computes the same numbers as Taichi's own kernel.
"""

from __future__ import annotations

import importlib
import os
import re
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from taichi._lib.core import taichi_python

from lariat.machine_code import library, taichi_runtime, target_processor
from lariat.machine_code.kernel_key import imported_files, kernel_key, own_key
from lariat.machine_code.kernel_source import KernelSource

MAX_DEVIATIONS = {"f8": 1e-9, "f4": 1e-6}
"""Deviation from Taichi's kernel above which a library is rejected, relative to the largest number
of an array, by the kind of its numbers [-]; whole numbers may differ by one."""


def main(folder: str, source: KernelSource) -> None:
    """Compile a kernel into a library in `folder`, named after the key of its sources."""
    with tempfile.TemporaryDirectory() as workspace:
        os.chdir(workspace)
        key, built = build_library(Path(workspace), source)
        target = library.library_path(Path(folder), source.name, key)
        finished = target.with_suffix(f".{os.getpid()}")
        finished.write_bytes(built.read_bytes())
        # The file appears to other processes as a whole.
        finished.replace(target)


def build_library(folder: Path, source: KernelSource) -> tuple[str, Path]:
    """Compile a kernel and compare it with Taichi's; return the key and the library.

    Args:
        folder: Folder for all files, which must be the current one.
        source: The kernel.

    Raises:
        OSError: LLVM cannot be told the target.
        ValueError: Taichi wrote no serial kernel, the library computes other numbers than Taichi,
            or a source changed meanwhile.
        CalledProcessError: The assembler or the linker failed.
    """
    key = own_key(source)
    target_processor.name_target(Path(taichi_python.__file__).resolve())
    taichi_runtime.start(writes_assembly=True)
    kernel = attribute(source.function)
    expected = attribute(source.trials)()
    for trial in expected:
        kernel(*trial.arguments)
    # Taichi has read the sources: what has changed since belongs to another key.
    if kernel_key(imported_files(source), source.root) != key:
        raise ValueError("a source of the kernel changed while it was compiled")
    texts = _text_assembly(library.KEY_MARKER + key)
    texts += _text_assembly(library.ARGUMENTS_MARKER + _argument_codes(kernel))
    (folder / "kernel.s").write_text(_kernel_assembly(folder, kernel.__name__) + texts)
    for command in (
        "as -o kernel.o kernel.s",
        "ld -shared -z noexecstack -o kernel.so kernel.o",
    ):
        subprocess.run(command.split(), check=True)
    built = folder / "kernel.so"
    run = library.load(built, key)
    for trial, there in zip(attribute(source.trials)(), expected, strict=True):
        run(*trial.arguments)
        compare(trial.results, there.results)
    return key, built


def attribute(name: str) -> Any:
    """Return what a name, as `package.module:function`, stands for."""
    module, _, function = name.partition(":")
    return getattr(importlib.import_module(module), function)


def _kernel_assembly(folder: Path, name: str) -> str:
    """Return the kernel's assembly from the files that Taichi wrote, under `KERNEL_SYMBOL`."""
    written = [path.read_text() for path in sorted(folder.glob("*.s"))]
    symbol = re.compile(rf"^({name}_\w+_kernel_\d+_\w+):$", re.MULTILINE)
    for text in reversed(written):
        if found := symbol.findall(text):
            if len(found) > 1 or not found[0].endswith("_serial"):
                raise ValueError(f"{name} is no serial kernel: Taichi made {', '.join(found)}")
            return re.sub(rf"\b{found[0]}\b", library.KERNEL_SYMBOL, text)
    raise ValueError(f"none of the {len(written)} files that Taichi wrote holds {name}")


def _text_assembly(text: str) -> str:
    """Return the assembly of a text in a library."""
    return f'\n.section .rodata\n.asciz "{text}"\n'


def _argument_codes(kernel: Any) -> str:
    """Return the types of a kernel's arguments, as `library.load` reads them."""
    codes = []
    for argument in kernel._primal.arguments:
        kind = argument.annotation
        if not hasattr(kind, "ndim"):
            codes.append(kind.to_string())
            continue
        element = getattr(kind.dtype, "dtype", kind.dtype)
        inner: Sequence[int] = () if element is kind.dtype else (kind.dtype.n, kind.dtype.m)
        codes.append(f"{element.to_string()}:{kind.ndim}:{len(inner)}")
    return ",".join(codes)


def compare(
    results: Sequence[np.ndarray[Any, Any]], expected: Sequence[np.ndarray[Any, Any]]
) -> None:
    """Compare the results of a library with those of Taichi's kernel.

    Args:
        results: Arrays that the library has written.
        expected: The same arrays, written by Taichi's kernel.

    Raises:
        ValueError: They deviate by more than `MAX_DEVIATIONS`.
    """
    for here, there in zip(results, expected, strict=True):
        a, b = here.astype(np.float64), there.astype(np.float64)
        difference = np.abs(a - b).max(initial=0.0)
        limit = MAX_DEVIATIONS.get(here.dtype.str[1:])
        allowed = 1.0 if limit is None else limit * np.abs(b).max(initial=0.0)
        # Not a number must not pass.
        if not difference <= allowed:
            raise ValueError(f"the library deviates from Taichi's kernel by {difference}")
