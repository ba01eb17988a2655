"""Couplings of free and driven unknowns through self-contacts.

The counterpart of H_fd in `grips`, for the part of the Hessian that is not in the band.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import unknown_at
from lariat.rod.kernels.banded_solve import solve
from lariat.rod.kernels.memory import load3
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
def fold_self_contacts(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Subtract the effect of some blocks on the others through self-contacts.

    `SUBTRACT_SELF_CONTACT_COUPLINGS` subtracts the effect of driven blocks from free ones,
    `FOLD_SELF_CONTACTS` that of free blocks from driven ones. The vector is at `arg`, with
    stride `real`.
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
            w[moves + k] = ti.select(free == from_free, w[unknown_at(arg, stride, k)], 0.0)
            w[to + k] = 0.0
        for a in range(ti.cast(w[rod + ni[Section.SELF_CONTACTS]], ti.i32)):
            entry = entries + SELF_CONTACT_WIDTH * a
            at_points, at_other = geometric_hessian_product(w, entry, moves)
            at_points += (
                normal_separation(w, entry, moves) / w[entry + SelfContact.COMPLIANCE]
            ) * load3(w, entry + SelfContact.NORMAL)
            subtract_at_nodes(w, entry, to, at_points, at_other)
        for k in range(width):
            free = k >= 3 * ni[Header.FIRST_FREE] and k < 3 * ni[Header.END_FREE]
            if free != from_free:
                w[unknown_at(arg, stride, k)] = w[unknown_at(arg, stride, k)] + w[to + k]
    else:
        result = solve(ni, w, w33, task, rod, step, arg, real)
    return result
