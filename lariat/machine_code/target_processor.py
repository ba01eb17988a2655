"""Processor that kernels are compiled for, where LLVM does not know the one at hand.

Taichi's LLVM asks the processor for its family and model. One that is newer than LLVM itself it calls
"generic", and gives it SSE2 alone, without AVX and fused products: the rod takes a third longer then.
Taichi has no setting for it. In the process that compiles, LLVM's function is therefore replaced by
one that returns the level of x86-64 whose instructions the processor has.
"""

from __future__ import annotations

import ctypes
import mmap
import platform
import struct
from pathlib import Path
from typing import Any

UNKNOWN = b"generic"
"""LLVM's name of a processor that it does not know."""
LEVEL = b"x86-64-v3"
"""LLVM's name of a processor with AVX2."""
LEVEL_FLAGS = frozenset(("avx2", "bmi1", "bmi2", "f16c", "fma", "abm", "movbe", "xsave"))
"""Instructions of that level beyond those of older ones, as in /proc/cpuinfo."""
NAMING_FUNCTION = b"_ZN4llvm3sys14getHostCPUNameEv"
"""Symbol of `llvm::StringRef llvm::sys::getHostCPUName()`."""
_SYMBOL_TABLE = 2
"""Type of an ELF section with all symbols (SHT_SYMTAB)."""


class _Name(ctypes.Structure):
    """LLVM's StringRef."""

    _fields_ = (("address", ctypes.c_void_p), ("length", ctypes.c_size_t))


def name_unknown_processor(library: Path) -> None:
    """Let LLVM compile for the instructions of a processor that it does not know.

    Nothing changes where LLVM knows the processor, where that lacks an instruction of the level, or
    where the library carries no symbol of LLVM's function.

    Args:
        library: File of Taichi's library, which this process has loaded.
    """
    if platform.machine() != "x86_64" or not processor_flags() >= LEVEL_FLAGS:
        return
    offset = symbol_address(library, NAMING_FUNCTION)
    start = _load_address(library)
    if offset is None or start is None:
        return
    address = start + offset
    named: Any = ctypes.CFUNCTYPE(_Name)(address)
    name = named()
    if ctypes.string_at(name.address, name.length) != UNKNOWN:
        return
    # mov rax, address of the name; mov edx, its length; ret.
    text = ctypes.create_string_buffer(LEVEL)
    code = b"\x48\xb8" + struct.pack("<Q", ctypes.addressof(text))
    code += b"\xba" + struct.pack("<I", len(LEVEL)) + b"\xc3"
    page = address // mmap.PAGESIZE * mmap.PAGESIZE
    length = address + len(code) - page
    protect = ctypes.CDLL(None).mprotect
    if protect(ctypes.c_void_p(page), ctypes.c_size_t(length), mmap.PROT_READ | mmap.PROT_WRITE):
        # A hardened system does not let a process change its code.
        return
    ctypes.memmove(address, code, len(code))
    protect(ctypes.c_void_p(page), ctypes.c_size_t(length), mmap.PROT_READ | mmap.PROT_EXEC)
    # The code holds the address of the name.
    _names.append(text)


_names: list[Any] = []


def processor_flags() -> set[str]:
    """Return the names of the processor's instruction sets, as Linux lists them."""
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("flags"):
            return set(line.partition(":")[2].split())
    return set()


def symbol_address(library: Path, name: bytes) -> int | None:
    """Return the address of a function in an ELF file of 64 bits, from where it is loaded.

    None if the file has no such symbol; a local one is found as well.
    """
    with library.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        (table,) = struct.unpack_from("<Q", content, 40)
        entry, count = struct.unpack_from("<HH", content, 58)
        headers = [struct.unpack_from("<IIQQQQIIQQ", content, table + entry * k) for k in range(count)]
        for header in headers:
            if header[1] != _SYMBOL_TABLE:
                continue
            strings = headers[header[6]]
            place = content.find(b"\0" + name + b"\0", strings[4], strings[4] + strings[5])
            if place < 0:
                continue
            number = struct.pack("<I", place + 1 - strings[4])
            found = content.find(number, header[4], header[4] + header[5])
            while found >= 0:
                if (found - header[4]) % 24 == 0:
                    (address,) = struct.unpack_from("<Q", content, found + 8)
                    return address
                found = content.find(number, found + 1, header[4] + header[5])
    return None


def _load_address(library: Path) -> int | None:
    """Return the address at which this process has loaded a library."""
    starts = [
        int(line.partition("-")[0], 16)
        for line in Path("/proc/self/maps").read_text().splitlines()
        if line.endswith(str(library))
    ]
    return min(starts, default=None)
