"""Forward sensitivities: columns dx/da for actions, parameters and initial state.

Each solve carries columns S = dx/da on,  H S = -dg/dx1 S1 - dg/dx0 S0 - ... - dg/dtheta,  with the
factors of its last Newton step, six columns at a time. A ring holds the columns of the last solves.
"""

import taichi as ti

from lariat.rod.kernels.addressing import (
    hessian_index,
    orientation_at,
    parameter_derivatives_at,
    sensitivity_columns_at,
    time_at,
)
from lariat.rod.kernels.adjoint import adjoint
from lariat.rod.kernels.memory import load3, load4, load33, load36, store36
from lariat.rod.kernels.rotations import left_jacobian, rotation_matrix
from lariat.rod.kernels.step_terms import internal_rate, step_times, target_share
from lariat.rod.kernels.types import Doubles, Integers, Matrices33, Matrices36
from lariat.rod.launch.codes import EndHold, Task
from lariat.rod.launch.layout import HISTORY_SLOTS, STEP_BLOCKS, Header, Section, TimeRow


@ti.real_func
def grip_sensitivities(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    w36: Matrices36,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Compute the rows of driven blocks in every column, from those of the solve before."""
    result = 0.0
    if task == Task.GRIP_SENSITIVITIES:
        n = ni[Header.NODES]
        count = 2 * n - 1
        times = time_at(ni, rod, step)
        back = ti.cast(w[times + TimeRow.GRIP_SOLVES_BACK], ti.i32)
        h = w[times + TimeRow.GRIP_DURATION]
        ring = HISTORY_SLOTS + 1
        block = ni[STEP_BLOCKS + step // ni[Header.SUBSTEPS]]
        actions = ni[Header.ACTION_GROUPS]
        groups = actions + (ni[Header.PARAMETERS] + 5) // 6 + (ni[Header.STATE_DIRECTIONS] + 5) // 6
        for group in range(groups):
            start = rod + ni[Section.SENSITIVITIES] + 18 * count * ring * group
            new = start + 18 * count * ((step + HISTORY_SLOTS) % ring)
            old = start + 18 * count * ((step + HISTORY_SLOTS - back) % ring)
            for end in range(2):
                kind = ni[Header.LEFT_END + end]
                driven = 0.0
                if group < actions and group == 2 * block + end:
                    driven = h
                if kind != EndHold.FREE:
                    outer = 18 * 2 * end * (n - 1)
                    moved = load36(w, old + outer)
                    for a in ti.static(range(3)):
                        moved[a, a] += driven
                    store36(w, new + outer, moved)
                    if kind == EndHold.CLAMPED:
                        edge = end * (n - 2)
                        rotation = 18 * (2 * edge + 1)
                        inner = 18 * 2 * (1 + end * (n - 3))
                        r = rotation_matrix(
                            load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, edge))
                        )
                        action = rod + ni[Section.ACTIONS] + 12 * block + 6 * end
                        rotation_per_velocity = driven * (
                            r.transpose() @ left_jacobian(h * load3(w, action + 3))
                        )
                        rotation_columns = load36(w, old + rotation)
                        for a in ti.static(range(3)):
                            for b in ti.static(range(3)):
                                rotation_columns[a, 3 + b] += rotation_per_velocity[a, b]
                        store36(w, new + rotation, rotation_columns)
                        store36(w, new + inner, moved)
    else:
        result = sensitivities(ni, w, w33, w36, task, rod, step, arg, real)
    return result


@ti.real_func
def sensitivities(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    w36: Matrices36,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Carry all columns over one solve, or write those of the positions as results.

    With self-contact the solve itself is left to `SOLVE_EXACTLY`, column by column.
    """
    result = 0.0
    if task == Task.SENSITIVITIES:
        n = ni[Header.NODES]
        count = 2 * n - 1
        first = ni[Header.FIRST_FREE]
        end = ni[Header.END_FREE]
        stop = ti.select(ni[Header.MAX_SELF_CONTACTS] > 0, first, end)
        ring = HISTORY_SLOTS + 1
        driven = ni[Header.ACTION_GROUPS]
        steady = driven + (ni[Header.PARAMETERS] + 5) // 6
        groups = steady + (ni[Header.STATE_DIRECTIONS] + 5) // 6
        rate = internal_rate(ni, w, rod, step)
        block = ni[STEP_BLOCKS + step // ni[Header.SUBSTEPS]]
        _h, weight, carry = step_times(ni, w, rod, step)
        for group in range(groups):
            alive = group >= driven
            if not alive:
                alive = group // 2 <= block and ni[Header.LEFT_END + group % 2] != EndHold.FREE
            if alive:
                start = rod + ni[Section.SENSITIVITIES] + 18 * count * ring * group
                new = start + 18 * count * ((step + HISTORY_SLOTS) % ring)
                ring_start = ti.raw_div(start, 18)
                new_index = ti.raw_div(new, 18)
                couplings = ti.raw_div(rod + ni[Section.INERTIA_COUPLINGS], 9)
                for j in range(first, end):
                    i = j // 2
                    moved = ti.Matrix.zero(ti.f64, 3, 6)
                    for back in range(1, ni[Header.HISTORY] + 1):
                        past = ring_start + count * ((step + HISTORY_SLOTS - back) % ring) + j
                        if j % 2 == 0:
                            mass = weight * w[rod + ni[Section.MASSES] + i]
                            share = target_share(ni, w, rod, step, back, carry)
                            moved += (mass * share) * w36[past]
                        else:
                            moved -= w33[couplings + HISTORY_SLOTS * i + back - 1] @ w36[past]
                    if group >= driven and group < steady:
                        force = parameter_derivatives_at(ni, rod, group - driven, j)
                        moved -= w36[ti.raw_div(force, 18)]
                    w36[new_index + j] = moved
                if rate > 0.0:
                    for i in range(n - 2):
                        j = 2 * i + 1
                        after = rod + ni[Section.BEND_JACOBIANS] + 27 * i
                        moment = ti.Matrix.zero(ti.f64, 3, 6)
                        for back in range(1, 3):
                            share = w[time_at(ni, rod, step) + TimeRow.BASE_SHARES + back - 1]
                            if share != 0.0:
                                past = (
                                    ring_start + count * ((step + HISTORY_SLOTS - back) % ring) + j
                                )
                                jacobian = share * load33(w, after + 9 * back)
                                moment += jacobian.transpose() @ w36[past + 2]
                                moment -= jacobian @ w36[past]
                        for a in ti.static(range(3)):
                            for b in ti.static(range(6)):
                                moment[a, b] *= rate * w[rod + ni[Section.BENDS] + 6 * i + a]
                        latest = load33(w, after)
                        to = new_index + j
                        if j >= first:
                            w36[to] = w36[to] - latest.transpose() @ moment
                        if j + 2 < end:
                            w36[to + 2] = w36[to + 2] + latest @ moment
                h = hessian_index(ni, rod, step)
                for j in range(ti.max(first - 2, 0), first):
                    for k in range(1, 3):
                        to = new_index + j + k
                        if j + k >= first and j + k < end:
                            w36[to] = w36[to] - w33[h + 3 * j + k] @ w36[new_index + j]
                for j in range(ti.max(end - 2, first), end):
                    for k in range(1, 3):
                        if j + k >= end and j + k < count:
                            coupled = w33[h + 3 * j + k].transpose() @ w36[new_index + j + k]
                            w36[new_index + j] = w36[new_index + j] - coupled
                for j in range(first, stop):
                    v = w36[new_index + j]
                    if j + 1 < end:
                        to = new_index + j + 1
                        w36[to] = w36[to] - w33[h + 3 * j + 1] @ v
                    if j + 2 < end:
                        to = new_index + j + 2
                        w36[to] = w36[to] - w33[h + 3 * j + 2] @ v
                for back in range(stop - first):
                    j = end - 1 - back
                    m = h + 3 * j
                    v = w33[m] @ w36[new_index + j]
                    if j + 1 < end:
                        v -= w33[m + 1].transpose() @ w36[new_index + j + 1]
                    if j + 2 < end:
                        v -= w33[m + 2].transpose() @ w36[new_index + j + 2]
                    w36[new_index + j] = v
    elif task == Task.WRITE_SENSITIVITIES:
        n = ni[Header.NODES]
        groups = sensitivity_columns_at(ni, rod, step, 0)[1]
        for group in range(groups):
            new, _groups = sensitivity_columns_at(ni, rod, step, group)
            out = rod + ni[Section.SENSITIVITIES_OUT]
            out += 18 * groups * n * (step // ni[Header.SUBSTEPS]) + 6 * group
            for i in range(n):
                for a in ti.static(range(3)):
                    for b in ti.static(range(6)):
                        w[out + 6 * groups * (3 * i + a) + b] = w[new + 36 * i + 6 * a + b]
    else:
        result = adjoint(ni, w, w33, w36, task, rod, step, arg, real)
    return result
