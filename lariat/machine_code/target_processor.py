"""Processor that kernels are compiled for.

On every x86-64 with AVX2 it is the level x86-64-v3: all of these run the same machine code, which,
with the same C library, gives the same bits. Elsewhere it is the processor at hand.

Taichi has no setting for it: its LLVM asks which processor it runs on. In the process that
compiles, that function is replaced by one that returns the level. Left alone, it calls a processor
that is newer than itself "generic", and uses neither AVX nor fused products, without which the rod
takes a third longer.
"""

from __future__ import annotations

import ctypes
import functools
import mmap
import platform
import struct
from pathlib import Path
from typing import Any

LEVEL = "x86-64-v3"
"""LLVM's name of any processor with AVX2."""
LEVEL_FLAGS = frozenset(
    {
        *("cx16", "lahf_lm", "popcnt", "sse4_1", "sse4_2", "ssse3"),
        *("abm", "avx", "avx2", "bmi1", "bmi2", "f16c", "fma", "movbe", "xsave"),
    }
)
"""Instructions of that level beyond those of every x86-64, as in /proc/cpuinfo."""
NAMING_FUNCTION = b"_ZN4llvm3sys14getHostCPUNameEv"
"""Symbol of `llvm::StringRef llvm::sys::getHostCPUName()`."""
SYMBOL_TABLE, SYMBOL_WIDTH = 2, 24
"""Type of the section of an ELF file that lists all symbols, and the bytes of one."""

_name = ctypes.create_string_buffer(LEVEL.encode())


class _StringRef(ctypes.Structure):
    _fields_ = (("address", ctypes.c_void_p), ("length", ctypes.c_size_t))


@functools.cache
def target() -> str:
    """Return the processor that kernels are compiled for here."""
    return target_of(platform.machine(), Path("/proc/cpuinfo").read_text())


def target_of(machine: str, cpuinfo: str) -> str:
    """Return the processor that kernels are compiled for: the level, or all that is known of it.

    Args:
        machine: Architecture, as `platform.machine` names it.
        cpuinfo: Text of /proc/cpuinfo.
    """
    lines = cpuinfo.split("\n\n")[0].splitlines()
    flags = {flag for line in lines if line.startswith("flags") for flag in line.split()}
    if machine == "x86_64" and flags >= LEVEL_FLAGS:
        return LEVEL
    known = [line for line in lines if line.startswith(("model", "flags", "Features", "CPU "))]
    return "\n".join([machine, *known])


def name_target(library: Path) -> None:
    """Let LLVM compile for the target, whatever processor it runs on.

    Args:
        library: File of the library that contains LLVM, which this process has loaded.

    Raises:
        OSError: LLVM's function is not found, or this process may not change its code.
    """
    if target() != LEVEL:
        return
    address = function_address(library, NAMING_FUNCTION)
    if address is None:
        raise OSError(f"{library} has no function that names the processor")
    # mov rax, address of the name; mov edx, its length; ret.
    code = b"\x48\xb8" + struct.pack("<Q", ctypes.addressof(_name))
    code += b"\xba" + struct.pack("<I", len(LEVEL)) + b"\xc3"
    page = address // mmap.PAGESIZE * mmap.PAGESIZE
    protect = ctypes.CDLL(None).mprotect
    protect.argtypes = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int
    length = address + len(code) - page
    if protect(page, length, mmap.PROT_READ | mmap.PROT_WRITE) != 0:
        raise OSError("this system lets no process change its code, by which LLVM is told a target")
    ctypes.memmove(address, code, len(code))
    protect(page, length, mmap.PROT_READ | mmap.PROT_EXEC)


def processor_name(address: int) -> str:
    """Return the name of the processor by LLVM's function at an address."""
    function: Any = ctypes.CFUNCTYPE(_StringRef)(address)
    name = function()
    return ctypes.string_at(name.address, name.length).decode()


def function_address(library: Path, symbol: bytes) -> int | None:
    """Return the address of a function, exported or not, of a library that this process has loaded.

    None if the library is not loaded, or its file does not name the function.
    """
    offset = _symbol_offset(library, symbol)
    starts = [
        int(line.partition("-")[0], 16)
        for line in Path("/proc/self/maps").read_text().splitlines()
        if line.endswith(f" {library}")
    ]
    return min(starts) + offset if starts and offset is not None else None


def _symbol_offset(library: Path, symbol: bytes) -> int | None:
    """Return the offset of a symbol in an ELF file of 64 bits; None if it is not there."""
    with library.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as elf:
        (place,) = struct.unpack_from("<Q", elf, 40)
        width, count = struct.unpack_from("<HH", elf, 58)
        # Name, type, flags, address, place, size, link, ...
        sections = [struct.unpack_from("<IIQQQQI", elf, place + width * k) for k in range(count)]
        for _name, kind, _flags, _address, start, size, link in sections:
            if kind != SYMBOL_TABLE:
                continue
            names, names_size = sections[link][4:6]
            name = elf.find(b"\0" + symbol + b"\0", names, names + names_size) + 1
            if name == 0:
                continue
            for found, value in struct.iter_unpack("<I4xQ8x", elf[start : start + size]):
                if found == name - names:
                    return value
    return None
