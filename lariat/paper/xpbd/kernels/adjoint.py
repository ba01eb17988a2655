"""Adjoint of a step of Algorithm 1: from derivatives in slot step + 1 to those in slot step.

The result of J sweeps depends on their start, so that the implicit function theorem does not
apply: the adjoint goes back through every correction in turn, with the inputs that the tape holds.
"""

from lariat.kernel_cache.language import ti
from lariat.paper.xpbd.kernels.addressing import place, scalar
from lariat.paper.xpbd.kernels.collision import find_contacts_adjoint
from lariat.paper.xpbd.kernels.constraints import (
    correct_bend_adjoint,
    correct_contact_adjoint,
    correct_stretch_adjoint,
    step_constants,
)
from lariat.paper.xpbd.kernels.quaternions import rotation_imaginary, vector_times
from lariat.paper.xpbd.kernels.step import action
from lariat.paper.xpbd.launch.layout import (
    PREDICTED_WIDTH,
    STEP_BLOCKS,
    Header,
    Parameter,
    Scalar,
    Section,
)
from lariat.rod.kernels.memory import add, load3, load4, store
from lariat.rod.kernels.rotations import exponential, left_jacobian, rotation_matrix
from lariat.rod.launch.codes import EndHold


@ti.func
def update_velocities_adjoint(ni: ti.template(), w: ti.template(), rod, step):
    """Carry derivatives from positions and velocities after the step to the end of the sweeps."""
    n = ni[Header.NODES]
    h = scalar(ni, w, rod, Scalar.STEP_DURATION)
    kept = 1.0 - scalar(ni, w, rod, Scalar.LINEAR_DAMPING)
    kept_turn = 1.0 - scalar(ni, w, rod, Scalar.ANGULAR_DAMPING)
    keep, keep_turn = ti.pow(kept, h), ti.pow(kept_turn, h)
    counted = (step + 1) % ni[Header.SUBSTEPS] == 0
    cost_at = place(ni, rod, Section.COST_GRADIENT, 3 * n * (step // ni[Header.SUBSTEPS]))
    d_linear = 0.0
    d_angular = 0.0
    for i in range(n):
        x_at = place(ni, rod, Section.D_POSITIONS, 3 * i)
        d_v = load3(w, place(ni, rod, Section.D_VELOCITIES, 3 * i))
        d_linear += d_v.dot(load3(w, place(ni, rod, Section.VELOCITIES, 3 * ((step + 1) * n + i))))
        d_x = load3(w, x_at) + (keep / h) * d_v
        if counted:
            d_x += load3(w, cost_at + 3 * i)
        store(w, place(ni, rod, Section.D_NODES, 3 * i), d_x)
        store(w, x_at, -(keep / h) * d_v)
    for i in range(n - 1):
        before = load4(w, place(ni, rod, Section.ORIENTATIONS, 4 * (step * (n - 1) + i)))
        after = load4(w, place(ni, rod, Section.ORIENTATIONS, 4 * ((step + 1) * (n - 1) + i)))
        q_at = place(ni, rod, Section.D_ORIENTATIONS, 4 * i)
        omega_at = place(ni, rod, Section.ANGULAR_VELOCITIES, 3 * ((step + 1) * (n - 1) + i))
        d_omega = load3(w, place(ni, rod, Section.D_ANGULAR_VELOCITIES, 3 * i))
        d_angular += d_omega.dot(load3(w, omega_at))
        y = (2.0 * keep_turn / h) * d_omega
        store(w, place(ni, rod, Section.D_EDGES, 4 * i), load4(w, q_at) + vector_times(y, before))
        store(w, q_at, -vector_times(y, after))
    w[place(ni, rod, Section.D_PARAMETERS, Parameter.LINEAR_DAMPING)] -= h / kept * d_linear
    w[place(ni, rod, Section.D_PARAMETERS, Parameter.ANGULAR_DAMPING)] -= h / kept_turn * d_angular


@ti.func
def solve_adjoint(ni: ti.template(), w: ti.template(), rod, step):
    """Carry derivatives back through the sweeps."""
    n = ni[Header.NODES]
    h = scalar(ni, w, rod, Scalar.STEP_DURATION)
    contacts = ti.cast(w[place(ni, rod, Section.CONTACT_COUNTS, step)], ti.i32)
    c = step_constants(ni, w, rod)
    zero = ti.Vector([0.0, 0.0, 0.0])
    for i in range(n - 2):
        store(w, place(ni, rod, Section.D_MULTIPLIERS, 3 * i), zero)
    for k in range(contacts):
        store(w, place(ni, rod, Section.D_NORMALS, 3 * k), zero)
        w[place(ni, rod, Section.D_CONTACT_MULTIPLIERS, k)] = 0.0
    d_mass = 0.0
    d_inertia = 0.0
    d_compliance = 0.0
    for back in range(ni[Header.ITERATIONS]):
        sweep = (step + 1) * ni[Header.ITERATIONS] - 1 - back
        for last in range(contacts):
            d_mass += correct_contact_adjoint(ni, w, c, rod, step, sweep, contacts - 1 - last)
        for last in range(2):
            color = 1 - last
            count = (n - 1 - color) // 2
            for k in range(count):
                i = color + 2 * (count - 1 - k)
                inertia, compliance = correct_bend_adjoint(ni, w, c, rod, step, sweep, i)
                d_inertia += inertia
                d_compliance += compliance
        for last in range(2):
            color = 1 - last
            count = (ni[Header.END_EDGE] - ni[Header.FIRST_EDGE] - color + 1) // 2
            for k in range(count):
                i = ni[Header.FIRST_EDGE] + color + 2 * (count - 1 - k)
                mass, inertia = correct_stretch_adjoint(ni, w, c, rod, sweep, i)
                d_mass += mass
                d_inertia += inertia
    # Weights are inverse masses and inverse inertias.
    mass_weight = scalar(ni, w, rod, Scalar.INVERSE_MASS)
    inertia_weight = scalar(ni, w, rod, Scalar.INVERSE_INERTIA)
    w[place(ni, rod, Section.D_PARAMETERS, Parameter.MASS)] -= mass_weight * mass_weight * d_mass
    w[place(ni, rod, Section.D_PARAMETERS, Parameter.INERTIA)] -= inertia_weight**2 * d_inertia
    w[place(ni, rod, Section.D_PARAMETERS, Parameter.BENDING_COMPLIANCE)] += d_compliance / (h * h)
    find_contacts_adjoint(ni, w, rod, step, contacts)


@ti.func
def predict_adjoint(ni: ti.template(), w: ti.template(), rod, step):
    """Carry derivatives from the start of the sweeps to the state before and the actions."""
    n = ni[Header.NODES]
    h = scalar(ni, w, rod, Scalar.STEP_DURATION)
    block = ni[STEP_BLOCKS + step // ni[Header.SUBSTEPS]]
    zero = ti.Vector([0.0, 0.0, 0.0])
    for i in range(n):
        d_x = zero
        if i >= ni[Header.FIRST_NODE] and i < ni[Header.END_NODE]:
            d_x = load3(w, place(ni, rod, Section.D_NODES, 3 * i))
        add(w, place(ni, rod, Section.D_POSITIONS, 3 * i), d_x)
        store(w, place(ni, rod, Section.D_VELOCITIES, 3 * i), h * d_x)
    for i in range(n - 1):
        if i >= ni[Header.FIRST_EDGE] and i < ni[Header.END_EDGE]:
            kept = place(
                ni, rod, Section.PREDICTED_ORIENTATIONS, PREDICTED_WIDTH * (step * (n - 1) + i)
            )
            unit, norm = load4(w, kept), w[kept + 4]
            d_q = load4(w, place(ni, rod, Section.D_EDGES, 4 * i))
            p = (d_q - unit.dot(d_q) * unit) / norm
            before = load4(w, place(ni, rod, Section.ORIENTATIONS, 4 * (step * (n - 1) + i)))
            omega = load3(w, place(ni, rod, Section.ANGULAR_VELOCITIES, 3 * (step * (n - 1) + i)))
            add(
                w,
                place(ni, rod, Section.D_ORIENTATIONS, 4 * i),
                p - (0.5 * h) * vector_times(omega, p),
            )
            turn = (0.5 * h) * rotation_imaginary(before, p)
            store(w, place(ni, rod, Section.D_ANGULAR_VELOCITIES, 3 * i), turn)
    for end in range(2):
        hold = ni[Header.LEFT_END + end]
        actions = place(ni, rod, Section.D_ACTIONS, 12 * block + 6 * end)
        i = end * (n - 1)
        if hold != EndHold.FREE:
            d_x = load3(w, place(ni, rod, Section.D_NODES, 3 * i))
            if hold == EndHold.CLAMPED:
                grip = place(ni, rod, Section.D_GRIPS, 3 * end)
                edge = end * (n - 2)
                q_at = place(ni, rod, Section.ORIENTATIONS, 4 * ((step + 1) * (n - 1) + edge))
                q = load4(w, q_at)
                d_x += load3(w, place(ni, rod, Section.D_NODES, 3 * (1 + end * (n - 3))))
                d_q = load4(w, place(ni, rod, Section.D_EDGES, 4 * edge))
                turn = load3(w, grip) + 0.5 * rotation_imaginary(q, d_q)
                y = h * action(ni, w, rod, step, end, 1)
                add(w, actions + 3, h * (left_jacobian(y).transpose() @ turn))
                store(w, grip, rotation_matrix(exponential(y)).transpose() @ turn)
            add(w, place(ni, rod, Section.D_POSITIONS, 3 * i), d_x)
            add(w, actions, h * d_x)
