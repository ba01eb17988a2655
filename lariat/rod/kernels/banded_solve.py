"""Solves with the factors of the Hessian, with self-contacts on top of the band.

Forward and back substitution with the factors of `banded_factorization`, over free blocks alone.
The contacts add a matrix of low rank (Woodbury).
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import hessian_index, transposed_index, unknown_at
from lariat.rod.kernels.memory import add, bounded_index, load3, store
from lariat.rod.kernels.self_contact_hessian import (
    geometric_hessian_product,
    normal_separation,
    subtract_at_nodes,
)
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import (
    SELF_CONTACT_HEAD,
    SELF_CONTACT_WIDTH,
    Header,
    Section,
    SelfContact,
)


@ti.real_func
def solve(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Solve H v = b in place for the vector at `arg`, over the free blocks; H^T v = b if real is 1.

    H is the banded matrix B, whose factors `factorize` left, plus c u u^T for each self-contact.
    With the columns B^-1 u, the forces f of the contacts solve f / c + u B^-1 u f = u v, and
    B^-1 u f is subtracted from v = B^-1 b (Woodbury).

    Newton's method leaves out the rest G of the contacts' Hessian; derivatives do not:
    `SOLVE_EXACTLY` iterates v = (H - G)^-1 (b - G v) for a vector with stride `real`, and returns
    whether that failed. `SOLVE_AGAIN` does the same with the columns of the last call.
    """
    result = 0.0
    newton = task == Task.SOLVE
    if newton or task == Task.SOLVE_EXACTLY or task == Task.SOLVE_AGAIN:
        first = ni[Header.FIRST_FREE]
        end = ni[Header.END_FREE]
        capacity = ni[Header.MAX_SELF_CONTACTS]
        count = 0
        if capacity > 0:
            count = ti.cast(w[rod + ni[Section.SELF_CONTACTS]], ti.i32)
        entries = rod + ni[Section.SELF_CONTACTS] + SELF_CONTACT_HEAD
        width = 3 * (2 * ni[Header.NODES] - 1)
        columns = rod + ni[Section.SELF_CONTACT_COLUMNS]
        matrix = rod + ni[Section.SELF_CONTACT_MATRIX]
        forces = matrix + capacity * count
        right = rod + ni[Section.SELF_CONTACT_VECTORS]
        last = right + width
        target = arg
        stride = 1
        rounds = 1
        if not newton:
            target = last + width
            stride = ti.cast(real, ti.i32)
            rounds = 100
            for k in range(width):
                w[right + k] = 0.0
                w[last + k] = 0.0
            for k in range(3 * first, 3 * end):
                w[right + k] = w[unknown_at(arg, stride, k)]
        c = 0
        if task == Task.SOLVE_AGAIN:
            c = count
        while c < count + rounds:
            d = target
            if c < count:
                d = columns + width * c
                for k in range(width):
                    w[d + k] = 0.0
                entry = entries + SELF_CONTACT_WIDTH * c
                normal = load3(w, entry + SelfContact.NORMAL)
                for side in range(2):
                    node = d + 6 * ti.cast(w[entry + SelfContact.EDGE + side], ti.i32)
                    place = w[entry + SelfContact.PLACE + side]
                    sign = 1.0 - 2.0 * side
                    add(w, node, (sign * (1.0 - place)) * normal)
                    add(w, node + 6, (sign * place) * normal)
                # Driven blocks take no part.
                for j in range(first):
                    store(w, d + 3 * j, ti.Vector([0.0, 0.0, 0.0]))
                for k in range(3 * end, width):
                    w[d + k] = 0.0
            elif not newton:
                for k in range(width):
                    w[d + k] = w[right + k]
                for a in range(count):
                    entry = entries + SELF_CONTACT_WIDTH * a
                    at_points, at_other = geometric_hessian_product(w, entry, last)
                    subtract_at_nodes(w, entry, d, at_points, at_other)
                for k in range(width):
                    if k < 3 * first or k >= 3 * end:
                        w[d + k] = 0.0
            h = hessian_index(ni, rod, step)
            rear = transposed_index(ni, rod, step)
            if real == 1.0:
                h, rear = rear, h
            v = load3(w, d + 3 * first)
            v_next = load3(w, d + 3 * ti.min(first + 1, end - 1))
            for j in range(first, end):
                store(w, d + 3 * j, v)
                m = bounded_index(h + 3 * j)
                after = v_next - w33[m + 1] @ v
                v_next = load3(w, d + 3 * ti.min(j + 2, end - 1)) - w33[m + 2] @ v
                v = after
            # The couplings of the last blocks with driven ones are multiplied by zero.
            v = ti.Vector([0.0, 0.0, 0.0])
            v_next = ti.Vector([0.0, 0.0, 0.0])
            for back in range(end - first):
                j = end - 1 - back
                m = bounded_index(h + 3 * j)
                r = bounded_index(rear + 3 * j)
                before = w33[m] @ load3(w, d + 3 * j) - w33[r + 2].transpose() @ v_next
                before -= w33[r + 1].transpose() @ v
                v_next = v
                v = before
                store(w, d + 3 * j, v)
            # L U of the transposed matrix, row by row; the right-hand side is one row of L more.
            a = ti.min(c, count)
            row = matrix + capacity * a
            for b in range(count):
                entry = entries + SELF_CONTACT_WIDTH * b
                value = normal_separation(w, entry, d)
                if a == b:
                    value += w[entry + SelfContact.COMPLIANCE]
                for k in range(ti.min(a, b)):
                    value -= w[row + k] * w[matrix + capacity * k + b]
                if b < a:
                    value /= w[matrix + capacity * b + b]
                w[row + b] = value
            if c >= count:
                for back in range(count):
                    b = count - 1 - back
                    force = w[forces + b]
                    for k in range(b + 1, count):
                        force -= w[matrix + capacity * k + b] * w[forces + k]
                    w[forces + b] = force
                    for k in range(3 * first, 3 * end):
                        w[d + k] = w[d + k] - force * w[columns + width * b + k]
                if not newton:
                    size = 0.0
                    change = 0.0
                    for k in range(3 * first, 3 * end):
                        size = ti.max(size, ti.abs(w[d + k]))
                        change = ti.max(change, ti.abs(w[d + k] - w[last + k]))
                        w[last + k] = w[d + k]
                    if change <= 1e-13 * size:
                        rounds = 0
                    elif c == count + rounds - 1:
                        result = 1.0
            c += 1
        if not newton:
            for k in range(3 * first, 3 * end):
                w[unknown_at(arg, stride, k)] = w[last + k]
    return result
