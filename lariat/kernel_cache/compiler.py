"""Compilation of a kernel into machine code, in a process of its own.

Taichi writes LLVM's intermediate code of a kernel into the folder that its process runs in, reports
on standard output, and must be configured before it starts: hence the separate process. The machine
code is kept only if it computes the same numbers as the kernel that Taichi runs.
"""

from __future__ import annotations

import importlib
import inspect
import os
import platform
import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from llvmlite import binding as llvm

from lariat.kernel_cache import cache, runtime
from lariat.kernel_cache.key import kernel_key, target
from lariat.kernel_cache.language import ti
from lariat.kernel_cache.source import KernelSource

MAX_DEVIATION = 1e-6
"""Deviation from Taichi's kernel above which machine code is rejected, relative to the largest
number of an array [-]; whole numbers may differ by one. A processor rounds derivatives through
friction differently from another by 2e-8; wrong code is far off."""

RUNTIME_FUNCTIONS = {
    "abs_f32": "llvm.fabs.f32",
    "abs_f64": "llvm.fabs.f64",
    "max_i32": "llvm.smax.i32",
    "min_i32": "llvm.smin.i32",
    "sin_f64": "sin",
    "cos_f64": "cos",
    "atan2_f64": "atan2",
    "pow_f64": "pow",
}
"""Functions of Taichi's runtime, by what LLVM and the C library have for them."""


def main(folder: str, source: KernelSource) -> None:
    """Compile a kernel into a file in `folder`, named after the key of its sources."""
    with tempfile.TemporaryDirectory() as workspace:
        os.chdir(workspace)
        key, content = compiled(source)
        finished = cache.kernel_path(Path(folder), source.name, key)
        written = finished.with_suffix(f".{os.getpid()}")
        written.write_bytes(content)
        # The file appears to other processes as a whole.
        written.replace(finished)


def compiled(source: KernelSource) -> tuple[str, bytes]:
    """Return the key of a kernel and the content of its file; the current folder must be empty.

    Raises:
        ValueError: The kernel is not serial, its machine code computes other numbers than Taichi,
            or a source changed meanwhile.
    """
    key = kernel_key(source)
    runtime.start(writes_intermediate_code=True)
    kernel = attribute(source.function)
    expected = attribute(source.self_tests)()
    for test in expected:
        kernel(*test.arguments)
    # Taichi has read the sources: what has changed since belongs to another key.
    if kernel_key(source) != key:
        raise ValueError("a source of the kernel changed while it was compiled")
    content = cache.pack(_machine_code(kernel.__name__), _argument_codes(kernel))
    run = cache.unpack(content)
    for test, there in zip(attribute(source.self_tests)(), expected, strict=True):
        run(*test.arguments)
        compare(test.results, there.results)
    return key, content


def attribute(name: str) -> Any:
    """Return what a name, as `package.module:function`, stands for."""
    module, _, function = name.partition(":")
    return getattr(importlib.import_module(module), function)


def _machine_code(name: str) -> bytes:
    """Return the object file of the kernel whose intermediate code Taichi has written."""
    text, symbol = _intermediate_code(name)
    for function, better in RUNTIME_FUNCTIONS.items():
        text = text.replace(f"@{function}(", f"@{better}(")
    # Taichi leaves it to its code generator to fuse products and sums.
    module = llvm.parse_assembly(text.replace(" reassoc ", " reassoc contract "))
    module.link_in(llvm.parse_assembly(_context_functions(text)))
    for function in module.functions:
        if not function.is_declaration:
            function.linkage = "external" if function.name == symbol else "internal"
        elif not (function.name.startswith("llvm.") or function.name in RUNTIME_FUNCTIONS.values()):
            raise ValueError(f"{name} calls {function.name}, which RUNTIME_FUNCTIONS lacks")
    module.get_function(symbol).name = cache.KERNEL_SYMBOL
    processor, features = target()
    machine = cache.target_machine(cpu=processor, features=features, opt=3)
    module.data_layout = str(machine.target_data)
    tuning = llvm.create_pipeline_tuning_options(speed_level=3)
    passes = llvm.create_pass_builder(machine, tuning)
    passes.getModulePassManager().run(module, passes)
    return machine.emit_object(module)


def _intermediate_code(name: str) -> tuple[str, str]:
    """Return the intermediate code of a kernel from the files that Taichi wrote, and its symbol."""
    pattern = re.compile(rf"^define .*@({name}_\w+_kernel_\d+_\w+)\(", re.MULTILINE)
    texts = [path.read_text() for path in Path().glob("*.ll")]
    written = {symbol: text for text in texts for symbol in pattern.findall(text)}
    if len(written) != 1 or not next(iter(written)).endswith("_serial"):
        raise ValueError(f"{name} is no serial kernel: Taichi wrote {', '.join(written) or 'none'}")
    ((symbol, text),) = written.items()
    return text, symbol


def _context_functions(text: str) -> str:
    """Return the code of the runtime's functions by which real functions read their context.

    Taichi ships them unoptimized, with attributes that keep LLVM from inlining them.
    """
    suffix = "x64" if platform.machine() == "x86_64" else "arm64"
    path = Path(ti.__file__).parent / "_lib" / "runtime" / f"runtime_{suffix}.bc"
    runtime_text = str(llvm.parse_bitcode(path.read_bytes()))
    parts = re.findall(r"^%.* = type .*", runtime_text, re.MULTILINE)
    for name in sorted(set(re.findall(r"@(RuntimeContext_\w+)\(", text))):
        pattern = rf"^define [^\n]*@{name}\(.*?^}}"
        parts += re.findall(pattern, runtime_text, re.MULTILINE | re.DOTALL)
    return re.sub(r" #\d+", "", "\n".join(parts))


def _argument_codes(kernel: Any) -> str:
    """Return the types of a kernel's arguments, as `CompiledKernel` reads them."""
    codes = []
    for parameter in inspect.signature(kernel).parameters.values():
        kind = parameter.annotation
        if not hasattr(kind, "ndim"):
            codes.append(str(kind))
            continue
        element = getattr(kind.dtype, "dtype", kind.dtype)
        codes.append(f"{element}:{kind.ndim}:{0 if element is kind.dtype else 2}")
    return ",".join(codes)


def compare(
    results: Sequence[np.ndarray[Any, Any]], expected: Sequence[np.ndarray[Any, Any]]
) -> None:
    """Compare the results of machine code with those of Taichi's kernel.

    Args:
        results: Arrays that the machine code has written.
        expected: The same arrays, written by Taichi's kernel.

    Raises:
        ValueError: They deviate by more than `MAX_DEVIATION`.
    """
    for here, there in zip(results, expected, strict=True):
        a, b = here.astype(np.float64), there.astype(np.float64)
        difference = np.abs(a - b).max(initial=0.0)
        whole = here.dtype.kind in "iu"
        allowed = 1.0 if whole else MAX_DEVIATION * np.abs(b).max(initial=0.0)
        # Not a number must not pass.
        if not difference <= allowed:
            raise ValueError(f"the machine code deviates from Taichi's kernel by {difference}")
