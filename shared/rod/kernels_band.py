# type: ignore
"""The banded linear system: block LDL^T and its solves."""

import taichi as ti

from shared.rod import layout as at
from shared.rod.kernels_access import (
    hessian_at,
)
from shared.rod.kernels_math import (
    add3,
    add33,
    load3,
    load33,
    store3,
    store33,
)
from shared.rod.kernels_types import Doubles, Integers


@ti.real_func
def solve(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """H v = b for vector `d` in place, free blocks only."""
    result = 0.0
    if task == at.SOLVE:
        d = arg
        first = ni[at.FIRST_FREE]
        end = ni[at.END_FREE]
        for j in range(first, end):
            m = hessian_at(ni, rod, step, j)
            v = load3(w, d + 3 * j)
            if j + 1 < end:
                add3(w, d + 3 * j + 3, -(load33(w, m + 9) @ v))
            if j + 2 < end:
                add3(w, d + 3 * j + 6, -(load33(w, m + 18) @ v))
        for back in range(end - first):
            j = end - 1 - back
            m = hessian_at(ni, rod, step, j)
            v = load33(w, m) @ load3(w, d + 3 * j)
            if j + 1 < end:
                v -= load33(w, m + 9).transpose() @ load3(w, d + 3 * j + 3)
            if j + 2 < end:
                v -= load33(w, m + 18).transpose() @ load3(w, d + 3 * j + 6)
            store3(w, d + 3 * j, v)
    return result


@ti.real_func
def factor(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Block LDL^T in place, over free blocks; returns whether all pivots are positive."""
    result = 0.0
    if task == at.FACTOR:
        first = ni[at.FIRST_FREE]
        end = ni[at.END_FREE]
        definite = 1
        for j in range(first, end):
            m = hessian_at(ni, rod, step, j)
            d = load33(w, m)
            minor = d[0, 0] * d[1, 1] - d[0, 1] * d[0, 1]
            determinant = d.determinant()
            if d[0, 0] <= 0.0 or minor <= 0.0 or determinant <= 0.0:
                definite = 0
            inverse = ti.Matrix.zero(ti.f64, 3, 3)
            if ti.abs(determinant) > 0.0:
                inverse = d.inverse()
            store33(w, m, inverse)
            if j + 1 < end:
                near = load33(w, m + 9)
                near_factor = near @ inverse
                add33(w, m + 27, -(near_factor @ near.transpose()))
                if j + 2 < end:
                    far = load33(w, m + 18)
                    far_factor = far @ inverse
                    add33(w, m + 36, -(far @ near_factor.transpose()))
                    add33(w, m + 54, -(far_factor @ far.transpose()))
                    store33(w, m + 18, far_factor)
                store33(w, m + 9, near_factor)
        result = definite
    else:
        result = solve(ni, w, task, rod, step, arg, real)
    return result
