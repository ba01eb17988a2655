"""Kernels are compiled for the level of x86-64, else for the processor at hand."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from pathlib import Path

import pytest

from lariat.machine_code import target_processor
from lariat.machine_code.kernel_source import ROOT
from lariat.rod.launch import machine_code

NAMING = """
import pathlib
from taichi._lib.core import taichi_python
from lariat.machine_code import target_processor

library = pathlib.Path(taichi_python.__file__)
address = target_processor.function_address(library, target_processor.NAMING_FUNCTION)
target_processor.name_target(library)
print(target_processor.processor_name(address))
"""
"""Program that prints LLVM's name of the processor after it has been told the target."""
CPUINFO = """processor\t: 0
model\t\t: {model}
flags\t\t: fpu sse2 {flags}
bugs\t\t: none

processor\t: 1
"""

has_level = pytest.mark.skipif(
    target_processor.target() != target_processor.LEVEL, reason="the processor lacks AVX2"
)


def cpuinfo(model: int, without: str = "") -> str:
    """Return the text of /proc/cpuinfo of a processor that lacks one instruction of the level."""
    flags = sorted(target_processor.LEVEL_FLAGS - {without})
    return CPUINFO.format(model=model, flags=" ".join(flags))


@has_level
def test_llvm_compiles_for_the_level() -> None:
    output = subprocess.run(
        [sys.executable, "-c", NAMING], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    assert output.split()[-1] == "x86-64-v3"


@has_level
def test_code_is_not_compiled_for_another_processor_than_its_key_names() -> None:
    with pytest.raises(OSError, match="no function that names the processor"):
        target_processor.name_target(Path(sys.executable).resolve())


def test_all_processors_of_the_level_are_one_target() -> None:
    newer, older = (target_processor.target_of("x86_64", cpuinfo(model)) for model in (2, 1))
    assert newer == older == "x86-64-v3"


@pytest.mark.parametrize("flag", sorted(target_processor.LEVEL_FLAGS))
def test_a_processor_below_the_level_is_a_target_of_its_own(flag: str) -> None:
    below, other = (target_processor.target_of("x86_64", cpuinfo(m, flag)) for m in (1, 2))
    assert len({below, other, "x86-64-v3"}) == 3


def test_another_architecture_is_a_target_of_its_own() -> None:
    text = "processor : 0\nFeatures : fp asimd\nCPU implementer : 0x41\nCPU part : {}\n"
    targets = {target_processor.target_of("aarch64", text.format(part)) for part in "12"}
    assert len(targets) == 2


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
