"""Forward sensitivities: columns dx/da for actions, parameters and initial state.

Each solve carries columns S = dx/da on,  H S = -dg/dx1 S1 - dg/dx0 S0 - ... - dg/dtheta,  with the
factors of its last Newton step, in groups of `GROUP_COLUMNS`. A ring holds the columns of the last
solves.
"""

import taichi as ti

from lariat.rod.kernels.addressing import (
    hessian_index,
    orientation_at,
    parameter_derivatives_at,
    sensitivity_columns_at,
    steady_groups,
    time_at,
)
from lariat.rod.kernels.adjoint import adjoint
from lariat.rod.kernels.memory import bounded, bounded_index, load3, load4, load33
from lariat.rod.kernels.rotations import left_jacobian, rotation_matrix
from lariat.rod.kernels.step_terms import internal_rate, step_times, target_share
from lariat.rod.kernels.types import Doubles, Integers, Matrices33, Matrices312
from lariat.rod.launch.codes import EndHold, Task
from lariat.rod.launch.layout import (
    GROUP_COLUMNS,
    HISTORY_SLOTS,
    MATRIX_WIDTH,
    STEP_BLOCKS,
    Header,
    Section,
    TimeRow,
)


@ti.real_func
def grip_sensitivities(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    w312: Matrices312,
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
        times = time_at(ni, rod, step)
        back = ti.cast(w[times + TimeRow.GRIP_SOLVES_BACK], ti.i32)
        h = w[times + TimeRow.GRIP_DURATION]
        block = ni[STEP_BLOCKS + step // ni[Header.SUBSTEPS]]
        _new, groups = sensitivity_columns_at(ni, rod, step, 0)
        for group in range(groups):
            new, _groups = sensitivity_columns_at(ni, rod, step, group)
            old, _groups = sensitivity_columns_at(ni, rod, step - back, group)
            driven = 0.0
            if group < ni[Header.ACTION_GROUPS] and group == block:
                driven = h
            for end in range(2):
                kind = ni[Header.LEFT_END + end]
                if kind != EndHold.FREE:
                    outer = 2 * MATRIX_WIDTH * end * (n - 1)
                    for k in range(MATRIX_WIDTH):
                        w[new + outer + k] = w[old + outer + k]
                    for a in range(3):
                        to = new + outer + (GROUP_COLUMNS + 1) * a + 6 * end
                        w[to] = w[to] + driven
                    if kind == EndHold.CLAMPED:
                        edge = end * (n - 2)
                        rotation = MATRIX_WIDTH * (2 * edge + 1)
                        inner = 2 * MATRIX_WIDTH * (1 + end * (n - 3))
                        r = rotation_matrix(
                            load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, edge))
                        )
                        action = rod + ni[Section.ACTIONS] + 12 * block + 6 * end
                        rotation_per_velocity = driven * (
                            r.transpose() @ left_jacobian(h * load3(w, action + 3))
                        )
                        for k in range(MATRIX_WIDTH):
                            w[new + rotation + k] = w[old + rotation + k]
                            w[new + inner + k] = w[new + outer + k]
                        for a in ti.static(range(3)):
                            for b in ti.static(range(3)):
                                to = new + rotation + GROUP_COLUMNS * a + 6 * end + 3 + b
                                w[to] = w[to] + rotation_per_velocity[a, b]
    else:
        result = sensitivities(ni, w, w33, w312, task, rod, step, arg, real)
    return result


