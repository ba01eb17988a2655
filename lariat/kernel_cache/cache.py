"""Files with the machine code of kernels: found, compiled where they are missing, and loaded.

A file is named after the key of the kernel's sources (see `key`). It holds a line that describes
the machine code, then the object file.
"""

from __future__ import annotations

import contextlib
import fcntl
import functools
import hashlib
import json
import logging
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from llvmlite import binding as llvm

from lariat.kernel_cache.call import CompiledKernel
from lariat.kernel_cache.key import cache_folder, compiler, compiler_file, kernel_key, language
from lariat.kernel_cache.source import KernelSource, NoCompilerError

KERNEL_SYMBOL = "lariat_kernel"
"""Name of the kernel's function in an object file."""
MAX_KEPT = 40
"""Number of files of a kernel that stay in the folder; the least recently used are deleted."""
COMPILATION_TIME_LIMIT = 300.0
"""Time after which the compiling process is stopped [s]; it takes up to 20 s."""

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
from lariat.kernel_cache import compiler
from lariat.kernel_cache.source import KernelSource
name, function, modules, self_tests = source
source = KernelSource(name, function, tuple(modules.split(",")), self_tests, pathlib.Path(root))
compiler.main(folder, source)
"""
"""Program of the compiling process: imports the packages from the root alone, so that no others on
the search path can take their place."""

logger = logging.getLogger(__name__)


@functools.cache
def kernel(source: KernelSource) -> CompiledKernel:
    """Return a kernel, which is compiled if its machine code is not kept.

    Raises:
        NoCompilerError: It is not kept, and there is no compiler.
        RuntimeError: It cannot be compiled.
    """
    folder = cache_folder()
    try:
        return _kept(source, folder)
    except OSError as error:
        logger.warning(
            "the kernel %s cannot be kept in %s, and is compiled for this process alone: %s",
            source.name,
            folder,
            error,
        )
        with tempfile.TemporaryDirectory() as elsewhere:
            return _kept(source, Path(elsewhere))


def kernel_path(folder: Path, name: str, key: str) -> Path:
    """Return the file of a kernel with a key."""
    return folder / f"{name}-{key[:16]}.kernel"


def _kept(source: KernelSource, folder: Path) -> CompiledKernel:
    """Return the kernel from its file in a folder, compiled if the file is missing or damaged.

    Raises:
        OSError: The folder cannot be written.
        NoCompilerError: It is missing, and there is no compiler.
        RuntimeError: It cannot be compiled.
    """
    path = kernel_path(folder, source.name, kernel_key(source))
    kept = _load(path)
    if kept is None:
        if language() is None:
            raise NoCompilerError
        folder.mkdir(parents=True, exist_ok=True)
        # One of the processes that start together compiles; the others wait for it.
        with (folder / f"{source.name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            kept = _load(path)
            if kept is None:
                _compile(source, folder)
                kept = _load(path)
        if kept is None:
            raise RuntimeError(
                f"a source of the kernel {source.name} changed while it was compiled"
            )
        files = sorted(folder.glob(f"{source.name}-*.kernel"), key=lambda p: p.stat().st_mtime)
        for old in files[:-MAX_KEPT]:
            old.unlink(missing_ok=True)
    with contextlib.suppress(OSError):
        # Without the right to write, the time of use stays as it is.
        path.touch()
    return kept


def compiling_command(source: KernelSource, folder: Path) -> list[str]:
    """Return the command that compiles a kernel into a folder."""
    words = [str(folder), str(source.root), ",".join(source.packages)]
    words += [source.name, source.function, ",".join(source.modules), source.self_tests]
    return [sys.executable, "-P", "-c", _COMPILING_PROGRAM, *words]


def _compile(source: KernelSource, folder: Path) -> None:
    """Compile the kernel in a process of its own, which names its file after what it read."""
    logger.info("compiling the kernel %s, once for this computer", source.name)
    try:
        subprocess.run(
            compiling_command(source, folder),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=COMPILATION_TIME_LIMIT,
            check=True,
        )
    except subprocess.SubprocessError as error:
        lines = str(getattr(error, "stderr", None) or "").strip().splitlines()
        message = lines[-1] if lines else f"{type(error).__name__}: its process died"
        raise RuntimeError(f"the kernel {source.name} could not be compiled: {message}") from error
    compiler_file(folder).write_text(compiler())


def target_machine(**options: Any) -> llvm.TargetMachine:
    """Return LLVM's target of this computer. Args: options: As llvmlite names them."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    target = llvm.Target.from_default_triple()
    return target.create_target_machine(reloc="pic", jit=True, **options)


def pack(machine_code: bytes, arguments: str) -> bytes:
    """Return the content of a file.

    Args:
        machine_code: Object file with the function `KERNEL_SYMBOL`.
        arguments: Types of its arguments, as `CompiledKernel` takes them.
    """
    about = {"arguments": arguments, "sha256": hashlib.sha256(machine_code).hexdigest()}
    return json.dumps(about).encode() + b"\n" + machine_code


def unpack(content: bytes) -> CompiledKernel:
    """Return the kernel of a file's content.

    Raises:
        ValueError: The content is damaged.
    """
    head, _, machine_code = content.partition(b"\n")
    about = json.loads(head)
    if about["sha256"] != hashlib.sha256(machine_code).hexdigest():
        raise ValueError("its machine code is not what was written")
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), target_machine())
    engine.add_object_file(llvm.ObjectFileRef.from_data(machine_code))
    engine.finalize_object()
    return CompiledKernel(engine.get_function_address(KERNEL_SYMBOL), about["arguments"], engine)


def _load(path: Path) -> CompiledKernel | None:
    """Return the kernel of a file; None if there is none, or it is damaged.

    Raises:
        OSError: The file cannot be read.
    """
    try:
        return unpack(path.read_bytes())
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError) as error:
        logger.warning("%s is damaged, and compiled anew: %s", path, error)
        return None
