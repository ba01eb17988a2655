"""Types of the arrays that every real function takes.

The two arrays of doubles are one: it is passed a second time as 3x3 matrices, row by row.
"""

from lariat.kernel_cache.language import ti

Integers = ti.types.ndarray(dtype=ti.i32, ndim=1)
Doubles = ti.types.ndarray(dtype=ti.f64, ndim=1)
Matrices33 = ti.types.ndarray(dtype=ti.types.matrix(3, 3, ti.f64), ndim=1)
