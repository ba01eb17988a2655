# type: ignore
"""The banded linear system: block LDL^T and its solves, with what touches add to it."""

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


@ti.func
def across(w: ti.template(), entry, d):
    """u v of a touch: how fast its two points part where blocks move by `d`."""
    first = d + 6 * ti.cast(w[entry], ti.i32)
    other = d + 6 * ti.cast(w[entry + 1], ti.i32)
    s, t = w[entry + 2], w[entry + 3]
    here = (1.0 - s) * load3(w, first) + s * load3(w, first + 6)
    there = (1.0 - t) * load3(w, other) + t * load3(w, other + 6)
    return load3(w, entry + 4).dot(here - there)


@ti.real_func
def solve(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """H v = b for vector `d` in place, free blocks only.

    Touches add c u u^T each to the band B. With columns B^-1 u their forces f solve
    f / c + u B^-1 u f = u v, and B^-1 u f is taken from v (Woodbury).
    """
    result = 0.0
    if task == at.SOLVE:
        first = ni[at.FIRST_FREE]
        end = ni[at.END_FREE]
        most = ni[at.MOST_TOUCHES]
        count = 0
        if most > 0:
            count = ti.cast(w[rod + ni[at.AT_TOUCHES]], ti.i32)
        entries = rod + ni[at.AT_TOUCHES] + at.TOUCH_HEAD
        width = 3 * (2 * ni[at.NODES] - 1)
        columns = rod + ni[at.AT_TOUCH_COLUMNS]
        for c in range(count + 1):
            d = arg
            if c < count:
                d = columns + width * c
                for k in range(width):
                    w[d + k] = 0.0
                entry = entries + at.TOUCH_WIDTH * c
                normal = load3(w, entry + 4)
                for side in range(2):
                    node = d + 6 * ti.cast(w[entry + side], ti.i32)
                    place = w[entry + 2 + side]
                    sign = 1.0 - 2.0 * side
                    add3(w, node, (sign * (1.0 - place)) * normal)
                    add3(w, node + 6, (sign * place) * normal)
                # What is driven answers nothing.
                for j in range(first):
                    store3(w, d + 3 * j, ti.Vector([0.0, 0.0, 0.0]))
                for k in range(3 * end, width):
                    w[d + k] = 0.0
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
        if count > 0:
            # Cholesky by rows, with the right-hand side as one row more: L^-1 of it comes along.
            matrix = rod + ni[at.AT_TOUCH_MATRIX]
            for a in range(count + 1):
                row = matrix + most * a
                for b in range(count):
                    if b <= a:
                        entry = entries + at.TOUCH_WIDTH * b
                        value = 0.0
                        if a < count:
                            value = across(w, entry, columns + width * a)
                        else:
                            value = across(w, entry, arg)
                        if a == b:
                            value += w[entry + 7]
                        for k in range(b):
                            value -= w[row + k] * w[matrix + most * b + k]
                        if a == b:
                            w[row + b] = ti.sqrt(ti.max(value, 1e-300))
                        else:
                            w[row + b] = value / w[matrix + most * b + b]
            forces = matrix + most * count
            for back in range(count):
                a = count - 1 - back
                value = w[forces + a]
                for k in range(a + 1, count):
                    value -= w[matrix + most * k + a] * w[forces + k]
                force = value / w[matrix + most * a + a]
                w[forces + a] = force
                for k in range(3 * first, 3 * end):
                    w[arg + k] = w[arg + k] - force * w[columns + width * a + k]
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
