# type: ignore
"""The ends of a roll-out: from a state to two slots of history, and back."""

import taichi as ti

from shared.rod import layout as at
from shared.rod.kernels_math import (
    exponential,
    load3,
    load4,
    logarithm,
    quaternion_product,
    rotation_matrix,
    store3,
    store4,
)
from shared.rod.kernels_newton import orientation_at, position_at, scalar
from shared.rod.kernels_types import Doubles, Integers


@ti.real_func
def begin(ni: Integers, w: Doubles, rod: ti.i32):
    """Slot 1 holds a state, slot 0 its velocities: turn these into the history that they mean."""
    n = ni[at.NODES]
    h = w[rod + ni[at.AT_TIMES]]
    for i in range(n - 1):
        q = load4(w, orientation_at(ni, rod, 1, i))
        q = q / ti.sqrt(q.dot(q))
        store4(w, orientation_at(ni, rod, 1, i), q)
        omega = load3(w, orientation_at(ni, rod, 0, i))
        store4(w, orientation_at(ni, rod, 0, i), quaternion_product(exponential(-h * omega), q))
    for end in range(2):
        if ni[at.LEFT + end] == at.CLAMPED:
            r = rotation_matrix(load4(w, orientation_at(ni, rod, 1, end * (n - 2))))
            reach = scalar(ni, w, rod, at.EDGE_LENGTH) * (1.0 - 2.0 * end)
            outer = load3(w, position_at(ni, rod, 1, end * (n - 1)))
            inner = outer + reach * (r @ ti.Vector([0.0, 0.0, 1.0]))
            store3(w, position_at(ni, rod, 1, 1 + end * (n - 3)), inner)
    for i in range(n):
        x = load3(w, position_at(ni, rod, 1, i))
        v = load3(w, position_at(ni, rod, 0, i))
        store3(w, position_at(ni, rod, 0, i), x - h * v)


@ti.real_func
def finish(ni: Integers, w: Doubles, rod: ti.i32):
    """Leave the last velocities in the targets' and tensions' sections."""
    n = ni[at.NODES]
    last = ni[at.STEPS] + 1
    h = w[rod + ni[at.AT_TIMES] + 2 * (ni[at.STEPS] - 1)]
    for i in range(n):
        x = load3(w, position_at(ni, rod, last, i))
        x1 = load3(w, position_at(ni, rod, last - 1, i))
        store3(w, rod + ni[at.AT_TARGETS] + 3 * i, (x - x1) / h)
    for i in range(n - 1):
        q = load4(w, orientation_at(ni, rod, last, i))
        q1 = load4(w, orientation_at(ni, rod, last - 1, i))
        turn = quaternion_product(q, ti.Vector([q1[0], -q1[1], -q1[2], -q1[3]]))
        if turn[0] < 0.0:
            turn = -turn
        store3(w, rod + ni[at.AT_TENSIONS] + 3 * i, logarithm(turn) / h)
