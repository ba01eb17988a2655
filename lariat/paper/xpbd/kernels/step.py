"""Step of Algorithm 1: lines 4 to 14, and the velocities after them."""

from lariat.kernel_cache.language import ti
from lariat.paper.xpbd.kernels.addressing import place, scalar
from lariat.paper.xpbd.kernels.collision import find_contacts
from lariat.paper.xpbd.kernels.constraints import (
    correct_bend,
    correct_contact,
    correct_stretch,
    step_constants,
)
from lariat.paper.xpbd.kernels.quaternions import rotation_imaginary, vector_times
from lariat.paper.xpbd.launch.layout import PREDICTED_WIDTH, STEP_BLOCKS, Header, Scalar, Section
from lariat.rod.kernels.memory import load3, load4, store
from lariat.rod.kernels.rotations import exponential, quaternion_product
from lariat.rod.launch.codes import EndHold


@ti.func
def action(ni: ti.template(), w: ti.template(), rod, step, end, kind):
    """Linear (`kind` 0) or angular (`kind` 1) velocity of a grip."""
    block = ni[STEP_BLOCKS + step // ni[Header.SUBSTEPS]]
    return load3(w, place(ni, rod, Section.ACTIONS, 12 * block + 6 * end + 3 * kind))


@ti.func
def start(ni: ti.template(), w: ti.template(), rod):
    """Normalize the quaternions of the initial state."""
    n = ni[Header.NODES]
    for i in range(n - 1):
        k = place(ni, rod, Section.ORIENTATIONS, 4 * i)
        q = load4(w, k)
        store(w, k, q / ti.sqrt(q.dot(q)))


@ti.func
def predict(ni: ti.template(), w: ti.template(), rod, step, slot):
    """Lines 4 to 7: free motion; the manipulated particles follow the actions."""
    n = ni[Header.NODES]
    h = scalar(ni, w, rod, Scalar.STEP_DURATION)
    stored = ti.select(ni[Header.TAPED] > 0, step, 0)
    gravity = load3(w, place(ni, rod, Section.SCALARS, Scalar.GRAVITY_X))
    for i in range(n):
        x = load3(w, place(ni, rod, Section.POSITIONS, 3 * (step * n + i)))
        v = load3(w, place(ni, rod, Section.VELOCITIES, 3 * (step * n + i)))
        store(w, place(ni, rod, Section.POSITIONS, 3 * (slot * n + i)), x + h * (v + h * gravity))
    for i in range(n - 1):
        q = load4(w, place(ni, rod, Section.ORIENTATIONS, 4 * (step * (n - 1) + i)))
        omega = load3(w, place(ni, rod, Section.ANGULAR_VELOCITIES, 3 * (step * (n - 1) + i)))
        p = q + (0.5 * h) * vector_times(omega, q)
        norm = ti.sqrt(p.dot(p))
        store(w, place(ni, rod, Section.ORIENTATIONS, 4 * (slot * (n - 1) + i)), p / norm)
        predicted = place(
            ni, rod, Section.PREDICTED_ORIENTATIONS, PREDICTED_WIDTH * (stored * (n - 1) + i)
        )
        store(w, predicted, p / norm)
        w[predicted + 4] = norm
    for end in range(2):
        hold = ni[Header.LEFT_END + end]
        if hold != EndHold.FREE:
            i = end * (n - 1)
            x = load3(w, place(ni, rod, Section.POSITIONS, 3 * (step * n + i)))
            x += h * action(ni, w, rod, step, end, 0)
            store(w, place(ni, rod, Section.POSITIONS, 3 * (slot * n + i)), x)
            if hold == EndHold.CLAMPED:
                inner = 3 * (slot * n + 1 + end * (n - 3))
                store(w, place(ni, rod, Section.POSITIONS, inner), x)
        if hold == EndHold.CLAMPED:
            i = end * (n - 2)
            q = load4(w, place(ni, rod, Section.ORIENTATIONS, 4 * (step * (n - 1) + i)))
            q = quaternion_product(exponential(h * action(ni, w, rod, step, end, 1)), q)
            store(w, place(ni, rod, Section.ORIENTATIONS, 4 * (slot * (n - 1) + i)), q)


@ti.func
def solve(ni: ti.template(), w: ti.template(), rod, step, slot):
    """Lines 8 to 14: J Gauss-Seidel sweeps over all constraints, in red-black order.

    A sweep along the rod from end to end takes 5 % longer and leaves the same error at rest.
    """
    n = ni[Header.NODES]
    stored = ti.select(ni[Header.TAPED] > 0, step, 0)
    c = step_constants(ni, w, rod)
    for i in range(n - 2):
        zero = ti.Vector([0.0, 0.0, 0.0])
        store(w, place(ni, rod, Section.MULTIPLIERS, 3 * (stored * (n - 2) + i)), zero)
    find_contacts(ni, w, rod, step, slot)
    contacts = ti.cast(w[place(ni, rod, Section.CONTACT_COUNTS, stored)], ti.i32)
    for j in range(ni[Header.ITERATIONS]):
        sweep = ti.select(ni[Header.TAPED] > 0, step * ni[Header.ITERATIONS] + j, 0)
        edges = ni[Header.END_EDGE] - ni[Header.FIRST_EDGE]
        for color in range(2):
            for k in range((edges - color + 1) // 2):
                correct_stretch(ni, w, c, rod, slot, sweep, ni[Header.FIRST_EDGE] + color + 2 * k)
        for color in range(2):
            for k in range((n - 1 - color) // 2):
                correct_bend(ni, w, c, rod, step, slot, sweep, color + 2 * k)
        for k in range(contacts):
            correct_contact(ni, w, c, rod, step, slot, sweep, k)


@ti.func
def update_velocities(ni: ti.template(), w: ti.template(), rod, step, slot):
    """Velocities from the displacements of the step, damped by (1 - xi)^dt."""
    n = ni[Header.NODES]
    h = scalar(ni, w, rod, Scalar.STEP_DURATION)
    keep = ti.pow(1.0 - scalar(ni, w, rod, Scalar.LINEAR_DAMPING), h)
    keep_turn = ti.pow(1.0 - scalar(ni, w, rod, Scalar.ANGULAR_DAMPING), h)
    for i in range(n):
        before = load3(w, place(ni, rod, Section.POSITIONS, 3 * (step * n + i)))
        after = load3(w, place(ni, rod, Section.POSITIONS, 3 * (slot * n + i)))
        v = (keep / h) * (after - before)
        store(w, place(ni, rod, Section.VELOCITIES, 3 * (slot * n + i)), v)
    for i in range(n - 1):
        before = load4(w, place(ni, rod, Section.ORIENTATIONS, 4 * (step * (n - 1) + i)))
        after = load4(w, place(ni, rod, Section.ORIENTATIONS, 4 * (slot * (n - 1) + i)))
        omega = (2.0 * keep_turn / h) * rotation_imaginary(before, after)
        store(w, place(ni, rod, Section.ANGULAR_VELOCITIES, 3 * (slot * (n - 1) + i)), omega)
