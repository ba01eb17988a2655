"""Vectors and matrices in the array of doubles.

Sums are written `w[i] = w[i] + v`: Taichi turns `w[i] += v` into an atomic addition, with a lock
for each number.
"""

import taichi as ti


@ti.func
def load3(w: ti.template(), at):
    """Vector of three numbers from `w[at]` on."""
    return ti.Vector([w[at], w[at + 1], w[at + 2]])


@ti.func
def load4(w: ti.template(), at):
    """Quaternion from `w[at]` on."""
    return ti.Vector([w[at], w[at + 1], w[at + 2], w[at + 3]])


@ti.func
def load33(w: ti.template(), at):
    """3x3 matrix from `w[at]` on, row by row."""
    return ti.Matrix(
        [
            [w[at], w[at + 1], w[at + 2]],
            [w[at + 3], w[at + 4], w[at + 5]],
            [w[at + 6], w[at + 7], w[at + 8]],
        ]
    )


@ti.func
def load36(w: ti.template(), start):
    """3x6 matrix from `w[start]` on, row by row."""
    m = ti.Matrix.zero(ti.f64, 3, 6)
    for a in ti.static(range(3)):
        for b in ti.static(range(6)):
            m[a, b] = w[start + 6 * a + b]
    return m


@ti.func
def store(w: ti.template(), at, v):
    """Write a vector to `w[at]` and after."""
    for a in ti.static(range(v.n)):
        w[at + a] = v[a]


@ti.func
def store33(w: ti.template(), at, m):
    """Write a 3x3 matrix to `w[at]` and after, row by row."""
    for a in ti.static(range(3)):
        for b in ti.static(range(3)):
            w[at + 3 * a + b] = m[a, b]


@ti.func
def store36(w: ti.template(), start, m):
    """Write a 3x6 matrix to `w[start]` and after, row by row."""
    for a in ti.static(range(3)):
        for b in ti.static(range(6)):
            w[start + 6 * a + b] = m[a, b]


@ti.func
def add(w: ti.template(), at, v):
    """Add a vector to the numbers from `w[at]` on."""
    for a in ti.static(range(v.n)):
        w[at + a] = w[at + a] + v[a]


@ti.func
def add33(w: ti.template(), at, m):
    """Add a 3x3 matrix to the numbers from `w[at]` on."""
    for a in ti.static(range(3)):
        for b in ti.static(range(3)):
            w[at + 3 * a + b] = w[at + 3 * a + b] + m[a, b]
