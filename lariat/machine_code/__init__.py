"""Kernels of Taichi, started from machine code that is kept from one process to the next.

Taichi's own cache keeps the LLVM code of a kernel, but every process imports Taichi, reads the
source again to check that it has not changed, and generates the machine code again: 0.5 to 5 s a
kernel. On a computer with an assembler, the first process that needs a kernel therefore starts
another one that writes it into a library (`compilation`). All others load the library (`library`)
and need neither Taichi nor an assembler. Where there is no library and none can be made, kernels
run through Taichi (`taichi_runtime`).
"""
