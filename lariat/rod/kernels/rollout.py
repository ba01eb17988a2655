"""The one kernel of the implicit rod: roll-outs, their derivatives, and statics as a roll-out.

One implicit step is the minimiser of the rod's incremental energy, by Newton's method. The energy
of a solve over a time h is, with x1, x0 and so on the solves before it,

    sum over nodes    m wt |x - y|^2 / 2 - m g x
    sum over edges    l K |e / l - d3|^2 / 2                                    (eq. 4)
                      + wt J |2 Im(conj(q^) q)|^2 / 2
    sum over bends    (k1, k2, k3) |y - rest|^2 / 2, y = log(conj(q_i) q_i+1)     (eq. 7)
                      + tau / h (k1, k2, k3) |y - y1|^2 / 2
    contact           l p(distance - radius), at evenly spaced samples of every edge
    touches           l p(distance - diameter) / 2, between points of edges that are no neighbours

with wt = (1 + c h) / h^2 and carry = 1 / (1 + c h): the damping c only rescales inertia. y is where
inertia alone would lead, and q^ the same for orientations, in the chart of the last one. For
implicit Euler y = x1 + carry (x1 - x0). For the second-order scheme a step is two such solves, of
h = gamma dt each with gamma = 1 - 1 / sqrt(2) (Alexander 1977, SDIRK2): the second starts from
base = x0 + r (x1 - x0), with r = (1 - gamma) / gamma and velocity likewise. Either way y is a sum
of the last positions, with shares that `layout` calls BASE and MOMENTUM. tau is the internal
damping, y1 the bends' y at the base. Shear is as stiff as stretch, as in the paper, whose
curvature 2 Im(conj(q) q) is replaced by the logarithm, so that torque stays proportional to twist.

Stretch is far stiffer than all else and makes plain Newton crawl. Its force is therefore a
variable of its own (mixed Newton): the geometric part of the Hessian takes the force that the
last linear solve predicted, and the number of iterations does not depend on the stiffness.

Why the code is cut as it is. A launch costs as much as several steps, so that one does a whole
horizon. Taichi's compile time grows faster than the size of what it compiles, so that the large
parts are real functions, compiled once each. Taichi 1.7 has two faults with these. Functions that
are inlined into them lose their branches and loops: what is inlined has none (`ti.select`). And
the key of the offline cache depends on chance as soon as one body names two real functions: hence
every part names only the part below it, does the tasks that are its own and passes on the others.
"""

import taichi as ti

from lariat.rod.kernels.access import orientation_at, position_at, scalar, time_at
from lariat.rod.kernels.rotations import (
    add3,
    exponential,
    load3,
    load4,
    logarithm,
    quaternion_product,
    relative,
    rotation_matrix,
    store3,
    store4,
)
from lariat.rod.kernels.sensitivities import columns_at
from lariat.rod.kernels.sensitivities import sensitivities as work
from lariat.rod.kernels.types import Doubles, Integers
from lariat.rod.launch.codes import Derivatives, EndHold, Task
from lariat.rod.launch.layout import HISTORY_SLOTS, REPORT_WIDTH, Header, Scalar, Section, TimeRow


@ti.kernel
def roll(ni: Integers, w: Doubles, batch: ti.i32):
    """Roll every rod of a batch out, with what is wanted of its derivatives; see `layout`."""
    ti.loop_config(serialize=True)
    for b in range(batch):
        rod = b * ni[Header.STRIDE]
        begin(ni, w, rod)
        advance(ni, w, rod)
        finish(ni, w, rod)


@ti.func
def begin(ni: ti.template(), w: ti.template(), rod):
    """The slot of the start holds a state, the one before it velocities: make these history."""
    n = ni[Header.NODES]
    last = HISTORY_SLOTS - 1
    h = w[time_at(ni, rod, 0)]
    for i in range(n - 1):
        q = load4(w, orientation_at(ni, rod, last, i))
        q = q / ti.sqrt(q.dot(q))
        store4(w, orientation_at(ni, rod, last, i), q)
        omega = load3(w, orientation_at(ni, rod, last - 1, i))
        before = quaternion_product(exponential(-h * omega), q)
        for slot in range(last):
            store4(w, orientation_at(ni, rod, slot, i), before)
    for end in range(2):
        if ni[Header.LEFT_END + end] == EndHold.CLAMPED:
            r = rotation_matrix(load4(w, orientation_at(ni, rod, last, end * (n - 2))))
            reach = scalar(ni, w, rod, Scalar.EDGE_LENGTH) * (1.0 - 2.0 * end)
            outer = load3(w, position_at(ni, rod, last, end * (n - 1)))
            inner = outer + reach * (r @ ti.Vector([0.0, 0.0, 1.0]))
            store3(w, position_at(ni, rod, last, 1 + end * (n - 3)), inner)
    for i in range(n):
        x = load3(w, position_at(ni, rod, last, i))
        v = load3(w, position_at(ni, rod, last - 1, i))
        for slot in range(last):
            store3(w, position_at(ni, rod, slot, i), x - h * v)


