"""Start of a solve: inertial targets and first iterate.

The inertial target of a node is the sum of its last positions, with shares

    y = sum_k (base_k + carry momentum_k) x_(t-k),  carry = 1 / (1 + c h),

which for implicit Euler is y = x1 + carry (x1 - x0). The target q^ of an edge is the same sum in
the chart of its last orientation: q^ = q1 exp(sum_k share_k log(conj(q1) q_(t-k))).
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import (
    effective_bend_at,
    orientation_at,
    position_at,
    scalar,
    target_orientation_at,
    target_position_at,
    time_at,
)
from lariat.rod.kernels.memory import (
    bounded,
    lane_count,
    load3,
    load4,
    load_lane3,
    load_lane4,
    store,
    store_lane,
)
from lariat.rod.kernels.newton_update import apply_step
from lariat.rod.kernels.plasticity import kept_rest
from lariat.rod.kernels.rotations import (
    exponential,
    logarithm,
    quaternion_product,
    relative_rotation,
    rotation_matrix,
)
from lariat.rod.kernels.step_terms import bend_rotation, internal_rate, step_times, target_share
from lariat.rod.kernels.types import Doubles, Integers, Matrices33
from lariat.rod.launch.codes import FrictionMode, Task
from lariat.rod.launch.layout import (
    EFFECTIVE_BEND_WIDTH,
    HISTORY_SLOTS,
    LANE_COUNT,
    EffectiveBend,
    Header,
    Scalar,
    Section,
    TimeRow,
)


@ti.real_func
def inertial_targets(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Compute the inertial targets and the bends' effective stiffness and rest.

    Internal damping k tau / h |u - u1|^2 / 2 and the bends' own energy k |u - rest|^2 / 2 add up,
    except for a constant, to one square with a higher stiffness and another rest. What the layers
    of a bend keep shifts its rest.
    """
    result = 0.0
    if task == Task.INERTIAL_TARGETS:
        n = ni[Header.NODES]
        history = ni[Header.HISTORY]
        _h, _weight, carry = step_times(ni, w, rod, step)
        # Offsets are computed before the loops, which would read the sizes again after every store.
        positions = position_at(ni, rod, step + HISTORY_SLOTS, 0)
        latest = orientation_at(ni, rod, step + HISTORY_SLOTS - 1, 0)
        target_positions = target_position_at(ni, rod, step, 0)
        target_orientations = target_orientation_at(ni, rod, step, 0)
        bends = rod + ni[Section.BENDS]
        effective_bends = effective_bend_at(ni, rod, step, 0)
        for i in range(n):
            target = ti.Vector([0.0, 0.0, 0.0])
            for back in range(1, history + 1):
                share = target_share(ni, w, rod, step, back, carry)
                target += share * load3(w, positions + 3 * (i - n * back))
            store(w, target_positions + 3 * i, target)
        lanes = bounded(rod + ni[Section.LANES])
        for strip in range((n - 1 + LANE_COUNT - 1) // LANE_COUNT):
            first = LANE_COUNT * strip
            count = ti.min(LANE_COUNT, n - 1 - first)
            width = lane_count(count)
            for k in range(count):
                store_lane(w, lanes + k, 0, load4(w, latest + 4 * (first + k)))
            for k in range(width):
                store_lane(w, lanes + k, 8, ti.Vector([0.0, 0.0, 0.0]))
            for back in range(2, history + 1):
                share = target_share(ni, w, rod, step, back, carry)
                for k in range(count):
                    q = latest + 4 * (first + k - (back - 1) * (n - 1))
                    store_lane(w, lanes + k, 4, load4(w, q))
                for k in range(width):
                    at = lanes + k
                    u = relative_rotation(load_lane4(w, at, 0), load_lane4(w, at, 4))
                    store_lane(w, at, 8, load_lane3(w, at, 8) + share * logarithm(u))
            for k in range(width):
                at = lanes + k
                turn = exponential(load_lane3(w, at, 8))
                store_lane(w, at, 11, quaternion_product(load_lane4(w, at, 0), turn))
            for k in range(count):
                store(w, target_orientations + 4 * (first + k), load_lane4(w, lanes + k, 11))
        rate = internal_rate(ni, w, rod, step)
        damped = rate > 0.0 or ni[Header.PARAMETERS] > 0
        for j in range(n - 2):
            before = ti.Vector([0.0, 0.0, 0.0])
            if damped:
                for back in range(1, 3):
                    share = w[time_at(ni, rod, step) + TimeRow.BASE_SHARES + back - 1]
                    u, _jacobian, _c, _d = bend_rotation(ni, w, rod, step + HISTORY_SLOTS - back, j)
                    before += share * u
            bend = bends + 6 * j
            rest = load3(w, bend + 3)
            for k in range(ni[Header.LAYERS]):
                rest += kept_rest(ni, w, rod, step, j, k)
            to = effective_bends + EFFECTIVE_BEND_WIDTH * j
            store(w, to + EffectiveBend.STIFFNESS, (1.0 + rate) * load3(w, bend))
            store(w, to + EffectiveBend.REST, (rest + rate * before) / (1.0 + rate))
            store(w, to + EffectiveBend.DAMPED_FROM, before)
    else:
        result = apply_step(ni, w, w33, task, rod, step, arg, real)
    return result


@ti.real_func
def predict(
    ni: Integers,
    w: Doubles,
    w33: Matrices33,
    task: ti.i32,
    rod: ti.i32,
    step: ti.i32,
    arg: ti.i32,
    real: ti.f64,
) -> ti.f64:
    """Set the first iterate: the inertial target (`arg` 1), or the last shape.

    The last shape is also taken where the target could lie beyond the middle of an obstacle or of
    another strand, or would stretch edges far beyond their length.
    """
    result = 0.0
    if task == Task.PREDICT:
        n = ni[Header.NODES]
        stretch = scalar(ni, w, rod, Scalar.STRETCH_STIFFNESS)
        length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
        positions = position_at(ni, rod, step + HISTORY_SLOTS, 0)
        orientations = orientation_at(ni, rod, step + HISTORY_SLOTS, 0)
        target_positions = target_position_at(ni, rod, step, 0)
        target_orientations = target_orientation_at(ni, rod, step, 0)
        tensions = rod + ni[Section.TENSIONS]
        largest_displacement = 0.0
        strain = 0.0
        previous = ti.Vector([0.0, 0.0, 0.0])
        for i in range(n):
            x1 = load3(w, positions + 3 * (i - n))
            displacement = load3(w, target_positions + 3 * i) - x1
            largest_displacement = ti.max(largest_displacement, displacement.norm())
            if i > 0:
                strain = ti.max(strain, (displacement - previous).norm())
            previous = displacement
        near = ni[Header.OBSTACLES] > 0 or ni[Header.MAX_SELF_CONTACTS] > 0
        unobstructed = not near or largest_displacement < scalar(ni, w, rod, Scalar.CONTACT_REACH)
        share = 0.0
        if arg == 1 and unobstructed and strain < 2.0 * length:
            share = 1.0
        if ni[Header.FRICTION_PAIRS] > 0:
            mode = ti.select(arg == 1, FrictionMode.FIRST, FrictionMode.LINE_SEARCH)
            w[rod + ni[Section.FRICTION_CONTACTS] + 1] = mode
        for i in range(n):
            x1 = load3(w, positions + 3 * (i - n))
            store(w, positions + 3 * i, x1 + share * (load3(w, target_positions + 3 * i) - x1))
        for i in range(n - 1):
            q1 = load4(w, orientations + 4 * (i - n + 1))
            q = q1 + share * (load4(w, target_orientations + 4 * i) - q1)
            store(w, orientations + 4 * i, q)
            x1 = load3(w, positions + 3 * (i - n))
            edge = load3(w, positions + 3 * (i - n) + 3) - x1
            d3 = rotation_matrix(q1) @ ti.Vector([0.0, 0.0, 1.0])
            store(w, tensions + 3 * i, stretch * (edge / length - d3))
    else:
        result = inertial_targets(ni, w, w33, task, rod, step, arg, real)
    return result
