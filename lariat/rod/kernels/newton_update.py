"""How iterates move."""

import taichi as ti

from lariat.rod.kernels.access import (
    bend_turn,
    grip,
    hessian_at,
    internal_rate,
    orientation_at,
    past_turn,
    position_at,
    scalar,
    step_times,
    target_share,
    time_at,
)
from lariat.rod.kernels.energy import edges
from lariat.rod.kernels.rotations import (
    add3,
    exponential,
    load3,
    load4,
    load33,
    logarithm,
    quaternion_product,
    relative,
    rotation_matrix,
    store3,
    store4,
    turned,
)
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import EndHold, Task
from lariat.rod.launch.layout import (
    EFFECTIVE_BEND_WIDTH,
    HISTORY_SLOTS,
    Header,
    Scalar,
    Section,
    TimeRow,
)


@ti.real_func
def accept(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Keep the iterate as the point to step from, and the way downhill as right-hand side."""
    result = 0.0
    if task == Task.ACCEPT_ITERATE:
        n = ni[Header.NODES]
        for k in range(3 * n):
            w[rod + ni[Section.ACCEPTED_POSITIONS] + k] = w[
                position_at(ni, rod, step + HISTORY_SLOTS, 0) + k
            ]
        for k in range(4 * (n - 1)):
            w[rod + ni[Section.ACCEPTED_ORIENTATIONS] + k] = w[
                orientation_at(ni, rod, step + HISTORY_SLOTS, 0) + k
            ]
        for j in range(2 * n - 1):
            downhill = 0.0
            if j >= ni[Header.FIRST_FREE] and j < ni[Header.END_FREE]:
                downhill = -1.0
            gradient = load3(w, rod + ni[Section.GRADIENT] + 3 * j)
            store3(w, rod + ni[Section.NEWTON_STEP] + 3 * j, downhill * gradient)
    else:
        result = edges(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def apply_step(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Move the iterate to accepted + share * step; the tensions follow linearly."""
    result = 0.0
    if task == Task.APPLY_STEP:
        share = real
        n = ni[Header.NODES]
        d = rod + ni[Section.NEWTON_STEP]
        stretch = scalar(ni, w, rod, Scalar.STRETCH_STIFFNESS)
        length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        for i in range(n - 1):
            x = load3(w, rod + ni[Section.ACCEPTED_POSITIONS] + 3 * i)
            nearby = load3(w, rod + ni[Section.ACCEPTED_POSITIONS] + 3 * i + 3)
            q = load4(w, rod + ni[Section.ACCEPTED_ORIENTATIONS] + 4 * i)
            r = rotation_matrix(q)
            phi = share * load3(w, d + 6 * i + 3)
            edge = nearby - x + share * (load3(w, d + 6 * i + 6) - load3(w, d + 6 * i))
            d3 = r @ ti.Vector([phi[1], -phi[0], 1.0])
            store3(w, rod + ni[Section.TENSIONS] + 3 * i, stretch * (edge / length - d3))
            store3(
                w, position_at(ni, rod, step + HISTORY_SLOTS, i), x + share * load3(w, d + 6 * i)
            )
            store4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, i), turned(q, phi))
        x = load3(w, rod + ni[Section.ACCEPTED_POSITIONS] + 3 * n - 3)
        store3(
            w,
            position_at(ni, rod, step + HISTORY_SLOTS, n - 1),
            x + share * load3(w, d + 6 * n - 6),
        )
    else:
        result = accept(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def targets(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Where inertia alone would lead, and the bends' stiffness and rest with internal damping."""
    result = 0.0
    if task == Task.INERTIAL_TARGETS:
        n = ni[Header.NODES]
        _h, _weight, carry = step_times(ni, w, rod, step)
        for i in range(n):
            target = ti.Vector([0.0, 0.0, 0.0])
            for back in range(1, ni[Header.HISTORY] + 1):
                share = target_share(ni, w, rod, step, back, carry)
                target += share * load3(w, position_at(ni, rod, step + HISTORY_SLOTS - back, i))
            store3(w, rod + ni[Section.TARGET_POSITIONS] + 3 * i, target)
        for i in range(n - 1):
            turn = ti.Vector([0.0, 0.0, 0.0])
            for back in range(2, ni[Header.HISTORY] + 1):
                share = target_share(ni, w, rod, step, back, carry)
                turn += share * logarithm(past_turn(ni, w, rod, step, i, back))
            q1 = load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS - 1, i))
            target = quaternion_product(q1, exponential(turn))
            store4(w, rod + ni[Section.TARGET_ORIENTATIONS] + 4 * i, target)
        # k |y - rest|^2 + rate k |y - before|^2 is, but for a constant, one square as well.
        rate = internal_rate(ni, w, rod, step)
        damped = rate > 0.0 or ni[Header.PARAMETERS] > 0
        for j in range(n - 2):
            before = ti.Vector([0.0, 0.0, 0.0])
            if damped:
                for back in range(1, 3):
                    share = w[time_at(ni, rod, step) + TimeRow.BASE_SHARES + back - 1]
                    y, _jacobian, _c, _d = bend_turn(ni, w, rod, step + HISTORY_SLOTS - back, j)
                    before += share * y
            bend = rod + ni[Section.BENDS] + 6 * j
            to = rod + ni[Section.EFFECTIVE_BENDS] + EFFECTIVE_BEND_WIDTH * j
            store3(w, to, (1.0 + rate) * load3(w, bend))
            store3(w, to + 3, (load3(w, bend + 3) + rate * before) / (1.0 + rate))
            store3(w, to + 6, before)
    else:
        result = apply_step(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def predict(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """The start of the iteration: where inertia leads (`arg` 1), or everything where it was.

    Inertia must not carry the rod into an obstacle, whose far side might then be the nearer one,
    nor tear edges far out of their length.
    """
    result = 0.0
    if task == Task.PREDICT:
        n = ni[Header.NODES]
        stretch = scalar(ni, w, rod, Scalar.STRETCH_STIFFNESS)
        length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        leap = 0.0
        strain = 0.0
        before = ti.Vector([0.0, 0.0, 0.0])
        for i in range(n):
            x1 = load3(w, position_at(ni, rod, step + HISTORY_SLOTS - 1, i))
            away = load3(w, rod + ni[Section.TARGET_POSITIONS] + 3 * i) - x1
            leap = ti.max(leap, away.norm())
            if i > 0:
                strain = ti.max(strain, (away - before).norm())
            before = away
        near = ni[Header.OBSTACLES] > 0 or ni[Header.MAX_SELF_CONTACTS] > 0
        clear = not near or leap < scalar(ni, w, rod, Scalar.CONTACT_REACH)
        share = 0.0
        if arg == 1 and clear and strain < 2.0 * length:
            share = 1.0
        for i in range(n):
            x1 = load3(w, position_at(ni, rod, step + HISTORY_SLOTS - 1, i))
            x = x1 + share * (load3(w, rod + ni[Section.TARGET_POSITIONS] + 3 * i) - x1)
            store3(w, position_at(ni, rod, step + HISTORY_SLOTS, i), x)
        for i in range(n - 1):
            q1 = load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS - 1, i))
            target = load4(w, rod + ni[Section.TARGET_ORIENTATIONS] + 4 * i)
            q = q1 + share * (target - q1)
            store4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, i), q)
            edge = load3(w, position_at(ni, rod, step + HISTORY_SLOTS - 1, i + 1)) - load3(
                w, position_at(ni, rod, step + HISTORY_SLOTS - 1, i)
            )
            d3 = rotation_matrix(q1) @ ti.Vector([0.0, 0.0, 1.0])
            store3(w, rod + ni[Section.TENSIONS] + 3 * i, stretch * (edge / length - d3))
    else:
        result = targets(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def move_grips(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Put driven ends where they belong (`exactly`), or write their way there as a step."""
    result = 0.0
    if task == Task.MOVE_GRIPS:
        exactly = arg
        n = ni[Header.NODES]
        d = rod + ni[Section.NEWTON_STEP]
        for end in range(2):
            kind = ni[Header.LEFT_END + end]
            if kind != EndHold.FREE:
                outer, inner, q = grip(ni, w, rod, step, end)
                node = end * (n - 1)
                if exactly:
                    store3(w, position_at(ni, rod, step + HISTORY_SLOTS, node), outer)
                else:
                    x = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, node))
                    store3(w, d + 6 * node, outer - x)
                if kind == EndHold.CLAMPED:
                    node = 1 + end * (n - 3)
                    edge = end * (n - 2)
                    if exactly:
                        store3(w, position_at(ni, rod, step + HISTORY_SLOTS, node), inner)
                        store4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, edge), q)
                    else:
                        x = load3(w, position_at(ni, rod, step + HISTORY_SLOTS, node))
                        before = load4(w, orientation_at(ni, rod, step + HISTORY_SLOTS, edge))
                        store3(w, d + 6 * node, inner - x)
                        store3(w, d + 6 * edge + 3, logarithm(relative(before, q)))
    else:
        result = predict(ni, w, task, rod, step, arg, real)
    return result


@ti.real_func
def subtract_couplings(
    ni: Integers, w: Doubles, task: ti.i32, rod: ti.i32, step: ti.i32, arg: ti.i32, real: ti.f64
) -> ti.f64:
    """Take from the free blocks of `d` what the steps of the fixed blocks cause there."""
    result = 0.0
    if task == Task.SUBTRACT_COUPLINGS:
        d = arg
        first = ni[Header.FIRST_FREE]
        end = ni[Header.END_FREE]
        count = 2 * ni[Header.NODES] - 1
        for j in range(ti.max(first - 2, 0), first):
            v = load3(w, d + 3 * j)
            for k in range(2):
                to = j + 1 + k
                if to >= first and to < end:
                    m = hessian_at(ni, rod, step, j) + 9 + 9 * k
                    add3(w, d + 3 * to, -(load33(w, m) @ v))
        for j in range(ti.max(end - 2, first), end):
            for k in range(2):
                to = j + 1 + k
                if to >= end and to < count:
                    m = hessian_at(ni, rod, step, j) + 9 + 9 * k
                    add3(w, d + 3 * j, -(load33(w, m).transpose() @ load3(w, d + 3 * to)))
    else:
        result = move_grips(ni, w, task, rod, step, arg, real)
    return result
