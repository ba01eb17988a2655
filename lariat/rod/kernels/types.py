"""Types of the arrays that every real function takes.

The three arrays of doubles are one: it is passed a second time as 3x3 matrices and a third time as
3x12 matrices, row by row.
"""

import taichi as ti

from lariat.rod.launch.layout import GROUP_COLUMNS

Integers = ti.types.ndarray(dtype=ti.i32, ndim=1)
Doubles = ti.types.ndarray(dtype=ti.f64, ndim=1)
Matrices33 = ti.types.ndarray(dtype=ti.types.matrix(3, 3, ti.f64), ndim=1)
Matrices312 = ti.types.ndarray(dtype=ti.types.matrix(3, GROUP_COLUMNS, ti.f64), ndim=1)