@ti.real_func
def sensitivities(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    w312: Matrices312,
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
        steady = steady_groups(ni)
        _new, groups = sensitivity_columns_at(ni, rod, step, 0)
        rate = internal_rate(ni, w, rod, step)
        block = ni[STEP_BLOCKS + step // ni[Header.SUBSTEPS]]
        _h, weight, carry = step_times(ni, w, rod, step)
        for group in range(groups):
            if group >= driven or group <= block:
                start = rod + ni[Section.SENSITIVITIES] + MATRIX_WIDTH * count * ring * group
                ring_start = ti.raw_div(start, MATRIX_WIDTH)
                new_index = ring_start + count * ((step + HISTORY_SLOTS) % ring)
                couplings = ti.raw_div(rod + ni[Section.INERTIA_COUPLINGS], 9)
                for j in range(first, end):
                    i = j // 2
                    moved = ti.Matrix.zero(ti.f64, 3, GROUP_COLUMNS)
                    for back in range(1, ni[Header.HISTORY] + 1):
                        past = ring_start + count * ((step + HISTORY_SLOTS - back) % ring) + j
                        if j % 2 == 0:
                            mass = weight * w[rod + ni[Section.MASSES] + i]
                            share = target_share(ni, w, rod, step, back, carry)
                            moved += (mass * share) * w312[past]
                        else:
                            moved -= w33[couplings + HISTORY_SLOTS * i + back - 1] @ w312[past]
                    if group >= driven and group < steady:
                        force = parameter_derivatives_at(ni, rod, group - driven, j)
                        moved -= w312[ti.raw_div(force, MATRIX_WIDTH)]
                    w312[new_index + j] = moved
                if rate > 0.0:
                    for i in range(n - 2):
                        j = 2 * i + 1
                        after = rod + ni[Section.BEND_JACOBIANS] + 27 * i
                        moment = ti.Matrix.zero(ti.f64, 3, GROUP_COLUMNS)
                        for back in range(1, 3):
                            share = w[time_at(ni, rod, step) + TimeRow.BASE_SHARES + back - 1]
                            if share != 0.0:
                                past = (
                                    ring_start + count * ((step + HISTORY_SLOTS - back) % ring) + j
                                )
                                jacobian = share * load33(w, after + 9 * back)
                                moment += jacobian.transpose() @ w312[past + 2]
                                moment -= jacobian @ w312[past]
                        for a in ti.static(range(3)):
                            for b in ti.static(range(GROUP_COLUMNS)):
                                moment[a, b] *= rate * w[rod + ni[Section.BENDS] + 6 * i + a]
                        latest = load33(w, after)
                        to = new_index + j
                        if j >= first:
                            w312[to] = w312[to] - latest.transpose() @ moment
                        if j + 2 < end:
                            w312[to + 2] = w312[to + 2] + latest @ moment
                h = hessian_index(ni, rod, step)
                for j in range(ti.max(first - 2, 0), first):
                    for k in range(1, 3):
                        to = new_index + j + k
                        if j + k >= first and j + k < end:
                            w312[to] = w312[to] - w33[h + 3 * j + k] @ w312[new_index + j]
                for j in range(ti.max(end - 2, first), end):
                    for k in range(1, 3):
                        if j + k >= end and j + k < count:
                            coupled = w33[h + 3 * j + k].transpose() @ w312[new_index + j + k]
                            w312[new_index + j] = w312[new_index + j] - coupled
                v = w312[bounded_index(new_index + first)]
                v_next = w312[bounded_index(new_index + ti.min(first + 1, end - 1))]
                for j in range(first, stop):
                    w312[bounded_index(new_index + j)] = v
                    m = bounded_index(h + 3 * j)
                    after = v_next - w33[m + 1] @ v
                    v_next = w312[bounded_index(new_index + ti.min(j + 2, end - 1))]
                    v_next -= w33[m + 2] @ v
                    v = after
                # The couplings of the last blocks with driven ones are multiplied by zero.
                v = ti.Matrix.zero(ti.f64, 3, GROUP_COLUMNS)
                v_next = ti.Matrix.zero(ti.f64, 3, GROUP_COLUMNS)
                for back in range(stop - first):
                    j = end - 1 - back
                    m = bounded_index(h + 3 * j)
                    before = w33[m] @ w312[bounded_index(new_index + j)]
                    before -= w33[m + 2].transpose() @ v_next
                    before -= w33[m + 1].transpose() @ v
                    v_next = v
                    v = before
                    w312[bounded_index(new_index + j)] = v
    elif task == Task.WRITE_SENSITIVITIES:
        n = ni[Header.NODES]
        groups = sensitivity_columns_at(ni, rod, step, 0)[1]
        for group in range(groups):
            new, _groups = sensitivity_columns_at(ni, rod, step, group)
            out = rod + ni[Section.SENSITIVITIES_OUT] + GROUP_COLUMNS * group
            out += MATRIX_WIDTH * groups * n * (step // ni[Header.SUBSTEPS])
            for i in range(n):
                for a in range(3):
                    to = bounded(out + GROUP_COLUMNS * groups * (3 * i + a))
                    at = bounded(new + 2 * MATRIX_WIDTH * i + GROUP_COLUMNS * a)
                    for b in ti.static(range(GROUP_COLUMNS)):
                        w[to + b] = w[at + b]
    else:
        result = adjoint(ni, w, w33, w312, task, rod, step, arg, real)
    return result
