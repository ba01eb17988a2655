"""History before a roll-out, from its initial state, and the velocities after it.

Both follow the scheme: velocity is (x - base) / h, with the base a sum of earlier positions.
"""

from lariat.kernel_cache.language import ti
from lariat.rod.kernels.addressing import orientation_at, position_at, time_at
from lariat.rod.kernels.memory import load3, load4, store
from lariat.rod.kernels.rotations import (
    exponential,
    logarithm,
    quaternion_product,
    relative_rotation,
)
from lariat.rod.launch.layout import FROZEN_FRICTION_WIDTH, HISTORY_SLOTS, Header, Section, TimeRow


@ti.func
def start_history(ni: ti.template(), w: ti.template(), rod):
    """Turn the initial state into a history.

    The slot of the start holds positions and orientations, the slot before it the velocities; all
    slots before the start get the state one duration earlier.
    """
    n = ni[Header.NODES]
    last = HISTORY_SLOTS - 1
    h = w[time_at(ni, rod, 0)]
    for k in range(FROZEN_FRICTION_WIDTH * ni[Header.FRICTION_PAIRS]):
        w[rod + ni[Section.FROZEN_FRICTION] + k] = 0.0
    for i in range(n - 1):
        q = load4(w, orientation_at(ni, rod, last, i))
        q = q / ti.sqrt(q.dot(q))
        store(w, orientation_at(ni, rod, last, i), q)
        omega = load3(w, orientation_at(ni, rod, last - 1, i))
        before = quaternion_product(exponential(-h * omega), q)
        for slot in range(last):
            store(w, orientation_at(ni, rod, slot, i), before)
    for i in range(n):
        x = load3(w, position_at(ni, rod, last, i))
        v = load3(w, position_at(ni, rod, last - 1, i))
        for slot in range(last):
            store(w, position_at(ni, rod, slot, i), x - h * v)


@ti.func
def write_final_velocities(ni: ti.template(), w: ti.template(), rod):
    """Write the last velocities into the sections of the target positions and the tensions."""
    n = ni[Header.NODES]
    last = ni[Header.STEPS] + HISTORY_SLOTS - 1
    start = time_at(ni, rod, ni[Header.STEPS] - 1)
    h = w[start]
    nearer = w[start + TimeRow.BASE_SHARES]
    further = w[start + TimeRow.BASE_SHARES + 1]
    for i in range(n):
        x = load3(w, position_at(ni, rod, last, i))
        x1 = load3(w, position_at(ni, rod, last - 1, i))
        x0 = load3(w, position_at(ni, rod, last - 2, i))
        store(w, rod + ni[Section.TARGET_POSITIONS] + 3 * i, (x - nearer * x1 - further * x0) / h)
    for i in range(n - 1):
        q = load4(w, orientation_at(ni, rod, last, i))
        q1 = load4(w, orientation_at(ni, rod, last - 1, i))
        q0 = load4(w, orientation_at(ni, rod, last - 2, i))
        base = quaternion_product(q1, exponential(further * logarithm(relative_rotation(q1, q0))))
        turn = quaternion_product(q, ti.Vector([base[0], -base[1], -base[2], -base[3]]))
        turn = ti.select(turn[0] < 0.0, -1.0, 1.0) * turn
        store(w, rod + ni[Section.TENSIONS] + 3 * i, logarithm(turn) / h)
