"""Block LDL^T of the banded Hessian.

The band couples each block of three unknowns with the next two. With 3x3 diagonal blocks D_j,

    H = L D L^T,  L_j+1,j = H_j+1,j D_j^-1,  L_j+2,j = H_j+2,j D_j^-1,

in time linear in the number of nodes. Only the free blocks from FIRST_FREE to END_FREE take part.
"""

import taichi as ti

from lariat.rod.kernels.addressing import hessian_at
from lariat.rod.kernels.memory import add33, load33, store33
from lariat.rod.kernels.self_contact_coupling import fold_self_contacts
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import Header


@ti.real_func
def factorize(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Factorize the Hessian as block LDL^T in place; return whether all pivots are positive."""
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
        result = fold_self_contacts(ni, w, task, rod, step, arg, real)
    return result
