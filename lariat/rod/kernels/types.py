"""Types of the two arrays that every real function takes."""

import taichi as ti

Integers = ti.types.ndarray(dtype=ti.i32, ndim=1)
Doubles = ti.types.ndarray(dtype=ti.f64, ndim=1)
