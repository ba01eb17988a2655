"""Kernels are compiled for the instructions of the processor, even if LLVM does not know it."""

from __future__ import annotations

import ctypes
import platform
import subprocess
import sys
from pathlib import Path

import pytest

from lariat.machine_code import target_processor
from lariat.machine_code.kernel_source import ROOT
from lariat.rod.launch import machine_code

NAMING = """
import pathlib, sys
from taichi._lib.core import taichi_python
from lariat.machine_code import target_processor

library = pathlib.Path(taichi_python.__file__)
address = target_processor.function_address(library, target_processor.NAMING_FUNCTION)
before = target_processor.processor_name(address)
target_processor.UNKNOWN = before if sys.argv[1] == "unknown" else b"another processor"
target_processor.name_unknown_processor(library)
print(before.decode(), target_processor.processor_name(address).decode())
"""
"""Program that prints LLVM's names of the processor before and after it has been named."""

has_level = pytest.mark.skipif(
    platform.machine() != "x86_64"
    or not target_processor.processor_flags() >= target_processor.LEVEL_FLAGS,
    reason="the processor lacks AVX2",
)


def names(known: str) -> list[str]:
    """Return LLVM's names of a processor that counts as known or unknown."""
    output = subprocess.run(
        [sys.executable, "-c", NAMING, known], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    return output.split()[-2:]


@has_level
def test_an_unknown_processor_gets_the_name_of_its_level() -> None:
    assert names("unknown")[1] == "x86-64-v3"


@has_level
def test_a_known_processor_keeps_its_name() -> None:
    before, after = names("known")
    assert after == before


@has_level
def test_the_rod_is_compiled_to_fused_products() -> None:
    assert machine_code.kernel() is not None
    # vfmadd231pd ymm, ymm, ymm: VEX prefix of three bytes, then its opcode.
    code = loaded_rod().read_bytes()
    fused = [code.count(bytes((0xC4, second))) for second in (0xE2, 0xC2, 0x62, 0x42)]
    assert sum(fused) > 1000


def test_a_function_is_found_where_it_was_loaded() -> None:
    assert machine_code.kernel() is not None
    library = loaded_rod()
    exported = ctypes.cast(ctypes.CDLL(str(library)).lariat_kernel, ctypes.c_void_p).value
    assert target_processor.function_address(library, b"lariat_kernel") == exported
    assert target_processor.function_address(library, b"lariat") is None
    assert target_processor.function_address(Path(sys.executable).resolve(), b"lariat") is None


def loaded_rod() -> Path:
    """Return the file of the rod's library that this process has loaded."""
    lines = Path("/proc/self/maps").read_text().splitlines()
    return next(Path(line.split()[-1]) for line in lines if "/rod-" in line)