@ti.func
def finish(ni: ti.template(), w: ti.template(), rod):
    """Leave the last velocities in the targets' and tensions' sections."""
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
        store3(w, rod + ni[Section.TARGET_POSITIONS] + 3 * i, (x - nearer * x1 - further * x0) / h)
    for i in range(n - 1):
        q = load4(w, orientation_at(ni, rod, last, i))
        q1 = load4(w, orientation_at(ni, rod, last - 1, i))
        q0 = load4(w, orientation_at(ni, rod, last - 2, i))
        base = quaternion_product(q1, exponential(further * logarithm(relative(q1, q0))))
        turn = quaternion_product(q, ti.Vector([base[0], -base[1], -base[2], -base[3]]))
        turn = ti.select(turn[0] < 0.0, -1.0, 1.0) * turn
        store3(w, rod + ni[Section.TENSIONS] + 3 * i, logarithm(turn) / h)


@ti.func
def advance(ni: ti.template(), w: ti.template(), rod):
    """Solve every step from the last one's end, with its report; carry derivatives on and back.

    First plain Newton steps: the fastest, and nearly always enough. Where these run astray, it
    starts again from the last step's end, with line search on the energy and definite Hessians.

    It is written as what to do next after each task, with one call for all of them: every call
    that names the parts makes Taichi look through all of these, for each of its own statements.
    """
    n = ni[Header.NODES]
    first = ni[Header.FIRST_FREE]
    end = ni[Header.END_FREE]
    length = scalar(ni, w, rod, Scalar.EDGE_LENGTH)
    tolerance = scalar(ni, w, rod, Scalar.TOLERANCE)
    sensed = ni[Header.DERIVATIVES] % Derivatives.ADJOINT
    asked = ti.cast(ni[Header.PARAMETERS] > 0 and ni[Header.OBSTACLES] > 0, ti.i32)
    slope = rod + ni[Section.ADJOINT]
    step = 0
    backward = 0
    d = rod + ni[Section.NEWTON_STEP]
    # Longer strides than this could jump over an obstacle. The shortest of edges set no limit: a
    # rod is as fast with many nodes as with few.
    reach = 2.0 * length
    if ni[Header.OBSTACLES] > 0:
        thickness = scalar(ni, w, rod, Scalar.CONTACT_REACH) - scalar(
            ni, w, rod, Scalar.CONTACT_MARGIN
        )
        reach = ti.max(ti.min(reach, 4.0 * thickness), thickness)
    touching = ni[Header.MAX_SELF_CONTACTS] > 0
    if touching:
        # Nor over another strand.
        reach = ti.min(reach, scalar(ni, w, rod, Scalar.CONTACT_REACH))
    column = 0
    iterations = 0
    strides = 0
    attempts = 0
    exact = 1
    shift = 0.0
    share = 1.0
    energy = 0.0
    lowest = 1e300
    careful = 0
    finishing = 0
    converged = 0
    definite = 1
    largest = 0.0
    left = 0.0
    moved_grips = 0
    stepped = 0
    task = Task.INERTIAL_TARGETS
    while task != Task.DONE:
        arg = exact
        real = shift
        if finishing == 2:
            # Derivatives want the forces of contact alone.
            arg = 2
        if task == Task.APPLY_STEP:
            real = share
        elif task == Task.MOVE_GRIPS:
            arg = moved_grips
        elif task == Task.PREDICT:
            arg = 1 - careful
        elif task == Task.SUBTRACT_COUPLINGS or task == Task.SOLVE:
            arg = d
            if backward == 1:
                arg = slope
        elif task == Task.SUBTRACT_SELF_CONTACT_COUPLINGS or task == Task.SOLVE_AGAIN:
            arg = columns_at(ni, rod, step, column // 6)[0] + column % 6
            real = 6.0
        elif task == Task.SOLVE_EXACTLY or task == Task.FOLD_SELF_CONTACTS:
            arg = slope
            real = 1.0
            if backward == 0:
                arg = columns_at(ni, rod, step, 0)[0]
                real = 6.0
        value = work(ni, w, task, rod, step, arg, real)
        judge = 0
        if finishing == 2:
            if task == Task.INERTIAL_TARGETS:
                task = Task.INERTIA_DERIVATIVES
            elif task == Task.INERTIA_DERIVATIVES:
                forces = ti.select(touching, Task.SELF_CONTACT, Task.PARAMETER_DERIVATIVES)
                task = ti.select(asked, Task.OBSTACLE_CONTACT, forces)
            elif task == Task.OBSTACLE_CONTACT:
                task = ti.select(touching, Task.SELF_CONTACT, Task.PARAMETER_DERIVATIVES)
            elif task == Task.SELF_CONTACT:
                task = Task.PARAMETER_DERIVATIVES
            elif task == Task.PARAMETER_DERIVATIVES:
                solving = ti.select(touching, Task.SOLVE_EXACTLY, Task.SOLVE)
                task = ti.select(backward, solving, Task.GRIP_SENSITIVITIES)
            elif task == Task.GRIP_SENSITIVITIES:
                task = Task.SENSITIVITIES
            elif task == Task.SENSITIVITIES:
                column = 0
                task = ti.select(
                    touching, Task.SUBTRACT_SELF_CONTACT_COUPLINGS, Task.WRITE_SENSITIVITIES
                )
            elif task == Task.SUBTRACT_SELF_CONTACT_COUPLINGS:
                # The first column makes what the others use.
                task = ti.select(column == 0, Task.SOLVE_EXACTLY, Task.SOLVE_AGAIN)
            elif task == Task.SOLVE_AGAIN or task == Task.SOLVE_EXACTLY:
                if value > 0.0:
                    w[rod + ni[Section.REPORTS] + REPORT_WIDTH * step + 1] = 0.0
                column += 1
                task = Task.SUBTRACT_SELF_CONTACT_COUPLINGS
                if backward == 1:
                    task = Task.FOLD_SELF_CONTACTS
                elif column == 6 * columns_at(ni, rod, step, 0)[1]:
                    task = Task.WRITE_SENSITIVITIES
            elif task == Task.SOLVE or task == Task.FOLD_SELF_CONTACTS:
                task = Task.ADJOINT
            elif task == Task.ADJOINT:
                task = Task.GRIP_ADJOINT
            elif task == Task.GRIP_ADJOINT:
                step -= 1
                task = Task.SOLVED
            else:
                finishing = 3
                task = Task.SOLVED
        elif task == Task.INERTIAL_TARGETS:
            task = Task.PREDICT
        elif task == Task.PREDICT:
            task = Task.EDGE_ENERGY
            if careful == 1:
                moved_grips = 1
                task = Task.MOVE_GRIPS
            stepped = 0
        elif task == Task.EDGE_ENERGY:
            energy = value
            task = Task.BEND_ENERGY
        elif task == Task.BEND_ENERGY:
            energy += value
            task = Task.OBSTACLE_CONTACT
        elif task == Task.OBSTACLE_CONTACT and touching:
            energy += value
            task = Task.SELF_CONTACT
        elif task == Task.OBSTACLE_CONTACT or task == Task.SELF_CONTACT:
            energy += value
            attempts += 1
            task = Task.FACTORIZE
            if careful == 1 and finishing == 0 and not (energy <= lowest + 1e-13 * ti.abs(lowest)):
                share *= 0.5
                stepped = 0
                task = Task.APPLY_STEP
                if share < 1e-6:
                    # No descent left above rounding: this is as far as it goes.
                    share = 0.0
                    converged = ti.cast(largest < 100.0 * tolerance, ti.i32)
                    finishing = 1
                    exact = 1
                    shift = 0.0
        elif task == Task.FACTORIZE:
            definite = ti.cast(value, ti.i32)
            task = Task.ACCEPT_ITERATE
            if careful == 1:
                lowest = ti.min(lowest, energy)
            if finishing == 1:
                task = Task.SOLVED
            elif definite == 0:
                if exact == 0:
                    shift = ti.max(10.0 * shift, 1e-9)
                exact = 0
                judge = 1
                task = Task.EDGE_ENERGY
        elif task == Task.ACCEPT_ITERATE:
            task = Task.SOLVE
            if iterations == 0:
                moved_grips = 0
                task = Task.MOVE_GRIPS
        elif task == Task.MOVE_GRIPS and moved_grips == 0:
            task = Task.SUBTRACT_COUPLINGS
        elif task == Task.SUBTRACT_COUPLINGS:
            task = Task.SOLVE
        elif task == Task.SOLVE:
            moved = 0.0
            rotated = 0.0
            driven = 0.0
            for j in range(2 * n - 1):
                size = load3(w, d + 3 * j).norm()
                if j % 2 == 1:
                    rotated = ti.max(rotated, size)
                else:
                    moved = ti.max(moved, size)
                    if j < first or j >= end:
                        driven = ti.max(driven, size)
            # Newton's next step shrinks by the square of the last two's ratio: the ratio alone,
            # with a hundredfold margin, leaves errors that differences of roll-outs do not notice.
            # Derivatives want the factors of where it ends.
            size = ti.max(moved, length * rotated)
            left = size
            if ni[Header.DERIVATIVES] == 0 and iterations > 0 and share == 1.0:
                ratio = size / (largest + 1e-300)
                left = ti.min(1.0, 100.0 * ratio) * size
            largest = size
            share = 1.0
            near = ni[Header.OBSTACLES] > 0 or touching
            if iterations > 0 or (near and moved > 4.0 * reach + 2.0 * driven):
                share = ti.min(share, ti.min(reach / (moved + 1e-30), 0.8 / (rotated + 1e-30)))
            if iterations == 0 or share == 1.0:
                strides += 1
            stepped = 1
            task = Task.APPLY_STEP
        elif task == Task.APPLY_STEP:
            task = Task.EDGE_ENERGY
            if stepped == 1 and iterations == 0:
                moved_grips = 1
                task = Task.MOVE_GRIPS
            elif stepped == 1:
                judge = 1
        else:
            # Grips are where they belong.
            task = Task.EDGE_ENERGY
            judge = stepped
        if judge == 1:
            if stepped == 1:
                stepped = 0
                if iterations > 0 and left < tolerance and share == 1.0:
                    converged = 1
                    if touching:
                        # Touches without a place are not pushed apart.
                        lost = w[rod + ni[Section.SELF_CONTACTS] + 1]
                        converged = ti.cast(lost == 0.0, ti.i32)
                    # Derivatives want the true Hessian.
                    finishing = ti.cast(exact == 0 or shift > 0.0, ti.i32)
                    if finishing == 0:
                        task = Task.SOLVED
                iterations += 1
                exact = 1
                shift = 0.0
            if task != Task.SOLVED and finishing == 0:
                if careful == 0 and (strides >= 14 or attempts >= 100 or not (largest < 1e6)):
                    careful = 1
                    iterations = 1
                    exact = 1
                    shift = 0.0
                    task = Task.PREDICT
                elif attempts >= ni[Header.MAX_ITERATIONS]:
                    task = Task.SOLVED
        if task == Task.SOLVED:
            if finishing < 2:
                report = rod + ni[Section.REPORTS] + REPORT_WIDTH * step
                w[report] = attempts
                w[report + 1] = converged
                w[report + 2] = largest
                w[report + 3] = definite
            if finishing < 2 and sensed == 1:
                finishing = 2
                task = Task.INERTIA_DERIVATIVES
            elif backward == 0:
                step += 1
                iterations = 0
                strides = 0
                attempts = 0
                exact = 1
                shift = 0.0
                share = 1.0
                lowest = 1e300
                careful = 0
                finishing = 0
                converged = 0
                largest = 0.0
                moved_grips = 0
                stepped = 0
                task = Task.INERTIAL_TARGETS
                if step == ni[Header.STEPS]:
                    task = Task.DONE
                    if ni[Header.DERIVATIVES] >= Derivatives.ADJOINT:
                        backward = 1
                        finishing = 2
                        step -= 1
            if backward == 1:
                task = Task.DONE
                if step >= 0:
                    task = Task.INERTIAL_TARGETS
                    slope = rod + ni[Section.ADJOINT] + 3 * (2 * n - 1) * (step + HISTORY_SLOTS)
                    if (step + 1) % ni[Header.SUBSTEPS] == 0:
                        cost = (
                            rod + ni[Section.COST_GRADIENT] + 3 * n * (step // ni[Header.SUBSTEPS])
                        )
                        for i in range(n):
                            add3(w, slope + 6 * i, load3(w, cost + 3 * i))
