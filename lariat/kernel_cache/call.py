"""Calls of compiled kernels, with arguments laid out in memory as Taichi passes them."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable
from ctypes import addressof, c_char
from typing import Any

import numpy as np

NUMBERS: dict[str, Any] = {
    "f64": ctypes.c_double,
    "f32": ctypes.c_float,
    "i32": ctypes.c_int32,
    "u32": ctypes.c_uint32,
}
"""Types of numbers by Taichi's names."""


class _Array:
    """Type of an array argument."""

    def __init__(self, code: str) -> None:
        name, outer, inner = code.split(":")
        self.dtype = np.dtype(f"{name[0]}{int(name[1:]) // 8}")
        self.outer, self.ndim = int(outer), int(outer) + int(inner)
        lengths = [(f"n{k}", ctypes.c_int32) for k in range(self.outer)]
        fields = {"_fields_": (*lengths, ("address", ctypes.c_void_p))}
        self.structure = type("ArrayArgument", (ctypes.Structure,), fields)

    def pack(self, value: np.ndarray[Any, Any]) -> ctypes.Structure:
        """Return an array's lengths and address; an array that is packed stays as it is.

        Raises:
            TypeError: It is another array than the kernel takes.
        """
        if type(value) is self.structure:
            return value
        if value.dtype != self.dtype or value.ndim != self.ndim or not value.flags.c_contiguous:
            raise TypeError(
                f"expected a contiguous array of {self.dtype} with {self.ndim} dimensions, got "
                f"{value.dtype} with shape {value.shape} and strides {value.strides}"
            )
        # NumPy's own way to the address takes three times as long, but knows every array.
        plain = value.size and value.flags.writeable
        address = addressof(c_char.from_buffer(value)) if plain else value.ctypes.data
        return self.structure(*value.shape[: self.outer], address)


class CompiledKernel:
    """Function of a kernel's arguments."""

    def __init__(self, address: int, codes: str, owner: object) -> None:
        """Create a call.

        Args:
            address: Address of the kernel's machine code.
            codes: Types of the arguments, comma-separated: of a number Taichi's name of it, e.g.
                `f64`; of an array `f64:2:0`, its numbers, its dimensions, and those of its elements
                (2 if they are matrices).
            owner: What must stay for the machine code to stay.
        """
        self._owner = owner
        self._kinds = [_Array(c) if ":" in c else NUMBERS[c] for c in codes.split(",")]
        self._packs: list[Any] = [k.pack if isinstance(k, _Array) else None for k in self._kinds]
        types = [k.structure if isinstance(k, _Array) else k for k in self._kinds]
        places = tuple((f"a{k}", kind) for k, kind in enumerate(types))
        self._arguments: Any = type("Arguments", (ctypes.Structure,), {"_fields_": places})
        # A serial kernel reads its arguments; real functions get a copy of some of the others.
        context = (
            ("arguments", ctypes.c_void_p),
            ("runtime", ctypes.c_void_p),
            ("thread", ctypes.c_int32),
            ("results", ctypes.c_void_p),
            ("others", ctypes.c_uint64 * 8),
        )
        self._context: Any = type("Context", (ctypes.Structure,), {"_fields_": context})
        self._function = ctypes.CFUNCTYPE(None, ctypes.POINTER(self._context))(address)

    def packed(self, place: int, value: np.ndarray[Any, Any]) -> Any:
        """Return an array as the argument at a place, for many calls; its memory must stay.

        Raises:
            TypeError: It is another array than the kernel takes.
        """
        argument = self._packs[place](value)
        # An argument holds an address: the array lives as long.
        argument.array = value
        return argument

    def __call__(self, *arguments: Any) -> None:
        """Run the kernel.

        Args:
            arguments: The kernel's arguments: numbers, and arrays or what `packed` made of them.

        Raises:
            TypeError: An argument is another one than the kernel takes.
        """
        if len(arguments) != len(self._kinds):
            raise TypeError(f"expected {len(self._kinds)} arguments, got {len(arguments)}")
        self.prepared(*arguments)()

    def prepared(self, *arguments: Any) -> PreparedCall:
        """Return a call whose first arguments stay; the memory of arrays stays with it.

        Args:
            arguments: The kernel's arguments, without numbers at its end that each run is given.

        Raises:
            TypeError: An argument is another one than the kernel takes, or an array lacks.
        """
        passed, count = len(arguments), len(self._kinds)
        if passed > count or any(self._packs[passed:]):
            raise TypeError(f"expected all arrays of {count} arguments, got {passed} arguments")
        values = [
            value if pack is None else pack(value)
            for pack, value in zip(self._packs, arguments, strict=False)
        ]
        packed = self._arguments(*values)
        names = tuple(f"a{k}" for k in range(passed, count))
        return PreparedCall(self.bind(packed, *arguments), packed, names)

    def bind(self, arguments: ctypes.Structure, *memory: object) -> Callable[[], object]:
        """Return a function that runs the kernel, as often as it is called.

        Args:
            arguments: Arguments, laid out as Taichi passes them.
            memory: Owners of the memory to which they point; the function keeps them.
        """
        context = self._context(ctypes.addressof(arguments))
        context.memory = arguments, *memory
        return functools.partial(self._function, ctypes.byref(context))


class PreparedCall:
    """Call of a kernel whose arrays stay: to hand them over takes longer than a short kernel."""

    def __init__(
        self, run: Callable[[], object], arguments: ctypes.Structure, names: tuple[str, ...]
    ) -> None:
        """Create a call.

        Args:
            run: Runs the kernel.
            arguments: Its arguments.
            names: Names of those that each run is given.
        """
        self._run, self._arguments, self._names = run, arguments, names

    def __call__(self, *numbers: float) -> None:
        """Run the kernel. Args: numbers: Its last arguments."""
        for name, number in zip(self._names, numbers, strict=True):
            setattr(self._arguments, name, number)
        self._run()
