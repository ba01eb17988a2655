"""Forward sensitivities of driven blocks, which follow their grips."""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    group_history,
    orientation_at,
    sensitivity_columns_at,
    time_at,
)
from lariat.rod.kernels.memory import bounded, load3, load4
from lariat.rod.kernels.parameter_derivatives import parameter_derivatives
from lariat.rod.kernels.rotations import left_jacobian, rotation_matrix
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import EndHold, Task
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
def grip_sensitivities(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
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
        groups = sensitivity_columns_at(ni, rod, 0)[1]
        for group in range(groups):
            start = sensitivity_columns_at(ni, rod, group)[0]
            history = group_history(ni, step, group)
            driven = 0.0
            if group < ni[Header.ACTION_GROUPS] and group == block:
                driven = h
            for held in range(6):
                # Outer node, frame and inner node of the left grip, then those of the right one.
                end = held // 3
                kind = ni[Header.LEFT_END + end]
                held_blocks = ti.select(kind == EndHold.CLAMPED, 3, 1)
                if kind != EndHold.FREE and held % 3 < held_blocks:
                    j = ti.select(end == 0, held % 3, 2 * n - 2 - held % 3)
                    at = bounded(start + COLUMNS_STRIDE * j)
                    for slot in range(history):
                        to = at + COLUMNS_WIDTH * (history - slot)
                        for k in range(COLUMNS_WIDTH):
                            w[to + k] = w[to - COLUMNS_WIDTH + k]
                    for k in range(COLUMNS_WIDTH):
                        w[at + k] = ti.select(
                            back <= history, w[at + COLUMNS_WIDTH * back + k], 0.0
                        )
                    rate = driven * ti.Matrix.identity(ti.f64, 3)
                    shift = 6 * end
                    if held % 3 == 1:
                        r = rotation_matrix(
                            load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, j // 2))
                        )
                        action = rod + ni[Section.ACTIONS] + 12 * block + 6 * end
                        turned = left_jacobian(h * load3(w, action + 3))
                        rate = driven * (r.transpose() @ turned)
                        shift += 3
                    for a in ti.static(range(3)):
                        for b in ti.static(range(3)):
                            to = at + shift + GROUP_COLUMNS * a + b
                            w[to] = w[to] + rate[a, b]
    else:
        result = parameter_derivatives(ni, w, w33, task, rod, step, arg, real)
    return result
