"""Forward sensitivities: columns dx/da for actions, parameters and initial state.

Each solve carries columns S = dx/da on,  H S = -dg/dx1 S1 - dg/dx0 S0 - ... - dg/dtheta,  with the
factors of its last Newton step, in groups of `GROUP_COLUMNS`, the columns of a group in lanes. Each
block of unknowns keeps its rows after the last solves, the latest first.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    group_history,
    hessian_index,
    parameter_derivatives_at,
    sensitivity_columns_at,
    steady_groups,
    time_at,
    transposed_index,
)
from lariat.rod.kernels.air_drag import air_drag_sensitivities, has_air_drag
from lariat.rod.kernels.friction import friction_sensitivities, slip_sensitivities, stamp_slips
from lariat.rod.kernels.memory import (
    bounded,
    bounded_index,
    load3,
    load33,
    load_column,
    store,
    store_column,
)
from lariat.rod.kernels.plasticity import plastic_sensitivities, set_sensitivities
from lariat.rod.kernels.prediction import predict
from lariat.rod.kernels.step_terms import internal_rate, step_times, target_share
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import Task
from lariat.rod.launch.layout import (
    COLUMNS_STRIDE,
    COLUMNS_WIDTH,
    GROUP_COLUMNS,
    HISTORY_SLOTS,
    STEP_BLOCKS,
    Header,
    Section,
    TimeRow,
)


@ti.real_func
def sensitivities(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Carry all columns over one solve, or write those of the positions as results.

    Those of slips and sets follow when the results are written.

    With self-contact the solve itself is left to `SOLVE_EXACTLY`, column by column.
    """
    result = 0.0
    if task == Task.SENSITIVITIES:
        n = ni[Header.NODES]
        first = ni[Header.FIRST_FREE]
        end = ni[Header.END_FREE]
        stop = ti.select(ni[Header.MAX_SELF_CONTACTS] > 0, first, end)
        driven = ni[Header.ACTION_GROUPS]
        steady = steady_groups(ni)
        groups = sensitivity_columns_at(ni, rod, 0)[1]
        rate = internal_rate(ni, w, rod, step)
        block = ni[STEP_BLOCKS + step // ni[Header.SUBSTEPS]]
        _h, weight, carry = step_times(ni, w, rod, step)
        h = hessian_index(ni, rod, step)
        transposed = transposed_index(ni, rod, step)
        last = COLUMNS_WIDTH * (HISTORY_SLOTS + 1)
        for group in range(groups):
            if group >= driven or group <= block:
                start = sensitivity_columns_at(ni, rod, group)[0]
                history = group_history(ni, step, group)
                for j in range(first, end):
                    at = bounded(start + COLUMNS_STRIDE * j)
                    i = j // 2
                    if group >= driven and group < steady:
                        force = parameter_derivatives_at(ni, rod, group - driven, j)
                        for k in range(COLUMNS_WIDTH):
                            w[at + last + k] = -w[force + k]
                    else:
                        for k in range(COLUMNS_WIDTH):
                            w[at + last + k] = 0.0
                    for later in ti.static(range(HISTORY_SLOTS)):
                        back = ti.static(HISTORY_SLOTS - later)
                        if back <= history:
                            mass = weight * w[rod + ni[Section.MASSES] + i]
                            share = mass * target_share(ni, w, rod, step, back, carry)
                            m = share * ti.Matrix.identity(ti.f64, 3)
                            if j % 2 == 1:
                                coupling = rod + ni[Section.INERTIA_COUPLINGS]
                                m = -load33(w, coupling + 9 * (HISTORY_SLOTS * i + back - 1))
                            for c in range(GROUP_COLUMNS):
                                old = at + COLUMNS_WIDTH * (back - 1) + c
                                v = load_column(w, old)
                                store_column(w, old + COLUMNS_WIDTH, v)
                                total = load_column(w, at + last + c) + m @ v
                                store_column(w, at + last + c, total)
                    for k in range(COLUMNS_WIDTH):
                        w[at + k] = w[at + last + k]
                if rate > 0.0:
                    for i in range(n - 2):
                        j = 2 * i + 1
                        at = bounded(start + COLUMNS_STRIDE * j)
                        after = rod + ni[Section.BEND_JACOBIANS] + 27 * i
                        latest = load33(w, after)
                        stiffness = rate * load3(w, rod + ni[Section.BENDS] + 6 * i)
                        for back in ti.static(range(1, 3)):
                            share = w[time_at(ni, rod, step) + TimeRow.BASE_SHARES + back - 1]
                            if share != 0.0 and back <= history:
                                jacobian = share * load33(w, after + 9 * back)
                                left = ti.select(j >= first, 1.0, 0.0)
                                right = ti.select(j + 2 < end, 1.0, 0.0)
                                for c in range(GROUP_COLUMNS):
                                    old = at + COLUMNS_WIDTH * back + c
                                    moment = jacobian.transpose() @ load_column(
                                        w, old + 2 * COLUMNS_STRIDE
                                    ) - jacobian @ load_column(w, old)
                                    moment *= stiffness
                                    to = at + c
                                    near = left * (latest.transpose() @ moment)
                                    store_column(w, to, load_column(w, to) - near)
                                    to = at + 2 * COLUMNS_STRIDE + c
                                    far = right * (latest @ moment)
                                    store_column(w, to, load_column(w, to) + far)
                if has_air_drag(ni, w, rod):
                    air_drag_sensitivities(ni, w, rod, step, start, history)
                if ni[Header.FRICTION_PAIRS] > 0:
                    friction_sensitivities(ni, w, rod, step, group, history)
                if ni[Header.LAYERS] > 0:
                    plastic_sensitivities(ni, w, rod, step, group)
                for j in range(ti.max(first - 2, 0), first):
                    for k in ti.static(range(1, 3)):
                        if j + k >= first and j + k < end:
                            m = w33[bounded_index(h + 3 * j) + k]
                            at = bounded(start + COLUMNS_STRIDE * j)
                            for c in range(GROUP_COLUMNS):
                                to = at + COLUMNS_STRIDE * k + c
                                coupled = m @ load_column(w, at + c)
                                store_column(w, to, load_column(w, to) - coupled)
                for j in range(ti.max(end - 2, first), end):
                    for k in ti.static(range(1, 3)):
                        if j + k >= end and j + k < 2 * n - 1:
                            m = w33[bounded_index(transposed + 3 * j) + k].transpose()
                            to = bounded(start + COLUMNS_STRIDE * j)
                            for c in range(GROUP_COLUMNS):
                                coupled = m @ load_column(w, to + COLUMNS_STRIDE * k + c)
                                store_column(w, to + c, load_column(w, to + c) - coupled)
                for j in range(first, stop):
                    m = bounded_index(h + 3 * j)
                    near = ti.select(j + 1 < end, 1.0, 0.0) * w33[m + 1]
                    far = ti.select(j + 2 < end, 1.0, 0.0) * w33[m + 2]
                    at = bounded(start + COLUMNS_STRIDE * j)
                    for c in range(GROUP_COLUMNS):
                        v = load_column(w, at + c)
                        to = at + COLUMNS_STRIDE + c
                        store_column(w, to, load_column(w, to) - near @ v)
                        to = at + 2 * COLUMNS_STRIDE + c
                        store_column(w, to, load_column(w, to) - far @ v)
                for back in range(stop - first):
                    j = end - 1 - back
                    m = bounded_index(h + 3 * j)
                    inverse = w33[m]
                    m = bounded_index(transposed + 3 * j)
                    near = w33[m + 1].transpose()
                    far = w33[m + 2].transpose()
                    at = bounded(start + COLUMNS_STRIDE * j)
                    for c in range(GROUP_COLUMNS):
                        v = inverse @ load_column(w, at + c)
                        after = load_column(w, at + COLUMNS_STRIDE + c)
                        v -= near @ ti.select(j + 1 < end, after, 0.0)
                        after = load_column(w, at + 2 * COLUMNS_STRIDE + c)
                        v -= far @ ti.select(j + 2 < end, after, 0.0)
                        store_column(w, at + c, v)
    elif task == Task.WRITE_SENSITIVITIES:
        n = ni[Header.NODES]
        groups = sensitivity_columns_at(ni, rod, 0)[1]
        solve = step // ni[Header.SUBSTEPS]
        for group in range(groups):
            alive = group >= ni[Header.ACTION_GROUPS] or group <= ni[STEP_BLOCKS + solve]
            if alive and ni[Header.FRICTION_PAIRS] > 0:
                slip_sensitivities(ni, w, rod, step, group, group_history(ni, step, group))
            if alive and ni[Header.LAYERS] > 0:
                set_sensitivities(ni, w, rod, step, group)
            start = sensitivity_columns_at(ni, rod, group)[0]
            out = rod + ni[Section.SENSITIVITIES_OUT] + GROUP_COLUMNS * group
            out += COLUMNS_WIDTH * groups * n * solve
            for i in range(n):
                for a in range(3):
                    at = bounded(start + 2 * COLUMNS_STRIDE * i + GROUP_COLUMNS * a)
                    row = ti.Vector([w[at + b] for b in range(GROUP_COLUMNS)])
                    to = out + GROUP_COLUMNS * groups * (3 * i + a)
                    store(w, to, ti.select(alive, row, 0.0))
        if ni[Header.FRICTION_PAIRS] > 0:
            stamp_slips(ni, w, rod, step)
    else:
        result = predict(ni, w, w33, task, rod, step, arg, real)
    return result
