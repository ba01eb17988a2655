# type: ignore
"""The three kernels of the implicit rod: roll-outs, their derivatives, and statics as a roll-out.

One implicit step is the minimiser of the rod's incremental energy, by Newton's method. The energy
of a step of length h from (x1, q1) with the step before that at (x0, q0) is

    sum over nodes    m wt |x - y|^2 / 2 - m g x
    sum over edges    l K |e / l - d3|^2 / 2                                    (eq. 4)
                      + wt J |2 Im(conj(q^) q)|^2 / 2
    sum over bends    (k1, k2, k3) |y - rest|^2 / 2, y = log(conj(q_i) q_i+1)     (eq. 7)
                      + tau / h (k1, k2, k3) |y - y1|^2 / 2
    contact           l p(distance - radius), at evenly spaced samples of every edge

with wt = (1 + c h) / h^2, y = x1 + carry (x1 - x0) and q^ likewise, carry = 1 / (1 + c h): the
damping c only rescales inertia. tau is the internal damping, y1 the last step's y. Shear is as
stiff as stretch, as in the paper, whose curvature 2 Im(conj(q) q) is replaced by the logarithm,
so that torque stays proportional to twist.

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

from shared.rod import layout as at
from shared.rod.kernels_access import orientation_at, position_at, scalar
from shared.rod.kernels_adjoint import adjoint
from shared.rod.kernels_math import (
    add3,
    exponential,
    load3,
    load4,
    logarithm,
    quaternion_product,
    rotation_matrix,
    store3,
    store4,
)
from shared.rod.kernels_moves import subtract_couplings as work
from shared.rod.kernels_sensitivities import sensitivities
from shared.rod.kernels_types import Doubles, Integers


@ti.kernel
def roll(ni: Integers, w: Doubles, batch: ti.i32):
    """Roll every rod of a batch out; see `layout` for what the arrays hold."""
    for b in range(batch):
        rod = b * ni[at.STRIDE]
        begin(ni, w, rod)
        for step in range(ni[at.STEPS]):
            descend(ni, w, rod, step)
        finish(ni, w, rod)


@ti.kernel
def carry_forward(ni: Integers, w: Doubles, batch: ti.i32):
    """Forward sensitivities of every rod along the roll-out that `roll` left behind."""
    for b in range(batch):
        rod = b * ni[at.STRIDE]
        for step in range(ni[at.STEPS]):
            for task in range(at.INERTIA, at.SENSITIVITIES + 1):
                sensitivities(ni, w, task, rod, step, 0, 0.0)


@ti.kernel
def carry_back(ni: Integers, w: Doubles, batch: ti.i32):
    """The adjoint of every rod along the roll-out that `roll` left behind."""
    for b in range(batch):
        rod = b * ni[at.STRIDE]
        for back in range(ni[at.STEPS]):
            step = ni[at.STEPS] - 1 - back
            slope = rod + ni[at.AT_ADJOINT] + 3 * (2 * ni[at.NODES] - 1) * (step + 2)
            if (step + 1) % ni[at.SUBSTEPS] == 0:
                cost = rod + ni[at.AT_COST]
                cost += 3 * ni[at.NODES] * (step // ni[at.SUBSTEPS])
                for i in range(ni[at.NODES]):
                    add3(w, slope + 6 * i, load3(w, cost + 3 * i))
            adjoint(ni, w, at.INERTIA, rod, step, 0, 0.0)
            adjoint(ni, w, at.PARAMETER_FORCES, rod, step, 0, 0.0)
            adjoint(ni, w, at.SOLVE, rod, step, slope, 0.0)
            adjoint(ni, w, at.ADJOINT, rod, step, 0, 0.0)
            adjoint(ni, w, at.GRIP_ADJOINT, rod, step, 0, 0.0)


@ti.func
def begin(ni: ti.template(), w: ti.template(), rod):
    """Slot 1 holds a state, slot 0 its velocities: turn these into the history that they mean."""
    n = ni[at.NODES]
    h = w[rod + ni[at.AT_TIMES]]
    for i in range(n - 1):
        q = load4(w, orientation_at(ni, rod, 1, i))
        q = q / ti.sqrt(q.dot(q))
        store4(w, orientation_at(ni, rod, 1, i), q)
        omega = load3(w, orientation_at(ni, rod, 0, i))
        store4(w, orientation_at(ni, rod, 0, i), quaternion_product(exponential(-h * omega), q))
    for end in range(2):
        if ni[at.LEFT + end] == at.CLAMPED:
            r = rotation_matrix(load4(w, orientation_at(ni, rod, 1, end * (n - 2))))
            reach = scalar(ni, w, rod, at.EDGE_LENGTH) * (1.0 - 2.0 * end)
            outer = load3(w, position_at(ni, rod, 1, end * (n - 1)))
            inner = outer + reach * (r @ ti.Vector([0.0, 0.0, 1.0]))
            store3(w, position_at(ni, rod, 1, 1 + end * (n - 3)), inner)
    for i in range(n):
        x = load3(w, position_at(ni, rod, 1, i))
        v = load3(w, position_at(ni, rod, 0, i))
        store3(w, position_at(ni, rod, 0, i), x - h * v)


@ti.func
def finish(ni: ti.template(), w: ti.template(), rod):
    """Leave the last velocities in the targets' and tensions' sections."""
    n = ni[at.NODES]
    last = ni[at.STEPS] + 1
    h = w[rod + ni[at.AT_TIMES] + 2 * (ni[at.STEPS] - 1)]
    for i in range(n):
        x = load3(w, position_at(ni, rod, last, i))
        x1 = load3(w, position_at(ni, rod, last - 1, i))
        store3(w, rod + ni[at.AT_TARGETS] + 3 * i, (x - x1) / h)
    for i in range(n - 1):
        q = load4(w, orientation_at(ni, rod, last, i))
        q1 = load4(w, orientation_at(ni, rod, last - 1, i))
        turn = quaternion_product(q, ti.Vector([q1[0], -q1[1], -q1[2], -q1[3]]))
        if turn[0] < 0.0:
            turn = -turn
        store3(w, rod + ni[at.AT_TENSIONS] + 3 * i, logarithm(turn) / h)


@ti.func
def descend(ni: ti.template(), w: ti.template(), rod, step):
    """Solve one step, from the last one's end; writes the report of the step.

    First plain Newton steps: the fastest, and nearly always enough. Where these run astray, it
    starts again from the last step's end, with line search on the energy and definite Hessians.

    It is written as what to do next after each task, with one call for all of them: every call
    that names the parts makes Taichi look through all of these, for each of its own statements.
    """
    n = ni[at.NODES]
    first = ni[at.FIRST_FREE]
    end = ni[at.END_FREE]
    length = scalar(ni, w, rod, at.EDGE_LENGTH)
    tolerance = scalar(ni, w, rod, at.TOLERANCE)
    d = rod + ni[at.AT_STEP]
    # Longer strides than this could jump over an obstacle.
    reach = 2.0 * length
    if ni[at.OBSTACLES] > 0:
        thickness = scalar(ni, w, rod, at.CONTACT_REACH) - scalar(ni, w, rod, at.CONTACT_MARGIN)
        reach = ti.min(reach, 4.0 * thickness)
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
    moved_grips = 0
    stepped = 0
    task = at.PREDICT
    while task != at.DONE:
        arg = exact
        real = shift
        if task == at.APPLY:
            real = share
        elif task == at.GRIPS:
            arg = moved_grips
        elif task == at.COUPLE or task == at.SOLVE:
            arg = d
        value = work(ni, w, task, rod, step, arg, real)
        judge = 0
        if task == at.PREDICT:
            task = at.EDGES
            if careful == 1:
                moved_grips = 1
                task = at.GRIPS
            stepped = 0
        elif task == at.EDGES:
            energy = value
            task = at.BENDS
        elif task == at.BENDS:
            energy += value
            task = at.CONTACTS
        elif task == at.CONTACTS:
            energy += value
            attempts += 1
            task = at.FACTOR
            if careful == 1 and finishing == 0 and not (energy <= lowest + 1e-13 * ti.abs(lowest)):
                share *= 0.5
                stepped = 0
                task = at.APPLY
                if share < 1e-6:
                    # No descent left above rounding: this is as far as it goes.
                    share = 0.0
                    converged = ti.cast(largest < 100.0 * tolerance, ti.i32)
                    finishing = 1
                    exact = 1
                    shift = 0.0
        elif task == at.FACTOR:
            definite = ti.cast(value, ti.i32)
            task = at.ACCEPT
            if careful == 1:
                lowest = ti.min(lowest, energy)
            if finishing == 1:
                task = at.DONE
            elif definite == 0:
                if exact == 0:
                    shift = ti.max(10.0 * shift, 1e-9)
                exact = 0
                judge = 1
                task = at.EDGES
        elif task == at.ACCEPT:
            task = at.SOLVE
            if iterations == 0:
                moved_grips = 0
                task = at.GRIPS
        elif task == at.GRIPS and moved_grips == 0:
            task = at.COUPLE
        elif task == at.COUPLE:
            task = at.SOLVE
        elif task == at.SOLVE:
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
            largest = ti.max(moved, length * rotated)
            share = 1.0
            if iterations > 0 or (ni[at.OBSTACLES] > 0 and moved > 4.0 * reach + 2.0 * driven):
                share = ti.min(share, ti.min(reach / (moved + 1e-30), 0.8 / (rotated + 1e-30)))
            if iterations == 0 or share == 1.0:
                strides += 1
            stepped = 1
            task = at.APPLY
        elif task == at.APPLY:
            task = at.EDGES
            if stepped == 1 and iterations == 0:
                moved_grips = 1
                task = at.GRIPS
            elif stepped == 1:
                judge = 1
        else:
            # Grips are where they belong.
            task = at.EDGES
            judge = stepped
        if judge == 1:
            if stepped == 1:
                stepped = 0
                if iterations > 0 and largest < tolerance:
                    converged = 1
                    # Derivatives want the true Hessian.
                    finishing = ti.cast(exact == 0 or shift > 0.0, ti.i32)
                    if finishing == 0:
                        task = at.DONE
                iterations += 1
                exact = 1
                shift = 0.0
            if task != at.DONE and finishing == 0:
                if careful == 0 and (strides >= 14 or attempts >= 100 or not (largest < 1e6)):
                    careful = 1
                    iterations = 1
                    exact = 1
                    shift = 0.0
                    task = at.PREDICT
                elif attempts >= ni[at.MAX_ITERATIONS]:
                    task = at.DONE
    report = rod + ni[at.AT_REPORT] + at.REPORT_WIDTH * step
    w[report] = attempts
    w[report + 1] = converged
    w[report + 2] = largest
    w[report + 3] = definite
