"""Block LDL^T of the banded Hessian.

The band couples each block of three unknowns with the next two. With 3x3 diagonal blocks D_j,

    H = L D L^T,  L_j+1,j = H_j+1,j D_j^-1,  L_j+2,j = H_j+2,j D_j^-1,

in time linear in the number of nodes. Only the free blocks from FIRST_FREE to END_FREE take part.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import hessian_index, transposed_index
from lariat.rod.kernels.memory import bounded_index
from lariat.rod.kernels.self_contact_coupling import fold_self_contacts
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import Header


@ti.func
def symmetric_adjugate(d):
    """Adjugate of a symmetric 3x3 matrix, and its leading minors 2 and 3."""
    a = d[1, 1] * d[2, 2] - d[1, 2] * d[1, 2]
    b = d[0, 2] * d[1, 2] - d[0, 1] * d[2, 2]
    c = d[0, 1] * d[1, 2] - d[0, 2] * d[1, 1]
    e = d[0, 1] * d[0, 2] - d[0, 0] * d[1, 2]
    minor = d[0, 0] * d[1, 1] - d[0, 1] * d[0, 1]
    determinant = d[0, 0] * a + d[0, 1] * b + d[0, 2] * c
    adjugate = ti.Matrix([[a, b, c], [b, d[0, 0] * d[2, 2] - d[0, 2] * d[0, 2], e], [c, e, minor]])
    return adjugate, minor, determinant


@ti.func
def symmetric_difference(h, scale, a, b):
    """h - scale a b^T, 3x3, of which both terms are symmetric."""
    m = h
    for i in ti.static(range(3)):
        for k in ti.static(range(i + 1)):
            m[i, k] -= scale * (a[i, 0] * b[k, 0] + a[i, 1] * b[k, 1] + a[i, 2] * b[k, 2])
            m[k, i] = m[i, k]
    return m


@ti.func
def adjugate(d):
    """Adjugate of a 3x3 matrix, and its determinant."""
    m = ti.Matrix(
        [
            [
                d[1, 1] * d[2, 2] - d[1, 2] * d[2, 1],
                d[0, 2] * d[2, 1] - d[0, 1] * d[2, 2],
                d[0, 1] * d[1, 2] - d[0, 2] * d[1, 1],
            ],
            [
                d[1, 2] * d[2, 0] - d[1, 0] * d[2, 2],
                d[0, 0] * d[2, 2] - d[0, 2] * d[2, 0],
                d[0, 2] * d[1, 0] - d[0, 0] * d[1, 2],
            ],
            [
                d[1, 0] * d[2, 1] - d[1, 1] * d[2, 0],
                d[0, 1] * d[2, 0] - d[0, 0] * d[2, 1],
                d[0, 0] * d[1, 1] - d[0, 1] * d[1, 0],
            ],
        ]
    )
    return m, d[0, 0] * m[0, 0] + d[0, 1] * m[1, 0] + d[0, 2] * m[2, 0]


@ti.func
def complete_transposed(w33: ti.template(), h, t, j):
    """Add the blocks of the Hessian below the diagonal to the differences of the transposed one."""
    for k in ti.static(range(1, 3)):
        w33[t + 3 * j + k] = w33[t + 3 * j + k] + w33[h + 3 * j + k]


@ti.real_func
def factorize_unsymmetric(ni: Integers, w33: Matrices33, rod: ti.i32, step: ti.i32) -> ti.f64:
    """Factorize a Hessian with friction as block L D U; return whether all pivots are positive.

    The factors take the places of L D L^T in the Hessian and, as U^T D^T L^T, in the transposed
    one, which holds the differences of its blocks below the diagonal.
    """
    definite = 1.0
    first = ni[Header.FIRST_FREE]
    end = ni[Header.END_FREE]
    h = hessian_index(ni, rod, step)
    t = transposed_index(ni, rod, step)
    count = 2 * ni[Header.NODES] - 1
    # Couplings with driven blocks stay as they are.
    for j in range(ti.max(first - 2, 0), first):
        complete_transposed(w33, h, t, j)
    for j in range(ti.max(end - 2, first), count):
        complete_transposed(w33, h, t, j)
    # The matrices that the next two columns change stay in registers.
    d = w33[h + 3 * first]
    near = w33[h + 3 * first + 1]
    above = (w33[t + 3 * first + 1] + near).transpose()
    d_next = w33[h + 3 * first + 3]
    if first >= end - 2:
        above = w33[t + 3 * first + 1].transpose()
    for j in range(first, end):
        m = bounded_index(h + 3 * j)
        r = bounded_index(t + 3 * j)
        cofactors, determinant = adjugate(d)
        if d[0, 0] <= 0.0 or cofactors[2, 2] <= 0.0 or determinant <= 0.0:
            definite = 0.0
        inverse = ti.select(determinant == 0.0, 0.0, 1.0 / determinant) * cofactors
        w33[m] = inverse
        w33[r] = inverse.transpose()
        if j + 1 < end:
            left = near @ inverse
            d = d_next - left @ above
            w33[m + 1] = left
            w33[r + 1] = (inverse @ above).transpose()
            if j + 2 < end:
                far = w33[m + 2]
                far_above = (w33[r + 2] + far).transpose()
                near_next = w33[m + 4]
                above_next = w33[r + 4]
                if j + 3 < end:
                    above_next += near_next
                far_left = far @ inverse
                near = near_next - far_left @ above
                above = above_next.transpose() - left @ far_above
                d_next = w33[m + 6] - far_left @ far_above
                w33[m + 2] = far_left
                w33[r + 2] = (inverse @ far_above).transpose()
    return definite


@ti.real_func
def factorize(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Factorize the Hessian as block LDL^T in place; return whether all pivots are positive."""
    result = 0.0
    if task == Task.FACTORIZE and ni[Header.FRICTION_PAIRS] > 0:
        result = factorize_unsymmetric(ni, w33, rod, step)
    elif task == Task.FACTORIZE:
        first = ni[Header.FIRST_FREE]
        end = ni[Header.END_FREE]
        definite = 1
        # The matrices that the next two columns change stay in registers.
        h = hessian_index(ni, rod, step)
        d = w33[h + 3 * first]
        near = w33[h + 3 * first + 1]
        d_next = w33[h + 3 * first + 3]
        for j in range(first, end):
            m = bounded_index(h + 3 * j)
            adjugate, minor, determinant = symmetric_adjugate(d)
            if d[0, 0] <= 0.0 or minor <= 0.0 or determinant <= 0.0:
                definite = 0
            # D^-1 = scale adjugate: products with the adjugate need not wait for the division. A
            # singular matrix counts as one with an inverse of zero.
            scale = ti.select(determinant == 0.0, 0.0, 1.0 / determinant)
            w33[m] = scale * adjugate
            if j + 1 < end:
                near_adjugate = near @ adjugate
                d = symmetric_difference(d_next, scale, near_adjugate, near)
                w33[m + 1] = scale * near_adjugate
                if j + 2 < end:
                    far = w33[m + 2]
                    far_adjugate = far @ adjugate
                    near = w33[m + 4] - scale * (far @ near_adjugate.transpose())
                    d_next = symmetric_difference(w33[m + 6], scale, far_adjugate, far)
                    w33[m + 2] = scale * far_adjugate
        result = definite
    else:
        result = fold_self_contacts(ni, w, w33, task, rod, step, arg, real)
    return result
