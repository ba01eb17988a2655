"""Types of the two arrays that every compiled function takes."""

import taichi as ti

Integers = ti.types.ndarray(dtype=ti.i32, ndim=1)
Doubles = ti.types.ndarray(dtype=ti.f64, ndim=1)
Vector3 = ti.types.vector(3, ti.f64)
Matrix3 = ti.types.matrix(3, 3, ti.f64)
