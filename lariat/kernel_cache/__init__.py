"""Kernels, compiled once into machine code that is kept from one process to the next.

The source of a kernel is Taichi's language (`language`). The first process that needs a kernel
starts another one that lets Taichi translate it into LLVM's intermediate code, and LLVM, by
llvmlite, into an object file (`compiler`). All others load the file (`cache`), in milliseconds and
without Taichi.
"""
