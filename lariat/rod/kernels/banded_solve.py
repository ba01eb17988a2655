"""The banded linear system: block LDL^T and its solves, with what touches add to it."""

import taichi as ti

from lariat.rod.kernels.access import hessian_at
from lariat.rod.kernels.rotations import add3, add33, load3, load33, store3, store33
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import SELF_CONTACT_HEAD, SELF_CONTACT_WIDTH, Header, Section


@ti.func
def across(w: ti.template(), entry, d):
    """u v of a touch: how fast its two points part where blocks move by `d`."""
    return load3(w, entry + 4).dot(parting(w, entry, d))


@ti.func
def parting(w: ti.template(), entry, d):
    """How the two points of a touch move against each other where blocks move by `d`."""
    first = d + 6 * ti.cast(w[entry], ti.i32)
    other = d + 6 * ti.cast(w[entry + 1], ti.i32)
    s, t = w[entry + 2], w[entry + 3]
    here = (1.0 - s) * load3(w, first) + s * load3(w, first + 6)
    there = (1.0 - t) * load3(w, other) + t * load3(w, other + 6)
    return here - there


@ti.func
def turning(w: ti.template(), entry, d):
    """What a touch's Hessian beside c u u^T makes of `d`: at its points, and at the other's nodes.

    The force f keeps to the line between the points, which turns, and the nearer of the other
    edge's points slides. With n normal, e along the other edge, L its length, r the distance, P
    the plane across n and v the parting:  -f (P v / r + q e), and f q r / L n with opposite signs
    at the other edge's nodes, where  q = n (d_j - d_j+1) / L - e v / r.
    """
    moved = parting(w, entry, d)
    normal = load3(w, entry + 4)
    along = load3(w, entry + 8)
    over, distance, force = w[entry + 11], w[entry + 12], w[entry + 13]
    other = d + 6 * ti.cast(w[entry + 1], ti.i32)
    lean = normal.dot(load3(w, other) - load3(w, other + 6))
    slide = over * lean - along.dot(moved) / distance
    flat = moved - normal.dot(moved) * normal
    return -force * (flat / distance + slide * along), force * slide * distance * over * normal


@ti.func
def take(w: ti.template(), entry, to, at_points, at_other):
    """Subtract what `turning` found from the blocks of `to`."""
    first = to + 6 * ti.cast(w[entry], ti.i32)
    other = to + 6 * ti.cast(w[entry + 1], ti.i32)
    s, t = w[entry + 2], w[entry + 3]
    add3(w, first, (s - 1.0) * at_points)
    add3(w, first + 6, -s * at_points)
    add3(w, other, (1.0 - t) * at_points - at_other)
    add3(w, other + 6, t * at_points + at_other)


@ti.real_func
def solve(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """H v = b for vector `arg` in place, free blocks only.

    Touches add c u u^T each to the band B. With columns B^-1 u their forces f solve
    f / c + u B^-1 u f = u v, and B^-1 u f is taken from v (Woodbury).

    Newton does without the rest G of their Hessian. Derivatives do not: `SOLVE_EXACTLY` repeats
    v = (H - G)^-1 (b - G v), for a vector with `real` numbers from one of its entries to the next,
    and returns whether it failed. `SOLVE_AGAIN` does so with the columns of the last time.
    """
    result = 0.0
    newton = task == Task.SOLVE
    if newton or task == Task.SOLVE_EXACTLY or task == Task.SOLVE_AGAIN:
        first = ni[Header.FIRST_FREE]
        end = ni[Header.END_FREE]
        most = ni[Header.MAX_SELF_CONTACTS]
        count = 0
        if most > 0:
            count = ti.cast(w[rod + ni[Section.SELF_CONTACTS]], ti.i32)
        entries = rod + ni[Section.SELF_CONTACTS] + SELF_CONTACT_HEAD
        width = 3 * (2 * ni[Header.NODES] - 1)
        columns = rod + ni[Section.SELF_CONTACT_COLUMNS]
        matrix = rod + ni[Section.SELF_CONTACT_MATRIX]
        forces = matrix + most * count
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
                w[right + k] = w[arg + stride * k]
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
            elif not newton:
                for k in range(width):
                    w[d + k] = w[right + k]
                for a in range(count):
                    entry = entries + SELF_CONTACT_WIDTH * a
                    at_points, at_other = turning(w, entry, last)
                    take(w, entry, d, at_points, at_other)
                for k in range(width):
                    if k < 3 * first or k >= 3 * end:
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
            # Cholesky by rows, with the right-hand side as one row more: L^-1 of it comes along.
            a = ti.min(c, count)
            row = matrix + most * a
            for b in range(count):
                if b <= a:
                    entry = entries + SELF_CONTACT_WIDTH * b
                    value = across(w, entry, d)
                    if a == b:
                        value += w[entry + 7]
                    for k in range(b):
                        value -= w[row + k] * w[matrix + most * b + k]
                    if a == b:
                        w[row + b] = ti.sqrt(ti.max(value, 1e-300))
                    else:
                        w[row + b] = value / w[matrix + most * b + b]
            if c >= count:
                for back in range(count):
                    b = count - 1 - back
                    value = w[forces + b]
                    for k in range(b + 1, count):
                        value -= w[matrix + most * k + b] * w[forces + k]
                    force = value / w[matrix + most * b + b]
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
                w[arg + stride * k] = w[last + k]
    return result


@ti.real_func
def fold_touches(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Take from blocks what touches make there of the steps of others.

    `TOUCH_COUPLE` takes from free ones what driven ones cause, `TOUCH_FOLD` the other way about;
    `arg` and `real` as in `solve`.
    """
    result = 0.0
    if task == Task.SUBTRACT_SELF_CONTACT_COUPLINGS or task == Task.FOLD_SELF_CONTACTS:
        stride = ti.cast(real, ti.i32)
        width = 3 * (2 * ni[Header.NODES] - 1)
        from_free = task == Task.FOLD_SELF_CONTACTS
        moves = rod + ni[Section.SELF_CONTACT_VECTORS]
        to = moves + width
        entries = rod + ni[Section.SELF_CONTACTS] + SELF_CONTACT_HEAD
        for k in range(width):
            free = k >= 3 * ni[Header.FIRST_FREE] and k < 3 * ni[Header.END_FREE]
            w[moves + k] = ti.select(free == from_free, w[arg + stride * k], 0.0)
            w[to + k] = 0.0
        for a in range(ti.cast(w[rod + ni[Section.SELF_CONTACTS]], ti.i32)):
            entry = entries + SELF_CONTACT_WIDTH * a
            at_points, at_other = turning(w, entry, moves)
            at_points += (across(w, entry, moves) / w[entry + 7]) * load3(w, entry + 4)
            take(w, entry, to, at_points, at_other)
        for k in range(width):
            free = k >= 3 * ni[Header.FIRST_FREE] and k < 3 * ni[Header.END_FREE]
            if free != from_free:
                w[arg + stride * k] = w[arg + stride * k] + w[to + k]
    else:
        result = solve(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def factor(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Block LDL^T in place, over free blocks; returns whether all pivots are positive."""
    result = 0.0
    if task == Task.FACTORIZE:
        first = ni[Header.FIRST_FREE]
        end = ni[Header.END_FREE]
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
        result = fold_touches(ni, w, task, rod, step, arg, real)
    return result
