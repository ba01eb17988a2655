# type: ignore
"""The three kernels of the implicit rod: roll-outs, their derivatives, and statics as a roll-out.

One implicit step is the minimiser of the rod's incremental energy, by Newton's method. The energy
of a step of length h from (x1, q1) with the step before that at (x0, q0) is

    sum over nodes    m wt |x - y|^2 / 2 - m g x
    sum over edges    l K |e / l - d3|^2 / 2                                    (eq. 4)
                      + wt J |2 Im(conj(q^) q)|^2 / 2
    sum over bends    (k1, k2, k3) |log(conj(q_i) q_i+1) - rest|^2 / 2           (eq. 7)
    contact           l p(distance - radius), at evenly spaced samples of every edge

with wt = (1 + c h) / h^2, y = x1 + carry (x1 - x0) and q^ likewise, carry = 1 / (1 + c h): the
damping c only rescales inertia. Shear is as stiff as stretch, as in the paper, whose curvature
2 Im(conj(q) q) is replaced by the logarithm, so that torque stays proportional to twist.

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
            sensitivities(ni, w, at.INERTIA, rod, step, 0, 0.0)
            sensitivities(ni, w, at.PARAMETER_FORCES, rod, step, 0, 0.0)
            sensitivities(ni, w, at.GRIP_SENSITIVITIES, rod, step, 0, 0.0)
            sensitivities(ni, w, at.SENSITIVITIES, rod, step, 0, 0.0)


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
    """
    n = ni[at.NODES]
    count = 2 * n - 1
    first = ni[at.FIRST_FREE]
    end = ni[at.END_FREE]
    length = scalar(ni, w, rod, at.EDGE_LENGTH)
    tolerance = scalar(ni, w, rod, at.TOLERANCE)
    d = rod + ni[at.AT_STEP]
    g = rod + ni[at.AT_GRADIENT]
    work(ni, w, at.PREDICT, rod, step, 0, 0.0)
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
    lowest = 1e300
    careful = 0
    finishing = 0
    converged = 0
    definite = 1
    largest = 0.0
    running = 1
    while running == 1:
        energy = work(ni, w, at.EDGES, rod, step, exact, shift)
        energy += work(ni, w, at.BENDS, rod, step, exact, 0.0)
        energy += work(ni, w, at.CONTACTS, rod, step, exact, 0.0)
        attempts += 1
        if careful == 1 and finishing == 0 and not (energy <= lowest + 1e-13 * ti.abs(lowest)):
            share *= 0.5
            if share < 1e-6:
                # No descent left above rounding: this is as far as it goes.
                work(ni, w, at.APPLY, rod, step, 0, 0.0)
                if largest < 100.0 * tolerance:
                    converged = 1
                finishing = 1
                exact = 1
                shift = 0.0
            else:
                work(ni, w, at.APPLY, rod, step, 0, share)
        else:
            definite = ti.cast(work(ni, w, at.FACTOR, rod, step, 0, 0.0), ti.i32)
            if finishing == 1:
                running = 0
            elif definite == 0 and exact == 1:
                exact = 0
                if careful == 1:
                    lowest = energy
            elif definite == 0:
                shift = ti.max(10.0 * shift, 1e-9)
            else:
                if careful == 1:
                    lowest = energy
                work(ni, w, at.ACCEPT, rod, step, 0, 0.0)
                for j in range(count):
                    fixed = j < first or j >= end
                    for a in ti.static(range(3)):
                        w[d + 3 * j + a] = 0.0 if fixed else -w[g + 3 * j + a]
                if iterations == 0:
                    work(ni, w, at.GRIPS, rod, step, 0, 0.0)
                    work(ni, w, at.COUPLE, rod, step, d, 0.0)
                work(ni, w, at.SOLVE, rod, step, d, 0.0)
                moved = 0.0
                rotated = 0.0
                driven = 0.0
                for i in range(n):
                    moved = ti.max(moved, load3(w, d + 6 * i).norm())
                    if 2 * i < first or 2 * i >= end:
                        driven = ti.max(driven, load3(w, d + 6 * i).norm())
                    if i < n - 1:
                        rotated = ti.max(rotated, load3(w, d + 6 * i + 3).norm())
                largest = ti.max(moved, length * rotated)
                share = 1.0
                if iterations > 0 or (ni[at.OBSTACLES] > 0 and moved > 4.0 * reach + 2.0 * driven):
                    share = ti.min(1.0, ti.min(reach / (moved + 1e-30), 0.8 / (rotated + 1e-30)))
                if iterations == 0 or share == 1.0:
                    strides += 1
                work(ni, w, at.APPLY, rod, step, 0, share)
                if iterations == 0:
                    work(ni, w, at.GRIPS, rod, step, 1, 0.0)
                if iterations > 0 and largest < tolerance:
                    converged = 1
                    running = 0
                    if exact == 0 or shift > 0.0:
                        # Derivatives want the true Hessian.
                        running = 1
                        finishing = 1
                iterations += 1
                exact = 1
                shift = 0.0
        if running == 1 and finishing == 0:
            astray = careful == 0 and (strides >= 14 or attempts >= 100 or not (largest < 1e6))
            if astray:
                careful = 1
                work(ni, w, at.PREDICT, rod, step, 0, 0.0)
                work(ni, w, at.GRIPS, rod, step, 1, 0.0)
                iterations = 1
                exact = 1
                shift = 0.0
            elif attempts >= ni[at.MAX_ITERATIONS]:
                running = 0
    report = rod + ni[at.AT_REPORT] + at.REPORT_WIDTH * step
    w[report] = attempts
    w[report + 1] = converged
    w[report + 2] = largest
    w[report + 3] = definite
